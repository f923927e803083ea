"""Hydrostatic column: see README.md beside this file."""
from pysph_boiling.analysis.plots import BLUE, ORANGE
from pysph_boiling.problems.hydrostatic import HydrostaticColumn
from pysph_boiling.reproduce.pictures import plot


def run(quick):
    flat = {10: HydrostaticColumn(layers=10), 20: HydrostaticColumn(layers=20)}
    if not quick:
        flat[40] = HydrostaticColumn(layers=40)
    return {"2d": {layers: problem.run() for layers, problem in flat.items()},
            "3d": {} if quick else {20: HydrostaticColumn(dim=3, width=0.4).run()}}


def rows(outcomes):
    for dim, found in outcomes.items():
        if not found:
            continue
        at = f" at {', '.join(map(str, found))} layers" if len(found) > 1 else ""
        for row, error in (("mean", "density_mean"), ("max", "density_max"), ("level", "level"), ("rest", "speed")):
            if (row, dim) != ("max", "3d"):
                sign = "+" if row == "level" else ""
                yield f"{row}_{dim}", found[20].errors[error], ", ".join(
                    f"{100.0 * one.errors[error]:{sign}.2f}" for one in found.values()) + f" %{at}"


def draw(outcomes, path):
    found = outcomes["2d"]
    with plot(path) as ax:
        for error, colour, label in (("density_mean", ORANGE, "mean compression"), ("level", BLUE, "level")):
            ax.plot(list(found), [100.0 * one.errors[error] for one in found.values()], "o-", color=colour, label=label)
        ax.set(xlabel="layers", ylabel="error [%]", title="hydrostatic column, 2-D", xscale="log",
               xticks=list(found), xticklabels=list(map(str, found)))
        ax.minorticks_off()
        ax.legend()

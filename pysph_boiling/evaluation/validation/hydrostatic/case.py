"""Hydrostatic column: see README.md beside this file."""
from pysph_boiling.analysis.plots import BLUE, ORANGE
from pysph_boiling.evaluation.problems.hydrostatic import HydrostaticColumn
from pysph_boiling.report.pictures import plot

ERRORS = {"mean": ("density_mean", ".2f"), "max": ("density_max", ".2f"), "level": ("level", "+.2f"),
          "rest": ("speed", ".2f"), "pairs": ("pairs", ".1f")}  # row -> error, its digits
ROWS = {"2d": ("mean", "max", "level", "rest", "pairs"), "3d": ("mean", "level", "rest", "pairs"),
        "2d_wendland": ("pairs",)}


def run(quick):
    flat = {10: HydrostaticColumn(layers=10), 20: HydrostaticColumn(layers=20)}
    if not quick:
        flat[40] = HydrostaticColumn(layers=40)
    return {"2d": {layers: problem.run() for layers, problem in flat.items()},
            "3d": {} if quick else {20: HydrostaticColumn(dim=3, width=0.4).run()},
            "2d_wendland": {} if quick else {20: HydrostaticColumn(kernel="WendlandQuintic").run()}}


def rows(outcomes):
    for name, found in outcomes.items():
        at = f" at {', '.join(map(str, found))} layers" if len(found) > 1 else ""
        for row in ROWS[name] if found else ():
            error, digits = ERRORS[row]
            yield f"{row}_{name}", found[20].errors[error], ", ".join(
                f"{100.0 * one.errors[error]:{digits}}" for one in found.values()) + f" %{at}"


def draw(outcomes, path):
    found = outcomes["2d"]
    with plot(path) as ax:
        for error, colour, label in (("density_mean", ORANGE, "mean compression"), ("level", BLUE, "level")):
            ax.plot(list(found), [100.0 * one.errors[error] for one in found.values()], "o-", color=colour, label=label)
        ax.set(xlabel="layers", ylabel="error [%]", title="hydrostatic column, 2-D", xscale="log",
               xticks=list(found), xticklabels=list(map(str, found)))
        ax.minorticks_off()
        ax.legend()

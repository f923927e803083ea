"""Sloshing: see README.md beside this file."""
from pysph_boiling.analysis.plots import BLUE, ORANGE
from pysph_boiling.evaluation.problems.drift import SloshingTank
from pysph_boiling.report.pictures import plot


def run(quick):
    return {cells: SloshingTank(cells=cells).run() for cells in ((20, 40) if quick else (20, 40, 80))}


def rows(outcomes):
    at = f" % at {', '.join(map(str, outcomes))} particles"
    for row in ("period", "gain", "loss"):
        errors = [one.errors[row] for one in outcomes.values()]
        yield row, max(errors) if row == "gain" else outcomes[40].errors[row], ", ".join(
            f"{100.0 * error:{'+' if row == 'period' else ''}.1f}" for error in errors) + at


def draw(outcomes, path):
    with plot(path, width=9.6, columns=2) as (left, right):
        for (cells, one), colour in zip(outcomes.items(), ("#B0B5BC", ORANGE, BLUE)):
            for ax, column in ((left, "shift [lengths]"), (right, "energy over the start [-]")):
                ax.plot(one.curves["t [periods]"], one.curves[column], color=colour, label=f"{cells} particles")
        left.set(xlabel="time over the period of the linear theory [-]", ylabel="centre of mass [lengths]",
                 title="sloshing")
        right.set(xlabel="time over the period of the linear theory [-]", ylabel="energy gained over that given [-]")
        for ax in (left, right):
            ax.axvline(0.5, color="#B0B5BC", linestyle="--", linewidth=0.8)
            ax.legend()

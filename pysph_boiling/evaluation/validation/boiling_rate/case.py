"""Steady boiling: see README.md beside this file."""
from pysph_boiling.analysis.plots import BLUE, GREEN, ORANGE
from pysph_boiling.evaluation.problems.boiling_rate import BoilingRate
from pysph_boiling.report.pictures import plot


def run(quick):
    return (BoilingRate(width=30, fill=16, sites=3, duration=8.0, begin=1.5) if quick else
            BoilingRate()).run()


def rows(outcome):
    yield "rate", outcome.errors["rate"], (f"{outcome.facts['made']:.0f} made, {outcome.facts['paid']:.0f} paid for: "
                                           f"{100.0 * outcome.errors['rate']:+.1f} %")
    yield "energy", outcome.errors["energy"], f"{outcome.errors['energy']:.0e}"
    yield "mass", outcome.errors["mass"], f"{outcome.errors['mass']:g}"


def draw(outcome, path):
    with plot(path, width=9.6, columns=2) as (left, right):
        t = outcome.curves["t [s]"]
        left.plot(t, outcome.curves["paid for [-]"], color=BLUE, label="paid for by the heater")
        left.plot(t, outcome.curves["made [-]"], color=ORANGE, label="vaporised and not condensed")
        left.set(xlabel="time [s]", ylabel="particles since the start", title="vapour made")
        left.legend()
        right.plot(t, outcome.curves["vapour [-]"], color=GREEN)
        right.set(xlabel="time [s]", ylabel="particles", title="vapour in the vessel")

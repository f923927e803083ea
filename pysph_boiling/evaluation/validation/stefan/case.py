"""Stefan problem: see README.md beside this file."""
import math

from pysph_boiling.analysis.plots import BLUE, ORANGE
from pysph_boiling.evaluation.problems.stefan import Stefan, front_constant
from pysph_boiling.report.pictures import plot

TABLE = {0.1: 0.220016, 0.5: 0.464786, 1.0: 0.620063}


def run(quick):
    asked = [(0.5, 10), (0.5, 20), (1.0, 10)] + ([] if quick else [(0.5, 40), (1.0, 20), (0.1, 10)])
    return {(stefan, layers): Stefan(stefan=stefan, layers=layers).run() for stefan, layers in asked}


def rows(outcomes):
    front = {key: one.errors["front"] for key, one in outcomes.items()}
    half = [layers for stefan, layers in front if stefan == 0.5]
    yield "front", front[0.5, 20], ", ".join(f"{100.0 * front[0.5, n]:+.2f}" for n in half) + (
        f" % at {', '.join(map(str, half))} particles")
    order = math.log2(abs(front[0.5, half[0]] / front[0.5, half[-1]])) / math.log2(half[-1] / half[0])
    yield "order", order, f"{order:.2f}"
    for row, stefan in (("large", 1.0), ("small", 0.1)):
        sizes = [layers for asked, layers in front if asked == stefan]
        if sizes:
            yield row, front[stefan, sizes[-1]], ", ".join(f"{100.0 * front[stefan, n]:+.2f}" for n in sizes) + (
                f" % at {', '.join(map(str, sizes))} particles")
    worst = max(abs(front_constant(stefan) - constant) for stefan, constant in TABLE.items())
    yield "constants", worst, f"{worst:.0e}"
    energy = max((one.errors["energy"] for one in outcomes.values()), key=abs)
    yield "energy", energy, f"{energy:.0e}"


def draw(outcomes, path):
    with plot(path, width=9.6, columns=2) as (left, right):
        one = outcomes[0.5, 20].curves
        left.plot(one["t [s]"], 1e3 * one["front [m]"], color=ORANGE, label="particles, 20 layers")
        left.plot(one["t [s]"], 1e3 * one["exact [m]"], "--", color=BLUE, label="exact")
        left.set(xlabel="time [s]", ylabel="thickness of the vapour [mm]", title="Stefan problem, St = 0.5")
        problem, constant = Stefan(), front_constant(0.5)
        y = one["y [m]"] / problem.thickness
        right.plot(1e3 * one["y [m]"], one["T [K]"] - one["T [K]"].min(), ".", color=ORANGE, label="particles")
        exact = [max(0.0, problem.superheat * Stefan.profile(at, constant)) for at in y]
        right.plot(1e3 * one["y [m]"], exact, color=BLUE, label="exact")
        right.set(xlabel="distance from the wall [mm]", ylabel="temperature above saturation [K]")
        for ax in (left, right):
            ax.legend()

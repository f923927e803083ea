"""Surface tension: see README.md beside this file."""
import numpy as np

from pysph_boiling.analysis.plots import BLUE, ORANGE
from pysph_boiling.evaluation.problems.capillary import BubbleShape, LaplacePressure
from pysph_boiling.report.pictures import plot

STARTS = 3  # random starts


def run(quick):
    coarse = dict(spacing=0.001)
    made = {"shape": (BubbleShape, coarse), "pressure": (LaplacePressure, coarse)}
    if not quick:
        fine = dict(spacing=0.001 / 1.5)
        made |= {"shape_fine": (BubbleShape, fine), "pressure_fine": (LaplacePressure, fine)}
    found = {name: [problem(seed=seed, **options).run() for seed in range(1, 1 + (1 if quick else STARTS))]
             for name, (problem, options) in made.items()}
    return found if quick else found | {"shape_3d": [BubbleShape(dim=3, radius=0.006, box=4.0).run()]}


def rows(outcomes):
    for row, error in (("shape", "frequency"), ("shape_fine", "frequency"), ("shape_3d", "frequency"),
                       ("pressure", "pressure"), ("pressure_fine", "pressure")):
        if row in outcomes:
            found = [1.0 + outcome.errors[error] for outcome in outcomes[row]]
            yield row, np.mean(found) - 1.0, f"{np.mean(found):.2f} of theory: {', '.join(f'{k:.2f}' for k in found)}"
    momentum = max(outcome.errors["momentum"] for outcome in outcomes["shape"])
    yield "momentum", momentum, f"{momentum:.0e}"


def draw(outcomes, path):
    with plot(path, width=5.2) as ax:
        for number, one in enumerate(outcomes["shape"]):
            t, shape, fit = one.curves.values()
            ax.plot(t, shape / shape[0], ".", markersize=3, color=ORANGE, label="particles" if number == 0 else None)
            ax.plot(t, fit / shape[0], color=BLUE, linewidth=0.8, label="fits" if number == 0 else None)
        ax.axhline(0.0, color="0.7", linewidth=0.8)
        ax.set(xlabel="time times frequency of theory [-]", ylabel="stretch over that at the start [-]")
        ax.legend()

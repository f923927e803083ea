"""Rotating drop: see README.md beside this file."""
import math

import numpy as np

from pysph_boiling.analysis.plots import BLUE, ORANGE
from pysph_boiling.evaluation.problems.rotating_drop import RotatingDrop
from pysph_boiling.report.pictures import plot


def run(quick):
    cells = 12 if quick else 25
    asked = {"coarse step": dict(courant=0.2), "drop": {}, "fine step": dict(courant=0.05),
             "flying": dict(drift=(3.0, -2.0))}
    made = {name: RotatingDrop(cells=cells, **changes) for name, changes in asked.items()}
    if not quick:
        made |= {"coarse": RotatingDrop(cells=12), "fine": RotatingDrop(cells=50)}
    return {name: (problem, problem.run()) for name, problem in made.items()}


def rows(outcomes):
    problem, drop = outcomes["drop"]
    sizes = sorted((one.cells, outcome.errors["axes"]) for name, (one, outcome) in outcomes.items()
                   if name in ("coarse", "drop", "fine"))
    yield "axes", drop.errors["axes"], ", ".join(f"{100.0 * error:.1f}" for _, error in sizes) + (
        f" % at {', '.join(str(cells) for cells, _ in sizes)} spacings")
    yield "tilt", drop.errors["tilt"], f"{drop.errors['tilt']:.4f}"
    momentum = max(outcome.errors["momentum"] for _, outcome in outcomes.values())
    yield "momentum", momentum, f"{momentum:.0e}"
    angular = [outcomes[name][1].errors["angular"] for name in ("coarse step", "drop", "fine step")]
    yield "angular", angular[1], ", ".join(f"{100.0 * change:+.3f}" for change in angular) + " % at CFL 0.2, 0.1, 0.05"
    order = math.log2(angular[0] / angular[-1]) / 2.0
    yield "angular_order", order, f"{order:.2f}"
    yield "energy", drop.errors["energy"], f"{100.0 * drop.errors['energy']:+.2f} %"
    flying = outcomes["flying"][1]
    apart = np.hypot(*(flying.curves[name] - drop.curves[name] for name in ("x [m]", "y [m]"))).max() * problem.cells
    yield "galilei", apart, f"{apart:.0e}"


def draw(outcomes, path):
    problem, drop = outcomes["drop"]
    angle = np.linspace(0.0, 2.0 * math.pi, 200)
    with plot(path, width=7.0, height=4.6) as ax:
        turns = np.degrees(np.arctan2(drop.curves["y0 [m]"], drop.curves["x0 [m]"]))
        even = (turns // 45.0) % 2 == 0
        for part, colour in ((even, ORANGE), (~even, "#F0C9A8")):
            ax.plot(drop.curves["x [m]"][part], drop.curves["y [m]"][part], ".", markersize=3, color=colour)
        ax.plot(*(drop.facts["F"] @ np.stack([np.cos(angle), np.sin(angle)])), color=BLUE, label="exact")
        ax.plot(np.cos(angle), np.sin(angle), "--", color=BLUE, linewidth=0.8, label="at the start")
        ax.set(aspect="equal", xlabel="x [m]", ylabel="y [m]", title=f"after {problem.duration:g} s; sectors of 45° at "
               "the start")
        ax.legend()

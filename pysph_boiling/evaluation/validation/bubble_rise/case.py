"""A bubble that rises: see README.md beside this file."""
import numpy as np

from pysph_boiling.analysis.plots import BLUE, GREEN, ORANGE, PURPLE
from pysph_boiling.evaluation.problems.bubble_rise import BubbleRise
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.report.pictures import plot
from pysph_boiling.schemes.effects import Cohesion, DensityConstraint

EOTVOS = 12.6  # of the bubble of 12 mm at the default cohesion


def run(quick):
    starts = 1 if quick else 3
    made = {"default": BubbleRise(starts=starts), "half the step": BubbleRise(starts=starts, dt_factor=0.035)}
    if not quick:
        for sweeps in (4, 8):
            made[f"{sweeps} sweeps"] = BubbleRise(starts=starts, density=DensityConstraint(
                min_sweeps=sweeps, max_sweeps=sweeps))
        for cells in (9, 12):
            d = 0.002 * cells
            made[f"{2 * cells} mm"] = BubbleRise(starts=starts, cells=cells, diameter=d, effects=(
                ("cohesion", Cohesion(sigma=WATER_1ATM.rho_l * 9.81 * d**2 / EOTVOS)),))
            made[f"{2 * cells} mm, same σ"] = BubbleRise(starts=starts, cells=cells, diameter=d)
    return {name: (problem, problem.run()) for name, problem in made.items()}


def rows(outcomes):
    speed = {name: one.facts["speed"] for name, (_, one) in outcomes.items()}  # over sqrt(g diameter)
    base = speed["default"]
    yield "step", speed["half the step"] / base - 1.0, f"{speed['half the step']:.2f} against {base:.2f} √(g d)"
    if "4 sweeps" in speed:
        changes = [speed[name] / base - 1.0 for name in ("4 sweeps", "8 sweeps")]
        yield "sweeps", max(changes, key=abs), ", ".join(f"{100.0 * change:+.0f}" for change in changes) + " %"
        for row, names in (("law", ("default", "18 mm", "24 mm")),
                           ("law_tension", ("default", "18 mm, same σ", "24 mm, same σ"))):
            d = np.array([outcomes[name][0].diameter for name in names])
            eotvos = np.array([outcomes[name][1].facts["eotvos"] for name in names])

            def power(speeds, d=d):
                """Exponent of the speed with the diameter; ``speeds`` over sqrt(g d)."""
                return np.polyfit(np.log(d), np.log(speeds * d**0.5), 1)[0]

            law, mendelson = power(np.array([speed[name] for name in names])), power(np.sqrt(2.0 / eotvos + 0.5))
            text = f"{law:.2f}; " + ", ".join(
                f"{speed[name]:.3f} ± {outcomes[name][1].facts['speed_error']:.3f}" for name in names) + " √(g d)"
            yield row, law - (mendelson if row == "law_tension" else 0.0), text + (
                f", and {mendelson:.2f} by Mendelson" if row == "law_tension" else "") + (
                ", flat by " + ", ".join(f"{outcomes[name][1].facts['aspect']:.1f}" for name in names))
    facts = outcomes["default"][1].facts
    yield "flat", facts["aspect"], (f"{facts['aspect']:.2f} ± {facts['aspect_error']:.2f} at Eo = "
                                    f"{facts['eotvos']:.1f}")
    for row, error in (("steady", "unsteady"), ("whole", "shredded")):
        yield row, outcomes["default"][1].errors[error], f"{100.0 * outcomes['default'][1].errors[error]:.0f} %"


def draw(outcomes, path):
    with plot(path) as ax:
        for (name, (_, one)), colour in zip(outcomes.items(), (
                ORANGE, BLUE, GREEN, PURPLE, "#B0B5BC", "#5A6472", "#8C6D31", "#C49AC4")):
            ax.plot(one.curves["t sqrt(g/d) [-]"], one.curves["height [diameters]"], color=colour, label=name)
        ax.set(xlabel="time √(g/d) [-]", ylabel="height [diameters]", title="bubbles of 12 mm, and of other sizes")
        ax.legend()

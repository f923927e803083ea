"""Surface tension: see README.md beside this file."""
from pysph_boiling.analysis.plots import BLUE, ORANGE
from pysph_boiling.evaluation.problems.capillary import BubbleShape, LaplacePressure
from pysph_boiling.report.pictures import plot


def run(quick):
    if quick:
        return {name: problem(starts=1).run() for name, problem in (("shape", BubbleShape),
                                                                    ("pressure", LaplacePressure))}
    fine = dict(spacing=0.001 / 1.5)
    return {"shape": BubbleShape().run(), "shape_fine": BubbleShape(**fine).run(),
            "pressure": LaplacePressure().run(), "pressure_fine": LaplacePressure(**fine).run()}


def rows(outcomes):
    for name, outcome in outcomes.items():
        if name.startswith("shape"):
            error = outcome.errors["frequency"]
            yield name, error, f"{1.0 + error:.2f} of theory, damping {outcome.facts['damping']:.2f} of critical"
        else:
            yield name, outcome.errors["pressure"], (f"{1.0 + outcome.errors['pressure']:.2f} of theory, starts "
                                                     f"{', '.join(f'{one:.2f}' for one in outcome.facts['found'])}")
    momentum = outcomes["shape"].errors["momentum"]
    yield "momentum", momentum, f"{momentum:.0e}"


def draw(outcomes, path):
    with plot(path, width=5.2) as ax:
        for name, colour in (("shape", ORANGE), ("shape_fine", BLUE)):
            if name in outcomes:
                t, shape, fit = outcomes[name].curves.values()
                ax.plot(t, shape, ".", markersize=3, color=colour,
                        label=f"{'8' if name == 'shape' else '12'} spacings in the radius")
                ax.plot(t, fit, color=colour, linewidth=0.8)
        ax.axhline(0.0, color="0.7", linewidth=0.8)
        ax.set(xlabel="time times frequency of theory [-]", ylabel="stretch over that at the start [-]")
        ax.legend()

"""Surface tension: see README.md beside this file."""
from pysph_boiling.analysis.plots import BLUE, ORANGE
from pysph_boiling.evaluation.problems.capillary import BubbleShape, LaplacePressure
from pysph_boiling.report.pictures import plot

FINE = dict(spacing=0.001 / 1.5)  # 12 in a radius of 8 mm, which is 8 otherwise
DEEP = dict(dim=3, spacing=0.0016, box=4.0, starts=2)  # 5
DEEP_FINE = DEEP | dict(spacing=0.008 / 7.0)  # 7
LONG = dict(jitter=0.5, stretch=1.4)  # at the start, in 3-D


def run(quick):
    if quick:
        return {"shape": BubbleShape().run(), "pressure": LaplacePressure(starts=2).run()}
    return {"shape": BubbleShape(starts=12).run(), "shape_fine": BubbleShape(**FINE).run(),
            "shape_3d": BubbleShape(**DEEP, **LONG).run(), "shape_3d_fine": BubbleShape(**DEEP_FINE, **LONG).run(),
            "pressure": LaplacePressure().run(), "pressure_fine": LaplacePressure(**FINE, starts=6).run(),
            "pressure_3d": LaplacePressure(**DEEP).run()}


def rows(outcomes):
    for name, outcome in outcomes.items():
        error = outcome.errors["frequency" if name.startswith("shape") else "pressure"]
        starts = ", ".join(f"{one:.2f}" for one in outcome.facts["found"])
        damping = f", damping {outcome.facts['damping']:.2f} of critical" if "damping" in outcome.facts else ""
        yield name, error, f"{1.0 + error:.2f} of theory (starts {starts}){damping}"
    at_rest = [outcome.facts for outcome in outcomes.values() if "length" in outcome.facts]
    for name, fact in (("round", "length"), ("whole", "torn")):
        yield name, max(facts[fact] for facts in at_rest), ", ".join(f"{facts[fact]:.2f}" for facts in at_rest)
    momentum = outcomes["shape"].errors["momentum"]
    yield "momentum", momentum, f"{momentum:.0e}"


def draw(outcomes, path):
    with plot(path, width=5.2) as ax:
        for name, label, colour in (("shape", "8 spacings in the radius", ORANGE), ("shape_fine", "12 spacings", BLUE)):
            if name in outcomes:
                t, shape, fit = outcomes[name].curves.values()
                ax.plot(t, shape, ".", markersize=3, color=colour, label=label)
                ax.plot(t, fit, color=colour, linewidth=0.8)
        ax.axhline(0.0, color="0.7", linewidth=0.8)
        ax.set(xlabel="time times frequency of theory [-]", ylabel="stretch over that at the start [-]")
        ax.legend()

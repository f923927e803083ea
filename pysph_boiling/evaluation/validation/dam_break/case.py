"""Dam break: see README.md beside this file."""
from pysph_boiling.analysis.plots import BLUE, GREEN, ORANGE
from pysph_boiling.evaluation.problems.dam_break import DamBreak
from pysph_boiling.report.pictures import plot


def run(quick):
    return {layers: DamBreak(layers=layers).run() for layers in ((10, 20) if quick else (10, 20, 40))}


def rows(outcomes):
    text = ", ".join(f"{100.0 * one.errors['front']:.1f}" for one in outcomes.values()) + (
        f" % outside their range at {', '.join(map(str, outcomes))} particles")
    yield "front", outcomes[20].errors["front"], text
    if 40 in outcomes:
        yield "front_fine", outcomes[40].errors["front"], f"{100.0 * outcomes[40].errors['front']:.1f} %"
    yield "density", outcomes[20].errors["density_mean"], f"{100.0 * outcomes[20].errors['density_mean']:.2f} %"


def draw(outcomes, path):
    with plot(path) as ax:
        for (layers, one), colour in zip(outcomes.items(), (GREEN, ORANGE, BLUE)):
            ax.plot(one.curves["t sqrt(g/H) [-]"], one.curves["front [-]"], color=colour, label=f"{layers} particles")
        one = outcomes[20].curves
        ax.fill_between(one["t sqrt(g/H) [-]"], one["experiments low [-]"], one["experiments high [-]"],
                        color="#B0B5BC", alpha=0.5, linewidth=0.0, label="range of three experiments")
        ax.set(xlabel="t √(g/H) [-]", ylabel="front X/a [-]", title="dam break")
        ax.legend()

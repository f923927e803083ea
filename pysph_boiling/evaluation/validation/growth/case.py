"""Growth in superheated liquid: see README.md beside this file."""
import math

import numpy as np

from pysph_boiling.analysis.plots import BLUE, GREEN, ORANGE
from pysph_boiling.evaluation.problems.growth import Growth, PlaneGrowth
from pysph_boiling.report.pictures import plot

SPHERE = dict(dim=3, growth=2.0)
QUICK = {
    "plane": PlaneGrowth(radius=2.0), "plane 2": PlaneGrowth(),
    "disc": Growth(radius=2.0), "disc 2": Growth(), "sphere": Growth(radius=2.0, **SPHERE),
    "unpooled": Growth(radius=2.0, pooled=False),
}
FULL = {
    **QUICK, "plane 3": PlaneGrowth(radius=8.0), "plane small": PlaneGrowth(radius=2.0, stefan=0.1),
    "small": Growth(radius=2.0, stefan=0.1), "disordered": Growth(jitter=0.2), "disc 3": Growth(radius=8.0),
    "sphere 2": Growth(radius=3.0, **SPHERE), "sphere 3": Growth(radius=4.0, **SPHERE),
    "sphere small": Growth(radius=1.5, stefan=0.1, **SPHERE),
    "sphere disordered": Growth(radius=2.0, jitter=0.2, **SPHERE), "unpooled 2": Growth(pooled=False),
}


def run(quick):
    return {name: (problem, problem.run()) for name, problem in (QUICK if quick else FULL).items()}


def rows(outcomes):
    def series(*names, error="error"):
        """Errors of the runs that were made, coarse first, and the text that shows them."""
        there = [outcomes[name] for name in names if name in outcomes]
        errors = [one.errors[error] for _, one in there]
        digits = 0 if errors and abs(errors[0]) > 0.1 else 1
        return errors, (", ".join(f"{100.0 * value:+.{digits}f}" for value in errors) + " % at R = " + ", ".join(
            f"{problem.radius * problem.growth:g}" for problem, _ in there) + " dx")

    for row, names, error, at in (
            ("plane", ("plane", "plane 2", "plane 3"), "error", 1), ("plane_small", ("plane small",), "error", 0),
            ("disc", ("disc", "disc 2", "disc 3"), "error", 1), ("disc_small", ("small",), "error", 0),
            ("disc_disordered", ("disordered",), "error", 0),
            ("sphere", ("sphere", "sphere 2", "sphere 3"), "error", 0), ("sphere_small", ("sphere small",), "error", 0),
            ("sphere_disordered", ("sphere disordered",), "error", 0),
            ("unpooled", ("unpooled", "unpooled 2"), "latent_error", 1)):
        errors, text = series(*names, error=error)
        if errors:
            yield row, errors[min(at, len(errors) - 1)], text
    for row, names in (("disc_ahead", ("disc", "disc 2", "disc 3")),
                       ("sphere_ahead", ("sphere", "sphere 2", "sphere 3"))):
        there = [outcomes[name] for name in names if name in outcomes]
        ahead = [one.errors["lattice_ahead"] for _, one in there]
        yield row, max(ahead, key=abs), ", ".join(f"{value:+.2f}" for value in ahead) + " dx at R = " + ", ".join(
            f"{problem.radius * problem.growth:g}" for problem, _ in there) + " dx"
    if "sphere 2" in outcomes:
        (coarse, a), (fine, b) = outcomes["sphere"], outcomes["sphere 2"]
        ratio = abs(a.errors["lattice_error"] / b.errors["lattice_error"])
        yield "sphere_order", math.log(ratio) / math.log(fine.radius / coarse.radius), (
            f"{100.0 * a.errors['lattice_error']:+.0f}, {100.0 * b.errors['lattice_error']:+.0f} %")
    roundness = outcomes["disc 2"][1].errors["roundness"]
    yield "round", roundness, f"{100.0 * roundness:.1f} % of the radius"
    energy = max(one.errors["energy"] for _, one in outcomes.values())
    yield "energy", energy, f"{energy:.0e}"


def draw(outcomes, path):
    with plot(path, width=12.8, height=3.8, columns=3) as (history, *shapes):
        ball = "sphere 3" if "sphere 3" in outcomes else "sphere"
        for name, label, colour in (("plane 2", "plane", GREEN), ("disc 2", "disc", ORANGE), (ball, "sphere", BLUE)):
            problem, one = outcomes[name]
            start = one.curves["t [s]"][0]
            history.plot(one.curves["t [s]"] / start, one.curves["R [dx]"] / problem.radius, color=colour,
                         label=f"{label}, from {problem.radius:g} dx")
            history.plot(one.curves["t [s]"] / start, one.curves["exact [dx]"] / problem.radius, "--", color=colour,
                         linewidth=0.8)
        history.set(xlabel="time over that of the start [-]", ylabel="R over that of the start [-]",
                    title="radius; dashed: exact")
        history.legend()
        unpooled = "unpooled 2" if "unpooled 2" in outcomes else "unpooled"
        for ax, name, heading in zip(shapes, ("disc 2", unpooled), ("latent heat pooled", "each particle its own")):
            problem, one = outcomes[name]
            vapour, R = one.curves["vapour [-]"] > 0.5, problem.radius * problem.growth
            ax.plot(one.curves["x [dx]"][vapour], one.curves["y [dx]"][vapour], ".", color=ORANGE, markersize=4)
            angle = np.linspace(0.0, 2.0 * math.pi, 200)
            ax.plot(R * np.cos(angle), R * np.sin(angle), color=BLUE)
            ax.set(aspect="equal", xlabel="x [dx]", ylabel="y [dx]", title=heading)

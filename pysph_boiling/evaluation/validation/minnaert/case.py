"""Ringing bubble: see README.md beside this file."""
from pysph_boiling.analysis.plots import BLUE, ORANGE
from pysph_boiling.evaluation.problems.minnaert import RingingBubble
from pysph_boiling.report.pictures import plot


def run(quick):
    made = {"undamped": RingingBubble()}
    if not quick:
        made["damped"] = RingingBubble(radius=2.2, disturbed=1.15, viscosity=4.0)
    return {name: problem.run() for name, problem in made.items()}


def rows(outcomes):
    one = outcomes["undamped"]
    yield "period", one.errors["period"], f"N = {one.facts['N']}: {1.0 + one.errors['period']:.4f} of theory"
    yield "fR", one.facts["fR"], f"{one.facts['fR']:.3f} m/s"
    yield "undamped", one.errors["decay"], f"{one.facts['rate']:+.3f} 1/s, {100.0 * one.errors['decay']:+.1f} %"
    if "damped" in outcomes:
        two = outcomes["damped"]
        yield "period_damped", two.errors["period"], f"N = {two.facts['N']}: {1.0 + two.errors['period']:.4f} of theory"
        yield "decay", two.errors["decay"], (f"{two.facts['rate']:.2f} against {two.facts['rate of theory']:.2f} 1/s, "
                                             f"{100.0 * two.errors['decay']:+.1f} %")
    for row, error in (("unexplained", "unexplained"), ("whole", "apart")):
        worst = max(outcome.errors[error] for outcome in outcomes.values())
        yield row, worst, f"{100.0 * worst:.1f} %"


def draw(outcomes, path):
    with plot(path, width=4.8 * len(outcomes), columns=len(outcomes)) as axes:
        for ax, (name, one) in zip(axes if len(outcomes) > 1 else [axes], outcomes.items()):
            ax.plot(one.curves["t [s]"], one.curves["r [dx]"], ".", markersize=3, color=ORANGE, label="particles")
            ax.plot(one.curves["t [s]"], one.curves["fit [dx]"], color=BLUE, label="fit")
            ax.set(xlabel="time [s]", ylabel="mean radius [dx]", title=f"{name}, N = {one.facts['N']}")
            ax.legend()

"""Table 4: particles and time per step of the six scenes, and the paper's observations in each of them."""
from typing import NamedTuple

import numpy as np

from pysph_boiling.evaluation.reproduce.figure import Figure, figures
from pysph_boiling.evaluation.reproduce.runs import Run
from pysph_boiling.report.page import VERDICTS, counts, label, sentence
from pysph_boiling.report.pictures import plot
from pysph_boiling.report.sections import Picture, Section, Statement, Table, bound, judged, write_csv
from pysph_boiling.schemes.stages import STAGES

__all__ = ["PAPER", "Performance", "cost"]

FRAME = 1.0 / 30.0  # [s]; a frame of a film

class Scenario(NamedTuple):
    """A row of the paper's Table 4, and words that identify the statements of its figure that support it."""

    name: str
    figure: str
    rate: float  # frames per second, with 20k particles
    observation: str
    about: tuple[str, ...]


PAPER = {
    "steady_boiling": Scenario("Steady boiling", "fig3", 22.7, "Consistent bubble generation and stable nucleation "
                               "cycles.", ("generation is consistent", "cycles are stable")),
    "cooling": Scenario("Post-heating cooling", "fig4", 25.2, "Gradual condensation and smooth vapor-liquid "
                        "transition.", ("Bubbles condense", "disappears gradually", "surface settles")),
    "explosive_boiling": Scenario("Explosive boiling", "fig5", 24.4, "Realistic explosive onset and rapid bubble "
                                  "nucleation.", ("bursts by itself", "bubbles form quickly")),
    "bubble_rise": Scenario("Bubble rising", "fig7", 23.3, "Bubble trajectories and shapes closely match "
                            "experiments.", ("trajectories closely match", "shapes closely match")),
    "bubble_merge": Scenario("Bubble merging", "fig8", 22.9, "Correct surface tension and coalescence dynamics.",
                             ("two bubbles become one", "coalescence keeps")),
    "bubble_split": Scenario("Bubble splitting", "fig9", 23.4, "Physically plausible breakup and volume "
                             "conservation.", ("one bubble becomes several", "breakup keeps")),
}
TIMED = {  # scene -> options of a timed run, most of which boils
    "steady_boiling": ("--duration", "3"), "cooling": ("--max-steps", "3000"),
    "explosive_boiling": ("--max-steps", "300"), "bubble_rise": ("--max-steps", "300"),
    "bubble_merge": ("--max-steps", "300"), "bubble_split": ("--max-steps", "200"),
}
EVEN = 1.5  # largest ratio of the slowest to the fastest scene [-] at which they cost about the same
QUICKER = 10.0  # largest number of steps a second over the paper's; a step that is faster does not do the same work
BOILS = 0.6  # least share of a timed run with vapour
SILENT = ("--pfreq", "100000")  # steps between particle files, so that only the first and the last are written


class Performance(Figure):
    """Timed runs of the paper's size, one at a time; the key observations come from the statements of the figures.

    The quick form times small runs of the figures, which share the machine.
    """

    key = "table4"
    reads_others = True
    title = "Table 4: time per step of six scenes, and what is observed in them"

    def runs(self, quick):
        return list(self.timed(quick).values())

    def timed(self, quick):
        """Scene -> the run that is timed: a run of its own, or the complete run of its figure."""
        if not quick:
            return {scene: Run(f"timed_{scene}", scene, (*options, *SILENT), alone=True)
                    for scene, options in TIMED.items()}
        known = figures()
        return {scene: next(run for run in known[row.figure]().runs(quick) if run.scene == scene
                            and not any(option.startswith("--no-") for option in run.options))
                for scene, row in PAPER.items()}

    def make(self, results, folder, quick):
        timed = {scene: results[run.name].record for scene, run in self.timed(quick).items()}
        costs = {scene: cost(record) for scene, record in timed.items()}
        boils = {scene: float(np.mean(results[run.name].results["n_vapour"] > 0.0))
                 for scene, run in self.timed(quick).items()}
        columns = ("scene", "particles", "time step [ms]", "share with vapour", "ms per step", "steps per second",
                   "s per film frame", "threads", "the paper's frames per second (20k particles, RTX 2060)")
        rows = [(PAPER[scene].name, f"{one['particles']:.0f}", f"{1e3 * FRAME / one['steps']:.2f}",
                 f"{boils[scene]:.0%}", f"{1e3 * one['step']:.1f}", f"{1.0 / one['step']:.1f}", f"{one['frame']:.2f}",
                 f"{one['threads']}", f"{PAPER[scene].rate}") for scene, one in costs.items()]
        draw_stages({PAPER[scene].name: record for scene, record in timed.items()}, folder / "stages.png")
        found = observed(folder.parent)
        return self.section(
            pictures=[Picture("stages.png", "Computing time of a film frame by stage of the time step.")],
            tables=[Table(columns, rows, f"A film frame is 1/{1.0 / FRAME:.0f} s of simulated time. {machine(timed)}"),
                    *observation_table(found)],
            data=[write_csv(folder / "performance.csv", dict(zip(columns, zip(*rows))))],
            statements=[*rates(costs, boils, quick), *observations(found)],
            text="This times small scenes that share the machine; the full form times each scene alone, in the size of "
            "the paper." if quick else "Each scene was timed alone, while it boils, without pictures and intermediate "
            "output. A frame of the paper is one pass of its Algorithm 1, which is one time step.")


def cost(record):
    """Computing time of a frame and of its parts, from ``run.json``."""
    step, steps = record["timed"]["seconds"] / record["timed"]["steps"], FRAME / record["dt"]
    stages = {name: value * steps / record["timed"]["steps"] for name, value in record["wall_time"].items()
              if name != "unit"}
    return dict(particles=record["particles"]["fluid"], steps=steps, step=step, frame=step * steps, stages=stages,
                threads=record["threads"])


def machine(timed):
    """A sentence on the machines of these runs."""
    made = {f"{record['processor']} ({record['machine']})" for record in timed.values()}
    return f"Timed on {', '.join(sorted(made))}."


def draw_stages(records, path):
    """Draw one bar per scene with the seconds of a frame by stage."""
    from matplotlib import colormaps

    stages = [name for name in ("search", *(stage.name for stage in STAGES))
              if any(name in record["wall_time"] for record in records.values())]
    with plot(path, width=7.2, height=0.55 * len(records) + 1.1) as ax:
        left = np.zeros(len(records))
        costs = [cost(record) for record in records.values()]
        for number, name in enumerate(stages):
            seconds = np.array([one["stages"].get(name, 0.0) for one in costs])
            ax.barh(list(records), seconds, left=left, color=colormaps["tab10"](number % 10), label=name, height=0.7)
            left += seconds
        rest = np.maximum(np.array([one["frame"] for one in costs]) - left, 0.0)
        ax.barh(list(records), rest, left=left, color="#C6CAD0", label="ledger, output", height=0.7)
        ax.invert_yaxis()
        ax.set_xlabel("seconds per frame")
        ax.grid(axis="y", visible=False)
        ax.legend(ncols=1, loc="center left", bbox_to_anchor=(1.0, 0.5))


def rates(costs, boils, quick):
    """Statements on steps per second."""
    paper = [row.rate for row in PAPER.values()]
    own = [1.0 / one["step"] for one in costs.values()]
    slow, fast = (choose(costs, key=lambda scene: costs[scene]["step"]) for choose in (max, min))
    parts = {scene: {name: value / costs[scene]["steps"] for name, value in costs[scene]["stages"].items()}
             for scene in (slow, fast)}
    more = {name: value - parts[fast].get(name, 0.0) for name, value in parts[slow].items()}
    most = max(more, key=more.get)
    share = bound("share of a timed run with vapour", boils.values(), BOILS, 1.0)
    return [
        judged(f"20k particles run at {min(paper)} to {max(paper)} frames per second on an RTX 2060.",
               f"{min(own):.3g} to {max(own):.3g} steps per second" + (" of small scenes" if quick else ""),
               [bound("steps per second", own, min(paper), QUICKER * max(paper)), share],
               "the machines differ: here it is a processor, in double precision", not quick,
               fair="A frame of the paper is one pass of its Algorithm 1 ('next frame', section 5), so steps are "
                    "compared; at least as many as its slowest scene, at most ten times its fastest"),
        judged(f"The scenes cost about the same: the fastest runs {max(paper) / min(paper):.2f} times as fast as the "
               "slowest.", "not timed alone" if quick else f"{max(own) / min(own):.2f} times",
               [bound("fastest over slowest", [max(own) / min(own)], 1.0, EVEN), share],
               f"a step of {PAPER[slow].name.lower()} takes {1e3 * costs[slow]['step']:.1f} ms, one of "
               f"{PAPER[fast].name.lower()} {1e3 * costs[fast]['step']:.1f} ms; the largest part of the difference, "
               f"{1e3 * more[most]:.1f} ms, is the stage '{most}'", not quick,
               fair="Cost per step, each scene alone and while it boils; half as much again is about the same"),
    ]


# --- key observations -------------------------------------------------------------------------------------------------


def observed(root):
    """Scene -> the statements of its figure that support the key observation; empty if it was not made yet."""
    found = {}
    for scene, row in PAPER.items():
        made = Section.load(root / row.figure).statements if (root / row.figure / "section.json").exists() else []
        found[scene] = [one for one in made if any(words in one.paper for words in row.about)]
        if made and len(found[scene]) != len(row.about):
            raise ValueError(f"{label(row.figure)} should have one statement for each of {row.about}; it has "
                             f"{[one.paper for one in made]}")
    return found


def observations(found):
    """A statement for each key observation: it agrees if all of its statements agree, and disagrees if one does not."""
    rows = []
    for scene, statements in found.items():
        row, verdicts = PAPER[scene], [one.agrees for one in statements]
        rows.append(Statement(
            f"{row.name}: {row.observation}",
            f"Of the statements measured for {label(row.figure)}, {counts(statements)}; the table below lists them."
            if verdicts else f"{label(row.figure)} was not made yet.",
            False if False in verdicts else True if verdicts and all(verdicts) else None,
            " ".join(sentence(one.why) for one in statements if one.why and one.agrees is not True),
            fair="It agrees if all the statements on it agree, each by its own criterion"))
    return rows


def observation_table(found):
    """List with a table of the statements for each key observation; empty if none was measured."""
    rows = [(PAPER[scene].name, one.paper, one.ours, VERDICTS[one.agrees]) for scene, statements in found.items()
            for one in statements]
    columns, caption = ("scene", "statement", "ours", "verdict"), "What the key observations rest on: statements above"
    return [Table(columns, rows, caption)] if rows else []

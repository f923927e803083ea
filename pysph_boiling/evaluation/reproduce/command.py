"""The command ``pysph-boiling reproduce``."""
import os
from pathlib import Path

from rich.console import Console

from pysph_boiling.evaluation.reproduce.figure import figures
from pysph_boiling.evaluation.reproduce.runs import perform
from pysph_boiling.evaluation.reproduce.wording import PAPER
from pysph_boiling.examples import scene_class
from pysph_boiling.names import Parser, unknown
from pysph_boiling.report.markdown_page import take_up, write_report
from pysph_boiling.report.options import add_report_options, refuse_quick
from pysph_boiling.report.page import origin, write_page
from pysph_boiling.report.sections import Section
from pysph_boiling.runs.jobs import Job, check_count, results, run_jobs
from pysph_boiling.runs.ledger import write_json
from pysph_boiling.runs.size import PACE, about, size_of

__all__ = ["reproduce"]


def make(figure, finished, root, quick):
    """Draw and measure one figure, from the finished runs, into its folder; returns a line that sums it up."""
    folder = root / figure.key
    folder.mkdir(exist_ok=True)
    own = figure.runs(quick)
    section = figure.make({run.name: finished[run.name] for run in own}, folder, quick)
    section.commands = [run.command for run in own]
    section.judged_on = judged_on([finished[run.name] for run in own])
    section.origins = [origin(finished[run.name].record) for run in own]
    section.save(folder)
    verdicts = [statement.agrees for statement in section.statements]
    return f"{figure.key}: {section.title}: {verdicts.count(True)} of {len(verdicts)} statements agree"


def judged_on(results):
    """Scene, length and forms of finished runs: ``superheat_sites, 12 s, in our forms``; empty without runs."""
    lengths, paper = {}, set()
    for result in results:
        lengths.setdefault(result.scene, set()).add(f"{result.results['t'][-1]:.3g}")
        paper.update(result.record.get("forms", {}).get("paper", ()))
    scenes = "; ".join(f"{scene}, {' and '.join(sorted(times, key=float))} s" for scene, times in lengths.items())
    forms = f"with the paper's forms of {', '.join(sorted(paper))}" if paper else "in our forms"
    return f"{scenes}, {forms}" if scenes else ""


def show_figures(asked, quick):
    """Print the figures ``asked`` for, key -> figure: how large each is, about how long it takes, and its runs."""
    console, sizes = Console(highlight=False, soft_wrap=True), Sizes()
    for key, figure in asked.items():
        own = figure.runs(quick)
        console.print(f"[bold]{key}[/bold]  {figure.title}", f"  {sizes.summary(own)}", sep="\n")
        for run in own:
            console.print(f"    {run.name}: {run.command}", markup=False)
    together = [run for figure in asked.values() for run in figure.runs(quick)]
    console.print(f"together: {sizes.summary(together)}; runs that several share are made once",
                  PACE, sep="\n")


class Sizes:
    """The sizes of runs; each is found once."""

    def __init__(self):
        self.applications, self.particles, self.sizes = {}, {}, {}

    def of(self, run):
        """The :class:`~pysph_boiling.runs.size.Size` of a run."""
        asked = run.scene, run.options
        if asked not in self.sizes:
            if run.scene not in self.applications:
                self.applications[run.scene] = scene_class(run.scene)()
            self.sizes[asked] = size_of(self.applications[run.scene], run.options, self.particles)
        return self.sizes[asked]

    def summary(self, runs):
        """How many runs, particles times steps, and about how long: runs of the same name count once."""
        sizes = [self.of(run) for run in {run.name: run for run in runs}.values()]
        if not sizes:
            return "no runs: drawn at once"
        work = sum(size.particles * size.steps for size in sizes)
        took = about(sum(size.seconds for size in sizes))
        return f"{len(sizes)} {'run' if len(sizes) == 1 else 'runs'}, {work:.2g} particle steps, about {took}"


def reproduce(arguments):
    """Run the simulations of the chosen figures, draw them, and write the page; returns its path.

    Errors: ``ValueError`` with the known names for an unknown figure; ``ChildProcessError`` if a run fails.
    """
    known = figures()
    parser = Parser(prog="pysph-boiling reproduce", description=(
        "Reproduce figures and tables of the paper, and compare each with the statements of the paper."))
    parser.add_argument("figure", nargs="*", metavar="FIGURE",
                        help=f"figures and tables, default all of: {', '.join(known)}")
    add_report_options(parser, quick="use small scenes, which take minutes instead of hours",
                       report="also write the chosen figures to this report",
                       json="write the statements and verdicts to this file")
    parser.add_argument("--directory", default=None, help="output folder; default reproduce, or reproduce_quick with "
                        "--quick")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1,
                        help="number of runs at the same time; default one per core")
    parser.add_argument("--list", action="store_true", help="list the figures and tables, about how long each takes, "
                        "and their runs, without starting them")
    options = parser.parse_args(arguments)
    refuse_quick(parser, options)
    for key in options.figure:
        if key not in known:
            raise unknown("figure", key, known)
    check_count(options.jobs)
    console = Console(highlight=False)
    asked = {key: known[key]() for key in options.figure or known}
    runs = [run for figure in asked.values() for run in figure.runs(options.quick)]
    if options.list:
        show_figures(asked, options.quick)
        return None

    root = Path(options.directory or ("reproduce_quick" if options.quick else "reproduce"))
    root.mkdir(parents=True, exist_ok=True)
    if options.report:
        take_up(options.report, root)
    finished = perform(runs, root / "runs", jobs=options.jobs, report=console.print)
    for reads_others in (False, True):  # those that read others come last
        results(run_jobs(
            [Job(name=key, call=(make, figure, finished, root, options.quick)) for key, figure in asked.items()
             if figure.reads_others == reads_others], options.jobs,
            ended=lambda outcome: console.print(outcome.value or f"{outcome.job.name}: {outcome.failure}")))
    sections = [Section.load(root / key) for key in known if (root / key / "section.json").exists()]
    page = write_page(sections, root, wording=PAPER, quick=options.quick)
    if options.report:
        made = [one for one in sections if one.key in asked]
        console.print(f"report: {write_report(made, root, options.report, known, wording=PAPER)}")
    if options.json:
        write_json(options.json, {section.key: {statement.paper: statement.agrees for statement in section.statements}
                                  for section in sections})
    console.print(f"page: {page}")
    return page

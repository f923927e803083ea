"""The command ``pysph-boiling reproduce``."""
import argparse
import os
from pathlib import Path

from pysph_boiling.evaluation.reproduce.figure import figures
from pysph_boiling.evaluation.reproduce.runs import perform
from pysph_boiling.evaluation.reproduce.wording import PAPER
from pysph_boiling.names import unknown
from pysph_boiling.report.markdown_page import take_up, write_report
from pysph_boiling.report.options import add_report_options, refuse_quick
from pysph_boiling.report.page import origin, write_page
from pysph_boiling.report.sections import Section
from pysph_boiling.runs.jobs import Job, check_count, results, run_jobs
from pysph_boiling.runs.ledger import write_json

__all__ = ["reproduce"]


def make(figure, finished, root, quick):
    """Draw and measure one figure, from the finished runs, into its folder; returns a line that sums it up."""
    folder = root / figure.key
    folder.mkdir(exist_ok=True)
    own = figure.runs(quick)
    section = figure.make({run.name: finished[run.name] for run in own}, folder, quick)
    section.commands = [run.command for run in own]
    section.origins = [origin(finished[run.name].record) for run in own]
    section.save(folder)
    verdicts = [statement.agrees for statement in section.statements]
    return f"{figure.key}: {section.title}: {verdicts.count(True)} of {len(verdicts)} statements agree"


def reproduce(arguments):
    """Run what the asked figures need, draw them, and write the page. Returns the page's path.

    Errors: ``ValueError`` for an unknown figure, with the known ones; ``ChildProcessError`` where a run failed.
    """
    from rich.console import Console

    known = figures()
    parser = argparse.ArgumentParser(prog="pysph-boiling reproduce", description=(
        "Run and draw figures and tables of the paper, and hold each against what the paper states."))
    parser.add_argument("figure", nargs="*", metavar="FIGURE",
                        help=f"which ones, all if none is named: {', '.join(known)}")
    add_report_options(parser, quick="small scenes, minutes instead of hours",
                       report="write the asked figures into this report too",
                       json="write the statements and verdicts there")
    parser.add_argument("--directory", default=None, help="output folder; default reproduce, reproduce_quick")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1,
                        help="runs side by side; default one per core")
    parser.add_argument("--list", action="store_true", help="print the runs and stop")
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
        for run in dict.fromkeys(runs):
            console.print(f"{run.name}: {run.command}")
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

"""The command ``pysph-boiling accuracy``, which measures what accuracy costs in computing time on this machine."""
import os
import statistics
import time
from pathlib import Path

from pysph_boiling.checks import require
from pysph_boiling.evaluation.accuracy.drawing import draw_front, draw_orders
from pysph_boiling.evaluation.accuracy.front import cheapest
from pysph_boiling.evaluation.accuracy.knobs import STUDIES, studies
from pysph_boiling.evaluation.accuracy.measure import Points
from pysph_boiling.evaluation.accuracy.results import find, percent, write_points
from pysph_boiling.names import Parser
from pysph_boiling.report.markdown_page import write_report
from pysph_boiling.report.options import add_report_options, refuse_quick
from pysph_boiling.report.page import Wording, write_page
from pysph_boiling.report.sections import Section, Table
from pysph_boiling.runs.ledger import write_json
from pysph_boiling.runs.provenance import origin
from pysph_boiling.schemes.quality import QUALITIES

__all__ = ["accuracy"]

REPEATS = 3
BUDGET = {True: 120.0, False: 6000.0}  # [s] after which points are not repeated; 3 minutes (quick) or 2 hours in all
BOUNDS = (0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)  # errors for which the cheapest settings are listed
OTHERS = 0.5  # load by other programs above which timings are called disturbed


def run(chosen, points, repeats, budget, report):
    """Run all points, and repeat them in the same order, so that repeats are spread over time; returns seconds."""
    begin = time.perf_counter()
    for done in range(repeats):
        for study in chosen:
            for number, problem in enumerate(study.problems(), 1):
                if points.repeats(problem) > done:
                    continue
                if done and time.perf_counter() - begin > budget:
                    return time.perf_counter() - begin
                record = points.add(problem)
                if done == 0:
                    report(f"{study.key} {number}/{len(study.problems())}: " + (record.get("failed") or "{}; {:.3g} s"
                           .format(", ".join(f"{name} {value:.3g}" for name, value in record["errors"].items()
                                             if value is not None), record["seconds"][-1])))
    return time.perf_counter() - begin


def make(findings, points, folder):
    """Draw the pictures of a study and write its data; returns its :class:`Section`."""
    study, rows = findings.study, findings.rows
    folder.mkdir(exist_ok=True)
    pictures = [draw_front(findings, folder / "front.png")]
    if study.trends:
        pictures.append(draw_orders(findings, points, folder / "orders.png"))
    names = sorted({name for row in rows for name in row.record.get("errors", {})} - {study.error})
    if study.others is not None:
        names = [name for name in names if name in study.others]

    def cells(number, row):
        record = row.record
        sweeps = record.get("facts", {}).get("sweeps")
        return [number, row.settings, row.preset, percent(row.error),
                *(percent(abs(record["errors"][name])) if record["errors"].get(name) is not None else "none"
                  for name in names), f"{sweeps:.1f}" if sweeps is not None else "",
                f"{row.cost:.3g}", f"{100.0 * row.spread:.0f}\N{NO-BREAK SPACE}%", len(record["seconds"])]

    columns = ("", "settings", "preset", "error", *(name.replace("_", " ") for name in names), "sweeps a step",
               "cost [s/s]", "spread", "runs")
    tables = [Table(columns, [cells(number, rows[k]) for number, k in enumerate(findings.front, 1)],
                    "The front. The cost is the median of the wall seconds per simulated second, and the spread is "
                    "half of their range relative to it. Settings that are not named have their defaults.")]
    presets = findings.presets()
    if presets:
        unit = next((row.cost for name, row in presets.items() if "standard" in name), float("nan"))
        tables.append(Table(("preset", "error", *(name.replace("_", " ") for name in names), "cost [s/s]",
                             "relative cost", "stated relative cost"),
                            [[name, percent(row.error), *(percent(abs(row.record["errors"].get(one) or 0.0))
                              if "errors" in row.record else "none" for one in names), f"{row.cost:.3g}",
                              f"{row.cost / unit:.2f}", f"{QUALITIES[name.split(', ')[0]].cost:g}"]
                             for name, row in presets.items()], "The presets."))
    best = {cheapest([row.cost for row in rows], [row.error for row in rows], bound): bound for bound in BOUNDS}
    tables.append(Table(("error at most", "cheapest settings", "error", "cost [s/s]"),
                        [[percent(bound), rows[k].settings, percent(rows[k].error), f"{rows[k].cost:.3g}"]
                         for k, bound in best.items() if k is not None], "The cost of an error."))
    if findings.orders:
        tables.append(Table(("trend", "order", "standard error", "points"),
                            [[name, f"{one.order:.2f}", f"{one.spread:.2f}" if one.spread >= 0.0 else "none",
                              one.points] for name, one in findings.orders.items()], "Orders of convergence."))
    failed = [row for row in rows if "failed" in row.record]
    if failed:
        tables.append(Table(("settings", "why"), [[row.settings, row.record["failed"]] for row in failed],
                            "Points that failed."))
    changing = [row.settings for row in rows if not row.record.get("same", True)]
    text = f"Reference: {study.problem.reference}. {len(rows)} points."
    if changing:
        text += f" Repeated runs had different errors for: {'; '.join(changing)}."
    return Section(study.key, study.title, pictures=pictures, tables=tables,
                   statements=findings.statements, data=[write_points(findings, folder / "points.csv")], text=text,
                   origins=[origin()])


def loads(every, threads):
    """A sentence on the load of the machine during the measurements, and whether it was high."""
    found = [load for findings in every for row in findings.rows for load in row.record["load"] if load is not None]
    if not found:
        return "", False
    median, most = statistics.median(found), max(found)
    high = median > threads + OTHERS
    return (f"The load average before a run had a median of {median:.1f} and a maximum of {most:.1f} on "
            f"{os.cpu_count()} cores; a run used {threads} {'thread' if threads == 1 else 'threads'}."
            + (" This load is high: other programs were running, so the times are not reliable." if high else "")), high


def accuracy(arguments):
    """Measure, draw, and write page, summary and data; returns the path of the page.

    Errors: ``ValueError`` for an unknown study; ``CheckFailed`` if a claim does not hold.
    """
    from rich.console import Console

    parser = Parser(prog="pysph-boiling accuracy", description=(
        "Measure the error and the computing time for every setting that matters."))
    parser.add_argument("study", nargs="*", metavar="STUDY", help=f"studies to run, default all of: "
                        f"{', '.join(STUDIES)}")
    add_report_options(parser, quick="use small scenes, which take three minutes at most",
                       report="write the studies to this report; default summary.md in the output folder",
                       json="write points, orders and claims to this file")
    parser.add_argument("--directory", default=None, help="output folder; default accuracy, or accuracy_quick with "
                        "--quick")
    parser.add_argument("--threads", type=int, default=1, help="number of threads of a run; default 1")
    parser.add_argument("--repeats", type=int, default=REPEATS, help=f"number of runs of each point; default {REPEATS}"
                        ", or fewer if they take too long")
    parser.add_argument("--list", action="store_true", help="list the points without running them")
    options = parser.parse_args(arguments)
    refuse_quick(parser, options)
    for name, most in (("threads", os.cpu_count() or 1), ("repeats", 100)):
        if not 1 <= getattr(options, name) <= most:
            raise ValueError(f"--{name} must be 1 to {most}, got {getattr(options, name)}")
    console = Console(highlight=False, soft_wrap=True)
    chosen = studies(options.quick, options.study)
    if options.list:
        for study in chosen:
            for problem in study.problems():
                console.print(f"{study.key}: {problem!r}", markup=False)
        return None

    root = Path(options.directory or ("accuracy_quick" if options.quick else "accuracy"))
    root.mkdir(parents=True, exist_ok=True)
    points = Points(root / "points.json", options.threads)
    took = run(chosen, points, options.repeats, BUDGET[options.quick],
               lambda line: console.print(line, markup=False))
    every = [find(study, points, options.quick) for study in chosen]
    sections = [make(findings, points, root / findings.study.key) for findings in every]
    note, _ = loads(every, options.threads)
    wording = Wording(
        title="What accuracy costs in computing time",
        intro="Error and wall time of problems with known answers, for each numerical setting alone, and for several "
              "settings together if one can compensate for another. Compiling is not included. {form}" + note,
        quick="This is the quick form with small scenes, which only shows that everything works. ", counted="claims",
        sides=("stated", "measured"), command="accuracy")
    page = write_page(sections, root, quick=options.quick, wording=wording)
    write_report(sections, root, options.report or root / "summary.md", STUDIES, quick=options.quick, wording=wording)
    if options.json:
        write_json(options.json, {findings.study.key: dict(
            points=[dict(settings=row.settings, preset=row.preset, error=row.error, cost=row.cost, spread=row.spread,
                         errors=row.record.get("errors"), failed=row.record.get("failed")) for row in findings.rows],
            front=[findings.rows[k].settings for k in findings.front],
            orders={name: one._asdict() for name, one in findings.orders.items()},
            claims={one.paper: one.agrees for one in findings.statements}) for findings in every})
    console.print(f"{sum(len(study.problems()) for study in chosen)} points, {took:.0f} s; {note}", markup=False)
    console.print(f"page: {page}", markup=False)
    failed = [f"{findings.study.key}: {one.paper} (measured {one.ours})" for findings in every
              for one in findings.statements if not one.agrees]
    require(not failed, "; ".join(failed))
    return page

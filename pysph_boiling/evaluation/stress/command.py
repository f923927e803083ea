"""The command ``pysph-boiling stress``, which runs difficult cases, judges them and prints a table."""
import fnmatch
from dataclasses import asdict, dataclass

import numpy as np

from pysph_boiling.checks import CheckFailed
from pysph_boiling.evaluation.stress.case import simulate
from pysph_boiling.evaluation.stress.cases import all_cases
from pysph_boiling.evaluation.stress.judge import judge, load_bounds
from pysph_boiling.names import Parser, unknown
from pysph_boiling.report import markdown
from pysph_boiling.report.options import add_report_options
from pysph_boiling.report.terminal import show
from pysph_boiling.runs import safeguards
from pysph_boiling.runs.jobs import Job, check_count, run_jobs
from pysph_boiling.runs.ledger import write_json

__all__ = ["Result", "measure", "page", "stress"]

WIDTH = 220  # width of the table [characters]; a narrower terminal wraps its lines
MEMORY = 8 * 2**30  # largest address space of a case [bytes], so that an unstable case does not use up the memory


@dataclass
class Result:
    """One row of the table; ``None`` for values that a case does not have."""

    case: str
    hard: str
    steps: int = 0
    particles: int = 0
    density_mean: float | None = None
    density_max: float | None = None
    speed: float | None = None
    outside: int | None = None
    bad: int | None = None
    residual: float | None = None
    limited: int | None = None
    projected: int | None = None
    rise: float | None = None
    safeguards: str = ""
    verdict: str = ""
    broken: tuple = ()  # rules
    reasons: tuple = ()
    events: dict = None
    warned: tuple = ()  # warnings of the scheme
    seconds: float = 0.0


def measure(case, run, bounds):
    """The row of a run."""
    wrong = judge(case, run, bounds)
    verdict = "fails" if wrong else "refused" if case.refused else "passes"
    row = Result(case.name, case.hard, steps=run.steps, seconds=run.seconds, verdict=verdict,
                 broken=[rule for rule, _ in wrong], reasons=[text for _, text in wrong], events=run.events,
                 warned=run.warned)
    if case.refused and not wrong:
        row.reasons = [run.refusal or run.stopped]
    if run.table:
        def most(name):
            return float(np.max(np.abs(run.table[name]))) if name in run.table else None

        row.particles = len(run.get("m"))
        row.density_mean, row.density_max = most("density_error_mean"), most("density_error_max")
        row.speed = most("speed") / np.sqrt(run.g * run.depth)
        row.outside, row.bad = int(most("outside")), int(most("bad"))
        row.limited, row.projected = int(most("n_limited")), int(most("n_projected"))
        row.residual = most("energy_residual")
        if run.setup.closed:
            row.rise = float((max(run.table["mechanical"]) - run.first) / run.scale)
        row.safeguards = safeguards.summary(run.table)
    return row


def perform(name, steps, bounds):
    """Run one case in this process; returns its row."""
    case = all_cases()[name]
    return measure(case, simulate(case, steps), bounds)


def run_all(asked, bounds, jobs, report):
    """The rows of cases [(case, steps)], which run in child processes, ``jobs`` at a time; one that dies has a row too.
    """
    cases = {case.name: case for case, _ in asked}

    def row_of(outcome):
        case = cases[outcome.job.name]
        return outcome.value or Result(case.name, case.hard, verdict="fails", reasons=[outcome.failure])

    outcomes = run_jobs([Job(name=case.name, call=(perform, case.name, steps, bounds), memory_limit=MEMORY)
                         for case, steps in asked], jobs, ended=lambda outcome: report(row_of(outcome)))
    return [row_of(outcome) for outcome in outcomes]


COLUMNS = {
    "case": lambda row: row.case,
    "what is hard": lambda row: row.hard,
    "steps": lambda row: f"{row.steps:,}",
    "density error": lambda row: "" if row.density_max is None else
        f"{row.density_mean:.1%} / {row.density_max:.1%}",
    "fastest / √(gH)": lambda row: "" if row.speed is None else f"{row.speed:.2f}",
    "outside": lambda row: "" if row.outside is None else str(row.outside),
    "NaN": lambda row: "" if row.bad is None else str(row.bad),
    "ledger": lambda row: "" if row.residual is None else f"{row.residual:.0e}",
    "energy rise": lambda row: "" if row.rise is None else f"{row.rise:+.2%}",
    "limited": lambda row: "" if row.limited is None else str(row.limited),
    "projected": lambda row: "" if row.projected is None else str(row.projected),
    "safeguards that acted": lambda row: row.safeguards,
    "verdict": lambda row: row.verdict + (": " + "; ".join(row.reasons) if row.reasons else ""),
}


ABOUT = """
This page shows how the model behaves in difficult cases, and the bounds by which each case is judged. It is written by
`pysph-boiling stress{options}`. A case passes if no bound below is exceeded at any step and its end state is sensible.
A case that fails stays in the table, with the reason.

*Energy rise* is the increase of kinetic plus potential energy, over m g H; it is given for cases in which nothing but
gravity does work. *H* is the height of the highest particle over the floor of the container at the start, *U* the
largest speed at the start. Safeguards are listed where they acted: steps that were split, the displacement limiter of
a sweep, projections into the container, steps that ended with a mean density error above `density.max_mean_error`
(unconverged), heat steps in one step, bubbles whose volume was held at its bounds. "What keeps it stable" in
[model.md](model.md) explains each of them.
""".strip()


def page(rows, bounds, options=""):
    """The blocks of the page that ``--report`` writes: the rows, and the bounds by which they were judged."""
    rules = [(rule, f"{entry['bound']:g}", entry["unit"], entry["reason"]) for rule, entry in bounds["rules"].items()]
    rules += [(f"{entry['rule']} of {', '.join(entry['cases'])}",
               "not judged" if entry["bound"] is None else f"{entry['bound']:g}",
               bounds["rules"][entry["rule"]]["unit"], entry["reason"]) for entry in bounds["exceptions"]]
    return ["# Hard cases: what stays stable, and what does not", ABOUT.format(options=options), counts(rows),
            markdown.table(COLUMNS, shown(rows)), "## Bounds",
            "The bounds are in `pysph_boiling/evaluation/stress/bounds.json`, and are read before anything runs.",
            markdown.table(("rule", "bound", "unit", "reason"), rules)]


def shown(rows):
    """The cells of rows, as texts."""
    return [[show_cell(row) for show_cell in COLUMNS.values()] for row in rows]


def counts(rows):
    """A sentence on how many cases passed."""
    verdicts = [row.verdict for row in rows]
    return (f"Of {len(rows)} cases, {verdicts.count('passes')} pass, {verdicts.count('refused')} are refused as they "
            f"must be, and {verdicts.count('fails')} fail.")


def stress(arguments):
    """Run the cases and print the table; returns its rows.

    Errors: ``ValueError`` with the known names for an unknown case; ``CheckFailed`` if a case fails.
    """
    from rich.console import Console
    from rich.table import Column

    parser = Parser(prog="pysph-boiling stress", description=(
        "Run difficult cases, and judge by fixed bounds whether they stay stable."))
    parser.add_argument("case", nargs="*", metavar="CASE", help="names of cases, or patterns for them; default all")
    add_report_options(parser, quick="run short forms of the cheap cases", report="write the table to this file",
                       json="write the rows to this file")
    parser.add_argument("--jobs", type=int, default=1, help="number of cases at the same time; default 1")
    parser.add_argument("--list", action="store_true", help="list the cases without running them")
    options = parser.parse_args(arguments)
    bounds, known = load_bounds(), all_cases()
    for pattern in options.case:
        if not fnmatch.filter(known, pattern):
            raise unknown("case", pattern, known)
    check_count(options.jobs)
    chosen = [case for name, case in known.items()
              if not options.case or any(fnmatch.fnmatch(name, pattern) for pattern in options.case)]
    asked = [(case, case.quick if options.quick else case.steps) for case in chosen if case.quick or not options.quick]
    console = Console(highlight=False)
    if options.list:
        for case, steps in asked:
            console.print(f"{case.name}: {case.hard} ({steps:,} steps)")
        return []

    def report(row):
        console.print(f"{row.verdict:>8} {row.case} ({row.seconds:.1f} s of CPU)" + "".join(
            f"\n         {reason}" for reason in row.reasons))

    rows = run_all(asked, bounds, options.jobs, report)
    columns = [Column(name, no_wrap=name not in ("what is hard", "safeguards that acted", "verdict"))
               for name in COLUMNS]
    show(Console(highlight=False, width=max(console.width, WIDTH)), columns, shown(rows), title="hard cases")
    console.print(counts(rows))
    if options.json:
        write_json(options.json, [asdict(row) for row in rows])
    if options.report:
        markdown.write(options.report, *page(rows, bounds, " --quick" if options.quick else ""))
    failed = [row.case for row in rows if row.verdict == "fails"]
    if failed:
        raise CheckFailed(f"{len(failed)} of {len(rows)} cases: {', '.join(failed)}")
    return rows

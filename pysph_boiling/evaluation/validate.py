"""The command ``pysph-boiling validate``, which compares the model with formulas, experiments and stored statistics.

A case is a folder of ``validation``, beside this module. Its ``README.md`` gives formula and source, and a table with
one row for each comparison, with bounds and their reason. Its ``case.py`` has three functions:

    run(quick)                  simulates; returns the input of the others
    rows(outcomes)              yields (name of a row, number, text for it)
    draw(outcomes, path)        draws one picture, with the functions for the figures of the paper

The bounds are read from the README before anything runs, so a run cannot change them.
"""
import importlib.util
import json
import os
import platform
import re
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from time import process_time

from pysph_boiling import __version__
from pysph_boiling.checks import CheckFailed
from pysph_boiling.names import Parser, add_renamed, unknown
from pysph_boiling.report import markdown
from pysph_boiling.report.options import add_report_options
from pysph_boiling.report.terminal import show
from pysph_boiling.runs.jobs import Job, check_count, results, run_jobs
from pysph_boiling.runs.ledger import write_json
from pysph_boiling.runs.provenance import processor

__all__ = ["COLUMNS", "KINDS", "Bounds", "Row", "cases", "measure", "page", "read_bounds", "validate"]

FOLDER = Path(__file__).with_name("validation")
KINDS = {
    "experiment": ("Real experiments", "against what was measured on real bubbles and in real boiling"),
    "validation": ("Validation", "against a formula, an experiment or a paper"),
    "verification": ("Verification", "against a conservation law, or against a run with another numerical setting"),
    "regression": ("Regression", "against statistics of earlier runs of this model"),
}
COLUMNS = ("row", "kind", "what", "reference", "from", "to", "why these bounds", "if it fails")


@dataclass(frozen=True)
class Bounds:
    """One row of a case's table: what is compared with what, the bounds, and their reason.

    ``low`` and ``high`` may be ``None``; ``excuse`` is the reason of a known failure, and empty otherwise.
    """

    name: str
    kind: str
    what: str
    reference: str
    low: float | None
    high: float | None
    why: str
    excuse: str

    def __post_init__(self):
        if self.kind not in KINDS:
            raise ValueError(f"row '{self.name}': kind must be one of {', '.join(KINDS)}, got '{self.kind}'")
        if self.low is None and self.high is None:
            raise ValueError(f"row '{self.name}' has no bounds")
        if not self.why:
            raise ValueError(f"row '{self.name}' gives no reason for its bounds")

    def holds(self, value):
        """Whether a number is within the bounds, which NaN is not."""
        return bool((self.low is None or value >= self.low) and (self.high is None or value <= self.high)
                    and value == value)

    @property
    def text(self):
        """The bounds in words."""
        if self.low is None:
            return f"≤ {self.high:g}"
        return f"≥ {self.low:g}" if self.high is None else f"{self.low:g} to {self.high:g}"


@dataclass(frozen=True)
class Row:
    """The result of a run for one row of a case."""

    case: str
    bounds: Bounds
    value: float
    found: str

    @property
    def holds(self):
        return self.bounds.holds(self.value)

    @property
    def command(self):
        return f"pysph-boiling validate {self.case}"


def read_bounds(readme):
    """The rows of a case from the table in its README, name -> :class:`Bounds`.

    Errors: ``ValueError`` for a heading other than :data:`COLUMNS`, for a row given twice, and for a row without kind,
    bounds or reason.
    """
    lines = [line.strip() for line in Path(readme).read_text(encoding="utf-8").splitlines()]
    table = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines if line.startswith("|")]
    if not table or tuple(table[0]) != COLUMNS:
        raise ValueError(f"{readme}: the table of rows must have the columns {', '.join(COLUMNS)}")
    found = {}
    for name, kind, what, reference, low, high, why, excuse in table[2:]:
        name = name.strip("`")
        if name in found:
            raise ValueError(f"{readme}: row '{name}' is given twice")
        found[name] = Bounds(name, kind, what, reference, *(float(text) if text else None for text in (low, high)), why,
                             excuse)
    return found


def cases():
    """Name -> folder of every case."""
    return {path.parent.name: path.parent for path in sorted(FOLDER.glob("*/case.py"))}


def load(folder):
    """The module ``case.py`` of a case."""
    spec = importlib.util.spec_from_file_location(f"validation_{folder.name}", folder / "case.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def measure(folder, quick, drawn=None):
    """Run a case; returns its list of :class:`Row` in the order of its README, and writes its picture to ``drawn``.

    The quick form may leave out rows, but the full form may not. Errors: ``ValueError`` for a row that is not in the
    README, or that is missing.
    """
    bounds, case = read_bounds(folder / "README.md"), load(folder)
    outcomes = case.run(quick)
    found = {}
    for name, value, text in case.rows(outcomes):
        if name not in bounds:
            raise ValueError(f"{folder.name}: row '{name}' is not in its README")
        found[name] = Row(folder.name, bounds[name], float(value), text)
    missing = [name for name in bounds if name not in found]
    if missing and not quick:
        raise ValueError(f"{folder.name}: nothing was measured for {', '.join(missing)}")
    if drawn is not None:
        case.draw(outcomes, drawn)
    return [found[name] for name in bounds if name in found]


def timed(folder, quick, drawn):
    """The result of :func:`measure`, and its processor time [s]."""
    begin = process_time()
    return measure(folder, quick, drawn), process_time() - begin


# --- the page ---------------------------------------------------------------------------------------------------------


def verdict(row):
    """Text for a cell that says whether the row holds, and if not, the reason if it is known."""
    if row.holds:
        return "holds"
    return f"**fails**: {row.bounds.excuse}" if row.bounds.excuse else "**fails**"


def title(folder):
    """The heading of a case's README."""
    return (folder / "README.md").read_text(encoding="utf-8").splitlines()[0].lstrip("# ")


def page(records, path, *, quick=False):
    """The blocks of the page ``path``: a table for each kind, the coverage by tests, and a picture of each case.

    ``records`` maps a case to its record: ``rows`` (list of :class:`Row`), ``origin`` and ``seconds`` [s].
    """
    place = {name: os.path.relpath(folder, path.parent) for name, folder in cases().items()}
    rows = [row for name in place if name in records for row in records[name]["rows"]]
    yield "# What was validated, and how well"
    yield ("<!-- Written by `pysph-boiling validate`. Change the cases in pysph_boiling/evaluation/validation, not "
           "this file. -->")
    yield (FOLDER / "intro.md").read_text(encoding="utf-8").strip()
    yield "This is the quick form, which is coarse and leaves out some rows." if quick else ""
    yield f"{len(rows)} rows, {sum(not row.holds for row in rows)} of which fail and say why."
    for kind, (name, against) in KINDS.items():
        own = [row for row in rows if row.bounds.kind == kind]
        if own:
            yield f"## {name}: {against}"
            yield markdown.table(
                ("case", "experiment", "source", "ours", "measured range, and why", "") if kind == "experiment" else
                ("case", "what", "reference", "found", "bounds, and why", ""),
                [(f"[{row.case}]({place[row.case]}/README.md)", row.bounds.what, row.bounds.reference, row.found,
                  f"{row.bounds.text}: {row.bounds.why}", verdict(row)) for row in own])
    yield (FOLDER / "covered.md").read_text(encoding="utf-8").strip()
    yield "## How each was made"
    for name in place:
        if name in records:
            one, heading = records[name], title(FOLDER / name)
            yield (f"{heading}: `pysph-boiling validate {name}`, {one['seconds']:.0f} s of processor time; "
                   f"{one['origin']}.")
            yield f"![{heading}](images/{picture(path, name)})"


def picture(path, name):
    """File name of a case's picture, in the folder ``images`` beside the page ``path``."""
    return f"{path.stem}_{name}.png"


def origin():
    """Version, precision and processor with which a case was measured."""
    return f"pysph_boiling {__version__}, double precision, OpenMP, {processor() or platform.machine()}"


def stored(path):
    """The records of ``validation.json``, without removed cases; empty if there is no file."""
    def row(case, bounds, value, found):
        return Row(case, Bounds(**bounds), value, found)

    raw = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    return {name: {**raw[name], "rows": [row(**one) for one in raw[name]["rows"]]} for name in cases() if name in raw}


# --- the command ------------------------------------------------------------------------------------------------------


def validate(arguments):
    """Run cases, print their table, draw their pictures, and write the page.

    The full form writes ``docs/validation.md`` of the checkout, with earlier results of all other cases from the JSON
    file beside it. The quick form, and an installed package, write a page of their own.

    Errors: ``ValueError`` for an unknown case, ``ChildProcessError`` where a case could not be
    run, once all others were, ``CheckFailed`` where a row fails that is not known to fail.
    """
    from rich.console import Console
    from rich.markup import escape

    parser = Parser(prog="pysph-boiling validate", description="Compare the model with "
                                     "formulas, experiments and statistics of earlier runs.")
    parser.add_argument("case", nargs="*", metavar="CASE", help="cases to run; default all")
    add_report_options(
        parser, quick="use coarse runs, which take three minutes instead of half an hour",
        json="write the rows to this file", report="write the page to this file, and pictures beside it; default "
        "docs/validation.md of a checkout, or validate/validation.md with --quick and in an installed package")
    add_renamed(parser, "--directory", "--report FILE.md")
    parser.add_argument("--jobs", type=int, default=1, help="number of cases at the same time, each with its own "
                        "threads; default 1")
    parser.add_argument("--list", action="store_true", help="list the cases without running them")
    options = parser.parse_args(arguments)
    known, console = cases(), Console()
    for name in options.case:
        if name not in known:
            raise unknown("case", name, known)
    check_count(options.jobs)
    if options.list:
        show(console, ("case", "title", "rows"),
             [(name, title(folder), f"{len(read_bounds(folder / 'README.md'))}") for name, folder in known.items()])
        return
    docs = FOLDER.parents[2] / "docs"  # which an installed package does not have
    written = Path("validate") if options.quick or not docs.is_dir() else docs
    path = Path(options.report or written / "validation.md")
    images = path.parent / "images"
    images.mkdir(parents=True, exist_ok=True)
    names = list(dict.fromkeys(options.case or known))
    records = {} if options.quick else stored(path.with_suffix(".json"))

    def ended(outcome):
        name = outcome.job.name
        if outcome.failure:
            console.print(f"{name}: {outcome.failure}", markup=False)
            return
        own, seconds = outcome.value
        records[name] = dict(origin=origin(), seconds=round(seconds, 1), rows=own)
        write_json(path.with_suffix(".json"), {case: {**one, "rows": [asdict(row) for row in one["rows"]]}
                                               for case, one in sorted(records.items())})
        console.print(f"{name}: {seconds:.0f} s of processor time", highlight=False)

    outcomes = run_jobs([
        Job(name=name, call=(timed, known[name], options.quick, images / picture(path, name)))
        for name in names], options.jobs, ended=ended)
    names = [outcome.job.name for outcome in outcomes if not outcome.failure]
    markdown.write(path, *page(records, path, quick=options.quick))

    rows = [row for name in names for row in records[name]["rows"]]
    for kind, (name, against) in KINDS.items():
        own = [row for row in rows if row.bounds.kind == kind]
        if own:
            words = ["holds" if row.holds else "[yellow]fails, known" if row.bounds.excuse else "[red]FAILS"
                     for row in own]
            show(console, ("case", "what", "found", "bounds", ""),
                 [(row.case, escape(row.bounds.what), escape(row.found), row.bounds.text, word)
                  for row, word in zip(own, words)], title=f"{name}: {against}")
    console.print(f"page: {path}; pictures in {images}")
    if options.json:
        write_json(options.json, dict(quick=options.quick, seconds={name: records[name]["seconds"] for name in names},
                                      rows=[dict(case=row.case, value=row.value, found=row.found, holds=row.holds,
                                                 command=row.command, **asdict(row.bounds)) for row in rows]))
    results(outcomes)
    broken = [row for row in rows if not row.holds and not row.bounds.excuse]
    if broken:
        raise CheckFailed("; ".join(f"{row.case}: {row.bounds.what}: {row.found}" for row in broken))


if __name__ == "__main__":
    validate(sys.argv[1:])

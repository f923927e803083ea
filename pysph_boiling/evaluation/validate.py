"""The command ``pysph-boiling validate``: the model against formulas, experiments, and its own stored statistics.

A case is a folder of ``tests/validation``. Its ``README.md`` gives formula and source, and a table of its rows: what is
compared with what, the bounds and their reason. Its ``case.py`` has three functions:

    run(quick)                  simulates; returns what the others need
    rows(outcomes)              yields (name of a row, number, text that shows it)
    draw(outcomes, path)        one picture, drawn by the functions that the figures of the paper use

The bounds are read from the README before anything runs, so no run can move them.
"""
import argparse
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
from pysph_boiling.names import unknown
from pysph_boiling.report import markdown
from pysph_boiling.report.options import add_renamed, add_report_options
from pysph_boiling.report.terminal import show
from pysph_boiling.runs.application import processor
from pysph_boiling.runs.jobs import Job, check_count, results, run_jobs
from pysph_boiling.runs.ledger import write_json

__all__ = ["COLUMNS", "KINDS", "Bounds", "Row", "cases", "measure", "page", "read_bounds", "validate"]

FOLDER = Path(__file__).parents[2] / "tests" / "validation"
KINDS = {
    "validation": ("Validation", "against a formula, an experiment or a paper"),
    "verification": ("Verification", "against a conservation law, or against the same with another numerical setting"),
    "regression": ("Regression", "against statistics of our own earlier runs"),
}
COLUMNS = ("row", "kind", "what", "reference", "from", "to", "why these bounds", "if it fails")


@dataclass(frozen=True)
class Bounds:
    """One row of a case's table: what is compared with what, within which bounds, and why.

    ``low`` and ``high`` may be ``None``; ``excuse`` says why the row is known to fail, and is empty where it holds.
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
        """Whether a number lies within the bounds; a NaN does not."""
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
    """What a run found for one row of a case."""

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
    """The rows of a case from the one table of its README, name -> :class:`Bounds`.

    Errors: ``ValueError`` for another heading than :data:`COLUMNS`, a row given twice, or one without kind, bounds or
    reason.
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
    """Name -> folder of every case. Raises ``ValueError`` outside a checkout."""
    found = {path.parent.name: path.parent for path in sorted(FOLDER.glob("*/case.py"))}
    if not found:
        raise ValueError("validate needs a checkout of the repository, which has its cases in tests/validation; this "
                         f"is an installed package, in {FOLDER.parents[1]}: clone the repository and run it there")
    return found


def load(folder):
    """The module ``case.py`` of a case."""
    spec = importlib.util.spec_from_file_location(f"validation_{folder.name}", folder / "case.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def measure(folder, quick, drawn=None):
    """Run a case; returns its list of :class:`Row`, in the order of its README. Its picture goes to ``drawn``.

    The quick form may leave rows out, the full one may not. Errors: ``ValueError`` for a row that the README does not
    have, or that is missing.
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
    """What :func:`measure` returns, and the processor time that it took [s]."""
    begin = process_time()
    return measure(folder, quick, drawn), process_time() - begin


# --- the page ---------------------------------------------------------------------------------------------------------


def verdict(row):
    """In one cell: whether the row holds; why not, where that is known."""
    if row.holds:
        return "holds"
    return f"**fails**: {row.bounds.excuse}" if row.bounds.excuse else "**fails**"


def title(folder):
    """Heading of a case's README."""
    return (folder / "README.md").read_text(encoding="utf-8").splitlines()[0].lstrip("# ")


def page(records, path, *, quick=False):
    """The blocks of the page ``path``: a table for each kind, what tests cover, a picture of each case.

    ``records`` maps a case to its record: ``rows`` (list of :class:`Row`), ``origin`` and ``seconds`` [s].
    """
    place = {name: os.path.relpath(folder, path.parent) for name, folder in cases().items()}
    rows = [row for name in place if name in records for row in records[name]["rows"]]
    yield "# What was validated, and how well"
    yield "<!-- Written by `pysph-boiling validate`. Change the cases in tests/validation, not this file. -->"
    yield (FOLDER / "intro.md").read_text(encoding="utf-8").strip()
    yield "This is the quick form: coarse, and with rows left out." if quick else ""
    yield f"{len(rows)} rows, {sum(not row.holds for row in rows)} of which fail and say why."
    for kind, (name, against) in KINDS.items():
        own = [row for row in rows if row.bounds.kind == kind]
        if own:
            yield f"## {name}: {against}"
            yield markdown.table(
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
    """With what and on what a case was measured."""
    return f"pysph_boiling {__version__}, double precision, OpenMP, {processor() or platform.machine()}"


def stored(path):
    """The records of ``validation.json``, without those of cases that are no more; empty where there is no file."""
    def row(case, bounds, value, found):
        return Row(case, Bounds(**bounds), value, found)

    raw = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    return {name: {**raw[name], "rows": [row(**one) for one in raw[name]["rows"]]} for name in cases() if name in raw}


# --- the command ------------------------------------------------------------------------------------------------------


def validate(arguments):
    """Run cases, print their table, draw their pictures, and write the page.

    The full form writes ``docs/validation.md``; cases that are not asked for keep what the JSON file beside it has of
    them. The quick form writes a page of its own.

    Errors: ``ValueError`` for an unknown case or outside a checkout, ``ChildProcessError`` where a case could not be
    run, once all others were, ``CheckFailed`` where a row fails that is not known to fail.
    """
    from rich.console import Console
    from rich.markup import escape

    parser = argparse.ArgumentParser(prog="pysph-boiling validate", description="The model against formulas, "
                                     "experiments, and its own stored statistics.")
    parser.add_argument("case", nargs="*", metavar="CASE", help="which ones; all if none is named")
    add_report_options(
        parser, quick="coarse, three minutes instead of half an hour", json="write the rows there",
        report="the page, beside which pictures go; default docs/validation.md, in the quick form "
               "validate/validation.md")
    add_renamed(parser, "--directory", "--report FILE.md")
    parser.add_argument("--jobs", type=int, default=1, help="cases side by side, each on its own threads; default 1")
    parser.add_argument("--list", action="store_true", help="print the cases and stop")
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
    path = Path(options.report or (Path("validate") if options.quick else FOLDER.parents[1] / "docs") / "validation.md")
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

"""Runs the main benchmarks in their quick forms, and prints one table of their results: ``make bench``.

    python benchmarks/summary.py [--against REV] [--only NAME ...] [--report FILE.md]

Each benchmark also prints its own tables. ``--against`` lets boil.py measure another version, too. The other codes of
peers.py are only run if they are installed already. The first run compiles for half an hour, mostly for
effects_cost.py.

The exit status is 1 unless the claims of every benchmark that ran hold.
"""
import argparse
import json
import os
import sys
import tempfile
from pathlib import Path

import boil
import machine
import peers
from rich.console import Console

from pysph_boiling.report import markdown
from pysph_boiling.report.options import add_report_options
from pysph_boiling.report.terminal import show
from pysph_boiling.runs.jobs import Job, run_job

HEAD = ("benchmark", "what", "found")


def boil_rows(found):
    """(what, figure) of the figures of boil.py."""
    for row in found:
        where = f"steady boiling, {row['particles']} particles, h/dx {row['hdx']:g}"
        mine, *others = row["versions"].values()
        for part in (boil.WHOLE, "search", "density", boil.FILE):
            yield f"{where}: {part}", "{least:.1f} ms, median {median:.1f} ms".format(**mine["parts"][part])
        yield f"{where}: outside the stages, of the mean step", f"{mine['outside']:.1%}"
        for name, other in zip(list(row["versions"])[1:], others):
            ratio = boil.times_as_fast(mine, other, boil.WHOLE)
            yield f"{where}: times as fast as {name}", "{least:.2f}, median {median:.2f}".format(**ratio)
        for one in row["same"]:
            yield f"{where}: {one['claim']}", f"{'holds' if one['holds'] else 'FAILS'}: {one['found']}"


def size_rows(found):
    """(what, figure) of the figures of size.py."""
    for row in found["rows"]:
        yield (f"{row['fluid'] + row['wall']:,} particles: time of a particle and step",
               f"{row['ns']:.0f} ns ({row['low']:.0f}-{row['high']:.0f}), {row['share']['search']:.0%} of it searching")
    yield "largest time of a particle over the smallest", f"{found['flatness']:.2f}"
    yield "memory of a particle", f"{found['bytes']:.0f} bytes"


def effects_rows(found):
    """(what, figure) of the figures of effects_cost.py."""
    for name, what in (("PBF", "the density constraint alone"), ("full", "the full model, boiling")):
        yield f"{found['particles']} particles: {what}", f"{found['ms'][name]:.1f} ms a step"
    for name, what in (("full", "the full model"), ("without expansion", "the same without expansion")):
        yield f"{what} before anything boils, over motion with heat", f"{found['idle'][name]:.2f} times its time"
    for claim, holds in found["claims"].items():
        yield claim, "holds" if holds else "FAILS"


def peers_rows(found):
    """(what, figure) of the figures of peers.py."""
    for row in found["ratios"]:
        at = f"{peers.EQUAL_SWEEPS} sweeps" if row["error"] is None else f"a density error of {row['error']:.2%}"
        yield (f"{row['scene']}, {row['threads']} threads, at {at}: times as fast as {row['peer']}",
               f"{row['median']:.2f} ({row['low']:.2f}-{row['high']:.2f})")
    for sentence in found["failed"] + found["different"]:
        yield "FAILS", sentence


BENCHMARKS = {"boil": boil_rows, "size": size_rows, "effects_cost": effects_rows, "peers": peers_rows}
OPTIONS = {"peers": ["--no-install"]}


def run(name, options, folder):
    """Run one benchmark; returns its rows of the table, and whether its claims hold or its codes are not installed."""
    path = Path(folder) / f"{name}.json"
    script = Path(__file__).with_name(f"{name}.py")
    outcome = run_job(Job(name=name, command=(
        sys.executable, str(script), "--quick", "--json", str(path), *OPTIONS.get(name, ()), *options)))
    if not path.exists():
        absent = outcome.status == peers.NOT_INSTALLED
        return [(name, "did not run", "the other codes are not installed" if absent else outcome.failure)], absent
    rows = [(name, what, figure) for what, figure in BENCHMARKS[name](json.loads(path.read_text()))]
    return rows, not outcome.failure


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--against", metavar="REV", help="another version that boil.py measures too")
    parser.add_argument("--only", nargs="+", choices=BENCHMARKS, default=list(BENCHMARKS), metavar="NAME",
                        help=f"of {', '.join(BENCHMARKS)}")
    add_report_options(parser, report="write the table to this file", json=None)
    options = parser.parse_args(argv)
    rows, good, begin = [], True, os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as folder:
        for name in options.only:
            against = ["--against", options.against] if name == "boil" and options.against else []
            found, fine = run(name, against, folder)
            rows += found
            good &= fine
    title = f"Quick forms, {machine.processors()}, load {begin:.1f} before and {os.getloadavg()[0]:.1f} after"
    show(Console(width=160), HEAD, rows, title)
    if options.report:
        markdown.write(options.report, title, markdown.table(HEAD, rows))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())

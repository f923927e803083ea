"""Runs a problem in a child process, and stores the results of all runs in a file."""
import hashlib
import json
import math
import os
from functools import cache
from pathlib import Path

import pysph_boiling
from pysph_boiling.runs.jobs import Job, run_job
from pysph_boiling.runs.ledger import write_json

__all__ = ["Points", "digest", "measure"]

MODEL = ("*.py", "equations/*.py", "schemes/**/*.py", "problems/*.py", "examples/*.py")  # sources of a run


@cache
def digest():
    """Short hash of the sources that a run depends on, so that every point is measured again after a change."""
    root, found = Path(pysph_boiling.__file__).parent, hashlib.sha256()
    for file in sorted(file for pattern in MODEL for file in root.glob(pattern) if file.name != "cli.py"):
        found.update(file.relative_to(root).as_posix().encode() + file.read_bytes())
    return found.hexdigest()[:12]


def perform(problem, threads):
    """Run a problem in this process; returns the record of its point."""
    from pysph.base.nnps_base import set_number_of_threads

    set_number_of_threads(threads)
    found = problem.run()
    return dict(errors=found.errors, facts=found.facts, seconds=found.seconds, simulated=found.simulated,
                steps=found.steps, particles=found.particles)


def measure(problem, threads=1):
    """The outcome of a run as a dict, with the load of the machine before it; ``failed`` gives the reason of a failure.
    """
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else math.nan
    outcome = run_job(Job(name=problem.title, call=(perform, problem, threads)))
    return {**(dict(failed=outcome.failure) if outcome.failure else outcome.value), "load": load}


class Points:
    """The points measured so far, in a JSON file with one record for each problem, number of threads and source state.

    A record has the outcome and the lists ``seconds`` and ``load`` with one entry per repeat; ``same`` is false if a
    repeat had different errors than the first run.
    """

    def __init__(self, file, threads=1):
        self.file, self.threads = Path(file), threads
        self.records = json.loads(self.file.read_text()) if self.file.exists() else {}

    def key(self, problem):
        """Short hash of everything on which the point depends."""
        text = f"{problem!r} {self.threads} {digest()}"
        return hashlib.sha256(text.encode()).hexdigest()[:16]

    def get(self, problem):
        """The record of a problem, or ``None`` if it was not run yet."""
        return self.records.get(self.key(problem))

    def repeats(self, problem):
        """Number of its runs; a point that failed counts as done."""
        record = self.get(problem)
        return 0 if record is None else math.inf if "failed" in record else len(record["seconds"])

    def add(self, problem):
        """Run the problem once more and write the file."""
        found, record = plain(measure(problem, self.threads)), self.get(problem)
        if record is None or "failed" in found:
            record = {"problem": repr(problem), **found, "seconds": [], "load": [], "same": True}
        if "failed" not in found:
            record["seconds"].append(found["seconds"])
            record["load"].append(found["load"])
            record["same"] = record["same"] and record["errors"] == found["errors"]
        self.records[self.key(problem)] = record
        write_json(self.file, self.records)
        return record


def plain(value):
    """A value that JSON can write; numbers that are not finite become ``None``."""
    if isinstance(value, dict):
        return {name: plain(one) for name, one in value.items()}
    if isinstance(value, (str, bool, type(None), int)):
        return value
    return float(value) if math.isfinite(value) else None

"""Simulations that a figure asks for: started once, kept, continued where they were interrupted."""
import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from pysph_boiling.examples import scene_class
from pysph_boiling.files import last_output, output_files
from pysph_boiling.runs.ledger import load_results
from pysph_boiling.threads import variables

__all__ = ["Result", "Run", "perform"]


@dataclass(frozen=True)
class Run:
    """One simulation: a scene and its command-line options.

    ``name`` is that of its folder, and the same wherever several figures use the run; ``alone`` keeps other runs from
    the machine while this one is timed.
    """

    name: str
    scene: str
    options: tuple[str, ...] = ()
    alone: bool = False

    @property
    def command(self):
        """What a reader would type."""
        return " ".join(["pysph-boiling", "run", self.scene, *self.options])


class Result:
    """A finished run: its results table, its record and its particle files."""

    def __init__(self, run, folder):
        self.run, self.folder = run, Path(folder)

    @cached_property
    def table(self):
        """Column name -> array (rows,), as in ``results.npz``."""
        return load_results(self.folder)

    @cached_property
    def record(self):
        """``run.json`` as a dict."""
        return json.loads((self.folder / "run.json").read_text())

    @cached_property
    def files(self):
        """Output files, in order of time."""
        return output_files(self.folder)

    @cached_property
    def times(self):
        """Time [s] of each output file, from its header: to load it takes a hundred times as long."""
        import h5py

        def time_of(file):
            with h5py.File(file, "r") as opened:
                return float(opened["solver_data"].attrs["t"])

        return np.array([time_of(file) for file in self.files])

    def arrays(self, t):
        """(arrays by name, time [s]) of the output nearest to ``t`` [s]."""
        from pysph_boiling.analysis.rendering import load_output

        return load_output(self.files[int(np.argmin(np.abs(self.times - t)))])


def wanted(run):
    """What a run is: its command, and every parameter that it leads to, so that changed defaults start it anew."""
    return f"{run.command}\n{scene_class(run.scene)().resolve(run.options)}\n"


def build(run):
    """What decides on the modules that a run compiles: its scene, and its options but for their numbers."""
    return run.scene, *(token for token in run.options if not token.replace(".", "", 1).isdigit())


def finished(run, folder):
    """Whether ``folder`` holds this very run, complete."""
    record, marker = Path(folder) / "run.json", Path(folder) / "asked.txt"
    return (record.exists() and marker.exists() and marker.read_text() == wanted(run)
            and bool(json.loads(record.read_text())["completed"]))


def start(run, folder, threads):
    """Start the run as a process of its own, from its last output if it was interrupted."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    marker, asked = folder / "asked.txt", wanted(run)
    last = last_output(folder) if marker.exists() and marker.read_text() == asked else None
    resume = ["--restart-file", last] if last else []
    if last:
        files = output_files(folder)
        for file in files[files.index(last) + 1:]:  # cut off
            os.remove(file)
    marker.write_text(asked)
    with open(folder / "console.txt", "a" if resume else "w") as log:
        return subprocess.Popen(
            [sys.executable, "-m", "pysph_boiling", "run", run.scene, *run.options, *resume, "--no-pictures",
             "--directory", str(folder)], stdout=log, stderr=subprocess.STDOUT, env=variables(threads))


def perform(runs, root, *, jobs=None, report=print):
    """Do the runs that are not done yet, ``jobs`` at a time with the cores shared out; returns name -> :class:`Result`.

    Each run has a folder below ``root``. Errors: ``ChildProcessError`` naming the runs that failed, once all others are
    done; an interrupt stops the running ones, which the next call continues.
    """
    root, cores = Path(root), os.cpu_count() or 1
    jobs = jobs or cores
    unique = {}
    for run in runs:
        if unique.setdefault(run.name, run) != run:
            raise ValueError(f"two different runs are called '{run.name}': {run.command} and "
                             f"{unique[run.name].command}")
    waiting = [run for run in unique.values() if not finished(run, root / run.name)]
    waiting.sort(key=lambda run: run.alone)  # what is timed comes last, with the machine to itself
    total, running, failed, compiled = len(waiting), {}, [], set()

    def compiling():
        """Whether the first run of some kind is not under way yet: two must not compile the same modules."""
        return any(build(run) not in compiled for run in running)

    try:
        while waiting or running:
            while waiting and len(running) < (1 if waiting[0].alone else jobs) and not compiling():
                run = waiting.pop(0)
                threads = cores if run.alone else max(1, cores // jobs)
                running[run] = start(run, root / run.name, threads), time.time()
                report(f"[{total - len(waiting)}/{total}] {run.name}: {run.command}")
            time.sleep(0.2)
            for run, (process, begin) in list(running.items()):
                if process.poll() is not None or any((root / run.name).glob("*_[0-9]*.hdf5")):
                    compiled.add(build(run))
                if process.poll() is None:
                    continue
                del running[run]
                if not finished(run, root / run.name):
                    failed.append(run.name)
                outcome = "failed" if run.name in failed else "done, but its final check failed" if \
                    process.returncode else "done"
                report(f"{run.name}: {outcome} after {time.time() - begin:.0f} s")
    finally:
        for process, _ in running.values():
            process.terminate()
            process.wait()
    if failed:
        raise ChildProcessError(f"these runs failed: {', '.join(failed)}; each has its console.txt in {root}")
    return {name: Result(run, root / name) for name, run in unique.items()}

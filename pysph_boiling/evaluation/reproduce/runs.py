"""The simulations of the figures: each is started once, stored, and continued if it was interrupted."""
import json
import os
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from pysph_boiling.examples import scene_class
from pysph_boiling.files import last_output, output_files
from pysph_boiling.results import SavedRun
from pysph_boiling.runs.jobs import Job, run_jobs
from pysph_boiling.threads import variables

__all__ = ["Run", "attempt", "perform"]


@dataclass(frozen=True)
class Run:
    """One simulation: a scene and its command-line options.

    ``name`` is the name of its folder, and is the same in all figures that use the run. ``alone`` means that no other
    run may use the machine, because this one is timed. ``resumes`` is false for a scene with a scheme of PySPH, which
    starts again if it was interrupted.
    """

    name: str
    scene: str
    options: tuple[str, ...] = ()
    alone: bool = False
    resumes: bool = True

    @property
    def command(self):
        """The command that a user would type for this run."""
        return " ".join(["pysph-boiling", "run", self.scene, *self.options])


def wanted(run):
    """The command of a run and all parameters that follow from it, so that changed defaults start it again."""
    return f"{run.command}\n{scene_class(run.scene)().resolve(run.options)}\n"


def build(run):
    """What decides which modules a run compiles: its scene, and its options without their numbers."""
    return run.scene, *(token for token in run.options if not token.replace(".", "", 1).isdigit())


def finished(run, folder):
    """Whether ``folder`` holds exactly this run, and it is complete."""
    record, marker = Path(folder) / "run.json", Path(folder) / "asked.txt"
    return (record.exists() and marker.exists() and marker.read_text() == wanted(run)
            and bool(json.loads(record.read_text())["completed"]))


def interrupted_at(run, folder):
    """The last complete output of exactly this run, which was interrupted; ``None`` if it must start again."""
    marker = Path(folder) / "asked.txt"
    return last_output(folder) if run.resumes and marker.exists() and marker.read_text() == wanted(run) else None


def job(run, folder, threads):
    """The run as a :class:`~pysph_boiling.runs.jobs.Job`, which resumes from its last output if it was interrupted."""
    last = interrupted_at(run, folder)
    resume = ["--restart-file", last] if last else []
    return Job(name=run.name, alone=run.alone, environment=variables(threads), log=folder / "console.txt",
               prepare=partial(prepare, run, folder), command=(
                   sys.executable, "-m", "pysph_boiling", "run", run.scene, *run.options, *resume, "--no-pictures",
                   "--directory", str(folder)))


def prepare(run, folder):
    """Prepare the folder of a run that is about to start."""
    folder.mkdir(parents=True, exist_ok=True)
    last = interrupted_at(run, folder)
    if last:
        files = output_files(folder)
        for file in files[files.index(last) + 1:]:  # cut off
            os.remove(file)
    else:
        (folder / "console.txt").unlink(missing_ok=True)
    (folder / "asked.txt").write_text(wanted(run))


def perform(runs, root, *, jobs=None, report=print):
    """:func:`attempt` runs of which none may fail; returns name -> :class:`~pysph_boiling.results.SavedRun`.

    Errors: ``ChildProcessError`` that names the runs that failed, after all others are done.
    """
    done, failed = attempt(runs, root, jobs=jobs, report=report)
    if failed:
        raise ChildProcessError(f"these runs failed: {', '.join(failed)}; each has its console.txt in {root}")
    return done


def attempt(runs, root, *, jobs=None, report=print):
    """Make the runs that are missing, ``jobs`` at a time, which share the cores.

    Returns (name -> :class:`~pysph_boiling.results.SavedRun` of those that are complete, name -> reason of those that
    failed). Each run has a folder below ``root``. An interrupt stops running ones, which the next call continues.
    """
    root, cores = Path(root), os.cpu_count() or 1
    jobs = jobs or cores
    unique = {}
    for run in runs:
        if unique.setdefault(run.name, run) != run:
            raise ValueError(f"two different runs are called '{run.name}': {run.command} and "
                             f"{unique[run.name].command}")
    waiting = [run for run in unique.values() if not finished(run, root / run.name)]
    waiting.sort(key=lambda run: run.alone)  # timed runs come last, and have the machine to themselves
    begun, failed, compiled = [], {}, set()

    def started(job):
        run = unique[job.name]
        begun.append(run)
        report(f"[{len(begun)}/{len(waiting)}] {run.name}: {run.command}")

    def compiling(running):
        """Whether the first run of some kind has not taken a step yet, since two must not compile the same modules."""
        compiled.update(build(unique[job.name]) for job in running if any((root / job.name).glob("*_[0-9]*.hdf5")))
        return any(build(unique[job.name]) not in compiled for job in running)

    def ended(outcome):
        run = unique[outcome.job.name]
        compiled.add(build(run))
        said = "done, but its final check failed" if outcome.failure else "done"
        if not finished(run, root / run.name):
            why = outcome.failure or "it is not complete"
            failed[run.name] = "; ".join([why, *outcome.output.splitlines()[-1:]])
            said = f"failed ({why})"
        report(f"{run.name}: {said} after {outcome.seconds:.0f} s")

    run_jobs([job(run, root / run.name, cores if run.alone else max(1, cores // jobs)) for run in waiting], jobs,
             hold=compiling, started=started, ended=ended)
    return {name: SavedRun(root / name) for name in unique if name not in failed}, failed

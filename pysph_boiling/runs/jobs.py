"""Jobs in child processes, several at a time and with limits, for all commands that start any.

A job is a command line or a call of a Python function. :func:`run_jobs` starts jobs, waits for them, and returns an
:class:`Outcome` for each, which describes every failure in the same way: an exit status, a signal, an exception, or a
limit of time or memory. If :func:`run_jobs` ends early, also by Ctrl-C, it ends the processes that still run.

    print(results(run_jobs([Job(name="a", call=(measure, 3)), Job(name="b", call=(measure, 4))], at_once=2)))
"""
import multiprocessing
import os
import signal
import subprocess
import time
import traceback
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import wait
from pathlib import Path

from pysph_boiling.threads import end_on_interrupt

__all__ = ["Job", "Outcome", "check_count", "results", "run_job", "run_jobs"]

INTERVAL = 0.05  # [s] between two checks of the processes
PATIENCE = 60.0  # [s] between asking a process to end and killing it
TAIL = 2000  # number of characters that are read from the end of a log


@dataclass(frozen=True, kw_only=True)
class Job:
    """The work of one process, either a ``command`` or a ``call``.

    Parameters
    ----------
    name : str
        Name of the job in messages.
    command : sequence of str
        A command line, beginning with the program.
    call : tuple
        A function and its arguments. The process is spawned, because OpenMP hangs in a fork of a process that has used
        threads; function, arguments and result are pickled.
    alone : bool
        Whether no other job may run at the same time.
    environment : dict or None
        All environment variables of the process; those of this process if ``None``.
    directory : path or None
        Working directory of a command; that of this process if ``None``.
    log : path or None
        File to which the process appends its output and errors; if ``None``, both go to those of this process.
    prepare : callable or None
        Called without arguments just before the process starts.
    time_limit, memory_limit : float or None
        Largest wall time [s] and address space [bytes] of the process. Memory is only limited on POSIX systems.

    Errors: ``ValueError`` unless exactly one of ``command`` and ``call`` is given.
    """

    name: str
    command: tuple[str, ...] = ()
    call: tuple | None = None
    alone: bool = False
    environment: dict | None = None
    directory: str | None = None
    log: str | None = None
    prepare: Callable | None = None
    time_limit: float | None = None
    memory_limit: int | None = None

    def __post_init__(self):
        if bool(self.command) == (self.call is not None):
            raise ValueError(f"job '{self.name}' needs a command or a call, and not both")


@dataclass(frozen=True)
class Outcome:
    """The outcome of a job.

    ``status`` is the exit status of the process, negative if a signal ended it, and ``seconds`` its wall time.
    ``failure`` describes what went wrong and is empty otherwise. ``value`` is the result of the function of a call.
    """

    job: Job
    status: int
    seconds: float
    failure: str = ""
    value: object = None

    def result(self):
        """The value. Raises ``ChildProcessError`` with name, failure and end of the log if the job has failed."""
        if self.failure:
            raise ChildProcessError("\n".join(filter(None, (f"{self.job.name}: {self.failure}", self.output))))
        return self.value

    @property
    def output(self):
        """The end of the job's log; empty if there is no log."""
        path = Path(self.job.log or os.devnull)
        return path.read_text(encoding="utf-8", errors="replace")[-TAIL:] if path.is_file() else ""


def results(outcomes):
    """The values of jobs. Raises ``ChildProcessError`` with a line for each that failed."""
    failed = [f"{outcome.job.name}: {outcome.failure}" for outcome in outcomes if outcome.failure]
    if failed:
        raise ChildProcessError("\n".join(failed))
    return [outcome.value for outcome in outcomes]


def run_job(job):
    """Run one job; returns its :class:`Outcome`."""
    return run_jobs([job])[0]


def run_jobs(jobs, at_once=1, *, hold=lambda running: False, started=lambda job: None, ended=lambda outcome: None):
    """Run jobs; returns the :class:`Outcome` of each, in the order of the jobs. A failure does not stop other jobs.

    Parameters
    ----------
    jobs : iterable of Job
        They start in this order.
    at_once : int
        Number of jobs that run at the same time.
    hold : callable
        Called with the list of running jobs. While it returns true, no other job starts.
    started, ended : callable
        Called with a job when its process has started, and with an outcome when the process has ended.
    """
    jobs = list(jobs)
    waiting, running, outcomes = list(enumerate(jobs)), {}, {}
    try:
        while waiting or running:
            while waiting and has_room(waiting[0][1], running.values(), at_once) and not hold(
                    [child.job for child in running.values()]):
                number, job = waiting.pop(0)
                running[number] = Child(job)
                started(job)
            wait([child.pipe for child in running.values() if child.pipe], INTERVAL)
            for number, child in list(running.items()):
                if child.has_ended():
                    del running[number]
                    outcomes[number] = child.outcome()
                    ended(outcomes[number])
    finally:
        for child in running.values():
            child.process.terminate()
        for child in running.values():
            child.stop()
    return [outcomes[number] for number in range(len(jobs))]


def has_room(job, running, at_once):
    """Whether the job may start while the given children run."""
    return len(running) < (1 if job.alone else at_once) and not any(child.job.alone for child in running)


def check_count(jobs):
    """Raise ``ValueError`` unless the option ``--jobs`` is between 1 and the number of cores."""
    cores = os.cpu_count() or 1
    if not 1 <= jobs <= cores:
        raise ValueError(f"--jobs must be 1 to {cores}, got {jobs}")


class Child:
    """The process of a job: a ``Popen`` of a command, or a ``Process`` whose result comes through ``pipe``."""

    def __init__(self, job):
        self.job, self.pipe, self.answer, self.failure = job, None, None, ""
        if job.prepare:
            job.prepare()
        self.begin = time.monotonic()
        if job.call:
            context = multiprocessing.get_context("spawn")
            self.pipe, theirs = context.Pipe(duplex=False)
            self.process = context.Process(target=answer, args=(job.call, job.memory_limit, job.log, theirs))
            with variables_of(job):
                self.process.start()
            theirs.close()
        else:
            with open(job.log, "a") if job.log else open(os.devnull) as log:
                output = dict(stdout=log, stderr=subprocess.STDOUT) if job.log else {}
                self.process = subprocess.Popen(
                    job.command, env=job.environment, cwd=job.directory, **output,
                    preexec_fn=(lambda: limit_memory(job.memory_limit)) if job.memory_limit else None)

    @property
    def status(self):
        """Exit status; ``None`` while the process runs."""
        return self.process.exitcode if self.job.call else self.process.poll()

    def join(self, seconds):
        """Wait up to so many ``seconds`` for the process to end."""
        if self.job.call:
            self.process.join(seconds)
            return
        try:
            self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            pass

    def has_ended(self):
        """Whether the process has ended; a process that exceeds its time limit is stopped."""
        if self.pipe and self.pipe.poll():
            try:
                self.answer = self.pipe.recv()
            except EOFError:  # it died
                pass
            self.pipe.close()
            self.pipe = None
            self.process.join()
        if self.status is None and self.job.time_limit and time.monotonic() - self.begin > self.job.time_limit:
            self.failure = f"the process took longer than {self.job.time_limit:g} s"
            self.stop()
        return self.status is not None and self.pipe is None

    def stop(self):
        """End the process, and wait until it has ended."""
        self.process.terminate()
        self.join(PATIENCE)
        if self.status is None:
            self.process.kill()
            self.join(None)

    def outcome(self):
        value, failure = self.answer or (None, "")
        return Outcome(self.job, self.status, time.monotonic() - self.begin,
                       self.failure or failure or describe_status(self.status), value)


def describe_status(status):
    """What an exit status says, empty for none."""
    if status < 0:
        return f"the process was ended by {signal.Signals(-status).name}"
    return f"the process ended with exit status {status}" if status else ""


@contextmanager
def variables_of(job):
    """Inside this block this process has the environment of a job, which a child process inherits."""
    before = dict(os.environ)
    try:
        if job.environment is not None:
            os.environ.clear()
            os.environ.update(job.environment)
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


# --- in the process of a call -----------------------------------------------------------------------------------------


def answer(call, memory, log, pipe):
    """Call the function, and send its value and a description of what went wrong."""
    end_on_interrupt()
    limit_memory(memory)
    if log:
        with open(log, "a") as file:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
    function, *arguments = call
    try:
        found = function(*arguments), ""
    except MemoryError as error:
        limit = f" (it may use {memory / 2**30:g} GiB)" if memory else ""
        found = None, f"the process ran out of memory{limit}: {error}".removesuffix(": ")
    except Exception as error:  # the outcome describes any error
        found = None, f"{type(error).__name__}: {error}"
        if not isinstance(error, (ValueError, OSError, ArithmeticError)):  # a fault of ours
            traceback.print_exc()
    pipe.send(found)


def limit_memory(size):
    """Limit the address space of this process [bytes], if the system supports that."""
    try:
        import resource

        if size:
            resource.setrlimit(resource.RLIMIT_AS, (size, size))
    except (ImportError, ValueError):
        pass

"""Jobs in processes of their own, for every command that starts some: several at a time, with limits.

A job is a command line or a call of a Python function. :func:`run_jobs` starts them, waits for them, and returns an
:class:`Outcome` of each, which says in one way what went wrong: an exit status, a signal, an exception, the limit of
time or that of memory. Whatever ends :func:`run_jobs` early, Ctrl-C too, ends the processes that still run.

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

INTERVAL = 0.05  # [s] between two looks at the processes
PATIENCE = 60.0  # [s] that a process has to end when it is asked to, before it is killed
TAIL = 2000  # characters of a log that are read


@dataclass(frozen=True, kw_only=True)
class Job:
    """What one process does. Give either ``command`` or ``call``.

    Parameters
    ----------
    name : str
        How messages call the job.
    command : sequence of str
        A command line, program first.
    call : tuple
        A function and its arguments. The process is a fresh one, since OpenMP waits for ever in a fork of a process
        that has used threads; function, arguments and result are pickled.
    alone : bool
        No other job runs beside this one.
    environment : dict or None
        All environment variables of the process; those of this process if ``None``.
    directory : path or None
        Working directory of a command; that of this process if ``None``.
    log : path or None
        File to which the process appends its output and its errors; both go where those of this process go if ``None``.
    prepare : callable or None
        Called, without arguments, right before the process starts.
    time_limit, memory_limit : float or None
        Wall time [s] and address space [bytes] that the process may take. Memory is limited on POSIX systems only.

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
    """How a job ended.

    ``status`` is the exit status of the process, negative where a signal ended it, and ``seconds`` the wall time that
    it took. ``failure`` says what went wrong, and is empty where nothing did. ``value`` is what the function of a call
    returned.
    """

    job: Job
    status: int
    seconds: float
    failure: str = ""
    value: object = None

    def result(self):
        """The value. Raises ``ChildProcessError`` with name, failure and the end of the log of a job that failed."""
        if self.failure:
            raise ChildProcessError("\n".join(filter(None, (f"{self.job.name}: {self.failure}", self.output))))
        return self.value

    @property
    def output(self):
        """The end of the job's log; empty where there is none."""
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
    """Run jobs; returns their :class:`Outcome` in the order in which they were given. A failure stops no other job.

    Parameters
    ----------
    jobs : iterable of Job
        They start in this order.
    at_once : int
        How many run side by side.
    hold : callable
        Called with the list of the jobs that run. While it returns true, no other job starts.
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
    """Whether the job may start beside the children that run."""
    return len(running) < (1 if job.alone else at_once) and not any(child.job.alone for child in running)


def check_count(jobs):
    """Raise ``ValueError`` unless the option ``--jobs`` is a number from 1 to that of the cores."""
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
        """Wait so long for the process to end."""
        if self.job.call:
            self.process.join(seconds)
            return
        try:
            self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            pass

    def has_ended(self):
        """Whether the process is over; one that has used up its time is ended."""
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
    """This process has the environment of a job, which a process that it starts takes over."""
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
    """Call the function, and send the pair of its value and of what went wrong."""
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
    except Exception as error:  # whatever it is, the outcome says it
        found = None, f"{type(error).__name__}: {error}"
        if not isinstance(error, (ValueError, OSError, ArithmeticError)):  # a fault of ours
            traceback.print_exc()
    pipe.send(found)


def limit_memory(size):
    """Limit the address space of this process [bytes], where the system can."""
    try:
        import resource

        if size:
            resource.setrlimit(resource.RLIMIT_AS, (size, size))
    except (ImportError, ValueError):
        pass

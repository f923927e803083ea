"""How OpenMP threads wait for each other: they spin for some microseconds, then they sleep.

A step of a small scene opens about a hundred parallel regions. Threads that sleep at once take longer to wake up than
a region takes (a fifth of a step at 5,000 particles on two threads). Threads that keep spinning take the processor
from other programs, so that two runs side by side take 8 times as long; with a thousand spins they take a tenth longer.
"""
import os
import signal

__all__ = ["WAITING", "end_on_interrupt", "variables", "wait_briefly"]

WAITING = {"OMP_WAIT_POLICY": "passive", "GOMP_SPINCOUNT": "1000"}


def wait_briefly():
    """Set this policy for the process, before any OpenMP library is loaded; a policy set by the user is kept."""
    if "OMP_WAIT_POLICY" not in os.environ:
        os.environ.update(WAITING)


def end_on_interrupt():
    """Let Ctrl-C end this child process at once and silently, since its parent reports the interruption."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def variables(threads):
    """Environment variables for a child process that runs on ``threads`` threads."""
    return {**os.environ, **WAITING, "OMP_NUM_THREADS": str(threads)}

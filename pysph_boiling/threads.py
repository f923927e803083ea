"""How OpenMP's threads wait for each other: they spin for some microseconds, then they sleep.

A step of a small scene opens some hundred parallel regions. Threads that sleep at once take longer to wake up than the
regions take (a fifth of a step at 5,000 particles on two threads); threads that spin on steal the processor from
whatever else runs, so that two runs side by side collapse (8 times the time). A thousand spins cost a tenth there.
"""
import os
import signal

__all__ = ["WAITING", "end_on_interrupt", "variables", "wait_briefly"]

WAITING = {"OMP_WAIT_POLICY": "passive", "GOMP_SPINCOUNT": "1000"}


def wait_briefly():
    """Set it for this process, before any OpenMP library is loaded; a policy that the user has set stays."""
    if "OMP_WAIT_POLICY" not in os.environ:
        os.environ.update(WAITING)


def end_on_interrupt():
    """Let Ctrl-C end this process at once and without a word: one that works for another, which says what happens."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def variables(threads):
    """Environment of a process of its own that runs on so many threads."""
    return {**os.environ, **WAITING, "OMP_NUM_THREADS": str(threads)}

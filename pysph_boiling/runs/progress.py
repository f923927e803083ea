"""What happens beside the steps of a run: a progress bar, Ctrl-C between two steps, a dry vessel, and warnings."""
import math
import signal
import threading
import warnings
from contextlib import contextmanager
from time import perf_counter

from pysph.solver.tools import Tool

from pysph_boiling.device import real
from pysph_boiling.parallel import ranks

__all__ = ["Dry", "Interrupt", "Progress", "Stopped", "plain_warnings"]

SECONDS_SHOWN = 0.2  # s between two updates of the progress bar, which is drawn twice a second


@contextmanager
def plain_warnings(console):
    """Print the warnings raised inside the block at its end: each sentence once, without the path of its source."""
    with warnings.catch_warnings(record=True) as told:
        try:
            yield
        finally:
            for sentence in dict.fromkeys(str(found.message) for found in told if found.category is UserWarning):
                console.print(f"note: {sentence}", markup=False)


class Stopped(KeyboardInterrupt):
    """Ctrl-C, handled between two steps; the message gives the step and says that the state is written."""


class Interrupt(Tool):
    """Inside ``with``, turns Ctrl-C into :class:`Stopped` before the next step.

    Python would raise ``KeyboardInterrupt`` at any place: within a step, from which a run cannot resume, or in a
    callback of a library that swallows it. A second Ctrl-C interrupts at once. On several ranks all of them stop.
    """

    def __init__(self):
        self.asked = False

    def __enter__(self):
        ours = threading.current_thread() is threading.main_thread()
        self.before = signal.getsignal(signal.SIGINT) if ours else None
        if self.before is signal.default_int_handler:  # otherwise it is ignored or has a handler, which is kept
            signal.signal(signal.SIGINT, self.ask)

    def __exit__(self, *error):
        if self.before is signal.default_int_handler:
            signal.signal(signal.SIGINT, self.before)

    def ask(self, number, frame):
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True

    def pre_step(self, solver):
        if ranks.anywhere(self.asked):
            raise Stopped


class Dry(Tool):
    """Ends a run after the step, or at the start, when the fluid arrays have no particles left."""

    def __init__(self, arrays, solver):
        self.arrays = arrays
        self.found = False
        self.look(solver, solver.count)

    def look(self, solver, steps):
        self.found = ranks.total(sum(real(pa) for pa in self.arrays)) == 0
        if self.found:
            solver.max_steps = steps

    def post_step(self, solver):
        self.look(solver, solver.count + 1)


class Progress(Tool):
    """A progress bar with the estimated time left."""

    def __init__(self, solver, title, quiet):
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

        self.bar = Progress(TextColumn("{task.description}"), BarColumn(), TextColumn("t = {task.fields[now]:.3f} s"),
                            TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn(), refresh_per_second=2,
                            disable=quiet)
        self.task = self.bar.add_task(title, total=solver.tf - solver.t, now=solver.t)
        self.start, self.told = solver.t, -math.inf

    def post_step(self, solver):
        now, clock = solver.t + solver.dt, perf_counter()
        if clock - self.told > SECONDS_SHOWN or now >= solver.tf - solver.dt:
            self.told = clock
            self.bar.update(self.task, completed=now - self.start, now=now)

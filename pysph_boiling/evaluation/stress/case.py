"""A difficult case, and a run of it."""
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from time import process_time
from typing import Any

import numpy as np
from pysph.base.omp_threads import get_number_of_threads, set_number_of_threads

from pysph_boiling.particles import host
from pysph_boiling.runs.ledger import Ledger
from pysph_boiling.runs.stepper import Stepper

__all__ = ["Case", "Run", "Setup", "simulate"]

G = 9.81  # [m/s^2] used for units of speed and time in a scene without gravity


@dataclass(kw_only=True)
class Setup:
    """A scene that is ready to step.

    ``factor`` is the time step in units of the default one. ``closed`` means that only gravity does work, so that
    kinetic plus potential energy may not rise. ``before(run)`` is called before each step, ``every`` is the number of
    steps between two measurements, and ``threads`` is the number of OpenMP threads (all cores if not given).
    """

    scheme: Any
    arrays: list
    factor: float = 1.0
    domain: Any = None
    closed: bool = False
    before: Callable | None = None
    every: int = 1
    threads: int | None = None


@dataclass(frozen=True, kw_only=True)
class Case:
    """A difficult case.

    ``hard`` says what is difficult about it, and ``build()`` makes the :class:`Setup`. ``steps`` and ``quick`` are the
    numbers of steps in the full and in the quick form (0 leaves the case out). ``end(run)`` yields a sentence for each
    fault of the end state. If the case must be refused, ``refused`` is a part of the error message.
    """

    name: str
    hard: str
    build: Callable
    steps: int
    quick: int = 0
    end: Callable = lambda run: ()
    refused: str = ""


@dataclass
class Run:
    """A run of a case: its state, and the measurements after each step (``table``, name -> list)."""

    setup: Setup
    stepper: Stepper = None
    ledger: Ledger = None
    table: dict = field(default_factory=dict)
    warned: list = field(default_factory=list)
    stopped: str = ""  # why it ended early
    refusal: str = ""  # error message if it did not start
    steps: int = 0
    whole: bool = True  # not the short form
    seconds: float = 0.0  # processor time of all threads

    def begin(self):
        """Compile, and measure the initial state."""
        setup = self.setup
        scheme = setup.scheme
        self.scene, self.container = scheme.scene(), scheme.effects.get("container")
        self.g = self.scene.g or G
        self.dt = setup.factor * (scheme.time_step() if self.scene.g else 0.07 * (scheme.spacing / G) ** 0.5)
        self.stepper = Stepper(scheme, setup.arrays, dt=self.dt, domain=setup.domain)
        self.fluid = scheme.arrays[0]
        self.stepper.solver.integrator.settle()  # energy counts after particles were moved apart
        self.ledger = Ledger(scheme, every=setup.every)
        self.ledger.begin(scheme.arrays)
        self.stepper.tools.append(self.ledger)
        self.up = np.array(self.scene.up)
        self.start = {name: host(self.fluid, name).copy() for name in self.fluid.properties}
        heights = self.height(self.start)
        self.floor, top = float(np.min(heights)), float(np.max(heights))
        if self.container:
            ends = [corner @ self.up for corner in self.corners()]
            self.floor, top = min(ends), min(top, max(ends))
        self.depth = max(top - self.floor, scheme.spacing)
        self.fastest = float(np.max(self.speeds()))
        self.first = self.mechanical()
        self.scale = float(np.sum(self.get("m"))) * self.g * self.depth

    def corners(self):
        return [np.array(corner) for corner in self.container.bounds(self.scene)]

    def height(self, values):
        return sum(component * values[axis] for component, axis in zip(self.up, "xyz"))

    def get(self, name):
        """A property of the particles, (n,)."""
        return host(self.fluid, name)

    def speeds(self):
        return np.sqrt(self.get("u") ** 2 + self.get("v") ** 2 + self.get("w") ** 2)

    def mechanical(self):
        """Kinetic plus potential energy [J]."""
        heights = self.height({axis: self.get(axis) for axis in "xyz"}) - self.floor
        return float(np.sum(self.get("m") * (0.5 * self.speeds() ** 2 + self.scene.g * heights)))

    def outside(self):
        """Number of particles outside the container, by more than round-off."""
        if self.container is None:
            return 0
        slack, inside = 1e-9 * self.scene.spacing, True
        for axis, low, high in zip("xyz"[:self.scene.dim], *self.corners()):
            inside = inside & (self.get(axis) >= low - slack) & (self.get(axis) <= high + slack)
        return int(np.count_nonzero(~inside))

    def bad(self):
        """Number of values that are NaN or Inf, over all properties."""
        return sum(int(np.count_nonzero(~np.isfinite(array.get_npy_array())))
                   for array in self.fluid.properties.values() if array.get_c_type() in ("double", "float"))

    def look(self):
        """Measure the state; returns whether the run can continue."""
        seen = dict(self.ledger.rows[-1], speed=float(np.max(self.speeds(), initial=0.0)), outside=self.outside(),
                    bad=self.bad(), mechanical=self.mechanical())
        for name, value in seen.items():
            self.table.setdefault(name, []).append(float(value))
        if seen["bad"]:
            self.stopped = f"there is NaN or Inf after step {self.steps}"
        return not seen["bad"]

    def advance(self, steps):
        """Take steps until one fails."""
        for _ in range(steps):
            if self.setup.before:
                self.setup.before(self)
            self.stepper.step()
            self.steps += 1
            if self.steps % self.setup.every == 0 and not self.look():
                return

    def last(self, name):
        """The last value of a column."""
        return self.table[name][-1]

    @property
    def events(self):
        """Number of discrete events since the start: name -> number."""
        return {name: int(values[-1]) for name, values in self.table.items() if name in EVENTS}


EVENTS = ("n_nucleated", "n_interrupted", "n_burst", "n_condensed", "n_vented", "n_bubbles_vented", "n_refilled")


def simulate(case, steps):
    """Run a case for ``steps`` steps; an error ends it and is stored. Returns the :class:`Run`."""
    run, threads, begun = Run(None, whole=steps >= case.steps), get_number_of_threads(), process_time()
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            run.setup = case.build()
            if run.setup.threads:
                set_number_of_threads(run.setup.threads)
            run.begin()
        except ValueError as error:
            run.refusal = str(error)
        else:
            try:
                run.advance(steps)
            except Exception as error:  # any error is a result of the case
                run.stopped = f"step {run.steps + 1}: {type(error).__name__}: {error}"
        finally:
            set_number_of_threads(threads)
    run.warned = sorted({str(warning.message) for warning in told if issubclass(warning.category, UserWarning)})
    run.seconds = process_time() - begun
    return run

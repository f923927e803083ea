"""The base class of problems with a known answer, and the outcome of a run."""
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

__all__ = ["Outcome", "Problem", "standard_error"]


def standard_error(values):
    """Standard error of the mean of ``values`` (n,), in their unit; 0 for one value."""
    return float(np.std(values, ddof=1) / np.sqrt(len(values))) if len(values) > 1 else 0.0


@dataclass(frozen=True)
class Outcome:
    """The outcome of one run of a problem.

    ``errors`` maps the name of an error to its value, which is dimensionless unless the name says otherwise, and signed
    if the sign has a meaning. ``seconds`` is the wall time of the steps without compiling [s], ``simulated`` the
    simulated time [s]. ``curves`` has columns (name with unit -> array) for a plot with the exact solution.
    """

    errors: dict
    seconds: float
    simulated: float
    steps: int
    particles: int
    curves: dict = field(default_factory=dict)
    facts: dict = field(default_factory=dict)

    @property
    def cost(self):
        """Wall seconds per simulated second."""
        return self.seconds / self.simulated


@dataclass(frozen=True, kw_only=True)
class Problem:
    """A problem with a known answer; its fields are the parameters that may be varied."""

    title: ClassVar[str] = ""
    reference: ClassVar[str] = ""  # formula or experiment, and its source

    def run(self):
        """Simulate and compare; returns an :class:`Outcome`."""
        raise TypeError(f"{type(self).__name__} must override run")

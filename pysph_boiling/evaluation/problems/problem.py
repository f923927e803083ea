"""What every problem with a known answer is, and what a run of it tells."""
from dataclasses import dataclass, field
from typing import ClassVar

__all__ = ["Outcome", "Problem"]


@dataclass(frozen=True)
class Outcome:
    """What one run of a problem told.

    ``errors`` maps the name of an error to its value, dimensionless unless the name says otherwise, signed where a sign
    means something; ``seconds`` is the wall time of the steps [s], compiling left out; ``simulated`` the time that
    they cover [s]; ``curves`` holds columns (name with unit -> array) for a plot against the exact answer.
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
    """A problem with a known answer; its fields are what may be varied."""

    title: ClassVar[str] = ""
    reference: ClassVar[str] = ""  # formula or experiment, and its source

    def run(self):
        """Simulate and compare; returns an :class:`Outcome`."""
        raise TypeError(f"{type(self).__name__} must override run")

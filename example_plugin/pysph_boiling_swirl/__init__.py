"""A stirrer for pysph_boiling: the effect ``swirl``."""
from dataclasses import dataclass
from typing import ClassVar

from pysph_boiling.particles import Property
from pysph_boiling.schemes.effects import Effect, cumulative, param
from pysph_boiling.schemes.stages import Term
from pysph_boiling_swirl.force import SwirlForce

__all__ = ["Swirl", "SwirlForce"]


@dataclass(frozen=True, kw_only=True)
class Swirl(Effect):
    """A stirrer that turns the fluid about a vertical axis. 3-D only."""

    slot: ClassVar[str] = "swirl"
    title: ClassVar[str] = "stirrer"
    requires: ClassVar[tuple[str, ...]] = ("density",)
    rate: float = param(1.0, "rad/s", "angular velocity of the stirrer")
    grip: float = param(5.0, "1/s", "rate at which the fluid takes the stirrer's velocity", low=0.0)
    axis: tuple = param((0.0, 0.0), "m", "x and y of the axis")

    def check(self, scene, arrays):
        """Raise ``ValueError`` in 2-D, where no axis is vertical, and for an axis that is not two numbers."""
        if scene.dim != 3:
            raise ValueError("swirl: a vertical axis needs a 3-D scene, this one is 2-D")
        if len(self.axis) != 2:
            raise ValueError(f"swirl.axis must be two numbers, x and y [m], got {self.axis}")

    def properties(self, scene):
        """What a particle has been given so far."""
        return (Property("swirl", "kg m^2/s", "angular momentum that the stirrer gave", state=True, cumulative=True),)

    def columns(self, scene):
        """The column ``swirl`` of the results."""
        return (cumulative("swirl", "kg m^2/s", "angular momentum that the stirrer gave since the start", "swirl"),)

    def rate_of_velocity(self, scene):
        """The integrator splits a step in which the stirrer would make velocities overshoot."""
        return self.grip

    def terms(self, scene, fluid):
        """One force, where all forces are summed."""
        yield Term("forces.sum", SwirlForce(fluid, None, omega=self.rate, grip=self.grip, x=self.axis[0],
                                            y=self.axis[1]))

"""A neutrally buoyant bubble, which stays at rest unless cohesion and the density constraint do work on it."""
import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from pysph_boiling.analysis.shapes import shapes
from pysph_boiling.evaluation.problems.bubble_rise import blow, still_water
from pysph_boiling.evaluation.problems.problem import Outcome, Problem
from pysph_boiling.examples.bubble_rise import BubbleRiseParameters
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.particles import positions
from pysph_boiling.schemes.effects import Buoyancy, Cohesion, DensityConstraint

__all__ = ["BubbleAtRest"]


@dataclass(frozen=True, kw_only=True)
class BubbleAtRest(Problem):
    """The scene of :mod:`pysph_boiling.examples.bubble_rise` without buoyancy and without heat flow.

    The bubble has a radius of ``radius`` spacings in a tank that is ``cells`` spacings wide and high. ``strength`` is
    the strength of the pair force of cohesion in units of gravity, the scheme's default if not given; ``dt_factor`` is
    the time step over t* = sqrt(spacing/g). The water settles for ``settle`` t*, then the bubble is inserted and
    observed for ``duration`` t*.

    Errors: ``speed``, root mean square of all particles over the last fifth of the time, over sqrt(g spacing);
    ``torn``, the fraction of the vapour outside its largest piece at the end.
    """

    title: ClassVar[str] = "bubble at rest"
    reference: ClassVar[str] = ("the bubble stays at rest, because its weight is balanced and surface tension does no "
                                "work on a sphere")
    dim: int = 2
    spacing: float = 0.004
    cells: int = 24
    radius: float = 3.6
    strength: float | None = None
    dt_factor: float = 0.07
    density: DensityConstraint = field(default_factory=DensityConstraint)
    settle: float = 15.0
    duration: float = 60.0

    SAMPLES: ClassVar[int] = 30

    def sigma(self):
        """Surface tension [N/m] of the strength asked for."""
        if self.strength is None:
            return None
        return Cohesion.tension(9.81 * self.strength, dim=self.dim, spacing=self.spacing, rho0=WATER_1ATM.rho_l)

    def run(self):
        p = BubbleRiseParameters(dim=self.dim, spacing=self.spacing, width=self.cells, fill=self.cells, superheat=0.0)
        unit = math.sqrt(self.spacing / 9.81)
        scheme, fluid, stepper = still_water(
            p, dt_factor=self.dt_factor, settle=self.settle * unit, density=self.density,
            buoyancy=Buoyancy(k_bubble=0.0), cohesion=Cohesion(sigma=self.sigma()))
        place = positions(fluid)[:, :self.dim] / self.spacing - 0.5 * self.cells
        inside = np.linalg.norm(place, axis=1) < self.radius
        blow(fluid, inside)
        t, speed, every = [], [], math.ceil(self.duration / self.SAMPLES / self.dt_factor)
        for sample in range(1, self.SAMPLES + 1):
            stepper.step(every)
            t.append(sample * every * self.dt_factor)
            speed.append(math.sqrt(np.mean(fluid.u**2 + fluid.v**2 + fluid.w**2)) * unit / self.spacing)
        pieces = [shape.n for shape in shapes(fluid, self.dim, scheme.rho0)]
        return Outcome(
            errors=dict(speed=float(np.mean(speed[-self.SAMPLES // 5:])), torn=1.0 - max(pieces) / sum(pieces)),
            seconds=stepper.seconds, simulated=stepper.t, steps=stepper.solver.count, particles=len(fluid.x),
            curves={"t/t* [-]": np.array(t), "speed/√(g dx) [-]": np.array(speed)},
            facts=dict(vapour=int(np.count_nonzero(inside))))

"""The dam break of :mod:`pysph_boiling.examples.dam_break`, compared with the measured fronts."""
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from pysph.base import kernels

from pysph_boiling.evaluation.problems.problem import Outcome, Problem
from pysph_boiling.examples.dam_break import DamBreak as Scene
from pysph_boiling.examples.dam_break import DamBreakParameters
from pysph_boiling.runs.stepper import Stepper
from pysph_boiling.schemes.effects import DensityConstraint

__all__ = ["DamBreak"]


class Recorded(Scene):
    """The scene with given fronts, so that its comparison with the experiments can be used here."""

    def measured(self):
        return self.fronts


@dataclass(frozen=True, kw_only=True)
class DamBreak(Problem):
    """The front X/a of a collapsing column of width a = ``width`` [m] and height 2 a, over t sqrt(g/H).

    The column has ``layers`` particles across its width; ``dt_factor`` is the time step over t* = sqrt(spacing/g).

    Errors: ``front``, the largest relative distance from the range of the experiments; ``density_mean``, the mean
    positive density error before the last sweep, averaged over time; ``density_max``, the largest one. Fact:
    ``front_at_2``, X/a at t sqrt(g/H) = 2, to compare runs with each other.
    """

    title: ClassVar[str] = "dam break"
    reference: ClassVar[str] = "fronts of Martin & Moyce 1952 and of Koshizuka & Oka 1996"
    dim: int = 2
    width: float = 0.5
    layers: int = 20
    duration: float = 0.8
    dt_factor: float = 0.07
    kernel: str = "CubicSpline"
    hdx: float = 1.2
    density: DensityConstraint = field(default_factory=DensityConstraint)

    def run(self):
        p = DamBreakParameters(dim=self.dim, spacing=self.width / self.layers, width=self.width, duration=self.duration)
        scene = Recorded()
        scene.parameters = p
        scheme = scene.make_scheme(p)
        scheme.kernel, scheme.hdx = getattr(kernels, self.kernel)(dim=self.dim), self.hdx
        scheme.set_effects(density=self.density)
        fluid, wall = scene.make_particles(p, scheme)
        scheme.setup_properties([fluid, wall])
        stepper = Stepper(scheme, [fluid, wall], dt=scheme.time_step(self.dt_factor))

        every = max(1, round(p.frame / stepper.dt))
        times, fronts, sweeps, mean, worst = [0.0], [float(fluid.x.max())], [], [], []
        while stepper.t < self.duration:
            for _ in range(every):
                stepper.step()
                sweeps.append(fluid.sweeps[1])
                mean.append(fluid.density_error[0])
                worst.append(fluid.density_error[1])
            times.append(stepper.t)
            fronts.append(float(fluid.x.max()))
        scene.fronts = list(zip(times, fronts))
        t, x, low, high = scene.front()
        error = scene.front_error()
        return Outcome(
            errors=dict(front=error, density_mean=float(np.mean(mean)), density_max=float(np.max(worst))),
            seconds=stepper.seconds, simulated=stepper.t, steps=stepper.solver.count, particles=len(fluid.x),
            curves={"t sqrt(g/H) [-]": t, "front [-]": x, "experiments low [-]": low, "experiments high [-]": high},
            facts=dict(front_at_2=float(np.interp(2.0, t, x)), sweeps=float(np.mean(sweeps)),
                       unconverged=float(fluid.unconverged[0]) / stepper.solver.count))

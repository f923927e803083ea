"""A bubble rising through still water: its speed for different time steps and numbers of sweeps."""
import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from pysph.base import kernels

from pysph_boiling.analysis.shapes import shapes
from pysph_boiling.evaluation.problems.problem import Outcome, Problem, standard_error
from pysph_boiling.examples.bubble_rise import BubbleRise as Scene
from pysph_boiling.examples.bubble_rise import BubbleRiseParameters
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.particles import positions
from pysph_boiling.phases import Phase
from pysph_boiling.runs.stepper import Stepper
from pysph_boiling.schemes.effects import DensityConstraint, HeatConduction

__all__ = ["BubbleRise", "blow", "still_water"]

STILL = dict(dynamic_nucleation=None, condensation=None, pooling=None, expansion=None, oscillation=None, venting=None,
             heat=HeatConduction(time_scaling=1e-9))  # so that the bubble only rises


def still_water(p, *, dt_factor, settle, kernel="CubicSpline", hdx=1.2, **effects):
    """The scene with parameters ``p`` and no heat flow, after settling for ``settle`` [s]: (scheme, fluid, stepper).

    ``dt_factor`` is the time step over t*; ``effects`` (slot -> effect) replace those of the scene.
    """
    scene = Scene()
    scheme = scene.make_scheme(p)
    scheme.kernel, scheme.hdx = getattr(kernels, kernel)(dim=p.dim), hdx
    scheme.set_effects(**effects, **STILL)
    arrays = scene.make_particles(p, scheme)
    scheme.setup_properties(arrays)
    scheme.set_temperature(arrays[0], WATER_1ATM.T_sat - 1.0)
    stepper = Stepper(scheme, arrays, dt=scheme.time_step(dt_factor))
    stepper.step(math.ceil(settle / stepper.dt))
    return scheme, arrays[0], stepper


def blow(fluid, inside):
    """Turn the particles in the mask ``inside`` (n,) into a bubble."""
    fluid.phase[inside], fluid.e[inside], fluid.T[inside] = Phase.VAPOUR, WATER_1ATM.L, WATER_1ATM.T_sat


@dataclass(frozen=True, kw_only=True)
class BubbleRise(Problem):
    """The scene of :mod:`pysph_boiling.examples.bubble_rise` without heat flow, from several starts.

    The tank is ``width`` diameters wide. ``effects``, pairs of a slot and an effect or ``None``, replace those of the
    scene. The bubble has a diameter of ``diameter`` [m], which is ``cells`` particles; ``dt_factor`` is the time step
    over t* = sqrt(spacing/g). The water settles for ``settle`` sqrt(diameter/g) before the bubble is inserted. Each of
    the ``starts`` runs begins with a different disturbance of the lattice, from seeds that begin with ``seed``. The
    speed is measured between 2.5 and 5.5 diameters above the base.

    Errors: ``shredded``, the largest fraction of the vapour outside its largest piece; ``unsteady``, the relative
    difference of the speeds in the two halves of that range. Facts: ``speed`` over sqrt(g diameter), the mean over the
    starts, with its range ``speed_low``, ``speed_high`` and its standard error ``speed_error``; ``aspect``, the mean of
    the width over the height of the largest piece in that range, with its standard error ``aspect_error``; ``eotvos``,
    rho g diameter^2/sigma.
    """

    title: ClassVar[str] = "bubble rise"
    reference: ClassVar[str] = "the speed with the smallest time step and the most sweeps"
    dim: int = 2
    diameter: float = 0.012
    cells: float = 6.0
    width: float = 4.0
    effects: tuple = ()
    dt_factor: float = 0.07
    kernel: str = "CubicSpline"
    hdx: float = 1.2
    density: DensityConstraint = field(default_factory=DensityConstraint)
    settle: float = 8.0
    starts: int = 3
    seed: int = 1

    FILL: ClassVar[float] = 7.5
    START: ClassVar[float] = 1.0
    WINDOW: ClassVar[tuple[float, float]] = (2.5, 5.5)
    PATIENCE: ClassVar[float] = 60.0  # time in sqrt(diameter/g) after which the run gives up

    def run(self):
        runs = [self.one(self.seed + start) for start in range(self.starts)]
        speeds, aspects = (np.array([run[name] for run in runs]) for name in ("speed", "aspect"))
        return Outcome(
            errors={name: float(np.mean([run[name] for run in runs])) for name in ("shredded", "unsteady")},
            seconds=sum(run["seconds"] for run in runs), simulated=sum(run["simulated"] for run in runs),
            steps=sum(run["steps"] for run in runs), particles=runs[0]["particles"],
            curves={"t sqrt(g/d) [-]": runs[0]["t"], "height [diameters]": runs[0]["height"],
                    "width over height [-]": runs[0]["aspects"]},
            facts=dict(speed=float(speeds.mean()), speed_low=float(speeds.min()), speed_high=float(speeds.max()),
                       speed_error=standard_error(speeds), aspect=float(aspects.mean()),
                       aspect_error=standard_error(aspects), eotvos=runs[0]["eotvos"],
                       sweeps=float(np.mean([run["sweeps"] for run in runs]))))

    def one(self, seed):
        """Run one start; lengths are in diameters, times in sqrt(diameter/g)."""
        spacing = self.diameter / self.cells
        p = BubbleRiseParameters(dim=self.dim, spacing=spacing, width=round(self.width * self.cells),
                                 fill=round(self.FILL * self.cells), diameter=self.cells,
                                 height=self.START * self.cells, superheat=0.0, seed=seed)
        unit = math.sqrt(self.diameter / 9.81)
        scheme, fluid, stepper = still_water(p, dt_factor=self.dt_factor, settle=self.settle * unit, kernel=self.kernel,
                                             hdx=self.hdx, **{"density": self.density, **dict(self.effects)})

        middle = [0.5 * p.width] * (self.dim - 1) + [p.height]
        place = positions(fluid)[:, :self.dim] / spacing - middle
        blow(fluid, np.linalg.norm(place, axis=1) < 0.5 * self.cells)
        begin, every = stepper.t, max(1, round(0.1 * unit / stepper.dt))
        t, height, aspect, shredded, sweeps = [], [], [], 0.0, []
        while not height or height[-1] < self.WINDOW[1]:
            stepper.step(every)
            found = shapes(fluid, self.dim, scheme.rho0)
            t.append((stepper.t - begin) / unit)
            if not found or t[-1] > self.PATIENCE:
                raise RuntimeError(f"the bubble does not rise: it is at {height[-1]:.2g} diameters after {t[-1]:.2g} "
                                   "sqrt(diameter/g)" if height else "there is no bubble")
            height.append(float(found[0].centroid[self.dim - 1]) / self.diameter)
            aspect.append(found[0].aspect)
            shredded = max(shredded, 1.0 - found[0].n / sum(shape.n for shape in found))
            sweeps.append(fluid.sweeps[1])
        low, high = self.WINDOW
        at = np.interp([low, 0.5 * (low + high), high], height, t)
        lower, upper = 0.5 * (high - low) / np.diff(at)
        scene = scheme.scene()
        return dict(aspect=float(np.mean(np.array(aspect)[(np.array(t) >= at[0]) & (np.array(t) <= at[2])])),
                    eotvos=scene.rho0 * scene.g * self.diameter**2 / scheme.effects["cohesion"].sigma_in(scene),
                    speed=(high - low) / (at[2] - at[0]), unsteady=abs(upper / lower - 1.0), shredded=shredded,
                    sweeps=float(np.mean(sweeps)), seconds=stepper.seconds, simulated=stepper.t,
                    steps=stepper.solver.count, particles=len(fluid.x), t=np.array(t), height=np.array(height),
                    aspects=np.array(aspect))

"""A column of water in an open tank, whose density and level at rest are known."""
import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from pysph.base import kernels
from scipy.spatial import cKDTree

from pysph_boiling.evaluation.problems.problem import Outcome, Problem
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.particles import box_vessel, fluid_block, lattice_density, positions
from pysph_boiling.runs.stepper import Stepper
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import BoxContainer, DensityConstraint, XSPHViscosity

__all__ = ["HydrostaticColumn", "compression", "nearest"]

SAMPLES = 8  # number of moments after settling at which the density is measured


def compression(fluid, others, scheme):
    """Positive density error max(rho/rho_rest - 1, 0) [-] of each particle at its present position, shape (n,).

    It is summed on the host with the scheme's kernel over the fluid and the boundary arrays ``others``, because the
    density in the particle array is the one before the last sweep.
    """
    kernel, h = scheme.kernel, scheme.hdx * scheme.spacing
    lattice, _ = lattice_density(kernel, dim=scheme.dim, hdx=scheme.hdx)
    q = np.linspace(0.0, kernel.radius_scale, 4001)
    w = [kernel.kernel(xij=[d * h, 0.0, 0.0], rij=d * h, h=h) for d in q]
    points, masses = (np.concatenate([positions(pa) if what == "x" else pa.m
                                      for pa in (fluid, *others)]) for what in "xm")
    up = scheme.dim - 1  # sorted vertically, a slab of fluid has its neighbours in a slab of points
    order = np.argsort(points[:, up], kind="stable")
    points, masses = points[order], masses[order]
    own = np.argsort(fluid.get("xyz"[up]), kind="stable")
    rho = np.empty(len(own))
    for part in np.array_split(own, max(1, len(own) // 128)):
        x = positions(fluid)[part]
        reach = kernel.radius_scale * h
        near = slice(*np.searchsorted(points[:, up], (x[0, up] - reach, x[-1, up] + reach)))
        r = np.sqrt(((x[:, None, :] - points[None, near, :]) ** 2).sum(axis=-1))
        rho[part] = np.interp(r / h, q, w, right=0.0) @ masses[near]
    return np.maximum(rho / (scheme.rho0 * lattice) - 1.0, 0.0)


def nearest(fluid, spacing):
    """Distance (n,) of each particle to its nearest neighbour, in spacings."""
    points = positions(fluid)
    return cKDTree(points).query(points, k=2)[0][:, 1] / spacing


@dataclass(frozen=True, kw_only=True)
class HydrostaticColumn(Problem):
    """A lattice is released at once: the walls push it away, it sloshes and comes to rest.

    The column is ``width`` [m] wide and ``height`` [m] or ``layers`` particles high; ``dt_factor`` is the time step
    over t* = sqrt(spacing/g). The column settles for ``settle`` and is then observed for ``watch``, both in
    sqrt(height/g).

    Errors: ``density_mean`` and ``density_max``, the mean and largest positive density error at the end of steps;
    ``level``, its relative error, positive if the water is too high; ``speed``, root mean square over sqrt(g height);
    ``pairs``, the fraction of particles within half a spacing of another one. Facts: ``closest``, the smallest distance
    of two particles in spacings; ``sweeps`` per step; ``residual``, the mean density error as reported by the sweeps;
    ``searches``, neighbour searches per step.
    """

    title: ClassVar[str] = "hydrostatic column"
    reference: ClassVar[str] = "rest density everywhere, and the level of the start"
    dim: int = 2
    height: float = 1.0
    width: float = 1.0
    layers: int = 20
    dt_factor: float = 0.07
    kernel: str = "CubicSpline"
    hdx: float = 1.2
    density: DensityConstraint = field(default_factory=DensityConstraint)
    viscosity: XSPHViscosity | None = field(default_factory=lambda: XSPHViscosity(wall=1.0))
    settle: float = 12.0
    watch: float = 3.0

    def run(self):
        spacing = self.height / self.layers
        size = [max(4, round(self.width / spacing)) * spacing] * (self.dim - 1)
        lower, upper = (0.0, 0.0, 0.0), (*size, 1.3 * self.height, *[0.0] * (3 - self.dim))
        scheme = BoilingScheme(
            ["fluid"], ["wall"], dim=self.dim, spacing=spacing, hdx=self.hdx, material=WATER_1ATM,
            kernel=getattr(kernels, self.kernel)(dim=self.dim), density=self.density,
            container=BoxContainer(lower=lower, upper=upper), viscosity=self.viscosity)
        common = dict(spacing=spacing, dim=self.dim, rho0=scheme.rho0, hdx=self.hdx)
        fluid = fluid_block(lower, (*size, self.height), **common)
        wall = box_vessel(lower, upper, kernel=scheme.kernel, **common)
        scheme.setup_properties([fluid, wall])
        stepper = Stepper(scheme, [fluid, wall], dt=scheme.time_step(self.dt_factor))

        unit = math.sqrt(self.height / 9.81)
        stepper.step(math.ceil(self.settle * unit / stepper.dt))
        every = max(1, round(self.watch * unit / stepper.dt / SAMPLES))
        mean, worst, level, speed, sweeps, residual, distances = [], [], [], [], [], [], []
        for _ in range(SAMPLES):
            for _ in range(every):
                stepper.step()
                sweeps.append(fluid.sweeps[1])
                residual.append(fluid.density_error[0])
            errors = compression(fluid, [wall], scheme)
            mean.append(errors.mean())
            worst.append(errors.max())
            level.append(2.0 * fluid.get("xyz"[self.dim - 1]).mean() / self.height - 1.0)
            distances.append(nearest(fluid, spacing))
            speed.append(math.sqrt(np.mean(fluid.u**2 + fluid.v**2 + fluid.w**2)) * unit / self.height)
        stages = scheme.integrator.wall_time
        return Outcome(
            errors=dict(density_mean=float(np.mean(mean)), density_max=float(np.max(worst)),
                        level=float(np.mean(level)), speed=float(np.mean(speed)),
                        pairs=float(np.mean(np.array(distances) < 0.5))),
            seconds=stepper.seconds, simulated=stepper.t, steps=stepper.solver.count, particles=len(fluid.x),
            facts=dict(closest=float(np.min(distances)), sweeps=float(np.mean(sweeps)),
                       residual=float(np.mean(residual)),
                       unconverged=float(fluid.unconverged[0]) / stepper.solver.count,
                       searches=getattr(scheme.integrator, "searches", stepper.solver.count) / stepper.solver.count,
                       seconds_search=stages["search"], seconds_density=stages["density"]))

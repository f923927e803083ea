"""Drift: still water must come to rest, the energy of sloshing water must not grow, and momentum must stay constant."""
import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from pysph.base import kernels
from scipy.spatial import cKDTree

from pysph_boiling.analysis.layering import first_layer, pool_layers
from pysph_boiling.evaluation.problems.periodic_box import periodic_box
from pysph_boiling.evaluation.problems.problem import Outcome, Problem
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.particles import box_vessel, fluid_block, positions
from pysph_boiling.runs.stepper import Stepper
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    ArtificialPressure,
    BoxContainer,
    DensityConstraint,
    WallMultipliers,
    XSPHViscosity,
)

__all__ = ["PeriodicBox", "SloshingTank", "StillWater"]

GRAVITY = 9.81


def repulsion(strength):
    """Artificial pressure of that strength [-]; none if it is 0."""
    return ArtificialPressure(strength=strength) if strength else None


@dataclass(frozen=True, kw_only=True)
class SloshingTank(Problem):
    """Water in a closed 2-D tank without viscosity is set in motion with the velocities of its lowest standing wave.

    The tank is ``length`` [m] or ``cells`` particles long, and the water is ``depth`` [m] deep. ``surface`` is the
    largest speed of the surface over sqrt(g depth); ``dt_factor`` is the time step over t* = sqrt(spacing/g). The water
    first settles for ``settle`` sqrt(depth/g) and is then observed for ``periods`` of the wave. ``artificial_pressure``
    is its strength; with 0 there is none. With ``wall_multipliers`` walls have multipliers, and
    ``wall_jitter`` [spacings] makes them rough.

    Errors relative to the initial kinetic energy, both 0 in the ideal case: ``gain``, the largest increase of kinetic
    plus potential energy; ``loss``, the energy lost after one period, which the sweeps dissipate. ``period`` is
    relative to the linear theory, T = 2 pi/sqrt(g k tanh(k depth)), k = pi/length.
    """

    title: ClassVar[str] = "sloshing tank"
    reference: ClassVar[str] = ("the energy never exceeds that of the start; linear theory of standing waves (Lamb "
                                "1932, art. 228)")
    length: float = 1.0
    depth: float = 0.5
    cells: int = 40
    surface: float = 0.25
    dt_factor: float = 0.07
    kernel: str = "CubicSpline"
    hdx: float = 1.2
    density: DensityConstraint = field(default_factory=DensityConstraint)
    viscosity: XSPHViscosity | None = None
    artificial_pressure: float = 0.0
    wall_multipliers: bool = False
    wall_jitter: float = 0.0
    settle: float = 12.0
    periods: float = 1.1

    def run(self):
        spacing = self.length / self.cells
        lower, upper = (0.0, 0.0, 0.0), (self.length, 1.6 * self.depth, 0.0)
        scheme = BoilingScheme(
            ["fluid"], ["wall"], dim=2, spacing=spacing, hdx=self.hdx, material=WATER_1ATM,
            kernel=getattr(kernels, self.kernel)(dim=2), density=self.density,
            container=BoxContainer(lower=lower, upper=upper), viscosity=self.viscosity,
            artificial_pressure=repulsion(self.artificial_pressure),
            wall_multipliers=WallMultipliers() if self.wall_multipliers else None)
        common = dict(spacing=spacing, dim=2, rho0=scheme.rho0, hdx=self.hdx)
        fluid = fluid_block(lower, (self.length, self.depth, 0.0), **common)
        wall = box_vessel(lower, upper, kernel=scheme.kernel, jitter=self.wall_jitter, **common)
        scheme.setup_properties([fluid, wall])
        stepper = Stepper(scheme, [fluid, wall], dt=scheme.time_step(self.dt_factor))
        stepper.step(math.ceil(self.settle * math.sqrt(self.depth / GRAVITY) / stepper.dt))

        k = math.pi / self.length
        period = 2.0 * math.pi / math.sqrt(GRAVITY * k * math.tanh(k * self.depth))
        speed = self.surface * math.sqrt(GRAVITY * self.depth) / math.sinh(k * self.depth)
        fluid.u[:] = speed * np.sin(k * fluid.x) * np.cosh(k * fluid.y)
        fluid.v[:] = -speed * np.cos(k * fluid.x) * np.sinh(k * fluid.y)

        def energy():  # [J/m]
            return float(np.sum(fluid.m * (0.5 * (fluid.u**2 + fluid.v**2) + GRAVITY * fluid.y)))

        given, start = float(np.sum(0.5 * fluid.m * (fluid.u**2 + fluid.v**2))), energy()
        begin, rest = stepper.t, fluid.x.mean()
        t, excess, shift = [0.0], [0.0], [0.0]
        while t[-1] < self.periods:
            stepper.step()
            t.append((stepper.t - begin) / period)
            excess.append((energy() - start) / given)
            shift.append(float(fluid.x.mean() - rest) / self.length)
        t, excess, shift = map(np.array, (t, excess, shift))
        returned = np.flatnonzero((shift[:-1] > 0.0) & (shift[1:] <= 0.0))
        half = np.nan
        if len(returned):  # the centre of the water is back in the middle after half a period
            i = returned[0]
            half = t[i] + (t[i + 1] - t[i]) * shift[i] / (shift[i] - shift[i + 1])
        return Outcome(
            errors=dict(gain=float(excess.max()), loss=float(-np.interp(1.0, t, excess)),
                        period=float(2.0 * half - 1.0)),
            seconds=stepper.seconds, simulated=stepper.t, steps=stepper.solver.count, particles=len(fluid.x),
            curves={"t [periods]": t, "energy over the start [-]": excess, "shift [lengths]": shift})


@dataclass(frozen=True, kw_only=True)
class PeriodicBox(Problem):
    """A disordered lattice relaxes while it drifts through a periodic box without gravity.

    The box has ``cells`` particles of ``spacing`` [m] on each side, displaced by up to ``jitter`` spacings, with a
    velocity of ``speed`` [m/s] along x and a time step of ``dt`` [s]. Errors: ``momentum``, the largest change of the
    mean velocity over ``speed``; ``mass``, its relative change.
    """

    title: ClassVar[str] = "periodic box"
    reference: ClassVar[str] = "momentum and mass stay constant"
    cells: int = 12
    spacing: float = 0.1
    jitter: float = 0.2
    speed: float = 1.0
    dt: float = 0.01
    steps: int = 200
    kernel: str = "CubicSpline"
    hdx: float = 1.2
    density: DensityConstraint = field(default_factory=DensityConstraint)

    def run(self):
        size = self.cells * self.spacing
        scheme = BoilingScheme(
            ["fluid"], ["wall"], dim=2, spacing=self.spacing, hdx=self.hdx, material=WATER_1ATM, gravity=(0.0,) * 3,
            kernel=getattr(kernels, self.kernel)(dim=2), density=self.density,
            container=BoxContainer(lower=(-9.0 * size, -9.0 * size, 0.0), upper=(9.0 * size, 9.0 * size, 0.0)),
            viscosity=XSPHViscosity(wall=1.0))
        fluid, wall, domain = periodic_box(size, dim=2, spacing=self.spacing, rho0=scheme.rho0, jitter=self.jitter,
                                           hdx=self.hdx)
        scheme.setup_properties([fluid, wall])
        fluid.u[:] = self.speed
        stepper = Stepper(scheme, [fluid, wall], dt=self.dt, domain=domain)
        mass, worst = fluid.m.sum(), 0.0
        for _ in range(self.steps):
            stepper.step()
            drift = np.array([np.sum(fluid.m * fluid.u), np.sum(fluid.m * fluid.v)]) / mass - (self.speed, 0.0)
            worst = max(worst, float(np.abs(drift).max()) / self.speed)
        return Outcome(
            errors=dict(momentum=worst, mass=abs(float(fluid.m.sum() / mass) - 1.0)), seconds=stepper.seconds,
            simulated=stepper.t, steps=stepper.solver.count, particles=len(fluid.x))


@dataclass(frozen=True, kw_only=True)
class StillWater(Problem):
    """A lattice of water is released in an open tank and comes to rest, twice: the second time slightly disturbed.

    The tank is ``cells`` spacings wide and filled to the same height; ``dt_factor`` is the time step over
    t* = sqrt(spacing/g). ``artificial_pressure`` is its strength; with 0 there is none. With ``wall_multipliers``
    walls have multipliers, and ``wall_jitter`` [spacings] makes them rough. The water is observed for ``duration`` t*.
    At the start of the second run its particles are displaced by up to ``disturbance`` spacings.

    Errors: ``speed``, root mean square over sqrt(g spacing), the mean over the last fifth of the time; ``difference``,
    the largest distance of a particle in the two runs at the end, in spacings. Facts: ``sweeps`` per step; ``density``,
    the mean density error as reported by the sweeps, over the last fifth of the time; and at the end ``row``, the
    number of particles per spacing^dim in the densest layer of half a spacing near the surface, 2 for a layer of the
    lattice; ``nearest``, the distance to the nearest particle, in spacings, below which 1 % are; ``level``, twice the
    mean height of the particles over the height of the filling; ``base`` and ``base_gap``, ``side`` and ``side_gap``,
    the densest eighth of a spacing in the first layer at the walls and the gap behind it, 8 and 0 in a lattice, 1 and 1
    without layers; and in 3-D ``plane``, the peak of the radial distribution in the spacing above the base.
    """

    title: ClassVar[str] = "still water"
    reference: ClassVar[str] = "water at rest stays at rest, and a small disturbance stays small"
    dim: int = 3
    cells: int = 14
    spacing: float = 0.004
    dt_factor: float = 0.07
    kernel: str = "CubicSpline"
    hdx: float = 1.2
    density: DensityConstraint = field(default_factory=DensityConstraint)
    viscosity: XSPHViscosity | None = field(default_factory=XSPHViscosity)
    artificial_pressure: float = 0.0
    wall_multipliers: bool = False
    wall_jitter: float = 0.0
    duration: float = 40.0
    disturbance: float = 1e-14

    SAMPLES: ClassVar[int] = 40
    LAYER: ClassVar[float] = 0.5  # spacings

    def structure(self, fluid):
        """The facts from ``row`` on of the fluid where it is now."""
        x = positions(fluid) / self.spacing
        height = np.sort(x[:, self.dim - 1])
        floors = height[height > height[-1] - 2.0]
        number = np.searchsorted(height, floors + self.LAYER) - np.searchsorted(height, floors)
        distance, _ = cKDTree(x).query(x, k=2)
        found = dict(row=float(number.max() / (self.LAYER * self.cells ** (self.dim - 1))),
                     nearest=float(np.quantile(distance[:, 1], 0.01)), level=float(2.0 * height.mean() / self.cells))
        layers = pool_layers(x[:, :self.dim], [float(self.cells)] * self.dim)
        for wall in ("base", "side"):
            found[wall], found[f"{wall}_gap"] = first_layer(layers[wall])
        return found | ({"plane": float(layers["planes"][0])} if self.dim == 3 else {})

    def release(self, disturbance):
        """Stepper of the tank whose particles are displaced by up to ``disturbance`` spacings, and the fluid."""
        flat, size = [0.0] * (3 - self.dim), self.cells * self.spacing
        lower, upper = (0.0, 0.0, 0.0), (*[size] * (self.dim - 1), 1.3 * size, *flat)
        scheme = BoilingScheme(
            ["fluid"], ["wall"], dim=self.dim, spacing=self.spacing, hdx=self.hdx, material=WATER_1ATM,
            kernel=getattr(kernels, self.kernel)(dim=self.dim), density=self.density,
            container=BoxContainer(lower=lower, upper=upper), viscosity=self.viscosity,
            artificial_pressure=repulsion(self.artificial_pressure),
            wall_multipliers=WallMultipliers() if self.wall_multipliers else None)
        common = dict(spacing=self.spacing, dim=self.dim, rho0=scheme.rho0, hdx=self.hdx)
        fluid = fluid_block(lower, (*[size] * self.dim, *flat), jitter=0.01, **common)
        moves = disturbance * self.spacing * np.random.default_rng(1).uniform(-1.0, 1.0, (self.dim, len(fluid.x)))
        for axis, move in zip("xyz", moves):
            fluid.get(axis)[:] += move
        wall = box_vessel(lower, upper, kernel=scheme.kernel, jitter=self.wall_jitter, **common)
        scheme.setup_properties([fluid, wall])
        return Stepper(scheme, [fluid, wall], dt=scheme.time_step(self.dt_factor)), fluid

    def run(self):
        (stepper, fluid), (other, disturbed) = self.release(0.0), self.release(self.disturbance)
        every = max(1, round(self.duration / self.SAMPLES / self.dt_factor))
        t, speed, difference, sweeps, density = [], [], [], [], []
        for _ in range(self.SAMPLES):
            for _ in range(every):
                stepper.step()
                sweeps.append(fluid.sweeps[1])
                density.append(fluid.density_error[0])
            other.step(every)
            t.append(stepper.t / math.sqrt(self.spacing / GRAVITY))
            speed.append(math.sqrt(np.mean(fluid.u**2 + fluid.v**2 + fluid.w**2) / (GRAVITY * self.spacing)))
            places = [positions(pa)[np.argsort(pa.uid)] for pa in (fluid, disturbed)]
            difference.append(float(np.abs(places[0] - places[1]).max()) / self.spacing)
        last = self.SAMPLES // 5
        return Outcome(
            errors=dict(speed=float(np.mean(speed[-last:])), difference=difference[-1]),
            seconds=stepper.seconds, simulated=stepper.t, steps=stepper.solver.count, particles=len(fluid.x),
            curves={"t/t* [-]": np.array(t), "speed/√(g dx) [-]": np.array(speed), "difference/dx [-]": np.array(
                difference)},
            facts=dict(sweeps=float(np.mean(sweeps)), density=float(np.mean(density[-last * every:])),
                       **self.structure(fluid)))

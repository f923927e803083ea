"""Surface tension of bubbles, measured from what it does: the period of an oscillation of shape, and the pressure."""
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pysph.base.nnps import DomainManager
from scipy.optimize import curve_fit
from scipy.spatial import cKDTree

from pysph_boiling.evaluation.problems.problem import Outcome, Problem
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.particles import fluid_block, positions
from pysph_boiling.phases import Phase
from pysph_boiling.runs.stepper import Stepper
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    BoxContainer,
    Cohesion,
    DensityConstraint,
    HeatConduction,
    PhaseChange,
    XSPHViscosity,
)

__all__ = ["BubbleShape", "LaplacePressure"]


def swing(t, size, omega, rate):
    """x'' + 2 ``rate`` x' + ``omega``^2 x = 0 from x = ``size`` at rest; ``rate`` < ``omega``."""
    damped = np.sqrt(np.maximum(omega**2 - rate**2, 1e-12))
    return size * np.exp(-rate * t) * (np.cos(damped * t) + rate / damped * np.sin(damped * t))


@dataclass(frozen=True, kw_only=True)
class Bubble(Problem):
    """Base: a bubble of ``radius`` [m] in liquid of the same density, in a periodic box without gravity.

    The box has a length of ``box`` radii. The time step is ``step`` sqrt(rho spacing^3/sigma).
    """

    dim: int = 2
    spacing: float = 0.001
    radius: float = 0.008
    sigma: float = 0.0589
    box: float = 5.0
    jitter: float = 0.2
    seed: int = 1
    step: float = 0.1
    density: DensityConstraint = DensityConstraint()

    def start(self, stretch=1.0, lean=True):
        """A bubble ``stretch`` times as long along x as across, at rest: (stepper, fluid, its mask of vapour)."""
        n, dim = round(self.box * self.radius / self.spacing), self.dim
        size = n * self.spacing
        far = (9.0 * size,) * 3
        scheme = BoilingScheme(
            ["fluid"], ["wall"], dim=dim, spacing=self.spacing, gravity=(0.0,) * 3, density=self.density,
            container=BoxContainer(lower=tuple(-np.array(far)), upper=far), viscosity=XSPHViscosity(rate=0.0, wall=1.0),
            heat=HeatConduction(time_scaling=1e-9), phases=PhaseChange(), cohesion=Cohesion(sigma=self.sigma),
            lean=lean)
        common = dict(spacing=self.spacing, dim=dim, rho0=scheme.rho0)
        corner = np.array([size] * dim + [0.0] * (3 - dim))
        fluid = fluid_block((0.0,) * 3, corner, jitter=self.jitter, seed=self.seed, **common)
        wall = fluid_block((0.0,) * 3, 2.0 * self.spacing * (corner > 0.0), name="wall", **common)
        wall.m[:] = 0.0  # the box has no walls, but the compiled equations need an array
        scheme.setup_properties([fluid, wall])
        scheme.set_temperature(fluid, WATER_1ATM.T_sat - 1.0)
        periodic = {f"{axis}{end}": value for axis in "xyz"[:dim] for end, value in (("min", 0.0), ("max", size))}
        stepper = Stepper(scheme, [fluid, wall], dt=self.step * math.sqrt(scheme.rho0 * self.spacing**3 / self.sigma),
                          domain=DomainManager(**periodic, **{f"periodic_in_{axis}": True for axis in "xyz"[:dim]}))
        axes = np.array([stretch, *[stretch**(-1.0 / (dim - 1))] * (dim - 1)])
        vapour = np.linalg.norm((positions(fluid)[:, :dim] - 0.5 * size) / axes, axis=1) < self.radius
        fluid.phase[vapour], fluid.e[vapour], fluid.T[vapour] = Phase.VAPOUR, WATER_1ATM.L, WATER_1ATM.T_sat
        return stepper, fluid

    @staticmethod
    def place(fluid, size, dim):
        """Positions (n, dim) of the vapour [m], in one piece where it leaves the box."""
        x = positions(fluid)[fluid.phase == Phase.VAPOUR][:, :dim]
        x = x[0] + (x - x[0] + 0.5 * size) % size - 0.5 * size
        return x


@dataclass(frozen=True, kw_only=True)
class BubbleShape(Bubble):
    """A bubble that is ``stretch`` times as long as wide oscillates between prolate and oblate, for ``periods``.

    A damped oscillation is fitted to the difference of its second moments over their sum.

    Errors: ``frequency``, that of the undamped oscillation over theory, minus 1; ``unexplained``, the standard
    deviation of the residual of the fit over that of the shape; ``momentum``, that of all particles over mass times
    sqrt(sigma/(rho R)). Fact: ``damping``, the damping ratio.
    """

    title: ClassVar[str] = "oscillating bubble"
    reference: ClassVar[str] = ("omega^2 = n (n^2 - 1) sigma/((rho_i + rho_e) R^3) in 2-D (Rayleigh 1879), (n - 1) n "
                                "(n + 1) (n + 2) sigma/(((n + 1) rho_i + n rho_e) R^3) in 3-D (Lamb 1932, section "
                                "275), n = 2")
    stretch: float = 1.2
    periods: float = 1.0

    def theory(self, n):
        """Angular frequency [1/s] of the bubble of ``n`` particles."""
        if self.dim == 2:
            return math.sqrt(3.0 * self.sigma / WATER_1ATM.rho_l / (math.sqrt(n / math.pi) * self.spacing)**3)
        return math.sqrt(4.8 * self.sigma / WATER_1ATM.rho_l / (3.0 * n / (4.0 * math.pi)) / self.spacing**3)

    def run(self):
        stepper, fluid = self.start(self.stretch)
        size = round(self.box * self.radius / self.spacing) * self.spacing
        omega = self.theory(int(np.count_nonzero(fluid.phase == Phase.VAPOUR)))
        t, shape, every = [], [], max(1, round(2.0 * math.pi / omega / stepper.dt / 60))
        while stepper.t < self.periods * 2.0 * math.pi / omega:
            x = self.place(fluid, size, self.dim)
            moments = np.mean((x - x.mean(0))**2, axis=0)
            across = np.mean(moments[1:])
            t.append(stepper.t * omega)
            shape.append((moments[0] - across) / (moments[0] + (self.dim - 1) * across))
            stepper.step(every)
        t, shape = np.array(t), np.array(shape)
        fit = curve_fit(swing, t, shape, p0=(shape[0], 1.0, 0.1))[0]
        left = shape - swing(t, *fit)
        momentum = np.linalg.norm([np.sum(fluid.m * fluid.get(name)) for name in "uvw"]) / fluid.m.sum()
        return Outcome(
            errors=dict(frequency=float(abs(fit[1]) - 1.0), unexplained=float(np.std(left) / np.std(shape)),
                        momentum=float(momentum / math.sqrt(self.sigma / (WATER_1ATM.rho_l * self.radius)))),
            seconds=stepper.seconds, simulated=stepper.t, steps=stepper.solver.count, particles=len(fluid.x),
            curves={"t omega [-]": t, "shape [-]": shape, "fit [-]": swing(t, *fit)},
            facts=dict(damping=float(fit[2] / abs(fit[1]))))


@dataclass(frozen=True, kw_only=True)
class LaplacePressure(Bubble):
    """The pressure in a bubble at rest against that of the liquid, from the virial of all forces between particles.

    The bubble settles for ``settle`` sqrt(rho R^3/sigma), then the virial is averaged over ``samples`` steps: that of
    the density constraint and of cohesion, over particles of the bubble that are farther than the range of cohesion
    from its surface, and over the liquid that is as far from it.

    Error: ``pressure``, the difference over theory, minus 1. Facts: ``difference`` and ``theory`` [Pa].
    """

    title: ClassVar[str] = "Laplace pressure"
    reference: ClassVar[str] = "(dim - 1) sigma/R: Laplace 1806"
    settle: float = 3.0
    samples: int = 60

    def run(self):
        stepper, fluid = self.start(lean=False)
        size, dx = round(self.box * self.radius / self.spacing) * self.spacing, self.spacing
        scheme = stepper.scheme
        equations = {type(term.equation).__name__: term.equation for term in scheme.terms()}
        cohesion, rho_rest = equations["BubbleCohesion"], equations["PBFLambda"].rho_rest
        radius = dx * (math.sqrt(np.sum(fluid.phase == Phase.VAPOUR) / math.pi) if self.dim == 2 else math.cbrt(
            0.75 / math.pi * np.sum(fluid.phase == Phase.VAPOUR)))
        stepper.step(math.ceil(self.settle * math.sqrt(scheme.rho0 * radius**3 / self.sigma) / stepper.dt))
        (move,) = (group for stage in stepper.equations.groups for block in stage for group in block.equations
                   if group.name == "density_move")
        impulse, found = np.zeros(len(fluid.x)), []
        move.post.append(lambda: np.add(impulse, self.density.omega * fluid.lmbda, out=impulse))
        for _ in range(self.samples):
            impulse[:] = 0.0
            stepper.step()
            x, vapour = positions(fluid)[:, :self.dim] % size, fluid.phase == Phase.VAPOUR
            pressure = self.virial(x, vapour, fluid, impulse, scheme, cohesion, rho_rest, stepper.dt, size)
            own = self.place(fluid, size, self.dim)
            r = np.linalg.norm((x - own.mean(0) + 0.5 * size) % size - 0.5 * size, axis=1)
            inside, outside = vapour & (r < radius - cohesion.radius), r > radius + cohesion.radius
            found.append(pressure[inside].mean() - pressure[outside].mean())
        difference = float(np.mean(found))
        theory = (self.dim - 1) * self.sigma / radius
        return Outcome(
            errors=dict(pressure=difference / theory - 1.0), seconds=stepper.seconds, simulated=stepper.t,
            steps=stepper.solver.count, particles=len(fluid.x),
            facts=dict(difference=difference, theory=theory))

    def virial(self, x, vapour, fluid, impulse, scheme, cohesion, rho_rest, dt, size):
        """Pressure [Pa] (n,) on each particle, sum_j F_ij . (x_i - x_j)/(2 dim V)."""
        pairs = cKDTree(x, boxsize=size).query_pairs(2.0 * fluid.h[0], output_type="ndarray")
        i, j = pairs.T
        d = (x[i] - x[j] + 0.5 * size) % size - 0.5 * size
        r, m, h = np.linalg.norm(d, axis=1), fluid.m[0], fluid.h[0]
        table = np.linspace(0.0, 2.0 * h, 2001)
        slope = np.interp(r, table, [scheme.kernel.dwdq(one, h) / h for one in table])
        force = m * (impulse[i] + impulse[j]) * slope / (rho_rest * dt**2)
        q = r / cohesion.radius
        shape = np.where(q < 1.0, 64.0 * (1.0 - q)**3 * q**3 * np.where(q <= 0.5, 2.0, 1.0) - (q <= 0.5), 0.0)
        force -= np.where(vapour[i] & vapour[j], m * cohesion.strength * shape, 0.0)
        total = np.bincount(i, force * r, len(x)) + np.bincount(j, force * r, len(x))
        return total / (2.0 * self.dim * m / scheme.rho0)

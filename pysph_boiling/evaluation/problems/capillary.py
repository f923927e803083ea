"""Surface tension of bubbles, measured from what it does: the period of an oscillation of shape, and the pressure."""
import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np
from scipy.optimize import curve_fit
from scipy.spatial import cKDTree

from pysph_boiling.analysis.drops import pieces
from pysph_boiling.evaluation.problems.periodic_box import periodic_box
from pysph_boiling.evaluation.problems.problem import Outcome, Problem
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.particles import positions
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


def swing(t, omega, rate):
    """x'' + 2 ``rate`` x' + ``omega``^2 x = 0 from x = 1 at rest; ``rate`` < ``omega``."""
    damped = np.sqrt(np.maximum(omega**2 - rate**2, 1e-12))
    return np.exp(-rate * t) * (np.cos(damped * t) + rate / damped * np.sin(damped * t))


def fitted_swing(t, shape):
    """(omega, rate) [1/unit of ``t``] of the :func:`swing` closest to the ``shape`` at the times ``t``.

    Both are NaN for a shape that has none with an omega from 0.3 to 2, such as one that does not change.
    """
    try:
        found, _ = curve_fit(swing, t, shape, p0=(1.0, 0.3), bounds=((0.3, 0.0), (2.0, 0.9)))
    except RuntimeError:  # of SciPy, without a minimum
        return np.full(2, np.nan)
    return found


def length(x):
    """Ratio [-] of the longest axis to the shortest of the ellipsoid with the second moments of points (n, dim)."""
    shortest, *_, longest = np.linalg.eigvalsh(np.cov(x.T))
    return math.sqrt(longest / shortest)


@dataclass(frozen=True, kw_only=True)
class Bubble(Problem):
    """Base: a bubble of ``radius`` [m] in liquid of the same density, in a periodic box without gravity.

    The box has a length of ``box`` radii. The time step is ``step`` sqrt(rho spacing^3/sigma). Each of the ``starts``
    runs begins with another disturbance of the lattice, by up to ``jitter`` spacings, from seeds that begin with
    ``seed``. ``fill`` is the density over that at rest, 0.994 in 2-D and 0.99 in 3-D if not given: a random packing
    at rest density is under pressure, 11 sigma/R with a radius of 8 spacings in 2-D, and the higher the pressure, the
    more it resists a change of shape.
    """

    dim: int = 2
    spacing: float = 0.001
    radius: float = 0.008
    sigma: float = 0.0589
    box: float = 5.0
    jitter: float = 0.2
    fill: float | None = None
    seed: int = 1
    starts: int = 3
    step: float = 0.1
    stretch: float = 1.2
    density: DensityConstraint = DensityConstraint()

    FILL: ClassVar[MappingProxyType] = MappingProxyType({2: 0.994, 3: 0.99})

    @property
    def size(self):
        """Length of the box [m]."""
        return round(self.box * self.radius / self.spacing) * self.spacing

    def disc(self, x):
        """Whether points ``x`` (n, dim) [m] from the centre are in the bubble (n,)."""
        return np.linalg.norm(x, axis=1) < self.radius

    def ellipse(self, x):
        """As :meth:`disc`, ``stretch`` radii long along x and shorter across, with the same volume."""
        axes = np.array([self.stretch, *[self.stretch**(-1.0 / (self.dim - 1))] * (self.dim - 1)])
        return self.disc(x / axes)

    def start(self, seed, inside):
        """A bubble at rest of the particles ``inside`` (as :meth:`disc`): (stepper, fluid)."""
        dim, size = self.dim, self.size
        far = (9.0 * size,) * 3
        scheme = BoilingScheme(
            ["fluid"], ["wall"], dim=dim, spacing=self.spacing, gravity=(0.0,) * 3, density=self.density,
            container=BoxContainer(lower=tuple(-np.array(far)), upper=far), viscosity=XSPHViscosity(rate=0.0, wall=1.0),
            heat=HeatConduction(time_scaling=1e-9), phases=PhaseChange(), cohesion=Cohesion(sigma=self.sigma))
        fill = self.FILL[dim] if self.fill is None else self.fill
        fluid, wall, domain = periodic_box(size, dim=dim, spacing=self.spacing, rho0=fill * scheme.rho0,
                                           jitter=self.jitter, seed=seed)
        scheme.setup_properties([fluid, wall])
        scheme.set_temperature(fluid, WATER_1ATM.T_sat - 1.0)
        stepper = Stepper(scheme, [fluid, wall], dt=self.step * math.sqrt(scheme.rho0 * self.spacing**3 / self.sigma),
                          domain=domain)
        vapour = inside(positions(fluid)[:, :dim] - 0.5 * size)
        fluid.phase[vapour], fluid.e[vapour], fluid.T[vapour] = Phase.VAPOUR, WATER_1ATM.L, WATER_1ATM.T_sat
        return stepper, fluid

    def omega(self, fluid):
        """Angular frequency [1/s] of an oscillation between long and wide, by theory."""
        return math.sqrt((3.0 if self.dim == 2 else 4.8) * self.sigma / (WATER_1ATM.rho_l *
                                                                         self.equivalent_radius(fluid)**3))

    def nearest(self, d):
        """Vectors (n, dim) [m] to the nearest images."""
        return (d + 0.5 * self.size) % self.size - 0.5 * self.size

    def place(self, fluid):
        """Positions (n, dim) of the vapour [m], in one piece where it leaves the box."""
        x = positions(fluid)[fluid.phase == Phase.VAPOUR][:, :self.dim]
        return x[0] + self.nearest(x - x[0])

    def equivalent_radius(self, fluid):
        """Radius [m] of a disc or ball with the volume of the vapour."""
        n = np.count_nonzero(fluid.phase == Phase.VAPOUR)
        return self.spacing * (math.sqrt(n / math.pi) if self.dim == 2 else math.cbrt(0.75 * n / math.pi))


@dataclass(frozen=True, kw_only=True)
class BubbleShape(Bubble):
    """A bubble that starts longer along x than across (``stretch`` radii) oscillates for ``periods``.

    A damped oscillation is fitted to the difference of its second moments over their sum, relative to the start: to
    the mean of all starts, and to each.

    Errors: ``frequency``, that of the undamped oscillation over theory, minus 1; ``unexplained``, the standard
    deviation of the residual of the fit over that of the shape; ``momentum``, the largest of all particles over mass
    times sqrt(sigma/(rho R)). Facts: ``damping``, the damping ratio; ``found``, the frequency of each start over
    theory.
    """

    title: ClassVar[str] = "oscillating bubble"
    reference: ClassVar[str] = ("omega^2 = n (n^2 - 1) sigma/((rho_i + rho_e) R^3) in 2-D (Rayleigh 1879), (n - 1) n "
                                "(n + 1) (n + 2) sigma/(((n + 1) rho_i + n rho_e) R^3) in 3-D (Lamb 1932, section "
                                "275), n = 2")
    periods: float = 1.0

    def run(self):
        runs = [self.one(self.seed + start) for start in range(self.starts)]
        t = np.linspace(0.0, 2.0 * math.pi * self.periods, 120)
        shapes = [np.interp(t, *run["curve"]) for run in runs]
        shape = np.mean(shapes, axis=0)
        omega, rate = fitted_swing(t, shape)
        fit = swing(t, omega, rate)
        return Outcome(
            errors=dict(frequency=float(omega - 1.0), unexplained=float(np.std(shape - fit) / np.std(shape)),
                        momentum=max(run["momentum"] for run in runs)),
            seconds=sum(run["seconds"] for run in runs), simulated=sum(run["simulated"] for run in runs),
            steps=sum(run["steps"] for run in runs), particles=runs[0]["particles"],
            curves={"t omega [-]": t, "shape [-]": shape, "fit [-]": fit},
            facts=dict(damping=float(rate / omega), found=[float(fitted_swing(t, one)[0]) for one in shapes]))

    def one(self, seed):
        """Run one start; times are in units of theory."""
        stepper, fluid = self.start(seed, self.ellipse)
        omega = self.omega(fluid)
        t, shape, every = [], [], max(1, round(2.0 * math.pi / omega / stepper.dt / 60))
        while not t or t[-1] < 2.0 * math.pi * self.periods:
            x = self.place(fluid)
            along, *across = np.var(x, axis=0)
            t.append(stepper.t * omega)
            shape.append((along - np.mean(across)) / (along + np.sum(across)))
            stepper.step(every)
        momentum = np.linalg.norm([np.sum(fluid.m * fluid.get(name)) for name in "uvw"]) / fluid.m.sum()
        speed = math.sqrt(self.sigma / (WATER_1ATM.rho_l * self.radius))
        return dict(curve=(t, np.array(shape) / shape[0]), momentum=float(momentum / speed),
                    seconds=stepper.seconds, simulated=stepper.t, steps=stepper.solver.count, particles=len(fluid.x))


@dataclass(frozen=True, kw_only=True)
class LaplacePressure(Bubble):
    """The pressure in a bubble at rest against that of the liquid, from the virial of all forces between particles.

    A packing keeps stress from how it came to rest. So it is shaken: while the bubbles settle, for ``settle``
    sqrt(rho R^3/sigma), each particle gets random velocities, in each step of ``shake`` sqrt(sigma/(rho spacing)) at
    first, linearly less until none are left after :attr:`QUIET` of that time. Bubbles of odd seeds start long
    (``stretch`` radii), as in :class:`BubbleShape`, the others round. Then the virial is averaged over ``samples``
    steps: that of the density constraint and of cohesion, over particles of the bubble that are farther than the range
    of cohesion from its surface, and over the liquid that is as far from it.

    Error: ``pressure``, the mean difference over theory, minus 1. Facts: ``found``, the differences over theory;
    ``length``, the largest ratio of axes at the end; ``torn``, the largest share of the vapour outside the largest
    piece.
    """

    title: ClassVar[str] = "Laplace pressure"
    reference: ClassVar[str] = "(dim - 1) sigma/R: Laplace 1806"
    settle: float = 3.0
    shake: float = 0.05
    starts: int = 4
    samples: int = 60

    QUIET: ClassVar[float] = 0.7

    def run(self):
        runs = [self.one(self.seed + start) for start in range(self.starts)]
        found = [run["found"] for run in runs]
        return Outcome(
            errors=dict(pressure=float(np.mean(found) - 1.0)), seconds=sum(run["seconds"] for run in runs),
            simulated=sum(run["simulated"] for run in runs), steps=sum(run["steps"] for run in runs),
            particles=runs[0]["particles"], facts=dict(
                found=found, length=max(run["length"] for run in runs), torn=max(run["torn"] for run in runs)))

    def one(self, seed):
        """Run one start."""
        stepper, fluid = self.start(seed, self.ellipse if seed % 2 else self.disc)
        scheme, radius = stepper.scheme, self.equivalent_radius(fluid)
        reach = Cohesion().radius * self.spacing
        self.calm(stepper, fluid, seed)
        shape, found = self.place(fluid), []
        _, sizes = pieces(shape, 1.6 * self.spacing)
        for _ in range(self.samples):
            stepper.step()
            pressure = self.virial(fluid, scheme, stepper.dt)
            r = np.linalg.norm(self.nearest(positions(fluid)[:, :self.dim] - self.place(fluid).mean(0)), axis=1)
            inside, outside = r < radius - reach, r > radius + reach
            found.append(pressure[inside].mean() - pressure[outside].mean())
        return dict(found=float(np.mean(found) * radius / (self.sigma * (self.dim - 1))), length=length(shape),
                    torn=1.0 - sizes.max() / sizes.sum(), seconds=stepper.seconds, simulated=stepper.t,
                    steps=stepper.solver.count, particles=len(fluid.x))

    def calm(self, stepper, fluid, seed):
        """Let a bubble settle, first shaken by random velocities from ``seed``."""
        rho = stepper.scheme.rho0
        rng, speed = np.random.default_rng([seed, 1]), math.sqrt(self.sigma / (rho * self.spacing))
        steps = math.ceil(self.settle * math.sqrt(rho * self.equivalent_radius(fluid)**3 / self.sigma) / stepper.dt)
        for step in range(steps):
            kick = self.shake * speed * max(0.0, 1.0 - step / (self.QUIET * steps))
            for name in "uvw"[:self.dim]:
                random = rng.normal(size=len(fluid.x))
                fluid.get(name)[:] += kick * (random - random.mean())
            stepper.step()

    def virial(self, fluid, scheme, dt):
        """Pressure [Pa] (n,) on each particle in the last step, sum_j F_ij . (x_i - x_j)/(2 dim V)."""
        equations = {type(term.equation).__name__: term.equation for term in scheme.terms()}
        cohesion, rho_rest = equations["BubbleCohesion"], equations["PBFLambda"].rho_rest
        x, vapour = positions(fluid)[:, :self.dim] % self.size, fluid.phase == Phase.VAPOUR
        i, j = cKDTree(x, boxsize=self.size).query_pairs(2.0 * fluid.h[0], output_type="ndarray").T
        r, m, h = np.linalg.norm(self.nearest(x[i] - x[j]), axis=1), fluid.m[0], fluid.h[0]
        table = np.linspace(0.0, 2.0 * h, 2001)
        slope = np.interp(r, table, [scheme.kernel.dwdq(one, h) / h for one in table])
        force = m * (fluid.impulse[i] + fluid.impulse[j]) * slope / (rho_rest * dt**2)
        q = r / cohesion.radius
        shape = np.where(q < 1.0, 64.0 * (1.0 - q)**3 * q**3 * np.where(q <= 0.5, 2.0, 1.0) - (q <= 0.5), 0.0)
        force -= np.where(vapour[i] & vapour[j], m * cohesion.strength * shape, 0.0)
        total = np.bincount(i, force * r, len(x)) + np.bincount(j, force * r, len(x))
        return total / (2.0 * self.dim * self.size**self.dim / len(x))

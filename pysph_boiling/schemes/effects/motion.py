"""Motion: the density constraint, containers, viscosity."""
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pysph.solver.tools import Tool

from pysph_boiling.equations import container, density_constraint, viscosity, warm_start
from pysph_boiling.particles import Property, fill, lattice_density, lattice_stiffness, vector
from pysph_boiling.rooms import Room
from pysph_boiling.schemes.effects.base import Column, Effect, Rule, cumulative, param
from pysph_boiling.schemes.integrator import MAX_SUBSTEPS, MotionLimits
from pysph_boiling.schemes.stages import Term

__all__ = ["BoxContainer", "CylinderContainer", "DensityConstraint", "DistanceContainer", "XSPHViscosity"]

STANDARD_DT_FACTOR = 0.07  # t*; the default time step
MAX_OMEGA = 0.7  # largest default under-relaxation
DISORDER = 1.15  # stiffness of settled water over that of the lattice, at most; measured 1.14 (2-D) and 1.11 (3-D)
WARM_START = 0.4  # share of the pressure of a step with which the next one begins
TREND = 0.3  # how much of the last change of the pressure a warm start goes on with
MAX_PUSH = 0.15  # spacings that an acceleration may move a particle in one step
MAX_VELOCITY_EXCHANGE = 0.9  # share of a velocity difference that viscosity, friction and drag may even out in one step


class UnconvergedSteps(Tool):
    """Counts the steps that ended with a mean density error above the bound ``max_mean_error``."""

    def __init__(self, scheme, effect):
        self.scheme, self.effect = scheme, effect

    def post_step(self, solver):
        for pa in self.scheme.arrays:
            if pa.constants["density_error"][0] > self.effect.error_limit:
                pa.constants["unconverged"][0] += 1.0


@dataclass(frozen=True, kw_only=True)
class DensityConstraint(Effect):
    """Incompressible motion by Position Based Fluids, with gravity. In a scene without it, particles do not move."""

    slot: ClassVar[str] = "density"
    title: ClassVar[str] = "density constraint"
    in_guest: ClassVar[bool] = False
    auto_rule: ClassVar[Rule] = Rule(
        lambda facts, chosen: facts.g > 0.0, "there is gravity", "no gravity: nothing sets the fluid in motion")
    min_sweeps: int = param(2, "-", "smallest number of sweeps in a step; sweeps are made in pairs", low=1,
                            may_change=True)
    max_sweeps: int = param(6, "-", "largest number of sweeps, unless the error is above max_mean_error", low=1,
                            may_change=True)
    tolerance: float = param(4e-3, "-", "mean positive density error at which the sweeps end",
                             low=0.0, may_change=True)
    omega: float = param(None, "-", "under-relaxation; 0.7 if not given, or less where pairs of sweeps would overshoot",
                         above=0.0, high=1.0)
    eps: float = param(0.1, "-", "relaxation of the multipliers, relative to sum w |grad C|^2 of the rest lattice",
                       low=0.0)
    max_displacement: float = param(0.5, "-", "largest displacement in one sweep, in spacings", above=0.0)
    chebyshev_radius: float = param(0.0, "-", "Chebyshev acceleration: estimated spectral radius of a sweep; 0 is off",
                                    low=0.0, high=0.999)
    chebyshev_delay: int = param(2, "-", "plain sweeps before the first accelerated one", low=1)
    settle: int = param(50, "-", "largest number of passes before the first step that move apart particles that "
                        "start too close, without a velocity; 0 leaves the start as it is", low=0)
    courant: float = param(0.4, "-", "a step is split if a particle would move farther than this, in spacings",
                           above=0.0, may_change=True)
    longest_step: float = param(0.15, "t*", "longer steps are split, t* = sqrt(spacing/|g|), and also steps in which "
                                "viscosity and drag would overshoot", above=0.0, may_change=True)
    short_step: float = param(0.017, "t*", "in shorter steps an existing density error is corrected without causing "
                              "a velocity, t* = sqrt(spacing/|g|)", above=0.0, may_change=True)
    max_mean_error: float = param(0.015, "-", "mean positive density error above which more than max_sweeps are made, "
                                  "up to ten times as many", above=0.0, may_change=True)
    warm_start: float = param(None, "-", "share of a step's pressure with which the next one begins, 0: from nothing; "
                              "0.4 if not given, 0 with accelerated sweeps", low=0.0, high=0.5, may_change=True)
    skin: float = param(0.0, "-", "neighbour lists reach this many spacings farther, and are kept until a particle has "
                        "moved by half of that", low=0.0, high=1.0)

    def __post_init__(self):
        super().__post_init__()
        if self.min_sweeps > self.max_sweeps:
            raise ValueError(f"density.min_sweeps = {self.min_sweeps} is above density.max_sweeps = {self.max_sweeps}")
        if self.chebyshev_radius and self.warm_start:
            raise ValueError(f"density.warm_start = {self.warm_start:g} is for plain sweeps, and density."
                             f"chebyshev_radius = {self.chebyshev_radius:g} accelerates them: both together lift water "
                             "at rest by up to 24 %; leave one of them out")

    @property
    def share_at_start(self):
        """Share of a step's pressure with which the next one begins [-]."""
        if self.warm_start is not None:
            return self.warm_start
        return 0.0 if self.chebyshev_radius else WARM_START

    @property
    def error_limit(self):
        """Mean positive density error that the end of a step should not exceed [-]."""
        return max(self.max_mean_error, self.tolerance)

    def omega_in(self, scene):
        """Under-relaxation [-]: as given, or the largest up to 0.7 with which pairs of sweeps are stable.

        A sweep multiplies the density error of a wave by 1 - omega s, where its stiffness s is up to 2.6 in 2-D and 4
        in 3-D. All sweeps of a step multiply it by r, and enter the velocity. Such a wave decays from step to step if
        -1/3 < r < 1, else it grows. A pair of sweeps has r = (1 - omega s)^2, which is in this range if omega s < 2.
        """
        if self.omega is not None:
            return self.omega
        stiffness = lattice_stiffness(scene.kernel, dim=scene.dim, hdx=scene.h / scene.spacing) / (1.0 + self.eps)
        return min(MAX_OMEGA, 2.0 / (DISORDER * stiffness))

    def properties(self, scene):
        return (
            *vector("au av aw", "m/s^2", "acceleration for the next prediction", state=True),
            *vector("sx sy sz", "m", "displacement of this step, x* - x"),
            Property("lmbda", "kg m^2", "Lagrange multiplier of the density constraint"),
            Property("impulse", "kg m^2", "sum of the multipliers of this step"),
            Property("lmbda_last", "J", "that sum over dt^2, of the last step", state=True),
            Property("lmbda_start", "J", "multiplier over dt^2 with which a step begins", state=True),
            Property("compression", "-", "positive part of the density constraint C"),
            Property("left_over", "-", "compression from before a short step"),
            *vector("gcx gcy gcz", "1/m", "gradient of C with respect to the particle itself"),
            Property("gc2", "1/(kg m^2)", "sum over the others of |grad C|^2 / m"),
            *vector("dpx dpy dpz", "m", "position correction of one sweep"),
            Property("limited", "-", "corrections cut by the displacement limiter since the start", "int", True, True),
            *((*vector("qx qy qz", "m", "displacement of the last sweep"),
               Property("q_lmbda", "kg m^2", "multiplier of the last sweep")) if self.chebyshev_radius else ()),
            *((Property("place", "-", "index at the last neighbour search", "int", True),
               *vector("listed_x listed_y listed_z", "m", "position at the last neighbour search", state=True))
              if self.skin else ()),
        )

    def constants(self, scene):
        accelerated = {"sweep_weight": [1.0, math.inf, 0.0]} if self.chebyshev_radius else {}
        return {"density_error": [0.0, 0.0], "sweeps": [0.0, 0.0], "first_sweeps": [0.0, 0.0], "unconverged": 0.0,
                "settled": 0.0, "substeps": [1.0, 0.0], "prior": [1.0, 1.0, 1.0], "warm_start": [0.0, 0.0, 0.0]
                } | accelerated | ({"listed": -1.0} if self.skin else {})

    def check(self, scene, arrays):
        """Check that no particle exceeds rest density by itself, because no motion could correct that."""
        lattice, _ = lattice_density(scene.kernel, dim=scene.dim, hdx=scene.h / scene.spacing)
        expansion = scene.effects.get("expansion")
        for name in scene.fluids:
            m, h = (arrays[name].get(prop, only_real_particles=False) for prop in ("m", "h"))  # not on a device yet
            lengths, which = np.unique(h, return_inverse=True)
            alone = np.array([scene.kernel.kernel([0.0] * 3, 0.0, length) for length in lengths])
            limits = scene.rho0 * lattice / alone[which]
            if np.any(m >= limits):
                worst = int(np.argmax(m / limits))
                raise ValueError(
                    f"the mass of particle {worst} of '{name}' must be below {limits[worst]:.4g} kg at its smoothing "
                    f"length of {h[worst]:.4g} m, got {m[worst]:.4g} kg: by itself it would exceed rest density")
            if expansion and np.any(m * expansion.max_swell(scene) >= limits):
                worst = int(np.argmax(m / limits))
                raise ValueError(
                    f"{expansion.describe_max_swell(scene)} must be below {limits[worst] / m[worst]:.4g} for a "
                    f"particle of {m[worst]:.4g} kg and a smoothing length of {h[worst]:.4g} m, got "
                    f"{expansion.max_swell(scene):.4g}: vapour that swells so far is denser than at rest when alone")

    def prepare(self, scene, arrays):
        """Set gravity for the first step, since forces are summed at the end of a step for the next one."""
        for name in scene.fluids:
            for axis, g in zip(("au", "av", "aw"), scene.gravity):
                fill(arrays[name], axis, g)

    def columns(self, scene):
        def largest(constant, index):
            return lambda arrays, scene: max(pa.constants[constant][index] for pa in arrays)

        return (
            Column("sweeps", "-", "density sweeps of the last step", largest("sweeps", 1)),
            Column("density_error_mean", "-", "mean positive density error before the last sweep",
                   largest("density_error", 0)),
            Column("density_error_max", "-", "largest positive density error before the last sweep",
                   largest("density_error", 1)),
            Column("n_unconverged", "-", "steps since the start that ended with a mean density error above "
                   "max_mean_error", largest("unconverged", 0)),
            Column("substeps", "-", "steps into which the last step was split", largest("substeps", 0)),
            Column("n_split", "-", "steps since the start that were split", largest("substeps", 1)),
            cumulative("n_limited", "-", "corrections cut by the displacement limiter since the start", "limited"),
        )

    def limits(self, scene, dt):
        """The :class:`MotionLimits` of the integrator; without gravity the time step ``dt`` [s] is the unit of time.

        Errors: ``ValueError`` if every step of ``dt`` would be split into more parts than allowed.
        """
        fall = scene.fall_time
        short_step = self.short_step * (fall if scene.g else dt / STANDARD_DT_FACTOR)
        rates = {slot: effect.rate_of_velocity(scene) for slot, effect in scene.effects.items()}
        longest, rate = self.longest_step * fall, sum(rates.values())
        if rate > 0.0:
            longest = min(longest, MAX_VELOCITY_EXCHANGE / rate)
        if dt > MAX_SUBSTEPS * longest:
            cause = f"density.longest_step = {self.longest_step:.3g} t* allows no more"
            if longest < self.longest_step * fall:
                slot = max(rates, key=rates.get)
                cause = f"the effect '{slot}' has a rate of {rates[slot]:.3g} 1/s: lower its rate"
            raise ValueError(f"each step of {dt:.3g} s would be split into {dt / longest:.3g} parts, more than "
                             f"{MAX_SUBSTEPS}; {cause}, or use shorter steps")
        return MotionLimits(longest_step=longest, short_step=short_step, tolerance=self.tolerance,
                            distance=self.courant * scene.spacing, push=MAX_PUSH * scene.spacing, settle=self.settle,
                            warm_start=(self.share_at_start, TREND))

    def tools(self, scheme):
        yield UnconvergedSteps(scheme, self)

    def terms(self, scene, fluid):
        fluids, walls = list(scene.fluids), list(scene.solids)
        lattice, squares = lattice_density(scene.kernel, dim=scene.dim, hdx=scene.h / scene.spacing)
        rho_rest = scene.rho0 * lattice
        eps = self.eps * squares / (scene.spacing**2 * scene.particle_mass)
        density, correction = density_constraint.PBFDensity, density_constraint.PBFPositionCorrection
        start = warm_start.PBFWarmStart
        if "expansion" in scene.effects:
            density = density_constraint.PBFDensitySwollen
            correction = density_constraint.PBFPositionCorrectionSwollen
            start = warm_start.PBFWarmStartSwollen
        yield Term("density.back", density_constraint.PBFStepBack(fluid, None))
        for place in ("density.before", "density.multiplier"):
            yield Term(place, density(fluid, fluids, rho_rest=rho_rest, kernel=scene.kernel))
            if walls:
                yield Term(place, density_constraint.PBFBoundaryDensity(
                    fluid, walls, rho_rest=rho_rest, kernel=scene.kernel))
        yield Term("density.left_over", density_constraint.PBFLeftOver(fluid, None, rho_rest=rho_rest))
        yield Term("density.correction", correction(
            fluid, fluids, rho_rest=rho_rest, kernel=scene.kernel, nudge=0.05 * scene.spacing))
        if walls:
            yield Term("density.correction", density_constraint.PBFBoundaryCorrection(
                fluid, walls, rho_rest=rho_rest, kernel=scene.kernel))
        yield Term("density.multiplier", density_constraint.PBFLambda(
            fluid, None, rho_rest=rho_rest, eps=eps, tolerance=self.tolerance, sweeps=self.max_sweeps,
            max_mean_error=self.error_limit))
        move = dict(omega=self.omega_in(scene), max_displacement=self.max_displacement * scene.spacing)
        yield Term("density.move", density_constraint.PBFMoveAccelerated(
            fluid, None, radius=self.chebyshev_radius, delay=self.chebyshev_delay, **move) if self.chebyshev_radius
            else density_constraint.PBFMove(fluid, None, **move))
        gx, gy, gz = scene.gravity
        yield Term("forces.sum", viscosity.PBFBodyForce(fluid, None, gx=gx, gy=gy, gz=gz))
        if self.share_at_start:
            yield Term("forces.sum", start(fluid, fluids, rho_rest=rho_rest))
            if walls:
                yield Term("forces.sum", warm_start.PBFBoundaryWarmStart(fluid, walls, rho_rest=rho_rest))


CONTACTS = (
    Property("contacts", "-", "contacts with the container since the start", "int", True, True),
    Property("projected", "-", "projections into the container since the start", "int", True, True))
N_CONTACTS = (
    cumulative("n_contacts", "-", "contacts with the container since the start", "contacts"),
    cumulative("n_projected", "-", "projections into the container since the start", "projected"))


def contained(scene, margin):
    """The places where a container acts, each with the largest distance [m] of being moved back that is a contact.

    In a short step, particles that were outside before are moved back without a velocity. A prediction always ends at
    the wall, which is a contact, since steps are short enough (``density.courant``). A correction in a sweep that
    pushes a particle through the margin and out of the container is a projection.
    """
    return (("density.back", math.inf), ("density.contact", math.inf), ("density.move", margin * scene.spacing))


@dataclass(frozen=True, kw_only=True)
class BoxContainer(Effect):
    """A box that particles cannot leave, because they are moved back inside."""

    slot: ClassVar[str] = "container"
    title: ClassVar[str] = "box container"
    requires: ClassVar[tuple[str, ...]] = ("density",)
    in_guest: ClassVar[bool] = False
    auto_rule: ClassVar[Rule] = Rule(
        lambda facts, chosen: facts.walls, "it catches particles that leak through walls", "there are no walls")
    lower: tuple = param((0.0, 0.0, 0.0), "m", "lower corner of the inside")
    upper: tuple = param((1.0, 1.0, 1.0), "m", "upper corner of the inside; its top is a lid")
    margin: float = param(0.1, "-", "particles stop this many spacings before a face", low=0.0, high=0.5)

    def __post_init__(self):
        super().__post_init__()
        if len(self.lower) != 3 or len(self.upper) != 3:
            raise ValueError("container.lower and container.upper must each be three lengths [m]")

    def properties(self, scene):
        return CONTACTS

    def columns(self, scene):
        return N_CONTACTS

    def bounds(self, scene):
        """Corners that particle centres may reach [m]."""
        inset = self.margin * scene.spacing
        lower = [v + inset if axis < scene.dim else 0.0 for axis, v in enumerate(self.lower)]
        upper = [v - inset if axis < scene.dim else 0.0 for axis, v in enumerate(self.upper)]
        return lower, upper

    def covers(self, scene, point):
        """Whether the vertical through a point of the bounds lies inside."""
        return True

    def volume(self, scene):
        """Volume of the inside [m^dim]; in a periodic domain, that of one period."""
        sides = np.where(scene.period > 0.0, scene.period, np.subtract(self.upper, self.lower))
        return float(np.prod(sides[:scene.dim]))

    def check(self, scene, arrays):
        lower, upper = self.bounds(scene)
        for axis in range(scene.dim):
            if not lower[axis] < upper[axis]:
                raise ValueError(f"container: lower {'xyz'[axis]} must be below upper {'xyz'[axis]}, got "
                                 f"{self.lower[axis]} and {self.upper[axis]} m")

    def terms(self, scene, fluid):
        lower, upper = self.bounds(scene)
        for place, depth in contained(scene, self.margin):
            yield Term(place, container.PBFBoxContainer(fluid, None, lower=lower, upper=upper, depth=depth))


@dataclass(frozen=True, kw_only=True)
class CylinderContainer(Effect):
    """An upright cylinder that particles cannot leave; in 2-D, its section through the axis."""

    slot: ClassVar[str] = "container"
    title: ClassVar[str] = "cylinder container"
    requires: ClassVar[tuple[str, ...]] = ("density",)
    in_guest: ClassVar[bool] = False
    centre: tuple = param((0.0, 0.0), "m", "position of the axis (x, y); only x is used in 2-D")
    radius: float = param(1.0, "m", "inner radius", above=0.0)
    bottom: float = param(0.0, "m", "height of the floor")
    top: float = param(1.0, "m", "height of the lid")
    margin: float = param(0.1, "-", "particles stop this many spacings before a face", low=0.0, high=0.5)

    def properties(self, scene):
        return CONTACTS

    def columns(self, scene):
        return N_CONTACTS

    def bounds(self, scene):
        """Corners of the box around the region that particle centres may reach [m]."""
        inset = self.margin * scene.spacing
        reach, ends = self.radius - inset, (self.bottom + inset, self.top - inset)
        lower, upper = ([centre + sign * reach for centre in self.centre[:scene.dim - 1]] for sign in (-1.0, 1.0))
        rest = [0.0] * (3 - scene.dim)
        return lower + [ends[0]] + rest, upper + [ends[1]] + rest

    def covers(self, scene, point):
        """Whether the vertical through a point of the bounds lies inside."""
        off = [point[axis] - self.centre[axis] for axis in range(scene.dim - 1)]
        return math.hypot(*off) <= self.radius - self.margin * scene.spacing

    def volume(self, scene):
        """Volume of the inside [m^dim]."""
        base = 2.0 * self.radius if scene.dim == 2 else math.pi * self.radius**2
        return base * (self.top - self.bottom)

    def check(self, scene, arrays):
        inset = self.margin * scene.spacing
        if self.radius <= inset or self.top - self.bottom <= 2.0 * inset:
            raise ValueError(f"container: a cylinder of radius {self.radius} m from {self.bottom} to {self.top} m has "
                             f"no inside at a spacing of {scene.spacing} m")

    def terms(self, scene, fluid):
        inset = self.margin * scene.spacing
        for place, depth in contained(scene, self.margin):
            yield Term(place, container.PBFCylinderContainer(
                fluid, None, centre=self.centre, radius=self.radius - inset, bottom=self.bottom + inset,
                top=self.top - inset, depth=depth, dim=scene.dim))


@dataclass(frozen=True, kw_only=True)
class DistanceContainer(Effect):
    """A room of any shape that particles cannot leave, such as the inside of a mesh or a vessel with an obstacle.

    ``room`` is a :class:`pysph_boiling.rooms.Room`, the signed distance on a grid. It is the constant ``room`` of the
    fluid arrays, which particle files do not hold.
    """

    slot: ClassVar[str] = "container"
    title: ClassVar[str] = "container by signed distance"
    requires: ClassVar[tuple[str, ...]] = ("density",)
    in_guest: ClassVar[bool] = False
    parameter_constants: ClassVar[tuple[str, ...]] = ("room",)
    room: Room | None = None
    margin: float = param(0.1, "-", "particles stop this many spacings before a face", low=0.0, high=0.5)

    def __post_init__(self):
        super().__post_init__()
        if not isinstance(self.room, Room):
            raise ValueError(f"container: a DistanceContainer needs a room (pysph_boiling.rooms.Room), got "
                             f"{self.room!r}")

    def properties(self, scene):
        return CONTACTS

    def columns(self, scene):
        return N_CONTACTS

    def constants(self, scene):
        return {"room": self.room.values.ravel()}

    def bounds(self, scene):
        """Corners of the box around the region that particle centres may reach [m]."""
        inset = self.margin * scene.spacing * (np.arange(3) < scene.dim)
        return (self.room.lower + inset).tolist(), (self.room.upper - inset).tolist()

    def covers(self, scene, point):
        """Whether the vertical through a point of the bounds has a part inside."""
        column = np.repeat(np.atleast_2d(point), self.room.values.shape[scene.dim - 1], axis=0)
        column[:, scene.dim - 1] = self.room.origin[scene.dim - 1] + self.room.step * np.arange(len(column))
        return bool(np.any(self.room(column) > self.margin * scene.spacing))

    def volume(self, scene):
        """Volume of the inside [m^dim]."""
        return self.room.volume

    def check(self, scene, arrays):
        if self.room.dim != scene.dim:
            raise ValueError(f"container: its room has {self.room.dim} dimensions, and the scene {scene.dim}")
        if np.any(scene.period > 0.0):
            raise ValueError("container: a room by signed distance has no periodic borders; use a BoxContainer")

    def terms(self, scene, fluid):
        for place, depth in contained(scene, self.margin):
            yield Term(place, container.PBFDistanceContainer(
                fluid, None, room=self.room, inset=self.margin * scene.spacing, depth=depth))


@dataclass(frozen=True, kw_only=True)
class XSPHViscosity(Effect):
    """XSPH viscosity between all fluid particles, and friction at the walls."""

    slot: ClassVar[str] = "viscosity"
    title: ClassVar[str] = "XSPH viscosity"
    requires: ClassVar[tuple[str, ...]] = ("density",)
    in_guest: ClassVar[bool] = False
    auto_rule: ClassVar[Rule] = Rule(lambda facts, chosen: True, "motion needs damping at the scale of a particle")
    rate: float = param(None, "1/s", "rate at which velocity differences decay; 0.7 sqrt(|g|/spacing) if not "
                        "given", low=0.0, may_change=True)
    wall: float = param(0.0, "-", "friction at walls as a multiple of the rate; 0 is free slip", low=0.0,
                        may_change=True)

    RATE: ClassVar[float] = 0.7  # of 1/t*; tuned

    def rate_in(self, scene):
        return self.rate if self.rate is not None else self.RATE / scene.fall_time

    def rate_of_velocity(self, scene):
        return self.rate_in(scene) * max(1.0, self.wall)  # the weights of fluid and wall neighbours add up to 1

    def terms(self, scene, fluid):
        yield Term("forces.sum", viscosity.PBFXSPHViscosity(
            fluid, list(scene.fluids), rate=self.rate_in(scene), rho0=scene.rho0))
        if self.wall > 0.0 and scene.solids:
            yield Term("forces.sum", viscosity.PBFWallFriction(
                fluid, list(scene.solids), rate=self.wall * self.rate_in(scene), rho0=scene.rho0))

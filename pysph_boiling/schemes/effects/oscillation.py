"""Oscillation of bubbles: a constraint on their mean radius, empirical or driven by the Rayleigh-Plesset equation."""
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pysph_boiling.device import largest, real, summed, values
from pysph_boiling.equations import oscillation
from pysph_boiling.names import SchemeError
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import Property, vector
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.effects.base import Column, Effect, constant, param
from pysph_boiling.schemes.rayleigh_plesset import RayleighPlesset
from pysph_boiling.schemes.stages import Term
from pysph_boiling.schemes.vapour import Vapour

__all__ = ["Oscillation"]

BAND = (0.45, 0.85)  # bounds of the paper, section 4.3, without their N^(1/3) part, in units of ``length``
ROUND_OFF = 1e-12  # relative tolerance of the bounds of a radius
TYPICAL = 20  # number of particles of the bubble for which the time scale is checked
ALIKE = 0.02  # largest relative difference of two exponents that mean the same gas
STEPS = 20  # least number of steps per period


@dataclass(frozen=True, kw_only=True)
class Oscillation(Effect):
    """Keeps the mean radius of each bubble within bounds, or lets it oscillate.

    The forms ``"band"`` (the paper) and ``"relative"`` only clamp the radius and do nothing inside the bounds. In the
    form ``"hysteresis"`` a target radius moves between the bounds and back in one ``period``. The form
    ``"rayleigh_plesset"`` solves an equation for the volume of each bubble, which then determines both its radius and
    the rest volume of its particles.

    **Limit of the displacement.** A step turns displacements into velocities, so they are limited to what the wall of a
    real bubble can do in a step dt. The constraint changes the mean radius by at most U dt, where U = pi (upper -
    lower) R/period is the largest speed of a sine between the bounds. Outwards, dt^2/2 p/(rho R) is added, with the
    acceleration at which the weight p of the liquid above would close the bubble (Rayleigh 1917), because a bubble must
    overcome this to grow at all. No particle is moved farther than that. So a bubble cannot gain speed from step to
    step, and in a short step the constraint causes no velocity. The column ``work_oscillation`` has the kinetic energy
    that the constraint has added in total.

    The limit is applied to a whole bubble, so that its displacements still have no net momentum. With unequal masses
    the centre of mass does not move, but the centroid does.

    ``slowdown``: a steam bubble of 4 mm oscillates 817 times per second, which no movie can show, so the bubble's own
    time is slower by this factor: period = slowdown 2 pi R0 sqrt(rho/(3 kappa p)). A period should have 20 or more
    steps.

    Limits: the bounds of ``"band"`` fit bubbles of 15 to 101 particles in 3-D and 9 to 30 in 2-D; smaller bubbles are
    expanded and larger ones compressed. The density constraint keeps a bubble above about 0.92 (3-D) or 0.965 (2-D) of
    its radius at rest. A bubble must be shorter than half a period of the domain.
    """

    slot: ClassVar[str] = "oscillation"
    title: ClassVar[str] = "oscillation of bubbles"
    requires: ClassVar[tuple[str, ...]] = ("bubbles", "density")
    in_guest: ClassVar[bool] = False
    form: str = param("band", "-", "form of the constraint",
                      choices=("band", "relative", "hysteresis", "rayleigh_plesset"))
    gradient: str = param("exact", "-", "'exact' (eq. 27) conserves momentum, 'paper' (eq. 28) does not",
                          choices=("exact", "paper"))
    omega: float = param(1.0, "-", "under-relaxation", above=0.0, high=1.0)
    sweeps: int = param(1, "-", "number of solves in a step", low=1)
    closing: bool = param(True, "-", "density sweeps follow after the solves; the paper has none")
    eps: float = param(1e-6, "-", "relaxation in eq. 29, relative to w/N", low=0.0)
    min_particles: int = param(2, "-", "smallest bubble that is constrained", low=2)
    k_model: float = param(0.05, "-", "'band': growth of the bounds with N^(1/3)", low=0.0)
    length: float = param(2.0, "-", "'band': unit of length of the paper's radii, in spacings", above=0.0)
    lower: float = param(None, "-", "lower bound, in units of the radius at rest; 0.9, hysteresis 0.95, "
                         "Rayleigh-Plesset 0.6 if not given", above=0.0)
    upper: float = param(None, "-", "upper bound, in units of the radius at rest; 1.15, Rayleigh-Plesset 1.25 if not "
                         "given", above=0.0)
    period: float = param(None, "s", "shortest period of the oscillation between the bounds; 10 "
                          "sqrt(spacing/|g|) if not given; not used by 'rayleigh_plesset'", above=0.0)
    pressure: float = param(101325.0, "Pa", "'rayleigh_plesset': ambient pressure", above=0.0)
    kappa: float = param(1.33, "-", "'rayleigh_plesset': polytropic exponent of the gas", low=1.0)
    viscosity: float = param(None, "Pa s", "'rayleigh_plesset': viscosity of the liquid; the material's if not given; "
                             "larger values can represent damping by heat and sound", low=0.0)
    sigma: float = param(None, "N/m", "'rayleigh_plesset': surface tension; the material's if not given", low=0.0)
    slowdown: float = param(50.0, "-", "'rayleigh_plesset': factor by which a bubble's time is slower", above=0.0)
    surface: float = param(None, "m", "'rayleigh_plesset': height of the free surface; that of the highest liquid "
                           "particle if not given")

    BOUNDS: ClassVar[dict] = {"relative": (0.9, 1.15), "hysteresis": (0.95, 1.15), "rayleigh_plesset": (0.6, 1.25)}
    PERIOD: ClassVar[float] = 10.0  # of t*; tuned
    MIXING: ClassVar[float] = 10.0  # time in t* in which the swells of a bubble's particles become equal; tuned

    def __post_init__(self):
        super().__post_init__()
        if self.form in self.BOUNDS:
            lower, upper = self.bounds()
            if not lower < upper:
                raise ValueError(f"oscillation.lower must be below oscillation.upper, got {lower} and {upper}")

    def bounds(self):
        """(lower, upper) in units of the radius at rest."""
        return tuple(default if given is None else given
                     for given, default in zip((self.lower, self.upper), self.BOUNDS[self.form]))

    def period_in(self, scene):
        return self.period if self.period is not None else self.PERIOD * scene.fall_time

    def bubble(self, scene):
        """The equation of a single bubble, with the material's constants or those given."""
        material = scene.material
        return RayleighPlesset(
            rho=material.rho_l, pressure=self.pressure, kappa=self.kappa,
            sigma=material.sigma if self.sigma is None else self.sigma,
            mu=material.mu_l if self.viscosity is None else self.viscosity)

    def properties(self, scene):
        rows = [*vector("bcx bcy bcz", "m", "centre of its bubble"),
                *vector("bdx bdy bdz", "-", "mean direction from the centre of its bubble"),
                Property("push_multiplier", "kg m", "mass times displacement along its direction")]
        if self.form == "hysteresis":
            rows.append(Property("target_radius", "-", "target radius of its bubble over that at rest; negative while "
                                 "it shrinks", state=True))
        if self.form == "rayleigh_plesset":
            rows.append(Property("swell_rate", "1/s", "rate of the swell, in the bubble's own time", state=True))
        return tuple(rows)

    def constants(self, scene):
        constants = {"pushes": 0.0, "oscillation_dt": 0.0, "n_pushed": 0.0, "work_oscillation": 0.0}
        return {**constants, "n_clamped": 0.0} if self.form == "rayleigh_plesset" else constants

    def columns(self, scene):
        meanings = {"n_pushed": "times that a bubble was moved since the start",
                    "n_clamped": "times that the volume of a bubble was limited by its bounds, or by the largest "
                                 "displacement in a step, since the start"}
        counts = tuple(Column(name, "-", meaning, lambda arrays, scene, name=name: constant(arrays, name))
                       for name, meaning in meanings.items() if name in self.constants(scene))

        def distance(arrays, scene):
            from pysph_boiling.schemes.bubbles import mean_radius, vapour_of

            vapour = vapour_of(arrays)
            return float(np.mean(mean_radius(vapour, scene))) if len(vapour.label) else 0.0

        return (*counts,
                Column("work_oscillation", "J", "kinetic energy added by the constraint since the start",
                       lambda arrays, scene: constant(arrays, "work_oscillation")),
                Column("bubble_distance_mean", "m", "mean over the bubbles of the mean distance of their particles "
                       "from the centroid (the paper, eq. 24); 0 without bubbles", distance))

    def check(self, scene, arrays):
        if self.form != "rayleigh_plesset" and math.isinf(self.period_in(scene)):
            raise ValueError("oscillation.period [s] must be given in a scene without gravity")
        if self.form == "rayleigh_plesset":
            self.check_gas(scene.material)
            if scene.dim != 3:
                raise ValueError("oscillation.form = 'rayleigh_plesset' needs a 3-D scene, because its equation is for "
                                 "a sphere")
            if "expansion" not in scene.effects:
                raise SchemeError("oscillation.form = 'rayleigh_plesset' needs the effect 'expansion'",
                                  "pass expansion=Expansion(...) to the scheme, or choose another form",
                                  "add --expansion, or choose another form")

    def check_gas(self, material):
        """Refuse pressure and exponent of steam at one atmosphere, the defaults, for a fluid with known others."""
        given, known = (self.pressure, self.kappa), (material.pressure, material.kappa)
        if None not in known and given == (Oscillation.pressure, Oscillation.kappa) and not np.allclose(
                given, known, rtol=ALIKE):
            raise ValueError(f"oscillation.form = 'rayleigh_plesset': give oscillation.pressure and oscillation.kappa, "
                             f"whose defaults are those of steam at one atmosphere; {material.name} has "
                             f"{known[0]:.6g} Pa and {known[1]:.3g}")

    def warnings(self, scene, dt):
        if self.form == "hysteresis":
            period = self.period_in(scene)
            if period < STEPS * dt:
                yield f"oscillation.period = {period:.3g} s has {period / dt:.3g} steps; it needs at least {STEPS}"
        if self.form == "rayleigh_plesset" and "expansion" in scene.effects:
            volume = TYPICAL * scene.effects["expansion"].v_exp * scene.spacing**scene.dim
            period = self.slowdown * 2.0 * math.pi / float(self.bubble(scene).frequency(sphere_radius(volume)))
            if period < STEPS * dt:
                yield (f"oscillation.slowdown = {self.slowdown:.3g} gives a bubble of {TYPICAL} particles a period of "
                       f"{period / dt:.3g} steps; it needs at least {STEPS}, with a slowdown of "
                       f"{self.slowdown * STEPS * dt / period:.3g}")

    def terms(self, scene, fluid):
        yield Term("oscillation.push", oscillation.BubbleOscillation(fluid, None, nearest=1e-6 * scene.spacing))

    def conditions(self, scene):
        return {"oscillation": lambda arrays: self.solve(scene, arrays)}

    def hooks(self, scene):
        if self.form == "rayleigh_plesset":
            return {"forces.next": lambda arrays: self.advance_volumes(scene, arrays)}
        return {}

    # --- on the host, one number per bubble ---------------------------------------------------------------------------

    def solve(self, scene, arrays):
        """Measure the bubbles and set the inputs of the kernel; returns whether any bubble is to be moved."""
        first = arrays[0].pushes[0] == 0.0
        if arrays[0].pushes[0] >= self.sweeps:
            return False
        vapour = Vapour(arrays)
        place, centre = vapour.places(scene.period)
        arm = place - centre[vapour.index]
        distance = np.linalg.norm(arm, axis=1)
        direction = arm / np.maximum(distance, 1e-6 * scene.spacing)[:, None]
        radius = vapour.sum(distance) / vapour.n
        mean = np.stack([vapour.sum(direction[:, axis]) for axis in range(3)], -1) / vapour.n[:, None]
        if self.gradient == "paper":
            mean[:] = 0.0

        low, high, speed = self.radii(scene, vapour, radius, first)
        gap = np.maximum(low - radius, 0.0) - np.maximum(radius - high, 0.0)
        gap[(vapour.n < self.min_particles) | (np.abs(gap) < ROUND_OFF * high)] = 0.0
        if not gap.any():
            return False
        dt = float(arrays[0].oscillation_dt[0])
        step = np.stack([vapour.get(name) for name in ("sx", "sy", "sz")], -1)
        reach = speed * dt + np.where(gap > 0.0, 0.5 * self.collapse(scene, arrays, centre, radius) * dt**2, 0.0)
        most = self.radius(vapour, place - step) + np.sign(gap) * reach - radius  # how far the wall may still move
        gap = np.clip(most, np.minimum(gap, 0.0), np.maximum(gap, 0.0))
        w, way = 1.0 / vapour.get("m"), direction - mean[vapour.index]
        squares = vapour.sum(w * np.sum(way**2, axis=1)) / vapour.n**2 + self.eps * vapour.sum(w) / vapour.n**2
        push = self.omega * gap / (squares * vapour.n)
        furthest = np.abs(push) * vapour.max(w * np.linalg.norm(way, axis=1))
        push *= np.minimum(1.0, np.abs(most) / self.sweeps / np.where(furthest > 0.0, furthest, 1.0))
        if not push.any():
            return False

        for axis, letter in enumerate("xyz"):
            vapour.put(f"bc{letter}", vapour.get(letter) - arm[:, axis])  # nearest image if periodic
            vapour.put(f"bd{letter}", mean[vapour.index, axis])
        vapour.put("push_multiplier", push[vapour.index])
        arrays[0].n_pushed[0] += np.count_nonzero(push)
        move = (push[vapour.index] * w)[:, None] * way
        given = (step + 0.5 * move) / dt**2 - np.array(scene.gravity)  # without the work of gravity on the displacement
        arrays[0].work_oscillation[0] += ranks.total(float(np.sum(np.sum(given * move, axis=1) / w)))
        for pa in arrays:
            pa.pushes[0] += 1.0
        return True

    @staticmethod
    def radius(vapour, place):
        """Mean distance of the particles of each bubble from its centroid [m]; ``place`` (n, 3) [m]."""
        centre = np.stack([vapour.sum(place[:, axis]) for axis in range(3)], -1) / vapour.n[:, None]
        return vapour.sum(np.linalg.norm(place - centre[vapour.index], axis=1)) / vapour.n

    @staticmethod
    def collapse(scene, arrays, centre, radius):
        """Acceleration p/(rho R) [m/s^2] of the wall of each bubble by the weight p of the liquid above it.

        The level is that of a uniform pool with the same mean height, which flying drops hardly change.
        """
        up = np.array(scene.up)
        count = ranks.total(sum(real(pa) for pa in arrays))
        mean = ranks.total(sum(summed(height(pa, up)) for pa in arrays)) / count
        floor = -ranks.largest(max(largest(-height(pa, up), default=-math.inf) for pa in arrays))
        depth = np.maximum(2.0 * mean - floor - centre @ up, 0.0)
        size = radius / {2: 2.0 / 3.0, 3: 0.75}[scene.dim]  # radius of a disc or ball with this mean radius
        return scene.g * depth / np.maximum(size, 0.5 * scene.spacing)

    def radii(self, scene, vapour, radius, first):
        """(low, high, speed) of each bubble: bounds of its mean radius [m], and the largest speed of its change [m/s].

        With ``first``, which is true once per step, the target radius of the form "hysteresis" advances.
        """
        if self.form == "band":
            unit = self.length * scene.spacing
            low, high = ((bound + self.k_model * np.cbrt(vapour.n)) * unit for bound in BAND)
            return low, high, math.pi * (high - low) / self.period_in(scene)
        at_rest = self.radius_at_rest(scene, vapour)
        lower, upper = self.bounds()
        period = self.period_in(scene)
        if self.form == "rayleigh_plesset":
            period = self.slowdown * 2.0 * math.pi / self.bubble(scene).frequency(at_rest / 0.75)
        speed = math.pi * (upper - lower) * at_rest / period
        if self.form == "relative":
            return lower * at_rest, upper * at_rest, speed
        if self.form == "hysteresis":
            at_rest = at_rest * self.target_radii(scene, vapour, radius / at_rest, first)
        return at_rest, at_rest, speed

    @staticmethod
    def radius_at_rest(scene, vapour):
        """Mean distance from the centre of a disc or sphere with the rest volume of the bubble [m]."""
        m = vapour.get("m")
        size = vapour.sum(m * vapour.get("swell") if "expansion" in scene.effects else m) / scene.particle_mass
        if scene.dim == 2:
            return 2.0 / 3.0 * np.sqrt(size / math.pi) * scene.spacing
        return 0.75 * sphere_radius(size) * scene.spacing

    def target_radii(self, scene, vapour, radius, first):
        """Target radius of each bubble in units of its radius at rest; particles store it, negative while it shrinks.

        In a bubble that has merged, the majority of particles decides. A new bubble starts from its ``radius`` (in the
        same unit) and grows, or shrinks if it is beyond the upper bound.
        """
        carried = vapour.get("target_radius")
        if not first:
            return np.abs(vapour.of_first(carried))
        lower, upper = self.bounds()
        sense = np.where(vapour.sum(np.sign(carried)) < 0.0, -1.0, 1.0)
        agree = carried * sense[vapour.index] > 0.0
        known = vapour.sum(agree)
        target = np.where(known > 0.0, vapour.sum(agree * np.abs(carried)) / np.maximum(known, 1.0), radius)
        dt = float(vapour.arrays[0].oscillation_dt[0])
        step = dt * 2.0 * (upper - lower) / self.period_in(scene)
        beyond = np.where(sense > 0.0, target + step - upper, lower - target + step)  # the bound ahead
        target = target + sense * (step - 2.0 * np.clip(beyond, 0.0, step))
        sense[beyond > 0.0] *= -1.0
        vapour.put("target_radius", (sense * target)[vapour.index], elsewhere=0.0)
        return target

    def advance_volumes(self, scene, arrays):
        """Advance the volume of each bubble, and distribute it as swell of its particles.

        The swell of a particle times the volume of its liquid is its part of the bubble's volume, so the parts add up
        when bubbles merge, and stay with their particles when a bubble splits. New vapour has the swell it had as
        liquid.
        """
        vapour = Vapour(arrays)
        dt = float(arrays[0].oscillation_dt[0])
        swell, rate, volume = vapour.get("swell"), vapour.get("swell_rate"), vapour.get("m") / scene.rho0
        filled = vapour.sum(volume)
        before = vapour.sum(volume * swell)
        flow = vapour.sum(volume * rate)
        R, R0 = sphere_radius(before), sphere_radius(scene.effects["expansion"].v_exp * filled)
        start = R
        R, U, clamped = self.bubble(scene).advance(
            R, flow / (4.0 * math.pi * R * R), R0, self.outer_pressure(scene, arrays, vapour), dt / self.slowdown,
            *self.bounds())
        # The liquid that a wall displaces moves as far as the wall, and two walls may approach each other, so a wall
        # may move by half the displacement that splits a step. Splitting steps instead would lead to ever more parts. A
        # limited wall gets the limited speed, since otherwise its speed would act in later steps, at any phase.
        reach = 0.25 * scene.effects["density"].courant * scene.spacing / arrays[0].substeps[0]
        held = np.clip(R, start - reach, start + reach)
        clamped |= held != R
        fastest = reach * self.slowdown / dt
        R, U = held, np.where(clamped, np.clip(U, -fastest, fastest), U)
        after, flow_after = 4.0 / 3.0 * math.pi * R**3, 4.0 * math.pi * R * R * U

        was, swell = swell, swell * (after / before)[vapour.index]
        rate = rate + ((flow_after - flow) / filled)[vapour.index]
        mixed = -math.expm1(-dt / (self.MIXING * scene.fall_time))
        swell += mixed * ((after / filled)[vapour.index] - swell)
        rate += mixed * ((flow_after / filled)[vapour.index] - rate)
        swell = np.minimum(swell, scene.effects["expansion"].max_swell(scene))
        vapour.put("swell", swell)
        vapour.put("swelling", (swell - was) / dt)
        vapour.put("swell_rate", rate, elsewhere=0.0)
        arrays[0].n_clamped[0] += np.count_nonzero(clamped)

    def outer_pressure(self, scene, arrays, vapour):
        """Pressure at the centre of each bubble [Pa]: the ambient pressure and the weight of the liquid above it."""
        up = np.array(scene.up)
        _, centre = vapour.places(scene.period)
        top = self.surface
        if top is None:
            top = ranks.largest(max((largest(height(pa, up), values(pa, "phase") != Phase.VAPOUR, -math.inf)
                                     for pa in arrays), default=-math.inf))
        return self.pressure + scene.rho0 * scene.g * np.maximum(top - centre @ up, 0.0)


def sphere_radius(volume):
    """Radius of a sphere [m] of a volume [m^3]."""
    return np.cbrt(3.0 * volume / (4.0 * math.pi))


def height(pa, up):
    """Heights of the real particles of an array [m]."""
    return sum(component * values(pa, axis) for component, axis in zip(up, "xyz"))

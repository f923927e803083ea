"""Bubbles: labels, buoyancy, cohesion, adhesion to sites, and drag on the liquid."""
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from pysph_boiling.equations import bubble_groups, buoyancy, cohesion
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import Property, vector
from pysph_boiling.schemes.effects.base import Column, Effect, Rule, any_vapour, param
from pysph_boiling.schemes.stages import Term
from pysph_boiling.schemes.vapour import join_labels

__all__ = ["BubbleLabels", "Buoyancy", "Cohesion", "Drag", "SiteAdhesion"]


@dataclass(frozen=True, kw_only=True)
class BubbleLabels(Effect):
    """Bubbles as connected components of vapour, labelled by their smallest uid."""

    slot: ClassVar[str] = "bubbles"
    title: ClassVar[str] = "bubble labels"
    requires: ClassVar[tuple[str, ...]] = ("phases",)
    auto_rule: ClassVar[Rule] = Rule(lambda facts, chosen: True, "there can be vapour")
    link_radius: float = param(1.4, "-", "vapour particles closer than this, in spacings, belong together",
                               above=0.0, high=2.0)

    MAX_ROUNDS: ClassVar[int] = 200  # a shuffled chain of n particles needs about log2(n); 200 is never reached

    def properties(self, scene):
        return (
            Property("parent", "-", "parent in the label forest (index)", "int"),
            Property("grandparent", "-", "grandparent in the label forest (index)", "int"),
            Property("unsettled", "-", "1 where a grandparent changed in the last round", "int"),
            Property("bubble", "-", "smallest uid of the bubble; NO_BUBBLE outside", "unsigned int", True),
            Property("bubble_n", "-", "particles in the bubble; 0 outside", "int", True),
        )

    def constants(self, scene):
        return {"bubble_rounds": 0.0}

    def check(self, scene, arrays):
        if len(scene.fluids) > 1:
            raise ValueError(f"bubbles: all liquid and vapour must be in one fluid array, got {scene.fluids}")

    def columns(self, scene):
        from pysph_boiling.schemes.bubbles import equivalent_radius, vapour_of

        def number(arrays, scene):
            return float(len(vapour_of(arrays).label))

        def single(arrays, scene):
            return float(np.count_nonzero(vapour_of(arrays).n == 1))

        def radius(arrays, scene):
            vapour = vapour_of(arrays)
            return float(equivalent_radius(vapour, scene).sum()) / len(vapour.label) if len(vapour.label) else 0.0

        return (
            Column("n_bubbles", "-", "number of bubbles", number),
            Column("bubble_radius_mean", "m", "mean over the bubbles of the radius of a disc or sphere of their "
                   "volume, with swollen vapour as large as it is; 0 without bubbles", radius),
            Column("n_single_bubbles", "-", "bubbles of one particle", single),
        )

    def conditions(self, scene):
        return {"bubbles": any_vapour}

    def hooks(self, scene):
        from pysph_boiling.schemes.bubbles import store_sizes

        def whole_bubbles(arrays):
            join_labels(arrays, scene.bubble_radius(self.link_radius))
            store_sizes(arrays)

        return {"bubbles.start": own_roots, "bubbles.label": whole_bubbles}

    def terms(self, scene, fluid):
        yield Term("bubbles.start", bubble_groups.BubbleStart(fluid, None))
        yield Term("bubbles.snap", bubble_groups.BubbleSnap(fluid, None))
        yield Term("bubbles.hook", bubble_groups.BubbleHook(
            fluid, list(scene.fluids), radius=scene.bubble_radius(self.link_radius)))
        yield Term("bubbles.shortcut", bubble_groups.BubbleShortcut(fluid, None))
        yield Term("bubbles.check", bubble_groups.BubbleCheck(fluid, None))
        yield Term("bubbles.label", bubble_groups.BubbleLabel(fluid, None))


def own_roots(arrays):
    """Make ghosts of other ranks their own roots, so that a chain of parents can end at a ghost but not pass it."""
    if ranks.size() > 1:
        for pa in arrays:
            n, total = pa.get_number_of_particles(True), pa.get_number_of_particles()
            for name in ("parent", "grandparent"):
                pa.get(name, only_real_particles=False)[n:] = np.arange(n, total)


@dataclass(frozen=True, kw_only=True)
class Buoyancy(Effect):
    """Upward force on bubbles, added to gravity.

    The form "paper" is eq. 19 for each particle: it grows with the number of particles of the bubble, from 0.015 g for
    one to ``a_max`` for 200, which is more than bubbles have (docs/forms.md).
    """

    slot: ClassVar[str] = "buoyancy"
    title: ClassVar[str] = "buoyancy"
    requires: ClassVar[tuple[str, ...]] = ("bubbles", "density")
    auto_rule: ClassVar[Rule] = Rule(lambda facts, chosen: facts.g > 0.0, "bubbles rise", "no gravity")
    form: str = param("archimedes", "-", "form of the force", choices=("archimedes", "paper", "ihmsen"))
    k_bubble: float = param(None, "-", "constant of the paper's eq. 19 in units of m_p/rho_l; 0 is neutral buoyancy; "
                            "1.5 if not given, 0.015 for the form 'paper'", low=0.0, may_change=True)
    a_max: float = param(3.0, "-", "form 'paper': largest acceleration in units of gravity", above=0.0)
    k_min: float = param(1.2, "-", "form 'ihmsen': smallest factor", low=0.0)
    k_max: float = param(1.5, "-", "form 'ihmsen': growth with the number of vapour neighbours", low=1.0)

    # The form 'paper' grows with N: at .015 a bubble of 100 particles has the acceleration of the other forms, and the
    # cap is reached at 200 particles. At 1.5 already two particles would reach it. In a small boil with this form
    # bubbles have 1 to 72 particles, so the cap does not act (docs/forms.md).
    K_BUBBLE: ClassVar[MappingProxyType] = MappingProxyType({"archimedes": 1.5, "paper": 0.015})

    def properties(self, scene):
        if self.form == "ihmsen":
            return (Property("vapour_near", "-", "vapour neighbours", "int"),)
        return ()

    def warnings(self, scene, dt):
        if scene.g == 0.0:
            yield "buoyancy has no effect without gravity"

    def terms(self, scene, fluid):
        gravity = dict(zip(("gx", "gy", "gz"), scene.gravity))
        k_bubble = self.K_BUBBLE.get(self.form) if self.k_bubble is None else self.k_bubble
        if self.form == "archimedes":
            yield Term("forces.sum", buoyancy.BubbleBuoyancy(fluid, None, k_bubble=k_bubble, **gravity))
        elif self.form == "paper":
            yield Term("forces.sum", buoyancy.BubbleBuoyancyPaper(
                fluid, None, k_bubble=k_bubble, a_max=self.a_max, **gravity))
        else:
            yield Term("forces.sum", buoyancy.BubbleBuoyancyIhmsen(
                fluid, list(scene.fluids), k_min=self.k_min, k_max=self.k_max, **gravity))


@dataclass(frozen=True, kw_only=True)
class Cohesion(Effect):
    """Cohesion between vapour particles, which keeps bubbles round and in one piece.

    It is solved in the sweeps of the density constraint. Where another scheme moves the particles (``BoilingGuest``) it
    is an acceleration.
    """

    slot: ClassVar[str] = "cohesion"
    title: ClassVar[str] = "cohesion of vapour"
    requires: ClassVar[tuple[str, ...]] = ("phases", "density")
    auto_rule: ClassVar[Rule] = Rule(lambda facts, chosen: True, "bubbles hold together")
    sigma: float = param(None, "N/m", "surface tension; if not given that of the material, but at least 2.85 (2-D) or "
                         "4.75 (3-D) rho g spacing^2", low=0.0)
    radius: float = param(2.4, "-", "range of the attraction, in spacings", above=0.0)

    # Surface tension over rho a_c spacing^2, where a_c is the strength of the pair force: 0.7 (2-D) and 0.64 (3-D) of
    # Fowler's integral of the force across a flat surface (0.82 and 1.49). With these the frequency of an oscillating
    # bubble is within 10 % of theory (``pysph-boiling validate surface_tension``).
    TENSION: ClassVar[MappingProxyType] = MappingProxyType({2: 0.57, 3: 0.95})
    # Smallest sigma/(rho g spacing^2) by default, the square of the capillary length in spacings. It makes a_c 5 g: at
    # 2 g in 3-D bubbles hang on stalks before they depart.
    RESOLVED: ClassVar[MappingProxyType] = MappingProxyType({2: 2.85, 3: 4.75})
    # Share of the last displacement with which a step begins. With 0, .4, .6, .8, 1 a bubble at rest stirs the pool at
    # .034, .015, .005, .006, .015 sqrt(g spacing) (2-D, 8 g, .035 t*) and .011, .007, .009, .005, .18 (10 g, .2 t*).
    START: ClassVar[float] = 0.6
    STIFFNESS: ClassVar[MappingProxyType] = MappingProxyType({2: 5.0, 3: 20.0})  # of the pair force over a_c/spacing

    @classmethod
    def tension(cls, strength, *, dim, spacing, rho0):
        """Surface tension [N/m] of a pair force of ``strength`` [m/s^2]; ``spacing`` in m, ``rho0`` in kg/m^3."""
        return cls.TENSION[dim] * rho0 * strength * spacing**2

    def properties(self, scene):
        if scene.hosted:
            return ()
        return (*vector("pull_x pull_y pull_z", "m", "displacement by cohesion in this sweep"),
                *vector("pulled_x pulled_y pulled_z", "m", "displacement by cohesion in the sweeps of this step"),
                *vector("pull_start_x pull_start_y pull_start_z", "m/s^2",
                        "acceleration by cohesion with which a step begins", state=True))

    def sigma_in(self, scene):
        """Surface tension [N/m]."""
        if self.sigma is not None:
            return self.sigma
        return max(scene.material.sigma, self.RESOLVED[scene.dim] * scene.rho0 * scene.g * scene.spacing**2)

    def check(self, scene, arrays):
        if self.radius * scene.spacing > scene.support * (1.0 + 1e-9):
            raise ValueError(f"cohesion.radius must be <= {scene.support / scene.spacing:.3g} spacings (the support of "
                             f"the kernel), got {self.radius}")

    def terms(self, scene, fluid):
        unit = self.tension(1.0, dim=scene.dim, spacing=scene.spacing, rho0=scene.rho0)
        pair = dict(strength=self.sigma_in(scene) / unit, radius=scene.bubble_radius(self.radius),
                    stiffness=self.STIFFNESS[scene.dim] / scene.spacing)
        if scene.hosted:
            yield Term("forces.sum", cohesion.BubbleCohesionForce(fluid, list(scene.fluids), **pair))
            return
        yield Term("density.multiplier", cohesion.BubbleCohesion(
            fluid, list(scene.fluids), **pair,
            max_displacement=scene.effects["density"].max_displacement * scene.spacing))
        yield Term("density.pull", cohesion.BubbleCohesionMove(fluid, None))
        yield Term("forces.sum", cohesion.BubbleCohesionStart(fluid, None, share=self.START))


@dataclass(frozen=True, kw_only=True)
class SiteAdhesion(Effect):
    """Adhesion of vapour to its site, which determines the size at which a bubble departs."""

    slot: ClassVar[str] = "adhesion"
    title: ClassVar[str] = "adhesion to sites"
    requires: ClassVar[tuple[str, ...]] = ("preset_nucleation", "density")
    auto_rule: ClassVar[Rule] = Rule(lambda facts, chosen: True, "bubbles stick to their sites")
    strength: float = param(None, "-", "strength of the attraction, in units of gravity; 15 in 2-D and 8 in 3-D if "
                            "not given", low=0.0)
    radius: float = param(2.4, "-", "range of the attraction, in spacings", above=0.0)

    def strength_in(self, scene):
        return self.strength if self.strength is not None else {2: 15.0, 3: 8.0}[scene.dim]

    def terms(self, scene, fluid):
        yield Term("forces.sum", cohesion.BubbleSiteAdhesion(
            fluid, list(scene.sites), strength=self.strength_in(scene) * scene.g, radius=self.radius * scene.spacing,
            spacing=scene.spacing))


@dataclass(frozen=True, kw_only=True)
class Drag(Effect):
    """Drag between vapour and liquid, in addition to the viscosity between all pairs."""

    slot: ClassVar[str] = "drag"
    title: ClassVar[str] = "drag between phases"
    requires: ClassVar[tuple[str, ...]] = ("phases", "density")
    auto_rule: ClassVar[Rule] = Rule(lambda facts, chosen: True, "bubbles drag the liquid along")
    rate: float = param(None, "1/s", "rate of the momentum exchange; 0.35 sqrt(|g|/spacing) if not given", low=0.0,
                        may_change=True)

    RATE: ClassVar[float] = 0.35  # of 1/t*; tuned

    def rate_in(self, scene):
        return self.rate if self.rate is not None else self.RATE / scene.fall_time

    def rate_of_velocity(self, scene):
        return self.rate_in(scene)

    def terms(self, scene, fluid):
        yield Term("forces.sum", buoyancy.BubbleDrag(
            fluid, list(scene.fluids), rate=self.rate_in(scene), rho0=scene.rho0))

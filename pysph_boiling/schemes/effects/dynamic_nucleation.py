"""Dynamic nucleation: superheated regions that hold enough heat burst into vapour without a site."""
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pysph_boiling.device import largest, positive, summed, values
from pysph_boiling.equations import dynamic_nucleation
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import Property
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.effects.base import Effect, Rule, cumulative, param
from pysph_boiling.schemes.stages import Term

__all__ = ["DynamicNucleation"]

ROUND_OFF_MARGIN = 1e-9  # relative tolerance of the radius, so that lattice particles at this distance always belong
Q_CRIT = 10.0  # the paper, Table 3


@dataclass(frozen=True, kw_only=True)
class DynamicNucleation(Effect):
    """A region of superheated liquid that holds enough heat turns as many particles into vapour as its heat can.

    The threshold is a heat (``q_crit``, the paper's value 10 if nothing is given) or a mean superheat. In both cases
    the heat must be enough for one particle. A threshold in units of m_p L means a superheat that depends on the number
    of particles in a region: 162 K for the 33 particles within 2 spacings in 3-D, and 412 K, which is beyond the
    critical point, for the 13 particles in 2-D.

    The heat of a region is the sum of c (T - T_sat). Latent heat held by interrupted particles does not count; it only
    reduces the heat needed to vaporise the particle that holds it, so a region may make more vapour than its sensible
    heat alone allows. A mean superheat is weighted by the heat capacities c, and particles that stay superheated end
    equally hot.
    """

    slot: ClassVar[str] = "dynamic_nucleation"
    title: ClassVar[str] = "dynamic nucleation"
    requires: ClassVar[tuple[str, ...]] = ("phases",)
    auto_rule: ClassVar[Rule] = Rule(
        lambda facts, chosen: facts.hottest > facts.T_sat + facts.fires_above,
        "liquid may reach the {f.fires_above:.0f} K at which a region fires",
        "nothing can reach the {f.fires_above:.0f} K at which a region fires")
    q_crit: float = param(None, "-", "heat above which a region fires, in units of m_p L; 10 if neither this nor "
                          "superheat_limit is given", low=0.0)
    superheat_limit: float = param(None, "K", "mean superheat above which a region fires; give this or q_crit", low=0.0)
    radius: float = param(2.0, "-", "radius of a region, in spacings", above=0.0)
    seed: int = param(0, "-", "seed of the choice of regions and particles", low=0, high=10**9)

    def __post_init__(self):
        super().__post_init__()
        if self.q_crit is not None and self.superheat_limit is not None:
            raise ValueError("dynamic_nucleation: give either q_crit [m_p L] or superheat_limit [K], not both")
        if self.q_crit is None and self.superheat_limit is None:
            object.__setattr__(self, "q_crit", Q_CRIT)

    def replaced(self, **changes):
        if len(changes.keys() & {"q_crit", "superheat_limit"}) == 1:  # the given one replaces the other
            changes = {"q_crit": None, "superheat_limit": None, **changes}
        return super().replaced(**changes)

    def reach(self, scene):
        """Radius of a region [m]."""
        return min(self.radius * scene.spacing * (1.0 + ROUND_OFF_MARGIN), scene.support * (1.0 - ROUND_OFF_MARGIN))

    def members(self, scene):
        """Number of particles in a region of the rest lattice."""
        cells = int(self.radius) + 1
        grid = np.indices((2 * cells + 1,) * scene.dim) - cells
        return int(np.count_nonzero(np.sum(grid**2, axis=0) * scene.spacing**2 < self.reach(scene) ** 2))

    def threshold(self, scene):
        """The heat [m_p L] and the mean sensible heat [J/kg] that a region must exceed; one of them is 0."""
        if self.superheat_limit is not None:
            return 0.0, scene.material.c_l * self.superheat_limit
        return self.q_crit, 0.0

    def onset(self, scene):
        """Mean superheat [K] of a full region at the threshold, and that which is enough for one particle."""
        q_crit, e_crit = self.threshold(scene)
        one = scene.material.L / (self.members(scene) * scene.material.c_l)
        return q_crit * one + e_crit / scene.material.c_l, one

    def check(self, scene, arrays):
        if len(scene.fluids) > 1:
            raise ValueError(f"dynamic_nucleation: all liquid must be in one fluid array, got {scene.fluids}")
        if self.radius * scene.spacing > scene.support * (1.0 + ROUND_OFF_MARGIN):
            raise ValueError(f"dynamic_nucleation.radius must be <= {scene.support / scene.spacing:.3g} spacings (the "
                             f"support of the kernel), got {self.radius}")
        reason = self.too_hot(scene)
        if reason:
            raise ValueError(f"dynamic_nucleation: {reason}")

    def too_hot(self, scene):
        """The reason why no full region fires below the critical point, or an empty string."""
        onset, limit = max(self.onset(scene)), scene.material.T_crit - scene.material.T_sat
        if onset < limit:
            return ""
        return (f"a full region of {self.members(scene)} particles would fire at a mean superheat of {onset:.4g} K, "
                f"but {scene.material.name} becomes critical at {limit:.4g} K: give a superheat_limit [K] below that, "
                "or a larger radius")

    def warnings(self, scene, dt):
        asked, one = self.onset(scene)
        if asked < one:
            yield (f"dynamic_nucleation: the threshold is a superheat of {asked:.3g} K, but the heat of a full "
                   f"region of {self.members(scene)} particles is only enough for one particle of vapour from "
                   f"{one:.3g} K on")

    def properties(self, scene):
        return (
            Property("held", "J/kg", "latent heat that a superheated particle holds since its interruption"),
            Property("region_heat", "2^-24 m_p L", "heat of the region around a particle; 0 if it is not enough"),
            Property("fire_key", "-", "random number that decides between regions of equal heat"),
            Property("pick_key", "-", "random number that gives the order in which members become vapour"),
            Property("claim", "-", "fire_key of the strongest region in reach; -1 if there is none"),
            Property("fires", "-", "1 where the region fires", "int"),
            Property("cut", "-", "largest pick_key that the region chooses; -1 if it does not fire"),
            Property("e_chosen", "J/kg", "enthalpy of the chosen particles of the region"),
            Property("e_others", "J/kg", "sensible heat of liquid as hot as the other particles of the region"),
            Property("member", "-", "number of firing regions with this particle, 0 or 1", "int"),
            Property("fired", "-", "times the region of the particle fired", "int", True, True),
            Property("burst", "-", "times the particle became vapour by dynamic nucleation", "int", True, True),
        )

    def constants(self, scene):
        return {"steps": 0.0}

    def columns(self, scene):
        return (
            cumulative("n_burst", "-", "particles made vapour by dynamic nucleation, since the start", "burst"),
            cumulative("n_fired", "-", "regions that fired, since the start", "fired"),
        )

    def conditions(self, scene):
        q_crit, e_crit = self.threshold(scene)
        hold = scene.effects["phases"].interrupt == "hold"
        lost = (1.0 - scene.material.c_v / scene.material.c_l) / scene.material.L  # of the heat capacity, by held heat
        least = 0.999 * max(q_crit, 1.0) * scene.particle_mass * scene.material.L  # sums differ by round-off

        def enough(arrays):
            heat, beyond = 0.0, -np.inf
            for pa in arrays:
                sensible, needed, hot = values(pa, "e"), e_crit, values(pa, "phase") == Phase.SUPERHEATED.value
                if hold:
                    e_lat = values(pa, "e_lat")
                    sensible, needed = positive(sensible - e_lat), e_crit * (1.0 - lost * e_lat)
                heat += summed(values(pa, "m") * sensible, hot)
                beyond = max(beyond, largest(sensible - needed, hot, default=-np.inf))
            return ranks.total(heat) >= least and ranks.largest(beyond) >= 0.0

        return {"dynamic_nucleation": enough}

    def terms(self, scene, fluid):
        material, fluids = scene.material, list(scene.fluids)
        q_crit, e_crit = self.threshold(scene)
        region, capacities = dict(radius=self.reach(scene)), dict(c_l=material.c_l, c_v=material.c_v)
        heat = dict(m_p=scene.particle_mass, L=material.L, **capacities)
        subcooling = scene.effects["condensation"].subcooling if "condensation" in scene.effects else 1.0
        hold = scene.effects["phases"].interrupt == "hold"
        if hold:
            yield Term("dynamic_nucleation.held", dynamic_nucleation.NucleationHeld(fluid, None))
        yield Term("dynamic_nucleation.region", dynamic_nucleation.NucleationRegion(
            fluid, fluids, q_crit=q_crit, e_crit=e_crit, stream=2 * self.seed, **region, **heat))
        yield Term("dynamic_nucleation.claim", dynamic_nucleation.NucleationClaim(fluid, fluids, **region))
        yield Term("dynamic_nucleation.fire", dynamic_nucleation.NucleationFire(fluid, fluids, **region))
        yield Term("dynamic_nucleation.fire", dynamic_nucleation.NucleationChoice(fluid, fluids, **region, **heat))
        yield Term("dynamic_nucleation.share", dynamic_nucleation.NucleationShare(
            fluid, fluids, T_sat=material.T_sat, L=material.L, subcooling=subcooling, **capacities, **region))
        if hold:
            yield Term("dynamic_nucleation.share", dynamic_nucleation.NucleationRelease(fluid, None))

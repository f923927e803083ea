"""Dynamic nucleation: superheated regions that hold enough heat burst into vapour where no site is near."""
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pysph_boiling.device import largest, summed, values
from pysph_boiling.equations import dynamic_nucleation
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import Property
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.effects.base import Effect, Rule, cumulative, param
from pysph_boiling.schemes.stages import Term

__all__ = ["DynamicNucleation"]

ROUND_OFF_MARGIN = 1e-9  # relative; particles of a lattice at the radius belong to the region whatever the round-off
Q_CRIT = 10.0  # the paper, Table 3


@dataclass(frozen=True, kw_only=True)
class DynamicNucleation(Effect):
    """A region of superheated liquid that holds enough heat turns as many particles into vapour as its heat pays for.

    The threshold is a heat (``q_crit``, 10 as in the paper if nothing is given) or a mean superheat; in either case the
    heat must pay for one particle. A heat in units of m_p L means another superheat for another number of particles in
    a region: 162 K for the 33 within 2 spacings in 3-D, and 412 K, past the critical point, for the 13 in 2-D.

    Heat of a region is c (T - T_sat): latent heat that interrupted particles hold does not count. It pays for the
    vaporisation of the particle that holds it, so a region may make more vapour than its sensible heat alone pays for.
    """

    slot: ClassVar[str] = "dynamic_nucleation"
    title: ClassVar[str] = "dynamic nucleation"
    requires: ClassVar[tuple[str, ...]] = ("phases",)
    auto_rule: ClassVar[Rule] = Rule(
        lambda facts, chosen: facts.hottest > facts.T_sat + facts.fires_above,
        "liquid may superheat to the {f.fires_above:.0f} K at which a region fires",
        "no superheat of {f.fires_above:.0f} K, at which a region fires")
    q_crit: float = param(None, "-", "heat above which a region fires, in units of m_p L; 10 if neither this nor "
                          "superheat_limit is given", low=0.0)
    superheat_limit: float = param(None, "K", "mean superheat above which a region fires; give this or q_crit", low=0.0)
    radius: float = param(2.0, "-", "radius of a region, in spacings", above=0.0)
    seed: int = param(0, "-", "seed of the choice of regions and particles", low=0, high=10**9)

    def __post_init__(self):
        super().__post_init__()
        if self.q_crit is not None and self.superheat_limit is not None:
            raise ValueError("dynamic_nucleation: give at most one of q_crit [m_p L] and superheat_limit [K]")

    def replaced(self, **changes):
        if len(changes.keys() & {"q_crit", "superheat_limit"}) == 1:  # the one that is given takes the other's place
            changes = {"q_crit": None, "superheat_limit": None, **changes}
        return super().replaced(**changes)

    def reach(self, scene):
        """Radius of a region [m]."""
        return min(self.radius * scene.spacing * (1.0 + ROUND_OFF_MARGIN), scene.support * (1.0 - ROUND_OFF_MARGIN))

    def members(self, scene):
        """Particles of the rest lattice in a region."""
        cells = int(self.radius) + 1
        grid = np.indices((2 * cells + 1,) * scene.dim) - cells
        return int(np.count_nonzero(np.sum(grid**2, axis=0) * scene.spacing**2 < self.reach(scene) ** 2))

    def threshold(self, scene):
        """Heat [m_p L] and mean sensible heat [J/kg] that a region must exceed; one of the two is 0."""
        if self.superheat_limit is not None:
            return 0.0, scene.material.c_l * self.superheat_limit
        return Q_CRIT if self.q_crit is None else self.q_crit, 0.0

    def onset(self, scene):
        """Mean superheat [K] of a full region by the threshold, and that which pays for one particle."""
        q_crit, e_crit = self.threshold(scene)
        one = scene.material.L / (self.members(scene) * scene.material.c_l)
        return q_crit * one + e_crit / scene.material.c_l, one

    def check(self, scene, arrays):
        if len(scene.fluids) > 1:
            raise ValueError(f"dynamic_nucleation: regions need all liquid in one fluid array, got {scene.fluids}")
        if self.radius * scene.spacing > scene.support * (1.0 + ROUND_OFF_MARGIN):
            raise ValueError(f"dynamic_nucleation.radius must be <= {scene.support / scene.spacing:.3g} spacings (the "
                             f"support of the kernel), got {self.radius}")
        onset, limit = max(self.onset(scene)), scene.material.T_crit - scene.material.T_sat
        if onset >= limit:
            raise ValueError(f"dynamic_nucleation: a full region of {self.members(scene)} particles would fire at a "
                             f"mean superheat of {onset:.4g} K, but {scene.material.name} is critical at {limit:.4g} "
                             "K: give a superheat_limit [K] below that, or a larger radius")

    def warnings(self, scene, dt):
        asked, one = self.onset(scene)
        if asked < one:
            yield (f"dynamic_nucleation: the threshold asks for {asked:.3g} K of superheat, but the "
                   f"{self.members(scene)} particles of a full region pay for a particle of vapour from {one:.3g} K on")

    def properties(self, scene):
        return (
            Property("held", "J/kg", "latent heat that a superheated particle holds since its interruption"),
            Property("region_heat", "2^-24 m_p L", "heat of the region round a particle; 0 if it does not suffice"),
            Property("fire_key", "-", "random number that decides between regions of equal heat"),
            Property("pick_key", "-", "random number in whose order members become vapour"),
            Property("claim", "-", "fire_key of the strongest region in reach; -1 where there is none"),
            Property("fires", "-", "1 where the region fires", "int"),
            Property("cut", "-", "largest pick_key that the region chooses; -1 where it does not fire"),
            Property("e_chosen", "J/kg", "enthalpy that the region gives to the chosen"),
            Property("e_others", "J/kg", "sensible heat that the region leaves to the others"),
            Property("member", "-", "regions that fired and hold the particle, 0 or 1", "int"),
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
        least = 0.999 * max(q_crit, 1.0) * scene.particle_mass * scene.material.L  # below: sums differ by round-off

        def enough(arrays):
            heat, hottest = 0.0, 0.0
            for pa in arrays:
                excess, hot = values(pa, "e"), values(pa, "phase") == Phase.SUPERHEATED.value
                if hold:
                    excess = excess - values(pa, "e_lat")
                    excess = 0.5 * (excess + abs(excess))  # max(excess, 0), which a device has not
                heat += summed(values(pa, "m") * excess, hot)
                hottest = max(hottest, largest(excess, hot))
            return ranks.total(heat) >= least and ranks.largest(hottest) >= e_crit

        return {"dynamic_nucleation": enough}

    def terms(self, scene, fluid):
        material, fluids = scene.material, list(scene.fluids)
        q_crit, e_crit = self.threshold(scene)
        region, heat = dict(radius=self.reach(scene)), dict(m_p=scene.particle_mass, L=material.L)
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
            fluid, fluids, T_sat=material.T_sat, L=material.L, c_l=material.c_l, c_v=material.c_v,
            subcooling=subcooling, **region))
        if hold:
            yield Term("dynamic_nucleation.share", dynamic_nucleation.NucleationRelease(fluid, None))

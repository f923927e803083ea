"""Preset nucleation: sites at which vapour forms, given as a particle array."""
import warnings
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np
from scipy.spatial import cKDTree

from pysph_boiling.equations import preset_nucleation
from pysph_boiling.names import SchemeError
from pysph_boiling.particles import Property
from pysph_boiling.schemes.effects.base import Effect, Rule, param
from pysph_boiling.schemes.stages import Term

__all__ = ["PresetNucleation"]

DRAWS = 1 << 16  # random numbers of a site before it uses those of the next


@dataclass(frozen=True, kw_only=True)
class PresetNucleation(Effect):
    """Preset nucleation sites: the kinetic condition near them, and their attraction of liquid.

    With ``activation`` each site has an activation superheat (``site_array(activation=...)``). It is dormant until
    liquid over it is that much above saturation, and again when its bubble has departed. A bubble leaves some vapour at
    its site, which fills its radius; it is the embryo in the cavity, and does not grow as long as the site is dormant.
    The criterion of Hsu 1962 is about the liquid at the tip of the embryo, so only liquid above that radius is
    compared. Hence the waiting time: the liquid at the base is hot again after some hundredths of a second, the liquid
    two spacings above it after a tenth of a second (steady_boiling). Sites that become active when superheated liquid
    is near are those of Prakash et al. (as told in the paper, section 1); that each site has a superheat of its own,
    and falls asleep again, is ours.

    Sites attract all liquid, as in section 3.2.1 of the paper, or only liquid in transition (``attracts``): that is how
    we read Gu et al., who move certain particles of water towards the sites, where these become vapour once they are at
    saturation and have absorbed enough heat (as told in the paper, section 2.2).
    """

    slot: ClassVar[str] = "preset_nucleation"
    title: ClassVar[str] = "preset nucleation sites"
    requires: ClassVar[tuple[str, ...]] = ("phases",)
    auto_rule: ClassVar[Rule] = Rule(lambda facts, chosen: facts.sites, "there are sites", "there are no sites")
    radius: float = param(1.6, "-", "radius of a site, in spacings", above=0.0)
    attraction: float = param(0.5, "-", "attraction of liquid by a site, in units of gravity", low=0.0)
    attraction_radius: float = param(2.4, "-", "range of the attraction, in spacings; beyond the kernel support it "
                                     "slows down the neighbour search of the scene", above=0.0)
    attracts: str = param("all", "-", "liquid that a site attracts: all of it, or that in transition (Gu et al.)",
                          choices=("all", "transition"))
    activation: bool = param(False, "-", "sites are dormant until liquid at them reaches their activation superheat")
    dormant_radius: float = param(2.4, "-", "radius within which no liquid enters the transition at a dormant site, in "
                                  "spacings; larger than radius", above=0.0)
    embryo: float = param(1.0, "-", "smallest radius of the embryo that a bubble leaves, in radii of the cavity: the "
                          "superheat that the next bubble needs is drawn between the activation superheat and that "
                          "over this number", above=0.0, high=1.0)
    seed: int = param(0, "-", "seed of these numbers", low=0)

    # Distance between sites, in spacings, from which bubbles depart, measured with steady_boiling and its adhesion: no
    # bubbles in 3 s at 2.33 and 2.62 (2-D, two starts each) and in 2.5 s at 2.33 (3-D); 3 and 4 bubbles at 3.0 (2-D),
    # 11 at 2.8 (3-D).
    MIN_SITE_SPACING: ClassVar[MappingProxyType] = MappingProxyType({2: 3.0, 3: 2.8})

    @property
    def reach(self):
        """Largest radius at which a site acts, in spacings."""
        return max(self.radius, self.attraction_radius if self.attraction else 0.0,
                   self.dormant_radius if self.activation else 0.0)

    def check(self, scene, arrays):
        if not scene.sites:
            raise SchemeError("preset_nucleation: preset sites need a particle array of sites",
                              "pass sites=['sites'] to the scheme and create that array (particles.site_array)",
                              "this scene has none, so leave 'preset_nucleation' out with --no-preset-nucleation")
        if len(scene.sites) > 1:
            raise ValueError(f"preset_nucleation: all preset sites must be in one array, got {scene.sites}, because "
                             "liquid is attracted by the nearest site of an array")
        for name in scene.sites:
            if not self.activation and np.any(arrays[name].activation > 0.0):
                raise SchemeError(f"preset_nucleation: sites '{name}' have activation superheats, which are not used",
                                  "pass preset_nucleation=PresetNucleation(activation=True), or sites without them",
                                  "give --preset-nucleation.activation yes, or sites that are alike")
            reach = float(arrays[name].h.min()) * scene.kernel.radius_scale / scene.spacing
            needed = max(self.reach, scene.effects["adhesion"].radius if "adhesion" in scene.effects else 0.0)
            if reach < needed * (1.0 - 1e-9):
                raise SchemeError(f"sites '{name}' reach {reach:.3g} spacings, but the effects need {needed:.3g}",
                                  f"make the array with site_array(reach={needed * scene.spacing:.3g})",
                                  "preset_nucleation.radius, preset_nucleation.attraction_radius and adhesion.radius "
                                  f"must be at most {reach:.3g}")
            self.warn_of_crowded_sites(
                scene, np.stack([arrays[name].get(axis, only_real_particles=True) for axis in "xyz"], -1))
        if self.activation and self.dormant_radius <= self.radius:
            raise ValueError("preset_nucleation.dormant_radius must be above preset_nucleation.radius = "
                             f"{self.radius:g} spacings, got {self.dormant_radius:g}")

    def warn_of_crowded_sites(self, scene, sites):
        """Warn of ``sites`` (n, 3) [m] that are so close to each other that no bubble departs from them."""
        if len(sites) < 2 or "adhesion" not in scene.effects:
            return
        place = np.where(scene.period > 0.0, sites % np.where(scene.period > 0.0, scene.period, 1.0), sites)
        apart = cKDTree(place, boxsize=scene.period).query(place, k=2)[0][:, 1] / scene.spacing
        least = self.MIN_SITE_SPACING[scene.dim]
        near = np.count_nonzero(apart < least * (1.0 - 1e-9))
        if near:
            warnings.warn(
                f"{near} of {len(sites)} nucleation sites are closer than {least:g} spacings to another, the closest "
                f"{apart.min():.3g}: their vapour may merge into a film on the base, from which no bubble departs; use "
                "fewer sites, or place them farther apart", stacklevel=2)

    def site_properties(self, scene):
        superheat = Property("activation", "K", "activation superheat of the site", state=True)
        state = Property("awake", "-", "0 while the site is dormant; else 1 plus the most vapour particles at it since "
                         "it woke", "int", True)
        drawn = Property("drawn", "-", "counter of the random numbers of the site", "int", True)
        return (superheat, state, drawn) if self.activation else (superheat,)

    def properties(self, scene):
        if "bubbles" not in scene.effects:
            return ()
        return (Property("departed", "-", "1 if the vapour was in a bubble that departed from its site", "int", True),)

    def prepare(self, scene, arrays):
        for name in scene.sites if self.activation else ():
            arrays[name].drawn[:] = DRAWS * np.arange(len(arrays[name].drawn))

    def tools(self, scheme):
        from pysph_boiling.schemes.bubbles import Departures

        if "bubbles" in scheme.effects:
            yield Departures(scheme, clearance=self.reach * scheme.spacing)

    def terms(self, scene, fluid):
        if scene.effects["phases"].kinetic == "site":
            yield Term("phases.kinetic", preset_nucleation.NucleationSiteCondition(
                fluid, list(scene.sites), radius=self.radius * scene.spacing))
            if self.activation:
                reach = self.dormant_radius * scene.spacing
                yield Term("phases.dormant", preset_nucleation.NucleationDormancy(
                    fluid, list(scene.sites), reach=reach))
                up = dict(zip(("ux", "uy", "uz"), scene.up))
                for site in scene.sites if fluid == scene.fluids[0] else ():
                    yield Term("phases.activate", preset_nucleation.NucleationActivation(
                        site, list(scene.fluids), radius=self.radius * scene.spacing, reach=reach,
                        embryo=self.embryo, seed=self.seed, T_sat=scene.material.T_sat, **up))
        if self.attraction > 0.0 and scene.g > 0.0 and scene.moves:
            yield Term("forces.sum", preset_nucleation.NucleationSiteAttraction(
                fluid, list(scene.sites), strength=self.attraction * scene.g,
                radius=self.attraction_radius * scene.spacing, transition=self.attracts == "transition"))

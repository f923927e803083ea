"""Phases: the four states, and preset nucleation sites."""
import warnings
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np
from scipy.spatial import cKDTree

from pysph_boiling.device import counted, largest, values
from pysph_boiling.equations import nucleation, phase_change
from pysph_boiling.names import SchemeError
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import Property
from pysph_boiling.phases import Phase, at_saturation
from pysph_boiling.schemes.effects.base import Column, Effect, Rule, cumulative, enthalpies, gather, param, shared
from pysph_boiling.schemes.stages import Term

__all__ = ["PhaseChange", "PresetNucleation"]


@dataclass(frozen=True, kw_only=True)
class PhaseChange(Effect):
    """The four states of a particle and the edges between them."""

    slot: ClassVar[str] = "phases"
    title: ClassVar[str] = "phase change"
    requires: ClassVar[tuple[str, ...]] = ("heat",)
    called_for: ClassVar[Rule] = Rule(
        lambda facts, chosen: facts.hottest > facts.T_sat,
        "something is above saturation", "nothing can reach saturation")
    interrupt: str = param("hold", "-", "stored latent heat when a site is lost: held, or converted (paper)",
                           choices=("hold", "convert"))
    kinetic: str = param("site", "-", "what liquid at saturation needs to enter the transition: a site near it, or "
                         "nothing (always); or it never does", choices=("site", "always", "never"))
    vapour_as_site: bool = param(True, "-", "vapour near a liquid particle counts as a nucleation site")
    kinetic_radius: float = param(1.5, "-", "reach of vapour as a site, in spacings", above=0.0, high=2.0)

    def properties(self, scene):
        rows = [
            Property("phase", "-", "state of the particle, see pysph_boiling.phases.Phase", "int", True),
            Property("kinetic", "-", "1 where a nucleation site is near", "int"),
            Property("vaporised", "-", "times the particle completed its latent heat", "int", True, True),
            Property("interrupted", "-", "times its transition was interrupted", "int", True, True),
        ]
        if self.interrupt == "hold":
            rows.append(Property("e_lat", "J/kg", "latent heat frozen at an interruption", state=True))
        return tuple(rows)

    def columns(self, scene):
        def count(which):
            return lambda arrays, scene: float(ranks.total(len(which(arrays))))

        def energy(which):
            return lambda arrays, scene: ranks.total(float(np.sum(enthalpies(arrays)[which(arrays)])))

        @shared
        def parted(arrays):
            """Indices of the liquid above T_sat, and of that at T_sat."""
            hot = in_state(arrays, Phase.SUPERHEATED)
            e_lat = gather(arrays, "e_lat")[hot] if self.interrupt == "hold" else 0.0
            held = at_saturation(Phase.SUPERHEATED, gather(arrays, "e")[hot], e_lat)
            return hot[~held], hot[held]

        states = {phase.name.lower(): (lambda arrays, phase=phase: in_state(arrays, phase),
                                       f"in state {phase.name.lower()}") for phase in Phase}
        states["superheated"] = lambda arrays: parted(arrays)[0], "of liquid above T_sat"
        states["held"] = lambda arrays: parted(arrays)[1], "of liquid at T_sat without a site: interrupted, or fed"
        columns = []
        for name, (which, meaning) in states.items():
            columns.append(Column(f"n_{name}", "-", f"particles {meaning}", count(which)))
            columns.append(Column(f"energy_{name}", "J", f"enthalpy of the particles {meaning}", energy(which)))
        columns += [
            cumulative("n_nucleated", "-", "particles vaporised by completing their latent heat, since the start",
                       "vaporised"),
            cumulative("n_interrupted", "-", "interrupted transitions since the start", "interrupted"),
        ]
        if self.interrupt == "hold":
            columns.append(Column("energy_hidden", "J", "held latent heat that no temperature shows", hidden_heat))
        return tuple(columns)

    def conditions(self, scene):
        def hot(arrays):
            return ranks.anywhere(any(
                largest(values(pa, "e"), default=-np.inf) >= 0.0 or
                counted(values(pa, "phase") != Phase.LIQUID.value) > 0 for pa in arrays))

        return {"phases": hot}

    def terms(self, scene, fluid):
        material, k = scene.material, scene.effects["heat"].conductivity
        subcooling = scene.effects["condensation"].subcooling if "condensation" in scene.effects else 1.0
        state = dict(T_sat=material.T_sat, L=material.L, c_l=material.c_l, c_v=material.c_v, subcooling=subcooling)
        conductivities = dict(k_l=k(material.k_l), k_v=k(material.k_v))
        hold = self.interrupt == "hold"
        temperature = phase_change.PhaseTemperatureHold if hold else phase_change.PhaseTemperature
        after = phase_change.PhaseTemperatureAfterHold if hold else phase_change.PhaseTemperatureAfter
        edges = phase_change.PhaseEdgesHold if hold else phase_change.PhaseEdges
        yield Term("heat.temperature", temperature(fluid, None, **state, **conductivities))
        yield Term("heat.update", after(fluid, None, **state))
        yield Term("phases.kinetic", phase_change.PhaseKineticReset(fluid, None, near=self.kinetic == "always"))
        if self.vapour_as_site and self.kinetic == "site":
            yield Term("phases.kinetic", phase_change.PhaseVapourCondition(
                fluid, list(scene.fluids), radius=scene.bubble_radius(self.kinetic_radius)))
        yield Term("phases.edges", edges(fluid, None, **state))


@shared
def in_state(arrays, phase):
    """Indices of the particles in a state among this rank's real ones."""
    return np.flatnonzero(gather(arrays, "phase") == phase.value)


def hidden_heat(arrays, scene):
    """Held latent heat of superheated particles [J]."""
    m, e, e_lat = (gather(arrays, name)[in_state(arrays, Phase.SUPERHEATED)] for name in ("m", "e", "e_lat"))
    return ranks.total(float(np.sum(np.minimum(e, e_lat) * m)))


@dataclass(frozen=True, kw_only=True)
class PresetNucleation(Effect):
    """Preset nucleation sites: the kinetic condition near them, and their pull on the liquid."""

    slot: ClassVar[str] = "nucleation"
    title: ClassVar[str] = "preset nucleation sites"
    requires: ClassVar[tuple[str, ...]] = ("phases",)
    called_for: ClassVar[Rule] = Rule(lambda facts, chosen: facts.sites, "there are sites", "there are no sites")
    radius: float = param(1.6, "-", "radius of a site, in spacings", above=0.0)
    attraction: float = param(0.5, "-", "pull of a site on liquid, in units of gravity", low=0.0)
    attraction_radius: float = param(2.4, "-", "reach of the pull, in spacings; beyond the kernel support it slows the "
                                     "neighbour search of the whole scene", above=0.0)

    # Spacings between sites from which on bubbles depart, measured on steady_boiling with its adhesion: none in 3 s at
    # 2.33 and 2.62 (2-D, two starts each) nor in 2.5 s at 2.33 (3-D); 3 and 4 at 3.0 (2-D), 11 at 2.8 (3-D).
    APART: ClassVar[MappingProxyType] = MappingProxyType({2: 3.0, 3: 2.8})

    @property
    def reach(self):
        """Largest radius at which a site acts, in spacings."""
        return max(self.radius, self.attraction_radius if self.attraction else 0.0)

    def check(self, scene, arrays):
        if not scene.sites:
            raise SchemeError("nucleation: preset sites need a particle array of sites",
                              "pass sites=['sites'] to the scheme and create that array (particles.site_array)",
                              "this scene has none, so take 'nucleation' out with --no-nucleation")
        if len(scene.sites) > 1:
            raise ValueError(f"nucleation: put all preset sites into one array, got {scene.sites}: the pull is towards "
                             "the nearest site of an array")
        for name in scene.sites:
            reach = float(arrays[name].h.min()) * scene.kernel.radius_scale / scene.spacing
            needed = max(self.reach, scene.effects["adhesion"].radius if "adhesion" in scene.effects else 0.0)
            if reach < needed * (1.0 - 1e-9):
                raise SchemeError(f"sites '{name}' reach {reach:.3g} spacings, the effects need {needed:.3g}",
                                  f"make the array with site_array(reach={needed * scene.spacing:.3g})",
                                  "nucleation.radius, nucleation.attraction_radius and adhesion.radius must be at most "
                                  f"{reach:.3g}")
            self.crowded(scene, np.stack([arrays[name].get(axis, only_real_particles=True) for axis in "xyz"], -1))

    def crowded(self, scene, sites):
        """Warn of ``sites`` (n, 3) [m] that are so near to each other that no bubble departs from them."""
        if len(sites) < 2 or "adhesion" not in scene.effects:
            return
        place = np.where(scene.period > 0.0, sites % np.where(scene.period > 0.0, scene.period, 1.0), sites)
        apart = cKDTree(place, boxsize=scene.period).query(place, k=2)[0][:, 1] / scene.spacing
        least = self.APART[scene.dim]
        near = np.count_nonzero(apart < least * (1.0 - 1e-9))
        if near:
            warnings.warn(
                f"{near} of {len(sites)} nucleation sites are less than {least:g} spacings from another, the nearest "
                f"{apart.min():.3g}: their vapour may join to a film over the base, from which no bubble departs; take "
                "fewer sites, or set them further apart", stacklevel=2)

    def tools(self, scheme):
        from pysph_boiling.schemes.bubbles import Departures

        if "bubbles" in scheme.effects:
            yield Departures(scheme, clearance=self.reach * scheme.spacing)

    def terms(self, scene, fluid):
        if scene.effects["phases"].kinetic == "site":
            yield Term("phases.kinetic", nucleation.NucleationSiteCondition(
                fluid, list(scene.sites), radius=self.radius * scene.spacing))
        if self.attraction > 0.0 and scene.g > 0.0 and "density" in scene.effects:
            yield Term("forces.sum", nucleation.NucleationSiteAttraction(
                fluid, list(scene.sites), strength=self.attraction * scene.g,
                radius=self.attraction_radius * scene.spacing))

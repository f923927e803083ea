"""Phases: the four states of a particle and the edges between them."""
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pysph_boiling.device import counted, largest, values
from pysph_boiling.equations import phase_change
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import Property
from pysph_boiling.phases import Phase, at_saturation
from pysph_boiling.schemes.effects.base import (
    Column,
    Effect,
    Rule,
    computed_once,
    cumulative,
    enthalpies,
    joined,
    param,
)
from pysph_boiling.schemes.stages import Term

__all__ = ["PhaseChange"]


@dataclass(frozen=True, kw_only=True)
class PhaseChange(Effect):
    """The four states of a particle and the transitions between them."""

    slot: ClassVar[str] = "phases"
    title: ClassVar[str] = "phase change"
    requires: ClassVar[tuple[str, ...]] = ("heat",)
    auto_rule: ClassVar[Rule] = Rule(
        lambda facts, chosen: facts.hottest > facts.T_sat,
        "something is above saturation", "nothing can reach saturation")
    interrupt: str = param("hold", "-", "stored latent heat when a site is lost: hold it, or convert it (paper)",
                           choices=("hold", "convert"))
    kinetic: str = param("site", "-", "condition for liquid at saturation to enter the transition: a site near it, "
                         "always, or never", choices=("site", "always", "never"))
    vapour_as_site: bool = param(True, "-", "vapour near a liquid particle counts as a nucleation site")
    kinetic_radius: float = param(1.5, "-", "radius within which vapour acts as a site, in spacings", above=0.0,
                                  high=2.0)

    def properties(self, scene):
        return (
            Property("phase", "-", "state of the particle, see pysph_boiling.phases.Phase", "int", True),
            Property("kinetic", "-", "1 where a nucleation site is near", "int"),
            Property("vaporised", "-", "times the particle completed its latent heat", "int", True, True),
            Property("interrupted", "-", "times its transition was interrupted", "int", True, True),
            Property("e_lat", "J/kg", "latent heat held since an interruption", state=True))

    def columns(self, scene):
        def count(which):
            return lambda arrays, scene: float(ranks.total(len(which(arrays))))

        def energy(which):
            return lambda arrays, scene: ranks.total(float(np.sum(enthalpies(arrays)[which(arrays)])))

        @computed_once
        def parted(arrays):
            """Indices of the liquid above T_sat, and of that at T_sat."""
            hot = in_state(arrays, Phase.SUPERHEATED)
            held = at_saturation(Phase.SUPERHEATED, joined(arrays, "e")[hot], joined(arrays, "e_lat")[hot])
            return hot[~held], hot[held]

        states = {phase.name.lower(): (lambda arrays, phase=phase: in_state(arrays, phase),
                                       f"in state {phase.name.lower()}") for phase in Phase}
        states["superheated"] = lambda arrays: parted(arrays)[0], "of liquid above T_sat"
        states["held"] = lambda arrays: parted(arrays)[1], "of liquid held at T_sat without a site: interrupted, or fed"
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
            columns.append(Column("energy_hidden", "J", "held latent heat, which no temperature shows", hidden_heat))
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
        yield Term("heat.temperature", phase_change.PhaseTemperature(
            fluid, None, **state, k_l=k(material.k_l), k_v=k(material.k_v)))
        yield Term("heat.update", phase_change.PhaseTemperatureAfter(fluid, None, **state))
        yield Term("phases.kinetic", phase_change.PhaseKineticReset(fluid, None, near=self.kinetic == "always"))
        if self.vapour_as_site and self.kinetic == "site":
            yield Term("phases.kinetic", phase_change.PhaseVapourCondition(
                fluid, list(scene.fluids), radius=scene.bubble_radius(self.kinetic_radius)))
        yield Term("phases.edges", phase_change.PhaseEdges(fluid, None, **state, hold=self.interrupt == "hold"))


@computed_once
def in_state(arrays, phase):
    """Indices of the particles in a state among this rank's real ones."""
    return np.flatnonzero(joined(arrays, "phase") == phase.value)


def hidden_heat(arrays, scene):
    """Held latent heat of superheated particles [J]."""
    m, e, e_lat = (joined(arrays, name)[in_state(arrays, Phase.SUPERHEATED)] for name in ("m", "e", "e_lat"))
    return ranks.total(float(np.sum(np.minimum(e, e_lat) * m)))

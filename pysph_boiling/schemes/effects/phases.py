"""Phases: the four states of a particle and the edges between them."""
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pysph_boiling.device import largest, values
from pysph_boiling.equations import phase_change
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import Property
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.effects.base import (
    Column,
    Effect,
    Rule,
    cumulative,
    param,
    totals,
)
from pysph_boiling.schemes.reductions import HELD, has
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

    def grows(self):
        """Whether liquid next to vapour boils."""
        return self.vapour_as_site and self.kinetic == "site"

    def properties(self, scene):
        near = Property("vapour_distance", "m", "distance of the nearest vapour within the kinetic radius; 0 without "
                        "any, in vapour, and below saturation", state=True)
        return (
            *([near] if self.grows() else []),
            Property("phase", "-", "state of the particle, see pysph_boiling.phases.Phase", "int", True),
            Property("kinetic", "-", "1 where a nucleation site is near", "int"),
            Property("vaporised", "-", "times the particle completed its latent heat", "int", True, True),
            Property("interrupted", "-", "times its transition was interrupted", "int", True, True),
            Property("e_lat", "J/kg", "latent heat held since an interruption", state=True))

    def columns(self, scene):
        states = {phase.name.lower(): (phase.value, f"in state {phase.name.lower()}") for phase in Phase}
        states["superheated"] = Phase.SUPERHEATED.value, "of liquid above T_sat"
        states["held"] = HELD, "of liquid held at T_sat without a site: interrupted, or fed"
        columns = []
        for name, (state, meaning) in states.items():
            columns.append(Column(f"n_{name}", "-", f"particles {meaning}",
                                  lambda arrays, scene, state=state: totals(arrays).number[state]))
            columns.append(Column(f"energy_{name}", "J", f"enthalpy of the particles {meaning}",
                                  lambda arrays, scene, state=state: totals(arrays).energy[state]))
        columns += [
            cumulative("n_nucleated", "-", "particles vaporised by completing their latent heat, since the start",
                       "vaporised"),
            cumulative("n_interrupted", "-", "interrupted transitions since the start", "interrupted"),
        ]
        if self.interrupt == "hold":
            columns.append(Column("energy_hidden", "J", "held latent heat, which no temperature shows",
                                  lambda arrays, scene: totals(arrays).hidden))
        return tuple(columns)

    def conditions(self, scene):
        def hot(arrays):
            return ranks.anywhere(any(
                has(pa, "phase", Phase.LIQUID.value + 1, len(Phase) - 1) or
                largest(values(pa, "e"), default=-np.inf) >= 0.0 for pa in arrays))

        return {"phases": hot}

    def terms(self, scene, fluid):
        material, k = scene.material, scene.effects["heat"].conductivity
        subcooling = scene.effects["condensation"].subcooling if "condensation" in scene.effects else 1.0
        state = dict(T_sat=material.T_sat, L=material.L, c_l=material.c_l, c_v=material.c_v, subcooling=subcooling)
        yield Term("heat.temperature", phase_change.PhaseTemperature(
            fluid, None, **state, k_l=k(material.k_l), k_v=k(material.k_v)))
        yield Term("heat.update", phase_change.PhaseTemperatureAfter(fluid, None, **state))
        yield Term("phases.kinetic", phase_change.PhaseKineticReset(fluid, None, near=self.kinetic == "always"))
        if self.grows():
            yield Term("phases.kinetic", phase_change.PhaseVapourCondition(
                fluid, list(scene.fluids), radius=scene.bubble_radius(self.kinetic_radius)))
        yield Term("phases.edges", phase_change.PhaseEdges(fluid, None, **state, hold=self.interrupt == "hold"))

"""Expansion: vapour fills more volume than the liquid it came from."""
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pysph_boiling.equations import expansion
from pysph_boiling.particles import Property
from pysph_boiling.schemes import ranks
from pysph_boiling.schemes.effects.base import Column, Effect, gather, param
from pysph_boiling.schemes.stages import Term

__all__ = ["Expansion"]


@dataclass(frozen=True, kw_only=True)
class Expansion(Effect):
    """Vapour counts several rest volumes in the density constraint; radii of bubbles scale with it."""

    slot: ClassVar[str] = "expansion"
    title: ClassVar[str] = "expansion of vapour"
    requires: ClassVar[tuple[str, ...]] = ("phases", "density")
    v_exp: float = param(2.0, "-", "rest volume of vapour in units of the liquid's (water at 1 atm: 1600)", low=1.0,
                         high=4.0)
    ramp: float = param(10.0, "-", "time in which vapour swells, in units of sqrt(spacing/|g|)", above=0.0)

    def properties(self, scene):
        return (Property("swell", "-", "rest volume in units of the liquid's", state=True),)

    def prepare(self, scene, arrays):
        for name in scene.fluids:
            swell = arrays[name].swell
            swell[swell == 0.0] = 1.0  # a new property is zero; a resumed run keeps its own

    def check(self, scene, arrays):
        if scene.g == 0.0:
            raise ValueError("expansion.ramp is in units of sqrt(spacing/|g|), which a scene without gravity has not")

    def columns(self, scene):
        def volume(arrays, scene):
            return ranks.total(float(np.sum(gather(arrays, "m") * gather(arrays, "swell")))) / scene.rho0

        return (Column("rest_volume", "m^dim", "rest volume of liquid and vapour", volume),)

    def terms(self, scene, fluid):
        rate = max(self.v_exp - 1.0, 0.1) / (self.ramp * scene.fall_time) if scene.g else 1.0
        driven = getattr(scene.effects.get("oscillation"), "form", None) == "rayleigh_plesset"
        yield Term("forces.volume", expansion.BubbleSwell(
            fluid, None, expanded=self.v_exp, rate=rate, vapour=not driven))

"""Expansion: vapour fills more volume than the liquid it came from."""
import warnings
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pysph.solver.tools import Tool

from pysph_boiling.device import Subset, summed, values
from pysph_boiling.equations import expansion
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import Property
from pysph_boiling.schemes.effects.base import Column, Effect, Rule, param
from pysph_boiling.schemes.stages import Term

__all__ = ["Expansion"]


@dataclass(frozen=True, kw_only=True)
class Expansion(Effect):
    """A vapour particle fills several rest volumes in the density constraint; radii that act on vapour scale with it.

    These radii scale with v_exp^(1/dim) up to the kernel support, 2.4 spacings by default. The radius of cohesion has
    this value from the start; the linking radius and that of the kinetic condition reach it at a v_exp of 2.9 and 2.6
    in 2-D, and of 5.0 and 4.1 in 3-D.

    Limits: a particle can be swollen so far that it alone exceeds rest density, which no motion can correct. The
    density constraint refuses such values (from 3.17 in 2-D and 5.4 in 3-D with the default kernel and smoothing
    length). Vapour that has filled its container does not swell further (:class:`FullContainer`).
    """

    slot: ClassVar[str] = "expansion"
    title: ClassVar[str] = "expansion of vapour"
    requires: ClassVar[tuple[str, ...]] = ("phases", "density")
    in_guest: ClassVar[bool] = False
    auto_rule: ClassVar[Rule] = Rule(
        lambda facts, chosen: "what bursts must swell" if "dynamic_nucleation" in chosen else
        "its pulsation changes the volume of a bubble" if getattr(
            facts.candidates.get("oscillation"), "form", "") == "rayleigh_plesset" else "",
        "{}", "nothing bursts or pulsates", decided=("dynamic_nucleation",))
    v_exp: float = param(2.0, "-", "rest volume of vapour relative to liquid (water at 1 atm: 1600); in 2-D below "
                         "3.166 with the default kernel and smoothing length", low=1.0, high=4.0)
    ramp: float = param(10.0, "-", "time in which vapour swells, in units of sqrt(spacing/|g|); faster swelling "
                        "throws the liquid", low=2.0)

    def properties(self, scene):
        return (Property("swell", "-", "rest volume relative to that as liquid", state=True),
                Property("swelling", "1/s", "rate at which the swell changed in the last step", state=True))

    def prepare(self, scene, arrays):
        for name in scene.fluids:
            swell = arrays[name].swell
            swell[swell == 0.0] = 1.0  # a new property is zero; a resumed run has its own values

    def check(self, scene, arrays):
        if scene.g == 0.0:
            raise ValueError("expansion.ramp is in units of sqrt(spacing/|g|), so the scene needs gravity")

    def rayleigh_plesset(self, scene):
        """The oscillation that drives the volume of each bubble, if there is one."""
        oscillation = scene.effects.get("oscillation")
        return oscillation if getattr(oscillation, "form", None) == "rayleigh_plesset" else None

    def max_swell(self, scene):
        """The largest possible swell of a particle [-]."""
        oscillation = self.rayleigh_plesset(scene)
        return self.v_exp * (oscillation.bounds()[1] ** 3 if oscillation else 1.0)

    def describe_max_swell(self, scene):
        """The settings that determine :meth:`max_swell`, for messages."""
        return "expansion.v_exp" + (" times the cube of oscillation.upper" if self.rayleigh_plesset(scene) else "")

    def columns(self, scene):
        return (Column("rest_volume", "m^dim", "rest volume of liquid and vapour", rest_volume),)

    def tools(self, scheme):
        if "container" in scheme.effects:
            yield FullContainer(scheme)

    def terms(self, scene, fluid):
        rate = max(self.v_exp - 1.0, 0.1) / (self.ramp * scene.fall_time) if scene.g else 1.0
        yield Term("forces.next", expansion.BubbleSwell(
            fluid, None, expanded=self.v_exp, rate=rate, vapour=self.rayleigh_plesset(scene) is None))
        yield Term("density.back", expansion.BubbleSwellBack(fluid, None, sense=-1.0))
        yield Term("density.left_over", expansion.BubbleSwellBack(fluid, None, sense=1.0))


def rest_volume(arrays, scene):
    """Rest volume of liquid and vapour [m^dim]."""
    return ranks.total(sum(summed(values(pa, "m") * values(pa, "swell")) for pa in arrays)) / scene.rho0


class FullContainer(Tool):
    """Limits the expansion of vapour to the volume of its container, and warns once when it does.

    Otherwise boiling in a closed box becomes unstable when the rest volume exceeds 1.04 to 1.13 times that of the box.
    """

    EVERY = 5  # steps between two checks, in which vapour swells by 4 % of v_exp - 1

    def __init__(self, scheme):
        self.scheme, self.warned = scheme, False

    def post_step(self, solver):
        if solver.count % self.EVERY:
            return
        arrays, scene = self.scheme.arrays, self.scheme.scene()
        room = scene.effects["container"].volume(scene)
        over = rest_volume(arrays, scene) - room
        if over <= 1e-9 * room:
            return
        swollen = [Subset(pa, values(pa, "swell") > 1.0) for pa in arrays]
        swell = [part.get("swell") for part in swollen]
        gained = ranks.total(sum(float(np.sum(part.get("m") * (own - 1.0))) for part, own in zip(swollen, swell)))
        left = 1.0 - min(over * scene.rho0 / gained, 1.0) if gained > 0.0 else 0.0
        for part, own in zip(swollen, swell):
            part.put("swell", 1.0 + left * (own - 1.0))
        if gained > 0.0 and not self.warned:
            self.warned = True
            warnings.warn(
                f"at t = {solver.t + solver.dt:.4g} s vapour has filled its container of {room:.4g} m^{scene.dim}, so "
                "its expansion was limited; to avoid this, use less liquid, venting, or a lower expansion.v_exp",
                stacklevel=2)

"""Venting: a bubble at the surface leaves the simulation, or a lid returns it as liquid."""
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pysph.solver.tools import Tool

from pysph_boiling.device import Subset, values
from pysph_boiling.equations import venting
from pysph_boiling.native import groups
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import NO_BUBBLE, Property
from pysph_boiling.phases import Phase, enthalpy, temperature
from pysph_boiling.schemes.effects.base import Column, Effect, Flow, Rule, constant, param
from pysph_boiling.schemes.reductions import has
from pysph_boiling.schemes.stages import Term

__all__ = ["Venting", "VentingTool"]

MOST = np.iinfo(np.intc).max


@dataclass(frozen=True, kw_only=True)
class Venting(Effect):
    """Bubbles that reach the surface are removed, or returned as liquid by a lid; both are recorded."""

    slot: ClassVar[str] = "venting"
    title: ClassVar[str] = "venting"
    requires: ClassVar[tuple[str, ...]] = ("bubbles", "density")
    auto_rule: ClassVar[Rule] = Rule(lambda facts, chosen: facts.g > 0.0, "bubbles reach the surface", "no gravity")
    mode: str = param("lid", "-", "'remove' takes the bubble out, 'lid' returns it as liquid",
                      choices=("lid", "remove"))
    free_fraction: float = param(0.2, "-", "a bubble of N particles leaves when this times N^(1 - 1/dim) of them are "
                                 "free", above=0.0, high=1.0)
    free_steps: int = param(2, "-", "number of consecutive steps for which a particle must be free", low=1)
    T_feed: float = param(None, "K", "temperature of returned liquid; saturation if not given", above=0.0,
                          may_change=True, temperature=True)
    cone_cosine: float = param(0.5, "-", "cosine of half the opening angle of the upward cone", above=0.0, high=0.99)
    min_cover_height: float = param(0.3, "-", "particles less than this above a particle do not cover it, in spacings",
                                    low=0.0)

    @property
    def removes_particles(self):
        return self.mode == "remove"

    def check(self, scene, arrays):
        if self.T_feed is not None and self.T_feed > scene.material.T_sat:
            raise ValueError(f"venting.T_feed must be <= T_sat = {scene.material.T_sat} K, got {self.T_feed} K")

    def properties(self, scene):
        return (
            Property("film", "-", "1 if liquid has nothing above it", "int"),
            Property("covered", "-", "1 if vapour has something other than film above it", "int"),
            Property("free", "-", "number of consecutive steps in which a vapour particle was free", "int", True),
        )

    def constants(self, scene):
        return {"energy_vented": 0.0, "mass_vented": 0.0, "n_vented": 0.0, "n_bubbles_vented": 0.0}

    def flows(self, scene):
        name, meaning = {
            "lid": ("energy_lid", "heat that left through the lid, where vapour becomes liquid, since the start"),
            "remove": ("energy_vented", "enthalpy of the vapour that left since the start")}[self.mode]
        return (Flow(name, -1, meaning, constant="energy_vented"),)

    def columns(self, scene):
        return (
            Column("n_vented", "-", "particles vented since the start",
                   lambda arrays, scene: constant(arrays, "n_vented")),
            Column("n_bubbles_vented", "-", "bubbles vented since the start",
                   lambda arrays, scene: constant(arrays, "n_bubbles_vented")),
        )

    def terms(self, scene, fluid):
        ux, uy, uz = scene.up
        cone = dict(ux=ux, uy=uy, uz=uz, cone_cosine=self.cone_cosine,
                    min_cover_height=self.min_cover_height * scene.spacing)
        yield Term("bubbles.film", venting.VentingFilm(fluid, list(scene.fluids), **cone))
        yield Term("bubbles.free", venting.VentingFree(fluid, list(scene.fluids), **cone))
        gravity = dict(zip(("gx", "gy", "gz"), scene.gravity))
        yield Term("forces.release", venting.VentingRelease(fluid, None, **gravity))

    def tools(self, scheme):
        yield VentingTool(self, scheme)


class VentingTool(Tool):
    """Vents whole bubbles after the step, and records their mass and enthalpy.

    A bubble leaves when enough of its particles have been free for ``free_steps`` steps. Only its top is free, so
    ``free_fraction`` is in units of N^(1 - 1/dim) and not of N: a bubble of 160 particles had 6 free ones when it had
    left the water. The mode ``"lid"`` turns its particles into liquid at ``T_feed``, at rest and in their positions,
    and the difference of enthalpy leaves through the lid. The mode ``"remove"`` removes them and keeps their cumulative
    properties (heater energy, counts) in constants.
    """

    def __init__(self, effect, scheme):
        self.effect, self.scheme = effect, scheme
        self.material = scheme.material
        feed = self.material.T_sat if effect.T_feed is None else effect.T_feed
        self.e_feed = float(enthalpy(feed, self.material))
        self.events = []  # (time [s], particles in the bubble)

    def post_step(self, solver):
        arrays = self.scheme.arrays
        if not ranks.anywhere(any(has(pa, "free", self.effect.free_steps, MOST) for pa in arrays)):
            return
        bubbles = [Subset(pa, (values(pa, "bubble") != NO_BUBBLE) & (values(pa, "phase") == Phase.VAPOUR.value))
                   for pa in arrays]
        labels = [part.get("bubble") for part in bubbles]
        here, _, index, _ = groups(np.concatenate(labels))
        names, place = ranks.union(here)
        index = place[index]
        size = ranks.total(np.bincount(index, minlength=len(names)))
        free = np.concatenate([part.get("free") for part in bubbles])
        released = ranks.total(np.bincount(index, weights=free >= self.effect.free_steps, minlength=len(names)))
        surface = size ** (1.0 - 1.0 / self.scheme.dim)
        leaving = (released > 0) & (released >= self.effect.free_fraction * surface)
        if not leaving.any():
            return
        sizes = size[leaving]
        self.events += [(solver.t + solver.dt, int(n)) for n in sizes]
        arrays[0].n_bubbles_vented[0] += len(sizes)
        for part, label in zip(bubbles, labels):
            self._vent(part.pa, part.only(np.isin(label, names[leaving])))

    def _vent(self, pa, gone):
        n = ranks.total(len(gone))
        if n == 0:
            return
        m, e = gone.get("m"), gone.get("e")
        if "work_vented" in pa.constants:
            lost = 0.5 * float(np.sum(m * sum(gone.get(name)**2 for name in "uvw")))
            pa.work_vented[0] -= lost
            pa.work_moved[0] += lost
        pa.n_vented[0] += n
        if self.effect.mode == "lid":
            phase = Phase.SUPERHEATED if self.e_feed >= 0.0 else Phase.LIQUID
            fed = dict(e=self.e_feed, phase=int(phase), T=temperature(self.e_feed, phase, self.material), u=0.0, v=0.0,
                       w=0.0, free=0, bubble_n=0, bubble=NO_BUBBLE, e_lat=0.0)
            for name, value in fed.items():
                if name in pa.properties:
                    gone.put(name, value)
            pa.energy_vented[0] += ranks.total(float(np.sum(m * (e - gone.get("e")))))
            return
        pa.energy_vented[0] += ranks.total(float(np.sum(m * e)))
        pa.mass_vented[0] += ranks.total(float(np.sum(m)))
        for name in sorted(pa.constants):
            if name.startswith("carried_"):
                carried = float(np.sum(gone.get(name.removeprefix("carried_")), dtype=float))
                pa.constants[name].get_npy_array()[0] += ranks.total(carried)
        gone.remove()


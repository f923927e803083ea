"""Refill: liquid flows in from above, so that an open vessel does not boil dry."""
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pysph.solver.tools import Tool

from pysph_boiling.parallel import ranks
from pysph_boiling.particles import NO_BUBBLE
from pysph_boiling.phases import Phase, enthalpy
from pysph_boiling.schemes.effects.base import Column, Effect, Flow, Rule, constant, joined, param
from pysph_boiling.schemes.vapour import nearest_image

__all__ = ["Refill", "RefillTool"]


@dataclass(frozen=True, kw_only=True)
class Refill(Effect):
    """Liquid is added above the surface, as much as was vented or at a given rate, and recorded as inflow."""

    slot: ClassVar[str] = "refill"
    title: ClassVar[str] = "refill"
    requires: ClassVar[tuple[str, ...]] = ("density", "container", "heat")
    in_guest: ClassVar[bool] = False
    auto_rule: ClassVar[Rule] = Rule(
        lambda facts, chosen: chosen["venting"].mode == "remove",
        "vented liquid is to be replaced", "the lid returns vented bubbles as liquid", after=("venting",))
    rate: float = param(None, "kg/s", "inflow (kg/(s m) in 2-D); the smoothed rate of venting if not given", low=0.0,
                        may_change=True)
    T_feed: float = param(None, "K", "temperature of the liquid that flows in; saturation if not given", above=0.0,
                          may_change=True, temperature=True)
    seed: int = param(0, "-", "seed of the positions of the inflow", low=0)

    DELAY: ClassVar[float] = 20.0  # t*: a vented bubble is replaced over this time, not in one step
    TRIES: ClassVar[int] = 16  # columns that are checked for each particle; the lowest free one is filled

    def check(self, scene, arrays):
        if self.T_feed is not None and self.T_feed > scene.material.T_sat:
            raise ValueError(f"refill.T_feed must be <= T_sat = {scene.material.T_sat} K, got {self.T_feed} K")
        if self.rate is None and scene.g == 0.0:
            raise ValueError("refill.rate [kg/s] must be given in a scene without gravity")

    def constants(self, scene):
        return {"mass_refilled": 0.0, "energy_refilled": 0.0, "n_refilled": 0.0, "refill_due": 0.0, "refill_uid": 0.0,
                "steps": 0.0}

    def prepare(self, scene, arrays):
        pa = arrays[scene.fluids[0]]
        if pa.refill_uid[0] == 0.0:
            pa.refill_uid[0] = 1.0 + ranks.largest(max(int(arrays[name].uid.max(initial=0)) for name in scene.fluids))

    def flows(self, scene):
        return (Flow("energy_refill", +1, "enthalpy of the liquid that flowed in since the start",
                     constant="energy_refilled"),)

    def columns(self, scene):
        return (Column("n_refilled", "-", "particles that flowed in since the start",
                       lambda arrays, scene: constant(arrays, "n_refilled")),)

    def tools(self, scheme):
        yield RefillTool(self, scheme)


class RefillTool(Tool):
    """Adds particles to the first fluid array after the step, at rest and one spacing above the surface.

    A particle is only added if there is space below the container's top; otherwise it waits (``refill_due``).
    """

    def __init__(self, effect, scheme):
        self.effect, self.scheme, self.scene = effect, scheme, scheme.scene()
        material = scheme.material
        self.T_feed = material.T_sat if effect.T_feed is None else effect.T_feed
        self.e_feed = float(enthalpy(self.T_feed, material))

    def post_step(self, solver):
        arrays, scene, effect = self.scheme.arrays, self.scene, self.effect
        pa, mass = arrays[0], scene.particle_mass
        if effect.rate is None:
            gone = constant(arrays, "mass_vented") if "mass_vented" in pa.constants else 0.0
            wanted = gone - constant(arrays, "mass_refilled") - pa.refill_due[0]
            pa.refill_due[0] += max(wanted, 0.0) * -math.expm1(-solver.dt / (effect.DELAY * scene.fall_time))
        else:
            pa.refill_due[0] += effect.rate * solver.dt
        n = int(pa.refill_due[0] / mass * (1.0 + 1e-12))
        if n == 0:
            return
        places = self.places(arrays, n, np.random.default_rng([effect.seed, int(pa.steps[0])]))
        n = len(places)
        if n == 0:
            return
        if ranks.rank() == 0:  # all ranks compute the new particles, which move to their ranks with the next search
            self.add(pa, places)
        for name, value in (("refill_due", -n * mass), ("refill_uid", n), ("n_refilled", n),
                            ("mass_refilled", n * mass), ("energy_refilled", n * mass * self.e_feed)):
            pa.constants[name].get_npy_array()[0] += value

    def add(self, pa, places):
        """Add liquid at rest at ``places`` (n, 3) [m]."""
        scene, n = self.scene, len(places)
        values = dict(zip("xyz", places.T), m=scene.particle_mass, h=scene.h, rho=scene.rho0, e=self.e_feed,
                      T=self.T_feed, phase=int(Phase.SUPERHEATED if self.e_feed >= 0.0 else Phase.LIQUID),
                      bubble=NO_BUBBLE, swell=1.0, uid=np.arange(n) + int(pa.refill_uid[0]))
        kinds = {name: pa.properties[name].get_npy_array().dtype for name in values if name in pa.properties}
        pa.add_particles(**{name: np.broadcast_to(values[name], n).astype(kind) for name, kind in kinds.items()})

    def places(self, arrays, n, random):
        """Up to ``n`` positions (n, 3) [m], each one spacing above the liquid below it."""
        scene = self.scene
        axis, dx = scene.dim - 1, scene.spacing
        points = np.stack([joined(arrays, name) for name in "xyz"], -1)
        liquid = np.ones(len(points), bool)
        if "phase" in arrays[0].properties:
            liquid = joined(arrays, "phase") != Phase.VAPOUR
        lower, upper = scene.effects["container"].bounds(scene)
        found = []
        for _ in range(n):
            best = None
            columns = list(self.columns(random))
            top, vapour = np.full(len(columns), -math.inf), np.zeros(len(columns))
            for number, column in enumerate(columns):
                apart = nearest_image(points - column, scene.period)[:, :axis]
                under = np.flatnonzero(np.sum(apart**2, axis=1) < dx * dx)
                if len(under):
                    highest = under[np.argmax(points[under, axis])]
                    top[number], vapour[number] = points[highest, axis], not liquid[highest]
            own, top = top, ranks.largest(top)
            vapour = ranks.largest(np.where(own == top, vapour, 0.0))
            for column, height, closed in zip(columns, top, vapour):
                if closed:
                    continue
                column[axis] = lower[axis] if height == -math.inf else height + dx
                if column[axis] <= upper[axis] and (best is None or column[axis] < best[axis]):
                    best = column
            if best is None:
                break
            found.append(best)
            points, liquid = np.vstack([points, best]), np.append(liquid, True)
        return np.array(found).reshape(-1, 3)

    def columns(self, random):
        """Random points of the container's cross-section, each a new array (3,)."""
        container, scene = self.scene.effects["container"], self.scene
        lower, upper = (np.array(corner) for corner in container.bounds(scene))
        inset = np.where(np.arange(3) < scene.dim - 1, 0.4 * scene.spacing, 0.0)  # where liquid settles at a wall
        for point in random.uniform(lower + inset, upper - inset, (self.effect.TRIES, 3)):
            if container.covers(scene, point):
                yield point

"""A geyser: a chamber without sites is heated from below, erupts through its vent, refills, and erupts again.

Equations   those of explosive_boiling, with a heated floor. Vapour is only made by dynamic nucleation (the paper, eqs.
            3-7): water in the chamber superheats until a region bursts, and its neighbours follow. The vapour pushes
            the water out through the vent and escapes; cold water falls back and fills the chamber again.
Source      none; this scene is not in the paper and shows what dynamic nucleation can do.
Run time    about 60 s on two cores (3-D, 4,256 particles, 3,600 steps for 5 s); less with ``--demo`` or ``--flat``. The
            first run also compiles.
Command     pysph-boiling run geyser
"""
from dataclasses import dataclass

import numpy as np

from pysph_boiling.checks import require
from pysph_boiling.examples.explosive_boiling import ExplosiveBoiling
from pysph_boiling.particles import fluid_block, positions, wall_array
from pysph_boiling.runs.application import SceneParameters, upright_box
from pysph_boiling.schemes.effects import Buoyancy, Heater, Venting, param

ROCK = 2  # layers of wall
LEAST = 0.08  # smallest fraction of all particles that leaves as vapour in an eruption


@dataclass(frozen=True, kw_only=True)
class GeyserParameters(SceneParameters):
    """A chamber, a funnel to a narrow vent, and a pool around the mouth of the vent; lengths in spacings."""

    duration: float = param(5.0, "s", "simulated time", above=0.0, may_change=True)
    frame: float = param(1.0 / 30.0, "s", "time between two outputs", above=0.0, may_change=True)
    seed: int = param(1, "-", "seed of the start positions and of the bursts", low=0)
    dim: int = param(3, "-", "dimension", choices=(2, 3))
    spacing: float = param(0.004, "m", "particle spacing", above=0.0)
    chamber: float = param(9.0, "-", "radius of the chamber (half its width in 2-D), in spacings", above=4.0)
    chamber_height: int = param(9, "-", "height of the chamber without its funnel, in spacings", low=4)
    vent: float = param(3.0, "-", "radius of the vent, in spacings", above=2.0)
    vent_height: int = param(14, "-", "height of the vent, in spacings", low=4)
    pool: float = param(16.0, "-", "radius of the pool, in spacings", above=4.0)
    pool_depth: int = param(1, "-", "depth of the pool, in spacings", low=1)
    sky: int = param(30, "-", "height of the space above the pool, in spacings", low=4)
    superheat: float = param(230.0, "K", "temperature of the chamber's floor above saturation", above=0.0, high=250.0,
                             may_change=True, sets="heater.temperature", law="L/c_l")
    superheat_limit: float = param(165.0, "K", "mean superheat at which a region bursts into vapour", above=0.0,
                                   high=250.0, sets="dynamic_nucleation.superheat_limit", law="L/c_l")
    region_radius: float = param(2.4, "-", "radius of a region, in spacings", above=0.0,
                                 sets="dynamic_nucleation.radius")
    subcooling: float = param(40.0, "K", "start and feed temperature below saturation", low=0.0, high=80.0, law="L/c_l")
    time_scaling: float = param(5000.0, "-", "A: factor by which heat is faster relative to motion", above=0.0,
                                sets="heat.time_scaling", law="rho_l c_l/k_l")
    v_exp: float = param(3.0, "-", "volume of vapour in units of the volume of its liquid", low=1.0, high=4.0,
                         sets="expansion.v_exp")


class Geyser(ExplosiveBoiling):
    """The scene of this module."""

    Parameters = GeyserParameters
    title = "geyser"
    variants = {
        "demo": dict(chamber=7.0, chamber_height=8, vent_height=10, pool=10.0, duration=2.5),
        "flat": dict(dim=2),
    }

    def heights(self, p):
        """Heights of the tops of chamber, funnel, vent, pool and sky above the floor, in spacings."""
        funnel = p.chamber - p.vent
        return np.cumsum([p.chamber_height, funnel, p.vent_height, p.pool_depth, p.sky])

    def inside(self, points, p):
        """Mask (n,) of the ``points`` (n, 3) [m] inside the cavity."""
        up = p.dim - 1
        z = points[:, up] / p.spacing
        r = np.linalg.norm(points[:, :up] / p.spacing - self.half(p), axis=1)
        chamber, funnel, vent, _, sky = self.heights(p)
        radius = np.interp(z, [chamber, funnel, vent, vent + 1e-9], [p.chamber, p.vent, p.vent, p.pool])
        return (z > 0.0) & (z < sky) & (r < radius)

    def half(self, p):
        """Half the width of the box around everything, in spacings."""
        return max(p.chamber, p.pool) + ROCK

    def box(self, p):
        return upright_box(p, 2.0 * self.half(p), self.heights(p)[-1])

    def make_scheme(self, p):
        scheme = super().make_scheme(p)
        T_sat = scheme.material.T_sat
        scheme.set_effects(
            heater=Heater(temperature=T_sat + p.superheat), buoyancy=Buoyancy(k_bubble=2.5),
            venting=Venting(mode="lid", T_feed=T_sat - p.subcooling),
            expansion=scheme.effects["expansion"].replaced(v_exp=p.v_exp))
        return scheme

    def make_particles(self, p, scheme):
        lower, upper = self.box(p)
        surface = self.heights(p)[-2] * p.spacing
        corner = list(upper)
        corner[p.dim - 1] = surface
        common = dict(spacing=p.spacing, dim=p.dim, rho0=scheme.rho0, hdx=scheme.hdx)
        fluid = fluid_block(lower, corner, jitter=0.01, seed=p.seed, part=self.ranks_part,
                            inside=lambda at: self.inside(at, p), **common)
        return [fluid, self.rock(lower, upper, p, scheme, common)]

    def rock(self, lower, upper, p, scheme, common):
        """The walls of the cavity; the top layer below the chamber is the heater."""
        up = p.dim - 1
        below = list(lower)
        below[up] = -ROCK * p.spacing
        block = fluid_block(below, upper, **common)
        points = positions(block)
        shifts = np.zeros(((2 * ROCK + 1) ** p.dim, 3))
        shifts[:, :p.dim] = (np.indices((2 * ROCK + 1,) * p.dim).reshape(p.dim, -1).T - ROCK) * p.spacing
        near = np.zeros(len(points), bool)
        for shift in shifts:
            near |= self.inside(points + shift, p)
        points = points[near & ~self.inside(points, p)]
        r = np.linalg.norm(points[:, :up] / p.spacing - self.half(p), axis=1)
        floor = (points[:, up] < 0.0) & (points[:, up] > -p.spacing) & (r < p.chamber)
        return wall_array(points, kernel=scheme.kernel, heated=floor, jitter=scheme.wall_jitter, **common)

    def start(self, arrays, p, scheme):
        scheme.set_temperature(arrays["fluid"], self.start_temperature(p))

    def start_temperature(self, p):
        return self.material.T_sat - p.subcooling

    def facts(self):
        p, scheme, effects = self.parameters, self.scheme, self.scheme.effects
        scene, material = scheme.scene(), scheme.material
        facts = {"t* = sqrt(dx/g)": (scene.fall_time, "s")}
        if "heat" in effects:
            diffusivity = effects["heat"].conductivity(material.k_l) / (material.rho_l * material.c_l)
            facts |= {"A (heat relative to motion)": (effects["heat"].time_scaling, "-"),
                      "time for heat to cross a third of the chamber": (
                          (p.chamber_height * p.spacing / 3.0) ** 2 / diffusivity, "s")}
        if "dynamic_nucleation" in effects:
            burst = effects["dynamic_nucleation"].onset(scene)[0]
            facts["St = c_l (T - T_sat)/L of a burst"] = (material.c_l * burst / material.L, "-")
        return facts

    @property
    def eruptions(self):
        """(time [s], particles of vapour) of each eruption so far."""
        least = LEAST * self.final["fluid"]
        return [(t, n) for t, n in self.vents if n >= least]

    def check_final(self):
        self.check_needs("dynamic_nucleation", "venting")
        count = len(self.eruptions)  # grows with the duration, so it has no upper bound
        require(count >= 3, f"there were {count} eruptions; there must be at least 3")


if __name__ == "__main__":
    Geyser().run()

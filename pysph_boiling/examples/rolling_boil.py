"""A rolling boil: a pot of water at full heat, with sites all over its base; bubbles crowd and merge, drops fly.

Equations   those of steady_boiling, with sites that wake when the liquid at them is hot enough (Hsu 1962).
Source      none; this scene is not in the paper and shows what preset nucleation does at a high heat flux.
Run time    about 4 minutes on two cores (3-D, 35,616 particles, 2,160 steps for 3 s); less with ``--demo`` or
            ``--flat``. The first run also compiles.
Command     pysph-boiling run rolling_boil
"""
from dataclasses import dataclass, replace

import numpy as np

from pysph_boiling.analysis.drops import drops
from pysph_boiling.checks import require
from pysph_boiling.examples.steady_boiling import SteadyBoiling, SteadyBoilingParameters
from pysph_boiling.particles import (
    box_vessel,
    cylinder_vessel,
    fluid_block,
    site_array,
    sites_on_base,
    sites_on_disc,
)
from pysph_boiling.phases import Phase
from pysph_boiling.runs.scene_file import HeatedPart, Vessel
from pysph_boiling.schemes.effects import CylinderContainer, param


@dataclass(frozen=True, kw_only=True)
class RollingBoilParameters(SteadyBoilingParameters):
    """A round pot, in 2-D its section through the axis."""

    duration: float = param(3.0, "s", "simulated time", above=0.0, may_change=True)
    width: int = param(44, "-", "inner diameter of the pot, in spacings", low=8)
    fill: int = param(24, "-", "height of the water, in spacings", low=6)
    headroom: float = param(0.6, "-", "height of the pot above the water, in heights of the water", above=0.0)
    sites: int = param(48, "-", "preset nucleation sites on the heated base", low=1)
    smallest_cavity: float = param(1e-6, "m", "smallest radius of the sites' cavities; 0 makes all sites alike, active "
                                   "at saturation", low=0.0, law="sigma T_sat c_l/(rho_v L^2)")
    largest_cavity: float = param(0.0, "m", "largest radius of the sites' cavities; 0 for none", low=0.0,
                                  law="sigma T_sat c_l/(rho_v L^2)")
    embryo: float = param(1.0, "-", "smallest radius of the embryo that a bubble leaves, in radii of its cavity",
                          above=0.0, high=1.0, sets="preset_nucleation.embryo")
    heated: float = param(0.95, "-", "heated fraction of the base's diameter", above=0.0, high=1.0)
    time_scaling: float = param(1600.0, "-", "A: factor by which heat is faster relative to motion", above=0.0,
                                sets="heat.time_scaling", law="rho_l c_l/k_l")
    superheat: float = param(100.0, "K", "temperature of the base above saturation", above=0.0, high=250.0,
                             may_change=True, sets="heater.temperature", law="L/c_l")


class RollingBoil(SteadyBoiling):
    """The scene of this module; the axis of the pot is at the origin."""

    Parameters = RollingBoilParameters
    title = "rolling boil"
    ADHESION = K_BUBBLE = {2: None, 3: None}
    variants = {
        "demo": dict(width=28, fill=14, sites=20, duration=1.5),
        "flat": dict(dim=2, spacing=0.002, width=60, fill=35, sites=8, time_scaling=2000.0, duration=2.0),
        "fine": dict(spacing=0.002, width=80, fill=36, sites=120, time_scaling=800.0),
    }

    def radius(self, p):
        """Inner radius of the pot [m]."""
        return 0.5 * p.width * p.spacing

    def box(self, p):
        """Corners of the box around the inside of the pot [m]."""
        radius, height = self.radius(p), (1.0 + p.headroom) * p.fill * p.spacing
        across = [radius] * (p.dim - 1)
        rest = [0.0] * (3 - p.dim)
        return (*(-half for half in across), 0.0, *rest), (*across, height, *rest)

    def make_scheme(self, p):
        scheme = super().make_scheme(p)
        scheme.set_effects(container=CylinderContainer(radius=self.radius(p), top=self.box(p)[1][p.dim - 1]))
        return scheme

    def make_particles(self, p, scheme):
        lower, upper = self.box(p)
        radius, height = self.radius(p), upper[p.dim - 1]
        surface = list(upper)
        surface[p.dim - 1] = p.fill * p.spacing
        common = dict(spacing=p.spacing, rho0=scheme.rho0, hdx=scheme.hdx)
        fluid = fluid_block(
            lower, surface, dim=p.dim, jitter=0.01, seed=p.seed, part=self.ranks_part, **common,
            inside=lambda at: np.linalg.norm(at[:, :p.dim - 1], axis=1) < radius - 0.25 * p.spacing)
        vessel = dict(kernel=scheme.kernel, heated_fraction=p.heated, jitter=scheme.wall_jitter, **common)
        if p.dim == 2:
            wall = box_vessel(lower, upper, dim=2, **vessel)
            points = sites_on_base(p.sites, lower=(-p.heated * radius, 0.0), upper=(p.heated * radius, 0.0), dim=2,
                                   pattern=p.pattern, seed=p.seed)
        else:
            wall = cylinder_vessel(radius, height, **vessel)
            points = sites_on_disc(p.sites, radius=p.heated * radius, pattern=p.pattern, seed=p.seed)
        return [fluid, wall, site_array(points, reach=2.4 * p.spacing, spacing=p.spacing,
                                        activation=self.activation(p))]

    def described(self, p):
        found, radius = super().described(p), self.radius(p)
        height, half, thick = (1.0 + p.headroom) * p.fill * p.spacing, p.heated * radius, 0.5 * p.spacing
        part = dict(cylinder=dict(start=[0.0, 0.0, -thick], radius=half, height=2.0 * thick)) if p.dim == 3 else dict(
            box=[[-half, -thick], [half, thick]])
        return replace(
            found, vessel=Vessel(cylinder=dict(radius=radius, height=height)),
            fluids=(replace(found.fluids[0], fill=1.0 / (1.0 + p.headroom)),),
            heaters=(HeatedPart(**part, temperature=found.heaters[0].temperature),))

    def facts(self):
        facts, name = super().facts(), "time to boil dry at that flux"
        if name in facts and self.parameters.dim == 3:  # the base is round, that of steady boiling is square
            facts[name] = (4.0 / np.pi * facts[name][0], "s")
        return facts

    def measure(self, arrays, t):
        """Vapour particles, and particles in drops above the height of the pool at the start."""
        p, fluid = self.parameters, arrays["fluid"]
        sizes, places = drops(fluid, p.spacing)
        height = places[:, p.dim - 1]
        return np.count_nonzero(fluid.phase == Phase.VAPOUR), int(sizes[height > p.fill * p.spacing].sum())

    def check_final(self):
        self.check_needs("preset_nucleation", "bubbles", "venting")
        vapour, spray = np.array(self.measured()).T
        late = slice(len(vapour) // 2, None)
        share = vapour[late].mean() / self.counts()["fluid"]
        require(0.01 <= share <= 0.3, f"in the second half of the run {share:.1%} of the particles are vapour; it must "
                "be 1% to 30%")
        flying = np.count_nonzero(spray[late]) / len(spray[late])
        require(flying >= 0.25, f"drops fly above the pool in {flying:.0%} of the outputs of the second half of the "
                "run; it must be at least 25%")
        require(len(self.departures) >= self.parameters.sites, f"{len(self.departures)} bubbles left the base; there "
                f"must be at least as many as sites, {self.parameters.sites}")


if __name__ == "__main__":
    RollingBoil().run()

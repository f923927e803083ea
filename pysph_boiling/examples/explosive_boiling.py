"""Explosive boiling: superheated water in a vessel without sites bursts into vapour; the pool swells and settles.

Equations   those of steady_boiling without preset sites and heater; dynamic nucleation (the paper, eqs. 3-7); the
            oscillation of bubbles (eqs. 23-30); vapour that fills twice the volume of its liquid; a lid that returns
            vented vapour as liquid. With ``--base-superheat`` the base is heated, and bursts go on.
Source      "Physically Based Boiling Simulation with Thermally Driven Dynamic Nucleation", Figs. 5 and 6
            (``--no-oscillation``).
Run time    about 70 s on two cores (3-D, 20,384 particles, 1,080 steps for 1.5 s); less with ``--demo`` or ``--flat``.
            The first run also compiles.
Command     pysph-boiling run explosive_boiling
"""
from dataclasses import dataclass

import numpy as np

from pysph_boiling.analysis.level import surface_level
from pysph_boiling.checks import require
from pysph_boiling.particles import box_vessel, fluid_block
from pysph_boiling.runs.application import SceneApplication, SceneParameters, base_heater, upright_box
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    ArtificialPressure,
    BoxContainer,
    BubbleLabels,
    Buoyancy,
    Cohesion,
    Condensation,
    DensityConstraint,
    Drag,
    DynamicNucleation,
    Expansion,
    HeatConduction,
    LatentPooling,
    Oscillation,
    PhaseChange,
    Venting,
    WallMultipliers,
    XSPHViscosity,
    param,
)


@dataclass(frozen=True, kw_only=True)
class ExplosiveBoilingParameters(SceneParameters):
    """A box of water near saturation whose lower part is superheated."""

    duration: float = param(1.5, "s", "simulated time", above=0.0, may_change=True)
    frame: float = param(1.0 / 30.0, "s", "time between two outputs", above=0.0, may_change=True)
    seed: int = param(1, "-", "seed of the start positions and of the bursts", low=0)
    dim: int = param(3, "-", "dimension", choices=(2, 3))
    spacing: float = param(0.004, "m", "particle spacing", above=0.0)
    width: int = param(28, "-", "width and depth of the vessel, in spacings", low=8)
    fill: int = param(26, "-", "height of the water, in spacings", low=6)
    headroom: float = param(1.0, "-", "height above the water, in heights of the water", above=0.0)
    hot: float = param(0.5, "-", "fraction of the water's height, from the floor, that is superheated", above=0.0,
                       high=1.0)
    superheat: float = param(90.0, "K", "superheat of that part of the water", above=0.0, high=250.0, law="L/c_l")
    superheat_limit: float = param(60.0, "K", "mean superheat at which a region bursts into vapour", above=0.0,
                                   high=250.0, sets="dynamic_nucleation.superheat_limit", law="L/c_l")
    region_radius: float = param(2.0, "-", "radius of a region, in spacings", above=0.0,
                                 sets="dynamic_nucleation.radius")
    subcooling: float = param(2.0, "K", "temperature of the rest of the water and of the feed below saturation",
                              low=0.0, high=80.0, law="L/c_l")
    time_scaling: float = param(800.0, "-", "A: heat runs this many times faster against motion", above=0.0,
                                sets="heat.time_scaling", law="rho_l c_l/k_l")
    base_superheat: float = param(0.0, "K", "temperature of the base above saturation; 0 for a base without a heater",
                                  low=0.0, high=250.0, law="L/c_l")


class ExplosiveBoiling(SceneApplication):
    """The scene of this module."""

    Parameters = ExplosiveBoilingParameters
    title = "explosive boiling"
    variants = {
        "demo": dict(width=16, fill=18, duration=1.0),
        "flat": dict(dim=2, spacing=0.002, width=40, fill=30, superheat=180.0, superheat_limit=100.0, region_radius=2.4,
                     time_scaling=1000.0, duration=1.0, frame=0.025),
    }

    def box(self, p):
        """Inner corners of the vessel [m]; its top is the lid."""
        return upright_box(p, p.width, (1.0 + p.headroom) * p.fill)

    def make_scheme(self, p):
        lower, upper = self.box(p)
        material = self.material
        return BoilingScheme(
            ["fluid"], ["wall"], dim=p.dim, spacing=p.spacing, material=material,
            density=DensityConstraint(max_sweeps=4, tolerance=5e-3),
            container=BoxContainer(lower=lower, upper=upper),
            viscosity=XSPHViscosity(),
            wall_multipliers=WallMultipliers(),
            artificial_pressure=ArtificialPressure(),
            heat=HeatConduction(time_scaling=p.time_scaling),
            **base_heater(p, material),
            phases=PhaseChange(),
            dynamic_nucleation=DynamicNucleation(
                superheat_limit=p.superheat_limit, radius=p.region_radius, seed=p.seed),
            bubbles=BubbleLabels(),
            condensation=Condensation(),
            pooling=LatentPooling(),
            buoyancy=Buoyancy(k_bubble=0.5),
            cohesion=Cohesion(),
            drag=Drag(),
            expansion=Expansion(v_exp=2.0),
            oscillation=Oscillation(form="hysteresis", min_particles=5),
            venting=Venting(mode="lid", T_feed=material.T_sat - p.subcooling))

    def make_particles(self, p, scheme):
        lower, upper = self.box(p)
        corner = list(upper)
        corner[p.dim - 1] = p.fill * p.spacing
        common = dict(spacing=p.spacing, dim=p.dim, rho0=scheme.rho0, hdx=scheme.hdx)
        return [fluid_block(lower, corner, jitter=0.01, seed=p.seed, part=self.ranks_part, **common),
                box_vessel(lower, upper, kernel=scheme.kernel, heated_fraction=float(p.base_superheat > 0.0),
                           jitter=scheme.wall_jitter, **common)]

    def start_temperature(self, p):
        return self.material.T_sat + np.array([p.superheat, -p.subcooling])

    def start(self, arrays, p, scheme):
        fluid = arrays["fluid"]
        height = fluid.y if p.dim == 2 else fluid.z
        hot = height < p.hot * p.fill * p.spacing
        scheme.set_temperature(fluid, scheme.material.T_sat + np.where(hot, p.superheat, -p.subcooling))

    def facts(self):
        p, material = self.parameters, self.scheme.material
        paid = material.c_l * p.superheat / material.L  # of the superheated water
        v_exp = self.scheme.effects["expansion"].v_exp if "expansion" in self.scheme.effects else 1.0
        heat = self.scheme.effects.get("heat")
        return {
            **({} if heat is None else {"A (heat relative to motion)": (heat.time_scaling, "-")}),
            "St = c_l superheat/L": (paid, "-"),
            "particles that the excess heat can vaporise": (
                paid * p.hot * self.counts()["fluid"], "-"),
            "swelling if no vapour vents": (paid * p.hot * (v_exp - 1.0), "-"),
            "t* = sqrt(dx/g)": (self.scheme.scene().fall_time, "s"),
        }

    def measure(self, arrays, t):
        return surface_level([arrays["fluid"]], dim=self.parameters.dim)

    def check_final(self):
        self.check_needs("dynamic_nucleation")
        results = self.ledger.table()
        burst, particles = results["n_burst"][-1], self.final["fluid"]
        p, material = self.parameters, self.scheme.material
        if p.base_superheat:
            half = np.interp(0.5 * results["t"][-1], results["t"], results["n_burst"])
            require(burst > half, "nothing burst in the second half, although the base is heated")
            return  # the rest is about the heat at the start
        paid = p.hot * material.c_l * p.superheat / material.L  # fraction that the excess heat can vaporise
        require(0.01 <= burst / particles <= paid, f"{burst:g} of {particles} particles burst into vapour; it must be "
                f"at least 1%, and at most the {paid:.1%} that the excess heat can vaporise")
        level = self.measured()
        swelling = max(level) / level[0] - 1.0
        v_exp = self.scheme.effects["expansion"].v_exp if "expansion" in self.scheme.effects else 1.0
        most = max(1.75 * paid * (v_exp - 1.0), 0.08)  # bubbles oscillate in phase, drops fly, voids open
        require(0.04 <= swelling <= most, f"the level rose by {swelling:.1%}; it must rise by 4% to {most:.1%}")
        left = results["n_vapour"][-1] / results["n_vapour"].max()
        require(left <= 0.5, f"{left:.0%} of the vapour is left at the end; it must be at most 50%")


if __name__ == "__main__":
    ExplosiveBoiling().run()

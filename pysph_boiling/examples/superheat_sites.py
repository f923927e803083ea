"""Superheat and sites: the vessel of steady boiling with more or fewer sites, where liquid superheats and bursts.

Equations   those of ``steady_boiling``; dynamic nucleation (the paper, eqs. 3-7) in superheated liquid without a site;
            heat loss at the surface. The three models of boiling (``--mode``) are compared in this vessel.
Source      "Physically Based Boiling Simulation with Thermally Driven Dynamic Nucleation", Figs. 1, 13, 14.
Run time    about 3 minutes on two cores (3-D, 20,384 particles, 2,880 steps for 4 s); less with ``--demo`` or
            ``--flat``. The first run also compiles.
Command     pysph-boiling run superheat_sites --sites 16
"""
from dataclasses import dataclass, replace

import numpy as np

from pysph_boiling.checks import require
from pysph_boiling.examples.steady_boiling import SteadyBoiling, SteadyBoilingParameters
from pysph_boiling.runs.scene_file import Fluid
from pysph_boiling.schemes.effects import AmbientLoss, DynamicNucleation, param

AMBIENT = 80.0  # K, how far the air over water at 373.15 K is below saturation


@dataclass(frozen=True, kw_only=True)
class SuperheatSitesParameters(SteadyBoilingParameters):
    """The parameters of steady boiling, of which ``sites`` matters most here, and those of dynamic nucleation.

    The sites are alike and always active, as those of the paper: only their number is to make a difference.
    """

    sites: int = param(9, "-", "preset nucleation sites on the heated base", low=1)
    pattern: str = param("regular", "-", "layout of the sites", choices=("regular", "random"))
    smallest_cavity: float = param(0.0, "m", "smallest radius of the sites' cavities; 0 makes all sites alike, active "
                                   "at saturation", low=0.0, law="sigma T_sat c_l/(rho_v L^2)")
    superheat_limit: float = param(28.0, "K", "mean superheat at which liquid away from sites bursts", above=0.0,
                                   sets="dynamic_nucleation.superheat_limit", law="L/c_l")
    region_radius: float = param(2.4, "-", "radius of the region that bursts, in spacings", above=0.0,
                                 sets="dynamic_nucleation.radius")
    start_superheat: float = param(0.0, "K", "superheat of the lowest quarter of the water at the start; 0 to start at "
                                   "the temperature of the rest", low=0.0, high=250.0, law="L/c_l")
    loss_coefficient: float = param(5.0, "W/(m^2 K)", "heat transfer at the surface, before the factor A", low=0.0,
                                    may_change=True, sets="loss.coefficient", law="k_l")


class SuperheatSites(SteadyBoiling):
    """The scene of this module."""

    Parameters = SuperheatSitesParameters
    title = "superheat and sites"
    variants = {"demo": {**SteadyBoiling.variants["demo"], "sites": 4},
                "flat": {**SteadyBoiling.variants["flat"], "sites": 5}}

    def make_scheme(self, p):
        scheme = super().make_scheme(p)
        scheme.set_effects(
            loss=AmbientLoss(coefficient=p.loss_coefficient,
                             T_ambient=self.material.T_sat - self.in_proportion(AMBIENT, "L/c_l")),
            dynamic_nucleation=DynamicNucleation(superheat_limit=p.superheat_limit, radius=p.region_radius))
        return scheme

    def described(self, p):
        found = super().described(p)
        if not p.start_superheat:
            return found
        (pool,) = found.fluids
        return replace(found, fluids=(Fluid(fill=0.25 * pool.fill, temperature=float(self.start_temperature(p)[0])),
                                      replace(pool, fill=0.75 * pool.fill)))

    def start_temperature(self, p):
        cold = super().start_temperature(p)
        return np.array([self.material.T_sat + p.start_superheat, cold]) if p.start_superheat else cold

    def start(self, arrays, p, scheme):
        if not p.start_superheat:
            return super().start(arrays, p, scheme)
        fluid = arrays["fluid"]
        low = fluid.get("xyz"[p.dim - 1]) < 0.25 * p.fill * p.spacing
        scheme.set_temperature(fluid, np.where(low, *self.start_temperature(p)))

    def check_final(self):
        self.check_needs("phases")
        superheated, last = self.ledger.table()["n_superheated"], self.ledger.rows[-1]
        # These are counts since the start, which grow with the duration; the ledger checks the heat for them.
        made = sum(last.get(name, 0.0) for name in ("n_nucleated", "n_burst", "n_emitted"))
        require(made >= 10, f"{made:g} particles became vapour; it must be at least 10")
        if self.scheme.effects["phases"].kinetic == "always":
            require(not superheated.any(), "there is superheated liquid, although all liquid may boil in this mode")
        else:
            require(superheated[len(superheated) // 2:].min() > 0, "there is no superheated liquid")


if __name__ == "__main__":
    SuperheatSites().run()

"""Cooling: steady boiling until the heater is switched off; then bubbles condense or leave, and the surface settles.

Equations   those of ``steady_boiling``; condensation (the paper, eqs. 20-22), heat loss at the surface.
Source      "Physically Based Boiling Simulation with Thermally Driven Dynamic Nucleation", Fig. 4.
Run time    about 3 minutes on two cores (3-D, 20,736 particles, 2,652 steps for 2.6 s); less with ``--demo`` or
            ``--flat``. The first run also compiles.
Command     pysph-boiling run cooling
"""
import dataclasses
from dataclasses import dataclass

import numpy as np

from pysph_boiling.checks import NotChecked, require
from pysph_boiling.examples.superheat_sites import SuperheatSites, SuperheatSitesParameters
from pysph_boiling.schemes.effects import param


@dataclass(frozen=True, kw_only=True)
class CoolingParameters(SuperheatSitesParameters):
    """A shallow vessel below cold air that is heated for a while.

    Vapour that clings to the base must lose its latent heat to the liquid, although it conducts badly, and the liquid
    must lose it at the surface: if one particle in ten is vapour, that heat would warm the whole pool by 50 K. Heat
    therefore runs faster relative to motion than in steady boiling, and the base is less superheated so that it still
    makes about as much vapour.
    """

    duration: float = param(2.6, "s", "simulated time", above=0.0, may_change=True)
    heater_until: float = param(0.8, "s", "when the heater is switched off", low=0.0, may_change=True,
                                sets="heater.until")
    spacing: float = param(0.002, "m", "particle spacing", above=0.0)
    width: int = param(36, "-", "width and depth of the vessel, in spacings", low=8)
    fill: int = param(16, "-", "height of the water, in spacings", low=6)
    sites: int = param(16, "-", "preset nucleation sites on the heated base", low=1)
    subcooling: float = param(3.0, "K", "start and feed temperature below saturation", low=0.0, high=80.0, law="L/c_l")
    time_scaling: float = param(12000.0, "-", "A: factor by which heat is faster relative to motion", above=0.0,
                                sets="heat.time_scaling", law="rho_l c_l/k_l")
    superheat: float = param(5.0, "K", "temperature of the base above saturation", above=0.0, high=250.0,
                             may_change=True, sets="heater.temperature", law="L/c_l")
    loss_coefficient: float = param(8.0, "W/(m^2 K)", "heat transfer at the surface, before the factor A", low=0.0,
                                    may_change=True, sets="loss.coefficient", law="k_l")


class Cooling(SuperheatSites):
    """The scene of this module."""

    Parameters = CoolingParameters
    title = "cooling"
    variants = {
        "demo": dict(width=24, fill=14, sites=9, duration=2.2, heater_until=0.7),
        "flat": dict(dim=2, width=60, fill=16, sites=5, heated=0.7, time_scaling=20000.0, superheat=8.0,
                     loss_coefficient=8.0, duration=2.2, heater_until=0.7),
    }

    def make_scheme(self, p):
        scheme = super().make_scheme(p)
        scheme.set_effects(heater=dataclasses.replace(scheme.effects["heater"], until=p.heater_until))
        return scheme

    def check_final(self):
        self.check_needs("heater", "phases", "condensation")
        results, last, off = self.ledger.table(), self.ledger.rows[-1], self.scheme.effects["heater"].until
        if off is None or off >= self.solver.t:
            raise NotChecked("the heater was on until the end")
        condensed = np.interp(off, results["t"], results["n_condensed"])
        # The heater decides how much it boils, and the ledger checks the heat, so there is no upper bound here.
        require(results["n_vapour"].max() >= 20, "the water never boiled")
        require(last["n_condensed"] > condensed, "nothing condensed once the heater was off")
        require(last["n_vapour"] == 0, f"{last['n_vapour']:g} particles are still vapour")
        require(last["T_max"] < self.scheme.material.T_sat, f"the highest temperature is still {last['T_max']:.1f} K")


if __name__ == "__main__":
    Cooling().run()

"""Steady boiling in which each bubble pulsates by the Rayleigh-Plesset equation, slower than in water.

A steam bubble of 10 mm in water pulsates some 650 times a second, which no film shows, so the time of the bubbles runs
``oscillation.slowdown`` times slower. Each bubble has a volume of its own, which its equation changes; the density
constraint and the oscillation constraint make its particles fill that volume, so that bubbles swell and shrink while
they grow, depart and rise.

Equations   those of ``steady_boiling``; vapour that takes up more room than its liquid, and the Rayleigh-Plesset
            equation for the volume of each bubble.
Source      the paper names the Rayleigh-Plesset equation as future work; M. S. Plesset, J. Appl. Mech. 16, 1949.
Run time    about 3 minutes on two cores (3-D, 20,384 particles, 2,880 steps for 4 s); less with ``--demo``. The first
            run also compiles.
Command     pysph-boiling run pulsating_boil
"""
from dataclasses import dataclass

import numpy as np

from pysph_boiling.checks import require
from pysph_boiling.examples.steady_boiling import SteadyBoiling, SteadyBoilingParameters
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.effects import Expansion, Oscillation, param


@dataclass(frozen=True, kw_only=True)
class PulsatingBoilParameters(SteadyBoilingParameters):
    """The parameters of steady boiling in 3-D, and those of the pulsation."""

    dim: int = param(3, "-", "dimension", choices=(3,))
    v_exp: float = param(1.5, "-", "volume of vapour at rest in units of the volume of its liquid", low=1.0, high=4.0,
                         sets="expansion.v_exp")
    slowdown: float = param(50.0, "-", "factor by which the time of a bubble is slower", above=0.0,
                            sets="oscillation.slowdown")


class PulsatingBoil(SteadyBoiling):
    """The scene of this module."""

    Parameters = PulsatingBoilParameters
    title = "pulsating boil"
    K_BUBBLE = {3: 1.5}  # swollen bubbles leave while they are small, so their buoyancy is less than in steady_boiling
    variants = {name: options for name, options in SteadyBoiling.variants.items() if name != "flat"}

    def make_scheme(self, p):
        scheme = super().make_scheme(p)
        scheme.set_effects(expansion=Expansion(v_exp=p.v_exp),
                           oscillation=Oscillation(form="rayleigh_plesset", slowdown=p.slowdown,
                                       pressure=self.material.pressure, kappa=self.material.kappa))
        return scheme

    def measure(self, arrays, t):
        """Largest swell of the vapour: its volume over that of its liquid; 0 without vapour."""
        fluid = arrays["fluid"]
        vapour = np.asarray(fluid.phase) == Phase.VAPOUR
        return {"swell": float(np.max(fluid.swell[vapour]))} if vapour.any() else {}

    def check_final(self):
        super().check_final()
        self.check_needs("oscillation", "expansion")
        # vapour that only swells to its volume at rest never exceeds it
        v_exp = self.scheme.effects["expansion"].v_exp
        swell = np.array([row["swell"] for row in self.measured() if row]) / v_exp
        require(np.any(swell >= 1.02), f"no bubble pulsates: at most {np.max(swell):.3f} of its volume at rest is "
                "filled; it must be at least 1.02 at some time")


if __name__ == "__main__":
    PulsatingBoil().run()

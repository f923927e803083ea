"""A neutrally buoyant bubble in a pool just above saturation: only the oscillation constraint moves it.

Equations   those of bubble_rise; buoyancy balances the bubble's weight (eq. 19; k_bubble = 0 here).
Source      the oscillation constraint of "Physically Based Boiling Simulation with Thermally Driven Dynamic
            Nucleation", section 4.3; its constants are varied for Table 3.
Run time    about 9 s on two cores (3-D, 2,880 particles, 720 steps for 1 s); less with ``--flat``. The first run also
            compiles.
Command     pysph-boiling run bubble_held
"""
from dataclasses import dataclass

import numpy as np

from pysph_boiling.checks import require
from pysph_boiling.examples.bubble_rise import BubbleRise, BubbleRiseParameters
from pysph_boiling.schemes.effects import Buoyancy, Venting, param


@dataclass(frozen=True, kw_only=True)
class BubbleHeldParameters(BubbleRiseParameters):
    """A small box of water near saturation, with a bubble in it."""

    duration: float = param(1.0, "s", "simulated time", above=0.0, may_change=True)

    width: int = param(12, "-", "width and depth of the vessel, in spacings", low=8)
    fill: int = param(20, "-", "height of the water, in spacings", low=12)
    diameter: float = param(5.0, "-", "diameter of the bubble, in spacings", above=1.0)
    height: float = param(8.0, "-", "height of its centre above the base, in spacings", above=0.0)
    superheat: float = param(0.1, "K", "temperature of the water above saturation", low=0.0, high=30.0, law="L/c_l")


class BubbleHeld(BubbleRise):
    """The scene of this module."""

    Parameters = BubbleHeldParameters
    title = "bubble held"
    variants = {"flat": dict(dim=2, width=16, fill=14, height=7.0, duration=0.5)}

    def make_scheme(self, p):
        scheme = super().make_scheme(p)
        scheme.set_effects(
            buoyancy=Buoyancy(k_bubble=0.0),
            # a push can open a void in the bubble, which is not the free surface
            venting=Venting(mode="lid", free_fraction=1.0, free_steps=50))
        return scheme

    def check_bubbles(self, history):
        begun = history["t"] >= 0.2 * self.parameters.duration  # the first push tears it for a moment
        whole = float(np.min((history["n1"] / history["n"])[begun]))
        require(whole >= 0.9, f"the bubble fell apart: its largest piece holds {whole:.0%} of the vapour")
        kept = float(history["n"][-1] / history["n"][0])
        require(kept >= 0.9, f"only {kept:.0%} of the vapour is left, at least 90% must stay below the surface")
        p, material = self.parameters, self.scheme.material
        # and a tenth, as it has whole particles
        most = 1.1 + p.superheat * material.c_l / material.L * self.final["fluid"] / float(history["n"][0])
        require(kept <= most, f"the vapour grew to {kept:.0%}, but the pool's heat is enough for {most:.0%} at most")


if __name__ == "__main__":
    BubbleHeld().run()

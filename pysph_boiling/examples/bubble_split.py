"""A bubble in a pool of slightly superheated water rises into a pair of eddies that stretch it and tear it apart.

What splits it. A bubble in still water holds together (``bubble_rise``); what tears bubbles in a boil is the shear of
the eddies that other bubbles leave behind (J. O. Hinze, AIChE J. 1, 1955: where rho_l u^2 d/sigma, with u the change of
velocity across the bubble, exceeds a number of order one). Here two counter-rotating eddies are set up at the start,
above the bubble: between them liquid falls, pierces the bubble and draws its flanks apart. After that nothing is
imposed. A bubble so large has little surface tension for its size (Bond number 130), so cohesion is weak here; the
oscillation constraint is soft (the omega of the paper's eq. 30 is small), since by pulling all of a bubble towards its
mean radius it holds together what shear draws apart.

Equations   as ``bubble_rise``; at the start the stream function of the eddies, S x exp(-(x^2 + (z - z0)^2)/(2 a^2)).
Source      "Physically Based Boiling Simulation with Thermally Driven Dynamic Nucleation", Fig. 9; Fig. 12 with
            ``--no-dynamic-nucleation``, and ``--no-oscillation`` for the other half of the ablation.
Run time    about 2 minutes on one core (3-D, 20,328 particles); ``--demo`` a minute, ``--flat`` seconds.
Command     pysph-boiling run bubble_split
"""
from dataclasses import dataclass

import numpy as np

from pysph_boiling.analysis.shapes import PIECE, split
from pysph_boiling.checks import require
from pysph_boiling.examples.bubble_rise import BubbleRise, BubbleRiseParameters
from pysph_boiling.schemes.effects import Cohesion, Oscillation, Venting, param


@dataclass(frozen=True, kw_only=True)
class BubbleSplitParameters(BubbleRiseParameters):
    """As for one bubble, which is larger; and the eddies."""

    duration: float = param(0.35, "s", "simulated time", above=0.0, may_change=True)
    diameter: float = param(7.0, "-", "diameter of the bubble, in spacings", above=1.0)
    height: float = param(11.0, "-", "height of its centre above the base, in spacings", above=0.0)
    cohesion_strength: float = param(0.2, "-", "strength of the cohesion of vapour, in units of gravity", low=0.0,
                                     sets="cohesion.strength")
    eddy_speed: float = param(8.0, "-", "S, speed of the jet between the eddies, in sqrt(|g| spacing)", low=0.0)
    eddy_size: float = param(4.0, "-", "a, distance of the eddies from the jet, in spacings", above=0.0)
    eddy_height: float = param(15.5, "-", "height of the eddies above the base, in spacings", above=0.0)


class BubbleSplit(BubbleRise):
    """See the module."""

    Parameters = BubbleSplitParameters
    title = "bubble split"
    variants = {
        "demo": dict(width=18, fill=28, duration=0.2),
        "flat": dict(dim=2, spacing=0.002, width=28, fill=32, diameter=9.0, eddy_height=16.0, eddy_speed=10.0,
                     cohesion_strength=1.0, time_scaling=1000.0, duration=0.25),
    }

    def make_scheme(self, p):
        scheme = super().make_scheme(p)
        scheme.set_effects(
            cohesion=Cohesion(strength=p.cohesion_strength),
            oscillation=Oscillation(form="hysteresis", omega=0.2),
            # eddies open gaps, in which vapour is free for a moment
            venting=Venting(mode="lid", free_fraction=1.0, free_steps=6))
        return scheme

    def flow(self, x, height, p):
        x, z = x / p.eddy_size, (height - p.eddy_height) / p.eddy_size
        speed = p.eddy_speed * np.sqrt(9.81 * p.spacing) * np.exp(-0.5 * (x**2 + z**2))
        return -speed * x * z, -speed * (1.0 - x**2)

    def check_bubbles(self, history):
        event = split(history)
        require(event is not None, "the bubble did not split")
        require(event.smaller >= PIECE[self.parameters.dim], f"the smaller daughter has {event.smaller} particles")
        # vapour may grow or condense between two frames, and a splash may come off: less than a tenth
        require(abs(event.ratio - 1.0) <= 0.1, f"the daughters have {event.ratio:.2f} of the vapour of the bubble")


if __name__ == "__main__":
    BubbleSplit().run()

"""A bubble in a pool of slightly superheated water rises into a pair of eddies that stretch it and tear it apart.

Why it splits: a bubble in still water stays in one piece (``bubble_rise``). In boiling water, bubbles are torn by the
shear of eddies that other bubbles leave behind, if rho_l u^2 d/sigma exceeds a number of order one, where u is the
change of velocity across the bubble (J. O. Hinze, AIChE J. 1, 1955). Here two counter-rotating eddies are set up above
the bubble at the start, and nothing is imposed afterwards. Between them liquid flows down, pierces the bubble and pulls
its sides apart. Cohesion is weak, because surface tension has little effect on such a large bubble (Bond number 130).
The oscillation constraint is weak too (small omega in the paper's eq. 30), because it pulls a bubble towards its mean
radius and so resists splitting.

Equations   those of ``bubble_rise``; the stream function of the eddies is S x exp(-(x^2 + (z - z0)^2)/(2 a^2)).
Source      "Physically Based Boiling Simulation with Thermally Driven Dynamic Nucleation", Fig. 9; Fig. 12 with
            ``--no-dynamic-nucleation``, and ``--no-oscillation`` for the other half of the ablation.
Run time    about 15 s on two cores (3-D, 20,328 particles, 252 steps for 0.35 s); less with ``--demo`` or ``--flat``.
            The first run also compiles.
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
    """The parameters of bubble_rise with a larger bubble, and those of the eddies."""

    duration: float = param(0.35, "s", "simulated time", above=0.0, may_change=True)
    diameter: float = param(7.0, "-", "diameter of the bubble, in spacings", above=1.0)
    height: float = param(11.0, "-", "height of its centre above the base, in spacings", above=0.0)
    cohesion_sigma: float = param(0.0589, "N/m", "surface tension of bubbles, that of water", low=0.0,
                                  sets="cohesion.sigma", law="sigma")
    eddy_speed: float = param(8.0, "-", "S, speed of the jet between the eddies, in sqrt(|g| spacing)", low=0.0)
    eddy_size: float = param(4.0, "-", "a, distance of the eddies from the jet, in spacings", above=0.0)
    eddy_height: float = param(15.5, "-", "height of the eddies above the base, in spacings", above=0.0)


class BubbleSplit(BubbleRise):
    """The scene of this module."""

    Parameters = BubbleSplitParameters
    title = "bubble split"
    variants = {
        "demo": dict(width=18, fill=28, duration=0.2),
        "flat": dict(dim=2, spacing=0.002, width=28, fill=32, diameter=9.0, eddy_height=16.0, eddy_speed=10.0,
                     cohesion_sigma=0.02, time_scaling=1000.0, duration=0.25),
    }

    def make_scheme(self, p):
        scheme = super().make_scheme(p)
        scheme.set_effects(
            cohesion=Cohesion(sigma=p.cohesion_sigma),
            oscillation=Oscillation(form="hysteresis", omega=0.2),
            # eddies open gaps, which free some vapour for a moment
            venting=Venting(mode="lid", free_fraction=1.0, free_steps=6))
        return scheme

    def flow(self, place, p):
        x, z = place[:, 0] / p.eddy_size, (place[:, -1] - p.eddy_height) / p.eddy_size
        speed = p.eddy_speed * np.sqrt(9.81 * p.spacing) * np.exp(-0.5 * (x**2 + z**2))
        velocity = np.zeros_like(place)
        velocity[:, 0], velocity[:, -1] = -speed * x * z, -speed * (1.0 - x**2)
        return velocity

    def check_bubbles(self, history):
        event = split(history)
        require(event is not None, "the bubble did not split")
        require(event.smaller >= PIECE[self.parameters.dim], f"the smaller daughter only has {event.smaller} particles")
        # between two frames, less than a tenth of the vapour may grow, condense or splash off
        require(abs(event.ratio - 1.0) <= 0.1, f"the daughters have {event.ratio:.2f} times the vapour of the bubble")


if __name__ == "__main__":
    BubbleSplit().run()

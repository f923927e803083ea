"""A jet of water pierces a large bubble along its axis: it becomes a ring, which breaks up into smaller bubbles.

Why a ring: a large bubble that is pierced from one side to the other by a jet is a torus, as one that rises fast after
it was set free (J. K. Walters & J. F. Davidson, J. Fluid Mech. 17, 1963) or that collapses beside a wall. A ring of
vapour is unstable along its circumference and breaks up. Here the jet comes from above, along the axis of the vessel,
as part of a ring vortex that is set up at the start; nothing is imposed afterwards. The pool is hardly above
saturation, because pooled latent heat would vaporise the jet, which is the liquid nearest to the centre of the bubble.
The oscillation constraint is left out: it pulls a bubble towards its mean radius, and with it the ring closes.

Equations   those of ``bubble_split`` without the oscillation constraint; in 3-D the Stokes stream function of the
            vortex is S r^2/2 exp(-(r^2 + (z - z0)^2)/(2 a^2)), so that S is the speed of the jet on the axis.
Source      a bubble that a micro-jet pierces is an open problem of the paper.
Run time    about 20 s on two cores (3-D, 36,000 particles, 216 steps for 0.3 s); less with ``--demo`` or ``--flat``.
            The first run also compiles.
Command     pysph-boiling run bubble_ring
"""
from dataclasses import dataclass

import numpy as np

from pysph_boiling.analysis.shapes import hole
from pysph_boiling.checks import require
from pysph_boiling.examples.bubble_split import BubbleSplit, BubbleSplitParameters
from pysph_boiling.schemes.effects import param


@dataclass(frozen=True, kw_only=True)
class BubbleRingParameters(BubbleSplitParameters):
    """The parameters of bubble_split with a bubble of 12 spacings; in 3-D the eddies are a ring vortex."""

    duration: float = param(0.3, "s", "simulated time", above=0.0, may_change=True)
    width: int = param(30, "-", "width and depth of the vessel, in spacings", low=8)
    fill: int = param(40, "-", "height of the water, in spacings", low=12)
    diameter: float = param(12.0, "-", "diameter of the bubble, in spacings", above=1.0)
    height: float = param(13.0, "-", "height of its centre above the base, in spacings", above=0.0)
    superheat: float = param(0.1, "K", "temperature of the water above saturation", low=0.0, high=30.0, law="L/c_l")
    eddy_speed: float = param(30.0, "-", "S, speed of the jet, in sqrt(|g| spacing)", low=0.0)
    eddy_height: float = param(20.0, "-", "height of the eddies above the base, in spacings", above=0.0)


class BubbleRing(BubbleSplit):
    """The scene of this module."""

    Parameters = BubbleRingParameters
    title = "bubble ring"
    variants = {
        "demo": dict(width=24, fill=36, duration=0.25),
        "flat": dict(dim=2, spacing=0.002, width=36, fill=40, time_scaling=1000.0, duration=0.2),
    }

    def make_scheme(self, p):
        scheme = super().make_scheme(p)
        scheme.set_effects(oscillation=None)
        return scheme

    def flow(self, place, p):
        if p.dim == 2:
            return super().flow(place, p)
        across, z = place[:, :2] / p.eddy_size, (place[:, 2] - p.eddy_height) / p.eddy_size
        r2 = np.sum(across**2, axis=1)
        speed = p.eddy_speed * np.sqrt(9.81 * p.spacing) * np.exp(-0.5 * (r2 + z**2))
        return np.column_stack([-0.5 * (speed * z)[:, None] * across, -speed * (1.0 - 0.5 * r2)])

    def measure(self, arrays, t):
        row = super().measure(arrays, t)
        return {**row, "hole": hole(arrays["fluid"], self.parameters.dim)} if row else row

    def check_bubbles(self, history):
        p = self.parameters
        if p.dim == 3:
            widest = float(np.max(history["hole"])) / p.spacing
            require(widest >= 2.0, f"the bubble did not become a ring: its hole has a radius of {widest:.2g} spacings "
                    "at most, which must be at least 2")
        daughter = float(np.nanmax(history["n2"], initial=0.0) / history["n"][0])
        require(daughter >= 0.1, f"the bubble did not break up: its second largest piece never has more than "
                f"{daughter:.1%} of the vapour, which must be at least 10%")


if __name__ == "__main__":
    BubbleRing().run()

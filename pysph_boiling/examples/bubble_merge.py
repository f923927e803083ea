"""Two bubbles merge in a pool of slightly superheated water: the lower, larger one rises faster and catches the other.

Equations   those of ``bubble_rise``. Bubbles are the connected components of vapour (the paper, section 4.1), held
            together by surface tension (4.2.1). A larger bubble has less surface per volume, so drag slows it less.
Source      "Physically Based Boiling Simulation with Thermally Driven Dynamic Nucleation", Fig. 8; Fig. 11 with
            ``--no-dynamic-nucleation``, and ``--no-oscillation`` for the other half of the ablation.
Run time    about 30 s on two cores (3-D, 20,328 particles, 432 steps for 0.6 s); less with ``--demo`` or ``--flat``.
            The first run also compiles.
Command     pysph-boiling run bubble_merge
"""
from dataclasses import dataclass

from pysph_boiling.analysis.shapes import merger
from pysph_boiling.checks import require
from pysph_boiling.examples.bubble_rise import BubbleRise, BubbleRiseParameters
from pysph_boiling.schemes.effects import param


@dataclass(frozen=True, kw_only=True)
class BubbleMergeParameters(BubbleRiseParameters):
    """Those of bubble_rise, whose ``height`` and ``diameter`` are of the lower bubble, and those of the upper one."""

    duration: float = param(0.6, "s", "simulated time", above=0.0, may_change=True)
    second: float = param(4.0, "-", "diameter of the upper bubble, in spacings", above=1.0)
    gap: float = param(2.0, "-", "gap between the two at the start, in spacings", above=1.5)
    aside: float = param(1.0, "-", "horizontal offset of the upper bubble, in spacings")


class BubbleMerge(BubbleRise):
    """The scene of this module."""

    Parameters = BubbleMergeParameters
    title = "bubble merge"
    variants = {
        "demo": dict(width=14, fill=30, duration=0.5),
        "flat": dict(dim=2, spacing=0.002, width=30, fill=40, diameter=8.0, gap=1.6, aside=0.5, time_scaling=1000.0,
                     duration=0.45),
    }

    def bubbles(self, p):
        above = p.height + 0.5 * (p.diameter + p.second) + p.gap
        return [(0.0, p.height, p.diameter), (p.aside, above, p.second)]

    def check_bubbles(self, history):
        event = merger(history)
        require(event is not None, f"the {history['bubbles'][0]:.0f} bubbles of the start did not merge into one")
        # between two frames, less than a tenth of the vapour may grow or condense
        require(abs(event.ratio - 1.0) <= 0.1, f"the merged bubble has {event.ratio:.2f} times the vapour of the two")


if __name__ == "__main__":
    BubbleMerge().run()

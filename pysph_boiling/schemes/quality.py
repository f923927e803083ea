"""Presets of accuracy: how long a step is and how exactly its density is solved.

Taken from the fronts of ``pysph-boiling accuracy``, which also checks what they promise. Columns of water at rest, 20
particles high, and boiling are behind the choice: in boiling a step costs more than its sweeps, and cohesion bounds it,
so that only "reference" has shorter ones than the scenes were calibrated with; its lists have a skin, which short steps
need. Accelerated sweeps are in none of them: below eight they are no gain, and they add energy to sloshing water.
"""
from dataclasses import dataclass
from types import MappingProxyType

from pysph_boiling.schemes.effects import DensityConstraint

__all__ = ["QUALITIES", "Quality"]


@dataclass(frozen=True, kw_only=True)
class Quality:
    """A preset, and what it promises.

    ``dt_factor`` is the time step in units of t* = sqrt(spacing/|g|); ``density`` the density constraint; ``stated``
    maps a study of ``pysph-boiling accuracy`` and one of its errors to the bound that a run of it keeps; ``cost`` is
    the wall time of a simulated second over that of "standard", about: it is measured anew by the same command.
    """

    dt_factor: float
    density: DensityConstraint
    stated: dict
    cost: float

    def settings(self):
        """What it sets in a problem that has these fields."""
        return dict(dt_factor=self.dt_factor, density=self.density)


def column(error):
    """The promise for columns at rest: mean positive density error [-] at most ``error``."""
    return {("hydrostatic_2d", "density_mean"): error, ("hydrostatic_3d", "density_mean"): error}


QUALITIES = MappingProxyType({
    "draft": Quality(dt_factor=0.07, density=DensityConstraint(max_sweeps=3, tolerance=1e-2),
                     stated=column(0.015), cost=0.8),
    "standard": Quality(dt_factor=0.07, density=DensityConstraint(),
                        stated=column(0.005) | {("dam_break", "front"): 0.1}, cost=1.0),
    "reference": Quality(dt_factor=0.0175, density=DensityConstraint(max_sweeps=4, tolerance=5e-4, skin=0.2),
                         stated=column(0.0007), cost=2.5),
})

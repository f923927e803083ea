"""Presets of accuracy: how long a step is and how exactly its density is solved.

Taken from the fronts of ``pysph-boiling accuracy``, and asserted in ``tests/accuracy``: the errors are those of a
column of water at rest, 20 particles high, in 2-D and 3-D.
"""
from dataclasses import dataclass
from types import MappingProxyType

__all__ = ["QUALITIES", "Quality"]


@dataclass(frozen=True)
class Quality:
    """A preset.

    ``share`` is the time step in units of t* = sqrt(spacing/|g|); ``density`` holds the parameters of
    :class:`~pysph_boiling.schemes.effects.DensityConstraint` that it sets; ``error`` is the mean positive density error
    [-] to expect of water at rest, at most; ``cost`` the wall time of a simulated second over that of "standard",
    measured, about.
    """

    share: float
    density: dict
    error: float
    cost: float


QUALITIES = MappingProxyType({
    "draft": Quality(0.07, dict(min_sweeps=2, max_sweeps=4, tolerance=5e-3), 0.01, 0.7),
    "standard": Quality(0.07, dict(min_sweeps=2, max_sweeps=6, tolerance=4e-3), 0.006, 1.0),
    "reference": Quality(0.0175, dict(min_sweeps=2, max_sweeps=2, tolerance=0.0, skin=0.1), 0.001, 2.0),
})

"""Presets of accuracy: the time step, and how exactly the density is solved.

They were chosen from the fronts of ``pysph-boiling accuracy``, which also checks the errors that they promise: for
columns of water at rest up to 40 particles high, and for boiling. Beyond that the error of a column grows in proportion
to its height, up to ``density.max_mean_error``, from which on more sweeps are made. In boiling the sweeps are a small
part of a step, and boiling was calibrated with its length, so only "reference" has shorter steps; its neighbour lists
have a skin, which saves time in short steps. No preset uses accelerated sweeps, which gain nothing below eight sweeps
and add energy to sloshing water.
"""
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from pysph_boiling.schemes.effects import DensityConstraint

__all__ = ["QUALITIES", "Quality"]


@dataclass(frozen=True, kw_only=True)
class Quality:
    """A preset, and the errors that it promises.

    ``dt_factor`` is the time step in units of ``t* = sqrt(spacing/|g|)``; ``density`` the density constraint;
    ``stated`` maps (study of ``pysph-boiling accuracy``, name of an error) to the bound that the error keeps; ``cost``
    is the approximate wall time per simulated second relative to "standard", which the same command measures again.
    """

    dt_factor: float
    density: DensityConstraint
    stated: dict
    cost: float

    def settings(self) -> dict[str, Any]:
        """The values that it sets in a problem with these fields."""
        return dict(dt_factor=self.dt_factor, density=self.density)


def column(error):
    """The promise for columns at rest, up to 40 particles high: a mean positive density error [-] of at most ``error``.
    """
    return {("hydrostatic_2d", "density_mean"): error, ("hydrostatic_3d", "density_mean"): error}


QUALITIES = MappingProxyType({
    "draft": Quality(dt_factor=0.07, density=DensityConstraint(max_sweeps=4, tolerance=1e-2),
                     stated=column(0.015), cost=0.8),
    "standard": Quality(dt_factor=0.07, density=DensityConstraint(),
                        stated=column(0.005) | {("dam_break", "front"): 0.1}, cost=1.0),
    "reference": Quality(dt_factor=0.0175, density=DensityConstraint(max_sweeps=4, tolerance=5e-4, skin=0.2),
                         stated=column(0.0007), cost=2.5),
})

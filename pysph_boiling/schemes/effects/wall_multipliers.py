"""Multipliers of walls: a wall takes up the pressure of the fluid before it, and pushes with it."""
from dataclasses import dataclass
from typing import ClassVar

from pysph_boiling.equations.wall_multipliers import (
    PBFWallCorrection,
    PBFWallMultiplier,
    PBFWallStart,
    PBFWallWarmStart,
)
from pysph_boiling.particles import Property, lattice_density
from pysph_boiling.schemes.effects.base import Effect
from pysph_boiling.schemes.stages import Term

__all__ = ["WallMultipliers"]


@dataclass(frozen=True, kw_only=True)
class WallMultipliers(Effect):
    """Walls have multipliers, extrapolated from those of the fluid; without it they push by those of the fluid alone.
    """

    slot: ClassVar[str] = "wall_multipliers"
    title: ClassVar[str] = "multipliers of walls"
    requires: ClassVar[tuple[str, ...]] = ("density",)
    in_guest: ClassVar[bool] = False

    def wall_properties(self, scene):
        return (Property("wall_lmbda", "m^2", "Lagrange multiplier per mass, the mean of those of the fluid near it"),
                Property("wall_start", "m^2/s^2", "the same over dt^2, of those with which a step begins"),
                Property("wall_weight", "kg/m^3", "the sum that such a mean is divided by"))

    def terms(self, scene, fluid):
        if not scene.solids:
            return
        lattice, _ = lattice_density(scene.kernel, dim=scene.dim, hdx=scene.h / scene.spacing)
        walls, begins = list(scene.solids), scene.effects["density"].share_at_start > 0.0
        if fluid == scene.fluids[0]:
            for wall in walls:
                yield Term("density.walls", PBFWallMultiplier(wall, list(scene.fluids)))
                if begins:
                    yield Term("forces.walls", PBFWallStart(wall, list(scene.fluids)))
        yield Term("density.correction", PBFWallCorrection(fluid, walls, rho_rest=scene.rho0 * lattice))
        if begins:
            yield Term("forces.sum", PBFWallWarmStart(fluid, walls, rho_rest=scene.rho0 * lattice))

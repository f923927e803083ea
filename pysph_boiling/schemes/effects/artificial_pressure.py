"""Artificial pressure: close particles repel, so that they do not pair, nor crowd at the free surface."""
from dataclasses import dataclass
from typing import ClassVar

from pysph_boiling.equations.artificial_pressure import PBFArtificialPressure
from pysph_boiling.particles import lattice_density
from pysph_boiling.schemes.effects.base import Effect, param
from pysph_boiling.schemes.stages import Term

__all__ = ["ArtificialPressure"]


@dataclass(frozen=True, kw_only=True)
class ArtificialPressure(Effect):
    """The artificial pressure of Position Based Fluids, as a force between fluid particles; without gravity, none."""

    slot: ClassVar[str] = "artificial_pressure"
    title: ClassVar[str] = "artificial pressure"
    requires: ClassVar[tuple[str, ...]] = ("density",)
    in_guest: ClassVar[bool] = False
    strength: float = param(20.0, "-", "s/(|g| spacing), which is k/spacing^2 (t*/dt)^2 with Macklin & Müller's k",
                            low=0.0, may_change=True)

    def terms(self, scene, fluid):
        lattice, _ = lattice_density(scene.kernel, dim=scene.dim, hdx=scene.h / scene.spacing)
        yield Term("forces.sum", PBFArtificialPressure(
            fluid, list(scene.fluids), rho_rest=scene.rho0 * lattice, kernel=scene.kernel,
            hdx=scene.h / scene.spacing, strength=self.strength * scene.g * scene.spacing))

"""BoilingScheme: Position Based Fluids with heat, phases and bubbles, composed of effects."""
from collections.abc import Sequence
from typing import Any

import numpy as np
from pysph.base.particle_array import ParticleArray

from pysph_boiling.materials import WATER_1ATM, Material
from pysph_boiling.particles import add_properties
from pysph_boiling.phases import Phase, enthalpy, temperature
from pysph_boiling.schemes.pbf import PBFScheme, Slots

__all__ = ["BoilingScheme"]


class BoilingScheme(PBFScheme):
    """Boiling after "Physically Based Boiling Simulation with Thermally Driven Dynamic Nucleation".

    It takes the parameters of :class:`PBFScheme`, and these:

    Parameters
    ----------
    material : Material   Constants of the fluid; its liquid density is the rest density.
    sites : list of str   Names of the arrays of preset nucleation sites.
    forms : str           "ours", "paper" for the paper's own form of each effect, or names of single forms
                          (:mod:`pysph_boiling.schemes.forms`). They change the effects that are given here;
                          ``set_effects`` afterwards overrides them.
    effects : "auto"      Choose the effects from the scene (:mod:`pysph_boiling.schemes.auto`): ``setup_properties``
                          checks the arrays and ``T_start`` [K], and prints the effects and the reasons (also in
                          ``choices``). Slots that are given, even as ``None``, are used as they are.
    **slots               One effect or ``None`` for each slot of :data:`pysph_boiling.schemes.effects.EFFECTS`.

    Without effects it builds the same as ``PBFScheme``. Errors and limits are the same, too. A vapour particle has the
    mass of a liquid particle, and its rest volume unless there is the effect ``expansion``.

    Example: a scheme for water in a vessel on a heater, whose effects are listed.

    >>> from pysph_boiling.materials import WATER_1ATM
    >>> from pysph_boiling.schemes.boiling import BoilingScheme
    >>> from pysph_boiling.schemes.effects import Heater, HeatConduction
    >>> scheme = BoilingScheme(["fluid"], ["wall"], dim=2, spacing=0.005, material=WATER_1ATM,
    ...                        heat=HeatConduction(), heater=Heater(temperature=400.0))
    >>> list(scheme.effects)
    ['density', 'heat', 'heater']
    >>> scheme.rho0  # kg/m^3
    958.0
    """

    slots = Slots()

    def __init__(self, fluids: Sequence[str], solids: Sequence[str], *, dim: int, spacing: float,
                 material: Material = WATER_1ATM, sites: Sequence[str] = (), effects: str | None = None,
                 T_start: Any = None, forms: str = "ours", **slots: Any):
        if not isinstance(material, Material):
            raise ValueError(f"material must be a Material, got {material!r}")
        if effects not in (None, "auto"):
            raise ValueError(f"effects must be 'auto' or left out (each effect has its own keyword), got {effects!r}")
        self.material, self.T_start, self.forms = material, T_start, forms
        self.asked = {slot: slots[slot] for slot in slots if slot in self.slots} if effects == "auto" else None
        if effects == "auto":  # given effects may need others that are chosen later
            slots = {name: value for name, value in slots.items() if name not in self.slots or name == "density"}
        super().__init__(fluids, solids, dim=dim, spacing=spacing, rho0=material.rho_l, sites=sites, **slots)
        if effects != "auto":
            self.set_forms(forms)

    def setup_properties(self, particles, clean=True):
        if self.asked is not None:
            asked, self.asked = self.asked, None
            self.derive(particles, self.T_start, asked=asked)
            self.set_forms(self.forms)
        super().setup_properties(particles, clean)

    def set_temperature(self, pa: ParticleArray, T: float | np.ndarray) -> None:
        """Set the initial temperature ``T`` [K], a number or (n,), of a fluid array: liquid, superheated above T_sat.

        Call it after ``setup_properties``. Raises ``ValueError`` for temperatures below melting or not below the
        critical temperature, and for a wrong shape.
        """
        if np.shape(T) not in ((), (1,), pa.x.shape):
            raise ValueError(f"T of '{pa.name}' must be a number or have shape {pa.x.shape} [K], got {np.shape(T)}")
        add_properties(pa, [row for row in self.effect_rows("properties") if row.name not in pa.properties])
        pa.e[:] = enthalpy(T, self.material)
        if np.size(T):
            self.material.check_melted(float(np.min(T)), f"T of '{pa.name}'")
        phase = Phase.LIQUID
        if "phase" in pa.properties:
            pa.phase[:] = (pa.e >= 0.0) * int(Phase.SUPERHEATED)
            phase = pa.phase
        if "e_lat" in pa.properties:
            pa.e_lat[:] = 0.0
        pa.T[:] = temperature(pa.e, phase, self.material)

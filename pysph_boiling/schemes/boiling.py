"""BoilingScheme: Position Based Fluids with heat, phases and bubbles, composed of the effects a scene calls for."""
from pysph_boiling.materials import WATER_1ATM, Material
from pysph_boiling.particles import add_properties
from pysph_boiling.phases import Phase, enthalpy, temperature
from pysph_boiling.schemes.effects import EFFECTS
from pysph_boiling.schemes.pbf import PBFScheme

__all__ = ["BoilingScheme"]


class BoilingScheme(PBFScheme):
    """Boiling after "Physically Based Boiling Simulation with Thermally Driven Dynamic Nucleation".

    Parameters are those of :class:`PBFScheme`, and

    material : Material   Constants of the fluid; its liquid density is the rest density.
    sites : list of str   Names of the arrays of preset nucleation sites.
    **effects             ``heat``, ``heater``, ``loss``, ``source``, ``phases``, ``nucleation``, ``bubbles``,
                          ``buoyancy``, ``tension``, ``adhesion``, ``drag``, ``venting``; each an effect or ``None``.

    Without effects it builds what ``PBFScheme`` builds. Errors and limits: as there; vapour and liquid have the same
    mass and rest volume.
    """

    slots = tuple(EFFECTS)

    def __init__(self, fluids, solids, *, dim, spacing, material=WATER_1ATM, sites=(), **effects):
        if not isinstance(material, Material):
            raise ValueError(f"material must be a Material, got {material!r}")
        self.material = material
        super().__init__(fluids, solids, dim=dim, spacing=spacing, rho0=material.rho_l, sites=sites, **effects)

    def set_temperature(self, pa, T):
        """Start a fluid array at temperature ``T`` [K], a number or (n,): liquid, superheated above saturation.

        Raises ``ValueError`` outside (0 K, critical temperature). Call it after ``setup_properties``.
        """
        add_properties(pa, [row for row in self.gather("properties") if row.name not in pa.properties])
        pa.e[:] = enthalpy(T, self.material)
        phase = Phase.LIQUID
        if "phase" in pa.properties:
            pa.phase[:] = (pa.e >= 0.0) * int(Phase.SUPERHEATED)
            phase = pa.phase
        if "e_lat" in pa.properties:
            pa.e_lat[:] = 0.0
        pa.T[:] = temperature(pa.e, phase, self.material)

"""How strongly a vessel boils."""
import numpy as np

__all__ = ["heat_flux"]


def heat_flux(table, *, area, time_scaling, begin):
    """Mean heat flux of the heater [W/m^2] from the time ``begin`` [s] on, over the factor A of the heat.

    ``table`` is the table of results, with ``t`` [s] and ``energy_heater`` [J, or J/m in 2-D]; ``area`` is that of the
    heated walls [m^2, or m in 2-D], and ``time_scaling`` is A, by which heat is faster relative to motion.
    """
    late = table["t"] > begin
    energy = table["energy_heater"][late]
    return float((energy[-1] - energy[0]) / (np.ptp(table["t"][late]) * area * time_scaling))

"""Functions that kernels call: temperature from enthalpy, and the counter-based random numbers.

They are compiled into each kernel that lists them in ``_get_helpers_``; a default argument gives a C type.
"""
from compyle.api import declare

__all__ = ["boiling_temperature", "boiling_uniform"]


def boiling_temperature(e=0.0, e_lat=0.0, phase=0, T_sat=0.0, L=0.0, c_l=1.0, c_v=1.0, subcooling=1.0):
    """Temperature [K] from specific enthalpy [J/kg]; the compiled twin of :func:`pysph_boiling.phases.temperature`."""
    T = T_sat
    if phase == 3:
        if e < L:
            T = T_sat + subcooling * (e - L) / c_v
        else:
            T = T_sat + (e - L) / c_v
    if phase == 0:
        if e < 0.0:
            T = T_sat + e / c_l
        else:
            T = T_sat + max(e - e_lat, 0.0) / c_l
    if phase == 2:
        if e < 0.0:
            T = T_sat + e / c_l
        else:
            T = T_sat + max(e - e_lat, 0.0) / c_l
    return T


def boiling_uniform(u=0, v=0):
    """Uniform number in [-1, 1) from two counters: multiply and xor-shift rounds, multipliers below 2^31."""
    h = declare('unsigned int')
    h = u
    h = h + v*40503
    h = h ^ (h >> 16)
    h = h * 569420461
    h = h ^ (h >> 15)
    h = h * 1935289751
    h = h ^ (h >> 15)
    return h * 4.656612873077393e-10 - 1.0

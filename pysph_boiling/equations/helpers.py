"""Functions that kernels call: heat capacity, temperature from enthalpy, random numbers, and fast smoothing kernels.

They are compiled into each kernel that lists them in ``_get_helpers_``; default arguments define the C types.

:func:`boiling_kernel` and :func:`boiling_kernel_slope` are polynomials without branches, so that compilers can
vectorise the loops over neighbours; :func:`kernel_coefficients` has the kernels that they support.
"""
from compyle.api import declare

__all__ = [
    "boiling_capacity", "boiling_cohesion", "boiling_kernel", "boiling_kernel_slope", "boiling_temperature",
    "boiling_uniform", "kernel_coefficients",
]


def kernel_coefficients(kernel):
    """Coefficients (c3, c4, c5, c1) of a PySPH kernel of radius 2 h, for :func:`boiling_kernel`.

    Errors: ``ValueError`` for a kernel other than ``CubicSpline`` and ``WendlandQuintic``.
    """
    shapes = {"CubicSpline": (0.25, 0.0, 0.0, -1.0), "WendlandQuintic": (0.0, 0.3125, -0.125, 0.0)}
    name = type(kernel).__name__
    if name not in shapes or kernel.dim == 1:
        raise ValueError(f"the density constraint supports the kernels {' and '.join(shapes)} in 2-D and 3-D, got "
                         f"{name} in {kernel.dim}-D")
    return tuple(float(kernel.fac) * c for c in shapes[name])


def boiling_kernel(q=0.0, c3=0.0, c4=0.0, c5=0.0, c1=0.0):
    """W h^dim at distance q = r/h: with t = max(2 - q, 0), u = max(1 - q, 0), c3 t^3 + c4 t^4 + c5 t^5 + c1 u^3."""
    t = max(2.0 - q, 0.0)
    u = max(1.0 - q, 0.0)
    return t*t*t * (c3 + t*(c4 + t*c5)) + c1*u*u*u


def boiling_kernel_slope(q=0.0, c3=0.0, c4=0.0, c5=0.0, c1=0.0):
    """(1/q) dW/dq h^dim of :func:`boiling_kernel`; times x_ij/h^2 it is the gradient. Finite, but wrong, at q = 0."""
    t = max(2.0 - q, 0.0)
    u = max(1.0 - q, 0.0)
    return -(t*t * (3.0*c3 + t*(4.0*c4 + t*5.0*c5)) + 3.0*c1*u*u) / max(q, 1e-9)


def boiling_cohesion(q=0.0):
    """Cohesion of a pair at distance q in units of its range, 0 to 1: attraction up to 1, repulsion below about 0.27.

    Source: Akinci, Akinci & Teschner 2013, eq. 2, normalised to a peak of 1.
    """
    f = 64.0 * (1.0-q)*(1.0-q)*(1.0-q) * q*q*q
    if q <= 0.5:
        f = 2.0*f - 1.0
    return f


def boiling_capacity(held=0.0, L=1.0, c_l=1.0, c_v=1.0):
    """Heat capacity [J/(kg K)] of liquid; the compiled twin of :func:`pysph_boiling.phases.heat_capacity`."""
    return c_l + (c_v - c_l) * max(min(held / L, 1.0), 0.0)


def boiling_temperature(e=0.0, e_lat=0.0, phase=0, T_sat=0.0, L=1.0, c_l=1.0, c_v=1.0, subcooling=1.0):
    """Temperature [K] from specific enthalpy [J/kg]; the compiled twin of :func:`pysph_boiling.phases.temperature`.

    A kernel that calls it lists :func:`boiling_capacity` before it in ``_get_helpers_``.
    """
    T = T_sat + min(e, 0.0) / c_l
    if phase == 1:
        T = T + max(e - L, 0.0) / c_v
    elif phase == 3:
        if e < L:
            T = T_sat + subcooling * (e - L) / c_v
        else:
            T = T_sat + (e - L) / c_v
    else:
        T = T + max(e - e_lat, 0.0) / boiling_capacity(e_lat, L, c_l, c_v)
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

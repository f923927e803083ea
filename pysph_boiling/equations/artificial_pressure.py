"""Artificial pressure: close particles repel, so that they do not pair, nor crowd at the free surface."""
from math import sqrt

from compyle.api import declare
from pysph.sph.equation import Equation

from pysph_boiling.equations.helpers import boiling_kernel, boiling_kernel_slope, kernel_coefficients

__all__ = ["PBFArtificialPressure"]

DISTANCE = 0.3  # spacings; where the kernel is the unit of the artificial pressure


class PBFArtificialPressure(Equation):
    r"""Artificial pressure between fluid particles, as a force.

    .. math::  a_i = -\frac{s}{\rho_0} \sum_j m_j \left(\frac{W_{ij}}{W(0.3\,\Delta x)}\right)^4 \nabla W_{ij}

    In a step of dt it moves particles of equal mass m as the position correction would with
    :math:`\lambda_i + \lambda_j - k (W_{ij}/W(0.3\,\Delta x))^4` in place of :math:`\lambda_i + \lambda_j`, with
    :math:`k = s\,m\,\Delta t^2`. It is equal and opposite in momentum for every pair, and has a potential.

    Source: Macklin & Müller 2013, eqs. 13 and 14, with n = 4. Differs: a force, once in a step, so that it does not
    depend on the time step nor on the number of sweeps; the reference distance is in spacings.

    Parameters
    ----------
    rho_rest : float        Summed density of the rest lattice [kg/m^3], > 0.
    kernel : PySPH kernel   CubicSpline or WendlandQuintic.
    hdx : float             Smoothing length over the spacing [-], > 0.
    strength : float        s [m^2/s^2], >= 0.

    Reads    d_h, s_h [m], s_m [kg], positions.   Writes   d_au, d_av, d_aw [m/s^2], own index only.
    Errors   ValueError if rho_rest <= 0, hdx <= 0 or strength < 0.
    Limits   Walls do not repel. Explicit: with s = 20 g dx water is calm in steps of up to 0.2 t*.
    """

    def __init__(self, dest, sources, rho_rest, kernel, hdx, strength):
        if not rho_rest > 0.0:
            raise ValueError(f"rho_rest must be > 0 kg/m^3, got {rho_rest}")
        if not hdx > 0.0:
            raise ValueError(f"hdx (smoothing length over spacing) must be > 0, got {hdx}")
        if not strength >= 0.0:
            raise ValueError(f"strength of the artificial pressure must be >= 0 m^2/s^2, got {strength}")
        self.rho_rest = float(rho_rest)
        self.strength = float(strength)
        c3, c4, c5, c1 = kernel_coefficients(kernel)
        self.c3 = float(c3)
        self.c4 = float(c4)
        self.c5 = float(c5)
        self.c1 = float(c1)
        self.per_unit = float(1.0 / boiling_kernel(DISTANCE / hdx, c3, c4, c5, c1))
        self.depth = float(kernel.dim == 3)
        super().__init__(dest, sources)

    def _get_helpers_(self):
        return [boiling_kernel, boiling_kernel_slope]

    def loop_all(self, d_idx, d_x, d_y, d_z, d_h, s_x, s_y, s_z, s_h, s_m, d_au, d_av, d_aw, NBRS, N_NBRS):
        i = declare('int')
        j = declare('int')
        x = d_x[d_idx]
        y = d_y[d_idx]
        z = d_z[d_idx]
        h = d_h[d_idx]
        ax = 0.0
        ay = 0.0
        az = 0.0
        for i in range(N_NBRS):
            j = NBRS[i]
            dx = x - s_x[j]
            dy = y - s_y[j]
            dz = z - s_z[j]
            h1 = 2.0 / (h + s_h[j])
            q = sqrt(dx*dx + dy*dy + dz*dz) * h1
            f = boiling_kernel(q, self.c3, self.c4, self.c5, self.c1) * self.per_unit
            f = s_m[j] * h1*h1*h1*h1 * (1.0 + self.depth*(h1 - 1.0)) * f*f*f*f
            f = f * boiling_kernel_slope(q, self.c3, self.c4, self.c5, self.c1)
            ax += f * dx
            ay += f * dy
            az += f * dz
        f = self.strength / self.rho_rest
        d_au[d_idx] -= f * ax
        d_av[d_idx] -= f * ay
        d_aw[d_idx] -= f * az

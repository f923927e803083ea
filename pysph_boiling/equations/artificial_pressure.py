"""Artificial pressure of Position Based Fluids: a repulsion of close pairs within the density sweeps."""
from math import sqrt

from compyle.api import declare
from pysph.sph.equation import Equation

from pysph_boiling.equations.helpers import boiling_kernel, boiling_kernel_slope, kernel_coefficients

__all__ = ["PBFArtificialPressure", "reference_distance"]

DISTANCE = 0.3  # spacings; where a pair repels with the full strength


def reference_distance(kernel, hdx):
    """q = r/h at which W is the unit of the artificial pressure, and that value W h^dim.

    ``kernel`` is a PySPH kernel, CubicSpline or WendlandQuintic, and ``hdx`` the smoothing length over the spacing.
    """
    q = DISTANCE / hdx
    return q, boiling_kernel(q, *kernel_coefficients(kernel))


class PBFArtificialPressure(Equation):
    r"""Adds the artificial pressure between fluid particles to the position correction.

    .. math::  \Delta x_i \mathrel{+}= -\frac{\kappa}{\rho_0} \sum_j m_j
               \left(\frac{W_{ij}}{W(0.3\,\Delta x)}\right)^4 \nabla W_{ij}, \qquad \kappa = s\,\Delta t^2

    For equal masses m this is the correction of :class:`PBFPositionCorrection` with
    :math:`\lambda_i + \lambda_j - \kappa m (W_{ij}/W(0.3\,\Delta x))^4` in place of :math:`\lambda_i + \lambda_j`. It
    is equal and opposite in momentum for every pair. As it goes with dt^2, a step of any length causes the same force.

    Source: Macklin & Müller 2013, eqs. 13 and 14, with n = 4. Differs: their k is constant; the reference distance is
    theirs in spacings rather than in h.

    Parameters
    ----------
    rho_rest : float        Summed density of the rest lattice [kg/m^3], > 0.
    kernel : PySPH kernel   CubicSpline or WendlandQuintic.
    hdx : float             Smoothing length over the spacing [-], > 0.
    strength : float        s [m^2/s^2], >= 0.

    Reads    d_h, s_h [m], s_m [kg], positions, constant ``prior`` [-], the time step.
    Writes   d_dpx, d_dpy, d_dpz [m], own index only.
    Needs    PBFPositionCorrection before it in the same group.
    Errors   ValueError if rho_rest <= 0, hdx <= 0 or strength < 0.
    Limits   It acts once in each sweep, so it grows with their number. Walls do not repel. In passes of the sweeps that
    the velocity does not feel (``prior``), there is none.
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
        self.reference, unit = reference_distance(kernel, hdx)
        self.per_unit = float(1.0 / unit)
        self.depth = float(kernel.dim == 3)
        super().__init__(dest, sources)

    def _get_helpers_(self):
        return [boiling_kernel, boiling_kernel_slope]

    def loop_all(self, d_idx, d_x, d_y, d_z, d_h, s_x, s_y, s_z, s_h, s_m, d_dpx, d_dpy, d_dpz, d_prior, NBRS, N_NBRS,
                 dt):
        i = declare('int')
        j = declare('int')
        x = d_x[d_idx]
        y = d_y[d_idx]
        z = d_z[d_idx]
        h = d_h[d_idx]
        px = 0.0
        py = 0.0
        pz = 0.0
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
            px += f * dx
            py += f * dy
            pz += f * dz
        f = self.strength * dt*dt * d_prior[1] / self.rho_rest
        d_dpx[d_idx] -= f * px
        d_dpy[d_idx] -= f * py
        d_dpz[d_idx] -= f * pz

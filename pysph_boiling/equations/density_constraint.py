"""Position Based Fluids: the density constraint, its Lagrange multipliers and the position corrections.

One sweep has three groups: ``[PBFDensity, PBFBoundaryDensity, PBFLambda]``, ``[PBFPositionCorrection,
PBFBoundaryCorrection]`` and ``[PBFMove]``, iterated as sub-groups of one parent. Masses may differ: with the weights
w = 1/m every pair of corrections conserves momentum, ``m_i dx_i + m_j dx_j = 0``. No array moves before the corrections
of all arrays are summed.

In a short step, a density error that existed before the step is corrected separately and without causing a velocity:
``[PBFStepBack]``, ``[PBFDensity, PBFBoundaryDensity]`` and ``[PBFLeftOver]`` measure it before the sweeps. The constant
``prior`` of each array says how the sweeps treat it: the fraction of this error that they correct, the fraction of
their displacements that enters the velocity, and their bounds relative to those of an ordinary step. In ordinary steps
it is (1, 1, 1).

The pressure that follows from the multipliers is only used by the mechanical ledger.
"""
from math import sqrt

from compyle.api import declare
from pysph.base.reduce_array import dummy_reduce_array as parallel_reduce_array  # compiled modules have their own
from pysph.sph.equation import Equation

from pysph_boiling.equations.helpers import boiling_kernel, boiling_kernel_slope, boiling_uniform, kernel_coefficients

__all__ = [
    "PBFBoundaryCorrection", "PBFBoundaryDensity", "PBFDensity", "PBFDensitySwollen", "PBFLambda", "PBFLeftOver",
    "PBFMove", "PBFMoveAccelerated", "PBFPositionCorrection", "PBFPositionCorrectionSwollen", "PBFPressure",
    "PBFStepBack",
]


FEWER = 0.7  # of the tolerance: what the error must stay below with a pair of sweeps less
PATIENCE = 100  # steps in a row in which it must, before a step begins with a pair less


def book_sweep(dst, mean, worst, left, tolerance, sweeps, most):
    """Count a sweep of the array ``dst``, keep its errors, and tell whether it was the last one: bool.

    ``mean`` and ``worst`` [-] are over all particles, ``left`` is the mean of what is to be worked off; the others are
    parameters of :class:`PBFLambda`. Sweeps come in pairs, since a single one can change the sign of a wave's error.
    The number of sweeps sets how much the water is compressed at rest, and so it must not vary there: a step begins
    with as many as the last one, or with a pair less if the error, which is inversely proportional to their number,
    has been well below the tolerance for long.
    """
    dst.density_error[0], dst.density_error[1] = mean, worst
    dst.sweeps[0] += 1.0
    dst.sweeps[1] += 1.0
    left = left / dst.prior[2]
    n, first = dst.sweeps[0], dst.sweeps[0] == dst.sweeps[1]  # the first run in this step
    small = left <= tolerance or (n >= sweeps and left <= most)
    if not small or n % 2.0 or (first and n < min(dst.first_sweeps[0], sweeps)):
        return False
    if first:
        fewer = left * n <= FEWER * tolerance * (n - 2.0)
        dst.first_sweeps[1] = dst.first_sweeps[1] + 1.0 if fewer and n == dst.first_sweeps[0] else 0.0
        dst.first_sweeps[0] = n
        if dst.first_sweeps[1] >= PATIENCE:
            dst.first_sweeps[0], dst.first_sweeps[1] = n - 2.0, 0.0
    return True


class PBFDensity(Equation):
    r"""Summed density and the gradients of the density constraint, from fluid neighbours.

    .. math::  \rho_i = \sum_j m_j W_{ij}, \qquad \nabla_i C_i = \sum_j \frac{m_j}{\rho_0} \nabla W_{ij}

    Source: the paper, eq. 2; Macklin & Müller 2013, eqs. 2 and 8.

    Parameters
    ----------
    rho_rest : float        Summed density of the rest lattice [kg/m^3], > 0.
    kernel : PySPH kernel   CubicSpline or WendlandQuintic.

    Reads    s_m [kg].   Writes   d_rho [kg/m^3], d_gcx, d_gcy, d_gcz [1/m], d_gc2 [1/(kg m^2)], own index only.
    Errors   ValueError if rho_rest <= 0.   Limits   The summed density is too low at a free surface, so C is clamped
    later. With the cubic spline particles form pairs where they are crowded, and everywhere from h/dx = 1.3 on; with
    Wendland's kernel they do not.
    """

    def __init__(self, dest, sources, rho_rest, kernel):
        if not rho_rest > 0.0:
            raise ValueError(f"rho_rest must be > 0 kg/m^3, got {rho_rest}")
        self.rho_rest = float(rho_rest)
        c3, c4, c5, c1 = kernel_coefficients(kernel)
        self.c3 = float(c3)
        self.c4 = float(c4)
        self.c5 = float(c5)
        self.c1 = float(c1)
        self.depth = float(kernel.dim == 3)
        super().__init__(dest, sources)

    def _get_helpers_(self):
        return [boiling_kernel, boiling_kernel_slope]

    def initialize(self, d_idx, d_rho, d_gcx, d_gcy, d_gcz, d_gc2):
        d_rho[d_idx] = 0.0
        d_gcx[d_idx] = 0.0
        d_gcy[d_idx] = 0.0
        d_gcz[d_idx] = 0.0
        d_gc2[d_idx] = 0.0

    def loop_all(self, d_idx, d_x, d_y, d_z, d_h, s_x, s_y, s_z, s_h, s_m, d_rho, d_gcx, d_gcy, d_gcz, d_gc2, NBRS,
                 N_NBRS):
        i = declare('int')
        j = declare('int')
        x = d_x[d_idx]
        y = d_y[d_idx]
        z = d_z[d_idx]
        h = d_h[d_idx]
        rho = 0.0
        gx = 0.0
        gy = 0.0
        gz = 0.0
        gg = 0.0
        for i in range(N_NBRS):
            j = NBRS[i]
            dx = x - s_x[j]
            dy = y - s_y[j]
            dz = z - s_z[j]
            h1 = 2.0 / (h + s_h[j])
            r2 = dx*dx + dy*dy + dz*dz
            q = sqrt(r2) * h1
            m = s_m[j] * h1*h1 * (1.0 + self.depth*(h1 - 1.0))
            rho += m * boiling_kernel(q, self.c3, self.c4, self.c5, self.c1)
            f = m * h1*h1 * boiling_kernel_slope(q, self.c3, self.c4, self.c5, self.c1)
            gx += f * dx
            gy += f * dy
            gz += f * dz
            gg += f*f*r2 / s_m[j]
        f = 1.0 / self.rho_rest
        d_rho[d_idx] += rho
        d_gcx[d_idx] += f * gx
        d_gcy[d_idx] += f * gy
        d_gcz[d_idx] += f * gz
        d_gc2[d_idx] += f * f * gg


class PBFDensitySwollen(Equation):
    r"""As :class:`PBFDensity`, for particles that fill ``swell`` times the volume of the same mass of liquid.

    .. math::  \rho_i = \sum_j s_j m_j W_{ij}, \qquad \nabla_i C_i = \sum_j \frac{s_j m_j}{\rho_0} \nabla W_{ij}

    Source: ours, a number density weighted by volume. The inertia is still that of m: gradients are weighted by 1/m.

    Parameters
    ----------
    rho_rest : float        Summed density of the rest lattice [kg/m^3], > 0.
    kernel : PySPH kernel   CubicSpline or WendlandQuintic.

    Reads    s_m [kg], s_swell [-].   Writes   d_rho [kg/m^3], d_gcx, d_gcy, d_gcz [1/m], d_gc2 [1/(kg m^2)], own index
    only.   Errors   ValueError if rho_rest <= 0.   Limits   The kernel support does not grow, so beyond a swell of
    about 4 (3-D) a particle has too few neighbours for a density.
    """

    def __init__(self, dest, sources, rho_rest, kernel):
        if not rho_rest > 0.0:
            raise ValueError(f"rho_rest must be > 0 kg/m^3, got {rho_rest}")
        self.rho_rest = float(rho_rest)
        c3, c4, c5, c1 = kernel_coefficients(kernel)
        self.c3 = float(c3)
        self.c4 = float(c4)
        self.c5 = float(c5)
        self.c1 = float(c1)
        self.depth = float(kernel.dim == 3)
        super().__init__(dest, sources)

    def _get_helpers_(self):
        return [boiling_kernel, boiling_kernel_slope]

    def initialize(self, d_idx, d_rho, d_gcx, d_gcy, d_gcz, d_gc2):
        d_rho[d_idx] = 0.0
        d_gcx[d_idx] = 0.0
        d_gcy[d_idx] = 0.0
        d_gcz[d_idx] = 0.0
        d_gc2[d_idx] = 0.0

    def loop_all(self, d_idx, d_x, d_y, d_z, d_h, s_x, s_y, s_z, s_h, s_m, s_swell, d_rho, d_gcx, d_gcy, d_gcz, d_gc2,
                 NBRS, N_NBRS):
        i = declare('int')
        j = declare('int')
        x = d_x[d_idx]
        y = d_y[d_idx]
        z = d_z[d_idx]
        h = d_h[d_idx]
        rho = 0.0
        gx = 0.0
        gy = 0.0
        gz = 0.0
        gg = 0.0
        for i in range(N_NBRS):
            j = NBRS[i]
            dx = x - s_x[j]
            dy = y - s_y[j]
            dz = z - s_z[j]
            h1 = 2.0 / (h + s_h[j])
            r2 = dx*dx + dy*dy + dz*dz
            q = sqrt(r2) * h1
            m = s_m[j] * s_swell[j] * h1*h1 * (1.0 + self.depth*(h1 - 1.0))
            rho += m * boiling_kernel(q, self.c3, self.c4, self.c5, self.c1)
            f = m * h1*h1 * boiling_kernel_slope(q, self.c3, self.c4, self.c5, self.c1)
            gx += f * dx
            gy += f * dy
            gz += f * dz
            gg += f*f*r2 / s_m[j]
        f = 1.0 / self.rho_rest
        d_rho[d_idx] += rho
        d_gcx[d_idx] += f * gx
        d_gcy[d_idx] += f * gy
        d_gcz[d_idx] += f * gz
        d_gc2[d_idx] += f * f * gg


class PBFBoundaryDensity(Equation):
    r"""Density and gradient from boundary particles, which do not move and so only contribute to :math:`\nabla_i C_i`.

    Source: Akinci et al. 2012, eq. 6, with psi_b = rho_0 V_b stored as the mass of the boundary particle.

    Parameters
    ----------
    rho_rest : float        Summed density of the rest lattice [kg/m^3], > 0.
    kernel : PySPH kernel   CubicSpline or WendlandQuintic.

    Reads    s_m [kg].   Writes   d_rho [kg/m^3], d_gcx, d_gcy, d_gcz [1/m], own index only.
    Needs    PBFDensity before it in the same group.   Errors   ValueError if rho_rest <= 0.
    """

    def __init__(self, dest, sources, rho_rest, kernel):
        if not rho_rest > 0.0:
            raise ValueError(f"rho_rest must be > 0 kg/m^3, got {rho_rest}")
        self.rho_rest = float(rho_rest)
        c3, c4, c5, c1 = kernel_coefficients(kernel)
        self.c3 = float(c3)
        self.c4 = float(c4)
        self.c5 = float(c5)
        self.c1 = float(c1)
        self.depth = float(kernel.dim == 3)
        super().__init__(dest, sources)

    def _get_helpers_(self):
        return [boiling_kernel, boiling_kernel_slope]

    def loop_all(self, d_idx, d_x, d_y, d_z, d_h, s_x, s_y, s_z, s_h, s_m, d_rho, d_gcx, d_gcy, d_gcz, NBRS, N_NBRS):
        i = declare('int')
        j = declare('int')
        x = d_x[d_idx]
        y = d_y[d_idx]
        z = d_z[d_idx]
        h = d_h[d_idx]
        rho = 0.0
        gx = 0.0
        gy = 0.0
        gz = 0.0
        for i in range(N_NBRS):
            j = NBRS[i]
            dx = x - s_x[j]
            dy = y - s_y[j]
            dz = z - s_z[j]
            h1 = 2.0 / (h + s_h[j])
            r2 = dx*dx + dy*dy + dz*dz
            q = sqrt(r2) * h1
            m = s_m[j] * h1*h1 * (1.0 + self.depth*(h1 - 1.0))
            rho += m * boiling_kernel(q, self.c3, self.c4, self.c5, self.c1)
            f = m * h1*h1 * boiling_kernel_slope(q, self.c3, self.c4, self.c5, self.c1)
            gx += f * dx
            gy += f * dy
            gz += f * dz
        f = 1.0 / self.rho_rest
        d_rho[d_idx] += rho
        d_gcx[d_idx] += f * gx
        d_gcy[d_idx] += f * gy
        d_gcz[d_idx] += f * gz


class PBFLambda(Equation):
    r"""Lagrange multiplier of the density constraint, and the residual that ends the sweeps.

    .. math::  \lambda_i = -\frac{\max(C_i - (1 - p) C^0_i, 0)}{\sum_k w_k |\nabla_k C_i|^2 + \varepsilon},
               \qquad C_i = \max(\rho_i/\rho_0 - 1, 0), \quad w = 1/m

    Source: the paper, eq. 1; Macklin & Müller 2013, eqs. 1 and 11. Differs: C_i is clamped at 0 (free surface), and
    only the fraction p of the error C^0 that existed before the step is corrected.

    Parameters
    ----------
    rho_rest : float         Summed density of the rest lattice [kg/m^3], > 0.
    eps : float              Relaxation [1/(kg m^2)], >= 0; the scheme gives it relative to the rest lattice.
    tolerance : float        The sweeps end when the mean of max(C - (1 - p) C^0, 0) is below this [-], >= 0,
    sweeps : int             or after this number of sweeps, >= 1,
    max_mean_error : float   if that mean is below this bound [-], > 0; in short steps ``prior`` scales the bounds.

    Reads    d_rho [kg/m^3], d_gcx, d_gcy, d_gcz [1/m], d_gc2 [1/(kg m^2)], d_m [kg], d_left_over [-] (C^0), constant
    ``prior`` [-] (p first).
    Writes   d_lmbda [kg m^2], d_compression [-], own index only; constants ``density_error`` (mean, max) [-],
    ``sweeps`` (count in this run of the stage, in this step) and ``first_sweeps`` (least in the next step, steps in a
    row in which fewer would have done) [-].
    Needs    PBFDensity in the same group.
    Errors   ValueError if rho_rest <= 0, eps < 0, tolerance < 0, sweeps < 1 or max_mean_error <= 0.
    Limits   The stiffness depends on the number of sweeps. The error is measured before the correction of the sweep.
    """

    def __init__(self, dest, sources, rho_rest, eps, tolerance, sweeps, max_mean_error):
        if not rho_rest > 0.0:
            raise ValueError(f"rho_rest must be > 0 kg/m^3, got {rho_rest}")
        self.rho_rest = float(rho_rest)
        if not eps >= 0.0:
            raise ValueError(f"eps must be >= 0 1/(kg m^2), got {eps}")
        if not tolerance >= 0.0:
            raise ValueError(f"tolerance must be >= 0, got {tolerance}")
        self.eps = float(eps)
        if not (sweeps >= 1 and max_mean_error > 0.0):
            raise ValueError(f"sweeps must be >= 1 and max_mean_error > 0, got {sweeps} and {max_mean_error}")
        self.tolerance = float(tolerance)
        self.enough = float(sweeps)
        self.max_mean_error = float(max_mean_error)
        self.conv = -1.0
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_rho, d_m, d_gcx, d_gcy, d_gcz, d_gc2, d_left_over, d_prior, d_lmbda,
                  d_compression):
        C = max(d_rho[d_idx] / self.rho_rest - 1.0, 0.0)
        own = (d_gcx[d_idx]*d_gcx[d_idx] + d_gcy[d_idx]*d_gcy[d_idx] + d_gcz[d_idx]*d_gcz[d_idx]) / d_m[d_idx]
        d_compression[d_idx] = C
        C = C - (1.0 - d_prior[0]) * d_left_over[d_idx]
        if C > 0.0:
            d_lmbda[d_idx] = -C / (own + d_gc2[d_idx] + self.eps)
        else:
            d_lmbda[d_idx] = 0.0

    def reduce(self, dst, t, dt):
        # here: compiled modules see no imports of ours
        from pysph_boiling.device import largest, positive, summed, values
        from pysph_boiling.equations.density_constraint import book_sweep

        n = max(parallel_reduce_array(float(dst.get_number_of_particles(True)), 'sum'), 1.0)
        mean = parallel_reduce_array(summed(values(dst, 'compression')), 'sum') / n
        worst = parallel_reduce_array(largest(values(dst, 'compression')), 'max')
        left = mean
        if dst.prior[0] < 1.0:
            total = summed(positive(values(dst, 'compression') - (1.0 - dst.prior[0]) * values(dst, 'left_over')))
            left = parallel_reduce_array(total, 'sum') / n
        self.conv = -1.0
        if book_sweep(dst, mean, worst, left, self.tolerance, self.enough, self.max_mean_error):
            self.conv = 1.0

    def converged(self):
        return self.conv


class PBFStepBack(Equation):
    r"""Moves particles back to the start of the step, :math:`x = x^* - s`; the displacement s is stored.

    Source: ours.   Reads   d_sx, d_sy, d_sz [m].   Writes   d_x, d_y, d_z, d_dpx, d_dpy, d_dpz [m], own index only.
    Limits   In single precision x^n is exact to 1e-7 x, which in a step of 1e-6 s is an error of .1 x per second.
    """

    def post_loop(self, d_idx, d_x, d_y, d_z, d_sx, d_sy, d_sz, d_dpx, d_dpy, d_dpz):
        d_dpx[d_idx] = d_sx[d_idx]
        d_dpy[d_idx] = d_sy[d_idx]
        d_dpz[d_idx] = d_sz[d_idx]
        d_x[d_idx] -= d_sx[d_idx]
        d_y[d_idx] -= d_sy[d_idx]
        d_z[d_idx] -= d_sz[d_idx]


class PBFLeftOver(Equation):
    r"""Stores the density error from before the step, and moves particles to the predicted positions again.

    .. math::  C^0_i = \max(\rho_i(x^n)/\rho_0 - 1, 0), \qquad x^* = x^n + s

    Source: ours; the idea to correct such errors without causing a velocity is from Macklin et al. 2014, section 4.4.

    Parameters
    ----------
    rho_rest : float   Summed density of the rest lattice [kg/m^3], > 0.

    Reads    d_rho [kg/m^3], d_dpx, d_dpy, d_dpz [m] (s).
    Writes   d_left_over [-], d_x, d_y, d_z, d_sx, d_sy, d_sz [m], own index only.
    Needs   PBFStepBack and PBFDensity in earlier groups.   Errors   ValueError if rho_rest <= 0.
    Limits   If a container has moved x^n, x* moves by the same distance, which does not enter the velocity. The
    neighbours are those of x*; particles that were neighbours at x^n only are not found.
    """

    def __init__(self, dest, sources, rho_rest):
        if not rho_rest > 0.0:
            raise ValueError(f"rho_rest must be > 0 kg/m^3, got {rho_rest}")
        self.rho_rest = float(rho_rest)
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_rho, d_left_over, d_x, d_y, d_z, d_sx, d_sy, d_sz, d_dpx, d_dpy, d_dpz):
        d_left_over[d_idx] = max(d_rho[d_idx] / self.rho_rest - 1.0, 0.0)
        d_sx[d_idx] = d_dpx[d_idx]
        d_sy[d_idx] = d_dpy[d_idx]
        d_sz[d_idx] = d_dpz[d_idx]
        d_x[d_idx] += d_dpx[d_idx]
        d_y[d_idx] += d_dpy[d_idx]
        d_z[d_idx] += d_dpz[d_idx]


class PBFPositionCorrection(Equation):
    r"""Position correction from fluid neighbours, equal and opposite in momentum for every pair.

    .. math::  \Delta x_i = \frac{w_i}{\rho_0} \sum_j (m_j \lambda_i + m_i \lambda_j) \nabla W_{ij}

    Source: Macklin & Müller 2013, eq. 12, for any masses. Differs: two particles at the same position have no gradient
    and would never separate, so they are moved apart by ``nudge`` in a direction that is hashed from their uids.

    Parameters
    ----------
    rho_rest : float        Summed density of the rest lattice [kg/m^3], > 0.
    kernel : PySPH kernel   CubicSpline or WendlandQuintic; in 2-D the hashed direction stays in the plane.
    nudge : float           Displacement that separates coincident particles [m], >= 0; multiplied by ``prior``.

    Reads    d_lmbda, s_lmbda [kg m^2], d_m, s_m [kg], d_uid, s_uid, constant ``prior`` [-].
    Writes   d_dpx, d_dpy, d_dpz [m], own index only.
    Needs    PBFLambda in an earlier group.   Errors   ValueError if rho_rest <= 0.
    """

    def __init__(self, dest, sources, rho_rest, kernel, nudge):
        if not rho_rest > 0.0:
            raise ValueError(f"rho_rest must be > 0 kg/m^3, got {rho_rest}")
        self.rho_rest = float(rho_rest)
        c3, c4, c5, c1 = kernel_coefficients(kernel)
        self.c3 = float(c3)
        self.c4 = float(c4)
        self.c5 = float(c5)
        self.c1 = float(c1)
        self.depth = float(kernel.dim == 3)
        self.nudge = float(nudge)
        super().__init__(dest, sources)

    def _get_helpers_(self):
        return [boiling_kernel_slope, boiling_uniform]

    def initialize(self, d_idx, d_dpx, d_dpy, d_dpz):
        d_dpx[d_idx] = 0.0
        d_dpy[d_idx] = 0.0
        d_dpz[d_idx] = 0.0

    def loop_all(self, d_idx, d_x, d_y, d_z, d_h, s_x, s_y, s_z, s_h, d_dpx, d_dpy, d_dpz, d_lmbda, s_lmbda, d_m, s_m,
                 d_uid, s_uid, d_prior, NBRS, N_NBRS):
        i = declare('int')
        j = declare('int')
        low = declare('unsigned int')
        high = declare('unsigned int')
        x = d_x[d_idx]
        y = d_y[d_idx]
        z = d_z[d_idx]
        h = d_h[d_idx]
        m = d_m[d_idx]
        lmbda = d_lmbda[d_idx]
        px = 0.0
        py = 0.0
        pz = 0.0
        here = 0.0
        for i in range(N_NBRS):
            j = NBRS[i]
            dx = x - s_x[j]
            dy = y - s_y[j]
            dz = z - s_z[j]
            h1 = 2.0 / (h + s_h[j])
            r2 = dx*dx + dy*dy + dz*dz
            q = sqrt(r2) * h1
            f = (s_m[j]*lmbda + m*s_lmbda[j]) * h1*h1*h1*h1 * (1.0 + self.depth*(h1 - 1.0))
            f = f * boiling_kernel_slope(q, self.c3, self.c4, self.c5, self.c1)
            px += f * dx
            py += f * dy
            pz += f * dz
            here += max(1.0 - 1e6*q, 0.0)
        f = 1.0 / (d_m[d_idx]*self.rho_rest)
        d_dpx[d_idx] += f * px
        d_dpy[d_idx] += f * py
        d_dpz[d_idx] += f * pz
        if here > 1.0:
            for i in range(N_NBRS):
                j = NBRS[i]
                dx = x - s_x[j]
                dy = y - s_y[j]
                dz = z - s_z[j]
                if 2.0*sqrt(dx*dx + dy*dy + dz*dz) < 1e-6*(h + s_h[j]):
                    if d_uid[d_idx] != s_uid[j]:
                        low = d_uid[d_idx]
                        high = s_uid[j]
                        f = self.nudge * d_prior[0]
                        if low > high:
                            low = s_uid[j]
                            high = d_uid[d_idx]
                            f = -f
                        f = f * 2.0*s_m[j] / (d_m[d_idx] + s_m[j])
                        d_dpx[d_idx] += f * boiling_uniform(low, high)
                        d_dpy[d_idx] += f * boiling_uniform(high, low)
                        d_dpz[d_idx] += f * self.depth * boiling_uniform(low, high + 1013)


class PBFPositionCorrectionSwollen(Equation):
    r"""As :class:`PBFPositionCorrection`, for particles that fill ``swell`` times the volume of their liquid.

    .. math::  \Delta x_i = \frac{w_i}{\rho_0} \sum_j (s_j m_j \lambda_i + s_i m_i \lambda_j) \nabla W_{ij}

    Source: Macklin & Müller 2013, eq. 12, with the gradients of :class:`PBFDensitySwollen`.

    Parameters
    ----------
    rho_rest, kernel, nudge   As :class:`PBFPositionCorrection`.

    Reads    d_lmbda, s_lmbda [kg m^2], d_m, s_m [kg], d_swell, s_swell [-], d_uid, s_uid, constant ``prior`` [-].
    Writes   d_dpx, d_dpy, d_dpz [m], own index only.
    Needs    PBFLambda in an earlier group.   Errors   ValueError if rho_rest <= 0.
    """

    def __init__(self, dest, sources, rho_rest, kernel, nudge):
        if not rho_rest > 0.0:
            raise ValueError(f"rho_rest must be > 0 kg/m^3, got {rho_rest}")
        self.rho_rest = float(rho_rest)
        c3, c4, c5, c1 = kernel_coefficients(kernel)
        self.c3 = float(c3)
        self.c4 = float(c4)
        self.c5 = float(c5)
        self.c1 = float(c1)
        self.depth = float(kernel.dim == 3)
        self.nudge = float(nudge)
        super().__init__(dest, sources)

    def _get_helpers_(self):
        return [boiling_kernel_slope, boiling_uniform]

    def initialize(self, d_idx, d_dpx, d_dpy, d_dpz):
        d_dpx[d_idx] = 0.0
        d_dpy[d_idx] = 0.0
        d_dpz[d_idx] = 0.0

    def loop_all(self, d_idx, d_x, d_y, d_z, d_h, s_x, s_y, s_z, s_h, d_dpx, d_dpy, d_dpz, d_lmbda, s_lmbda, d_m, s_m,
                 d_swell, s_swell, d_uid, s_uid, d_prior, NBRS, N_NBRS):
        i = declare('int')
        j = declare('int')
        low = declare('unsigned int')
        high = declare('unsigned int')
        x = d_x[d_idx]
        y = d_y[d_idx]
        z = d_z[d_idx]
        h = d_h[d_idx]
        m = d_m[d_idx] * d_swell[d_idx]
        lmbda = d_lmbda[d_idx]
        px = 0.0
        py = 0.0
        pz = 0.0
        here = 0.0
        for i in range(N_NBRS):
            j = NBRS[i]
            dx = x - s_x[j]
            dy = y - s_y[j]
            dz = z - s_z[j]
            h1 = 2.0 / (h + s_h[j])
            r2 = dx*dx + dy*dy + dz*dz
            q = sqrt(r2) * h1
            f = (s_m[j]*s_swell[j]*lmbda + m*s_lmbda[j]) * h1*h1*h1*h1 * (1.0 + self.depth*(h1 - 1.0))
            f = f * boiling_kernel_slope(q, self.c3, self.c4, self.c5, self.c1)
            px += f * dx
            py += f * dy
            pz += f * dz
            here += max(1.0 - 1e6*q, 0.0)
        f = 1.0 / (d_m[d_idx]*self.rho_rest)
        d_dpx[d_idx] += f * px
        d_dpy[d_idx] += f * py
        d_dpz[d_idx] += f * pz
        if here > 1.0:
            for i in range(N_NBRS):
                j = NBRS[i]
                dx = x - s_x[j]
                dy = y - s_y[j]
                dz = z - s_z[j]
                if 2.0*sqrt(dx*dx + dy*dy + dz*dz) < 1e-6*(h + s_h[j]):
                    if d_uid[d_idx] != s_uid[j]:
                        low = d_uid[d_idx]
                        high = s_uid[j]
                        f = self.nudge * d_prior[0]
                        if low > high:
                            low = s_uid[j]
                            high = d_uid[d_idx]
                            f = -f
                        f = f * 2.0*s_m[j] / (d_m[d_idx] + s_m[j])
                        d_dpx[d_idx] += f * boiling_uniform(low, high)
                        d_dpy[d_idx] += f * boiling_uniform(high, low)
                        d_dpz[d_idx] += f * self.depth * boiling_uniform(low, high + 1013)


class PBFBoundaryCorrection(Equation):
    r"""Position correction from boundary particles, which have no multipliers.

    .. math::  \Delta x_i \mathrel{+}= \frac{w_i}{\rho_0} \sum_b \psi_b \lambda_i \nabla W_{ib}

    Source: Akinci et al. 2012 (psi_b); Macklin & Müller 2013, eq. 12.

    Parameters
    ----------
    rho_rest : float        Summed density of the rest lattice [kg/m^3], > 0.
    kernel : PySPH kernel   CubicSpline or WendlandQuintic.

    Reads    d_lmbda [kg m^2], d_m, s_m [kg].   Writes   d_dpx, d_dpy, d_dpz [m], own index only.
    Needs    PBFPositionCorrection before it in the same group.   Errors   ValueError if rho_rest <= 0.
    """

    def __init__(self, dest, sources, rho_rest, kernel):
        if not rho_rest > 0.0:
            raise ValueError(f"rho_rest must be > 0 kg/m^3, got {rho_rest}")
        self.rho_rest = float(rho_rest)
        c3, c4, c5, c1 = kernel_coefficients(kernel)
        self.c3 = float(c3)
        self.c4 = float(c4)
        self.c5 = float(c5)
        self.c1 = float(c1)
        self.depth = float(kernel.dim == 3)
        super().__init__(dest, sources)

    def _get_helpers_(self):
        return [boiling_kernel_slope]

    def loop_all(self, d_idx, d_x, d_y, d_z, d_h, s_x, s_y, s_z, s_h, d_dpx, d_dpy, d_dpz, d_lmbda, d_m, s_m, NBRS,
                 N_NBRS):
        i = declare('int')
        j = declare('int')
        x = d_x[d_idx]
        y = d_y[d_idx]
        z = d_z[d_idx]
        h = d_h[d_idx]
        lmbda = d_lmbda[d_idx]
        px = 0.0
        py = 0.0
        pz = 0.0
        for i in range(N_NBRS):
            j = NBRS[i]
            dx = x - s_x[j]
            dy = y - s_y[j]
            dz = z - s_z[j]
            h1 = 2.0 / (h + s_h[j])
            r2 = dx*dx + dy*dy + dz*dz
            q = sqrt(r2) * h1
            f = s_m[j]*lmbda * h1*h1*h1*h1 * (1.0 + self.depth*(h1 - 1.0))
            f = f * boiling_kernel_slope(q, self.c3, self.c4, self.c5, self.c1)
            px += f * dx
            py += f * dy
            pz += f * dz
        f = 1.0 / (d_m[d_idx]*self.rho_rest)
        d_dpx[d_idx] += f * px
        d_dpy[d_idx] += f * py
        d_dpz[d_idx] += f * pz


class PBFMove(Equation):
    r"""Applies the correction, :math:`x^* \leftarrow x^* + \omega\,\Delta x`, up to a length of ``max_displacement``.

    Source: the paper, Algorithm 1 line 24. Differs: the displacement is limited, and limited corrections are counted.

    Parameters
    ----------
    omega : float              Under-relaxation [-], in (0, 1].
    max_displacement : float   Largest displacement in one sweep [m], > 0.

    Reads    d_dpx, d_dpy, d_dpz [m], d_lmbda [kg m^2], constant ``prior`` [-].
    Writes   d_x, d_y, d_z, d_sx, d_sy, d_sz [m], d_impulse (sum of omega lmbda over the sweeps of a step) [kg m^2],
    d_limited, own index only.   Needs   all corrections in an earlier group.
    Errors   ValueError if omega is not in (0, 1] or max_displacement <= 0.
    Limits   A limited correction does not conserve momentum; the column ``n_limited`` of the results counts them.
    """

    def __init__(self, dest, sources, omega, max_displacement):
        if not 0.0 < omega <= 1.0:
            raise ValueError(f"omega must lie in (0, 1], got {omega}")
        if not max_displacement > 0.0:
            raise ValueError(f"max_displacement must be > 0 m, got {max_displacement} m")
        self.omega = float(omega)
        self.max_displacement = float(max_displacement)
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_x, d_y, d_z, d_sx, d_sy, d_sz, d_dpx, d_dpy, d_dpz, d_lmbda, d_impulse, d_prior,
                  d_limited):
        d_impulse[d_idx] += d_prior[1] * self.omega * d_lmbda[d_idx]
        f = self.omega
        size = f * sqrt(d_dpx[d_idx]*d_dpx[d_idx] + d_dpy[d_idx]*d_dpy[d_idx] + d_dpz[d_idx]*d_dpz[d_idx])
        if size > self.max_displacement:
            f = f * self.max_displacement / size
            d_limited[d_idx] += 1
        d_x[d_idx] += f * d_dpx[d_idx]
        d_y[d_idx] += f * d_dpy[d_idx]
        d_z[d_idx] += f * d_dpz[d_idx]
        f = f * d_prior[1]
        d_sx[d_idx] += f * d_dpx[d_idx]
        d_sy[d_idx] += f * d_dpy[d_idx]
        d_sz[d_idx] += f * d_dpz[d_idx]


class PBFMoveAccelerated(Equation):
    r"""As :class:`PBFMove`, accelerated with the displacement of the sweep before: the Chebyshev semi-iteration.

    .. math::  d^{k+1} = \beta_k \omega\,\Delta x + (\beta_k - 1)\, d^k, \qquad
               \beta_k = 1,\ \frac{2}{2 - \varrho^2},\ \frac{4}{4 - \varrho^2 \beta_{k-1}}, \dots

    Source: Wang 2015, "A Chebyshev semi-iterative approach for accelerating projective and position-based dynamics",
    section 4. Differs: the weights are reset when the mean density error grows from one sweep to the next.

    Parameters
    ----------
    omega, max_displacement : float   As :class:`PBFMove`.
    radius : float                    Estimate of the spectral radius of a plain sweep [-], in (0, 1).
    delay : int                       Plain sweeps before the first accelerated one, also after a reset, >= 1.

    Reads    d_dpx, d_dpy, d_dpz [m], constants ``sweep_weight`` (weight, last mean error, plain sweeps done) [-],
    ``density_error`` and ``prior``.   Writes   d_x .. d_z, d_sx .. d_sz [m], d_qx, d_qy, d_qz [m] (the last
    displacement), d_q_lmbda (its multiplier) and d_impulse (their sum over a step) [kg m^2], d_limited, own index only;
    ``sweep_weight``.
    Needs    all corrections in an earlier group; ``sweep_weight`` = (1, inf, 0) when the sweeps begin.
    Errors   ValueError if a parameter is out of range.   Limits   as :class:`PBFMove`.
    """

    def __init__(self, dest, sources, omega, max_displacement, radius, delay):
        if not 0.0 < omega <= 1.0:
            raise ValueError(f"omega must lie in (0, 1], got {omega}")
        if not max_displacement > 0.0:
            raise ValueError(f"max_displacement must be > 0 m, got {max_displacement} m")
        if not 0.0 < radius < 1.0:
            raise ValueError(f"radius must lie in (0, 1), got {radius}")
        if not delay >= 1:
            raise ValueError(f"delay must be >= 1, got {delay}")
        self.omega = float(omega)
        self.max_displacement = float(max_displacement)
        self.radius = float(radius)
        self.delay = float(delay)
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_x, d_y, d_z, d_sx, d_sy, d_sz, d_dpx, d_dpy, d_dpz, d_qx, d_qy, d_qz, d_q_lmbda,
                  d_lmbda, d_impulse, d_limited, d_sweep_weight, d_prior):
        carried = d_sweep_weight[0] - 1.0
        f = self.omega * d_sweep_weight[0]
        d_q_lmbda[d_idx] = f * d_lmbda[d_idx] + carried * d_q_lmbda[d_idx]
        d_impulse[d_idx] += d_prior[1] * d_q_lmbda[d_idx]
        qx = f * d_dpx[d_idx] + carried * d_qx[d_idx]
        qy = f * d_dpy[d_idx] + carried * d_qy[d_idx]
        qz = f * d_dpz[d_idx] + carried * d_qz[d_idx]
        size = sqrt(qx*qx + qy*qy + qz*qz)
        f = 1.0
        if size > self.max_displacement:
            f = self.max_displacement / size
            d_limited[d_idx] += 1
        d_qx[d_idx] = f * qx
        d_qy[d_idx] = f * qy
        d_qz[d_idx] = f * qz
        d_x[d_idx] += f * qx
        d_y[d_idx] += f * qy
        d_z[d_idx] += f * qz
        f = f * d_prior[1]
        d_sx[d_idx] += f * qx
        d_sy[d_idx] += f * qy
        d_sz[d_idx] += f * qz

    def reduce(self, dst, t, dt):
        weight = dst.sweep_weight[0]
        plain = dst.sweep_weight[2] + 1.0
        if dst.density_error[0] > dst.sweep_weight[1]:
            plain = 0.0
        if plain < self.delay:
            weight = 1.0
        elif weight == 1.0:
            weight = 2.0 / (2.0 - self.radius*self.radius)
        else:
            weight = 4.0 / (4.0 - self.radius*self.radius*weight)
        dst.sweep_weight[0] = weight
        dst.sweep_weight[1] = dst.density_error[0]
        dst.sweep_weight[2] = plain
        if dst.gpu is not None:
            dst.gpu.push('sweep_weight')


class PBFPressure(Equation):
    r"""Pressure of the density constraint on a particle, from the multipliers of all sweeps of a step.

    .. math::  p_i = -\frac{\rho_0}{\rho_\text{rest}\,\Delta t^2} \sum_j \Lambda_j W_{ij},
               \qquad \Lambda_j = \sum_\text{sweeps} \omega \lambda_j

    A step that begins with multipliers (``lmbda_start``) has them in its sum.

    The sweeps move particles by :math:`w_i \sum_j \Lambda_j \nabla_i C_j`, which corresponds to the force
    :math:`\sum_j \Lambda_j \nabla_i C_j / \Delta t^2`. If C does not change while the swells s change by ds, the work
    of this force on the motion is :math:`-\sum_j \Lambda_j\, \partial_s C_j\, ds/\Delta t^2`, which equals
    :math:`\sum_i p_i\, dV_i` with :math:`V_i = s_i m_i/\rho_0`.

    Source: ours, from the principle of virtual work.

    Parameters
    ----------
    rho0 : float       Rest density [kg/m^3], > 0.
    rho_rest : float   Summed density of the rest lattice [kg/m^3], > 0.

    Reads    s_impulse (Lambda) [kg m^2], the time step.   Writes   d_pressure [Pa], own index only.
    Errors   ValueError if rho0 <= 0 or rho_rest <= 0.   Limits   Walls have no multipliers. A limited correction
    (``n_limited``) counts in full.
    """

    def __init__(self, dest, sources, rho0, rho_rest):
        if not (rho0 > 0.0 and rho_rest > 0.0):
            raise ValueError(f"rho0 and rho_rest must be > 0 kg/m^3, got {rho0} and {rho_rest}")
        self.share = float(rho0 / rho_rest)
        super().__init__(dest, sources)

    def initialize(self, d_idx, d_pressure):
        d_pressure[d_idx] = 0.0

    def loop(self, d_idx, s_idx, d_pressure, s_impulse, WIJ):
        d_pressure[d_idx] -= s_impulse[s_idx] * WIJ

    def post_loop(self, d_idx, d_pressure, dt):
        d_pressure[d_idx] *= self.share / max(dt*dt, 1e-300)

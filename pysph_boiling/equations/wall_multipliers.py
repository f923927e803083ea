"""Multipliers of walls: a wall takes up the pressure of the fluid before it, and pushes with it."""
from pysph.sph.equation import Equation

__all__ = ["PBFWallCorrection", "PBFWallMultiplier", "PBFWallStart", "PBFWallWarmStart"]


class PBFWallMultiplier(Equation):
    r"""Multiplier per mass of a boundary particle, the mean of those of the fluid near it.

    .. math::  \mu_b = \frac{\sum_j \lambda_j W_{bj}}{\sum_j m_j W_{bj}}

    Source: Adami, Hu & Adams 2012, eq. 27, for multipliers in place of pressures. Differs: without the hydrostatic
    term, which is rho g times the distance of the two. The multiplier per mass of a fluid particle is
    :math:`\lambda_j/m_j`; it is to the density constraint what the pressure is to the equation of motion.

    Reads    s_lmbda [kg m^2], s_m [kg].   Writes   d_wall_lmbda [m^2], d_wall_weight [kg/m^3], own index only.
    Needs    PBFLambda in an earlier group.   Limits   0 where no fluid is near.
    """

    def initialize(self, d_idx, d_wall_lmbda, d_wall_weight):
        d_wall_lmbda[d_idx] = 0.0
        d_wall_weight[d_idx] = 0.0

    def loop(self, d_idx, s_idx, d_wall_lmbda, d_wall_weight, s_lmbda, s_m, WIJ):
        d_wall_lmbda[d_idx] += s_lmbda[s_idx] * WIJ
        d_wall_weight[d_idx] += s_m[s_idx] * WIJ

    def post_loop(self, d_idx, d_wall_lmbda, d_wall_weight):
        if d_wall_weight[d_idx] > 0.0:
            d_wall_lmbda[d_idx] = d_wall_lmbda[d_idx] / d_wall_weight[d_idx]


class PBFWallCorrection(Equation):
    r"""Position correction from the multipliers of boundary particles.

    .. math::  \Delta x_i \mathrel{+}= \frac{1}{\rho_0} \sum_b \psi_b\, \mu_b \nabla W_{ib}

    With that of :class:`PBFBoundaryCorrection` it is what a fluid particle of the mass psi_b and the multiplier
    psi_b mu_b would do there.

    Source: Macklin & Müller 2013, eq. 12; Akinci et al. 2012 (psi_b).

    Parameters
    ----------
    rho_rest : float   Summed density of the rest lattice [kg/m^3], > 0.

    Reads    s_wall_lmbda [m^2], s_m (psi_b) [kg].   Writes   d_dpx, d_dpy, d_dpz [m], own index only.
    Needs    PBFWallMultiplier in an earlier group, PBFPositionCorrection before it in the same one.
    Errors   ValueError if rho_rest <= 0.   Limits   It pushes swollen vapour as it pushes liquid.
    """

    def __init__(self, dest, sources, rho_rest):
        if not rho_rest > 0.0:
            raise ValueError(f"rho_rest must be > 0 kg/m^3, got {rho_rest}")
        self.rho_rest = float(rho_rest)
        super().__init__(dest, sources)

    def loop(self, d_idx, s_idx, d_dpx, d_dpy, d_dpz, s_wall_lmbda, s_m, DWIJ):
        f = s_m[s_idx] * s_wall_lmbda[s_idx] / self.rho_rest
        d_dpx[d_idx] += f * DWIJ[0]
        d_dpy[d_idx] += f * DWIJ[1]
        d_dpz[d_idx] += f * DWIJ[2]


class PBFWallStart(Equation):
    r"""As :class:`PBFWallMultiplier`, of the multipliers with which the next step begins.

    .. math::  \mu^s_b = \frac{\sum_j \lambda^s_j W_{bj}}{\sum_j m_j W_{bj}}

    Source: there.   Reads   s_lmbda_start [J], s_m [kg].   Writes   d_wall_start [m^2/s^2], d_wall_weight [kg/m^3], own
    index only.   Limits   0 where no fluid is near.
    """

    def initialize(self, d_idx, d_wall_start, d_wall_weight):
        d_wall_start[d_idx] = 0.0
        d_wall_weight[d_idx] = 0.0

    def loop(self, d_idx, s_idx, d_wall_start, d_wall_weight, s_lmbda_start, s_m, WIJ):
        d_wall_start[d_idx] += s_lmbda_start[s_idx] * WIJ
        d_wall_weight[d_idx] += s_m[s_idx] * WIJ

    def post_loop(self, d_idx, d_wall_start, d_wall_weight):
        if d_wall_weight[d_idx] > 0.0:
            d_wall_start[d_idx] = d_wall_start[d_idx] / d_wall_weight[d_idx]


class PBFWallWarmStart(Equation):
    r"""Acceleration by the multipliers of walls with which the next step begins.

    .. math::  a_i = \frac{1}{\rho_0} \sum_b \psi_b\, \mu^s_b \nabla W_{ib}

    It is the correction of :class:`PBFWallCorrection` over dt^2, and goes with :class:`PBFBoundaryWarmStart`.

    Source: there.

    Parameters
    ----------
    rho_rest : float   Summed density of the rest lattice [kg/m^3], > 0.

    Reads    s_wall_start [m^2/s^2], s_m (psi_b) [kg].   Writes   d_au, d_av, d_aw [m/s^2], own index only.
    Needs    PBFWallStart in an earlier group.   Errors   ValueError if rho_rest <= 0.   Limits   as there.
    """

    def __init__(self, dest, sources, rho_rest):
        if not rho_rest > 0.0:
            raise ValueError(f"rho_rest must be > 0 kg/m^3, got {rho_rest}")
        self.rho_rest = float(rho_rest)
        super().__init__(dest, sources)

    def loop(self, d_idx, s_idx, d_au, d_av, d_aw, s_wall_start, s_m, DWIJ):
        f = s_m[s_idx] * s_wall_start[s_idx] / self.rho_rest
        d_au[d_idx] += f * DWIJ[0]
        d_av[d_idx] += f * DWIJ[1]
        d_aw[d_idx] += f * DWIJ[2]

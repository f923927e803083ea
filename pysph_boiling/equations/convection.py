"""Convection of liquid: two forms of a force on hot liquid, whose density does not change in the model."""
from math import sqrt

from pysph.sph.equation import Equation

__all__ = ["ConvectionBoussinesq", "ConvectionGradient"]


class ConvectionBoussinesq(Equation):
    r"""Buoyancy of liquid that is warmer than the reference, :math:`a = -\beta (T - T_{ref})\, g`.

    Source: the Boussinesq approximation; the paper, section 3.3.1, mentions convection without a formula.

    Parameters
    ----------
    beta : float         Thermal expansion coefficient [1/K], >= 0.
    k_liquid_min : float        A particle with k >= k_liquid_min is liquid [W/(m K)], > 0.
    gx, gy, gz : float   Gravity [m/s^2].

    Reads    d_T [K], d_k [W/(m K)], constant convection_T [K].   Writes   d_au, d_av, d_aw [m/s^2], own index only.
    Errors   ValueError if beta < 0.   Limits   The density itself stays rho_0.
    """

    def __init__(self, dest, sources, beta, k_liquid_min, gx=0.0, gy=0.0, gz=0.0):
        if not beta >= 0.0:
            raise ValueError(f"beta must be >= 0 1/K, got {beta}")
        self.k_liquid_min = float(k_liquid_min)
        self.bx = -float(beta) * float(gx)
        self.by = -float(beta) * float(gy)
        self.bz = -float(beta) * float(gz)
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_T, d_k, d_convection_T, d_au, d_av, d_aw):
        if d_k[d_idx] >= self.k_liquid_min:
            f = d_T[d_idx] - d_convection_T[0]
            d_au[d_idx] += f * self.bx
            d_av[d_idx] += f * self.by
            d_aw[d_idx] += f * self.bz


class ConvectionGradient(Equation):
    r"""Acceleration of liquid from hot to cold, limited to ``largest``.

    .. math::  a_i = -c\, \nabla T_i, \qquad \nabla T_i = \sum_j \frac{m_j}{\rho_0} (T_j - T_i) \nabla W_{ij}

    Source: the paper, section 3.3.1, after Gu et al.: particles follow the cumulative temperature gradient. The gain c
    and the cap are ours; the sum runs over liquid neighbours.

    Parameters
    ----------
    gain : float      c [m^2/(s^2 K)], >= 0.
    largest : float   Largest acceleration [m/s^2], >= 0.
    rho0 : float      Rest density [kg/m^3], > 0.
    k_liquid_min : float     A particle with k >= k_liquid_min is liquid [W/(m K)], > 0.

    Reads    d_T, s_T [K], d_k, s_k [W/(m K)], s_m [kg].   Writes   d_gTx, d_gTy, d_gTz [K/m], d_au, d_av, d_aw [m/s^2],
    own index only.   Errors   ValueError if gain < 0 or rho0 <= 0.
    Limits   A gradient of a field is balanced by a pressure, so convection rolls only form where the cap acts.
    """

    def __init__(self, dest, sources, gain, largest, rho0, k_liquid_min):
        if not gain >= 0.0:
            raise ValueError(f"gain of the convection must be >= 0 m^2/(s^2 K), got {gain}")
        if not rho0 > 0.0:
            raise ValueError(f"rho0 must be > 0 kg/m^3, got {rho0}")
        self.gain = float(gain)
        self.largest = float(largest)
        self.rho0 = float(rho0)
        self.k_liquid_min = float(k_liquid_min)
        super().__init__(dest, sources)

    def initialize(self, d_idx, d_gTx, d_gTy, d_gTz):
        d_gTx[d_idx] = 0.0
        d_gTy[d_idx] = 0.0
        d_gTz[d_idx] = 0.0

    def loop(self, d_idx, s_idx, d_gTx, d_gTy, d_gTz, d_T, s_T, s_k, s_m, DWIJ):
        if s_k[s_idx] >= self.k_liquid_min:
            f = s_m[s_idx] / self.rho0 * (s_T[s_idx] - d_T[d_idx])
            d_gTx[d_idx] += f * DWIJ[0]
            d_gTy[d_idx] += f * DWIJ[1]
            d_gTz[d_idx] += f * DWIJ[2]

    def post_loop(self, d_idx, d_k, d_gTx, d_gTy, d_gTz, d_au, d_av, d_aw):
        if d_k[d_idx] >= self.k_liquid_min:
            size = sqrt(d_gTx[d_idx]*d_gTx[d_idx] + d_gTy[d_idx]*d_gTy[d_idx] + d_gTz[d_idx]*d_gTz[d_idx])
            f = self.gain
            if f * size > self.largest:
                f = self.largest / size
            d_au[d_idx] -= f * d_gTx[d_idx]
            d_av[d_idx] -= f * d_gTy[d_idx]
            d_aw[d_idx] -= f * d_gTz[d_idx]

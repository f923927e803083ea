"""Body force, XSPH viscosity and wall friction, which do not depend on boiling."""
from pysph.sph.equation import Equation

__all__ = ["PBFBodyForce", "PBFWallFriction", "PBFXSPHViscosity"]


class PBFBodyForce(Equation):
    r"""Uniform acceleration; it also resets the acceleration and must come first in the force stage.

    Source: the paper, Algorithm 1 line 17.

    Parameters
    ----------
    gx, gy, gz : float   Acceleration [m/s^2].

    Reads nothing.   Writes   d_au, d_av, d_aw [m/s^2], own index only.
    """

    def __init__(self, dest, sources, gx=0.0, gy=0.0, gz=0.0):
        self.gx = float(gx)
        self.gy = float(gy)
        self.gz = float(gz)
        super().__init__(dest, sources)

    def initialize(self, d_idx, d_au, d_av, d_aw):
        d_au[d_idx] = self.gx
        d_av[d_idx] = self.gy
        d_aw[d_idx] = self.gz


class PBFXSPHViscosity(Equation):
    r"""XSPH viscosity as an acceleration, so that its strength does not depend on the time step.

    .. math::  a_i = r \sum_j \frac{m_j}{\rho_0} (v_j - v_i) W_{ij}

    Source: Schechter & Bridson 2012, used by Macklin & Müller 2013, eq. 17 (there once per step, with c = r dt). It is
    antisymmetric in m a for any masses.

    Parameters
    ----------
    rate : float   Rate at which velocity differences decay [1/s], >= 0.
    rho0 : float   Rest density [kg/m^3], > 0.

    Reads    d_u .. d_w, s_u .. s_w [m/s], s_m [kg].   Writes   d_au, d_av, d_aw [m/s^2], own index only.
    Errors   ValueError if rate < 0 or rho0 <= 0.   Limits   Explicit: rate dt must stay below 1 (schemes split steps).
    """

    def __init__(self, dest, sources, rate, rho0):
        if not rate >= 0.0:
            raise ValueError(f"rate must be >= 0 1/s, got {rate}")
        if not rho0 > 0.0:
            raise ValueError(f"rho0 must be > 0 kg/m^3, got {rho0}")
        self.rate = float(rate)
        self.rho0 = float(rho0)
        super().__init__(dest, sources)

    def loop(self, d_idx, s_idx, d_au, d_av, d_aw, s_m, VIJ, WIJ):
        f = self.rate * s_m[s_idx] / self.rho0 * WIJ
        d_au[d_idx] -= f * VIJ[0]
        d_av[d_idx] -= f * VIJ[1]
        d_aw[d_idx] -= f * VIJ[2]


class PBFWallFriction(Equation):
    r"""Friction of fluid at walls at rest, in the form of :class:`PBFXSPHViscosity`.

    .. math::  a_i \mathrel{-}= r \sum_b \frac{\psi_b}{\rho_0} v_i W_{ib}

    Source: Akinci et al. 2012, eq. 14 (friction with psi_b), in XSPH form.

    Parameters
    ----------
    rate : float   Rate at which the velocity at a wall decays [1/s], >= 0.
    rho0 : float   Rest density [kg/m^3], > 0.

    Reads    d_u .. d_w [m/s], s_m [kg].   Writes   d_au, d_av, d_aw [m/s^2], own index only.
    Errors   ValueError if rate < 0 or rho0 <= 0.   Limits   Walls at rest; explicit: rate dt must stay below 1.
    """

    def __init__(self, dest, sources, rate, rho0):
        if not rate >= 0.0:
            raise ValueError(f"rate must be >= 0 1/s, got {rate}")
        if not rho0 > 0.0:
            raise ValueError(f"rho0 must be > 0 kg/m^3, got {rho0}")
        self.rate = float(rate)
        self.rho0 = float(rho0)
        super().__init__(dest, sources)

    def loop(self, d_idx, s_idx, d_au, d_av, d_aw, d_u, d_v, d_w, s_m, WIJ):
        f = self.rate * s_m[s_idx] / self.rho0 * WIJ
        d_au[d_idx] -= f * d_u[d_idx]
        d_av[d_idx] -= f * d_v[d_idx]
        d_aw[d_idx] -= f * d_w[d_idx]

"""Warm start of the density constraint: a step begins with part of the pressure of the last one, as a force.

Without it the sweeps of each step find the whole pressure anew, of which at rest nearly all is as in the last step.
"""
from pysph.sph.equation import Equation

__all__ = ["PBFBoundaryWarmStart", "PBFWarmStart", "PBFWarmStartSwollen"]


class WarmStartForce(Equation):
    """Base of the forces of a warm start, which have one parameter and different sums.

    Source, Reads, Writes and Errors: at each.
    """

    def __init__(self, dest, sources, rho_rest):
        if not rho_rest > 0.0:
            raise ValueError(f"rho_rest must be > 0 kg/m^3, got {rho_rest}")
        self.rho_rest = float(rho_rest)
        super().__init__(dest, sources)


class PBFWarmStart(WarmStartForce):
    r"""Acceleration by the multipliers with which the next step begins, equal and opposite in momentum for every pair.

    .. math::  a_i = \frac{w_i}{\rho_0} \sum_j (m_j \lambda^s_i + m_i \lambda^s_j) \nabla W_{ij}

    It is the position correction of :class:`PBFPositionCorrection` over dt^2. The next prediction applies it, together
    with all other accelerations, so it costs no search and no sum of its own. :class:`~.PBFStep` finds the
    :math:`\lambda^s`.

    Source: ours, as a force; warm starts of impulses are common in rigid body solvers (Catto 2005, "Iterative dynamics
    with temporal coherence").

    Parameters
    ----------
    rho_rest : float   Summed density of the rest lattice [kg/m^3], > 0.

    Reads    d_lmbda_start, s_lmbda_start [J], d_m, s_m [kg].   Writes   d_au, d_av, d_aw [m/s^2], own index only.
    Errors   ValueError if rho_rest <= 0.
    Limits   The share of the last pressure must be at most 0.5, or else long waves grow.
    """

    def loop(self, d_idx, s_idx, d_lmbda_start, s_lmbda_start, d_m, s_m, d_au, d_av, d_aw, DWIJ):
        f = (s_m[s_idx]*d_lmbda_start[d_idx] + d_m[d_idx]*s_lmbda_start[s_idx]) / (d_m[d_idx]*self.rho_rest)
        d_au[d_idx] += f * DWIJ[0]
        d_av[d_idx] += f * DWIJ[1]
        d_aw[d_idx] += f * DWIJ[2]


class PBFWarmStartSwollen(WarmStartForce):
    r"""As :class:`PBFWarmStart`, for particles that fill ``swell`` times the volume of their liquid.

    .. math::  a_i = \frac{w_i}{\rho_0} \sum_j (s_j m_j \lambda^s_i + s_i m_i \lambda^s_j) \nabla W_{ij}

    Source: as :class:`PBFPositionCorrectionSwollen`.   Reads   d_swell, s_swell [-] too.   Writes, Errors and Limits
    are those of :class:`PBFWarmStart`.
    """

    def loop(self, d_idx, s_idx, d_lmbda_start, s_lmbda_start, d_m, s_m, d_swell, s_swell, d_au, d_av, d_aw, DWIJ):
        f = s_m[s_idx]*s_swell[s_idx]*d_lmbda_start[d_idx] + d_m[d_idx]*d_swell[d_idx]*s_lmbda_start[s_idx]
        f = f / (d_m[d_idx]*self.rho_rest)
        d_au[d_idx] += f * DWIJ[0]
        d_av[d_idx] += f * DWIJ[1]
        d_aw[d_idx] += f * DWIJ[2]


class PBFBoundaryWarmStart(WarmStartForce):
    r"""The same from boundary particles, which have no multipliers.

    .. math::  a_i \mathrel{+}= \frac{w_i}{\rho_0} \sum_b \psi_b \lambda^s_i \nabla W_{ib}

    Source: as :class:`PBFBoundaryCorrection`.   Reads   d_lmbda_start [J], d_m, s_m (psi_b) [kg].   Writes, Errors and
    Limits are those of :class:`PBFWarmStart`.
    """

    def loop(self, d_idx, s_idx, d_lmbda_start, d_m, s_m, d_au, d_av, d_aw, DWIJ):
        f = s_m[s_idx]*d_lmbda_start[d_idx] / (d_m[d_idx]*self.rho_rest)
        d_au[d_idx] += f * DWIJ[0]
        d_av[d_idx] += f * DWIJ[1]
        d_aw[d_idx] += f * DWIJ[2]

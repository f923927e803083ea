"""Buoyancy of bubbles in three forms, and the drag between vapour and liquid."""
from math import exp

from compyle.api import declare
from pysph.sph.equation import Equation

__all__ = ["BubbleBuoyancy", "BubbleBuoyancyIhmsen", "BubbleBuoyancyPaper", "BubbleDrag"]


class BubbleBuoyancy(Equation):
    r"""Buoyancy as the same upward acceleration for all particles of all bubbles (``"archimedes"``).

    .. math::  a = k_b \frac{\rho_l}{m_p} |g| \quad\text{against gravity}

    Source: the paper, eqs. 18-19: F = k_b num_p rho_l g over the mass num_p m_p. It is added to the pressure of the
    density constraint: with k_b = 0 a bubble of equal density is neutrally buoyant, as liquid in its place would be
    (measured).

    Parameters
    ----------
    k_bubble : float   Proportionality constant in units of m_p/rho_l [-], >= 0.
    gx, gy, gz : float Gravity [m/s^2].

    Reads    d_phase.   Writes   d_au, d_av, d_aw [m/s^2], own index only.   Errors   ValueError if k_bubble < 0.
    Limits   The strength is tuned, and does not follow from the density ratio (1600 for water), since all particles
    have equal masses. It acts on all vapour, so that without VentingRelease and venting, vapour rises out of the pool.
    """

    def __init__(self, dest, sources, k_bubble, gx=0.0, gy=0.0, gz=0.0):
        if not k_bubble >= 0.0:
            raise ValueError(f"k_bubble must be >= 0 (in units of m_p/rho_l), got {k_bubble}")
        self.bx = -float(k_bubble) * float(gx)
        self.by = -float(k_bubble) * float(gy)
        self.bz = -float(k_bubble) * float(gz)
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_phase, d_au, d_av, d_aw):
        if d_phase[d_idx] == 3:
            d_au[d_idx] += self.bx
            d_av[d_idx] += self.by
            d_aw[d_idx] += self.bz


class BubbleBuoyancyPaper(Equation):
    r"""Buoyancy as an acceleration that grows with the number of particles in the bubble up to a cap (``"paper"``).

    .. math::  a = \min(k_b N \tfrac{\rho_l}{m_p} |g|,\; a_{max}) \quad\text{against gravity}

    Source: the paper, eq. 19 applied to each particle, which is one reading of its text ("applied to all particles").

    Parameters
    ----------
    k_bubble : float   Proportionality constant in units of m_p/rho_l [-], >= 0.
    a_max : float      Largest acceleration in units of gravity [-], > 0.
    gx, gy, gz : float Gravity [m/s^2].

    Reads    d_phase, d_bubble_n.   Writes   d_au, d_av, d_aw [m/s^2], own index only.   Needs   current bubble sizes.
    Errors   ValueError if k_bubble < 0 or a_max <= 0.   Limits   The cap is ours; without it large bubbles explode.
    """

    def __init__(self, dest, sources, k_bubble, a_max, gx=0.0, gy=0.0, gz=0.0):
        if not k_bubble >= 0.0:
            raise ValueError(f"k_bubble must be >= 0 (in units of m_p/rho_l), got {k_bubble}")
        if not a_max > 0.0:
            raise ValueError(f"a_max must be > 0 (in units of gravity), got {a_max}")
        self.k_bubble = float(k_bubble)
        self.a_max = float(a_max)
        self.gx = float(gx)
        self.gy = float(gy)
        self.gz = float(gz)
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_phase, d_bubble_n, d_au, d_av, d_aw):
        if d_phase[d_idx] == 3:
            f = min(self.k_bubble * d_bubble_n[d_idx], self.a_max)
            d_au[d_idx] -= f * self.gx
            d_av[d_idx] -= f * self.gy
            d_aw[d_idx] -= f * self.gz


class BubbleBuoyancyIhmsen(Equation):
    r"""Buoyancy as an acceleration that depends on the number n of vapour neighbours (``"ihmsen"``).

    .. math::  a = k_{min} \left(k_{max} - (k_{max} - 1)\, e^{-0.1 n}\right) |g| \quad\text{against gravity}

    Source: Ihmsen, Bader, Akinci & Teschner 2011, eq. 7.

    Parameters
    ----------
    k_min, k_max : float   Smallest factor [-], >= 0, and its growth [-], >= 1.
    gx, gy, gz : float     Gravity [m/s^2].

    Reads    d_phase, s_phase.   Writes   d_vapour_near (count), d_au, d_av, d_aw [m/s^2], own index only.
    Errors   ValueError outside the ranges above.
    """

    def __init__(self, dest, sources, k_min, k_max, gx=0.0, gy=0.0, gz=0.0):
        if not k_min >= 0.0:
            raise ValueError(f"k_min must be >= 0, got {k_min}")
        if not k_max >= 1.0:
            raise ValueError(f"k_max must be >= 1, got {k_max}")
        self.k_min = float(k_min)
        self.k_max = float(k_max)
        self.gx = float(gx)
        self.gy = float(gy)
        self.gz = float(gz)
        super().__init__(dest, sources)

    def initialize(self, d_idx, d_vapour_near):
        d_vapour_near[d_idx] = 0

    def loop_all(self, d_idx, d_phase, d_vapour_near, d_h, d_x, d_y, d_z, d_uid, s_phase, s_x, s_y, s_z, s_uid,
                 NBRS, N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        if d_phase[d_idx] == 3:
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                if s_phase[s_idx] == 3:
                    if s_uid[s_idx] != d_uid[d_idx]:
                        rx = d_x[d_idx] - s_x[s_idx]
                        ry = d_y[d_idx] - s_y[s_idx]
                        rz = d_z[d_idx] - s_z[s_idx]
                        if rx*rx + ry*ry + rz*rz < 4.0*d_h[d_idx]*d_h[d_idx]:
                            d_vapour_near[d_idx] += 1

    def post_loop(self, d_idx, d_phase, d_vapour_near, d_au, d_av, d_aw):
        if d_phase[d_idx] == 3:
            f = self.k_min * (self.k_max - (self.k_max - 1.0) * exp(-0.1*d_vapour_near[d_idx]))
            d_au[d_idx] -= f * self.gx
            d_av[d_idx] -= f * self.gy
            d_aw[d_idx] -= f * self.gz


class BubbleDrag(Equation):
    r"""Drag between vapour and liquid, proportional to their relative velocity; conserves momentum.

    .. math::  a_i = r \sum_{j:\,\text{other phase}} \frac{m_j}{\rho_0} (v_j - v_i) W_{ij}

    Source: after Monaghan & Kocharyan 1995 (drag between phases); the paper, section 4.2.1, mentions resistance without
    a formula.

    Parameters
    ----------
    rate : float   Rate of the exchange [1/s], >= 0.
    rho0 : float   Rest density [kg/m^3], > 0.

    Reads    d_phase, s_phase, velocities [m/s], s_m [kg].   Writes   d_au, d_av, d_aw [m/s^2], own index only.
    Errors   ValueError if rate < 0 or rho0 <= 0.   Limits   Explicit: rate dt must stay below 1.
    """

    def __init__(self, dest, sources, rate, rho0):
        if not rate >= 0.0:
            raise ValueError(f"rate of the drag must be >= 0 1/s, got {rate}")
        if not rho0 > 0.0:
            raise ValueError(f"rho0 must be > 0 kg/m^3, got {rho0}")
        self.rate = float(rate)
        self.rho0 = float(rho0)
        super().__init__(dest, sources)

    def loop(self, d_idx, s_idx, d_phase, s_phase, d_au, d_av, d_aw, s_m, VIJ, WIJ):
        f = self.rate * s_m[s_idx] / self.rho0 * WIJ
        if d_phase[d_idx] == 3:
            if s_phase[s_idx] == 3:
                f = 0.0
        else:
            if s_phase[s_idx] != 3:
                f = 0.0
        d_au[d_idx] -= f * VIJ[0]
        d_av[d_idx] -= f * VIJ[1]
        d_aw[d_idx] -= f * VIJ[2]

"""Surface tension of bubbles: cohesion between vapour particles, and adhesion of vapour to preset sites."""
from math import sqrt

from compyle.api import declare
from pysph.sph.equation import Equation

__all__ = ["BubbleCohesion", "BubbleSiteAdhesion"]


class BubbleCohesion(Equation):
    r"""Cohesion between vapour particles: attraction that turns into repulsion when they are close.

    .. math::  a_i = -a_c \sum_j \frac{2 m_j}{m_i + m_j} C(r_{ij}/R)\, \hat{x}_{ij}, \qquad
               C(q) = \begin{cases} 2\cdot 64 (1-q)^3 q^3 - 1 & q \le 1/2 \\ 64 (1-q)^3 q^3 & 1/2 < q < 1 \end{cases}

    Source: Akinci, Akinci & Teschner 2013, eq. 2, normalised to a peak of 1; the paper, section 4.2.1, mentions surface
    tension without a formula.

    Parameters
    ----------
    strength : float   a_c [m/s^2], >= 0. Bubbles at rest stay calm up to strength dt^2/spacing = 0.025 in 2-D and 0.01
        in 3-D.
    radius : float     Range R [m], > 0, at most the support of the kernel.

    Reads    d_phase, s_phase, d_m, s_m [kg], positions.   Writes   d_au, d_av, d_aw [m/s^2], own index only.
    Errors   ValueError if strength < 0 or radius <= 0.   Limits   The strength is tuned, and not a surface tension.
    """

    def __init__(self, dest, sources, strength, radius):
        if not strength >= 0.0:
            raise ValueError(f"strength of the cohesion must be >= 0 m/s^2, got {strength}")
        if not radius > 0.0:
            raise ValueError(f"radius of the cohesion must be > 0 m, got {radius} m")
        self.strength = float(strength)
        self.radius = float(radius)
        super().__init__(dest, sources)

    def loop_all(self, d_idx, d_phase, s_phase, d_m, s_m, d_au, d_av, d_aw, d_x, d_y, d_z, s_x, s_y, s_z,
                 NBRS, N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        if d_phase[d_idx] == 3:
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                if s_phase[s_idx] == 3:
                    rx = d_x[d_idx] - s_x[s_idx]
                    ry = d_y[d_idx] - s_y[s_idx]
                    rz = d_z[d_idx] - s_z[s_idx]
                    r = sqrt(rx*rx + ry*ry + rz*rz)
                    if r < self.radius:
                        q = r / self.radius
                        f = 64.0 * (1.0-q)*(1.0-q)*(1.0-q) * q*q*q
                        if q <= 0.5:
                            f = 2.0*f - 1.0
                        f = self.strength * f * 2.0*s_m[s_idx] / (d_m[d_idx] + s_m[s_idx])
                        f = f / max(r, 1e-6*self.radius)
                        d_au[d_idx] -= f * rx
                        d_av[d_idx] -= f * ry
                        d_aw[d_idx] -= f * rz


class BubbleSiteAdhesion(Equation):
    r"""Adhesion of vapour to preset sites.

    .. math::  a_i = a_a \sqrt{1 - r/r_a}\, \min(1, r/\Delta x)\, \hat{n}_{i \to s}, \qquad r < r_a

    Source: ours, calibrated: the number of particles at departure grows with a_a over the buoyancy (the paper, section
    4.2.1: a bubble departs when buoyancy overcomes surface tension and resistance).

    Parameters
    ----------
    strength : float   a_a [m/s^2], >= 0.
    radius : float     r_a [m], > 0.
    spacing : float    Particle spacing [m], > 0; closer to the site than this, the force decreases to zero.

    Reads    d_phase, positions.   Writes   d_au, d_av, d_aw [m/s^2], own index only.
    Errors   ValueError if strength < 0, radius <= 0 or spacing <= 0.   Limits   Sites do not recoil.
    """

    def __init__(self, dest, sources, strength, radius, spacing):
        if not strength >= 0.0:
            raise ValueError(f"strength of the adhesion must be >= 0 m/s^2, got {strength}")
        if not radius > 0.0:
            raise ValueError(f"radius of the adhesion must be > 0 m, got {radius} m")
        if not spacing > 0.0:
            raise ValueError(f"spacing must be > 0 m, got {spacing} m")
        self.strength = float(strength)
        self.radius = float(radius)
        self.spacing = float(spacing)
        super().__init__(dest, sources)

    def loop_all(self, d_idx, d_phase, d_au, d_av, d_aw, d_x, d_y, d_z, s_x, s_y, s_z, NBRS, N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        if d_phase[d_idx] == 3:
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                rx = d_x[d_idx] - s_x[s_idx]
                ry = d_y[d_idx] - s_y[s_idx]
                rz = d_z[d_idx] - s_z[s_idx]
                r = sqrt(rx*rx + ry*ry + rz*rz)
                if r < self.radius:
                    f = self.strength * sqrt(1.0 - r/self.radius) * min(1.0, r/self.spacing)
                    f = f / max(r, 1e-6*self.radius)
                    d_au[d_idx] -= f * rx
                    d_av[d_idx] -= f * ry
                    d_aw[d_idx] -= f * rz

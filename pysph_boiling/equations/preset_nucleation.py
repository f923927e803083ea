"""Nucleation at preset sites: the kinetic condition near them, and their attraction of liquid."""
from math import sqrt

from compyle.api import declare
from pysph.sph.equation import Equation

__all__ = ["NucleationSiteAttraction", "NucleationSiteCondition"]


class NucleationSiteCondition(Equation):
    """The kinetic condition from preset sites: it holds if a site is within ``radius``.

    Source: the paper, section 3.2.1.

    Parameters
    ----------
    radius : float   Radius of a site [m], > 0.

    Reads    positions.   Writes   d_kinetic, own index only.   Needs   PhaseKineticReset in the same group.
    Errors   ValueError if radius <= 0.
    """

    def __init__(self, dest, sources, radius):
        if not radius > 0.0:
            raise ValueError(f"radius of a site must be > 0 m, got {radius} m")
        self.radius = float(radius)
        super().__init__(dest, sources)

    def loop(self, d_idx, s_idx, d_kinetic, RIJ):
        if RIJ < self.radius:
            d_kinetic[d_idx] = 1


class NucleationSiteAttraction(Equation):
    r"""Attraction of nearby liquid towards the nearest site.

    .. math::  a_i = a_s (1 - r/r_a)^2 \,\hat{n}_{i \to s}, \qquad r < r_a

    Source: the paper, section 3.2.1, mentions the attraction without a formula; the formula is ours.

    Parameters
    ----------
    strength : float   a_s [m/s^2], >= 0.
    radius : float     r_a [m], > 0.

    Reads    d_phase, positions.   Writes   d_au, d_av, d_aw [m/s^2], own index only.
    Errors   ValueError if strength < 0 or radius <= 0.   Limits   Sites do not recoil; the wall takes up the momentum.
    """

    def __init__(self, dest, sources, strength, radius):
        if not strength >= 0.0:
            raise ValueError(f"strength of the attraction must be >= 0 m/s^2, got {strength}")
        if not radius > 0.0:
            raise ValueError(f"radius of the attraction must be > 0 m, got {radius} m")
        self.strength = float(strength)
        self.radius = float(radius)
        super().__init__(dest, sources)

    def loop_all(self, d_idx, d_au, d_av, d_aw, d_phase, d_x, d_y, d_z, s_x, s_y, s_z, NBRS, N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        nearest = declare('long')
        best = self.radius*self.radius
        nearest = -1
        if d_phase[d_idx] != 3:
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                rx = d_x[d_idx] - s_x[s_idx]
                ry = d_y[d_idx] - s_y[s_idx]
                rz = d_z[d_idx] - s_z[s_idx]
                r2 = rx*rx + ry*ry + rz*rz
                if r2 < best:
                    best = r2
                    nearest = s_idx
            if nearest >= 0:
                r = sqrt(best)
                f = (1.0 - r/self.radius)
                f = self.strength * f * f / max(r, 1e-6*self.radius)
                d_au[d_idx] += f * (s_x[nearest] - d_x[d_idx])
                d_av[d_idx] += f * (s_y[nearest] - d_y[d_idx])
                d_aw[d_idx] += f * (s_z[nearest] - d_z[d_idx])

"""Bubble oscillation: displacements that bring the mean radius of a bubble to its target.

The host computes one number per bubble (:mod:`pysph_boiling.schemes.effects.oscillation`), and the kernel turns it into
a displacement of each particle of the bubble.
"""
from math import sqrt

from pysph.sph.equation import Equation

__all__ = ["BubbleOscillation"]


class BubbleOscillation(Equation):
    r"""Radial displacement of the particles of a bubble.

    .. math::  \Delta x_i = w_i P_b\, (d_i - \bar d_b), \qquad d_i = \frac{x_i - c_b}{|x_i - c_b|}, \quad w = 1/m,
               \qquad P_b = \frac{\omega}{N}\frac{r_\text{target} - r_\text{mean}}{\sum_i w_i |\nabla_i r|^2 + \epsilon}

    Source: the paper, eqs. 27 to 30, with the mean radius r of eq. 24 and :math:`\nabla_i r = (d_i - \bar d)/N`. With a
    mean direction of zero it is the paper's approximation, eq. 28, whose displacements have a net momentum.

    Parameters
    ----------
    nearest : float   At distances from the centre below this [m], > 0, the direction decreases to zero.

    Reads    d_phase, d_m [kg], d_bcx, d_bcy, d_bcz (centre of its bubble) [m], d_bdx, d_bdy, d_bdz (mean direction)
    [-], d_push_multiplier (P_b) [kg m].   Writes   d_x, d_y, d_z, d_sx, d_sy, d_sz [m], own index only.
    Needs    these values for the present positions.   Errors   ValueError if nearest <= 0.
    """

    def __init__(self, dest, sources, nearest):
        if not nearest > 0.0:
            raise ValueError(f"nearest distance to the centre must be > 0 m, got {nearest} m")
        self.nearest = float(nearest)
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_phase, d_m, d_x, d_y, d_z, d_sx, d_sy, d_sz, d_bcx, d_bcy, d_bcz, d_bdx, d_bdy, d_bdz,
                  d_push_multiplier):
        if d_phase[d_idx] == 3:
            rx = d_x[d_idx] - d_bcx[d_idx]
            ry = d_y[d_idx] - d_bcy[d_idx]
            rz = d_z[d_idx] - d_bcz[d_idx]
            r = max(sqrt(rx*rx + ry*ry + rz*rz), self.nearest)
            f = d_push_multiplier[d_idx] / d_m[d_idx]
            px = f * (rx/r - d_bdx[d_idx])
            py = f * (ry/r - d_bdy[d_idx])
            pz = f * (rz/r - d_bdz[d_idx])
            d_x[d_idx] += px
            d_y[d_idx] += py
            d_z[d_idx] += pz
            d_sx[d_idx] += px
            d_sy[d_idx] += py
            d_sz[d_idx] += pz

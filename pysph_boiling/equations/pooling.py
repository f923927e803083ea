"""Pooled latent heat: liquid in transition joins the nearest bubble and gets its enthalpy from the bubble's pool."""
from compyle.api import declare
from pysph.sph.equation import Equation

__all__ = ["PoolingInterface", "PoolingJoin", "PoolingShare"]


class PoolingInterface(Equation):
    r"""Conductivity of liquid in transition near vapour, so that its heat arrives at the surface of the bubble.

    .. math::  k_i \leftarrow k_i \frac{\Delta x}{2 d_i} \quad\text{where } d_i > \tfrac12 \Delta x

    Such liquid is at T_sat, but T_sat belongs to the surface, which lies half a spacing from the centre of the nearest
    vapour particle, so d - dx/2 away. In the harmonic mean of a pair the half spacing on its side then counts as d.
    Without this a bubble gathers heat as if its radius were larger by d - dx/2. Liquid that is not pooled needs no
    correction: while it stores its own latent heat, the surface moves through it, and is on the mean in its centre.

    Source: ours; resistances in series.

    Parameters
    ----------
    spacing : float   Particle spacing dx [m], > 0.

    Reads    d_phase, d_vapour_distance [m], 0 where there is none.   Writes   d_k [W/(m K)], own index only.
    Needs    PhaseTemperature and the heat from walls in earlier groups: that heat need not pass the centre.
    Errors   ValueError if spacing <= 0.   Limits   The vapour is taken to be as large as liquid, also with expansion.
    """

    def __init__(self, dest, sources, spacing):
        if not spacing > 0.0:
            raise ValueError(f"spacing must be > 0 m, got {spacing} m")
        self.half_spacing = 0.5 * float(spacing)
        super().__init__(dest, sources)

    def initialize(self, d_idx, d_phase, d_vapour_distance, d_k):
        if d_phase[d_idx] == 1:
            if d_vapour_distance[d_idx] > self.half_spacing:
                d_k[d_idx] *= self.half_spacing / d_vapour_distance[d_idx]


class PoolingJoin(Equation):
    """Assigns liquid in transition to the bubble of the nearest vapour particle within ``radius``.

    Of equally near bubbles it joins the one with the smaller label. All other particles get ``NO_BUBBLE``.

    Source: ours.

    Parameters
    ----------
    radius : float   Kinetic radius [m], > 0; 1.0 to 1.5 spacings.

    Reads    d_phase, s_phase, s_bubble, positions.   Writes   d_joined, own index only.
    Needs    BubbleLabel in an earlier group.   Errors   ValueError if radius <= 0.
    """

    def __init__(self, dest, sources, radius):
        if not radius > 0.0:
            raise ValueError(f"kinetic radius must be > 0 m, got {radius} m")
        self.radius2 = float(radius) * float(radius)
        super().__init__(dest, sources)

    def loop_all(self, d_idx, d_phase, d_joined, d_x, d_y, d_z, s_phase, s_bubble, s_x, s_y, s_z, NBRS, N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        label = declare('unsigned int')
        label = 4294967295
        best = self.radius2
        if d_phase[d_idx] == 1:
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                if s_phase[s_idx] == 3:
                    rx = d_x[d_idx] - s_x[s_idx]
                    ry = d_y[d_idx] - s_y[s_idx]
                    rz = d_z[d_idx] - s_z[s_idx]
                    r2 = rx*rx + ry*ry + rz*rz
                    if r2 < best:
                        best = r2
                        label = s_bubble[s_idx]
                    if r2 == best:
                        if r2 < self.radius2:
                            if s_bubble[s_idx] < label:
                                label = s_bubble[s_idx]
        d_joined[d_idx] = label


class PoolingShare(Equation):
    """Sets the enthalpy from the pool of the bubble; a particle whose latent heat is then complete becomes vapour.

    Source: ours; the paper stores latent heat in each particle (section 3.3.2).

    Parameters
    ----------
    T_sat : float   Saturation temperature [K].
    L : float       Latent heat [J/kg].
    c_v : float     Specific heat capacity of vapour [J/(kg K)].

    Reads    d_pooled [J/kg], negative for a particle without a pool.
    Writes   d_e [J/kg], d_phase, d_T [K], d_vaporised, own index only.
    Needs    the hook of ``LatentPooling`` after PoolingJoin, which sums over bubbles. Only liquid in transition gets a
             pool, and it holds no latent heat (e_lat = 0).
    """

    def __init__(self, dest, sources, T_sat, L, c_v):
        self.T_sat = float(T_sat)
        self.L = float(L)
        self.c_v = float(c_v)
        super().__init__(dest, sources)

    def initialize(self, d_idx, d_pooled, d_e, d_phase, d_T, d_vaporised):
        if d_pooled[d_idx] >= 0.0:
            d_e[d_idx] = d_pooled[d_idx]
            d_T[d_idx] = self.T_sat
            if d_e[d_idx] >= self.L:
                d_phase[d_idx] = 3
                d_T[d_idx] = self.T_sat + (d_e[d_idx] - self.L) / self.c_v
                d_vaporised[d_idx] += 1

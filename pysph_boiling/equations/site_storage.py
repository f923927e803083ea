"""Latent heat stored in preset sites (Li & Xiao): a site absorbs heat of the liquid near it, and emits whole bubbles.

There are five groups, because each reads what all particles wrote in the one before: :class:`StorageNearest` with
:class:`StorageOccupied`, :class:`StorageChoice`, :class:`StorageAbsorption`, :class:`StorageEmission` and
:class:`StorageVapour`. A site is identified by its ``number``, which its periodic images share. A particle stores the
squared distance from its site, and all decisions compare this one number, so that they agree to the last bit.
"""
from compyle.api import declare
from pysph.sph.equation import Equation

__all__ = [
    "StorageAbsorption", "StorageChoice", "StorageEmission", "StorageNearest", "StorageOccupied", "StorageVapour",
]


class StorageNearest(Equation):
    """The nearest site of each particle that is not vapour; of two at equal distance, the one with the smaller number.

    Source: ours; the paper compares with Li & Xiao in Table 1 without a formula.

    Parameters
    ----------
    reach : float   Largest distance at which a site acts [m], > 0.

    Reads    d_phase, s_number, positions.   Writes   d_site (-1 if none is in reach), d_site_r2 [m^2], own index only.
    Errors   ValueError if reach <= 0.
    """

    def __init__(self, dest, sources, reach):
        if not reach > 0.0:
            raise ValueError(f"reach of a site must be > 0 m, got {reach} m")
        self.reach2 = float(reach) * float(reach)
        super().__init__(dest, sources)

    def initialize(self, d_idx, d_site, d_site_r2):
        d_site[d_idx] = -1
        d_site_r2[d_idx] = self.reach2

    def loop_all(self, d_idx, d_phase, d_site, d_site_r2, d_x, d_y, d_z, s_number, s_x, s_y, s_z, NBRS, N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        if d_phase[d_idx] != 3:
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                rx = d_x[d_idx] - s_x[s_idx]
                ry = d_y[d_idx] - s_y[s_idx]
                rz = d_z[d_idx] - s_z[s_idx]
                r2 = rx*rx + ry*ry + rz*rz
                if r2 < d_site_r2[d_idx]:
                    d_site_r2[d_idx] = r2
                    d_site[d_idx] = s_number[s_idx]
                elif r2 == d_site_r2[d_idx]:
                    if s_number[s_idx] < d_site[d_idx]:
                        d_site[d_idx] = s_number[s_idx]


class StorageOccupied(Equation):
    """Marks a site as occupied while there is vapour within ``radius``; also stores its index in memory.

    Source: ours, after Li & Xiao (one bubble per site at a time).

    Parameters
    ----------
    radius : float   Radius of a site [m], > 0.

    Reads    s_phase, d_number, positions.   Writes   d_occupied, own index only, and d_place at its own number.
    Errors   ValueError if radius <= 0.
    """

    def __init__(self, dest, sources, radius):
        if not radius > 0.0:
            raise ValueError(f"radius of a site must be > 0 m, got {radius} m")
        self.radius = float(radius)
        super().__init__(dest, sources)

    def initialize(self, d_idx, d_number, d_place, d_occupied):
        d_occupied[d_idx] = 0
        d_place[d_number[d_idx]] = d_idx

    def loop(self, d_idx, s_idx, d_occupied, s_phase, RIJ):
        if s_phase[s_idx] == 3:
            if RIJ < self.radius:
                d_occupied[d_idx] = 1


class StorageChoice(Equation):
    r"""Chooses the ``n_emit`` nearest particles of each site, ties by uid, and the heat needed to vaporise them.

    .. math::  C_s = \sum m_i (L - e_i)

    The site stores the squared distance and the uid of the last of them: all particles up to this one are chosen.

    Source: ours, after Li & Xiao.

    Parameters
    ----------
    n_emit : int   Particles in an emitted bubble [-], >= 1.
    L : float      Latent heat [J/kg].

    Reads    s_site, s_site_r2 [m^2], s_uid, s_m [kg], s_e [J/kg].
    Writes   d_chosen, d_cut_r2 [m^2], d_cut_uid, d_cost [J], own index only.
    Needs    StorageNearest in an earlier group.   Errors   ValueError if n_emit < 1.
    Limits   All of the fluid must be in one array.
    """

    def __init__(self, dest, sources, n_emit, L):
        if not n_emit >= 1:
            raise ValueError(f"n_emit must be >= 1 particle, got {n_emit}")
        self.n_emit = int(n_emit)
        self.L = float(L)
        super().__init__(dest, sources)

    def loop_all(self, d_idx, d_number, d_chosen, d_cut_r2, d_cut_uid, d_cost, s_site, s_site_r2, s_uid, s_m, s_e,
                 NBRS, N_NBRS):
        i = declare('int')
        k = declare('int')
        after = declare('int')
        most = declare('int')
        s_idx = declare('long')
        best = declare('long')
        most = self.n_emit
        d_chosen[d_idx] = 0
        d_cut_r2[d_idx] = -1.0
        d_cut_uid[d_idx] = 0
        d_cost[d_idx] = 0.0
        for k in range(most):
            best = -1
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                if s_site[s_idx] == d_number[d_idx]:
                    after = 0
                    if s_site_r2[s_idx] > d_cut_r2[d_idx]:
                        after = 1
                    elif s_site_r2[s_idx] == d_cut_r2[d_idx]:
                        if s_uid[s_idx] > d_cut_uid[d_idx]:
                            after = 1
                    if after == 1:
                        if best < 0:
                            best = s_idx
                        elif s_site_r2[s_idx] < s_site_r2[best]:
                            best = s_idx
                        elif s_site_r2[s_idx] == s_site_r2[best]:
                            if s_uid[s_idx] < s_uid[best]:
                                best = s_idx
            if best >= 0:
                d_chosen[d_idx] += 1
                d_cut_r2[d_idx] = s_site_r2[best]
                d_cut_uid[d_idx] = s_uid[best]
                d_cost[d_idx] += s_m[best] * (self.L - s_e[best])


class StorageAbsorption(Equation):
    r"""Superheated liquid near a site gives it a part of its excess heat, unless the site is occupied or full.

    .. math::  q_i = f m_i e_i, \qquad f = \min(1, a\,\Delta t)

    A site is full when it holds the heat needed to vaporise its chosen particles.

    Source: ours, after Li & Xiao (a site absorbs the excess heat of the liquid near it).

    Parameters
    ----------
    radius : float       Radius of a site [m], > 0.
    rate : float         a [1/s], >= 0.
    T_sat, c_l : float   Saturation temperature [K], specific heat capacity of liquid [J/(kg K)].

    Reads    d_site, d_site_r2 [m^2], d_m [kg], s_place, s_occupied, s_Q_s, s_cost [J].
    Writes   d_e [J/kg], d_T [K], d_paid, d_q_sites [J], own index only.
    Needs    StorageChoice in an earlier group; liquid holds no latent heat (e_lat = 0).
    Errors   ValueError if radius <= 0 or rate < 0.
    """

    def __init__(self, dest, sources, radius, rate, T_sat, c_l):
        if not radius > 0.0:
            raise ValueError(f"radius of a site must be > 0 m, got {radius} m")
        if not rate >= 0.0:
            raise ValueError(f"rate of absorption must be >= 0 1/s, got {rate}")
        self.radius2 = float(radius) * float(radius)
        self.rate = float(rate)
        self.T_sat = float(T_sat)
        self.c_l = float(c_l)
        super().__init__(dest, sources)

    def loop_all(self, d_idx, d_site, d_site_r2, d_m, d_e, d_T, d_paid, d_q_sites, s_place, s_occupied, s_Q_s, s_cost,
                 dt):
        s_idx = declare('long')
        d_paid[d_idx] = 0.0
        if d_site[d_idx] >= 0:
            s_idx = s_place[d_site[d_idx]]
            if d_site_r2[d_idx] < self.radius2:
                if d_e[d_idx] > 0.0:
                    if s_occupied[s_idx] == 0:
                        if s_Q_s[s_idx] < s_cost[s_idx]:
                            share = min(1.0, self.rate*dt) * d_e[d_idx]
                            d_e[d_idx] -= share
                            d_T[d_idx] = self.T_sat + d_e[d_idx] / self.c_l
                            d_paid[d_idx] = d_m[d_idx] * share
                            d_q_sites[d_idx] += d_paid[d_idx]


class StorageEmission(Equation):
    r"""Adds the absorbed heat to a site, which emits a bubble if it is free and holds enough heat for it.

    .. math::  Q_s \leftarrow Q_s + \sum q_i, \qquad Q_s \leftarrow Q_s - C_s \quad\text{if } Q_s \ge C_s

    Source: ours, after Li & Xiao.

    Parameters
    ----------
    n_emit, L : int, float   As :class:`StorageChoice`.

    Reads    d_occupied, d_chosen, d_cut_r2 [m^2], d_cut_uid, s_site, s_site_r2 [m^2], s_uid, s_m [kg], s_e [J/kg],
    s_paid [J].   Writes   d_Q_s, d_cost [J], d_emits, own index only.
    Needs    StorageAbsorption in an earlier group.
    """

    def __init__(self, dest, sources, n_emit, L):
        self.n_emit = int(n_emit)
        self.L = float(L)
        super().__init__(dest, sources)

    def loop_all(self, d_idx, d_number, d_occupied, d_chosen, d_cut_r2, d_cut_uid, d_cost, d_Q_s, d_emits, s_site,
                 s_site_r2, s_uid, s_m, s_e, s_paid, NBRS, N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        d_emits[d_idx] = 0
        d_cost[d_idx] = 0.0
        for i in range(N_NBRS):
            s_idx = NBRS[i]
            if s_site[s_idx] == d_number[d_idx]:
                d_Q_s[d_idx] += s_paid[s_idx]
                if s_site_r2[s_idx] < d_cut_r2[d_idx]:
                    d_cost[d_idx] += s_m[s_idx] * (self.L - s_e[s_idx])
                elif s_site_r2[s_idx] == d_cut_r2[d_idx]:
                    if s_uid[s_idx] <= d_cut_uid[d_idx]:
                        d_cost[d_idx] += s_m[s_idx] * (self.L - s_e[s_idx])
        if d_occupied[d_idx] == 0:
            if d_chosen[d_idx] == self.n_emit:
                if d_Q_s[d_idx] >= d_cost[d_idx]:
                    d_Q_s[d_idx] -= d_cost[d_idx]
                    d_emits[d_idx] = 1


class StorageVapour(Equation):
    """The chosen particles of a site that emits become vapour at saturation.

    Source: ours, after Li & Xiao.

    Parameters
    ----------
    T_sat, L : float   Saturation temperature [K], latent heat [J/kg].

    Reads    d_site, d_site_r2 [m^2], d_uid, d_m [kg], s_place, s_emits, s_cut_r2 [m^2], s_cut_uid.
    Writes   d_e [J/kg], d_phase, d_T [K], d_emitted, d_q_sites [J], own index only.
    Needs    StorageEmission in an earlier group.
    """

    def __init__(self, dest, sources, T_sat, L):
        self.T_sat = float(T_sat)
        self.L = float(L)
        super().__init__(dest, sources)

    def loop_all(self, d_idx, d_site, d_site_r2, d_uid, d_m, d_e, d_phase, d_T, d_emitted, d_q_sites, s_place,
                 s_emits, s_cut_r2, s_cut_uid):
        s_idx = declare('long')
        chosen = declare('int')
        chosen = 0
        if d_site[d_idx] >= 0:
            s_idx = s_place[d_site[d_idx]]
            if s_emits[s_idx] == 1:
                if d_site_r2[d_idx] < s_cut_r2[s_idx]:
                    chosen = 1
                elif d_site_r2[d_idx] == s_cut_r2[s_idx]:
                    if d_uid[d_idx] <= s_cut_uid[s_idx]:
                        chosen = 1
        if chosen == 1:
            d_q_sites[d_idx] -= d_m[d_idx] * (self.L - d_e[d_idx])
            d_e[d_idx] = self.L
            d_phase[d_idx] = 3
            d_T[d_idx] = self.T_sat
            d_emitted[d_idx] += 1

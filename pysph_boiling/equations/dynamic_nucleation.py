"""Dynamic nucleation: a superheated region that holds enough heat turns some of its particles into vapour at once.

The region of a superheated particle consists of this particle and the superheated particles within a fixed radius. Read
literally, the paper lets the regions of neighbours overlap and use the same heat several times. Here a region only
fires if its claim is the strongest one on each of its members, so that the regions that fire in one step are disjoint.
The heat of a region is its sensible heat, ``e - held``. Latent heat held since an interruption does not raise the
temperature and causes no burst; it only reduces the heat needed to vaporise its own particle. It also lowers the heat
capacity of its particle, which the sums count in units of c_l as w = c/c_l, 1 where no heat is held.

The equations stand in one group each, in this order: :class:`NucleationHeld` (if latent heat is held at all),
:class:`NucleationRegion`, :class:`NucleationClaim`, then :class:`NucleationFire` with :class:`NucleationChoice`, and
:class:`NucleationShare`. All decisions compare integers stored in doubles, or keys hashed from (seed, stream, step,
uid), so they depend neither on threads nor on the order of the particles.
"""
from math import floor

from compyle.api import declare
from pysph.sph.equation import Equation

from pysph_boiling.equations.helpers import boiling_capacity, boiling_temperature
from pysph_boiling.equations.phase_change import PhaseEquation

__all__ = [
    "NucleationChoice", "NucleationClaim", "NucleationFire", "NucleationHeld", "NucleationRegion", "NucleationRelease",
    "NucleationShare",
]


def nucleation_key(uid=0, stream=0, count=0):
    """Random integer in [0, 2^32), never the same for two uids; multipliers below 2^31."""
    i = declare('int')
    h = declare('unsigned int')
    h = uid
    for i in range(3):
        if i == 1:
            h = h + stream
        if i == 2:
            h = h + count
        h = h ^ (h >> 16)
        h = h * 569420461
        h = h ^ (h >> 15)
        h = h * 1935289751
        h = h ^ (h >> 15)
    return h


def nucleation_units(share=0.0):
    """Whole units of 2^-24, so that sums are exact in any order."""
    return floor(share*16777216.0 + 0.5)


class NucleationHeld(Equation):
    """Latent heat held by a superheated particle (``interrupt="hold"``): that of the interruption minus later cooling.

    Source: ours.   Reads   d_phase, d_e, d_e_lat [J/kg].   Writes   d_held [J/kg], 0 in other phases, own index only.
    """

    def initialize(self, d_idx, d_phase, d_e, d_e_lat, d_held):
        d_held[d_idx] = 0.0
        if d_phase[d_idx] == 2:
            d_held[d_idx] = max(min(d_e[d_idx], d_e_lat[d_idx]), 0.0)


class NucleationRegion(Equation):
    r"""Sensible heat of the region around each superheated particle, if it is enough to fire, and the particle's keys.

    .. math::  Q_i = \sum_j m_j (e_j - e^{held}_j) > q_{crit} m_p L + e_{crit} \sum_j w_j m_j, \qquad Q_i \ge m_p L

    Source: the paper, section 3.2.2, eq. 5: c (T - T_sat) = e - e_held. Differs: Q is summed in whole units of
    2^-24 m_p L, so it is exact. The second threshold is a mean superheat, e_crit/c_l, weighted by heat capacity.

    Parameters
    ----------
    radius : float   Radius of a region [m], > 0.
    m_p : float      Mass of a particle of the rest lattice [kg].
    L : float        Latent heat [J/kg].
    c_l, c_v : float  Specific heat capacity of liquid and vapour [J/(kg K)].
    q_crit : float   Threshold in units of m_p L [-], >= 0.
    e_crit : float   Threshold for the mean sensible heat of the region, were it all liquid [J/kg], >= 0.
    stream : int     Stream of the random numbers, even; the next stream is used too.

    Reads    d_uid, d_phase, s_phase, s_m [kg], s_e, s_held [J/kg], positions; constant ``steps``.
    Writes   d_region_heat [2^-24 m_p L], 0 if it is not enough, d_fire_key, d_pick_key, own index only.
    Errors   ValueError if radius <= 0 or a threshold is negative.
    Limits   Needs double precision.
    """

    def __init__(self, dest, sources, radius, m_p, L, c_l, c_v, q_crit, e_crit, stream):
        if not radius > 0.0:
            raise ValueError(f"radius of a region must be > 0 m, got {radius} m")
        if not (q_crit >= 0.0 and e_crit >= 0.0):
            raise ValueError(f"thresholds must be >= 0, got {q_crit} m_p L and {e_crit} J/kg")
        self.radius2 = float(radius) * float(radius)
        self.m_p = float(m_p)
        self.L = float(L)
        self.c_l = float(c_l)
        self.c_v = float(c_v)
        self.q_crit = float(q_crit) * 16777216.0
        self.e_crit = float(e_crit) / float(L)
        self.stream = int(stream)
        super().__init__(dest, sources)

    def _get_helpers_(self):
        return [boiling_capacity, nucleation_key, nucleation_units]

    def initialize(self, d_idx, d_uid, d_phase, d_steps, d_region_heat, d_fire_key, d_pick_key):
        count = declare('long')
        d_region_heat[d_idx] = 0.0
        if d_phase[d_idx] == 2:
            count = cast(d_steps[0], 'long')
            d_fire_key[d_idx] = nucleation_key(d_uid[d_idx], self.stream, count)
            d_pick_key[d_idx] = nucleation_key(d_uid[d_idx], self.stream + 1, count)

    def loop_all(self, d_idx, d_phase, d_region_heat, d_x, d_y, d_z, s_phase, s_m, s_e, s_held, s_x, s_y, s_z, NBRS,
                 N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        heat = 0.0
        mass = 0.0
        if d_phase[d_idx] == 2:
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                if s_phase[s_idx] == 2:
                    rx = d_x[d_idx] - s_x[s_idx]
                    ry = d_y[d_idx] - s_y[s_idx]
                    rz = d_z[d_idx] - s_z[s_idx]
                    if rx*rx + ry*ry + rz*rz < self.radius2:
                        share = s_m[s_idx] / self.m_p
                        heat += nucleation_units(share * (s_e[s_idx] - s_held[s_idx]) / self.L)
                        c = boiling_capacity(s_held[s_idx], self.L, self.c_l, self.c_v)
                        mass += nucleation_units(share * (c/self.c_l))
            if heat > self.q_crit + self.e_crit*mass and heat >= 16777216.0:
                d_region_heat[d_idx] = heat


class NucleationClaim(Equation):
    """Key of the strongest claim on each superheated particle: of its regions the one with most heat, then by key.

    Source: ours (see the module). If the uid decided between equal regions, a uniform block would fire one region at a
    time, beginning in a corner.

    Parameters
    ----------
    radius : float   As :class:`NucleationRegion`.

    Reads    d_phase, s_region_heat [2^-24 m_p L], s_fire_key, positions.   Writes   d_claim, own index only.
    Needs    NucleationRegion in an earlier group.
    """

    def __init__(self, dest, sources, radius):
        self.radius2 = float(radius) * float(radius)
        super().__init__(dest, sources)

    def loop_all(self, d_idx, d_phase, d_claim, d_x, d_y, d_z, s_region_heat, s_fire_key, s_x, s_y, s_z, NBRS, N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        heat = 0.0
        key = -1.0
        if d_phase[d_idx] == 2:
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                if s_region_heat[s_idx] > 0.0:
                    rx = d_x[d_idx] - s_x[s_idx]
                    ry = d_y[d_idx] - s_y[s_idx]
                    rz = d_z[d_idx] - s_z[s_idx]
                    if rx*rx + ry*ry + rz*rz < self.radius2:
                        if s_region_heat[s_idx] > heat:
                            heat = s_region_heat[s_idx]
                            key = s_fire_key[s_idx]
                        if s_region_heat[s_idx] == heat:
                            key = max(key, s_fire_key[s_idx])
        d_claim[d_idx] = key


class NucleationFire(Equation):
    """A region fires if its claim is the strongest one on all of its members.

    Source: ours, a maximum over the neighbours of neighbours, found in two passes.

    Parameters
    ----------
    radius : float   As :class:`NucleationRegion`.

    Reads    d_region_heat [2^-24 m_p L], d_fire_key, s_claim, s_phase, positions.   Writes   d_fires, own index only.
    Needs    NucleationClaim in an earlier group.
    """

    def __init__(self, dest, sources, radius):
        self.radius2 = float(radius) * float(radius)
        super().__init__(dest, sources)

    def loop_all(self, d_idx, d_region_heat, d_fire_key, d_fires, d_x, d_y, d_z, s_phase, s_claim, s_x, s_y, s_z,
                 NBRS, N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        d_fires[d_idx] = 0
        if d_region_heat[d_idx] > 0.0:
            d_fires[d_idx] = 1
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                if s_phase[s_idx] == 2:
                    rx = d_x[d_idx] - s_x[s_idx]
                    ry = d_y[d_idx] - s_y[s_idx]
                    rz = d_z[d_idx] - s_z[s_idx]
                    if rx*rx + ry*ry + rz*rz < self.radius2:
                        if s_claim[s_idx] != d_fire_key[d_idx]:
                            d_fires[d_idx] = 0


class NucleationChoice(Equation):
    r"""Chooses the members of a firing region that become vapour, and the enthalpies of its members afterwards.

    Members are taken in the order of their keys while :math:`\sum m (L - e^{held}) \le Q`; those with a key up to
    ``cut`` are chosen. Sorting by random keys has the distribution of a Fisher-Yates shuffle. The chosen members get L;
    the others keep the latent heat they hold and share the remaining sensible heat so that all are equally hot,

    .. math::  e - e^{held} = w \Big(Q - \sum_{chosen} m (L - e^{held})\Big) / \sum_{others} w m

    If there are no others, the chosen share it. If already the first member needs too much heat, the region does not
    fire.

    Source: the paper, section 3.2.2, eqs. 4, 6 and 7, for any masses; held latent heat is only used by its particle.

    Parameters
    ----------
    radius, m_p, L, c_l, c_v : float   As :class:`NucleationRegion`.

    Reads    d_region_heat [2^-24 m_p L], s_pick_key, s_phase, s_m [kg], s_e, s_held [J/kg], positions.
    Writes   d_fires, d_fired (count), d_cut (-1 if the region does not fire), d_e_chosen (enthalpy), d_e_others
    (sensible heat of liquid as hot as the others) [J/kg], own index only.
    Needs    NucleationFire before it in the same group.
    Limits   Q is exact to 2^-25 m_p L for each member, so if Q is only just enough for the chosen members, the others
    may end some J/kg (1 mK) below saturation.
    """

    def __init__(self, dest, sources, radius, m_p, L, c_l, c_v):
        self.radius2 = float(radius) * float(radius)
        self.m_p = float(m_p)
        self.L = float(L)
        self.c_l = float(c_l)
        self.c_v = float(c_v)
        super().__init__(dest, sources)

    def _get_helpers_(self):
        return [boiling_capacity, nucleation_units]

    def loop_all(self, d_idx, d_region_heat, d_fires, d_fired, d_cut, d_e_chosen, d_e_others, d_x, d_y, d_z,
                 s_pick_key, s_phase, s_m, s_e, s_held, s_x, s_y, s_z, NBRS, N_NBRS):
        i = declare('int')
        more = declare('int')
        s_idx = declare('long')
        cut = -1.0
        taken = 0.0
        heat = 0.0
        price = 0.0
        chosen = 0.0
        others = 0.0
        more = d_fires[d_idx]
        while more == 1:
            key = 4294967296.0
            units = 0.0
            heat = 0.0
            price = 0.0
            chosen = 0.0
            others = 0.0
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                if s_phase[s_idx] == 2:
                    rx = d_x[d_idx] - s_x[s_idx]
                    ry = d_y[d_idx] - s_y[s_idx]
                    rz = d_z[d_idx] - s_z[s_idx]
                    if rx*rx + ry*ry + rz*rz < self.radius2:
                        heat += s_m[s_idx] * (s_e[s_idx] - s_held[s_idx])
                        if s_pick_key[s_idx] > cut:
                            c = boiling_capacity(s_held[s_idx], self.L, self.c_l, self.c_v)
                            others += s_m[s_idx] * (c/self.c_l)
                            if s_pick_key[s_idx] < key:
                                key = s_pick_key[s_idx]
                                units = nucleation_units(s_m[s_idx] / self.m_p * (self.L - s_held[s_idx]) / self.L)
                        else:
                            chosen += s_m[s_idx]
                            price += s_m[s_idx] * (self.L - s_held[s_idx])
            more = 0
            if others > 0.0 and taken + units <= d_region_heat[d_idx]:
                more = 1
                cut = key
                taken += units
        d_cut[d_idx] = cut
        if cut < 0.0:
            d_fires[d_idx] = 0
        else:
            d_fired[d_idx] += 1
            d_e_chosen[d_idx] = self.L
            if others > 0.0:
                d_e_others[d_idx] = (heat - price) / others
            else:
                d_e_chosen[d_idx] = self.L + (heat - price) / chosen


class NucleationShare(PhaseEquation):
    """Gives members of a firing region their new enthalpy; the chosen become vapour, the others stay superheated.

    Source: the paper, section 3.2.2.

    Parameters
    ----------
    radius : float                           As :class:`NucleationRegion`.
    T_sat, L, c_l, c_v, subcooling : float   As :class:`PhaseEquation`.

    Reads    s_cut, s_e_chosen, s_e_others, d_held [J/kg], d_pick_key, positions.   Writes   d_e [J/kg], d_phase,
    d_T [K], d_member (regions that fire and hold the particle: 0 or 1), d_burst (count), own index only.
    Needs    NucleationChoice in an earlier group.
    """

    def __init__(self, dest, sources, radius, T_sat, L, c_l, c_v, subcooling=1.0):
        self.radius2 = float(radius) * float(radius)
        super().__init__(dest, sources, T_sat, L, c_l, c_v, subcooling)

    def loop_all(self, d_idx, d_pick_key, d_phase, d_e, d_held, d_T, d_member, d_burst, d_x, d_y, d_z, s_cut,
                 s_e_chosen, s_e_others, s_x, s_y, s_z, NBRS, N_NBRS):
        i = declare('int')
        state = declare('int')
        s_idx = declare('long')
        d_member[d_idx] = 0
        if d_phase[d_idx] == 2:
            state = 2
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                if s_cut[s_idx] >= 0.0:
                    rx = d_x[d_idx] - s_x[s_idx]
                    ry = d_y[d_idx] - s_y[s_idx]
                    rz = d_z[d_idx] - s_z[s_idx]
                    if rx*rx + ry*ry + rz*rz < self.radius2:
                        d_member[d_idx] += 1
                        c = boiling_capacity(d_held[d_idx], self.L, self.c_l, self.c_v)
                        d_e[d_idx] = d_held[d_idx] + s_e_others[s_idx] * (c/self.c_l)
                        if d_pick_key[d_idx] <= s_cut[s_idx]:
                            d_e[d_idx] = s_e_chosen[s_idx]
                            state = 3
            if d_member[d_idx] > 0:
                d_phase[d_idx] = state
                d_T[d_idx] = boiling_temperature(d_e[d_idx], d_held[d_idx], state, self.T_sat, self.L, self.c_l,
                                                 self.c_v, self.subcooling)
            if state == 3:
                d_burst[d_idx] += 1


class NucleationRelease(Equation):
    """Members of a firing region that become vapour release their held latent heat; the others keep it (``"hold"``).

    Source: ours.
    Reads    d_member, d_phase, d_held [J/kg].   Writes   d_e_lat [J/kg], own index only.
    Needs    NucleationShare in the same group.
    """

    def post_loop(self, d_idx, d_member, d_phase, d_held, d_e_lat):
        if d_member[d_idx] > 0:
            d_e_lat[d_idx] = d_held[d_idx]
            if d_phase[d_idx] == 3:
                d_e_lat[d_idx] = 0.0

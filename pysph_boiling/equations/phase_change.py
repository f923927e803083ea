"""Phases: temperature by state, the kinetic condition, and every edge of the state machine.

The table of edges is :data:`pysph_boiling.phases.EDGES`. One group finds the kinetic condition from the states of the
neighbours, and the next one writes the new states. The integers are those of :class:`pysph_boiling.phases.Phase`:
0 liquid, 1 transition, 2 superheated, 3 vapour.
"""
from math import sqrt

from compyle.api import declare
from pysph.sph.equation import Equation

from pysph_boiling.equations.helpers import boiling_capacity, boiling_temperature

__all__ = [
    "PhaseEdges", "PhaseEquation", "PhaseKineticReset", "PhaseTemperature", "PhaseTemperatureAfter",
    "PhaseVapourCondition",
]


class PhaseEquation(Equation):
    """Base of the equations that set temperatures, with the constants of :func:`boiling_temperature`; it has no kernel.

    Parameters
    ----------
    T_sat : float      Saturation temperature [K].
    L : float          Latent heat [J/kg].
    c_l, c_v : float   Specific heat capacity of liquid and vapour [J/(kg K)].
    subcooling : float  Fraction of the deficit L - e of vapour that lowers its temperature [-]: 1, or 0 if the deficit
        is latent heat.

    Source, Reads, Writes   those of the equations that derive from it.
    """

    def __init__(self, dest, sources, T_sat, L, c_l, c_v, subcooling=1.0):
        self.T_sat = float(T_sat)
        self.L = float(L)
        self.c_l = float(c_l)
        self.c_v = float(c_v)
        self.subcooling = float(subcooling)
        super().__init__(dest, sources)

    def _get_helpers_(self):
        return [boiling_capacity, boiling_temperature]


class PhaseTemperature(PhaseEquation):
    r"""Temperature and conductivity of each particle by its phase; resets ``ae``.

    The temperature of superheated liquid is T_sat for 0 <= e <= e_lat and T_sat + (e - e_lat)/c above, where e_lat is
    the latent heat held since an interruption, and c = c_l + (c_v - c_l) e_lat/L that of a mixture with vapour. Its
    conductivity is k_l c/c_l, so its diffusivity is that of liquid, and the heat step needs to be no shorter.

    Source: the paper, Table 2 and eq. 3: sensible heat changes T, latent heat does not. Held heat is ours: with e_lat =
    0, as in the paper, the temperature can jump by up to L/c_l = 535 K at an interruption.

    Parameters
    ----------
    T_sat, L, c_l, c_v, subcooling : float   As :class:`PhaseEquation`.
    k_l, k_v : float   Thermal conductivity of liquid and vapour [W/(m K)].

    Reads    d_e, d_e_lat [J/kg], d_phase.   Writes   d_T [K], d_k [W/(m K)], d_ae [J/(kg s)], own index only.
    """

    def __init__(self, dest, sources, T_sat, L, c_l, c_v, k_l, k_v, subcooling=1.0):
        self.k_l = float(k_l)
        self.k_v = float(k_v)
        super().__init__(dest, sources, T_sat, L, c_l, c_v, subcooling)

    def initialize(self, d_idx, d_e, d_e_lat, d_phase, d_T, d_k, d_ae):
        d_T[d_idx] = boiling_temperature(d_e[d_idx], d_e_lat[d_idx], d_phase[d_idx], self.T_sat, self.L, self.c_l,
                                         self.c_v, self.subcooling)
        d_k[d_idx] = self.k_l
        if d_phase[d_idx] == 2:
            c = boiling_capacity(min(d_e[d_idx], d_e_lat[d_idx]), self.L, self.c_l, self.c_v)
            d_k[d_idx] = self.k_l * (c/self.c_l)
        if d_phase[d_idx] == 3:
            d_k[d_idx] = self.k_v
        d_ae[d_idx] = 0.0


class PhaseTemperatureAfter(PhaseEquation):
    """Temperature again, after ``HeatUpdate`` in the same group, so that T always fits e.

    Source: ours.

    Parameters
    ----------
    T_sat, L, c_l, c_v, subcooling : float   As :class:`PhaseEquation`.

    Reads    d_e, d_e_lat [J/kg], d_phase.   Writes   d_T [K], own index only.
    Needs    HeatUpdate before it in the same group.
    """

    def post_loop(self, d_idx, d_e, d_e_lat, d_phase, d_T):
        d_T[d_idx] = boiling_temperature(d_e[d_idx], d_e_lat[d_idx], d_phase[d_idx], self.T_sat, self.L, self.c_l,
                                         self.c_v, self.subcooling)


class PhaseKineticReset(Equation):
    """Resets the kinetic condition to false, or to true everywhere as in the model of Gu et al.

    Source: the paper, section 3.3.2 (kinetic condition) and Table 1.

    Parameters
    ----------
    near : bool   Whether the condition holds everywhere.

    Reads nothing.   Writes   d_kinetic, own index only.
    """

    def __init__(self, dest, sources, near=False):
        self.near = float(near)
        super().__init__(dest, sources)

    def initialize(self, d_idx, d_kinetic):
        d_kinetic[d_idx] = 0
        if self.near > 0.5:
            d_kinetic[d_idx] = 1


class PhaseVapourCondition(Equation):
    """Kinetic condition from vapour: the first layer of liquid at or above saturation round a bubble.

    These are particles within ``radius`` of vapour, with no liquid between them and the nearest vapour particle. One is
    between them if it is nearer to both than they are to each other by more than 1 % (the relative neighbourhood graph
    of Toussaint 1980; the margin is for lattices, where distances are equal up to round-off). A second layer at T_sat
    would make a bubble gather heat as if it were larger by that layer.

    Source: ours; without it a bubble cannot grow away from its site (the paper only mentions sites).

    Parameters
    ----------
    radius : float   Kinetic radius [m], > 0; 1.0 to 1.5 spacings.

    Reads    d_e [J/kg], d_phase, s_phase, positions.   Writes   d_kinetic; d_vapour_distance, of the nearest vapour in
    reach [m], 0 where there is none, or only liquid below saturation; own index only.
    Needs    PhaseKineticReset in the same group.   Errors   ValueError if radius <= 0.
    """

    def __init__(self, dest, sources, radius):
        if not radius > 0.0:
            raise ValueError(f"kinetic radius must be > 0 m, got {radius} m")
        self.radius2 = float(radius) * float(radius)
        super().__init__(dest, sources)

    def loop_all(self, d_idx, d_e, d_phase, d_kinetic, d_vapour_distance, d_x, d_y, d_z, s_phase, s_x, s_y, s_z, NBRS,
                 N_NBRS):
        i = declare('int')
        found = declare('int')
        s_idx = declare('long')
        nearest = declare('long')
        best = self.radius2
        found = 0
        nearest = 0
        d_vapour_distance[d_idx] = 0.0
        if d_phase[d_idx] != 3:
            if d_e[d_idx] >= 0.0:
                for i in range(N_NBRS):
                    s_idx = NBRS[i]
                    if s_phase[s_idx] == 3:
                        rx = d_x[d_idx] - s_x[s_idx]
                        ry = d_y[d_idx] - s_y[s_idx]
                        rz = d_z[d_idx] - s_z[s_idx]
                        r2 = rx*rx + ry*ry + rz*rz
                        if r2 < best:
                            best = r2
                            nearest = s_idx
                            found = 1
        if found == 1:
            d_vapour_distance[d_idx] = sqrt(best)
            best = 0.98 * best
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                if s_phase[s_idx] != 3:
                    rx = d_x[d_idx] - s_x[s_idx]
                    ry = d_y[d_idx] - s_y[s_idx]
                    rz = d_z[d_idx] - s_z[s_idx]
                    r2 = rx*rx + ry*ry + rz*rz
                    rx = s_x[nearest] - s_x[s_idx]
                    ry = s_y[nearest] - s_y[s_idx]
                    rz = s_z[nearest] - s_z[s_idx]
                    if max(r2, rx*rx + ry*ry + rz*rz) < best:
                        found = 0
            if found == 1:
                d_kinetic[d_idx] = 1


class PhaseEdges(PhaseEquation):
    """The new state from the old one, the enthalpy and the kinetic condition; ``e`` never changes.

    At an interruption stored latent heat turns into sensible heat, as in the paper; or, with ``hold``, e_lat is set to
    e, so that the temperature stays at T_sat. Held heat is reset when the transition resumes, when the particle cools
    below saturation, or when it becomes vapour.

    Source: the paper, section 3.3.2 and Fig. 2, with the missing edges of :data:`pysph_boiling.phases.EDGES`; ours with
    ``hold``.

    Parameters
    ----------
    T_sat, L, c_l, c_v, subcooling : float   As :class:`PhaseEquation`.
    hold : bool   Whether latent heat is held at an interruption.

    Reads    d_e [J/kg], d_kinetic.   Writes   d_phase, d_e_lat [J/kg], d_T [K], d_vaporised, d_interrupted, own index
    only.   Needs   the kinetic condition in an earlier group.
    Limits   Without ``hold`` the temperature may jump by up to L/c_l at an interruption. Held heat does not show in the
    temperature; the column ``energy_hidden`` of the results reports it.
    """

    def __init__(self, dest, sources, T_sat, L, c_l, c_v, subcooling=1.0, hold=True):
        self.hold = float(hold)
        super().__init__(dest, sources, T_sat, L, c_l, c_v, subcooling)

    def post_loop(self, d_idx, d_e, d_e_lat, d_phase, d_kinetic, d_T, d_vaporised, d_interrupted):
        old = declare('int')
        state = declare('int')
        old = d_phase[d_idx]
        state = old
        if old != 3:
            if d_e[d_idx] < 0.0:
                state = 0
                d_e_lat[d_idx] = 0.0
            else:
                if old == 1:
                    if d_e[d_idx] >= self.L:
                        state = 3
                        d_e_lat[d_idx] = 0.0
                        d_vaporised[d_idx] += 1
                    else:
                        if d_kinetic[d_idx] == 0:
                            state = 2
                            d_interrupted[d_idx] += 1
                            if self.hold > 0.5:
                                d_e_lat[d_idx] = d_e[d_idx]
                else:
                    state = 2
                    if d_kinetic[d_idx] == 1:
                        state = 1
                        d_e_lat[d_idx] = 0.0
        d_phase[d_idx] = state
        d_T[d_idx] = boiling_temperature(d_e[d_idx], d_e_lat[d_idx], state, self.T_sat, self.L, self.c_l, self.c_v,
                                         self.subcooling)

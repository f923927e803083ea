"""Nucleation at preset sites: the kinetic condition near them, and their attraction of liquid."""
from math import sqrt

from compyle.api import declare
from pysph.sph.equation import Equation

from pysph_boiling.equations.helpers import boiling_uniform

__all__ = ["NucleationActivation", "NucleationDormancy", "NucleationSiteAttraction", "NucleationSiteCondition"]


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


class NucleationActivation(Equation):
    r"""Wakes a dormant site when the liquid over it is hot enough, and puts it to sleep when its bubble has departed.

    A site is dormant (``awake`` is 0) until superheated liquid over it has reached its activation superheat:

    .. math::  T \ge T_{sat} + \Delta T_a \left(1 + \xi (1/\epsilon - 1)\right)

    Here xi is a random number from 0 to 1, drawn anew for each bubble: the embryo that a bubble leaves has a radius
    between that of the mouth of the cavity and epsilon times that. The liquid is that between ``radius`` and ``reach``
    from the site, within 45 degrees of the vertical.

    Then the site is awake, and ``awake`` is 1 plus the largest number of vapour particles that have been within
    ``reach`` since. Its bubble has departed when there is no vapour between ``radius`` and ``reach``, and at most half
    of that number within ``radius``. What is left there is the embryo, and the site is dormant again. It is also
    dormant again when all that is within ``radius`` has cooled below saturation.

    Source: Griffith & Wallis 1960 and Hsu 1962: a cavity is active, and its waiting time ends, when the liquid at the
    tip of the embryo is hot enough. The states and the random numbers are ours.

    Parameters
    ----------
    radius : float   Radius of a site [m], > 0; an embryo is as high as this.
    reach : float    Distance up to which vapour is a bubble of the site [m], > radius.
    embryo : float   epsilon [-], > 0 and <= 1; at 1 a site always needs the same superheat.
    seed : int       Seed of the random numbers.
    T_sat : float    Saturation temperature [K].
    ux, uy, uz : float   Unit vector that points upwards [-].

    Reads    d_activation (dT_a) [K], s_phase, s_T [K], positions.   Writes   d_awake, d_drawn, own index only.
    Needs    PhaseEdges in an earlier group.
    Errors   ValueError if radius <= 0, reach <= radius, embryo <= 0 or embryo > 1.
    """

    def __init__(self, dest, sources, radius, reach, embryo, seed, T_sat, ux, uy, uz):
        if not 0.0 < radius < reach:
            raise ValueError(f"radius and reach of a site must be 0 < radius < reach, got {radius} m and {reach} m")
        if not 0.0 < embryo <= 1.0:
            raise ValueError(f"embryo must be > 0 and <= 1, got {embryo}")
        self.radius2 = float(radius) * float(radius)
        self.reach2 = float(reach) * float(reach)
        self.spread = 1.0 / float(embryo) - 1.0
        self.seed = int(seed)
        self.T_sat = float(T_sat)
        self.ux, self.uy, self.uz = float(ux), float(uy), float(uz)
        super().__init__(dest, sources)

    def _get_helpers_(self):
        return [boiling_uniform]

    def loop_all(self, d_idx, d_activation, d_awake, d_drawn, d_x, d_y, d_z, s_phase, s_T, s_x, s_y, s_z, NBRS, N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        hot = declare('int')
        vapour = declare('int')
        beyond = declare('int')
        boils = declare('int')
        hot = 0
        vapour = 0
        beyond = 0
        boils = 0
        needed = 0.5 + 0.5*boiling_uniform(d_drawn[d_idx], self.seed)
        needed = self.T_sat + d_activation[d_idx]*(1.0 + self.spread*needed)
        for i in range(N_NBRS):
            s_idx = NBRS[i]
            rx = d_x[d_idx] - s_x[s_idx]
            ry = d_y[d_idx] - s_y[s_idx]
            rz = d_z[d_idx] - s_z[s_idx]
            r2 = rx*rx + ry*ry + rz*rz
            if r2 < self.radius2:
                if s_phase[s_idx] != 0:
                    boils = 1
                if s_phase[s_idx] == 3:
                    vapour += 1
            elif r2 < self.reach2:
                if s_phase[s_idx] == 3:
                    vapour += 1
                    beyond = 1
                if s_phase[s_idx] == 2:
                    if s_T[s_idx] >= needed:
                        up = -(rx*self.ux + ry*self.uy + rz*self.uz)
                        if up > 0.0:
                            if 2.0*up*up >= r2:
                                hot = 1
        if d_awake[d_idx] == 0:
            if hot == 1:
                d_awake[d_idx] = 1 + vapour
        else:
            if d_awake[d_idx] <= vapour:
                d_awake[d_idx] = 1 + vapour
            if boils == 0:
                d_awake[d_idx] = 0
            elif d_awake[d_idx] > 1:
                if beyond == 0:
                    if 2*vapour < d_awake[d_idx]:
                        d_awake[d_idx] = 0
            if d_awake[d_idx] == 0:
                d_drawn[d_idx] += 1


class NucleationDormancy(Equation):
    """The kinetic condition fails within ``reach`` of a dormant site, also next to the vapour at it.

    Source: ours, after Hsu 1962: an embryo that has stayed in the cavity does not grow before the site is active.

    Parameters
    ----------
    reach : float   Distance from the site up to which it acts [m], > 0.

    Reads    s_awake, positions.   Writes   d_kinetic, own index only.
    Needs    PhaseVapourCondition and NucleationSiteCondition in an earlier group.   Errors   ValueError if reach <= 0.
    """

    def __init__(self, dest, sources, reach):
        if not reach > 0.0:
            raise ValueError(f"reach of a dormant site must be > 0 m, got {reach} m")
        self.reach = float(reach)
        super().__init__(dest, sources)

    def loop(self, d_idx, s_idx, d_kinetic, s_awake, RIJ):
        if RIJ < self.reach:
            if s_awake[s_idx] == 0:
                d_kinetic[d_idx] = 0


class NucleationSiteAttraction(Equation):
    r"""Attraction of nearby liquid towards the nearest site.

    .. math::  a_i = a_s (1 - r/r_a)^2 \,\hat{n}_{i \to s}, \qquad r < r_a

    Source: the paper, section 3.2.1, mentions the attraction without a formula; the formula is ours. With
    ``transition`` only liquid in transition is attracted, after Gu et al. as told in the paper, section 2.2.

    Parameters
    ----------
    strength : float    a_s [m/s^2], >= 0.
    radius : float      r_a [m], > 0.
    transition : bool   Whether only liquid in transition is attracted.

    Reads    d_phase, positions.   Writes   d_au, d_av, d_aw [m/s^2], own index only.
    Errors   ValueError if strength < 0 or radius <= 0.   Limits   Sites do not recoil; the wall takes up the momentum.
    """

    def __init__(self, dest, sources, strength, radius, transition=False):
        if not strength >= 0.0:
            raise ValueError(f"strength of the attraction must be >= 0 m/s^2, got {strength}")
        if not radius > 0.0:
            raise ValueError(f"radius of the attraction must be > 0 m, got {radius} m")
        self.strength = float(strength)
        self.radius = float(radius)
        self.first = float(1 if transition else 0)
        self.last = float(1 if transition else 2)
        super().__init__(dest, sources)

    def loop_all(self, d_idx, d_au, d_av, d_aw, d_phase, d_x, d_y, d_z, s_x, s_y, s_z, NBRS, N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        nearest = declare('long')
        best = self.radius*self.radius
        nearest = -1
        if d_phase[d_idx] >= self.first and d_phase[d_idx] <= self.last:
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

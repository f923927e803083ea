"""Vapour at the free surface: which liquid is a film above a bubble, which vapour is free, and how free vapour moves.

There are two passes over an upward cone: liquid with an empty cone is film, and vapour with nothing but film in its
cone is free. After the step, the host decides what happens to the bubble: it leaves, or a lid returns it as liquid
(:class:`pysph_boiling.schemes.effects.venting.VentingTool`).
"""
from math import sqrt

from compyle.api import declare
from pysph.sph.equation import Equation

__all__ = ["VentingCone", "VentingFilm", "VentingFree", "VentingRelease"]


class VentingCone(Equation):
    """Base of the equations that look into an upward cone; it has no kernel.

    Parameters
    ----------
    ux, uy, uz : float         Unit vector upwards [-].
    cone_cosine : float        Opening of the cone: z > cone_cosine r [-], in (0, 1).
    min_cover_height : float   Particles lower than this above the particle do not count [m], >= 0.

    Source, Reads, Writes   those of the equations that derive from it.
    Errors   ValueError if cone_cosine is not in (0, 1) or min_cover_height < 0.
    """

    def __init__(self, dest, sources, ux, uy, uz, cone_cosine, min_cover_height):
        if not 0.0 < cone_cosine < 1.0:
            raise ValueError(f"cone_cosine must lie in (0, 1), got {cone_cosine}")
        if not min_cover_height >= 0.0:
            raise ValueError(f"min_cover_height must be >= 0 m, got {min_cover_height} m")
        self.ux = float(ux)
        self.uy = float(uy)
        self.uz = float(uz)
        self.cone_cosine = float(cone_cosine)
        self.min_cover_height = float(min_cover_height)
        super().__init__(dest, sources)


class VentingFilm(VentingCone):
    """Marks liquid at the free surface as film: there is no particle in its upward cone.

    Source: ours. A bubble under a film of liquid must be able to burst; with the rule "no liquid above", bubbles of
    more than 10 particles never leave.

    Parameters
    ----------
    ux, uy, uz, cone_cosine, min_cover_height : float   As :class:`VentingCone`.

    Reads    d_phase, positions.   Writes   d_film (0 or 1), own index only.
    """

    def initialize(self, d_idx, d_phase, d_film):
        d_film[d_idx] = 1
        if d_phase[d_idx] == 3:
            d_film[d_idx] = 0

    def loop_all(self, d_idx, d_film, d_h, d_x, d_y, d_z, s_x, s_y, s_z, NBRS, N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        if d_film[d_idx] == 1:
            for i in range(N_NBRS):
                s_idx = NBRS[N_NBRS - 1 - i]  # who lies above comes last in most lists, and one is enough
                rx = s_x[s_idx] - d_x[d_idx]
                ry = s_y[s_idx] - d_y[d_idx]
                rz = s_z[s_idx] - d_z[d_idx]
                up = rx*self.ux + ry*self.uy + rz*self.uz
                r2 = rx*rx + ry*ry + rz*rz
                if up > self.min_cover_height:
                    if r2 < 4.0*d_h[d_idx]*d_h[d_idx]:
                        if up > self.cone_cosine*sqrt(r2):
                            d_film[d_idx] = 0
                            break


class VentingFree(VentingCone):
    """Marks vapour as covered if there is something other than film in its upward cone.

    Source: ours (see :class:`VentingFilm`).

    Parameters
    ----------
    ux, uy, uz, cone_cosine, min_cover_height : float   As :class:`VentingCone`.

    Reads    d_phase, s_film, positions.   Writes   d_covered (0 or 1), own index only.
    Needs    VentingFilm in an earlier group.
    """

    def initialize(self, d_idx, d_phase, d_covered):
        d_covered[d_idx] = 1
        if d_phase[d_idx] == 3:
            d_covered[d_idx] = 0

    def loop_all(self, d_idx, d_covered, d_h, d_x, d_y, d_z, s_film, s_x, s_y, s_z, NBRS, N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        if d_covered[d_idx] == 0:
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                if s_film[s_idx] == 0:
                    rx = s_x[s_idx] - d_x[d_idx]
                    ry = s_y[s_idx] - d_y[d_idx]
                    rz = s_z[s_idx] - d_z[d_idx]
                    up = rx*self.ux + ry*self.uy + rz*self.uz
                    r2 = rx*rx + ry*ry + rz*rz
                    if up > self.min_cover_height:
                        if r2 < 4.0*d_h[d_idx]*d_h[d_idx]:
                            if up > self.cone_cosine*sqrt(r2):
                                d_covered[d_idx] = 1


class VentingRelease(Equation):
    """Lets only gravity act on free vapour, and counts its free steps; it comes last in the force stage.

    Source: ours; with buoyancy, free vapour would fly out of the pool.

    Parameters
    ----------
    gx, gy, gz : float   Gravity [m/s^2].

    Reads    d_phase, d_covered.   Writes   d_free (steps in a row for which vapour has been free), d_au, d_av, d_aw
    [m/s^2], own index only.   Needs   VentingFree earlier in the step, if there is any vapour.
    """

    def __init__(self, dest, sources, gx=0.0, gy=0.0, gz=0.0):
        self.gx = float(gx)
        self.gy = float(gy)
        self.gz = float(gz)
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_phase, d_covered, d_free, d_au, d_av, d_aw):
        if d_phase[d_idx] != 3:
            d_free[d_idx] = 0
        else:
            if d_covered[d_idx] == 1:
                d_free[d_idx] = 0
            else:
                d_free[d_idx] += 1
                d_au[d_idx] = self.gx
                d_av[d_idx] = self.gy
                d_aw[d_idx] = self.gz

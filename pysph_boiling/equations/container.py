"""Analytic containers: particles that have left a box or an upright cylinder are moved back inside, and counted.

Before the density sweeps this is the contact of predicted positions with a wall, which a particle below rest density
would not feel otherwise. In the sweeps it is a safeguard against corrections that push water through a wall.
"""
from math import sqrt

from pysph.sph.equation import Equation

__all__ = ["PBFBoxContainer", "PBFCylinderContainer"]


class PBFBoxContainer(Equation):
    r"""Clamps positions to an axis-aligned box.

    Source: projection onto a convex set, the collision response of Macklin & Müller 2013 (Algorithm 1, line 14).

    Parameters
    ----------
    lower, upper : three floats   Corners [m], lower < upper in every direction that is not fixed by the dimension.
    depth : float                 Being moved back by up to this distance [m] counts as a contact, by more as a
        projection.

    Reads    constant ``prior`` [-].
    Reads and writes   d_x, d_y, d_z, d_sx, d_sy, d_sz [m], d_contacts, d_projected, own index only.
    Needs    in the sweeps, PBFMove before it in the same group.   Errors   ValueError if lower > upper along an axis.
    Limits   No friction and no bounce; momentum given to the wall is not recorded.
    """

    def __init__(self, dest, sources, lower, upper, depth):
        for axis, low, high in zip("xyz", lower, upper):
            if not low <= high:
                raise ValueError(f"box container: lower {axis} = {low} m is above upper {axis} = {high} m")
        self.depth = float(depth)
        self.x0 = float(lower[0])
        self.y0 = float(lower[1])
        self.z0 = float(lower[2])
        self.x1 = float(upper[0])
        self.y1 = float(upper[1])
        self.z1 = float(upper[2])
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_x, d_y, d_z, d_sx, d_sy, d_sz, d_prior, d_contacts, d_projected):
        x = min(max(d_x[d_idx], self.x0), self.x1)
        y = min(max(d_y[d_idx], self.y0), self.y1)
        z = min(max(d_z[d_idx], self.z0), self.z1)
        dx = x - d_x[d_idx]
        dy = y - d_y[d_idx]
        dz = z - d_z[d_idx]
        moved = sqrt(dx*dx + dy*dy + dz*dz)
        if moved > 0.0:
            d_sx[d_idx] += d_prior[1] * dx
            d_sy[d_idx] += d_prior[1] * dy
            d_sz[d_idx] += d_prior[1] * dz
            d_x[d_idx] = x
            d_y[d_idx] = y
            d_z[d_idx] = z
            if moved > self.depth:
                d_projected[d_idx] += 1
            else:
                d_contacts[d_idx] += 1


class PBFCylinderContainer(Equation):
    r"""Projects positions into an upright cylinder; in 2-D its section through the axis, ``|x - cx| <= radius``.

    Source: projection onto a convex set, as for the box.

    Parameters
    ----------
    centre : two floats     Axis position (x, y) [m]; in 2-D only x is used.
    radius : float          Radius [m], > 0.
    bottom, top : float     Ends along the vertical (y in 2-D, z in 3-D) [m], bottom < top.
    depth : float           As for the box [m].
    dim : int               2 or 3.

    Reads    constant ``prior`` [-].
    Reads and writes   d_x, d_y, d_z, d_sx, d_sy, d_sz [m], d_contacts, d_projected, own index only.
    Needs    in the sweeps, PBFMove before it in the same group.   Errors   ValueError if radius <= 0 or bottom >= top.
    Limits   As for the box.
    """

    def __init__(self, dest, sources, centre, radius, bottom, top, depth, dim):
        if not radius > 0.0:
            raise ValueError(f"cylinder container: radius must be > 0 m, got {radius} m")
        if not bottom < top:
            raise ValueError(f"cylinder container: bottom {bottom} m is not below top {top} m")
        self.depth = float(depth)
        self.cx = float(centre[0])
        self.cy = float(centre[1])
        self.radius = float(radius)
        self.bottom = float(bottom)
        self.top = float(top)
        self.deep = float(dim == 3)
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_x, d_y, d_z, d_sx, d_sy, d_sz, d_prior, d_contacts, d_projected):
        x = d_x[d_idx]
        y = d_y[d_idx]
        z = d_z[d_idx]
        rx = x - self.cx
        ry = self.deep * (y - self.cy)
        r = sqrt(rx*rx + ry*ry)
        if r > self.radius:
            x = self.cx + rx * self.radius / r
            if self.deep > 0.5:
                y = self.cy + ry * self.radius / r
        if self.deep > 0.5:
            z = min(max(z, self.bottom), self.top)
        else:
            y = min(max(y, self.bottom), self.top)
        dx = x - d_x[d_idx]
        dy = y - d_y[d_idx]
        dz = z - d_z[d_idx]
        moved = sqrt(dx*dx + dy*dy + dz*dz)
        if moved > 0.0:
            d_sx[d_idx] += d_prior[1] * dx
            d_sy[d_idx] += d_prior[1] * dy
            d_sz[d_idx] += d_prior[1] * dz
            d_x[d_idx] = x
            d_y[d_idx] = y
            d_z[d_idx] = z
            if moved > self.depth:
                d_projected[d_idx] += 1
            else:
                d_contacts[d_idx] += 1

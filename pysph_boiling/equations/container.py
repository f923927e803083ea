"""Analytic containers: project particles that left a box or an upright cylinder back to its inside, and count them."""
from math import sqrt

from pysph.sph.equation import Equation

__all__ = ["PBFBoxContainer", "PBFCylinderContainer"]


class PBFBoxContainer(Equation):
    r"""Clamp positions to an axis-aligned box.

    Source: projection onto a convex set, the collision response of Macklin & Müller 2013 (Algorithm 1, line 14).

    Parameters
    ----------
    lower, upper : three floats   Corners [m], lower < upper in every direction that is not fixed by the dimension.

    Reads and writes   d_x, d_y, d_z, d_sx, d_sy, d_sz [m], d_projected, own index only.
    Needs    PBFMove before it in the same group.   Errors   ValueError if lower > upper in some direction.
    Limits   No friction and no bounce; momentum given to the wall is not recorded.
    """

    def __init__(self, dest, sources, lower, upper):
        for axis, low, high in zip("xyz", lower, upper):
            if not low <= high:
                raise ValueError(f"box container: lower {axis} = {low} m is above upper {axis} = {high} m")
        self.x0 = float(lower[0])
        self.y0 = float(lower[1])
        self.z0 = float(lower[2])
        self.x1 = float(upper[0])
        self.y1 = float(upper[1])
        self.z1 = float(upper[2])
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_x, d_y, d_z, d_sx, d_sy, d_sz, d_projected):
        x = min(max(d_x[d_idx], self.x0), self.x1)
        y = min(max(d_y[d_idx], self.y0), self.y1)
        z = min(max(d_z[d_idx], self.z0), self.z1)
        moved = abs(x - d_x[d_idx]) + abs(y - d_y[d_idx]) + abs(z - d_z[d_idx])
        if moved > 0.0:
            d_sx[d_idx] += x - d_x[d_idx]
            d_sy[d_idx] += y - d_y[d_idx]
            d_sz[d_idx] += z - d_z[d_idx]
            d_x[d_idx] = x
            d_y[d_idx] = y
            d_z[d_idx] = z
            d_projected[d_idx] += 1


class PBFCylinderContainer(Equation):
    r"""Project positions into an upright cylinder; in 2-D its section through the axis, ``|x - cx| <= radius``.

    Source: projection onto a convex set, as for the box.

    Parameters
    ----------
    centre : two floats     Axis position (x, y) [m]; in 2-D only x is used.
    radius : float          Radius [m], > 0.
    bottom, top : float     Ends along the vertical (y in 2-D, z in 3-D) [m], bottom < top.
    dim : int               2 or 3.

    Reads and writes   d_x, d_y, d_z, d_sx, d_sy, d_sz [m], d_projected, own index only.
    Needs    PBFMove before it in the same group.   Errors   ValueError if radius <= 0 or bottom >= top.
    Limits   As for the box.
    """

    def __init__(self, dest, sources, centre, radius, bottom, top, dim):
        if not radius > 0.0:
            raise ValueError(f"cylinder container: radius must be > 0 m, got {radius} m")
        if not bottom < top:
            raise ValueError(f"cylinder container: bottom {bottom} m is not below top {top} m")
        self.cx = float(centre[0])
        self.cy = float(centre[1])
        self.radius = float(radius)
        self.bottom = float(bottom)
        self.top = float(top)
        self.deep = float(dim == 3)
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_x, d_y, d_z, d_sx, d_sy, d_sz, d_projected):
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
        moved = abs(x - d_x[d_idx]) + abs(y - d_y[d_idx]) + abs(z - d_z[d_idx])
        if moved > 0.0:
            d_sx[d_idx] += x - d_x[d_idx]
            d_sy[d_idx] += y - d_y[d_idx]
            d_sz[d_idx] += z - d_z[d_idx]
            d_x[d_idx] = x
            d_y[d_idx] = y
            d_z[d_idx] = z
            d_projected[d_idx] += 1

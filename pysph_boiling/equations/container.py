"""Containers: particles that have left a box, an upright cylinder or any room are moved back inside, and counted.

Before the density sweeps this is the contact of predicted positions with a wall, which a particle below rest density
would not feel otherwise. In the sweeps it is a safeguard against corrections that push water through a wall.
"""
from math import sqrt

from compyle.api import declare
from pysph.sph.equation import Equation

__all__ = ["PBFBoxContainer", "PBFCylinderContainer", "PBFDistanceContainer"]


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


class PBFDistanceContainer(Equation):
    r"""Moves positions into a room that is given by its signed distance, along the gradient of the distance.

    The distance is linear between the nodes of a grid. A position less than ``inset`` inside moves by

    .. math::  \Delta x = (inset - d) \nabla d / \max(|\nabla d|^2, 1/4)

    up to four times, since corners take more than one.

    Source: ours; Newton's method on the distance.

    Parameters
    ----------
    room : Room     Signed distances on a grid (:class:`pysph_boiling.rooms.Room`); the kernel reads them from the
        constant ``room``.
    inset : float   Smallest distance from the surface [m], >= 0.
    depth : float   As for the box [m].

    Reads    constants ``prior`` [-], ``room`` [m], shape (nx ny nz,).
    Reads and writes   d_x, d_y, d_z, d_sx, d_sy, d_sz [m], d_contacts, d_projected, own index only.
    Needs    in the sweeps, PBFMove before it in the same group.   Errors   ValueError if inset < 0.
    Limits   As for the box. Edges are rounded by up to half a step of the grid. A position beyond the grid moves as if
        it were on its border, so it may take several calls to come back.
    """

    def __init__(self, dest, sources, room, inset, depth):
        if not inset >= 0.0:
            raise ValueError(f"distance container: inset must be >= 0 m, got {inset} m")
        self.ny = int(room.values.shape[1])
        self.nz = int(room.values.shape[2])
        self.end_x = float(room.values.shape[0] - 1) - 1e-9
        self.end_y = float(room.values.shape[1] - 1) - 1e-9
        self.end_z = float(room.values.shape[2] - 1) - 1e-9
        self.x0 = float(room.origin[0])
        self.y0 = float(room.origin[1])
        self.z0 = float(room.origin[2])
        self.per = 1.0 / float(room.step)
        self.inset = float(inset)
        self.depth = float(depth)
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_x, d_y, d_z, d_sx, d_sy, d_sz, d_prior, d_contacts, d_projected, d_room):
        turn = declare('int')
        i = declare('long')
        j = declare('long')
        k = declare('long')
        a = declare('long')
        b = declare('long')
        dx = 0.0
        dy = 0.0
        dz = 0.0
        missing = 1.0
        for turn in range(4):
            if missing > 0.0:
                fx = min(max((d_x[d_idx] + dx - self.x0) * self.per, 0.0), self.end_x)
                fy = min(max((d_y[d_idx] + dy - self.y0) * self.per, 0.0), self.end_y)
                fz = min(max((d_z[d_idx] + dz - self.z0) * self.per, 0.0), self.end_z)
                i = cast(fx, 'long')
                j = cast(fy, 'long')
                k = cast(fz, 'long')
                fx -= i
                fy -= j
                fz -= k
                a = (i*self.ny + j)*self.nz + k
                b = a + self.ny*self.nz
                x00 = d_room[b] - d_room[a]
                x01 = d_room[b + 1] - d_room[a + 1]
                x10 = d_room[b + self.nz] - d_room[a + self.nz]
                x11 = d_room[b + self.nz + 1] - d_room[a + self.nz + 1]
                y00 = d_room[a] + x00*fx
                y01 = d_room[a + 1] + x01*fx
                y10 = d_room[a + self.nz] + x10*fx - y00
                y11 = d_room[a + self.nz + 1] + x11*fx - y01
                z0 = y00 + y10*fy
                z1 = y01 + y11*fy - z0
                missing = self.inset - z0 - z1*fz
                if missing > 0.0:
                    gx = ((x00 + (x10 - x00)*fy)*(1.0 - fz) + (x01 + (x11 - x01)*fy)*fz) * self.per
                    gy = (y10*(1.0 - fz) + y11*fz) * self.per
                    gz = z1 * self.per
                    f = missing / max(gx*gx + gy*gy + gz*gz, 0.25)
                    dx += f*gx
                    dy += f*gy
                    dz += f*gz
        moved = sqrt(dx*dx + dy*dy + dz*dz)
        if moved > 0.0:
            d_sx[d_idx] += d_prior[1] * dx
            d_sy[d_idx] += d_prior[1] * dy
            d_sz[d_idx] += d_prior[1] * dz
            d_x[d_idx] += dx
            d_y[d_idx] += dy
            d_z[d_idx] += dz
            if moved > self.depth:
                d_projected[d_idx] += 1
            else:
                d_contacts[d_idx] += 1

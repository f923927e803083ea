"""Shapes: boxes, balls, cylinders and what is left between them, as signed distances; rooms for fluid and their walls.

A signed distance [m] is positive inside a shape and negative outside. A :class:`Room` holds one on a regular grid, so
that a container can look it up (:class:`~pysph_boiling.schemes.effects.DistanceContainer`).

Example: a ball with a radius of 5 cm.

>>> import numpy as np
>>> from pysph_boiling.rooms import Room, ball, wall_points
>>> room = Room.of(ball((0.0, 0.0, 0.0), 0.05), spacing=0.005)
>>> [round(float(d), 4) for d in room(np.array([[0.0, 0.02, 0.0], [0.06, 0.0, 0.0]]))]
[0.03, -0.01]
>>> round(room.volume / (4.0 / 3.0 * np.pi * 0.05**3), 2)
1.0
>>> walls = wall_points(room, spacing=0.005)
>>> bool(np.all(np.linalg.norm(walls, axis=1) > 0.05))
True
"""
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pysph_boiling.names import whole_number

__all__ = ["Room", "Shape", "ball", "box", "cylinder", "lattice", "wall_points"]

MARGIN = 3  # steps that the grid of a room reaches beyond it, besides the layers of its walls
MAX_NODES = 1 << 27  # of a grid: 1 GiB
CHUNK = 1 << 18  # points that are looked at together


@dataclass(frozen=True)
class Shape:
    """A region in space: the box around it, and its signed distance.

    ``lower`` and ``upper`` (3,) [m] are the corners of the box. ``distance(points)`` takes positions (n, 3) [m] and
    returns signed distances (n,) [m], positive inside. ``volume(step)`` is the volume [m^dim], exact or from samples
    with a distance of ``step`` [m].
    """

    lower: np.ndarray
    upper: np.ndarray
    distance: Callable
    volume: Callable
    dim: int = 3

    def without(self, shapes):
        """What is left of this shape when other shapes are taken away."""
        if not shapes:
            return self

        def volume(step):
            lower, upper = (end([getattr(s, name) for s in shapes], axis=0) for end, name in
                            ((np.min, "lower"), (np.max, "upper")))
            taken = sum(float(np.sum(np.clip(0.5 + np.minimum(
                self.distance(at), np.max([s.distance(at) for s in shapes], axis=0)) / step, 0.0, 1.0)))
                for at in lattice(np.maximum(lower, self.lower), np.minimum(upper, self.upper), step, self.dim))
            return self.volume(step) - taken * step**self.dim

        return Shape(self.lower, self.upper, lambda at: np.min([self.distance(at), *(-s.distance(at) for s in shapes)],
                                                               axis=0), volume, self.dim)

    def contains(self, points):
        """Mask (n,) of the positions (n, 3) [m] that lie inside."""
        return self.distance(points) > 0.0


def _lengths(name, values, number=3):
    values = np.asarray(values, dtype=float)
    if values.shape != (number,) or not np.all(np.isfinite(values)):
        raise ValueError(f"{name} must be {number} finite lengths [m], got {values.tolist()}")
    return values


def _positive(name, value):
    if not 0.0 < value < np.inf:
        raise ValueError(f"{name} must be > 0 m, got {value} m")
    return float(value)


def box(lower, upper, dim=3):
    """A box between two corners (dim,) [m]; in 2-D a rectangle."""
    lower, upper = (_lengths(f"the {end} corner of a box", v, dim) for end, v in (("lower", lower), ("upper", upper)))
    if not np.all(lower < upper):
        raise ValueError(f"the lower corner of a box must be below the upper one along every axis, got "
                         f"{lower.tolist()} and {upper.tolist()} m")
    middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)

    def distance(points):
        beyond = np.abs(points[:, :dim] - middle) - half
        return -np.linalg.norm(np.maximum(beyond, 0.0), axis=1) - np.minimum(beyond.max(axis=1), 0.0)

    flat = [0.0] * (3 - dim)
    return Shape(np.array([*lower, *flat]), np.array([*upper, *flat]), distance,
                 lambda step: float(np.prod(upper - lower)), dim)


def ball(centre, radius, dim=3):
    """A ball about ``centre`` (dim,) [m] of ``radius`` [m]; in 2-D a disc."""
    centre, radius = _lengths("the centre of a sphere", centre, dim), _positive("the radius of a sphere", radius)
    flat = [0.0] * (3 - dim)
    return Shape(np.array([*(centre - radius), *flat]), np.array([*(centre + radius), *flat]),
                 lambda points: radius - np.linalg.norm(points[:, :dim] - centre, axis=1),
                 lambda step: np.pi * radius**2 if dim == 2 else 4.0 / 3.0 * np.pi * radius**3, dim)


def cylinder(start, radius, height, axis="z"):
    """A cylinder (3-D) of ``radius`` and ``height`` [m] along ``axis``; ``start`` (3,) [m] is the middle of its start.
    """
    if axis not in ("x", "y", "z"):
        raise ValueError(f"the axis of a cylinder must be 'x', 'y' or 'z', got {axis!r}")
    start, along = _lengths("the start of a cylinder", start), "xyz".index(axis)
    radius, height = _positive("the radius of a cylinder", radius), _positive("the height of a cylinder", height)
    across = [k for k in range(3) if k != along]

    def distance(points):
        away = np.linalg.norm(points[:, across] - start[across], axis=1) - radius
        beyond = np.stack([away, np.abs(points[:, along] - start[along] - 0.5 * height) - 0.5 * height], -1)
        return -np.linalg.norm(np.maximum(beyond, 0.0), axis=1) - np.minimum(beyond.max(axis=1), 0.0)

    reach = np.where(np.arange(3) == along, 0.0, radius)
    return Shape(start - reach, start + reach + np.where(np.arange(3) == along, height, 0.0), distance,
                 lambda step: np.pi * radius**2 * height)


def lattice(lower, upper, spacing, dim=3):
    """Yields the cubic lattice of cell centres between two corners [m], in parts: positions (n, 3) [m]."""
    axes = [lower[k] + spacing * (np.arange(int(np.ceil((upper[k] - lower[k]) / spacing - 1e-6))) + 0.5)
            for k in range(dim)]
    shape = tuple(map(len, axes))
    number = int(np.prod(shape))
    for first in range(0, number, CHUNK):
        points = np.zeros((min(CHUNK, number - first), 3))
        for k, index in enumerate(np.unravel_index(np.arange(first, first + len(points)), shape)):
            points[:, k] = axes[k][index]
        yield points


class Room:
    """A region that fluid may fill, by its signed distance on a regular grid, linear between the nodes.

    ``values`` (nx, ny, nz) [m] are the distances at the nodes, positive inside, ``origin`` (3,) [m] is the first node,
    and ``step`` [m] is the distance of two nodes. ``lower`` and ``upper`` (3,) [m] are the corners of the box around
    the region, and ``volume`` [m^dim] is its volume. In 2-D, nz is 2 and all distances are the same along z.

    Errors: ``ValueError`` for a region without an inside. Limits: edges are rounded by up to half a step.
    """

    def __init__(self, values, origin, step, lower, upper, volume, dim=3):
        self.values, self.origin = np.ascontiguousarray(values, dtype=float), np.asarray(origin, dtype=float)
        self.step, self.lower, self.upper, self.dim = float(step), np.asarray(lower), np.asarray(upper), dim
        self.volume = float(volume)
        if not np.any(self.values > 0.0):
            raise ValueError(f"there is no room for fluid between {np.round(lower, 6)} and {np.round(upper, 6)} m at "
                             f"a spacing of {step:g} m")

    @classmethod
    def of(cls, shape, *, spacing, layers=2):
        """The room in a :class:`Shape`, on a grid of ``spacing`` [m] that has space for ``layers`` of walls."""
        dim = shape.dim
        origin, counts = grid_around(shape.lower, shape.upper, spacing, dim, layers)
        axes = [origin[k] + spacing * np.arange(counts[k]) for k in range(3)]
        values = np.empty(counts)
        for k, x in enumerate(axes[0]):
            points = np.stack([p.ravel() for p in np.meshgrid([x], axes[1], axes[2] * (dim == 3), indexing="ij")], -1)
            values[k] = shape.distance(points).reshape(counts[1:])
        return cls(values, origin, spacing, shape.lower, shape.upper, shape.volume(0.5 * spacing), dim)

    def __eq__(self, other):
        return isinstance(other, Room) and self.step == other.step and np.array_equal(self.origin, other.origin) \
            and np.array_equal(self.values, other.values)

    def __hash__(self):
        return hash((self.values.shape, self.step, self.volume))

    def __repr__(self):
        return f"Room({'x'.join(map(str, self.values.shape))} nodes, {self.step:g} m)"

    def _corners(self, points):
        """Values (2, 2, 2, n) at the corners of the cells in which points lie, and the places (3, n) in them."""
        last = np.array(self.values.shape) - 1
        place = np.clip((points - self.origin) / self.step, 0.0, last * (1.0 - 1e-12)).T
        cell = np.minimum(place.astype(int), (last - 1)[:, None])
        i, j, k = cell
        return np.array([[[self.values[i + a, j + b, k + c] for c in (0, 1)] for b in (0, 1)] for a in (0, 1)]), \
            place - cell

    def __call__(self, points):
        """Signed distances (n,) [m] of positions (n, 3) [m]; beyond the grid, those of its border."""
        points = np.asarray(points, dtype=float)
        found = np.empty(len(points))
        for first in range(0, len(points), CHUNK):
            v, (x, y, z) = self._corners(points[first:first + CHUNK])
            v = v[0] * (1.0 - x) + v[1] * x
            v = v[0] * (1.0 - y) + v[1] * y
            found[first:first + CHUNK] = v[0] * (1.0 - z) + v[1] * z
        return found

    def gradient(self, points):
        """Gradient of the distance (n, 3) [-]; it points inside."""
        v, (x, y, z) = self._corners(np.asarray(points, dtype=float))
        along = v[1] - v[0]
        v = v[0] * (1.0 - x) + v[1] * x
        gx = (along[0, 0] * (1.0 - y) + along[1, 0] * y) * (1.0 - z) + (along[0, 1] * (1.0 - y) + along[1, 1] * y) * z
        gy = (v[1] - v[0])[0] * (1.0 - z) + (v[1] - v[0])[1] * z
        v = v[0] * (1.0 - y) + v[1] * y
        return np.stack([gx, gy, v[1] - v[0]], -1) / self.step

    def moved(self, points, distance):
        """The points (n, 3) [m], moved along the gradient until they have a signed ``distance``, (n,) or a number."""
        points = points.copy()
        for _ in range(4):
            slope = self.gradient(points)
            size = np.maximum(np.sum(slope**2, axis=1), 0.25)
            points += slope * ((distance - self(points)) / size)[:, None]
        return points

    @property
    def bottom(self):
        """Height of the lowest point inside [m]."""
        return float(self.lower[self.dim - 1])

    def places(self, spacing, gap=0.1):
        """Places (n, 3) [m] for fluid particles: a cubic lattice, ``gap`` spacings from the walls at least."""
        found = [points[self(points) > gap * spacing] for points in lattice(self.lower, self.upper, spacing, self.dim)]
        return np.concatenate(found)


def grid_around(lower, upper, step, dim, layers):
    """(origin (3,) [m], numbers of nodes (3,)) of a grid around a box that has space for ``layers`` of wall particles.
    """
    if not step > 0.0:
        raise ValueError(f"spacing must be > 0 m, got {step} m")
    around = (whole_number("layers", layers, low=1) + MARGIN) * step
    origin = np.asarray(lower, dtype=float) - around
    counts = np.ceil((np.asarray(upper) + around - origin) / step).astype(int) + 1
    if dim == 2:
        origin[2], counts[2] = -0.5 * step, 2
    if np.prod(counts.astype(float)) > MAX_NODES:
        raise ValueError(f"the vessel has a size of {' x '.join(f'{v:.3g}' for v in np.subtract(upper, lower)[:dim])} "
                         f"m, too large for a spacing of {step:g} m: is it in metres, and not in millimetres?")
    return origin, tuple(int(n) for n in counts)


def wall_points(room, *, spacing, layers=2):
    """Positions (n, 3) [m] of wall particles around a room.

    Its ``layers`` are one spacing from each other, and the first is half a spacing from the room. Particles begin as
    those points of a cubic lattice that lie outside, up to ``layers`` spacings away, and are moved along the normal to
    the layer in which they lie. So there is one for each square of a spacing on the average, and their distances vary
    where the wall is oblique, for which :func:`~pysph_boiling.particles.akinci_volume` allows.
    """
    layers = whole_number("layers", layers, low=1)
    around = np.where(np.arange(3) < room.dim, layers * spacing, 0.0)
    found = []
    for points in lattice(room.lower - around, room.upper + around, spacing, room.dim):
        depth = -room(points) / spacing + 1e-6
        here = (depth >= 0.0) & (depth < layers)
        found.append(room.moved(points[here], -(np.floor(depth[here]) + 0.5) * spacing))
    return np.concatenate(found)

"""Layers in which particles pack at the walls of a box: profiles of their density, and their radial distribution."""
import numpy as np
from scipy.spatial import cKDTree

__all__ = ["density_profile", "first_layer", "pool_layers", "radial_distribution"]

BINS = 8  # per spacing
REACH = 3.0  # spacings from the wall
EDGE = 2.5  # spacings from the other walls, within which particles do not count
SURFACE = 3.5  # spacings below the surface, within which they do not count at the sides


def density_profile(distance, area):
    """Particles per spacing^dim in bins of an eighth of a spacing, up to 3 spacings from a wall, shape (24,).

    ``distance`` (n,) of the particles from the wall is in spacings, and the ``area`` of the wall before which they lie
    in spacings^(dim - 1). A mean of 1 is the density at rest; a plane of the lattice that lies in one bin has 8 in it.
    """
    number, _ = np.histogram(distance, np.arange(int(REACH * BINS) + 1) / BINS)
    return number * BINS / area


def first_layer(profile):
    """(peak, gap): the densest bin of a :func:`density_profile` within a spacing of the wall, and the least mean of two
    neighbouring bins up to a spacing behind it. Both are 1 without layers.
    """
    highest = int(np.argmax(profile[:BINS]))
    return float(profile[highest]), float(min((profile[1:] + profile[:-1])[highest:highest + BINS]) / 2.0)


def radial_distribution(points, lower, upper, *, width=1.0 / BINS, reach=2.0):
    """Radial distribution of ``points`` (n, d) in the box ``lower`` .. ``upper`` (d,), d = 1 to 3.

    Its shape is (reach/width,), its bins are ``width`` wide, from above 0 on; all lengths are in spacings. It is 1 for
    points at random. Points within ``reach`` of an end of the box count as neighbours only. Without others it is NaN.
    """
    points, lower, upper = np.asarray(points, float), np.asarray(lower, float), np.asarray(upper, float)
    d = points.shape[1]
    inner = np.all((points > lower + reach) & (points < upper - reach), axis=1)
    edges = np.arange(round(reach / width) + 1) * width
    shells = np.diff(((2.0, np.pi, 4.0 / 3.0 * np.pi)[d - 1]) * edges**d)
    if not inner.any():
        return np.full(len(shells), np.nan)
    number = np.diff(cKDTree(points[inner]).count_neighbors(cKDTree(points), edges))
    return number / (inner.sum() * len(points) / np.prod(upper - lower) * shells)


def pool_layers(points, size):
    """Layers at the walls of a box of ``size`` (dim,), which is the inside of the walls, filled to its last component.

    ``points`` (n, dim), from the corner 0 on, and ``size`` are in spacings; the last axis is the vertical. The result
    is a dictionary: ``base`` and ``side``, the mean :func:`density_profile` at the base and at all sides; ``planes``
    (2,), the highest bin of the :func:`radial_distribution` within the first and the second spacing above the base
    (3-D only). Particles near an edge of the box or, at the sides, near the surface do not count.

    Errors: ``ValueError`` if nothing is left in the middle of the box.
    """
    points, size = np.asarray(points, float), np.asarray(size, float)
    dim = len(size)
    if np.any(size[:-1] <= 2.0 * EDGE) or size[-1] <= EDGE + SURFACE:
        raise ValueError(f"the box must be wider than {2.0 * EDGE:g} and higher than {EDGE + SURFACE:g} spacings, got "
                         f"{size}")
    low, high = np.full(dim, EDGE), size - EDGE
    high[-1] = size[-1] - SURFACE
    within = (points > low) & (points < high)
    sides = []
    for axis in range(dim - 1):
        others = [k for k in range(dim) if k != axis]
        here, area = np.all(within[:, others], axis=1), float(np.prod((high - low)[others]))
        x = points[here, axis]
        sides += [density_profile(x, area), density_profile(size[axis] - x, area)]
    middle = np.all(within[:, :-1], axis=1)
    base = density_profile(points[middle, -1], float(np.prod((high - low)[:-1])))
    found = dict(base=base, side=np.mean(sides, axis=0))
    if dim == 3:
        height = points[:, -1]
        found["planes"] = np.array([np.max(radial_distribution(
            points[(height >= k) & (height < k + 1.0), :-1], np.zeros(2), size[:-1])) for k in (0, 1)])
    return found

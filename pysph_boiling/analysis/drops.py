"""Drops: pieces of liquid that have left the pool."""
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from pysph_boiling.particles import positions
from pysph_boiling.phases import Phase

__all__ = ["LINK", "drops", "pieces"]

LINK = 1.5  # distance in spacings up to which two particles belong to one piece


def pieces(points, link):
    """Piece (n,) of each of ``points`` (n, dim) [m], and the number of points in each piece, (pieces,).

    Points belong to one piece if they are linked by distances of at most ``link`` [m].
    """
    a, b = cKDTree(points).query_pairs(link, output_type="ndarray").T
    graph = coo_array((np.ones(len(a), bool), (a, b)), shape=(len(points),) * 2)
    piece = connected_components(graph, directed=False)[1]
    return piece, np.bincount(piece, minlength=1)


def drops(fluid, spacing):
    """Sizes (drops,) in particles and centroids (drops, 3) [m] of the drops of a fluid array.

    They are the pieces of the fluid without the largest one, which is the pool, and without pieces of vapour alone.
    ``spacing`` is in m.
    """
    points = positions(fluid)
    if not len(points):
        return np.zeros(0, dtype=int), np.zeros((0, 3))
    piece, sizes = pieces(points, LINK * spacing)
    centroids = np.stack([np.bincount(piece, x) for x in points.T], -1) / sizes[:, None]
    chosen = np.bincount(piece, fluid.phase != Phase.VAPOUR) > 0
    chosen[np.argmax(sizes)] = False
    return sizes[chosen], centroids[chosen]

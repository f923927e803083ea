"""Ghost particles: keep the copies of periodic neighbours current between the groups of a step.

PySPH copies every property to its periodic ghosts at a neighbour search and not again. An iterated solver changes
positions and multipliers many times on one list, so groups name what their ghosts need and the refresh copies just
that. In a scene without ghosts each call returns at once.
"""
import numpy as np

from pysph_boiling.device import Copies, real

__all__ = ["GhostRefresh", "Ghosts"]

POSITIONS = ("x", "y", "z")


class Ghosts:
    """Knows, after each neighbour search, of which particle every ghost is the image.

    Limits: ghosts of other MPI ranks are not handled; the scheme refuses to start on more than one rank.
    """

    def __init__(self):
        self.images = []  # (copies, shift (n, 3) [m])
        self.arrays = ()

    def search_done(self):
        """Find the images anew; call it right after the neighbour search."""
        self.images = []
        for pa in self.arrays:
            n, total = real(pa), pa.get_number_of_particles()
            if total == n:
                continue
            if pa.gpu is not None:
                pa.gpu.pull("uid", *POSITIONS)
            uid = pa.get_carray("uid").get_npy_array()
            order = np.argsort(uid[:n], kind="stable")
            original = order[np.searchsorted(uid[:n], uid[n:], sorter=order)]
            place = np.stack([pa.get_carray(axis).get_npy_array() for axis in POSITIONS], -1)
            self.images.append((Copies(pa, n, original), place[n:] - place[original]))

    def refresh(self, names):
        """Copy the properties ``names`` from the originals to their images; positions keep their shift."""
        for copies, shift in self.images:
            for name in names:
                if name in copies.pa.properties:
                    copies.refresh(name, shift[:, POSITIONS.index(name)] if name in POSITIONS else 0.0)


class GhostRefresh:
    """The ``post`` of a group: refreshes its properties on the ghosts, does nothing where there are none."""

    def __init__(self, ghosts, names):
        self.ghosts, self.names = ghosts, tuple(names)

    def __call__(self):
        if self.ghosts.images:
            self.ghosts.refresh(self.names)

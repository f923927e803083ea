"""The vapour of a state on the host, grouped by bubble: what per-bubble sums and decisions work on.

Only the vapour subset is touched, so the cost is that of the vapour. Equations label the bubbles and apply what is
decided; between the two, one number a bubble is all that the host computes.
"""
import numpy as np

from pysph_boiling.device import Subset, values
from pysph_boiling.particles import fill
from pysph_boiling.phases import Phase

__all__ = ["Vapour"]


class Vapour:
    """The real vapour particles of fluid arrays with current labels.

    ``label`` (bubbles,) sorted smallest uids; ``index`` (n,) bubble of each particle; ``n`` (bubbles,) particles.
    """

    def __init__(self, arrays):
        self.arrays = list(arrays)
        self.parts = [Subset(pa, values(pa, "phase") == Phase.VAPOUR) for pa in self.arrays]
        self.label, self.first, self.index, self.n = np.unique(
            self.get("bubble"), return_index=True, return_inverse=True, return_counts=True)

    def __len__(self):
        return len(self.index)

    def get(self, name):
        """A property of the vapour particles, (n,)."""
        return np.concatenate([part.get(name) for part in self.parts])

    def put(self, name, new, elsewhere=None):
        """Write a property of the vapour particles; ``elsewhere`` is what all other particles get, if given."""
        ends = np.cumsum([len(part) for part in self.parts])[:-1]
        for part, share in zip(self.parts, np.split(np.broadcast_to(new, len(self)), ends)):
            if elsewhere is not None:
                fill(part.pa, name, elsewhere)
            part.put(name, share)

    def sum(self, values):
        """Sum per bubble, (bubbles,)."""
        return np.bincount(self.index, weights=values, minlength=len(self.label))

    def places(self, period=(0.0, 0.0, 0.0)):
        """(place, centroid): positions (n, 3) and mean positions (bubbles, 3) [m].

        ``period`` [m] is the length of the periodic domain along each axis, 0 where it is not periodic: positions are
        taken relative to one member, by the nearest image (a bubble must be shorter than half a period).
        """
        place = np.stack([self.get(name) for name in ("x", "y", "z")], -1)
        anchor = place[self.first][self.index]
        offset = place - anchor
        for axis, length in enumerate(period):
            if length > 0.0:
                offset[:, axis] -= length * np.round(offset[:, axis] / length)
        place = anchor + offset
        mean = np.stack([self.sum(offset[:, axis]) for axis in range(3)], -1) / np.maximum(self.n, 1)[:, None]
        return place, place[self.first] + mean

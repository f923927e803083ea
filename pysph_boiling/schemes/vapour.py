"""The vapour particles on the host, grouped by bubble, for sums and decisions per bubble.

Only the vapour is read, so the cost grows with its number of particles. Equations label the bubbles and apply the
decisions; in between, the host computes one number per bubble, and ranks exchange only these.
"""
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from pysph_boiling.device import Subset, values
from pysph_boiling.native import groups, members
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import fill
from pysph_boiling.phases import Phase

__all__ = ["Vapour", "join_labels", "nearest_image"]


class Vapour:
    """The real vapour particles of fluid arrays with current labels.

    ``label`` (bubbles,) are the sorted smallest uids, ``index`` (n,) the bubble of each particle, and ``n`` (bubbles,)
    the numbers of particles. On several ranks, particles are those of this rank, but bubbles those of all ranks: sums
    go over all ranks, which must all call the methods in the same order.
    """

    def __init__(self, arrays):
        self.arrays = list(arrays)
        self.parts = [self.part(pa) for pa in self.arrays]
        here, self.first, index, n = groups(self.get("bubble"))
        self.label, self.here = ranks.union(here)  # ``here``: indices of this rank's bubbles among all
        if ranks.size() == 1:
            self.index, self.n = index, n
            return
        self.index = self.here[index]
        self.n = ranks.total(np.bincount(self.here, weights=n, minlength=len(self.label)).astype(int))

    @staticmethod
    def part(pa):
        """The vapour of one array."""
        vapour = Phase.VAPOUR.value
        if pa.gpu is None:
            return Subset(pa, who=members(pa.get("phase"), vapour, vapour))
        return Subset(pa, values(pa, "phase") == vapour)

    def __len__(self):
        return len(self.index)

    def get(self, name):
        """A property of the vapour particles, (n,)."""
        parts = [part.get(name) for part in self.parts]
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def put(self, name, new, elsewhere=None):
        """Set a property of the vapour particles; if given, ``elsewhere`` is the value for all other particles."""
        ends = np.cumsum([len(part) for part in self.parts])[:-1]
        for part, share in zip(self.parts, np.split(np.broadcast_to(new, len(self)), ends)):
            if elsewhere is not None:
                fill(part.pa, name, elsewhere)
            part.put(name, share)

    def sum(self, values):
        """Sum per bubble, (bubbles,)."""
        return ranks.total(np.bincount(self.index, weights=values, minlength=len(self.label)))

    def max(self, values, least=0.0):
        """Largest value per bubble, (bubbles,), but at least ``least``."""
        most = np.full(len(self.label), least)
        np.maximum.at(most, self.index, values)
        return ranks.largest(most)

    def of_first(self, values):
        """The values (n,) or (n, k) of the first particle of each bubble, (bubbles,) or (bubbles, k)."""
        found = np.zeros((len(self.label), *np.shape(values)[1:]))
        order = np.full(len(self.label), -ranks.size())
        order[self.here] = -ranks.rank()
        mine = ranks.largest(order)[self.here] == -ranks.rank()
        found[self.here[mine]] = values[self.first[mine]]
        return ranks.total(found)

    def places(self, period):
        """(place, centroid): positions (n, 3) and mean positions (bubbles, 3) [m].

        ``period`` [m] is the length of the periodic domain along each axis, 0 where it is not periodic. Positions are
        taken relative to one member by the nearest image, so a bubble must be shorter than half a period.
        """
        place = np.stack([self.get(name) for name in ("x", "y", "z")], -1)
        first = self.of_first(place)
        anchor = first[self.index]
        offset = nearest_image(place - anchor, period)
        place = anchor + offset
        mean = np.stack([self.sum(offset[:, axis]) for axis in range(3)], -1) / np.maximum(self.n, 1)[:, None]
        return place, first + mean


def nearest_image(offset, period):
    """Offsets (..., 3) [m] to the nearest image; ``period`` (3,) [m] of the domain, 0 along an axis that has none."""
    period = np.asarray(period, dtype=float)
    return offset - period * np.round(offset / np.where(period > 0.0, period, np.inf))


def join_labels(arrays, radius):
    """Give all parts of a bubble on several ranks the same label, the smallest uid of all of them.

    Each rank has labelled its own parts, and its ghosts have the labels of their owners. Vapour closer than ``radius``
    [m] to vapour of another rank gives a pair of labels to join; all ranks get all pairs and join them.
    """
    if ranks.size() == 1:
        return
    (pa,) = arrays  # as the labels demand
    n, label, phase, *place = (pa.get_number_of_particles(True), *(  # type: ignore[misc]
        pa.get(name, only_real_particles=False) for name in ("bubble", "phase", "x", "y", "z")))
    vapour, place = np.flatnonzero(phase == Phase.VAPOUR), np.stack(place, -1)
    here, there = vapour[vapour < n], vapour[vapour >= n]
    pairs = np.zeros((0, 2), label.dtype)
    if len(here) and len(there):
        near = cKDTree(place[here]).sparse_distance_matrix(cKDTree(place[there]), radius, output_type="ndarray")
        near = near[near["v"] < radius]
        pairs = np.unique(np.stack([label[here[near["i"]]], label[there[near["j"]]]], -1), axis=0)
    pairs, _ = ranks.gather(pairs)
    names, index = np.unique(pairs, return_inverse=True)
    if len(names) == 0:
        return
    a, b = index.reshape(-1, 2).T
    graph = coo_matrix((np.ones(len(a), bool), (a, b)), shape=(len(names),) * 2)
    _, first, part = np.unique(connected_components(graph, directed=False)[1], return_index=True, return_inverse=True)
    joined = vapour[np.isin(label[vapour], names)]
    label[joined] = names[first[part]][np.searchsorted(names, label[joined])]

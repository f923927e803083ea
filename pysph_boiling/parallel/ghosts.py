"""Ghost particles: keep periodic copies and copies from other ranks up to date between the groups of a step.

PySPH copies all properties to the ghosts at a neighbour search only. The iterative solver changes positions and
multipliers many times between two searches, so each group names the properties to refresh on the ghosts after it. In a
scene without ghosts each call returns at once.
"""
from collections import Counter
from contextlib import contextmanager

import numpy as np

from pysph_boiling.device import Copies, real

__all__ = ["GhostRefresh", "Ghosts"]

POSITIONS = ("x", "y", "z")
PLACES = ("grandparent",)  # properties that are indices into this rank's arrays, meaningless on other ranks


class Plan:
    """Which ``particles`` (n,) of an array are sent to which ranks ``to`` (n,), and how many come from each rank.

    ``coming`` (ranks,) are the latter. One message goes to each rank, with all properties that are sent together.
    ``tag`` tells messages of several arrays apart. What comes is in the order of the ranks.
    """

    def __init__(self, comm, tag, particles, to, coming):
        self.comm, self.tag = comm, tag
        order = np.argsort(to, kind="stable")
        self.particles = particles[order]
        self.going, self.coming = pieces(np.bincount(to, minlength=len(coming))), pieces(coming)
        self.number = int(np.sum(coming))

    def post(self, columns):
        """Send the particles' rows of ``columns``, name -> array (n,) or (n, stride); returns a :class:`Message`."""
        record = np.dtype([(name, values.dtype, values.shape[1:]) for name, values in columns.items()])
        sent, come = np.empty(len(self.particles), record), np.empty(self.number, record)
        requests = [self.comm.Irecv(come[rows].view(np.uint8), rank, self.tag) for rank, rows in self.coming]
        for name, values in columns.items():
            sent[name] = values[self.particles]
        requests += [self.comm.Isend(sent[rows].view(np.uint8), rank, self.tag) for rank, rows in self.going]
        return Message(sent, come, requests)


class Message:
    """What is on its way to and from other ranks: records (n,) with a field for each property."""

    def __init__(self, sent, come, requests):
        self.sent, self.come, self.requests = sent, come, requests

    def wait(self):
        """The records that have come, once all have been sent and received."""
        for request in self.requests:
            request.Wait()
        return self.come


def pieces(numbers):
    """(rank, slice) of the rows of each rank that has any, for rows in the order of the ranks."""
    ends = np.cumsum(numbers)
    return [(rank, slice(ends[rank] - numbers[rank], ends[rank])) for rank in np.flatnonzero(numbers).tolist()]


class Ghosts:
    """Stores, after each neighbour search, of which particle every ghost is the image.

    One layer of ghosts contains all neighbours of a rank's own particles; values computed for the originals are sent to
    their ghosts. ``exported`` counts the particles of each array that this rank has sent at searches, ``copied`` their
    bytes, and ``refreshed`` the bytes of single properties sent between groups.
    """

    def __init__(self):
        self.images = []  # (copies, shift (n, 3) [m])
        self.exchanges = []  # (array, first ghost, plan of the exchange)
        self.arrays = ()
        self.exported, self.copied, self.refreshed = Counter(), 0, 0

    def search_done(self, manager=None):
        """Find the images again after a neighbour search; on several ranks ``manager`` is PySPH's parallel manager."""
        self.images, self.exchanges = [], []
        if manager:
            for exchange in manager.pa_exchanges:
                self.exported[exchange.pa.name] += len(exchange.plan.particles)
                self.copied += len(exchange.plan.particles) * exchange.record_size
                if exchange.pa in self.arrays:
                    self.exchanges.append((exchange.pa, exchange.num_local, exchange.plan))
            return
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
        """Copy the properties ``names`` from the originals to their images; positions keep a periodic shift."""
        with self.refreshing(names):
            pass

    @contextmanager
    def refreshing(self, names):
        """As :meth:`refresh`; on several ranks values are on their way during the block, which may not change them."""
        posted = [(pa, n, plan.post(columns)) for pa, n, plan in self.exchanges if (columns := {
            name: pa.get_carray(name).get_npy_array() for name in names
            if name in pa.properties and name not in PLACES})]
        yield
        for pa, n, message in posted:
            self.refreshed += message.sent.nbytes
            come = message.wait()
            for name in come.dtype.names:
                pa.get_carray(name).get_npy_array()[n:] = come[name]
        for copies, shift in self.images:
            for name in names:
                if name in copies.pa.properties:
                    copies.refresh(name, shift[:, POSITIONS.index(name)] if name in POSITIONS else 0.0)


class GhostRefresh:
    """The ``post`` hook of a group, which refreshes its properties on the ghosts, if there are any."""

    def __init__(self, ghosts, names):
        self.ghosts, self.names = ghosts, tuple(names)

    def __call__(self):
        if self.ghosts.images or self.ghosts.exchanges:
            self.ghosts.refresh(self.names)

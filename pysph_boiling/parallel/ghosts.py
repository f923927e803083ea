"""Ghost particles: keep periodic copies and copies from other ranks up to date between the groups of a step.

PySPH copies all properties to the ghosts at a neighbour search only. The iterative solver changes positions and
multipliers many times between two searches, so each group names the properties to refresh on the ghosts after it. In a
scene without ghosts each call returns at once.
"""
import numpy as np

from pysph_boiling.device import Copies, real

__all__ = ["GhostRefresh", "Ghosts"]

POSITIONS = ("x", "y", "z")
PLACES = ("grandparent",)  # properties that are indices into this rank's arrays, meaningless on other ranks


class Ghosts:
    """Stores, after each neighbour search, of which particle every ghost is the image.

    One layer of ghosts contains all neighbours of a rank's own particles; values computed for the originals are sent to
    their ghosts. ``exported`` counts the particles that this rank has sent at searches, ``copied`` their bytes, and
    ``refreshed`` the bytes of single properties sent between groups.
    """

    def __init__(self):
        self.images = []  # (copies, shift (n, 3) [m])
        self.exchanges = []  # (array, first ghost, index of the exported (n,), plan of the exchange)
        self.arrays = ()
        self.exported, self.copied, self.refreshed = 0, 0, 0

    def search_done(self, manager=None):
        """Find the images again after a neighbour search; on several ranks ``manager`` is PySPH's parallel manager."""
        self.images, self.exchanges = [], []
        if manager:
            for exchange in manager.pa_exchanges:
                size = sum(exchange.pa.properties[name].get_npy_array().itemsize for name in exchange.lb_props)
                self.exported += exchange.numParticleExport
                self.copied += exchange.numParticleExport * size
                if exchange.pa in self.arrays:
                    self.exchanges.append(self.plan(exchange))
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

    @staticmethod
    def plan(exchange):
        """The pattern of PySPH's last exchange of one array: which particles are sent to which rank."""
        from pyzoltan.core.zoltan_comm import ZComm

        exported = exchange.exportParticleLocalids.get_npy_array().copy()
        plan = ZComm(exchange.comm, exchange.data_tag_remote, len(exported),
                     exchange.exportParticleProcs.get_npy_array())
        return exchange.pa, exchange.num_local, exported, plan

    def refresh(self, names):
        """Copy the properties ``names`` from the originals to their images; positions keep a periodic shift."""
        for pa, n, exported, plan in self.exchanges:
            columns = {name: pa.get_carray(name).get_npy_array() for name in names
                       if name in pa.properties and name not in PLACES}
            if columns:
                record = np.dtype([(name, values.dtype) for name, values in columns.items()])
                mine, theirs = np.empty(len(exported), record), np.empty(plan.nreturn, record)
                for name, values in columns.items():
                    mine[name] = values[exported]
                plan.set_nbytes(record.itemsize)
                plan.Comm_Do(mine, theirs)
                for name, values in columns.items():
                    values[n:] = theirs[name]
                self.refreshed += mine.nbytes
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

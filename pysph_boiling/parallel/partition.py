"""PySPH's distribution of particles over ranks, without its loops over particles in Python.

Twice per step PySPH sorts all particles of a rank into Python objects, asks Zoltan about each of them, and sends the
particles of every array near a border, one property after the other. That takes several times as long as the step
itself. Here NumPy sorts the particles into cells, only when the load is balanced; Zoltan is asked about boxes of many
particles; a rank receives only particles that its own particles read; and all properties travel in one message. Zoltan
still balances the load, and PySPH still says when particles move.

Import this module only where MPI is set up, since the PySPH module that it extends does not exist elsewhere.
"""
import numpy as np
from pysph.base.particle_array import get_local_tag, get_remote_tag
from pysph.parallel.parallel_manager import ParticleArrayExchange, ZoltanParallelManagerGeometric

from pysph_boiling.parallel.ghosts import Plan

__all__ = ["Partition"]

BALANCED = 1.05  # largest load of a rank, relative to the mean, with which the domains stay as they are
STILL = 0.01  # relative load of a particle without equations of its own, such as a wall particle
FAR = 2**20  # largest index of a cell; particles beyond share the outermost cells
NOBODY = np.zeros(0, int), np.zeros(0, int)  # particles to be sent, and their ranks
FEW = 16  # number of particles up to which Zoltan is asked about each particle


def within(points, corners):
    """Mask (n,) of the ``points`` (3, n) inside a box; all false if its lower corner is above the upper one."""
    lower, upper = corners
    return ((points >= lower[:, None]) & (points <= upper[:, None])).all(axis=0)


def extent(points):
    """Corners (2, 3) of the smallest box around ``points`` (3, n); lower above upper if there are none."""
    return np.array([points.min(axis=1, initial=np.inf), points.max(axis=1, initial=-np.inf)])


class ArrayExchange(ParticleArrayExchange):
    """PySPH's exchange of one array, with all properties of a particle in one message.

    ``listed`` are the particles to be sent (n,) and their ranks (n,), and ``plan`` is the :class:`Plan` of the last
    exchange: after a neighbour search, that of the ghosts. ``record_size`` is what a particle takes in a message [B].
    """

    listed = plan = message = None

    def columns(self):
        """The properties that are sent: name -> array (n,), or (n, stride)."""
        pa = self.pa
        return {name: pa.properties[name].get_npy_array().reshape(-1, pa.stride[name]) if name in pa.stride else
                pa.properties[name].get_npy_array() for name in self.lb_props}

    @property
    def record_size(self):
        return sum(values.dtype.itemsize * values[:1].size for values in self.columns().values())

    def start(self, coming):
        """Send the listed particles; ``coming`` (ranks,) are the numbers that each rank sends to this one."""
        self.plan = Plan(self.comm, self.pa_index, *self.listed, coming)
        self.message = self.plan.post(self.columns())

    def lb_exchange_data(self):
        """Replace the listed particles by those that have come to stay."""
        leaving = self.listed[0]
        if len(leaving):
            self.pa.remove_particles(leaving)
        self.num_local = self.receive(self.num_local - len(leaving), get_local_tag())

    def remote_exchange_data(self):
        """Append the ghosts that have come."""
        self.num_remote = self.receive(self.num_local, get_remote_tag()) - self.num_local

    def receive(self, count, tag):
        """Append what has come to ``count`` particles; returns how many there are then."""
        come, self.message = self.message.wait(), None
        if len(come):
            self.extend(count, count + len(come))
            for name, values in self.columns().items():
                values[count:] = come[name]
            self.set_tag(count, count + len(come), tag)
            self.pa.align_particles()
        return count + len(come)


class Partition(ZoltanParallelManagerGeometric):
    """PySPH's parallel manager with faster methods for a step; see PySPH's documentation for the rest.

    ``pairs`` are the (destination, source) names of the arrays of all sums over neighbours, and ``moving`` the names of
    the arrays that move; others change ranks only once after the load was balanced.
    """

    def __init__(self, *args, pairs, moving, **options):
        self.binned = []  # for each array: its occupied cells, and the cell of each particle
        self.placed = set()  # numbers of arrays that do not move, and have all particles in the right domain
        self.home = {}  # number of an array -> corners of a box around its particles, owned entirely by this rank
        super().__init__(*args, **options)
        self.pa_exchanges = [ArrayExchange(number, pa, self.comm) for number, pa in enumerate(self.particles)]
        self.update_particle_gids()
        names = [exchange.pa.name for exchange in self.pa_exchanges]
        self.moving = frozenset(moving)
        self.readers = [[names.index(dest) for dest, source in pairs if source == name] for name in names]
        for exchange in self.pa_exchanges:
            exchange.lb_weight = 1.0 if any(dest == exchange.pa.name for dest, _ in pairs) else STILL

    # --- load balancing: Zoltan distributes cells ---------------------------------------------------------------------

    def update_partition(self):
        """Balance the load if it is not balanced; new domains cost as much as several exchanges."""
        loads = self.comm.allgather(sum(exchange.lb_weight * exchange.num_local for exchange in self.pa_exchanges))
        if self.initial_update or max(loads) > BALANCED * np.mean(loads):
            super().update_partition()
        else:
            self.migrate_partition()

    def local_bin(self):
        """Find the cells that contain this rank's particles."""
        if self.initial_update or self.update_cell_sizes:
            self.compute_cell_size()
        self.binned = [self.bin(self.points(exchange)) for exchange in self.pa_exchanges]
        self.cell_list = np.unique(np.concatenate([keys for keys, _ in self.binned])).tolist()

    def set_data(self):
        """Give Zoltan the positions and the loads of the cells."""
        cells, weight = np.array(self.cell_list, np.int64), np.zeros(len(self.cell_list))
        for exchange, (keys, place) in zip(self.pa_exchanges, self.binned):
            weight[np.searchsorted(cells, keys)] += exchange.lb_weight * np.bincount(place, minlength=len(keys))
        centres = (lattice(cells) + 0.5) * self.cell_size
        for told, values in zip((self.pz.x, self.pz.y, self.pz.z, self.pz.weights), (*centres.T, weight)):
            told.resize(len(values))
            told.set_data(np.ascontiguousarray(values))

    def load_balance(self):
        super().load_balance()
        self.home.clear()
        self.placed.clear()

    def create_particle_lists(self):
        """List the particles of the cells that Zoltan moves to other ranks."""
        owner = np.full(len(self.cell_list), self.rank, np.int32)
        owner[self.exportCellLocalids.get_npy_array()[:self.numCellExport]] = \
            self.exportCellProcs.get_npy_array()[:self.numCellExport]
        for exchange, (keys, place) in zip(self.pa_exchanges, self.binned):
            to = owner[np.searchsorted(self.cell_list, keys)][place]
            leaving = np.flatnonzero(to != self.rank)
            exchange.listed = leaving, to[leaving]
        self.send()

    # --- every step: particles change ranks, ghosts are replaced ------------------------------------------------------

    def migrate_particles(self):
        """Send particles that have left this rank's domain to the rank whose domain they are in now."""
        for number, exchange in enumerate(self.pa_exchanges):
            if number in self.placed:
                exchange.listed = NOBODY
                continue
            if exchange.pa.name not in self.moving:
                self.placed.add(number)
            points = self.points(exchange)
            owner, moved = np.full(exchange.num_local, self.rank, np.int32), np.isfinite(points).all(axis=0)
            if number in self.home:
                moved &= ~within(points, self.home[number])
            if moved.any():
                owner[moved] = self.owners(points[:, moved])
                corners = extent(points[:, owner == self.rank])
                if np.isfinite(corners).all() and (self.among(corners) == self.rank).all():
                    self.home[number] = corners
            leaving = np.flatnonzero(owner != self.rank)
            exchange.listed = leaving, owner[leaving]
        self.send()
        for exchange in self.pa_exchanges:
            exchange.lb_exchange_data()

    def compute_remote_particles(self):
        """List the particles that other ranks read: sources within one support of the box around their destinations."""
        places = [self.points(exchange) for exchange in self.pa_exchanges]
        mine = np.array([[*np.ravel(extent(points)), exchange.pa.get("h").max(initial=0.0)]
                         for points, exchange in zip(places, self.pa_exchanges)])
        boxes = np.empty((self.size, *mine.shape))
        self.comm.Allgather(mine, boxes)
        support = self.radius_scale * boxes[:, :, 6].max(axis=0)
        for index, (points, exchange) in enumerate(zip(places, self.pa_exchanges)):
            sent = {self.rank: np.zeros(0, int)}
            for dest in self.readers[index]:
                reach = max(support[index], support[dest])
                lower, upper = boxes[:, dest, :3] - reach, boxes[:, dest, 3:6] + reach
                meet = (lower <= mine[index, 3:6]).all(axis=1) & (upper >= mine[index, :3]).all(axis=1)
                for rank in np.flatnonzero(meet & (np.arange(self.size) != self.rank)).tolist():
                    read = np.flatnonzero(within(points, (lower[rank], upper[rank])))
                    sent[rank] = np.union1d(sent[rank], read) if rank in sent else read
            exchange.listed = (np.concatenate(list(sent.values())),
                               np.repeat(list(sent), [len(particles) for particles in sent.values()]))
        self.send()

    def send(self):
        """Tell each rank how many particles of each array come to it, and send the listed ones of all arrays at once.
        """
        sent = np.stack([np.bincount(exchange.listed[1], minlength=self.size) for exchange in self.pa_exchanges], -1)
        coming = np.empty_like(sent)
        self.comm.Alltoall(sent, coming)
        for number, exchange in enumerate(self.pa_exchanges):
            exchange.start(coming[:, number])

    def update_local_data(self):
        """Store the number of particles."""
        for index, exchange in enumerate(self.pa_exchanges):
            self.num_local[index], self.num_global[index] = exchange.num_local, exchange.num_global

    def update_remote_data(self):
        """Store the number of ghosts."""
        for index, exchange in enumerate(self.pa_exchanges):
            self.num_local[index], self.num_remote[index] = exchange.num_local, exchange.num_remote

    # --- small things -------------------------------------------------------------------------------------------------

    @staticmethod
    def points(exchange):
        """Positions of this rank's particles of an array, (3, n) [m]."""
        return np.stack([exchange.pa.get(axis, only_real_particles=False)[:exchange.num_local] for axis in "xyz"])

    def bin(self, points):
        """(keys, place): the occupied cells, and for each of ``points`` (3, n) the index of its cell."""
        with np.errstate(invalid="ignore"):  # the guard reports values that are not finite after the step
            x, y, z = np.clip(np.floor(points / self.cell_size).astype(np.int64), -FAR, FAR - 1) + FAR
        return np.unique((x * 2 * FAR + y) * 2 * FAR + z, return_inverse=True)

    def among(self, corners):
        """Ranks that own a part of a box."""
        lower, upper = corners
        return self.pz.procs[:self.pz.Zoltan_Box_PP_Assign(*lower, *upper)]

    def owners(self, points):
        """Rank (n,) that owns each of ``points`` (3, n), found by bisecting the box until one rank owns each part."""
        owner, parts = np.empty(points.shape[1], np.int32), [np.arange(points.shape[1])]
        while parts:
            index = parts.pop()
            lower, upper = corners = extent(points[:, index])
            if len(index) <= FEW or (lower == upper).all():
                owner[index] = [self.pz.Zoltan_Point_PP_Assign(*point) for point in points[:, index].T.tolist()]
                continue
            ranks = self.among(corners)
            if len(ranks) == 1:
                owner[index] = ranks[0]
            else:
                axis = np.argmax(upper - lower)
                above = points[axis, index] > 0.5 * (lower[axis] + upper[axis])
                parts += [index[above], index[~above]]
        return owner


def lattice(keys):
    """Indices of cells (n, 3) from their keys."""
    return np.stack([keys // (4 * FAR * FAR), keys // (2 * FAR) % (2 * FAR), keys % (2 * FAR)], -1) - FAR

"""PySPH's distribution of particles over ranks, without the work that it does particle by particle in Python.

PySPH bins all particles of a rank into Python objects, twice a step, asks Zoltan about each of them, and sends every
array's particles near a border. That takes several times as long as a step itself. Here NumPy bins them when the load
is balanced, Zoltan is asked about boxes of many particles, and a rank is sent what its particles read. The balancing
and every exchange of particles remain Zoltan's and PySPH's.

Import this where MPI is set up only: PySPH's module behind it exists nowhere else.
"""
import numpy as np
from pysph.parallel.parallel_manager import ZoltanParallelManagerGeometric

__all__ = ["Partition"]

STILL = 0.01  # what a particle costs a rank that reads nothing itself, as one of a wall, in units of one that does
FAR = 2**20  # cells; beyond them there is no telling cells apart, and no need to
FEW = 16  # particles that Zoltan is asked about one by one


def within(points, corners):
    """Which of ``points`` (3, n) lie in a box, (n,); none if it is inside out."""
    lower, upper = corners
    return ((points >= lower[:, None]) & (points <= upper[:, None])).all(axis=0)


def extent(points):
    """Corners (2, 3) of the smallest box round ``points`` (3, n); inside out if there are none."""
    return np.array([points.min(axis=1, initial=np.inf), points.max(axis=1, initial=-np.inf)])


class Partition(ZoltanParallelManagerGeometric):
    """PySPH's manager of the ranks, which calls the methods below in a step; see its documentation for the rest.

    ``pairs`` are the (destination, source) names of all sums over neighbours.
    """

    def __init__(self, *args, pairs, **options):
        self.binned = []  # for each array: the cells that its particles lie in, and which of them each lies in
        self.home = {}  # number of an array -> corners of a box round its particles that this rank owns wholly
        super().__init__(*args, **options)
        names = [exchange.pa.name for exchange in self.pa_exchanges]
        self.readers = [[names.index(dest) for dest, source in pairs if source == name] for name in names]
        for exchange in self.pa_exchanges:
            exchange.lb_weight = 1.0 if any(dest == exchange.pa.name for dest, _ in pairs) else STILL

    # --- load balancing: Zoltan distributes cells ---------------------------------------------------------------------

    def local_bin(self):
        """Find the cells that this rank's particles lie in."""
        if self.initial_update or self.update_cell_sizes:
            self.compute_cell_size()
        self.binned = [self.bin(self.points(exchange)) for exchange in self.pa_exchanges]
        self.cell_list = np.unique(np.concatenate([keys for keys, _ in self.binned])).tolist()

    def set_data(self):
        """Tell Zoltan where the cells are, and what they weigh."""
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

    def create_particle_lists(self):
        """List the particles of the cells that Zoltan gives to other ranks."""
        owner = np.full(len(self.cell_list), self.rank, np.int32)
        owner[self.exportCellLocalids.get_npy_array()[:self.numCellExport]] = \
            self.exportCellProcs.get_npy_array()[:self.numCellExport]
        for exchange, (keys, place) in zip(self.pa_exchanges, self.binned):
            to = owner[np.searchsorted(self.cell_list, keys)][place]
            leaving = np.flatnonzero(to != self.rank)
            self.export(exchange, leaving, to[leaving])

    # --- every step: particles move, ghosts are made anew -------------------------------------------------------------

    def migrate_particles(self):
        """Send particles that have left this rank's domain to the rank that they are in now."""
        for number, exchange in enumerate(self.pa_exchanges):
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
            self.export(exchange, leaving, owner[leaving])
            exchange.lb_exchange_data()

    def compute_remote_particles(self):
        """List the particles that other ranks read: sources within a support of the box round their destinations."""
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
            self.export(exchange, np.concatenate(list(sent.values())),
                        np.repeat(list(sent), [len(particles) for particles in sent.values()]))

    def update_local_data(self):
        """Note how many particles there are."""
        for index, exchange in enumerate(self.pa_exchanges):
            self.num_local[index], self.num_global[index] = exchange.num_local, exchange.num_global

    def update_remote_data(self):
        """Note how many ghosts there are."""
        for index, exchange in enumerate(self.pa_exchanges):
            self.num_local[index], self.num_remote[index] = exchange.num_local, exchange.num_remote

    # --- small things -------------------------------------------------------------------------------------------------

    @staticmethod
    def points(exchange):
        """Positions of this rank's particles of an array, (3, n) [m]."""
        return np.stack([exchange.pa.get(axis, only_real_particles=False)[:exchange.num_local] for axis in "xyz"])

    def bin(self, points):
        """(keys, place): the cells that ``points`` (3, n) lie in, and which of them each lies in."""
        with np.errstate(invalid="ignore"):  # what is not finite is told after the step
            x, y, z = np.clip(np.floor(points / self.cell_size).astype(np.int64), -FAR, FAR - 1) + FAR
        return np.unique((x * 2 * FAR + y) * 2 * FAR + z, return_inverse=True)

    def among(self, corners):
        """Ranks that own some of a box."""
        lower, upper = corners
        return self.pz.procs[:self.pz.Zoltan_Box_PP_Assign(*lower, *upper)]

    def owners(self, points):
        """Rank in whose domain each of ``points`` (3, n) lies, (n,): of halves of halves, until one rank owns each."""
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

    @staticmethod
    def export(exchange, particles, ranks):
        """Set an array's list of the ``particles`` (n,) that go to ``ranks`` (n,)."""
        exchange.reset_lists()
        for listed, values in ((exchange.exportParticleLocalids, particles),
                               (exchange.exportParticleGlobalids, exchange.pa.get("gid")[particles]),
                               (exchange.exportParticleProcs, ranks)):
            listed.resize(len(values))
            listed.set_data(np.asarray(values, listed.get_npy_array().dtype))
        exchange.numParticleExport = len(particles)


def lattice(keys):
    """Indices of cells (n, 3) from their keys."""
    return np.stack([keys // (4 * FAR * FAR), keys // (2 * FAR) % (2 * FAR), keys % (2 * FAR)], -1) - FAR

"""The class DeviceCellNNPS: neighbour lists on a device, for the backends of PySPH that have one.

It needs pyopencl (or PyCUDA), so import this module only where there is a device.
"""
from math import floor

import numpy as np
from compyle.api import Elementwise, Scan, annotate, declare
from compyle.array import Array, get_backend, maximum, minimum, zeros
from compyle.low_level import atomic_inc
from pysph.base.gpu_nnps_base import GPUNNPS

__all__ = ["DeviceCellNNPS"]

MARGIN = 1.001  # cells are wider than the support by this factor, which covers the rounding of positions
SPARE = 1.25  # room for entries, in units of what was needed when it did not suffice
PER_PARTICLE = 4  # largest number of cells, in units of the number of particles; more are folded together


@annotate
def cell_counts(i, x, y, z, per_length, mask_x, mask_y, mask_z, room, members, counts, lacking):
    """Writes each particle into the next free entry of its cell, or only counts it if there is none left."""
    cx, cy, cz, cell, place = declare('int', 5)
    cx = floor(x[i] * per_length)
    cy = floor(y[i] * per_length)
    cz = floor(z[i] * per_length)
    cell = ((cz & mask_z) * (mask_y + 1) + (cy & mask_y)) * (mask_x + 1) + (cx & mask_x)
    place = atomic_inc(counts[cell])
    if place < room:
        members[cell * room + place] = i
    else:
        lacking[0] = 1


@annotate
def cell_sort(i, counts, room, members):
    """Sorts the entries of a cell, so that lists do not depend on which particle came first."""
    a, b, first, stop, filled, one = declare('int', 6)
    first = i * room
    filled = counts[i] if counts[i] < room else room
    stop = first + filled
    for a in range(first + 1, stop):
        one = members[a]
        b = a - 1
        while b >= first and members[b] > one:
            members[b + 1] = members[b]
            b = b - 1
        members[b + 1] = one


@annotate
def cell_lists(i, lengths, d_x, d_y, d_z, d_h, s_x, s_y, s_z, s_h, per_length, scale2, mask_x, mask_y, mask_z,
               cell_room, members, counts, room, neighbours, number, lacking):
    """The neighbours of a particle, by PySPH's expression, in the cells around it; those beyond its room are counted.

    Every candidate is written, and the next one takes its place unless it is near: that is faster than a branch.
    """
    a, b, c, cx, cy, cz, cell, k, first, stop, j, n, begin, ax, ay, az, place, near, filled = declare('int', 19)
    x = d_x[i]
    y = d_y[i]
    z = d_z[i]
    own = scale2 * d_h[i] * d_h[i]
    cx = floor(x * per_length)
    cy = floor(y * per_length)
    cz = floor(z * per_length)
    ax = 1 if mask_x > 0 else 0
    ay = 1 if mask_y > 0 else 0
    az = 1 if mask_z > 0 else 0
    n = 0
    begin = i * (room + 1)
    for c in range(-az, az + 1):
        for b in range(-ay, ay + 1):
            for a in range(-ax, ax + 1):
                cell = (((cz + c) & mask_z) * (mask_y + 1) + ((cy + b) & mask_y)) * (mask_x + 1) + ((cx + a) & mask_x)
                first = cell * cell_room
                filled = counts[cell] if counts[cell] < cell_room else cell_room
                stop = first + filled
                for k in range(first, stop):
                    j = members[k]
                    dx = x - s_x[j]
                    dy = y - s_y[j]
                    dz = z - s_z[j]
                    r2 = dx * dx + dy * dy + dz * dz
                    other = scale2 * s_h[j] * s_h[j]
                    reach = other if other > own else own
                    place = n if n < room else room
                    neighbours[begin + place] = j
                    near = 1 if r2 < reach else 0
                    n = n + near
    lengths[i] = n
    if n > room:
        lacking[number] = 1


@annotate
def list_begins(i, begins, room):
    begins[i] = i * (room + 1)


@annotate
def in_order_of_cells(i, counts, begins, room, members, indices):
    k = declare('int')
    for k in range(counts[i]):
        indices[begins[i] + k] = members[i * room + k]


@annotate
def scanned(i, counts):
    return counts[i]


@annotate
def scan_output(i, prev_item, begins):
    begins[i] = prev_item


class Cells:
    """The particles of one array by cells: ``members`` has ``room`` entries for each cell, ``counts`` are in use."""

    def __init__(self, search, pa):
        self.search, self.pa, self.room = search, pa, 0
        self.counts = self.members = None

    def sort(self):
        search, gpu = self.search, self.pa.gpu
        if self.counts is None or len(self.counts.dev) != search.n_cells:
            self.counts = search.array(search.n_cells, np.int32)
            self.members = search.array(search.n_cells * self.room, np.int32)
        self.counts.fill(0)
        if gpu.get_number_of_particles():
            search.call(cell_counts, gpu.x, gpu.y, gpu.z, *search.lattice, self.room, self.members, self.counts,
                        search.lacking)
            search.call(cell_sort, self.counts, self.room, self.members)

    def widen(self):
        """Make more room if a cell had too little."""
        most = int(maximum(self.counts))
        if most > self.room:
            self.room = int(SPARE * most) + 1
            self.members = self.search.array(self.search.n_cells * self.room, np.int32)

    def indices(self):
        """The particles in the order of their cells, on the device."""
        begins = self.search.array(self.search.n_cells, np.int32)
        Scan(scanned, scan_output, "a+b", dtype=np.int32, backend=self.search.backend)(
            counts=self.counts, begins=begins)
        found = self.search.array(self.pa.gpu.get_number_of_particles(), np.int32)
        self.search.call(in_order_of_cells, self.counts, begins, self.room, self.members, found)
        return found


class Lists:
    """The neighbour lists of one pair of arrays, by the names under which PySPH's evaluators read them.

    Each list has ``room`` entries, and one for candidates that are too many or too far.
    """

    def __init__(self, search, source, dest, number):
        self.search, self.source, self.dest, self.number, self.room = search, source, dest, number, 0
        self._nbr_lengths_gpu = self._start_idx_gpu = self._neighbors_gpu = None

    def get_neighbors_gpu(self):
        """Does nothing: the lists are made when the search is updated."""

    def find(self):
        search, gpu, source = self.search, self.dest.gpu, self.source
        n = gpu.get_number_of_particles()
        if self._nbr_lengths_gpu is None or len(self._nbr_lengths_gpu.dev) != n:
            self._nbr_lengths_gpu = search.array(n, np.uint32)
            self.make_room(n)
        if n:
            search.call(cell_lists, self._nbr_lengths_gpu, gpu.x, gpu.y, gpu.z, gpu.h, source.pa.gpu.x, source.pa.gpu.y,
                        source.pa.gpu.z, source.pa.gpu.h, search.lattice[0], search.scale2, *search.lattice[1:],
                        source.room, source.members, source.counts, self.room, self._neighbors_gpu, self.number,
                        search.lacking)

    def make_room(self, n):
        self._neighbors_gpu = self.search.array(n * (self.room + 1), np.uint32)
        self._start_idx_gpu = self.search.array(n, np.uint32)
        if n:
            self.search.call(list_begins, self._start_idx_gpu, self.room)

    def widen(self):
        """Make more room if a list had too little."""
        n = len(self._nbr_lengths_gpu.dev)
        most = int(maximum(self._nbr_lengths_gpu)) if n else 0
        if most > self.room:
            self.room = int(SPARE * most) + 1
            self.make_room(n)


class DeviceCellNNPS(GPUNNPS):
    """Neighbour lists from cells, for PySPH's evaluators on a device.

    Space is divided into cells as wide as the largest support. They are numbered along each axis modulo a power of two,
    so that the bounds of the particles are not needed, and a stray particle costs no memory; where two cells have the
    same number, the test of the distance tells their particles apart. The lists of the pairs that were asked for are
    made at each update, from the positions then, in an order that depends on nothing but the particles. An update
    fetches a single small array: whether the room of a cell or of a list did not suffice. If so, it is made anew with
    more.

    The arguments are those of PySPH's searches. Smoothing lengths may differ, but must not change. On a device all
    neighbour lists are cached.
    """

    def __init__(self, dim, particles, radius_scale=2.0, domain=None, fixed_h=True, backend=None):
        super().__init__(dim, particles, radius_scale, 1, domain, True, False, get_backend(backend))
        self.scale2, self.n_known, self.chosen = float(radius_scale)**2, None, (0, 0)
        self.pairs, self.sources = {}, [Cells(self, pa) for pa in particles]
        self.kernels = {}
        self.domain.update()
        self.update()

    def array(self, n, dtype):
        return zeros(max(n, 1), dtype, backend=self.backend) if n == 0 else Array(dtype, n=n, backend=self.backend)

    def call(self, kernel, *args):
        if kernel not in self.kernels:
            self.kernels[kernel] = Elementwise(kernel, backend=self.backend)
        self.kernels[kernel](*args)

    def set_lattice(self):
        """Cells as wide as the largest support, as many as the particles take now, but not many more than there are.
        """
        filled = [pa.gpu for pa in self.particles if pa.gpu.get_number_of_particles()]
        size = MARGIN * self.radius_scale * max((float(maximum(gpu.h)) for gpu in filled), default=1.0)
        most = max(64, PER_PARTICLE * sum(gpu.get_number_of_particles() for gpu in filled))
        numbers = [1, 1, 1]
        for k, axis in enumerate("xyz"[:self.dim]):
            ends = [(float(minimum(getattr(gpu, axis))), float(maximum(getattr(gpu, axis)))) for gpu in filled]
            length = max((high for _, high in ends), default=0.0) - min((low for low, _ in ends), default=0.0)
            cells = length / size + 3.0
            numbers[k] = 2**int(np.ceil(np.log2(min(cells, most)))) if np.isfinite(cells) else 4
        while np.prod(numbers) > most and max(numbers) > 4:
            numbers[int(np.argmax(numbers))] //= 2
        self.n_cells = int(np.prod(numbers))
        self.lattice = (1.0 / size, *(number - 1 for number in numbers))

    def update(self):
        """Make the lists of all pairs that were asked for."""
        known = [pa.gpu.get_number_of_particles() for pa in self.particles]
        if self.n_known is None or any(now > before for now, before in zip(known, self.n_known)):
            self.set_lattice()
        self.n_known = known
        self.make([*{id(lists.source): lists.source for lists in self.pairs.values()}.values()],
                  list(self.pairs.values()))

    def make(self, sources, pairs):
        while True:
            self.lacking = zeros(1 + len(self.pairs), np.int32, backend=self.backend)
            for cells in sources:
                cells.sort()
            for lists in pairs:
                lists.find()
            lacking = self.lacking.get()
            if not lacking.any():
                return
            for one in [*(sources if lacking[0] else ()), *(lists for lists in pairs if lacking[lists.number])]:
                one.widen()

    def set_context(self, src_index, dst_index):
        """Choose a pair of arrays, whose lists are then those of ``current_cache``."""
        self.chosen = src_index, dst_index
        if self.chosen not in self.pairs:
            source = self.sources[src_index]
            self.pairs[self.chosen] = Lists(self, source, self.particles[dst_index], 1 + len(self.pairs))
            self.make([source], [self.pairs[self.chosen]])

    def lists(self, dst_index, src_index):
        """Device arrays: where the list of each particle begins among all neighbours, its length, and all neighbours.
        """
        self.set_context(src_index, dst_index)
        found = self.current_cache
        return found._start_idx_gpu, found._nbr_lengths_gpu, found._neighbors_gpu

    @property
    def current_cache(self):
        return self.pairs[self.chosen]

    def get_nearest_particles_gpu(self, src_index, dst_index):
        self.set_context(src_index, dst_index)

    def get_nearest_particles(self, src_index, dst_index, d_idx, nbrs):
        """The neighbours of one particle, on the host: for tests, since it fetches all lists."""
        begins, lengths, found = (one.get() for one in self.lists(dst_index, src_index))
        nbrs.resize(int(lengths[d_idx]))
        nbrs.set_data(found[begins[d_idx]:][:lengths[d_idx]])

    def spatially_order_particles(self, pa_index):
        """Sort the particles of an array in memory by their cells; the search must be updated next."""
        cells = self.sources[pa_index]
        if cells.pa.gpu.get_number_of_particles():
            self.make([cells], [])
            cells.pa.gpu.align(cells.indices())

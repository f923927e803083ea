"""A neighbour search for PySPH: a subclass of its NNPS, whose lists are a subclass of its NeighborCache."""
import numpy as np

from cython.parallel cimport prange
from libc.stdint cimport uintptr_t
from libc.stdlib cimport calloc, free, realloc
from libc.string cimport memset
from cyarray.carray cimport BaseArray, DoubleArray, LongArray, UIntArray
from pysph.base.nnps_base cimport NNPS, NNPSParticleArrayWrapper, NeighborCache

cdef extern from "sorted_cells.h" nogil:
    const double SPARE
    const int MOST_SPAN, LANES
    ctypedef struct Cells:
        int number[3]
    ctypedef struct Sorted:
        long n
        double *x
        double *y
        double *z
        double *r2
        unsigned int *id
        int *place
        int *start
        double least, most
    ctypedef struct Lists:
        unsigned int **begin
        int *count
    ctypedef struct Worker:
        unsigned int **slab
        long *size
        long used
        int slabs, now
        float *buffer
    ctypedef struct Run:
        int begin, number
    ctypedef struct Runs:
        Run *run
        int many
        long total
    int omp_get_max_threads()
    int cells_init()
    double cells_bounds(long, double *, double *, double *)
    double cells_fit(Cells *, double *, double *, double)
    int cells_sort(Sorted *, Cells *, long, double *, double *, double *, double *, double)
    int cells_lists(Cells *, Sorted *, Sorted *, int, int, Worker *, Lists *)
    void cells_runs_of(Cells *, Sorted *, Sorted *, long, Runs *)
    int cells_near(Sorted *, int, double, double, double, double)


cdef class SortedCellLists(NeighborCache):
    """The neighbour lists of one pair of arrays, all made at once, in the form of PySPH's NeighborCache."""
    cdef Lists lists
    cdef bint made                  # of the positions of the last update

    def __init__(self, NNPS nnps, int dst_index, int src_index):
        NeighborCache.__init__(self, nnps, dst_index, src_index)
        self._cached.resize(0)      # PySPH's own, which are not used
        self._cached.squeeze()

    def __dealloc__(self):
        free(self.lists.begin)
        free(self.lists.count)

    cpdef find_all_neighbors(self):
        if not self.made:
            (<SortedCellNNPS>self._nnps).find(self)

    cpdef update(self):
        self.made = False

    cpdef get_neighbors(self, int src_index, size_t d_idx, UIntArray nbrs):
        cdef SortedCellNNPS nnps = self._nnps
        nnps.check_index(self._dst_index, d_idx)
        self.find_all_neighbors()
        self.get_neighbors_raw(d_idx, nbrs)

    cdef void get_neighbors_raw(self, size_t d_idx, UIntArray nbrs) noexcept nogil:
        nbrs.c_set_view(self.lists.begin[d_idx], self.lists.count[d_idx])


cdef class SortedCellNNPS(NNPS):
    """Neighbour search by a counting sort of particles into cells.

    It finds the same neighbours as PySPH's LinkedListNNPS, in an order that does not depend on the number of threads,
    but only on positions and on the order of the arrays. ``update`` sorts the particles. The first ``set_context`` of a
    pair of arrays makes their lists, for the positions at the last ``update``. Loops that PySPH generates read these
    lists.

    The parameters are those of PySPH's ``LinkedListNNPS``; with ``cache=False`` there are no lists, and each query
    searches.

    Errors: ``FloatingPointError`` for a position that is NaN or Inf, and ``ValueError`` for an invalid smoothing
    length; both name the array and the particle. ``MemoryError`` if there is not enough memory for the lists.
    """
    cdef Cells cells
    cdef Sorted *sorted             # (narrays)
    cdef Worker *workers            # (threads)
    cdef int threads, lanes
    cdef Lists *current             # of the pair of set_context
    cdef Sorted *source
    cdef Sorted *destination
    cdef UIntArray gid              # of the source
    cdef public bint fixed_h

    ghosts_stay_behind = True       # when particles are sorted

    def __cinit__(self, int dim, list particles, *args, **kwargs):
        self.lanes = cells_init()
        self.sorted = <Sorted *>calloc(len(particles) + 1, sizeof(Sorted))
        if self.sorted == NULL:
            raise MemoryError("SortedCellNNPS")

    def __dealloc__(self):
        cdef int i, k
        for i in range(self.narrays if self.sorted != NULL else 0):
            free(self.sorted[i].x)
            free(self.sorted[i].id)
            free(self.sorted[i].place)
            free(self.sorted[i].start)
        for i in range(self.threads):
            for k in range(self.workers[i].slabs):
                free(self.workers[i].slab[k])
            free(self.workers[i].slab)
            free(self.workers[i].size)
            free(self.workers[i].buffer)
        free(self.sorted)
        free(self.workers)

    def __init__(self, int dim, list particles, double radius_scale=2.0, int ghost_layers=1, domain=None,
                 bint fixed_h=False, bint cache=True, bint sort_gids=False):
        NNPS.__init__(self, dim, particles, radius_scale, ghost_layers, domain, cache, sort_gids)
        self.fixed_h, self.sort_gids = fixed_h, sort_gids
        self.cache = [SortedCellLists(self, d, s) for d in range(self.narrays) for s in range(self.narrays)]
        self.domain.update()
        self.update()

    def use_lanes(self, bint use):
        """Set whether eight candidates are tested at a time, if the processor supports it (AVX2); for tests."""
        self.lanes = use and cells_init()
        self.update()

    def busy_threads(self):
        """Number of threads that have written lists since the search was made."""
        return sum(self.workers[i].slabs > 0 for i in range(self.threads))

    # --- sorting ------------------------------------------------------------------------------------------------------

    cpdef update(self):
        """Sort the particles at their present positions; lists are made again when they are needed."""
        cdef double low[3]
        cdef double high[3]
        cdef double total, side, widest
        cdef long particles
        cdef int i
        cdef NNPSParticleArrayWrapper w
        cdef Sorted *s
        self.cell_size, self.hmin = self.domain.manager.cell_size, self.domain.manager.hmin
        self.measure(low, high)
        particles, side, widest = 0, 0.0, 0.0
        for i in range(self.narrays):
            s = &self.sorted[i]
            particles += s.n
            widest = max(widest, s.most)
            if s.most > 0.0 and (side == 0.0 or s.most < side):
                side = s.most
        side = max(side, widest/MOST_SPAN)*(1.0 + 2.0*SPARE)
        if side == 0.0:
            side = 1.0              # nothing has neighbours
        # Memory for cells, 4 bytes each and array, stays in proportion: where particles lie so far apart that there
        # would be more, the outermost cells take in the few that are far out, and cells are made larger for the rest.
        most = max(1 << 20, 4*particles)
        total = cells_fit(&self.cells, low, high, side)
        if total > most:
            self.bulk(low, high)
            while cells_fit(&self.cells, low, high, side) > most:
                side *= 1.25
        self.n_cells = self.cells.number[0]*self.cells.number[1]*self.cells.number[2]
        for i in range(self.narrays):
            w = self.pa_wrappers[i]
            if cells_sort(&self.sorted[i], &self.cells, w.x.length, w.x.data, w.y.data, w.z.data, w.h.data,
                          self.radius_scale):
                raise MemoryError(f"SortedCellNNPS: no room to sort {w.x.length} particles into {self.n_cells} cells")
        for lists in self.cache:
            lists.update()
        for i in range(self.threads):
            self.workers[i].now = self.workers[i].used = 0
        self.current = NULL

    cdef measure(self, double *low, double *high):
        """Bounds of all positions, and of the smoothing lengths of each array."""
        cdef NNPSParticleArrayWrapper w
        cdef DoubleArray values
        cdef double least, most
        cdef int i, k
        for k in range(3):
            low[k], high[k] = np.inf, -np.inf
        for i in range(self.narrays):
            w = self.pa_wrappers[i]
            for k, values in enumerate((w.x, w.y, w.z)):
                if cells_bounds(values.length, values.data, &low[k], &high[k]) != 0.0:
                    self.refuse(w, "xyz"[k], ~np.isfinite(values.get_npy_array()), FloatingPointError)
            least, most = np.inf, -np.inf
            if cells_bounds(w.h.length, w.h.data, &least, &most) != 0.0 or least < 0.0:
                h = w.h.get_npy_array()
                self.refuse(w, "h", ~(np.isfinite(h) & (h >= 0.0)), ValueError)
            self.sorted[i].n = w.x.length
            self.sorted[i].least, self.sorted[i].most = least*self.radius_scale, max(most*self.radius_scale, 0.0)
        if low[0] > high[0]:        # no particles
            for k in range(3):
                low[k] = high[k] = 0.0
        for k in range(3):
            self.xmin.data[k], self.xmax.data[k] = low[k], high[k]

    def refuse(self, NNPSParticleArrayWrapper w, name, bad, error):
        """Raise ``error`` for the particles of an array that the mask ``bad`` (n,) marks."""
        first = int(np.argmax(bad))
        many = int(np.count_nonzero(bad))
        must = "a number >= 0" if name == "h" else "finite"
        value = w.pa.get(name, only_real_particles=False)[first]
        raise error(f"neighbour search: {name} of particle {first} of array '{w.pa.name}' must be {must}, got {value}"
                    + (f"; {many} particles in all" if many > 1 else ""))

    cdef bulk(self, double *low, double *high):
        """Narrow the bounds to a region with nearly all particles."""
        cdef int k
        for k, axis in enumerate("xyz"):
            values = np.concatenate([w.pa.get(axis, only_real_particles=False) for w in self.pa_wrappers])
            first, last = np.quantile(values, (0.02, 0.98))
            low[k], high[k] = max(low[k], 2.0*first - last), min(high[k], 2.0*last - first)

    # --- lists --------------------------------------------------------------------------------------------------------

    cdef find(self, SortedCellLists lists):
        """Make the lists of a pair of arrays."""
        cdef int threads = omp_get_max_threads(), failed
        cdef Sorted *d = &self.sorted[lists._dst_index]
        cdef Sorted *s = &self.sorted[lists._src_index]
        cdef Lists *l = &lists.lists
        cdef Worker *workers
        cdef NNPSParticleArrayWrapper w
        cdef unsigned int *gid
        cdef long i
        if threads > self.threads:
            workers = <Worker *>realloc(self.workers, threads*sizeof(Worker))
            if workers == NULL:
                raise MemoryError("SortedCellNNPS")
            memset(workers + self.threads, 0, (threads - self.threads)*sizeof(Worker))
            self.workers, self.threads = workers, threads
        with nogil:
            failed = cells_lists(&self.cells, d, s, self.lanes, threads, self.workers, l)
        if failed:
            raise MemoryError(f"SortedCellNNPS: no room for the lists of {d.n} particles")
        if self.sort_gids and s.n > 0:
            w = self.pa_wrappers[lists._src_index]
            gid = w.gid.data
            for i in prange(d.n, nogil=True):
                self._sort_neighbors(l.begin[i], l.count[i], gid)
        lists.made = True

    cpdef set_context(self, int src_index, int dst_index):
        cdef SortedCellLists lists
        NNPS.set_context(self, src_index, dst_index)
        self.source, self.destination = &self.sorted[src_index], &self.sorted[dst_index]
        self.gid = (<NNPSParticleArrayWrapper>self.pa_wrappers[src_index]).gid
        lists = self.current_cache
        self.current = &lists.lists
        if self.use_cache:
            lists.find_all_neighbors()

    def lists(self, int dst_index, int src_index):
        """The neighbours in one array of all particles of another, for loops of one's own: (begin, count), (n,) each.

        ``begin`` holds addresses of the first neighbour's index (``unsigned int``), ``count`` how many there are. One of
        the neighbours stands again behind the last, so often that the length is a multiple of 8: loops may read
        eight at a time. Lists are made if they are not there yet, and good until the next ``update``.
        """
        cdef SortedCellLists lists = self.cache[dst_index*self.narrays + src_index]
        cdef long n = self.sorted[dst_index].n
        lists.find_all_neighbors()
        if n == 0:
            return np.zeros(0, np.uintp), np.zeros(0, np.intc)
        return <uintptr_t[:n]><uintptr_t *>lists.lists.begin, <int[:n]>lists.lists.count

    def check_index(self, int dst_index, size_t d_idx):
        """Raise ``IndexError`` for a particle that did not exist at the last update."""
        if d_idx >= <size_t>self.sorted[dst_index].n:
            raise IndexError(f"array '{self.particles[dst_index].name}' had {self.sorted[dst_index].n} particles at the "
                             f"last update of the neighbour search: there is no particle {d_idx}")

    cdef void get_nearest_neighbors(self, size_t d_idx, UIntArray nbrs) noexcept nogil:
        if self.use_cache:
            if nbrs._old_data == NULL:      # so that the array knows what to free; later views cost less
                nbrs.c_set_view(self.current.begin[d_idx], self.current.count[d_idx])
            nbrs.data, nbrs.length = self.current.begin[d_idx], self.current.count[d_idx]
        else:
            nbrs.c_reset()
            self.find_nearest_neighbors(d_idx, nbrs)

    cpdef get_nearest_particles_no_cache(self, int src_index, int dst_index, size_t d_idx, UIntArray nbrs,
                                         bint prealloc):
        cdef bint use_cache = self.use_cache
        self.check_index(dst_index, d_idx)
        self.use_cache = False      # no lists for a question about one particle
        self.set_context(src_index, dst_index)
        self.use_cache = use_cache
        if prealloc:
            nbrs.length = 0
        else:
            nbrs.c_reset()
        self.find_nearest_neighbors(d_idx, nbrs)

    cdef void find_nearest_neighbors(self, size_t d_idx, UIntArray nbrs) noexcept nogil:
        """Append the neighbours of one particle, without lists; ``set_context`` comes first."""
        cdef Sorted *d = self.destination
        cdef Sorted *s = self.source
        cdef int at = d.place[d_idx], k, j
        cdef size_t before = nbrs.length
        cdef Runs runs
        if s.n == 0:
            return
        cells_runs_of(&self.cells, d, s, d_idx, &runs)
        for k in range(runs.many):
            for j in range(runs.run[k].begin, runs.run[k].begin + runs.run[k].number):
                if cells_near(s, j, d.x[at], d.y[at], d.z[at], d.r2[at]):
                    nbrs.c_append(s.id[j])
        if self.sort_gids:
            self._sort_neighbors(&nbrs.data[before], nbrs.length - before, self.gid.data)

    # --- order in memory ----------------------------------------------------------------------------------------------

    cpdef get_spatially_ordered_indices(self, int pa_index, LongArray indices):
        """Indices of the particles in the order of the cells, with ghosts behind all others, as PySPH needs them."""
        cdef NNPSParticleArrayWrapper w = self.pa_wrappers[pa_index]
        cdef Sorted *s = &self.sorted[pa_index]
        cdef long k, filled = 0, real = w.pa.get_number_of_particles(True)
        if s.n != w.x.length:       # particles were added or removed
            self.update()
        indices.resize(s.n)
        for k in range(s.n):
            if s.id[k] < real:
                indices.data[filled] = s.id[k]
                filled += 1
        for k in range(s.n if filled < s.n else 0):
            if s.id[k] >= real:
                indices.data[filled] = s.id[k]
                filled += 1

    def order_particles(self, int pa_index, without=()):
        """``spatially_order_particles`` of PySPH, except for the properties ``without``, which keep their old order."""
        cdef LongArray indices = LongArray()
        self.get_spatially_ordered_indices(pa_index, indices)
        pa = self.particles[pa_index]
        for name, values in pa.properties.items():
            if name not in without:
                (<BaseArray>values).c_align_array(indices, pa.stride.get(name, 1))

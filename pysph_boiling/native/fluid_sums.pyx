"""Sums over neighbours in the fluid and the density sweeps, over arrays and lists that Python hands in.

The loops are in C, in the headers beside this file.
"""
from libc.stdint cimport uint64_t, uintptr_t
from libc.stdlib cimport free, realloc

import numpy as np

from cyarray.carray cimport DoubleArray, IntArray, UIntArray
from pysph.base.nnps_base cimport NNPS

cdef extern from "exchange.h" nogil:
    enum: NO_CONTAINER, BOX, CYLINDER, ROOM, SWEEP_BLOCK, VAPOUR
    ctypedef struct PairKernel:
        double h, ratio, w_scale, g_scale
        int wendland, deep
    ctypedef struct PairSource:
        const unsigned int **begin
        const int *count
        const double *records
    ctypedef struct SweepModel:
        PairKernel kernel
        int container
        double m, rho_rest, eps, omega, max_displacement, nudge, depth, radius
        double strength, reach, stiffness, dt
        double low[3]
        double high[3]
        double centre[2]
        long ny, nz
        double end[3]
        double origin[3]
        double per, inset
    ctypedef struct SweepFluid:
        long n
        double *x
        double *y
        double *z
        double *sx
        double *sy
        double *sz
        double *qx
        double *qy
        double *qz
        double *q_lmbda
        double *rho
        double *lmbda
        double *impulse
        double *compression
        double *left_over
        int *limited
        int *contacts
        int *projected
        const double *room
        const double *swell
        const unsigned int *uid
        const int *phase
        const double *pull_start_x
        const double *pull_start_y
        const double *pull_start_z
        double *pulled_x
        double *pulled_y
        double *pulled_z
    void pack_records(long, const double *, const double *, const double *, const double *, double *)
    void pack_last(long, const double *, double *)
    void pair_kernel(PairKernel *, double, double, double, double, double)
    void sweep_multipliers(const SweepModel *, const SweepFluid *, const PairSource *, const PairSource *, int, double,
                           double *, double *)
    void sweep_walls(const SweepModel *, const PairSource *, const double *, long, double *)
    void sweep_move(const SweepModel *, const SweepFluid *, const PairSource *, const PairSource *, const PairSource *,
                    int, double, double, double)
    void label_bubbles(long, long, const int *, const unsigned int *, const double *, const double *, const double *,
                       double, const unsigned int **, const int *, const int *, int *, unsigned int *)
    void exchange_heat(const PairKernel *, const PairSource *, long, const double *, double, double *)
    ctypedef struct Forces:
        double viscosity, drag, repulsion, per_unit, start, m
        const double *swell
    void exchange_momentum(const PairKernel *, const PairSource *, const PairSource *, int, const double *, long,
                           const Forces *, const double *, double *, double *, double *)

cdef enum:
    LINE = 64                       # bytes; a record never straddles two lines of the cache


cdef class Records:
    """Memory for (n, 4) numbers that starts at a line of the cache."""
    cdef void *memory
    cdef double *first
    cdef long room

    def __dealloc__(self):
        free(self.memory)

    cdef int fit(self, long n) except -1:
        cdef void *memory
        if n > self.room or self.memory == NULL:
            memory = realloc(self.memory, 32*(n + n//4) + LINE)
            if memory == NULL:
                raise MemoryError(f"no room for the records of {n} particles")
            self.memory, self.room = memory, n + n//4
            self.first = <double *>((<uintptr_t>memory + LINE - 1) // LINE * LINE)
        return 0


cdef double *data(pa, str name) except? NULL:
    """The numbers of a property, for as long as the array has its present length; NULL if it is empty."""
    cdef double[::1] values = pa.get(name, only_real_particles=False)
    return &values[0] if values.shape[0] else NULL


cdef int *counter(pa, str name) except? NULL:
    cdef int[::1] values = pa.get(name, only_real_particles=False)
    return &values[0] if values.shape[0] else NULL


def lists_of(NNPS nnps, int dst, int src):
    """Lists of any neighbour search of PySPH's in the form of ``SortedCellNNPS.lists``: a copy, kept by the third."""
    cdef UIntArray found = UIntArray()
    cdef long n = nnps.particles[dst].get_number_of_particles(True), i, k, filled, used = 0
    cdef int[::1] count = np.zeros(n, np.intc)
    cdef uintptr_t[::1] begin = np.zeros(n, np.uintp)
    cdef unsigned int[::1] kept = np.zeros(64*n + 64, np.uintc)
    nnps.set_context(src, dst)
    for i in range(n):
        nnps.get_nearest_neighbors(i, found)
        filled = (found.length + 7)//8*8           # to a multiple of 8, as there
        if used + filled > kept.shape[0]:
            kept = np.concatenate([kept, np.zeros(kept.shape[0] + filled, np.uintc)])
        for k in range(found.length):
            kept[used + k] = found.data[k]
        begin[i], count[i] = used, found.length
        for k in range(found.length, filled):
            kept[used + k] = kept[used]
        used += filled
    for i in range(n):
        begin[i] = <uintptr_t>(&kept[0] + begin[i])
    return begin, count, kept


cdef class FluidSums:
    """Sums over the neighbours of one fluid within it, for arrays in double precision on the host.

    ``kernel`` are its coefficients (c3, c4, c5, c1), ``deep`` says whether it is 3-D.
    """
    cdef PairKernel kernel
    cdef double[4] coefficients
    cdef PairSource own
    cdef Records records
    cdef PairSource *walls
    cdef int n_walls
    cdef list wall_records
    cdef object kept                # what pointers point into
    cdef long n, total              # particles; with ghosts
    cdef double m

    def __dealloc__(self):
        free(self.walls)

    def __init__(self, *, tuple kernel, bint deep):
        for k in range(4):
            self.coefficients[k] = kernel[k]
        self.kernel.deep = deep
        self.records, self.wall_records = Records(), []

    cdef int take_up(self, pa, lists) except -1:
        """The fluid where it is now, and its lists of neighbours (those of ``SortedCellNNPS.lists``)."""
        cdef double *c = self.coefficients
        self.kept = [pa, lists]
        self.total, self.n = pa.get_number_of_particles(), pa.get_number_of_particles(True)
        if self.total:              # uniform, as the scheme has found out
            self.m = data(pa, "m")[0]
            pair_kernel(&self.kernel, data(pa, "h")[0], c[0], c[1], c[2], c[3])
        self.point(&self.own, lists, self.records, self.total)
        return 0

    cdef const double *swells(self, pa) except? NULL:
        """The swell of the particles and ghosts that were taken up; NULL if it is 1 everywhere."""
        cdef double ends[2]
        cdef const double *swell = data(pa, "swell")
        property_ends(self.total, swell, ends)
        if ends[0] == 1.0 and ends[1] == 1.0:
            return NULL
        return swell

    cdef int take_up_walls(self, walls) except -1:
        """Pairs (array, lists of the fluid's neighbours there); ``take_up`` comes first."""
        self.kept.append(walls)
        self.n_walls = len(walls)
        self.walls = self.point_at_walls(self.walls, self.wall_records, walls)
        return 0

    cdef PairSource *point_at_walls(self, PairSource *sources, list kept, walls) except? NULL:
        """``sources`` with room for the ``walls``, and new records of these in ``kept``."""
        cdef PairSource *found = sources
        cdef Records records
        cdef long n
        if len(kept) < len(walls):
            found = <PairSource *>realloc(sources, len(walls)*sizeof(PairSource))
            if found == NULL:
                raise MemoryError(f"no room for {len(walls)} arrays of walls")
            kept[:] = [Records() for _ in walls]
        for k in range(len(walls)):
            wall, wall_lists = walls[k]
            n, records = wall.get_number_of_particles(), kept[k]
            self.point(&found[k], wall_lists, records, n)
            if n:
                pack_records(n, data(wall, "x"), data(wall, "y"), data(wall, "z"), data(wall, "m"), records.first)
        return found

    cdef int point(self, PairSource *s, lists, Records records, long n) except -1:
        cdef uintptr_t[::1] begin
        cdef int[::1] count
        begin, count = lists[:2]
        if count.shape[0] < self.n:
            raise ValueError(f"neighbour lists of {count.shape[0]} particles for {self.n} particles of the fluid")
        records.fit(n)
        s.begin = <const unsigned int **>&begin[0] if begin.shape[0] else NULL
        s.count, s.records = &count[0] if count.shape[0] else NULL, records.first
        return 0


cdef class Exchange(FluidSums):
    """What particles of a fluid exchange with their neighbours in it: heat, and momentum."""
    cdef Records velocities

    def __init__(self, **options):
        super().__init__(**options)
        self.velocities = Records()

    def heat(self, pa, lists, double rho0):
        """Add to ``ae`` [J/(kg s)] what HeatConductionClearyMonaghan adds."""
        cdef double factor
        self.take_up(pa, lists)
        factor = 4.0*self.m/(rho0*rho0)*self.kernel.g_scale
        pack_records(self.total, data(pa, "x"), data(pa, "y"), data(pa, "z"), data(pa, "k"), self.records.first)
        exchange_heat(&self.kernel, &self.own, self.n, data(pa, "T"), factor, data(pa, "ae"))

    def momentum(self, pa, lists, walls, double viscosity, double drag, double rho0, gravity, repulsion=None,
                 double start=0.0, bint swollen=False):
        """Set the accelerations [m/s^2] to gravity with what PBFXSPHViscosity and BubbleDrag add; rates in 1/s.

        ``repulsion`` are parameters of PBFArtificialPressure, strength/rho_rest [m^5/(kg s^2)] and per_unit, or none.
        ``start`` is 1/rho_rest [m^3/kg] for PBFWarmStart, or PBFWarmStartSwollen if ``swollen``, and with ``walls``
        (pairs of an array and the lists of the fluid's neighbours there) PBFBoundaryWarmStart; 0 for none.
        """
        cdef double g[3]
        cdef double scale, volume
        cdef Forces forces
        cdef const int *phase = counter(pa, "phase") if drag > 0.0 else NULL
        cdef double *records
        cdef long i
        self.take_up(pa, lists)
        self.take_up_walls(walls)
        self.velocities.fit(self.total)
        g[0], g[1], g[2] = gravity
        scale = self.m/rho0*self.kernel.w_scale
        records = self.records.first
        pack_records(self.total, data(pa, "x"), data(pa, "y"), data(pa, "z"), NULL, records)
        if phase != NULL:
            for i in range(self.total):
                records[4*i + 3] = phase[i] == VAPOUR
        pack_records(self.total, data(pa, "u"), data(pa, "v"), data(pa, "w"),
                     data(pa, "lmbda_start") if start > 0.0 else NULL, self.velocities.first)
        forces.viscosity, forces.drag, forces.m = viscosity*scale, drag*scale, self.m
        forces.repulsion, forces.per_unit, forces.start = 0.0, 0.0, start*self.kernel.g_scale
        forces.swell = NULL
        if swollen and start > 0.0:
            forces.swell = self.swells(pa)
        if repulsion is not None:
            volume = self.kernel.h**3 if self.kernel.deep else self.kernel.h**2
            forces.repulsion = self.m*repulsion[0]*self.kernel.g_scale
            forces.per_unit = repulsion[1]*self.kernel.w_scale*volume
        exchange_momentum(&self.kernel, &self.own, self.walls, self.n_walls, self.velocities.first, self.n, &forces, g,
                          data(pa, "au"), data(pa, "av"), data(pa, "aw"))


cdef class Labels(FluidSums):
    """The bubbles of a fluid."""

    def label(self, pa, lists, double radius2, images):
        """Set ``bubble`` to the smallest uid of each connected part of the vapour, and ``parent``.

        ``radius2`` [m^2] is the square of the linking radius; ``images`` (ghosts,) are the particles that the ghosts
        are images of.
        """
        cdef unsigned int[::1] uid = pa.get("uid", only_real_particles=False)
        cdef unsigned int[::1] bubble = pa.get("bubble", only_real_particles=False)
        cdef int[::1] ghosts = np.ascontiguousarray(images, np.intc)
        self.take_up(pa, lists)
        if ghosts.shape[0] != self.total - self.n:
            raise ValueError(f"{self.total - self.n} ghosts have {ghosts.shape[0]} originals")
        if self.total:
            label_bubbles(self.n, self.total, counter(pa, "phase"), &uid[0], data(pa, "x"), data(pa, "y"),
                          data(pa, "z"), radius2, self.own.begin, self.own.count,
                          &ghosts[0] if ghosts.shape[0] else NULL, counter(pa, "parent"), &bubble[0])


cdef class DensitySweeps(FluidSums):
    """The sums and moves of the density sweeps of one fluid.

    ``rho_rest`` to ``nudge`` and ``depth`` are parameters of the equations. ``carries`` is true for sweeps that carry
    on what the last one moved (the properties qx, qy and qz), ``swollen`` for particles that fill ``swell`` times the
    volume of their liquid. The container is a ``box`` (lower and upper corner [m]),
    a ``cylinder`` (x and y of its centre, radius, bottom, top [m]), or none; ``cohesion`` is its strength [m/s^2],
    radius [m] and stiffness [1/m], or none.

    A sweep is ``multipliers``, ``wall_multipliers`` if walls have any, then ``move``, all on the particles that
    ``start`` was given. What ghosts need is copied to them between these, and after the last one.
    """
    cdef SweepModel model
    cdef SweepFluid fluid
    cdef bint carries, swollen, coheres
    cdef PairSource *pushes         # as the walls, with other records
    cdef list push_records, extrapolated
    cdef Records partial

    def __dealloc__(self):
        free(self.pushes)

    def __init__(self, *, double rho_rest, double eps, double omega, double max_displacement, double nudge,
                 bint carries=False, bint swollen=False, double depth=0.0, box=None, cylinder=None, room=None,
                 cohesion=None, **options):
        cdef SweepModel *p = &self.model
        super().__init__(**options)
        p.rho_rest, p.eps, p.omega, p.nudge, p.depth = rho_rest, eps, omega, nudge, depth
        p.max_displacement = max_displacement
        p.container, self.carries, self.swollen, self.partial = NO_CONTAINER, carries, swollen, Records()
        self.push_records, self.extrapolated = [], []
        if box:
            p.container = BOX
            for k in range(3):
                p.low[k], p.high[k] = box[0][k], box[1][k]
        if cylinder:
            p.container = CYLINDER
            p.centre[0], p.centre[1], p.radius, p.low[2], p.high[2] = cylinder
        if room:
            p.container = ROOM
            p.ny, p.nz, end, origin, p.per, p.inset = room
            for k in range(3):
                p.end[k], p.origin[k] = end[k], origin[k]
        self.coheres = cohesion is not None
        if self.coheres:
            p.strength, p.reach, p.stiffness = cohesion

    def start(self, pa, lists, walls, double dt, extrapolated=()):
        """Take up the fluid ``pa`` where it is now, for sweeps of a step of ``dt`` [s].

        ``lists`` are those of its neighbours within it, ``walls`` pairs (array, lists of the fluid's neighbours there).
        Where walls have multipliers, ``extrapolated`` are the lists of the neighbours of each in the fluid.
        """
        cdef SweepFluid *f = &self.fluid
        cdef unsigned int[::1] uid = pa.get("uid", only_real_particles=False)
        self.take_up(pa, lists)
        self.model.m, self.model.kernel, self.model.dt = self.m, self.kernel, dt
        f.n = self.n
        f.x, f.y, f.z = data(pa, "x"), data(pa, "y"), data(pa, "z")
        f.sx, f.sy, f.sz = data(pa, "sx"), data(pa, "sy"), data(pa, "sz")
        f.qx = f.qy = f.qz = f.q_lmbda = NULL
        if self.carries:
            f.q_lmbda = data(pa, "q_lmbda")
            f.qx, f.qy, f.qz = data(pa, "qx"), data(pa, "qy"), data(pa, "qz")
        f.rho, f.lmbda, f.compression = data(pa, "rho"), data(pa, "lmbda"), data(pa, "compression")
        f.impulse, f.left_over, f.limited = data(pa, "impulse"), data(pa, "left_over"), counter(pa, "limited")
        f.swell = NULL
        if self.swollen:
            f.swell = self.swells(pa)
        f.uid = &uid[0] if uid.shape[0] else NULL
        f.phase = NULL
        if self.coheres:
            f.phase = counter(pa, "phase")
            f.pulled_x, f.pulled_y, f.pulled_z = data(pa, "pulled_x"), data(pa, "pulled_y"), data(pa, "pulled_z")
            f.pull_start_x, f.pull_start_y = data(pa, "pull_start_x"), data(pa, "pull_start_y")
            f.pull_start_z = data(pa, "pull_start_z")
        f.contacts = f.projected = NULL
        if self.model.container != NO_CONTAINER:
            f.contacts, f.projected = counter(pa, "contacts"), counter(pa, "projected")
        if self.model.container == ROOM:
            f.room = (<DoubleArray?>pa.constants["room"]).data
        self.take_up_walls(walls)
        self.extrapolated = list(extrapolated)
        self.pushes = self.point_at_walls(self.pushes, self.push_records, walls if extrapolated else ())
        self.partial.fit(1 + f.n//SWEEP_BLOCK)

    def multipliers(self, double forgiven):
        """Density, its error and the multipliers of all particles; the share ``forgiven`` of ``left_over`` stays.

        Returns the sum of the errors, the sum of those that are to be worked off, and the largest error.
        """
        cdef SweepFluid *f = &self.fluid
        cdef double found[3]
        pack_records(self.total, f.x, f.y, f.z, f.swell, self.records.first)
        sweep_multipliers(&self.model, f, &self.own, self.walls, self.n_walls, forgiven, self.partial.first, found)
        return found[0], found[1], found[2]

    def wall_multipliers(self, walls):
        """The multipliers of ``walls``, the arrays that ``start`` was given."""
        cdef PairSource near
        cdef uintptr_t[::1] begin
        cdef int[::1] count
        cdef Records records
        cdef long n
        pack_last(self.total, self.fluid.lmbda, self.records.first)
        near.records = self.records.first
        for k in range(len(walls)):
            begin, count = self.extrapolated[k][:2]
            n, records = walls[k].get_number_of_particles(True), self.wall_records[k]
            if count.shape[0] < n:
                raise ValueError(f"neighbour lists of {count.shape[0]} particles for {n} particles of a wall")
            if n:
                near.begin, near.count = <const unsigned int **>&begin[0], &count[0]
                sweep_walls(&self.model, &near, records.first, n, data(walls[k], "wall_lmbda"))

    cdef int take_up_pushes(self) except -1:
        """Mass times multiplier of the walls, into the records of what pushes."""
        cdef double *psi
        cdef double *lmbda
        cdef double *records
        cdef long i
        for k in range(len(self.extrapolated)):
            wall = self.kept[2][k][0]
            psi, lmbda, records = data(wall, "m"), data(wall, "wall_lmbda"), (<Records>self.push_records[k]).first
            for i in range(wall.get_number_of_particles()):
                records[4*i + 3] = psi[i]*lmbda[i]
        return 0

    def move(self, double nudge, double feels, double weight):
        """Apply the corrections.

        ``nudge`` scales what sets particles at one place apart, the velocity ``feels`` that share of the move, and
        ``weight`` is that of Chebyshev's iteration (1: none).
        """
        pack_last(self.total, self.fluid.lmbda, self.records.first)
        self.take_up_pushes()
        sweep_move(&self.model, &self.fluid, &self.own, self.walls, self.pushes if self.extrapolated else NULL,
                   self.n_walls, nudge, feels, weight)


# --- sums over the particles alone ------------------------------------------------------------------------------------

cdef extern from * nogil:
    enum: N_STATES
    long label_groups(long, const unsigned int *, uint64_t *, unsigned int *, long *, long *, long *)
    void count_members(long, const long *, const double *, double, double, const unsigned int *, long,
                       const unsigned int *, double *, double *)
    int any_within(long, const int *, int, int)
    long all_within(long, const int *, int, int, long *)
    double property_sum(long, const double *)
    double counter_sum(long, const int *)
    void property_ends(long, const double *, double *)
    double largest_square(long, const double *, const double *, const double *)
    void state_sums(long, const double *, const double *, const double *, const int *, double *, double *)


def sum_of(values):
    """Sum of a property (n,), of type float or int."""
    cdef const double[::1] numbers
    cdef const int[::1] counters
    if values.dtype.kind == "f":
        numbers = values
        return property_sum(numbers.shape[0], &numbers[0]) if numbers.shape[0] else 0.0
    counters = values
    return counter_sum(counters.shape[0], &counters[0]) if counters.shape[0] else 0.0


def sums_of(pa, names):
    """Sums of properties of the real particles of an array, each of type float or int, as a list."""
    cdef long n = pa.get_number_of_particles(True)
    cdef list sums = []
    for name in names:
        values = pa.properties[name]
        sums.append(property_sum(n, (<DoubleArray>values).data) if type(values) is DoubleArray
                    else counter_sum(n, (<IntArray?>values).data))
    return sums


def has_within(const int[::1] values, int low, int high):
    """Whether one of the values (n,) lies in low..high."""
    return values.shape[0] > 0 and any_within(values.shape[0], &values[0], low, high) != 0


def indices_within(const int[::1] values, int low, int high):
    """Indices of the values (n,) that lie in low..high, in order."""
    cdef long n = values.shape[0]
    found = np.empty(all_within(n, &values[0], low, high, NULL) if n else 0, np.int_)
    cdef long[::1] f = found
    if f.shape[0]:
        all_within(n, &values[0], low, high, &f[0])
    return found


def ends_of(const double[::1] values):
    """Smallest and largest value of a property (n,); both NaN if there is one, infinite if n is 0."""
    cdef double ends[2]
    property_ends(values.shape[0], &values[0] if values.shape[0] else NULL, ends)
    return ends[0], ends[1]


def square_of(const double[::1] x, const double[::1] y, const double[::1] z):
    """Largest square of a vector property with the components (n,); 0 if n is 0, NaN if there is one."""
    if not x.shape[0] == y.shape[0] == z.shape[0]:
        raise ValueError(f"components of {x.shape[0]}, {y.shape[0]} and {z.shape[0]} particles")
    return largest_square(x.shape[0], &x[0], &y[0], &z[0]) if x.shape[0] else 0.0


def states_of(const double[::1] m, const double[::1] e, const double[::1] e_lat, const int[::1] phase):
    """Number of particles and enthalpy [J] by state: two lists, the second one with the held latent heat at its end."""
    cdef double number[N_STATES]
    cdef double energy[N_STATES + 1]
    cdef long n = m.shape[0]
    if not n == e.shape[0] == e_lat.shape[0] == phase.shape[0]:
        raise ValueError(f"masses of {n}, enthalpies of {e.shape[0]}, held heat of {e_lat.shape[0]} and phases of "
                         f"{phase.shape[0]} particles")
    if n == 0:
        return [0.0]*N_STATES, [0.0]*(N_STATES + 1)
    state_sums(n, &m[0], &e[0], &e_lat[0], &phase[0], number, energy)
    return [number[k] for k in range(N_STATES)], [energy[k] for k in range(N_STATES + 1)]


def groups_of(const unsigned int[::1] label):
    """As ``np.unique`` of labels (n,): the labels, where each comes first, the group of each of n, and their sizes."""
    cdef long n = label.shape[0], groups = 0
    group = np.empty(n, np.uintc)
    key, first, index, number = np.empty((4, n), np.int_)
    cdef unsigned int[::1] g = group
    cdef long[::1] o = key, f = first, k = index, m = number
    if n:
        groups = label_groups(n, &label[0], <uint64_t *>&o[0], &g[0], &f[0], &m[0], &k[0])
    return group[:groups], first[:groups], index, number[:groups]


def counts_of(const long[::1] index, long groups, const double[::1] height, double base, double reach,
              const unsigned int[::1] uid, const unsigned int[::1] known):
    """Of the members (n,) of each group: how many lie no more than ``reach`` above ``base``, and how many have a uid in
    the sorted ``known``, both (groups,)."""
    cdef long n = index.shape[0], m = known.shape[0]
    counts = np.zeros((2, groups + 1))
    cdef double[:, ::1] c = counts
    if not n == height.shape[0] == uid.shape[0]:
        raise ValueError(f"groups of {n}, heights of {height.shape[0]} and uids of {uid.shape[0]} particles")
    if n:
        count_members(n, &index[0], &height[0], base, reach, &uid[0], m, &known[0] if m else NULL, &c[0, 0], &c[1, 0])
    return counts[0, :groups], counts[1, :groups]

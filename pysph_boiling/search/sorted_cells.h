/* Neighbour search over particles that are sorted into cells: the loops that do the work, in C++, with OpenMP or without.
 *
 * Space is cut into cells. Those of one row along x follow each other in memory, so that the candidates of all particles
 * of a cell are a few runs of memory: nine in 3-D, where a cell is as wide as the support in y and z and half as wide in
 * x. The runs are copied to one buffer, in single precision and in widths of a cell from the corner of the cell in
 * question, whatever the unit and wherever the origin is. Each particle then meets one straight loop, eight candidates at
 * a time with AVX2. What lies so near the support that single precision cannot tell is decided by PySPH's own expression
 * in double precision,
 *     |x_j - x_i|^2 < (radius_scale h_i)^2   or   |x_j - x_i|^2 < (radius_scale h_j)^2,
 * so that the neighbours are PySPH's to the last bit. Compile without contraction of products and sums
 * (-ffp-contract=off), as PySPH is on x86-64.
 *
 * A list is in the order of the cells (z, y, x), within a cell in that of the array. Cells lie on a lattice fixed in space.
 */
#ifndef SORTED_CELLS_H
#define SORTED_CELLS_H
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#ifdef _OPENMP
#include <omp.h>
#else
static inline int omp_get_thread_num(void) { return 0; }
static inline int omp_get_max_threads(void) { return 1; }
#endif
#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#define CELLS_AVX2 __attribute__((target("avx2,fma,popcnt")))
#else
#define CELLS_AVX2
#endif

enum { LANES = 8, MOST_SPAN = 8, MOST_RUNS = (2 * MOST_SPAN + 1) * (2 * MOST_SPAN + 1), SLAB = 1 << 19 };
static const double SPARE = 1e-6;   /* of a cell: so that rounding puts no neighbour one cell too far */
static const double UNSURE = 1e-5;  /* of the support squared, ten times the error of single precision */

struct Cells {                      /* the lattice */
    int number[3];
    double corner[3], width[3], per[3], side;   /* per = 1 / width; side is that in y and z */
};

struct Sorted {                     /* one array, sorted by cell */
    long n, room, cells_room;
    double *x, *y, *z, *r2;         /* (n) each; r2 = (radius_scale h)^2 */
    unsigned int *id;               /* (n) index in the array */
    int *place;                     /* (n) where a particle of the array stands here */
    int *start;                     /* (cells + 1) */
    double least, most;             /* of radius_scale h */
};

struct Lists { unsigned int **begin; int *count; long room; };      /* of one (destination, source) pair */

struct Worker {                     /* what one thread writes to: its lists in slabs, and its candidates */
    unsigned int **slab;
    long *size, used, buffer_room;
    int slabs, now;
    float *buffer;
    char apart[128];                /* two threads never share a line of the cache */
};

struct Run { int begin, number; };  /* candidates that follow each other in a Sorted */

struct Runs { Run run[MOST_RUNS]; int many; long total; };

static unsigned int cells_lanes[256][LANES] __attribute__((aligned(64)));   /* which lanes a mask keeps, in order */

static int cells_init(void) {       /* whether the processor has AVX2 */
#if defined(__x86_64__) && defined(__GNUC__)
    for (int mask = 0; mask < 256; mask++)
        for (int k = 0, n = 0; k < LANES; k++)
            if (mask >> k & 1) cells_lanes[mask][n++] = k;
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
#else
    return 0;
#endif
}

/* Extends low and high to hold `v` (n). Returns NaN if one of them is NaN or Inf, 0 otherwise. */
static double cells_bounds(long n, const double *v, double *low, double *high) {
    double l = *low, h = *high, bad = 0.0;
    #pragma omp parallel for simd reduction(min : l) reduction(max : h) reduction(+ : bad) if (parallel : n > 50000)
    for (long i = 0; i < n; i++) {
        l = v[i] < l ? v[i] : l;
        h = v[i] > h ? v[i] : h;
        bad += 0.0 * v[i];
    }
    *low = l; *high = h;
    return bad;
}

/* Cells of the width `side` between low (3) and high (3); returns their number, which may be too large to use. */
static double cells_fit(Cells *c, const double *low, const double *high, double side) {
    double total = 1.0;
    c->side = side;
    for (int k = 0; k < 3; k++) {
        c->width[k] = k == 0 ? 0.5 * side : side;
        c->per[k] = 1.0 / c->width[k];
        c->corner[k] = floor(low[k] / c->width[k]) * c->width[k];
        double number = floor((high[k] - c->corner[k]) / c->width[k]) + 1.0;
        number = number > 1.0 ? number : 1.0;
        total *= number;
        c->number[k] = number < 1e9 ? (int)number : 1000000000;
    }
    return total;
}

/* Cell along one axis; what lies outside belongs to the outermost one, so that neighbours stay neighbours. */
static inline int cells_along(const Cells *c, int k, double v) {
    double at = (v - c->corner[k]) * c->per[k];
    return at < 1.0 ? 0 : at >= c->number[k] ? c->number[k] - 1 : (int)at;
}

static inline int cells_of(const Cells *c, double x, double y, double z) {
    return cells_along(c, 0, x) + c->number[0] * (cells_along(c, 1, y) + c->number[1] * cells_along(c, 2, z));
}

/* Counting sort, stable. Returns 1 where memory is short. */
static int cells_sort(Sorted *s, const Cells *c, long n, const double *x, const double *y, const double *z,
                      const double *h, double scale) {
    long cells = (long)c->number[0] * c->number[1] * c->number[2];
    if (n > s->room || !s->x) {
        s->room = n + n / 4 + 64;
        free(s->x); free(s->id); free(s->place);
        s->x = (double *)malloc(4 * sizeof(double) * s->room);
        s->id = (unsigned int *)malloc(sizeof(int) * s->room);
        s->place = (int *)malloc(sizeof(int) * s->room);
        if (!s->x || !s->id || !s->place) { s->room = s->n = 0; return 1; }
        s->y = s->x + s->room; s->z = s->y + s->room; s->r2 = s->z + s->room;
    }
    if (cells + 2 > s->cells_room) {
        s->cells_room = cells + cells / 4 + 64;
        free(s->start);
        s->start = (int *)malloc(sizeof(int) * s->cells_room);
        if (!s->start) { s->cells_room = s->n = 0; return 1; }
    }
    memset(s->start, 0, sizeof(int) * (cells + 2));
    s->n = n;
    int *next = s->start + 1;       /* start[c + 1], which moves from the start to the end of its cell */
    #pragma omp parallel for if (n > 50000)
    for (long i = 0; i < n; i++) s->place[i] = cells_of(c, x[i], y[i], z[i]);
    for (long i = 0; i < n; i++) next[s->place[i]]++;
    int total = 0;
    for (long k = 0; k < cells; k++) { int number = next[k]; next[k] = total; total += number; }
    for (long i = 0; i < n; i++) {
        int k = next[s->place[i]]++;
        double r = scale * h[i];
        s->x[k] = x[i]; s->y[k] = y[i]; s->z[k] = z[i]; s->r2[k] = r * r;
        s->id[k] = (unsigned int)i; s->place[i] = k;
    }
    return 0;
}

static inline int cells_near(const Sorted *s, int j, double x, double y, double z, double r2) {
    double dx = s->x[j] - x, dy = s->y[j] - y, dz = s->z[j] - z, d2 = dx * dx + dy * dy + dz * dz;
    return d2 < r2 || d2 < s->r2[j];
}

/* How many cells along each axis a list reaches. */
static void cells_spans(const Cells *c, const Sorted *d, const Sorted *s, int *span) {
    double reach = d->most > s->most ? d->most : s->most;
    for (int k = 0; k < 3; k++) span[k] = (int)ceil(reach * (1.0 + SPARE) / c->width[k]);
}

/* The runs of candidates of a cell. */
static void cells_runs(const Cells *c, const Sorted *s, int cell, const int *span, Runs *r) {
    int nx = c->number[0], ny = c->number[1], nz = c->number[2];
    int ix = cell % nx, iy = cell / nx % ny, iz = cell / nx / ny;
    int x0 = ix > span[0] ? ix - span[0] : 0, x1 = ix + span[0] < nx ? ix + span[0] : nx - 1;
    r->many = 0; r->total = 0;
    for (int kz = iz > span[2] ? iz - span[2] : 0; kz <= iz + span[2] && kz < nz; kz++)
        for (int ky = iy > span[1] ? iy - span[1] : 0; ky <= iy + span[1] && ky < ny; ky++) {
            const int *start = s->start + (long)nx * (ky + (long)ny * kz);
            int begin = start[x0], number = start[x1 + 1] - begin;
            if (number > 0) {
                r->run[r->many].begin = begin; r->run[r->many++].number = number;
                r->total += number;
            }
        }
}

/* Neighbours among the candidates, one by one in double precision; `out` has room for all of them, and one. */
static int cells_scan(const Runs *r, const Sorted *s, double x, double y, double z, double r2, unsigned int *out) {
    int n = 0;
    for (int k = 0; k < r->many; k++)
        for (int j = r->run[k].begin, end = j + r->run[k].number; j < end; j++) {
            out[n] = s->id[j];
            n += cells_near(s, j, x, y, z, r2);
        }
    return n;
}

#if defined(__x86_64__) && defined(__GNUC__)
struct Candidates { float *x, *y, *z, *r2; unsigned int *id; double corner[3], unit; int uniform; float unsure; };

/* Copies the candidates to the worker's buffer; returns 1 where memory is short. */
CELLS_AVX2 static int cells_gather(const Runs *r, const Sorted *s, Worker *w, Candidates *t) {
    if (r->total + LANES > w->buffer_room) {
        w->buffer_room = (2 * r->total + 1024) / 16 * 16;   /* a line of the cache: loads straddle none */
        free(w->buffer);
        w->buffer = (float *)malloc(5 * sizeof(float) * w->buffer_room + 64);
        if (!w->buffer) { w->buffer_room = 0; return 1; }
    }
    t->x = (float *)(((uintptr_t)w->buffer + 63) / 64 * 64);
    t->y = t->x + w->buffer_room; t->z = t->y + w->buffer_room; t->r2 = t->z + w->buffer_room;
    t->id = (unsigned int *)(t->r2 + w->buffer_room);
    const double x0 = t->corner[0], y0 = t->corner[1], z0 = t->corner[2], unit = t->unit;
    float *tx = t->x, *ty = t->y, *tz = t->z, *tr = t->r2;
    for (int k = 0; k < r->many; k++) {
        const long b = r->run[k].begin, number = r->run[k].number;
        const double *sx = s->x + b, *sy = s->y + b, *sz = s->z + b, *sr = s->r2 + b;
        #pragma omp simd
        for (long q = 0; q < number; q++) {
            tx[q] = (float)((sx[q] - x0) * unit);
            ty[q] = (float)((sy[q] - y0) * unit);
            tz[q] = (float)((sz[q] - z0) * unit);
        }
        if (!t->uniform)
            for (long q = 0; q < number; q++) tr[q] = (float)(sr[q] * unit * unit);
        tx += number; ty += number; tz += number; tr += number;
    }
    unsigned int *id = t->id;
    for (int k = 0; k < r->many; k++) {
        memcpy(id, s->id + r->run[k].begin, sizeof(int) * r->run[k].number);
        id += r->run[k].number;
    }
    for (int q = 0; q < LANES; q++) { tx[q] = 1e18f; ty[q] = tz[q] = tr[q] = 0.0f; id[q] = 0; }
    return 0;
}

/* Neighbours among the candidates, eight at a time; `out` has room for all of them, and eight. */
CELLS_AVX2 static int cells_scan_lanes(const Candidates *t, const Runs *r, const Sorted *s, double x, double y, double z,
                                       double r2, unsigned int *out) {
    const float *tx = t->x, *ty = t->y, *tz = t->z, *tr = t->r2;    /* which the stores below do not change */
    const unsigned int *id = t->id;
    const __m256 X = _mm256_set1_ps((float)((x - t->corner[0]) * t->unit));
    const __m256 Y = _mm256_set1_ps((float)((y - t->corner[1]) * t->unit));
    const __m256 Z = _mm256_set1_ps((float)((z - t->corner[2]) * t->unit));
    const __m256 R = _mm256_set1_ps((float)(r2 * t->unit * t->unit)), unsure = _mm256_set1_ps(t->unsure);
    __m256 high = _mm256_add_ps(R, unsure), low = _mm256_sub_ps(R, unsure);
    int n = 0;
    for (long k = 0; k < r->total; k += LANES) {
        __m256 dx = _mm256_sub_ps(_mm256_load_ps(tx + k), X), dy = _mm256_sub_ps(_mm256_load_ps(ty + k), Y);
        __m256 dz = _mm256_sub_ps(_mm256_load_ps(tz + k), Z);
        __m256 d2 = _mm256_fmadd_ps(dx, dx, _mm256_fmadd_ps(dy, dy, _mm256_mul_ps(dz, dz)));
        if (!t->uniform) {
            __m256 most = _mm256_max_ps(R, _mm256_load_ps(tr + k));
            high = _mm256_add_ps(most, unsure); low = _mm256_sub_ps(most, unsure);
        }
        unsigned int maybe = _mm256_movemask_ps(_mm256_cmp_ps(d2, high, _CMP_LT_OQ));
        unsigned int sure = _mm256_movemask_ps(_mm256_cmp_ps(d2, low, _CMP_LT_OQ));
        for (unsigned int ask = maybe & ~sure; __builtin_expect(ask != 0, 0); ask &= ask - 1) {
            int lane = __builtin_ctz(ask), run = 0;
            long at = k + lane;
            while (run < r->many && at >= r->run[run].number) at -= r->run[run++].number;
            if (run < r->many && cells_near(s, r->run[run].begin + (int)at, x, y, z, r2)) sure |= 1u << lane;
        }
        _mm256_storeu_si256((__m256i *)(out + n), _mm256_permutevar8x32_epi32(
            _mm256_load_si256((const __m256i *)(id + k)), _mm256_load_si256((const __m256i *)cells_lanes[sure])));
        n += __builtin_popcount(sure);
    }
    return n;
}
#endif

/* Room for `bound` more neighbours in the worker's slabs; NULL where memory is short. */
static unsigned int *cells_room(Worker *w, long bound) {
    while (w->now < w->slabs && w->used + bound > w->size[w->now]) { w->now++; w->used = 0; }
    if (w->now == w->slabs) {
        long size = bound > SLAB ? bound : SLAB;
        unsigned int **slab = (unsigned int **)realloc(w->slab, sizeof(void *) * (w->slabs + 1));
        if (slab) w->slab = slab;
        long *sizes = (long *)realloc(w->size, sizeof(long) * (w->slabs + 1));
        if (sizes) w->size = sizes;
        unsigned int *made = slab && sizes ? (unsigned int *)malloc(sizeof(int) * size) : NULL;
        if (!made) return NULL;
        w->slab[w->slabs] = made; w->size[w->slabs++] = size;
    }
    return w->slab[w->now] + w->used;
}

/* Lists of the particles of `d` in one cell, among `s`; returns 1 where memory is short. */
static int cells_lists_of(const Cells *c, const Sorted *d, const Sorted *s, int cell, const int *span, int lanes,
                          Worker *w, Lists *l) {
    Runs runs;
    cells_runs(c, s, cell, span, &runs);
#if defined(__x86_64__) && defined(__GNUC__)
    Candidates t;
    const int index[3] = {cell % c->number[0], cell / c->number[0] % c->number[1], cell / c->number[0] / c->number[1]};
    const double far = 2.0 * c->side;       /* of a particle that the outermost cells took in: not for single precision */
    for (int k = 0; k < 3; k++) t.corner[k] = c->corner[k] + index[k] * c->width[k];
    t.unit = 1.0 / c->side;
    t.uniform = s->most <= d->least;        /* then no h_j adds a neighbour */
    t.unsure = (float)(UNSURE * span[1] * span[1]);
    if (lanes && cells_gather(&runs, s, w, &t)) return 1;
#endif
    for (int q = d->start[cell]; q < d->start[cell + 1]; q++) {
        unsigned int i = d->id[q], *out = cells_room(w, runs.total + LANES);
        if (!out) return 1;
        double x = d->x[q], y = d->y[q], z = d->z[q];
#if defined(__x86_64__) && defined(__GNUC__)
        if (lanes && fabs(x - t.corner[0]) < far && fabs(y - t.corner[1]) < far && fabs(z - t.corner[2]) < far)
            l->count[i] = cells_scan_lanes(&t, &runs, s, x, y, z, d->r2[q], out);
        else
#endif
        l->count[i] = cells_scan(&runs, s, x, y, z, d->r2[q], out);
        l->begin[i] = out;
        const int n = l->count[i], filled = (n + LANES - 1) / LANES * LANES;
        for (int k = n; k < filled; k++) out[k] = out[n - 1];       /* whoever reads eight at a time reads neighbours */
        w->used += filled;
    }
    return 0;
}

/* Lists of all particles of `d` among `s`; returns 1 where memory is short. */
static int cells_lists(const Cells *c, const Sorted *d, const Sorted *s, int lanes, int threads, Worker *workers,
                       Lists *l) {
    int cells = c->number[0] * c->number[1] * c->number[2], failed = 0, span[3];
    if (d->n > l->room || !l->begin) {
        l->room = d->n + d->n / 4 + 64;
        free(l->begin); free(l->count);
        l->begin = (unsigned int **)malloc(sizeof(void *) * l->room);
        l->count = (int *)malloc(sizeof(int) * l->room);
        if (!l->begin || !l->count) { l->room = 0; return 1; }
    }
    cells_spans(c, d, s, span);
    int parts = 32 * threads < cells ? 32 * threads : cells;
    #pragma omp parallel for schedule(dynamic, 1) reduction(| : failed) num_threads(threads)
    for (int part = 0; part < parts; part++) {
        int begin = (int)((long)cells * part / parts), end = (int)((long)cells * (part + 1) / parts);
        for (int cell = begin; cell < end && !failed; cell++)
            if (d->start[cell] < d->start[cell + 1])
                failed |= cells_lists_of(c, d, s, cell, span, lanes, workers + omp_get_thread_num(), l);
    }
    return failed;
}

/* Candidates of one particle of the array, for who keeps no lists. */
static void cells_runs_of(const Cells *c, const Sorted *d, const Sorted *s, long i, Runs *r) {
    int span[3], k = d->place[i];
    cells_spans(c, d, s, span);
    cells_runs(c, s, cells_of(c, d->x[k], d->y[k], d->z[k]), span, r);
}
#endif

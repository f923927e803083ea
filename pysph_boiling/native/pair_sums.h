/* Sums over the neighbours of one particle, several at a time, in double precision: for GCC and Clang, eight with
 * AVX-512 and four with AVX2.
 *
 * What a sum reads of a neighbour lies together, 32 bytes (x, y, z, w), so that four neighbours are four loads and a
 * transposition. All smoothing lengths are equal: factors that are the same for all pairs stand outside the sums, and
 * distances stay in metres. With t = max(2 h - r, 0) and u = max(h - r, 0), the kernels are
 *     cubic spline         W = w_scale (t^3 + ratio u^3),     (1/r) dW/dr = g_scale (t^2 + ratio u^2)/r
 *     Wendland quintic     W = w_scale (t + ratio) t^4,       (1/r) dW/dr = g_scale t^3
 */
#ifndef PAIR_SUMS_H
#define PAIR_SUMS_H
#include <math.h>
#include <string.h>
#include <immintrin.h>

#define PAIR_INLINE static inline __attribute__((always_inline))
#define COINCIDENT 1e-6                 /* r/h below which two particles are at one place */
#define NEAREST 1e-9                    /* r/h that is added (to r^2, its square), so that nothing is divided by 0 */
#define VAPOUR 3                        /* Phase.VAPOUR */

/* As max and min in PySPH's modules, where a NaN that comes first stays one; fmax and fmin would drop it. */
PAIR_INLINE double larger(double a, double b) { return b > a ? b : a; }
PAIR_INLINE double smaller(double a, double b) { return b < a ? b : a; }

#ifdef __AVX512F__
#define LANES 8
#else
#define LANES 4
#endif
typedef double Four __attribute__((vector_size(32)));
typedef double Lanes __attribute__((vector_size(8*LANES)));
typedef long long LaneMask __attribute__((vector_size(8*LANES)));

typedef struct { double h, ratio, w_scale, g_scale; int wendland, deep; } PairKernel;       /* deep: 3-D */

typedef struct {                        /* neighbours of every particle in one array */
    const unsigned int **begin;
    const int *count;
    const double *records;              /* (n, 4) of that array: x, y, z and what a sum weights it by */
} PairSource;

typedef struct { Lanes x, y, z, w; } LaneRecords;
typedef struct { Lanes dx, dy, dz, r2, r, t, u; } LanePairs;

PAIR_INLINE Lanes lanes(double value) { return value - (Lanes){}; }
PAIR_INLINE Four four_load(const double *from) { Four v; memcpy(&v, from, sizeof v); return v; }
PAIR_INLINE Lanes lanes_load(const double *from) { Lanes v; memcpy(&v, from, sizeof v); return v; }

/* Some numbers of two vectors, by their places. */
#if defined(__clang__) || __GNUC__ >= 12
#define LANES_OF(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
#define LANES_OF(a, b, ...) __builtin_shuffle(a, b, (LaneMask){__VA_ARGS__})
#endif

#if LANES == 8
PAIR_INLINE Lanes lanes_larger(Lanes a, Lanes b) { return _mm512_max_pd(a, b); }
PAIR_INLINE Lanes lanes_root(Lanes v) { return _mm512_sqrt_pd(v); }
PAIR_INLINE double lanes_sum(Lanes v) { return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7])); }

PAIR_INLINE Lanes lanes_two(Four low, Four high) { return _mm512_insertf64x4(_mm512_castpd256_pd512(low), high, 1); }

/* Records of eight neighbours. */
PAIR_INLINE LaneRecords lanes_records(const double *records, const unsigned int *neighbours) {
    Lanes row[4];
    for (int k = 0; k < 4; k++) {       /* 0 and 2, 1 and 3, 4 and 6, 5 and 7 */
        const unsigned int *first = neighbours + (k & 1) + 2*(k & 2);
        row[k] = lanes_two(four_load(records + 4l*first[0]), four_load(records + 4l*first[2]));
    }
    const Lanes low_xz = LANES_OF(row[0], row[1], 0, 8, 2, 10, 4, 12, 6, 14);
    const Lanes low_yw = LANES_OF(row[0], row[1], 1, 9, 3, 11, 5, 13, 7, 15);
    const Lanes high_xz = LANES_OF(row[2], row[3], 0, 8, 2, 10, 4, 12, 6, 14);
    const Lanes high_yw = LANES_OF(row[2], row[3], 1, 9, 3, 11, 5, 13, 7, 15);
    LaneRecords r;
    r.x = LANES_OF(low_xz, high_xz, 0, 1, 4, 5, 8, 9, 12, 13);
    r.y = LANES_OF(low_yw, high_yw, 0, 1, 4, 5, 8, 9, 12, 13);
    r.z = LANES_OF(low_xz, high_xz, 2, 3, 6, 7, 10, 11, 14, 15);
    r.w = LANES_OF(low_yw, high_yw, 2, 3, 6, 7, 10, 11, 14, 15);
    return r;
}
#else
PAIR_INLINE Lanes lanes_larger(Lanes a, Lanes b) { return _mm256_max_pd(a, b); }
PAIR_INLINE Lanes lanes_root(Lanes v) { return _mm256_sqrt_pd(v); }
PAIR_INLINE double lanes_sum(Lanes v) { return (v[0] + v[2]) + (v[1] + v[3]); }

/* Records of four neighbours. */
PAIR_INLINE LaneRecords lanes_records(const double *records, const unsigned int *neighbours) {
    const Lanes a = lanes_load(records + 4l*neighbours[0]), b = lanes_load(records + 4l*neighbours[1]);
    const Lanes c = lanes_load(records + 4l*neighbours[2]), d = lanes_load(records + 4l*neighbours[3]);
    const Lanes ab_xz = LANES_OF(a, b, 0, 4, 2, 6), ab_yw = LANES_OF(a, b, 1, 5, 3, 7);
    const Lanes cd_xz = LANES_OF(c, d, 0, 4, 2, 6), cd_yw = LANES_OF(c, d, 1, 5, 3, 7);
    LaneRecords r;
    r.x = LANES_OF(ab_xz, cd_xz, 0, 1, 4, 5); r.z = LANES_OF(ab_xz, cd_xz, 2, 3, 6, 7);
    r.y = LANES_OF(ab_yw, cd_yw, 0, 1, 4, 5); r.w = LANES_OF(ab_yw, cd_yw, 2, 3, 6, 7);
    return r;
}
#endif

/* Numbers of as many neighbours as there are lanes. */
PAIR_INLINE Lanes lanes_values(const double *values, const unsigned int *neighbours) {
    Lanes v;
    for (int k = 0; k < LANES; k++) v[k] = values[neighbours[k]];
    return v;
}

/* Where the last neighbours of a list of n > 0 begin that are not as many as there are lanes, or just as many. */
PAIR_INLINE int lanes_last(int n) { return (n - 1) & ~(LANES - 1); }

/* Which of the last neighbours of a list of n > 0 count: 1 or 0. Lists are filled up to a multiple of 8. */
PAIR_INLINE Lanes lanes_counted(int n) {
    static const double counted[16] = {1, 1, 1, 1, 1, 1, 1, 1};
    return lanes_load(counted + 8 - (n - lanes_last(n)));
}

PAIR_INLINE LanePairs lanes_pairs(const PairKernel *kernel, Lanes x, Lanes y, Lanes z, LaneRecords at) {
    const double nearest = NEAREST * kernel->h;
    LanePairs p;
    p.dx = x - at.x; p.dy = y - at.y; p.dz = z - at.z;
    p.r2 = p.dx*p.dx + (p.dy*p.dy + (p.dz*p.dz + lanes(nearest * nearest)));
    p.r = lanes_root(p.r2);
    p.t = lanes_larger(lanes(2.0 * kernel->h) - p.r, lanes(0.0));
    p.u = lanes_larger(lanes(kernel->h) - p.r, lanes(0.0));
    return p;
}

/* Records (n, 4) of the columns; w: NULL for 0. */
static void pack_records(long n, const double *x, const double *y, const double *z, const double *w, double *records) {
    #pragma omp parallel for schedule(static)
    for (long i = 0; i < n; i++) {
        records[4*i] = x[i]; records[4*i + 1] = y[i]; records[4*i + 2] = z[i]; records[4*i + 3] = w ? w[i] : 0.0;
    }
}

static void pack_last(long n, const double *w, double *records) {
    #pragma omp parallel for schedule(static)
    for (long i = 0; i < n; i++) records[4*i + 3] = w[i];
}

/* The kernel for a smoothing length h, by the coefficients of boiling_kernel: c3 and c1, or c4 and c5. */
static void pair_kernel(PairKernel *kernel, double h, double c3, double c4, double c5, double c1) {
    const double volume = kernel->deep ? h*h*h : h*h;
    kernel->h = h;
    kernel->wendland = c3 == 0.0;
    if (kernel->wendland) {             /* W h^dim = (c4 + c5 t/h) (t/h)^4, and 4 c4 = -10 c5 */
        kernel->ratio = c4 / c5 * h;
        kernel->w_scale = c5 / (volume * h*h*h*h*h);
        kernel->g_scale = 5.0 * kernel->w_scale;
    } else {
        kernel->ratio = c1 / c3;
        kernel->w_scale = c3 / (volume * h*h*h);
        kernel->g_scale = -3.0 * kernel->w_scale;
    }
}

/* W/w_scale = outer + ratio inner */
PAIR_INLINE Lanes lanes_outer(int wendland, LanePairs p) {
    const Lanes t2 = p.t*p.t;
    return wendland ? t2*t2 * p.t : t2 * p.t;
}

PAIR_INLINE Lanes lanes_inner(int wendland, LanePairs p) {
    const Lanes t2 = p.t*p.t;
    return wendland ? t2*t2 : p.u*p.u * p.u;
}

PAIR_INLINE Lanes lanes_kernel(const PairKernel *kernel, int wendland, LanePairs p) {
    return lanes_outer(wendland, p) + lanes(kernel->ratio)*lanes_inner(wendland, p);
}

/* (dW/dr)/g_scale of the cubic spline, (1/r) (dW/dr)/g_scale of Wendland's kernel */
PAIR_INLINE Lanes lanes_slope(const PairKernel *kernel, int wendland, LanePairs p) {
    const Lanes t2 = p.t*p.t;
    return wendland ? t2*p.t : t2 + lanes(kernel->ratio)*(p.u*p.u);
}

/* weight (1/r) (dW/dr)/g_scale; times x_ij it is the gradient */
PAIR_INLINE Lanes lanes_gradient(const PairKernel *kernel, int wendland, LanePairs p, Lanes weight) {
    const Lanes f = weight * lanes_slope(kernel, wendland, p);
    return wendland ? f : f / p.r;
}

typedef struct { Lanes x, y, z, plus, swell, gx, gy, gz, here; } GradientSums;

PAIR_INLINE void add_gradient(GradientSums *sum, const PairSource *s, const double *swell,
                              const unsigned int *neighbours, Lanes counted, const PairKernel *kernel, int wendland,
                              int swollen) {
    const LaneRecords at = lanes_records(s->records, neighbours);
    const LanePairs p = lanes_pairs(kernel, sum->x, sum->y, sum->z, at);
    const Lanes weight = swollen ? sum->swell*at.w + sum->plus*lanes_values(swell, neighbours) : at.w + sum->plus;
    const Lanes f = lanes_gradient(kernel, wendland, p, weight * counted);
    sum->gx += f*p.dx; sum->gy += f*p.dy; sum->gz += f*p.dz;
    sum->here += p.r < lanes(COINCIDENT * kernel->h) ? counted : lanes(0.0);
}

/* out: sums of (plus + w) f (dx, dy, dz), or if ``swollen`` of (swell_j plus + swell_i w) f (dx, dy, dz); how many
 * neighbours are at the same place, itself among them. */
PAIR_INLINE void sum_gradient(const PairSource *s, long i, const PairKernel *kernel, int wendland, int swollen,
                              const double *swell, double plus, double x, double y, double z, double *out) {
    const unsigned int *neighbours = s->begin[i];
    const int n = s->count[i], last = lanes_last(n);
    const Lanes none = lanes(0.0);
    GradientSums sum = {lanes(x), lanes(y), lanes(z), lanes(plus), lanes(swollen ? swell[i] : 1.0), none, none, none,
                        none};
    for (int k = 0; k < last; k += LANES)
        add_gradient(&sum, s, swell, neighbours + k, lanes(1.0), kernel, wendland, swollen);
    if (n > 0) add_gradient(&sum, s, swell, neighbours + last, lanes_counted(n), kernel, wendland, swollen);
    out[0] = lanes_sum(sum.gx); out[1] = lanes_sum(sum.gy); out[2] = lanes_sum(sum.gz); out[3] = lanes_sum(sum.here);
}
#endif

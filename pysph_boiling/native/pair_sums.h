/* Sums over the neighbours of one particle, four at a time, in double precision: for GCC and Clang, with AVX2.
 *
 * What a sum reads of a neighbour lies together, 32 bytes (x, y, z, w), so that four neighbours are four loads and a
 * transposition. All smoothing lengths are equal: what is the same for all pairs stands outside the sums.
 *
 * With q = r/h, t = max(2 - q, 0) and u = max(1 - q, 0), the kernels are, but for h^-dim,
 *     cubic spline         W = c3 t^3 + c1 u^3,           (1/q) dW/dq = -3 (c3 t^2 + c1 u^2)/q
 *     Wendland quintic     W = (c4 + c5 t) t^4,           (1/q) dW/dq = 5 c5 t^3, since 4 c4 + 5 c5 t = -5 c5 q
 */
#ifndef PAIR_SUMS_H
#define PAIR_SUMS_H
#include <math.h>
#include <string.h>
#include <immintrin.h>

#define PAIR_INLINE static inline __attribute__((always_inline))
#define COINCIDENT 1e-6                 /* q below which two particles are at one place */
#define VAPOUR 3                        /* Phase.VAPOUR */

/* As max and min in PySPH's modules, where a NaN that comes first stays one; fmax and fmin would drop it. */
PAIR_INLINE double larger(double a, double b) { return b > a ? b : a; }
PAIR_INLINE double smaller(double a, double b) { return b < a ? b : a; }

typedef double Four __attribute__((vector_size(32)));
typedef long long FourMask __attribute__((vector_size(32)));

typedef struct { double h1, c3, c4, c5, c1; int wendland, deep; } PairKernel;   /* h1 = 1/h; deep: 3-D */

typedef struct {                        /* neighbours of every particle in one array */
    const unsigned int **begin;
    const int *count;
    const double *records;              /* (n, 4) of that array: x, y, z and what a sum weights it by */
} PairSource;

typedef struct { Four x, y, z, w; } FourRecords;
typedef struct { Four dx, dy, dz, r2, q, t, u; } FourPairs;

PAIR_INLINE Four four(double value) { Four v = {value, value, value, value}; return v; }
PAIR_INLINE double four_sum(Four v) { return (v[0] + v[2]) + (v[1] + v[3]); }
PAIR_INLINE Four four_larger(Four a, Four b) { return _mm256_max_pd(a, b); }

PAIR_INLINE Four four_root(Four v) {
    Four r;
    for (int k = 0; k < 4; k++) r[k] = sqrt(v[k]);
    return r;
}

/* Four of the eight numbers of two vectors, by their places. */
#if defined(__clang__) || __GNUC__ >= 12
#define FOUR_OF(a, b, i, j, k, l) __builtin_shufflevector(a, b, i, j, k, l)
#else
#define FOUR_OF(a, b, i, j, k, l) __builtin_shuffle(a, b, (FourMask){i, j, k, l})
#endif

PAIR_INLINE Four four_load(const double *from) { Four v; memcpy(&v, from, sizeof v); return v; }

/* Records of four neighbours. */
PAIR_INLINE FourRecords four_records(const double *records, const unsigned int *neighbours) {
    const Four a = four_load(records + 4l*neighbours[0]), b = four_load(records + 4l*neighbours[1]);
    const Four c = four_load(records + 4l*neighbours[2]), d = four_load(records + 4l*neighbours[3]);
    const Four ab_xz = FOUR_OF(a, b, 0, 4, 2, 6), ab_yw = FOUR_OF(a, b, 1, 5, 3, 7);
    const Four cd_xz = FOUR_OF(c, d, 0, 4, 2, 6), cd_yw = FOUR_OF(c, d, 1, 5, 3, 7);
    FourRecords r;
    r.x = FOUR_OF(ab_xz, cd_xz, 0, 1, 4, 5); r.z = FOUR_OF(ab_xz, cd_xz, 2, 3, 6, 7);
    r.y = FOUR_OF(ab_yw, cd_yw, 0, 1, 4, 5); r.w = FOUR_OF(ab_yw, cd_yw, 2, 3, 6, 7);
    return r;
}

/* Numbers of four neighbours. */
PAIR_INLINE Four four_values(const double *values, const unsigned int *neighbours) {
    Four v = {values[neighbours[0]], values[neighbours[1]], values[neighbours[2]], values[neighbours[3]]};
    return v;
}

/* Which of the last four of a list of n > 0 neighbours count: 1 or 0. Lists are filled up to a multiple of 4. */
PAIR_INLINE Four four_counted(int n) {
    static const double counted[4][4] = {{1, 1, 1, 1}, {1, 0, 0, 0}, {1, 1, 0, 0}, {1, 1, 1, 0}};
    return four_load(counted[n % 4]);
}

PAIR_INLINE FourPairs four_pairs(const PairKernel *kernel, Four x, Four y, Four z, FourRecords at) {
    FourPairs p;
    p.dx = x - at.x; p.dy = y - at.y; p.dz = z - at.z;
    p.r2 = p.dx*p.dx + (p.dy*p.dy + p.dz*p.dz);
    p.q = four_root(p.r2) * four(kernel->h1);
    p.t = four_larger(four(2.0) - p.q, four(0.0));
    p.u = four_larger(four(1.0) - p.q, four(0.0));
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

/* h^-dim */
PAIR_INLINE double pair_scale(const PairKernel *kernel) {
    return kernel->deep ? kernel->h1*kernel->h1*kernel->h1 : kernel->h1*kernel->h1;
}

/* W h^dim */
PAIR_INLINE Four four_kernel(const PairKernel *kernel, int wendland, FourPairs p) {
    const Four t2 = p.t*p.t;
    if (wendland) return t2*t2 * (four(kernel->c5)*p.t + four(kernel->c4));
    return four(kernel->c3)*t2*p.t + four(kernel->c1)*(p.u*p.u)*p.u;
}

/* dW/dq h^dim of the cubic spline; (1/q) dW/dq h^dim of Wendland's kernel */
PAIR_INLINE Four four_slope(const PairKernel *kernel, int wendland, FourPairs p) {
    const Four t2 = p.t*p.t;
    if (wendland) return four(5.0*kernel->c5) * (t2*p.t);
    return four(-3.0*kernel->c3)*t2 + four(-3.0*kernel->c1)*(p.u*p.u);
}

/* weight (1/q) dW/dq h^dim; times x_ij/h^2 it is the gradient */
PAIR_INLINE Four four_gradient(const PairKernel *kernel, int wendland, FourPairs p, Four weight) {
    const Four f = weight * four_slope(kernel, wendland, p);
    return wendland ? f : f / four_larger(p.q, four(1e-9));
}
#endif

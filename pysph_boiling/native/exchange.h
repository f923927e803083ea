/* What neighbours in the fluid exchange: HeatConductionClearyMonaghan, and PBFXSPHViscosity with BubbleDrag in one sum,
 * where all masses and all smoothing lengths are equal. Formulas, sources and limits stand there.
 */
#ifndef EXCHANGE_H
#define EXCHANGE_H
#include "pair_sums.h"

typedef struct { Four x, y, z, T, k, flow; } HeatSum;

PAIR_INLINE void add_heat(HeatSum *sum, const PairSource *s, const double *T, const unsigned int *neighbours,
                          Four counted, const PairKernel *kernel, int wendland, Four near) {
    const FourRecords at = four_records(s->records, neighbours);
    const FourPairs p = four_pairs(kernel, sum->x, sum->y, sum->z, at);
    const Four weight = at.w * (sum->T - four_values(T, neighbours)) * p.r2 * counted;
    const Four over = (sum->k + at.w) * (p.r2 + near), f = weight * four_slope(kernel, wendland, p);
    sum->flow += wendland ? f / over : f / (over * four_larger(p.q, four(1e-9)));
}

/* What particle i is given. */
PAIR_INLINE double heat_of(long i, const PairKernel *kernel, int wendland, const PairSource *s, const double *T) {
    const double *own = s->records + 4*i;
    const unsigned int *neighbours = s->begin[i];
    const int n = s->count[i], last = (n - 1) & ~3;
    const Four near = four(0.01 / (kernel->h1*kernel->h1));
    HeatSum sum = {four(own[0]), four(own[1]), four(own[2]), four(T[i]), four(own[3]), four(0.0)};
    for (int k = 0; k < last; k += 4) add_heat(&sum, s, T, neighbours + k, four(1.0), kernel, wendland, near);
    if (n > 0) add_heat(&sum, s, T, neighbours + last, four_counted(n), kernel, wendland, near);
    return own[3] * four_sum(sum.flow);
}

/* Adds factor k_i sum_j k_j/(k_i + k_j) (T_i - T_j) x_ij.gradW h^(dim + 2)/(r^2 + .01 h^2) to ae; a record's w is k. */
static void exchange_heat(const PairKernel *kernel, const PairSource *s, long n, const double *T, double factor,
                          double *ae) {
    #pragma omp parallel for schedule(static)
    for (long i = 0; i < n; i++)
        ae[i] += factor * (kernel->wendland ? heat_of(i, kernel, 1, s, T) : heat_of(i, kernel, 0, s, T));
}

typedef struct { Four x, y, z, u, v, w, vapour, ax, ay, az; } MomentumSum;

PAIR_INLINE void add_momentum(MomentumSum *sum, const PairSource *s, const double *velocities,
                              const unsigned int *neighbours, Four counted, const PairKernel *kernel, int wendland,
                              Four viscosity, Four drag) {
    const FourRecords at = four_records(s->records, neighbours), moves = four_records(velocities, neighbours);
    const FourPairs p = four_pairs(kernel, sum->x, sum->y, sum->z, at);
    const Four other = at.w - sum->vapour;          /* 1, 0 or -1 */
    const Four f = four_kernel(kernel, wendland, p) * (viscosity + drag*(other*other)) * counted;
    sum->ax += f*(sum->u - moves.x); sum->ay += f*(sum->v - moves.y); sum->az += f*(sum->w - moves.z);
}

/* What particle i loses to its neighbours: out (3). */
PAIR_INLINE void momentum_of(long i, const PairKernel *kernel, int wendland, const PairSource *s,
                             const double *velocities, double viscosity, double drag, double *out) {
    const double *own = s->records + 4*i, *moves = velocities + 4*i;
    const unsigned int *neighbours = s->begin[i];
    const int n = s->count[i], last = (n - 1) & ~3;
    const Four none = four(0.0), all = four(viscosity), between = four(drag);
    MomentumSum sum = {four(own[0]), four(own[1]), four(own[2]), four(moves[0]), four(moves[1]), four(moves[2]),
                       four(own[3]), none, none, none};
    for (int k = 0; k < last; k += 4)
        add_momentum(&sum, s, velocities, neighbours + k, four(1.0), kernel, wendland, all, between);
    if (n > 0) add_momentum(&sum, s, velocities, neighbours + last, four_counted(n), kernel, wendland, all, between);
    out[0] = four_sum(sum.ax); out[1] = four_sum(sum.ay); out[2] = four_sum(sum.az);
}

/* Accelerations: gravity less sum_j (viscosity + drag, where one is vapour) W h^dim (v_i - v_j); a record's w is 1 in
 * vapour, else 0. */
static void exchange_momentum(const PairKernel *kernel, const PairSource *s, const double *velocities, long n,
                              double viscosity, double drag, const double *gravity, double *au, double *av,
                              double *aw) {
    #pragma omp parallel for schedule(static)
    for (long i = 0; i < n; i++) {
        double lost[3];
        if (kernel->wendland) momentum_of(i, kernel, 1, s, velocities, viscosity, drag, lost);
        else momentum_of(i, kernel, 0, s, velocities, viscosity, drag, lost);
        au[i] = gravity[0] - lost[0]; av[i] = gravity[1] - lost[1]; aw[i] = gravity[2] - lost[2];
    }
}
#endif

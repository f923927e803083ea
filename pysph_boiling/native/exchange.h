/* What neighbours in the fluid exchange: HeatConductionClearyMonaghan, and PBFXSPHViscosity with BubbleDrag,
 * PBFWarmStart or PBFWarmStartSwollen and PBFArtificialPressure in one sum, with PBFBoundaryWarmStart near walls, where
 * all masses of the fluid and all smoothing lengths are equal. Formulas, sources and limits stand there.
 */
#ifndef EXCHANGE_H
#define EXCHANGE_H
#include "pair_sums.h"

typedef struct { Lanes x, y, z, T, k, flow; } HeatSum;

PAIR_INLINE void add_heat(HeatSum *sum, const PairSource *s, const double *T, const unsigned int *neighbours,
                          Lanes counted, const PairKernel *kernel, int wendland, Lanes near) {
    const LaneRecords at = lanes_records(s->records, neighbours);
    const LanePairs p = lanes_pairs(kernel, sum->x, sum->y, sum->z, at);
    const Lanes weight = at.w * (sum->T - lanes_values(T, neighbours)) * counted;
    const Lanes over = (sum->k + at.w) * (p.r2 + near), f = weight * lanes_slope(kernel, wendland, p);
    sum->flow += f * (wendland ? p.r2 : p.r) / over;
}

/* What particle i is given. */
PAIR_INLINE double heat_of(long i, const PairKernel *kernel, int wendland, const PairSource *s, const double *T) {
    const double *own = s->records + 4*i;
    const unsigned int *neighbours = s->begin[i];
    const int n = s->count[i], last = lanes_last(n);
    const Lanes near = lanes(0.01 * kernel->h*kernel->h);
    HeatSum sum = {lanes(own[0]), lanes(own[1]), lanes(own[2]), lanes(T[i]), lanes(own[3]), lanes(0.0)};
    for (int k = 0; k < last; k += LANES) add_heat(&sum, s, T, neighbours + k, lanes(1.0), kernel, wendland, near);
    if (n > 0) add_heat(&sum, s, T, neighbours + last, lanes_counted(n), kernel, wendland, near);
    return own[3] * lanes_sum(sum.flow);
}

/* Adds factor k_i sum_j k_j/(k_i + k_j) (T_i - T_j) x_ij.gradW/g_scale/(r^2 + .01 h^2) to ae; a record's w is k. */
static void exchange_heat(const PairKernel *kernel, const PairSource *s, long n, const double *T, double factor,
                          double *ae) {
    #pragma omp parallel for schedule(static)
    for (long i = 0; i < n; i++)
        ae[i] += factor * (kernel->wendland ? heat_of(i, kernel, 1, s, T) : heat_of(i, kernel, 0, s, T));
}

typedef struct {
    double viscosity, drag, repulsion, per_unit;
    double start;                       /* 1/rho_rest; 0 without a warm start */
    double m;
    const double *swell;                /* NULL: 1 everywhere, or no warm start */
} Forces;

typedef struct { Lanes x, y, z, u, v, w, vapour, lmbda, swell, ax, ay, az; } MomentumSum;

PAIR_INLINE void add_momentum(MomentumSum *sum, const PairSource *s, const double *velocities,
                              const unsigned int *neighbours, Lanes counted, const PairKernel *kernel, int wendland,
                              int pushes, int swollen, const Forces *forces) {
    const LaneRecords at = lanes_records(s->records, neighbours), moves = lanes_records(velocities, neighbours);
    const LanePairs p = lanes_pairs(kernel, sum->x, sum->y, sum->z, at);
    const Lanes other = at.w - sum->vapour;          /* 1, 0 or -1 */
    const Lanes W = lanes_kernel(kernel, wendland, p);
    const Lanes f = W * (lanes(forces->viscosity) + lanes(forces->drag)*(other*other)) * counted;
    sum->ax += f*(sum->u - moves.x); sum->ay += f*(sum->v - moves.y); sum->az += f*(sum->w - moves.z);
    if (pushes) {                       /* lmbda is 0 without a warm start */
        const Lanes w = lanes(forces->per_unit) * W, w2 = w*w;
        const Lanes start = swollen ? sum->lmbda*lanes_values(forces->swell, neighbours) + sum->swell*moves.w
                                    : sum->lmbda + moves.w;
        const Lanes push = lanes(forces->repulsion)*(w2*w2) - lanes(forces->start)*start;
        const Lanes g = lanes_gradient(kernel, wendland, p, push * counted);
        sum->ax += g*p.dx; sum->ay += g*p.dy; sum->az += g*p.dz;
    }
}

/* What particle i loses to its neighbours: out (3). */
PAIR_INLINE void momentum_of(long i, const PairKernel *kernel, int wendland, int pushes, int swollen,
                             const PairSource *s, const PairSource *walls, int n_walls, const double *velocities,
                             const Forces *forces, double *out) {
    const double *own = s->records + 4*i, *moves = velocities + 4*i;
    const unsigned int *neighbours = s->begin[i];
    const int n = s->count[i], last = lanes_last(n);
    const Lanes none = lanes(0.0);
    MomentumSum sum = {lanes(own[0]), lanes(own[1]), lanes(own[2]), lanes(moves[0]), lanes(moves[1]), lanes(moves[2]),
                       lanes(own[3]), lanes(moves[3]), lanes(swollen ? forces->swell[i] : 1.0), none, none, none};
    for (int k = 0; k < last; k += LANES)
        add_momentum(&sum, s, velocities, neighbours + k, lanes(1.0), kernel, wendland, pushes, swollen, forces);
    if (n > 0)
        add_momentum(&sum, s, velocities, neighbours + last, lanes_counted(n), kernel, wendland, pushes, swollen,
                     forces);
    out[0] = lanes_sum(sum.ax); out[1] = lanes_sum(sum.ay); out[2] = lanes_sum(sum.az);
    if (pushes && moves[3] != 0.0)
        for (int k = 0; k < n_walls; k++)
            if (walls[k].count[i] > 0) {
                const double f = forces->start * moves[3] / forces->m;
                double near[4];
                sum_gradient(&walls[k], i, kernel, wendland, 0, NULL, 0.0, own[0], own[1], own[2], near);
                out[0] -= f * near[0]; out[1] -= f * near[1]; out[2] -= f * near[2];
            }
}

/* Accelerations: gravity less sum_j (viscosity + drag, where one is vapour) W/w_scale (v_i - v_j), less sum_j
 * (repulsion (per_unit W/w_scale)^4 - start (swell_j lmbda_i + swell_i lmbda_j)) gradW/g_scale, and with start
 * lmbda_i/m sum_b psi_b gradW/g_scale. A record's w is 1 in vapour, else 0; the fourth of the velocities is lmbda; that
 * of a wall is psi_b.
 */
static void exchange_momentum(const PairKernel *kernel, const PairSource *s, const PairSource *walls, int n_walls,
                              const double *velocities, long n, const Forces *forces, const double *gravity,
                              double *au, double *av, double *aw) {
    const int pushes = forces->repulsion != 0.0 || forces->start != 0.0;
    #pragma omp parallel for schedule(static)
    for (long i = 0; i < n; i++) {
        double lost[3];
        if (forces->swell) {
            if (kernel->wendland) momentum_of(i, kernel, 1, 1, 1, s, walls, n_walls, velocities, forces, lost);
            else momentum_of(i, kernel, 0, 1, 1, s, walls, n_walls, velocities, forces, lost);
        } else if (pushes) {
            if (kernel->wendland) momentum_of(i, kernel, 1, 1, 0, s, walls, n_walls, velocities, forces, lost);
            else momentum_of(i, kernel, 0, 1, 0, s, walls, n_walls, velocities, forces, lost);
        } else {
            if (kernel->wendland) momentum_of(i, kernel, 1, 0, 0, s, walls, n_walls, velocities, forces, lost);
            else momentum_of(i, kernel, 0, 0, 0, s, walls, n_walls, velocities, forces, lost);
        }
        au[i] = gravity[0] - lost[0]; av[i] = gravity[1] - lost[1]; aw[i] = gravity[2] - lost[2];
    }
}
#endif

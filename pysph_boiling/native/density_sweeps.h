/* The density sweeps in two loops over the particles: what PBFDensity, PBFBoundaryDensity, PBFLambda and, in the second
 * one, PBFPositionCorrection, PBFBoundaryCorrection, PBFMove or PBFMoveAccelerated, BubbleCohesion and the containers
 * compute, also for swollen particles (PBFDensitySwollen, PBFPositionCorrectionSwollen), where all masses of the fluid
 * and all smoothing lengths are equal. Between the two, PBFWallMultiplier, for PBFWallCorrection in the second one.
 * Formulas, sources and limits stand there.
 *
 * Sums over all particles are made block by block, in one order whatever the threads.
 */
#ifndef DENSITY_SWEEPS_H
#define DENSITY_SWEEPS_H
#include "pair_sums.h"

#define SWEEP_BLOCK 256                 /* particles whose sums are added up first */

enum { NO_CONTAINER, BOX, CYLINDER, ROOM };

typedef struct {
    PairKernel kernel;
    int container;
    double m, rho_rest, eps, omega, max_displacement, nudge;
    double depth, low[3], high[3];      /* box; of a cylinder low[2] and high[2] are its ends */
    double centre[2], radius;
    long ny, nz;                        /* of a room: nodes of its grid, their last places, and its first node */
    double end[3], origin[3], per, inset;   /* per: nodes per length */
    double strength, reach, stiffness, dt;      /* of cohesion */
} SweepModel;

typedef struct {                        /* of the fluid */
    long n;
    double *x, *y, *z, *sx, *sy, *sz, *qx, *qy, *qz;    /* qx to qz: NULL for plain sweeps */
    double *q_lmbda;                                    /* NULL for plain sweeps */
    double *rho, *lmbda, *impulse, *compression, *left_over;
    int *limited, *contacts, *projected;                /* the last two: NULL without a container */
    const double *room;                                 /* signed distances of a container of the kind ROOM */
    const double *swell;                                /* NULL: 1 everywhere */
    const unsigned int *uid;
    const int *phase;                                   /* NULL without cohesion */
    const double *pull_start_x, *pull_start_y, *pull_start_z;
    double *pulled_x, *pulled_y, *pulled_z;
} SweepFluid;

typedef struct { Lanes x, y, z, outer, inner, gx, gy, gz, gg; } DensitySums;

PAIR_INLINE void add_density(DensitySums *sum, const PairSource *s, const unsigned int *neighbours, Lanes counted,
                             const PairKernel *kernel, int wendland, int weighted) {
    const LaneRecords at = lanes_records(s->records, neighbours);
    const LanePairs p = lanes_pairs(kernel, sum->x, sum->y, sum->z, at);
    const Lanes weight = weighted ? at.w*counted : counted, slope = weight * lanes_slope(kernel, wendland, p);
    const Lanes f = wendland ? slope : slope / p.r;
    sum->outer += weight*lanes_outer(wendland, p); sum->inner += weight*lanes_inner(wendland, p);
    sum->gx += f*p.dx; sum->gy += f*p.dy; sum->gz += f*p.dz;
    sum->gg += wendland ? f*f * p.r2 : slope*slope;
}

/* out: sums of W/w_scale, of f (dx, dy, dz) and of f^2 r^2, f = (1/r) (dW/dr)/g_scale; if ``weighted``, W and f times
 * a record's w. */
PAIR_INLINE void sum_density(const PairSource *s, long i, const PairKernel *kernel, int wendland, int weighted,
                             double x, double y, double z, double *out) {
    const unsigned int *neighbours = s->begin[i];
    const int n = s->count[i], last = lanes_last(n);
    const Lanes none = lanes(0.0);
    DensitySums sum = {lanes(x), lanes(y), lanes(z), none, none, none, none, none, none};
    for (int k = 0; k < last; k += LANES) add_density(&sum, s, neighbours + k, lanes(1.0), kernel, wendland, weighted);
    if (n > 0) add_density(&sum, s, neighbours + last, lanes_counted(n), kernel, wendland, weighted);
    out[0] = lanes_sum(sum.outer) + kernel->ratio * lanes_sum(sum.inner);
    out[1] = lanes_sum(sum.gx); out[2] = lanes_sum(sum.gy); out[3] = lanes_sum(sum.gz);
    out[4] = lanes_sum(sum.gg);
}

PAIR_INLINE long sweep_blocks(long n) { return (n + SWEEP_BLOCK - 1) / SWEEP_BLOCK; }

PAIR_INLINE long sweep_end(long b, long n) { return (b + 1) * SWEEP_BLOCK < n ? (b + 1) * SWEEP_BLOCK : n; }

/* Particles of block b: density and multipliers; their sums of errors to ``partial``. */
PAIR_INLINE void multipliers_of(long b, const SweepModel *p, int wendland, int swollen, const SweepFluid *fluid,
                                const PairSource *own, const PairSource *walls, int n_walls, double forgiven,
                                double *partial) {
    const PairKernel kernel = p->kernel;
    const double scale = kernel.w_scale, slope = kernel.g_scale / p->rho_rest;
    double all = 0.0, left = 0.0, worst = 0.0, out[5];
    for (long i = b * SWEEP_BLOCK; i < sweep_end(b, fluid->n); i++) {
        const double x = own->records[4*i], y = own->records[4*i + 1], z = own->records[4*i + 2], f = p->m * slope;
        sum_density(own, i, &kernel, wendland, swollen, x, y, z, out);
        double rho = p->m * scale * out[0], gx = f * out[1], gy = f * out[2], gz = f * out[3];
        const double others = f*f * out[4] / p->m;
        for (int k = 0; k < n_walls; k++)
            if (walls[k].count[i] > 0) {
                sum_density(&walls[k], i, &kernel, wendland, 1, x, y, z, out);
                rho += scale * out[0]; gx += slope * out[1]; gy += slope * out[2]; gz += slope * out[3];
            }
        const double error = larger(rho / p->rho_rest - 1.0, 0.0), own_part = (gx*gx + gy*gy + gz*gz) / p->m;
        const double wanted = error - forgiven * fluid->left_over[i];
        fluid->rho[i] = rho;
        fluid->compression[i] = error;
        fluid->lmbda[i] = wanted > 0.0 ? -wanted / (own_part + others + p->eps) : 0.0;
        all += error; left += larger(wanted, 0.0); worst = larger(worst, error);
    }
    partial[3*b] = all; partial[3*b + 1] = left; partial[3*b + 2] = worst;
}

/* Density and multipliers; found: sum of the errors, sum of those that are to be worked off, largest error. A record's
 * w is the swell. */
static void sweep_multipliers(const SweepModel *p, const SweepFluid *fluid, const PairSource *own,
                              const PairSource *walls, int n_walls, double forgiven, double *partial, double *found) {
    const long blocks = sweep_blocks(fluid->n);
    #pragma omp parallel for schedule(static)
    for (long b = 0; b < blocks; b++)
        if (fluid->swell) {
            if (p->kernel.wendland) multipliers_of(b, p, 1, 1, fluid, own, walls, n_walls, forgiven, partial);
            else multipliers_of(b, p, 0, 1, fluid, own, walls, n_walls, forgiven, partial);
        } else {
            if (p->kernel.wendland) multipliers_of(b, p, 1, 0, fluid, own, walls, n_walls, forgiven, partial);
            else multipliers_of(b, p, 0, 0, fluid, own, walls, n_walls, forgiven, partial);
        }
    found[0] = found[1] = found[2] = 0.0;
    for (long b = 0; b < blocks; b++) {
        found[0] += partial[3*b]; found[1] += partial[3*b + 1]; found[2] = larger(found[2], partial[3*b + 2]);
    }
}

typedef struct { Lanes x, y, z, lmbda, all; } MeanSums;

PAIR_INLINE void add_mean(MeanSums *sum, const PairSource *s, const unsigned int *neighbours, Lanes counted,
                          const PairKernel *kernel, int wendland) {
    const LaneRecords at = lanes_records(s->records, neighbours);
    const Lanes W = lanes_kernel(kernel, wendland, lanes_pairs(kernel, sum->x, sum->y, sum->z, at)) * counted;
    sum->lmbda += W*at.w; sum->all += W;
}

/* The mean multiplier of the fluid near particle i of a wall, whose record is ``here``; a record's w is lmbda. */
PAIR_INLINE double mean_multiplier(long i, const PairKernel *kernel, int wendland, const PairSource *fluid,
                                   const double *here) {
    const unsigned int *neighbours = fluid->begin[i];
    const int n = fluid->count[i], last = lanes_last(n);
    MeanSums sum = {lanes(here[0]), lanes(here[1]), lanes(here[2]), lanes(0.0), lanes(0.0)};
    if (n == 0) return 0.0;
    for (int k = 0; k < last; k += LANES) add_mean(&sum, fluid, neighbours + k, lanes(1.0), kernel, wendland);
    add_mean(&sum, fluid, neighbours + last, lanes_counted(n), kernel, wendland);
    const double all = lanes_sum(sum.all);
    return all != 0.0 ? lanes_sum(sum.lmbda) / all : 0.0;     /* Wendland's w_scale is negative, and so are its sums */
}

/* Multipliers per mass of the n particles of a wall with these records, from their neighbours in the ``fluid``. */
static void sweep_walls(const SweepModel *p, const PairSource *fluid, const double *records, long n, double *lmbda) {
    const PairKernel kernel = p->kernel;
    #pragma omp parallel for schedule(static)
    for (long i = 0; i < n; i++)
        lmbda[i] = (kernel.wendland ? mean_multiplier(i, &kernel, 1, fluid, records + 4*i)
                                    : mean_multiplier(i, &kernel, 0, fluid, records + 4*i)) / p->m;
}

static double sweep_uniform(unsigned int u, unsigned int v) {   /* boiling_uniform */
    unsigned int h = u + v*40503u;
    h ^= h >> 16; h *= 569420461u; h ^= h >> 15; h *= 1935289751u; h ^= h >> 15;
    return h * 4.656612873077393e-10 - 1.0;
}

/* Another particle lies at the place of particle i: a displacement along a direction hashed from their uids. */
static void set_apart(const SweepModel *p, const SweepFluid *fluid, const PairSource *own, long i, double nudge,
                      double *d) {
    for (int k = 0; k < own->count[i]; k++) {
        const unsigned int j = own->begin[i][k];
        unsigned int low = fluid->uid[i], high = fluid->uid[j];
        const double x = own->records[4*i] - own->records[4l*j], y = own->records[4*i + 1] - own->records[4l*j + 1],
                     z = own->records[4*i + 2] - own->records[4l*j + 2];
        if (low == high || sqrt(x*x + y*y + z*z) >= COINCIDENT * p->kernel.h) continue;
        double f = nudge;
        if (low > high) { unsigned int swap = low; low = high; high = swap; f = -f; }
        d[0] += f * sweep_uniform(low, high);
        d[1] += f * sweep_uniform(high, low);
        d[2] += p->kernel.deep ? f * sweep_uniform(low, high + 1013u) : 0.0;
    }
}

/* The displacement d that takes particle i into the room, as PBFDistanceContainer computes it. */
static void into_room(const SweepModel *p, const SweepFluid *fluid, long i, double *d) {
    const double at[3] = {fluid->x[i], fluid->y[i], fluid->z[i]};
    const long ny = p->ny, nz = p->nz;
    d[0] = d[1] = d[2] = 0.0;
    for (int turn = 0; turn < 4; turn++) {
        double f[3];
        long cell[3];
        for (int axis = 0; axis < 3; axis++) {
            f[axis] = smaller(larger((at[axis] + d[axis] - p->origin[axis]) * p->per, 0.0), p->end[axis]);
            cell[axis] = (long)f[axis];
            f[axis] -= cell[axis];
        }
        const double *a = fluid->room + (cell[0]*ny + cell[1])*nz + cell[2], *b = a + ny*nz;
        const double x00 = b[0] - a[0], x01 = b[1] - a[1], x10 = b[nz] - a[nz], x11 = b[nz + 1] - a[nz + 1];
        const double y00 = a[0] + x00*f[0], y01 = a[1] + x01*f[0];
        const double y10 = a[nz] + x10*f[0] - y00, y11 = a[nz + 1] + x11*f[0] - y01;
        const double z0 = y00 + y10*f[1], z1 = y01 + y11*f[1] - z0, missing = p->inset - z0 - z1*f[2];
        if (!(missing > 0.0)) return;
        const double gx = ((x00 + (x10 - x00)*f[1])*(1.0 - f[2]) + (x01 + (x11 - x01)*f[1])*f[2]) * p->per;
        const double gy = (y10*(1.0 - f[2]) + y11*f[2]) * p->per, gz = z1 * p->per;
        const double size = missing / larger(gx*gx + gy*gy + gz*gz, 0.25);
        d[0] += size*gx; d[1] += size*gy; d[2] += size*gz;
    }
}

static void contain(const SweepModel *p, const SweepFluid *fluid, long i, double feels) {
    double x = fluid->x[i], y = fluid->y[i], z = fluid->z[i];
    if (p->container == BOX) {
        x = smaller(larger(x, p->low[0]), p->high[0]);
        y = smaller(larger(y, p->low[1]), p->high[1]);
        z = smaller(larger(z, p->low[2]), p->high[2]);
    } else if (p->container == ROOM) {
        double d[3];
        into_room(p, fluid, i, d);
        x += d[0]; y += d[1]; z += d[2];
    } else {
        const double rx = x - p->centre[0], ry = p->kernel.deep ? y - p->centre[1] : 0.0, r = sqrt(rx*rx + ry*ry);
        if (r > p->radius) {
            x = p->centre[0] + rx * p->radius / r;
            if (p->kernel.deep) y = p->centre[1] + ry * p->radius / r;
        }
        if (p->kernel.deep) z = smaller(larger(z, p->low[2]), p->high[2]);
        else y = smaller(larger(y, p->low[2]), p->high[2]);
    }
    const double dx = x - fluid->x[i], dy = y - fluid->y[i], dz = z - fluid->z[i], moved = sqrt(dx*dx + dy*dy + dz*dz);
    if (moved > 0.0) {
        fluid->sx[i] += feels * dx; fluid->sy[i] += feels * dy; fluid->sz[i] += feels * dz;
        fluid->x[i] = x; fluid->y[i] = y; fluid->z[i] = z;
        if (moved > p->depth) fluid->projected[i] += 1;
        else fluid->contacts[i] += 1;
    }
}

/* Moves the vapour particle i by cohesion, from the place where the records have it and its neighbours. */
static void pull(const SweepModel *p, const SweepFluid *fluid, const PairSource *own, long i, double feels) {
    const double *here = own->records + 4*i, dt2 = p->dt*p->dt;
    double ax = 0.0, ay = 0.0, az = 0.0;
    for (int k = 0; k < own->count[i]; k++) {
        const unsigned int j = own->begin[i][k];
        if (fluid->phase[j] != VAPOUR) continue;
        const double *there = own->records + 4l*j, dx = here[0] - there[0], dy = here[1] - there[1],
                     dz = here[2] - there[2], r = sqrt(dx*dx + dy*dy + dz*dz), q = r / p->reach;
        if (q >= 1.0) continue;
        double f = 64.0 * (1.0 - q)*(1.0 - q)*(1.0 - q) * q*q*q;
        f = (q <= 0.5 ? 2.0*f - 1.0 : f) * p->strength / larger(r, 1e-6 * p->reach);
        ax -= f*dx; ay -= f*dy; az -= f*dz;
    }
    double f = feels / (1.0 + p->stiffness * p->strength * dt2);
    double px = f * (dt2*(ax - fluid->pull_start_x[i]) - fluid->pulled_x[i]);
    double py = f * (dt2*(ay - fluid->pull_start_y[i]) - fluid->pulled_y[i]);
    double pz = f * (dt2*(az - fluid->pull_start_z[i]) - fluid->pulled_z[i]);
    const double size = sqrt(px*px + py*py + pz*pz);
    if (size > p->max_displacement) {
        f = p->max_displacement / size;
        px *= f; py *= f; pz *= f;
        fluid->limited[i] += 1;
    }
    fluid->pulled_x[i] += px; fluid->pulled_y[i] += py; fluid->pulled_z[i] += pz;
    fluid->x[i] += px; fluid->y[i] += py; fluid->z[i] += pz;
    fluid->sx[i] += px; fluid->sy[i] += py; fluid->sz[i] += pz;
}

/* Particles of block b: their corrections, applied. */
PAIR_INLINE void move_of(long b, const SweepModel *p, int wendland, int swollen, const SweepFluid *fluid,
                         const PairSource *own, const PairSource *walls, const PairSource *pushes, int n_walls,
                         double nudge, double feels, double weight) {
    const PairKernel kernel = p->kernel;
    const double slope = kernel.g_scale / p->rho_rest;
    for (long i = b * SWEEP_BLOCK; i < sweep_end(b, fluid->n); i++) {
        const double x = own->records[4*i], y = own->records[4*i + 1], z = own->records[4*i + 2];
        const double lmbda = own->records[4*i + 3];
        double out[4], d[3];
        sum_gradient(own, i, &kernel, wendland, swollen, fluid->swell, lmbda, x, y, z, out);
        d[0] = slope * out[0]; d[1] = slope * out[1]; d[2] = slope * out[2];
        if (out[3] > 1.0) set_apart(p, fluid, own, i, p->nudge * nudge, d);
        if (lmbda != 0.0)
            for (int k = 0; k < n_walls; k++)
                if (walls[k].count[i] > 0) {
                    const double f = lmbda * slope / p->m;
                    sum_gradient(&walls[k], i, &kernel, wendland, 0, NULL, 0.0, x, y, z, out);
                    d[0] += f * out[0]; d[1] += f * out[1]; d[2] += f * out[2];
                }
        for (int k = 0; pushes && k < n_walls; k++)
            if (pushes[k].count[i] > 0) {
                sum_gradient(&pushes[k], i, &kernel, wendland, 0, NULL, 0.0, x, y, z, out);
                d[0] += slope * out[0]; d[1] += slope * out[1]; d[2] += slope * out[2];
            }
        double f = p->omega * weight, multiplier = f * lmbda;
        d[0] *= f; d[1] *= f; d[2] *= f;
        if (fluid->qx) {
            multiplier += (weight - 1.0) * fluid->q_lmbda[i];
            fluid->q_lmbda[i] = multiplier;
            d[0] += (weight - 1.0) * fluid->qx[i]; d[1] += (weight - 1.0) * fluid->qy[i];
            d[2] += (weight - 1.0) * fluid->qz[i];
        }
        const double size = sqrt(d[0]*d[0] + d[1]*d[1] + d[2]*d[2]);
        if (size > p->max_displacement) {
            f = p->max_displacement / size;
            d[0] *= f; d[1] *= f; d[2] *= f;
            fluid->limited[i] += 1;
        }
        if (fluid->qx) { fluid->qx[i] = d[0]; fluid->qy[i] = d[1]; fluid->qz[i] = d[2]; }
        fluid->x[i] = x + d[0]; fluid->y[i] = y + d[1]; fluid->z[i] = z + d[2];
        fluid->impulse[i] += feels * multiplier;
        fluid->sx[i] += feels * d[0]; fluid->sy[i] += feels * d[1]; fluid->sz[i] += feels * d[2];
        if (fluid->phase && fluid->phase[i] == VAPOUR) pull(p, fluid, own, i, feels);
        if (p->container != NO_CONTAINER) contain(p, fluid, i, feels);
    }
}

/* The corrections, applied: nudge of coincident particles, what the velocity feels of them, weight of Chebyshev's.
 * pushes: as the walls, but a record's w is mass times multiplier per mass; NULL where walls have none. */
static void sweep_move(const SweepModel *p, const SweepFluid *fluid, const PairSource *own, const PairSource *walls,
                       const PairSource *pushes, int n_walls, double nudge, double feels, double weight) {
    #pragma omp parallel for schedule(static)
    for (long b = 0; b < sweep_blocks(fluid->n); b++)
        if (fluid->swell) {
            if (p->kernel.wendland) move_of(b, p, 1, 1, fluid, own, walls, pushes, n_walls, nudge, feels, weight);
            else move_of(b, p, 0, 1, fluid, own, walls, pushes, n_walls, nudge, feels, weight);
        } else {
            if (p->kernel.wendland) move_of(b, p, 1, 0, fluid, own, walls, pushes, n_walls, nudge, feels, weight);
            else move_of(b, p, 0, 0, fluid, own, walls, pushes, n_walls, nudge, feels, weight);
        }
}
#endif

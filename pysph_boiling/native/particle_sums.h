/* Sums, extremes and groups of the particles of one array, in one pass over each property; no neighbours.
 *
 * A sum of doubles is made in blocks, whose sums are added with compensation (Neumaier 1974), so that its rounding
 * error does not grow with the number of particles. The order of a sum does not depend on the number of threads: there
 * is one.
 */
#ifndef PARTICLE_SUMS_H
#define PARTICLE_SUMS_H
#include <stdint.h>
#include <algorithm>
#include "pair_sums.h"

#define TOTAL_BLOCK 1024                /* particles, a multiple of 16 */
#define N_STATES 5                      /* phases 0 to 3, those of SUPERHEATED above T_sat alone; the rest of them */
#define SUPERHEATED 2                   /* Phase.SUPERHEATED */
#define HELD 4

/* Groups of n > 0 equal labels, in the order of the labels: their labels, where each comes first, and their sizes; the
 * group of each label. `key` (n) is memory; n < 2^32. Returns the number of groups.
 */
static long label_groups(long n, const unsigned int *label, uint64_t *key, unsigned int *group, long *first,
                         long *number, long *index) {
    long groups = 0;
    for (long i = 0; i < n; i++) key[i] = (uint64_t)label[i] << 32 | (uint64_t)i;       /* as one number: sorts fast */
    std::sort(key, key + n);
    for (long k = 0; k < n; k++) {
        const unsigned int own = (unsigned int)(key[k] >> 32);
        const long i = (long)(key[k] & 0xffffffff);
        if (k == 0 || own != group[groups - 1]) {
            group[groups] = own;
            first[groups] = i;
            number[groups++] = 0;
        }
        number[groups - 1]++;
        index[i] = groups - 1;
    }
    return groups;
}

/* Of the members of each group, how many lie no more than `reach` above `base`, and how many have a uid in the sorted
 * `known`. Both counts (groups) are 0 before.
 */
static void count_members(long n, const long *index, const double *height, double base, double reach,
                          const unsigned int *uid, long m, const unsigned int *known, double *low, double *met) {
    for (long i = 0; i < n; i++) {
        if (height[i] - base <= reach) low[index[i]] += 1.0;
        if (std::binary_search(known, known + m, uid[i])) met[index[i]] += 1.0;
    }
}

/* Which of 8 values lie in low..high, as bits. */
PAIR_INLINE int within(const int *a, __m256i low, __m256i high) {
    const __m256i v = _mm256_loadu_si256((const __m256i *)a);
    const __m256i out = _mm256_or_si256(_mm256_cmpgt_epi32(low, v), _mm256_cmpgt_epi32(v, high));
    return ~_mm256_movemask_ps(_mm256_castsi256_ps(out)) & 255;
}

/* Whether one of the values lies in low..high. */
static int any_within(long n, const int *a, int low, int high) {
    const __m256i least = _mm256_set1_epi32(low), most = _mm256_set1_epi32(high);
    long i = 0;
    for (; i + 8 <= n; i += 8)
        if (within(a + i, least, most)) return 1;
    for (; i < n; i++)
        if (low <= a[i] && a[i] <= high) return 1;
    return 0;
}

/* Number of the values that lie in low..high; their indices, in order, unless `found` is NULL. */
static long all_within(long n, const int *a, int low, int high, long *found) {
    const __m256i least = _mm256_set1_epi32(low), most = _mm256_set1_epi32(high);
    long number = 0, i = 0;
    for (; i + 8 <= n; i += 8) {
        int bits = within(a + i, least, most);
        if (!found) number += __builtin_popcount(bits);
        else for (; bits; bits &= bits - 1) found[number++] = i + __builtin_ctz(bits);
    }
    for (; i < n; i++)
        if (low <= a[i] && a[i] <= high) {
            if (found) found[number] = i;
            number++;
        }
    return number;
}

typedef struct { double sum, lost; } Total;

PAIR_INLINE void total_add(Total *t, double value) {
    const double sum = t->sum + value;
    t->lost += fabs(t->sum) >= fabs(value) ? (t->sum - sum) + value : (value - sum) + t->sum;
    t->sum = sum;
}

PAIR_INLINE double four_total(__m256d a) {
    double part[4];
    _mm256_storeu_pd(part, a);
    return (part[0] + part[1]) + (part[2] + part[3]);
}

/* Sum of a property. */
static double property_sum(long n, const double *a) {
    Total total = {0.0, 0.0};
    for (long begin = 0; begin < n; begin += TOTAL_BLOCK) {
        const long end = begin + TOTAL_BLOCK < n ? begin + TOTAL_BLOCK : n;
        __m256d s0 = _mm256_setzero_pd(), s1 = s0, s2 = s0, s3 = s0;
        double rest = 0.0;
        long i = begin;
        for (; i + 16 <= end; i += 16) {
            s0 = _mm256_add_pd(s0, _mm256_loadu_pd(a + i));
            s1 = _mm256_add_pd(s1, _mm256_loadu_pd(a + i + 4));
            s2 = _mm256_add_pd(s2, _mm256_loadu_pd(a + i + 8));
            s3 = _mm256_add_pd(s3, _mm256_loadu_pd(a + i + 12));
        }
        for (; i < end; i++) rest += a[i];
        total_add(&total, four_total(_mm256_add_pd(_mm256_add_pd(s0, s1), _mm256_add_pd(s2, s3))) + rest);
    }
    return total.sum + total.lost;
}

static double counter_sum(long n, const int *a) {
    long long sum = 0;
    for (long i = 0; i < n; i++) sum += a[i];
    return (double)sum;
}

/* Smallest and largest value of a property; both NaN if there is one, infinite without particles. */
static void property_ends(long n, const double *a, double *ends) {
    const double inf = __builtin_inf();
    __m256d least = _mm256_set1_pd(inf), most = _mm256_set1_pd(-inf), odd = _mm256_setzero_pd();
    __m256d least_too = least, most_too = most;         /* two chains, since each has to wait for itself */
    double low[4], high[4];
    long i = 0;
    for (; i + 8 <= n; i += 8) {
        const __m256d v = _mm256_loadu_pd(a + i), w = _mm256_loadu_pd(a + i + 4);
        least = _mm256_min_pd(v, least);
        most = _mm256_max_pd(v, most);
        least_too = _mm256_min_pd(w, least_too);
        most_too = _mm256_max_pd(w, most_too);
        odd = _mm256_or_pd(odd, _mm256_cmp_pd(v, w, _CMP_UNORD_Q));
    }
    least = _mm256_min_pd(least, least_too);
    most = _mm256_max_pd(most, most_too);
    int none = _mm256_movemask_pd(odd);
    _mm256_storeu_pd(low, least);
    _mm256_storeu_pd(high, most);
    ends[0] = inf;
    ends[1] = -inf;
    for (int k = 0; k < 4; k++) ends[0] = smaller(ends[0], low[k]), ends[1] = larger(ends[1], high[k]);
    for (; i < n; i++) {
        ends[0] = smaller(ends[0], a[i]);
        ends[1] = larger(ends[1], a[i]);
        none |= a[i] != a[i];
    }
    if (none) ends[0] = ends[1] = __builtin_nan("");
}

/* Largest square of a vector; 0 without particles, NaN if one of its components is. */
static double largest_square(long n, const double *x, const double *y, const double *z) {
    __m256d most = _mm256_setzero_pd(), odd = most;
    double found[4], largest = 0.0;
    long i = 0;
    for (; i + 4 <= n; i += 4) {
        const __m256d a = _mm256_loadu_pd(x + i), b = _mm256_loadu_pd(y + i), c = _mm256_loadu_pd(z + i);
        const __m256d square = _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(a, a), _mm256_mul_pd(b, b)),
                                             _mm256_mul_pd(c, c));
        most = _mm256_max_pd(square, most);
        odd = _mm256_or_pd(odd, _mm256_cmp_pd(square, square, _CMP_UNORD_Q));
    }
    int none = _mm256_movemask_pd(odd);
    _mm256_storeu_pd(found, most);
    for (int k = 0; k < 4; k++) largest = larger(largest, found[k]);
    for (; i < n; i++) {
        const double square = x[i]*x[i] + y[i]*y[i] + z[i]*z[i];
        largest = larger(largest, square);
        none |= square != square;
    }
    return none ? __builtin_nan("") : largest;
}

typedef struct { __m256d energy[N_STATES], hidden; __m256i number[N_STATES]; } StateSums;

PAIR_INLINE void add_states(StateSums *s, const double *m, const double *e, const double *e_lat, const int *phase) {
    const __m256d mass = _mm256_loadu_pd(m), own = _mm256_loadu_pd(e), stored = _mm256_loadu_pd(e_lat);
    const __m256d energy = _mm256_mul_pd(mass, own), saturated = _mm256_cmp_pd(own, stored, _CMP_LE_OQ);
    const __m256i state = _mm256_cvtepi32_epi64(_mm_loadu_si128((const __m128i *)phase));
    const __m256i liquid = _mm256_cmpeq_epi64(state, _mm256_setzero_si256());
    if (_mm256_movemask_pd(_mm256_castsi256_pd(liquid)) == 15) {        /* as most are */
        s->energy[0] = _mm256_add_pd(s->energy[0], energy);
        s->number[0] = _mm256_sub_epi64(s->number[0], liquid);
        return;
    }
    for (int k = 0; k < N_STATES; k++) {
        __m256d in = _mm256_castsi256_pd(_mm256_cmpeq_epi64(state, _mm256_set1_epi64x(k == HELD ? SUPERHEATED : k)));
        if (k == SUPERHEATED) {
            s->hidden = _mm256_add_pd(s->hidden, _mm256_and_pd(in, _mm256_mul_pd(mass, _mm256_min_pd(own, stored))));
            in = _mm256_andnot_pd(saturated, in);
        } else if (k == HELD)
            in = _mm256_and_pd(saturated, in);
        s->energy[k] = _mm256_add_pd(s->energy[k], _mm256_and_pd(in, energy));
        s->number[k] = _mm256_sub_epi64(s->number[k], _mm256_castpd_si256(in));
    }
}

/* Number and enthalpy [J] of the particles in each state; after the enthalpies the latent heat that superheated ones
 * hold. HELD are those with no more than that, e <= e_lat. */
static void state_sums(long n, const double *m, const double *e, const double *e_lat, const int *phase, double *number,
                       double *energy) {
    Total total[N_STATES + 1] = {{0.0, 0.0}};
    StateSums s;
    memset(&s, 0, sizeof s);
    for (long begin = 0; begin < n; begin += TOTAL_BLOCK) {
        const long end = begin + TOTAL_BLOCK < n ? begin + TOTAL_BLOCK : n;
        long i = begin;
        for (; i + 4 <= end; i += 4) add_states(&s, m + i, e + i, e_lat + i, phase + i);
        if (i < end) {                  /* filled up with what is in no state */
            double rest[3][4] = {{0.0}};
            int none[4] = {-1, -1, -1, -1};
            for (long k = i; k < end; k++)
                rest[0][k - i] = m[k], rest[1][k - i] = e[k], rest[2][k - i] = e_lat[k], none[k - i] = phase[k];
            add_states(&s, rest[0], rest[1], rest[2], none);
        }
        for (int k = 0; k < N_STATES; k++) {
            total_add(&total[k], four_total(s.energy[k]));
            s.energy[k] = _mm256_setzero_pd();
        }
        total_add(&total[N_STATES], four_total(s.hidden));
        s.hidden = _mm256_setzero_pd();
    }
    for (int k = 0; k <= N_STATES; k++) energy[k] = total[k].sum + total[k].lost;
    for (int k = 0; k < N_STATES; k++) {
        long long part[4];
        _mm256_storeu_si256((__m256i *)part, s.number[k]);
        number[k] = (double)(part[0] + part[1] + part[2] + part[3]);
    }
}
#endif

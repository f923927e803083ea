/* Bubbles as connected components of vapour, by union-find: the labels of the equations in bubble_groups.py. Only
 * vapour costs, and of two roots the one with the smaller uid wins.
 */
#ifndef BUBBLE_LABELS_H
#define BUBBLE_LABELS_H
#define LABEL_NONE 4294967295u          /* NO_BUBBLE */

static int label_root(int *parent, int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

static void label_join(int *parent, const unsigned int *uid, int i, int j) {
    const int a = label_root(parent, i), b = label_root(parent, j);
    if (a == b) return;
    if (uid[a] < uid[b]) parent[b] = a;
    else parent[a] = b;
}

/* n particles and `total` with ghosts; images (total - n): the particle that each ghost is an image of. */
static void label_bubbles(long n, long total, const int *phase, const unsigned int *uid, const double *x,
                          const double *y, const double *z, double radius2, const unsigned int **begin,
                          const int *count, const int *images, int *parent, unsigned int *bubble) {
    for (long i = 0; i < total; i++) parent[i] = (int)i;
    for (long i = n; i < total; i++)
        if (phase[i] == VAPOUR) label_join(parent, uid, (int)i, images[i - n]);
    for (long i = 0; i < n; i++) {
        if (phase[i] != VAPOUR) continue;
        for (int k = 0; k < count[i]; k++) {
            const unsigned int j = begin[i][k];
            const double dx = x[i] - x[j], dy = y[i] - y[j], dz = z[i] - z[j];
            if (phase[j] == VAPOUR && dx*dx + dy*dy + dz*dz < radius2) label_join(parent, uid, (int)i, (int)j);
        }
    }
    for (long i = 0; i < n; i++) bubble[i] = phase[i] == VAPOUR ? uid[label_root(parent, (int)i)] : LABEL_NONE;
}
#endif

"""Bubbles as connected components of vapour, labelled by FastSV hooking and pointer jumping in iterated groups.

One round has four groups: :class:`BubbleSnap`, :class:`BubbleHook`, :class:`BubbleShortcut` and :class:`BubbleCheck`.
:class:`BubbleStart` comes before all rounds, and :class:`BubbleLabel` after them. Parents are indices into the array.
Of two roots the one with the smaller uid wins, so the label of a bubble is its smallest uid on every backend and for
every order of the particles. A shuffled chain of n particles needs about log2(n) rounds.

Each of the four equations needs its own group, inside one parent group that iterates until :class:`BubbleCheck` has
converged. In a periodic domain ``grandparent`` must be refreshed on the ghosts after :class:`BubbleSnap`. Any other
arrangement gives wrong labels without an error, so use :func:`pysph_boiling.schemes.guest.label_groups` in another
scheme.
"""
from compyle.api import declare
from pysph.base.reduce_array import dummy_reduce_array as parallel_reduce_array  # compiled modules have their own
from pysph.sph.equation import Equation

__all__ = ["BubbleCheck", "BubbleHook", "BubbleLabel", "BubbleShortcut", "BubbleSnap", "BubbleStart"]


class BubbleStart(Equation):
    """Makes every particle its own parent.

    Source: Zhang, Azad & Hu 2020 (FastSV), the start of their Algorithm 2; the paper, section 4.1 (union-find).
    Reads nothing.   Writes   d_parent, d_grandparent, own index only.
    """

    def initialize(self, d_idx, d_parent, d_grandparent):
        d_parent[d_idx] = d_idx
        d_grandparent[d_idx] = d_idx


class BubbleSnap(Equation):
    """Computes grandparents from parents, ``gf = f[f]``.

    Source: Zhang, Azad & Hu 2020.   Reads   d_parent.   Writes   d_grandparent, own index only.
    """

    def initialize(self, d_idx, d_parent, d_grandparent):
        d_grandparent[d_idx] = d_parent[d_parent[d_idx]]


class BubbleHook(Equation):
    """Hooks the parent of a particle, and the particle itself, onto the smallest grandparent within reach.

    Source: Zhang, Azad & Hu 2020, stochastic and aggressive hooking. Several threads may write the entry of a parent,
    but every value is a valid parent, so that only the number of rounds can vary, and never the labels.

    Parameters
    ----------
    radius : float   Linking radius [m], > 0: vapour particles closer than this belong together.

    Reads    d_phase, s_phase, s_grandparent, d_uid, positions.   Writes   d_parent, own and parent's index.
    Needs    BubbleSnap in an earlier group.   Errors   ValueError if radius <= 0.
    """

    def __init__(self, dest, sources, radius):
        if not radius > 0.0:
            raise ValueError(f"link radius must be > 0 m, got {radius} m")
        self.radius2 = float(radius) * float(radius)
        super().__init__(dest, sources)

    def loop_all(self, d_idx, d_phase, d_parent, d_uid, d_x, d_y, d_z, s_phase, s_grandparent, s_x, s_y, s_z,
                 NBRS, N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        g = declare('int')
        p = declare('int')
        if d_phase[d_idx] == 3:
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                if s_phase[s_idx] == 3:
                    rx = d_x[d_idx] - s_x[s_idx]
                    ry = d_y[d_idx] - s_y[s_idx]
                    rz = d_z[d_idx] - s_z[s_idx]
                    if rx*rx + ry*ry + rz*rz < self.radius2:
                        g = s_grandparent[s_idx]
                        p = d_parent[d_idx]
                        if d_uid[g] < d_uid[d_parent[p]]:
                            d_parent[p] = g
                        if d_uid[g] < d_uid[d_parent[d_idx]]:
                            d_parent[d_idx] = g


class BubbleShortcut(Equation):
    """Pointer jumping: replaces the parent by the grandparent if that is smaller.

    Source: Zhang, Azad & Hu 2020.   Reads   d_grandparent, d_uid.   Writes   d_parent, own index only.
    """

    def initialize(self, d_idx, d_parent, d_grandparent, d_uid):
        if d_uid[d_grandparent[d_idx]] < d_uid[d_parent[d_idx]]:
            d_parent[d_idx] = d_grandparent[d_idx]


class BubbleCheck(Equation):
    """Checks convergence: no grandparent changed in this round.

    Source: Zhang, Azad & Hu 2020.   Reads   d_parent, d_grandparent.   Writes   d_unsettled, own index only; constant
    ``bubble_rounds`` (count) [-].
    """

    def __init__(self, dest, sources):
        self.conv = -1.0
        super().__init__(dest, sources)

    def initialize(self, d_idx, d_parent, d_grandparent, d_unsettled):
        d_unsettled[d_idx] = 0
        if d_parent[d_parent[d_idx]] != d_grandparent[d_idx]:
            d_unsettled[d_idx] = 1

    def reduce(self, dst, t, dt):
        from pysph_boiling.device import summed, values  # here: compiled modules see no imports of ours

        changed = parallel_reduce_array(summed(values(dst, 'unsettled')), 'sum')
        dst.bubble_rounds[0] += 1.0
        self.conv = 1.0 if changed == 0 else -1.0

    def converged(self):
        return self.conv


class BubbleLabel(Equation):
    """Labels each vapour particle with the uid of its root, and all others with ``NO_BUBBLE``.

    Source: the paper, section 4.1.   Reads   d_parent, d_uid, d_phase.   Writes   d_bubble, own index only.
    Needs    converged parents.
    """

    def initialize(self, d_idx, d_parent, d_uid, d_phase, d_bubble):
        d_bubble[d_idx] = 4294967295
        if d_phase[d_idx] == 3:
            d_bubble[d_idx] = d_uid[d_parent[d_idx]]

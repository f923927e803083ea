"""Sizes and radii of bubbles, from the labels of :mod:`pysph_boiling.equations.bubble_groups`, and their departures.

Only the vapour particles are read, so the cost grows with their number.
"""
import math

import numpy as np
from pysph.solver.tools import Tool

from pysph_boiling.native import counts
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import positions
from pysph_boiling.schemes.effects.base import computed_once
from pysph_boiling.schemes.vapour import Vapour

__all__ = ["Departures", "equivalent_radius", "mean_radius", "store_sizes", "vapour_of"]


@computed_once
def vapour_of(arrays):
    """The :class:`Vapour` of fluid arrays with current labels."""
    return Vapour(arrays)


def equivalent_radius(vapour, scene):
    """Radius of a disc or sphere of the rest volume of each bubble, including expansion, (bubbles,) [m]."""
    m = vapour.get("m")
    swollen = "swell" in vapour.arrays[0].properties
    volume = vapour.sum(m * vapour.get("swell") if swollen else m) / scene.rho0
    return np.sqrt(volume / math.pi) if scene.dim == 2 else np.cbrt(3.0 * volume / (4.0 * math.pi))


def mean_radius(vapour, scene):
    """Mean distance of the particles of each bubble from its centroid (the paper, eq. 24), (bubbles,) [m]."""
    place, centroid = vapour.places(scene.period)
    return vapour.sum(np.linalg.norm(place - centroid[vapour.index], axis=1)) / np.maximum(vapour.n, 1)


def store_sizes(arrays):
    """Set ``bubble_n`` of each vapour particle to the number of particles in its bubble, and of all others to 0."""
    vapour = Vapour(arrays)
    vapour.put("bubble_n", vapour.n[vapour.index], elsewhere=0)


class Departures(Tool):
    """Records each bubble that departs from the base: ``events`` is a list of (time [s], particles).

    A bubble is detached when its lowest particle is more than ``clearance`` [m] above the highest site. It departs when
    it is detached and most of its particles were in an attached bubble one step before. So a bubble that splits or
    merges while it rises does not depart again, and vapour that forms above the base does not depart at all.
    """

    def __init__(self, scheme, clearance):
        self.scheme, self.clearance = scheme, clearance
        self.up = np.array(scheme.scene().up)
        self.base = None
        self.attached = np.zeros(0, np.uintc)  # uids in attached bubbles, one step before, sorted
        self.events = []

    def pre_step(self, solver):
        if self.base is None:  # at the start and when a run is resumed
            sites = [pa for pa in solver.particles if pa.name in self.scheme.sites]
            self.base = ranks.largest(max(
                float(np.max(positions(pa) @ self.up, initial=-np.inf)) for pa in sites))
            self.attached = self.look()[-1]

    def post_step(self, solver):
        vapour, aloft, before, self.attached = self.look()
        for n in vapour.n[aloft & (before > 0.5 * vapour.n)]:
            self.events.append((solver.t + solver.dt, int(n)))

    def look(self):
        """The vapour; whether each bubble is detached, and how many of its particles were in attached bubbles one step
        before, (bubbles,) each; the uids in attached bubbles now."""
        vapour = Vapour(self.scheme.arrays)
        height = sum(share * vapour.get(name) for name, share in zip("xyz", self.up) if share)
        uid = vapour.get("uid")
        low, before = map(ranks.total, counts(vapour.index, len(vapour.label), height, self.base, self.clearance, uid,
                                              self.attached))
        aloft = low == 0.0
        return vapour, aloft, before, np.sort(ranks.gather(uid[~aloft[vapour.index]])[0])

"""Sizes and radii of bubbles, from the labels of :mod:`pysph_boiling.equations.bubble_groups`, and their departures.

Only the vapour particles are read, so the cost grows with their number.
"""
import math

import numpy as np
from pysph.solver.tools import Tool

from pysph_boiling.native import counts
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import in_order
from pysph_boiling.schemes.effects.base import computed_once
from pysph_boiling.schemes.vapour import Vapour, nearest_image

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
    """Records each bubble that departs from the base: ``events`` is a list of (time [s], particles, site).

    A bubble is detached when its lowest particle is more than ``clearance`` [m] above the highest site. It departs when
    it is detached and most of its particles were in an attached bubble one step before and have not departed before
    (``departed``). So neither a bubble that splits or merges while it rises nor one that hovers at the edge of its site
    departs again, and vapour that forms above the base does not depart at all.

    It departs from the site next to its lowest particle. Sites are numbered in the order of their coordinates, x first,
    and not in that of the memory.
    """

    def __init__(self, scheme, clearance):
        self.scheme, self.clearance = scheme, clearance
        self.up, self.period = np.array(scheme.scene().up), scheme.scene().period
        self.sites = self.base = None
        self.attached = np.zeros(0, np.uintc)  # uids in attached bubbles that had not departed, one step before, sorted
        self.events = []

    def pre_step(self, solver):
        if self.base is None:  # at the start and when a run is resumed
            places = ranks.gather(np.concatenate([
                np.stack([pa.get(axis, only_real_particles=True) for axis in "xyz"], -1)
                for pa in solver.particles if pa.name in self.scheme.sites]))[0]
            self.sites = in_order(places)
            self.base = float(np.max(self.sites @ self.up))
            self.attached = self.look()[-1]

    def post_step(self, solver):
        vapour, height, aloft, before, self.attached = self.look()
        leaves = aloft & (before > 0.5 * vapour.n)
        departed = (vapour.get("departed") > 0) | leaves[vapour.index]
        vapour.put("departed", departed, elsewhere=0)  # so that new vapour has not departed
        if leaves.any():
            lowest = self.lowest(vapour, height)
            for bubble in np.flatnonzero(leaves):
                away = nearest_image(self.sites - lowest[bubble], self.period)
                site = int(np.argmin(np.sum((away - np.outer(away @ self.up, self.up))**2, axis=1)))
                self.events.append((solver.t + solver.dt, int(vapour.n[bubble]), site))

    def look(self):
        """The vapour and the heights of its particles; whether each bubble is detached, and how many of its particles
        were in attached bubbles one step before, (bubbles,) each; the uids now in attached bubbles, without those that
        have departed before."""
        vapour = Vapour(self.scheme.arrays)
        height = sum(share * vapour.get(name) for name, share in zip("xyz", self.up) if share)
        uid = vapour.get("uid")
        low, before = map(ranks.total, counts(vapour.index, len(vapour.label), height, self.base, self.clearance, uid,
                                              self.attached))
        aloft = low == 0.0
        attached = ~aloft[vapour.index] & (vapour.get("departed") == 0)
        return vapour, height, aloft, before, np.sort(ranks.gather(uid[attached])[0])

    def lowest(self, vapour, height):
        """Place of the lowest particle of each bubble, (bubbles, 3) [m]; the mean of several that are equally low."""
        low = height == -vapour.max(-height, least=-np.inf)[vapour.index]
        return np.stack([vapour.sum(low * vapour.get(axis)) for axis in "xyz"], -1) / vapour.sum(low)[:, None]

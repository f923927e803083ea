"""Bubbles of a state: size, centroid, mean radius, from the labels of :mod:`pysph_boiling.equations.bubble_groups`.

Only the vapour subset is touched, so the cost is that of the vapour.
"""
import math
from dataclasses import dataclass

import numpy as np
from pysph.solver.tools import Tool

from pysph_boiling.device import Subset, values
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.vapour import Vapour

__all__ = ["BubbleTable", "Departures", "bubble_table", "store_sizes"]


@dataclass(frozen=True)
class BubbleTable:
    """One row per bubble, sorted by label; all arrays have shape (bubbles,) but for the centroid.

    ``label`` smallest uid [-]; ``n`` particles [-]; ``mass`` [kg]; ``centroid`` (bubbles, 3) [m]; ``mean_radius`` mean
    distance from the centroid (the paper, eq. 24) [m]; ``equivalent_radius`` of a disc or sphere of the same volume
    [m]; ``deficit`` sum of m c_v (T_sat - T) over its particles below saturation (the paper, eq. 20) [J].
    """

    label: np.ndarray
    n: np.ndarray
    mass: np.ndarray
    centroid: np.ndarray
    mean_radius: np.ndarray
    equivalent_radius: np.ndarray
    deficit: np.ndarray


def bubble_table(arrays, scene, period=(0.0, 0.0, 0.0)):
    """The :class:`BubbleTable` of fluid arrays with current labels.

    ``period`` [m] is the length of the periodic domain along each axis, 0 where it is not periodic: positions of a
    bubble are then taken relative to one of its members, by the nearest image (a bubble must be shorter than half a
    period).
    """
    vapour = Vapour(arrays)
    place, centroid = vapour.places(period)
    distance = np.linalg.norm(place - centroid[vapour.index], axis=1)
    m = vapour.get("m")
    mass = vapour.sum(m)
    volume = mass / scene.rho0
    equivalent = np.sqrt(volume / math.pi) if scene.dim == 2 else np.cbrt(3.0 * volume / (4.0 * math.pi))
    deficit = vapour.sum(m * np.maximum(scene.material.L - vapour.get("e"), 0.0))
    return BubbleTable(vapour.label, vapour.n, mass, centroid, vapour.sum(distance) / np.maximum(vapour.n, 1),
                       equivalent, deficit)


def store_sizes(arrays):
    """Write the number of particles of its bubble to each vapour particle (``bubble_n``), 0 to all others."""
    vapour = Vapour(arrays)
    vapour.put("bubble_n", vapour.n[vapour.index], elsewhere=0)


class Departures(Tool):
    """Records each bubble that leaves the base: ``events`` is a list of (time [s], particles).

    A bubble is aloft when its lowest particle is more than ``clearance`` [m] above the highest site. It departs when it
    is aloft and most of its particles were in a bubble at the base one step before; so a bubble that splits or merges
    on its way up does not depart again, and vapour that is made aloft does not depart at all.
    """

    def __init__(self, scheme, clearance):
        self.scheme, self.clearance = scheme, clearance
        self.up = np.array(scheme.scene().up)
        self.base = None
        self.attached = None  # uids in bubbles at the base, one step before
        self.events = []

    def pre_step(self, solver):
        if self.attached is None:  # also when an interrupted run goes on
            sites = [pa for pa in solver.particles if pa.name in self.scheme.sites]
            self.base = max(float(np.max(np.stack([pa.x, pa.y, pa.z], -1) @ self.up)) for pa in sites)
            uid, index, _, aloft = self.look()
            self.attached = uid[~aloft[index]]

    def post_step(self, solver):
        uid, index, size, aloft = self.look()
        before = np.bincount(index, weights=np.isin(uid, self.attached), minlength=len(size))
        for n in size[aloft & (before > 0.5 * size)]:
            self.events.append((solver.t + solver.dt, int(n)))
        self.attached = uid[~aloft[index]]

    def look(self):
        """Of each vapour particle its uid and bubble; of each bubble its particles, and whether it is aloft."""
        parts = {name: [] for name in ("uid", "bubble", "height")}
        for pa in self.scheme.arrays:
            vapour = Subset(pa, values(pa, "phase") == Phase.VAPOUR)
            parts["uid"].append(vapour.get("uid"))
            parts["bubble"].append(vapour.get("bubble"))
            parts["height"].append(np.stack([vapour.get(axis) for axis in "xyz"], -1) @ self.up - self.base)
        uid, bubble, height = (np.concatenate(parts[name]) for name in ("uid", "bubble", "height"))
        _, index, size = np.unique(bubble, return_inverse=True, return_counts=True)
        lowest = np.full(len(size), np.inf)
        np.minimum.at(lowest, index, height)
        return uid, index, size, lowest > self.clearance

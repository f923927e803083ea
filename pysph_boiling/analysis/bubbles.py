"""Bubbles of a state: size, centroid, mean radius, from the labels of :mod:`pysph_boiling.equations.bubble_groups`.

Only the vapour subset is touched, so the cost is that of the vapour.
"""
import math
from dataclasses import dataclass

import numpy as np
from pysph.solver.tools import Tool

from pysph_boiling.phases import Phase

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
    columns = {name: [] for name in ("x", "y", "z", "m", "e", "bubble")}
    for pa in arrays:
        vapour = np.flatnonzero(pa.get("phase", only_real_particles=True) == Phase.VAPOUR)
        for name, parts in columns.items():
            parts.append(pa.get(name, only_real_particles=True)[vapour])
    data = {name: np.concatenate(parts) for name, parts in columns.items()}
    label, first, index, n = np.unique(data["bubble"], return_index=True, return_inverse=True, return_counts=True)
    place = np.stack([data["x"], data["y"], data["z"]], -1)
    anchor = place[first][index]
    offset = place - anchor
    for axis, length in enumerate(period):
        if length > 0.0:
            offset[:, axis] -= length * np.round(offset[:, axis] / length)
    bubbles = len(label)

    def summed(values):
        return np.bincount(index, weights=values, minlength=bubbles)

    mean = np.stack([summed(offset[:, axis]) for axis in range(3)], -1) / n[:, None] if bubbles else np.zeros((0, 3))
    radius = summed(np.linalg.norm(offset - mean[index], axis=1)) / np.maximum(n, 1)
    mass = summed(data["m"])
    volume = mass / scene.rho0
    equivalent = np.sqrt(volume / math.pi) if scene.dim == 2 else np.cbrt(3.0 * volume / (4.0 * math.pi))
    deficit = summed(data["m"] * np.maximum(scene.material.L - data["e"], 0.0))
    return BubbleTable(label, n, mass, place[first] + mean, radius, equivalent, deficit)


def store_sizes(arrays):
    """Write the number of particles of its bubble to each vapour particle (``bubble_n``), 0 to all others."""
    vapour = [np.flatnonzero(pa.get("phase", only_real_particles=True) == Phase.VAPOUR) for pa in arrays]
    labels = np.concatenate([pa.get("bubble", only_real_particles=True)[who] for pa, who in zip(arrays, vapour)])
    _, index, size = np.unique(labels, return_inverse=True, return_counts=True)
    sizes = np.split(size[index], np.cumsum([len(who) for who in vapour])[:-1])
    for pa, who, values in zip(arrays, vapour, sizes):
        pa.bubble_n[:] = 0
        pa.bubble_n[who] = values
        if pa.gpu is not None:
            pa.gpu.push("bubble_n")


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
        self.attached = np.zeros(0, np.uint32)  # uids in bubbles at the base, one step before
        self.events = []

    def post_step(self, solver):
        if self.base is None:
            sites = [pa for pa in solver.particles if pa.name in self.scheme.sites]
            self.base = max(float(np.max(np.stack([pa.x, pa.y, pa.z], -1) @ self.up)) for pa in sites)
        parts = {name: [] for name in ("uid", "bubble", "height")}
        for pa in self.scheme.arrays:
            vapour = np.flatnonzero(pa.get("phase", only_real_particles=True) == Phase.VAPOUR)
            parts["uid"].append(pa.uid[vapour])
            parts["bubble"].append(pa.bubble[vapour])
            parts["height"].append(np.stack([pa.x[vapour], pa.y[vapour], pa.z[vapour]], -1) @ self.up - self.base)
        uid, bubble, height = (np.concatenate(parts[name]) for name in ("uid", "bubble", "height"))
        if len(uid) == 0:
            self.attached = uid
            return
        _, index, size = np.unique(bubble, return_inverse=True, return_counts=True)
        lowest = np.full(len(size), np.inf)
        np.minimum.at(lowest, index, height)
        up_now = lowest > self.clearance
        before = np.bincount(index, weights=np.isin(uid, self.attached), minlength=len(size))
        for n in size[up_now & (before > 0.5 * size)]:
            self.events.append((solver.t + solver.dt, int(n)))
        self.attached = uid[~up_now[index]]

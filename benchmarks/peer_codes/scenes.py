"""The scenes that every code runs, and the functions that measure them from positions alone, for all codes.

Lengths are in metres. The fluid starts two spacings from the walls, centre to centre, with which every code is stable,
and slightly off the lattice, so that no pair of particles has exactly the distance of the support radius.
"""
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from pysph_boiling.evaluation.accuracy.front import pareto

__all__ = ["GRAVITY", "Scene", "at_equal_error", "by_rising_error", "compression", "cubic_spline", "front", "outside"]

GRAVITY = 9.81
JITTER = 2e-3  # spacings
ESCAPES = 0.005  # share of the particles that may be outside the tank in a run that counts


def cubic_spline(r, h):
    """Cubic spline in 3-D [1/m^3] at distance ``r`` [m]; its support is 2 ``h``."""
    q = r / h
    return (0.25 * np.maximum(2.0 - q, 0.0) ** 3 - np.maximum(1.0 - q, 0.0) ** 3) / (np.pi * h**3)


@dataclass(frozen=True)
class Scene:
    """A block of ``counts`` particles in an open tank whose inside is ``tank`` spacings wide, both (x, y, z)."""

    name: str
    counts: tuple
    tank: tuple
    duration: float  # [s]
    watched: float  # density is measured from this time on [s]
    spacing: float = 0.025

    @property
    def h(self):
        """Smoothing length [m]: the support is two spacings, as SPlisHSPlasH has it."""
        return self.spacing

    @property
    def unit(self):
        """sqrt(spacing/g) [s]."""
        return float(np.sqrt(self.spacing / GRAVITY))

    @property
    def size(self):
        """Inside of the tank [m]."""
        return self.spacing * np.array(self.tank, float)

    @cached_property
    def fluid(self):
        """Positions (n, 3) [m] at the start."""
        axes = [self.spacing * (np.arange(n) + 1.5) for n in self.counts]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
        return points + JITTER * self.spacing * np.random.default_rng(0).uniform(-1.0, 1.0, points.shape)

    @cached_property
    def wall(self):
        """Two layers of boundary particles (n, 3) [m] round floor and sides."""
        axes = [self.spacing * (np.arange(-2, n + (2 if k < 2 else 0)) + 0.5) for k, n in enumerate(self.tank)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
        return points[~np.all((points > 0.0) & (points < self.size), axis=1)]

    @cached_property
    def wall_volume(self):
        """Akinci volumes (n,) [m^3] of the boundary particles."""
        return 1.0 / kernel_sums(self.wall, self.wall, np.ones(len(self.wall)), self.h)

    @property
    def level(self):
        """Height [m] of the same water at rest in the tank."""
        return len(self.fluid) * self.spacing**3 / (self.size[0] * self.size[1])


def kernel_sums(points, sources, weights, h):
    """sum_j weight_j W(|x_i - x_j|) at each of ``points`` (n, 3), shape (n,)."""
    pairs = cKDTree(points).sparse_distance_matrix(cKDTree(sources), 2.0 * h, output_type="coo_matrix")
    return np.bincount(pairs.row, cubic_spline(pairs.data, h) * weights[pairs.col], minlength=len(points))


def compression(scene, points):
    """Positive density error max(rho/rho_0 - 1, 0) [-] of fluid at ``points`` (n, 3), shape (n,).

    ``rho_0`` is what the rest lattice reads: a particle fills spacing^3, boundary particles their Akinci volume.
    """
    rest = kernel_sums(np.zeros((1, 3)), np.mgrid[-2:3, -2:3, -2:3].reshape(3, -1).T * scene.spacing, np.ones(125),
                       scene.h)[0]
    density = kernel_sums(points, points, np.ones(len(points)), scene.h)
    density += kernel_sums(points, scene.wall, scene.wall_volume, scene.h) / scene.spacing**3
    return np.maximum(density / rest - 1.0, 0.0)


def outside(scene, points):
    """Which particles are as far behind a face as the first boundary particles, shape (n,); the tank has no lid."""
    margin = 0.5 * scene.spacing
    upper = scene.size + [margin, margin, np.inf]
    return ~np.all((points > -margin) & (points < upper), axis=1)


def front(scene, points):
    """Front X/a [-] of a dam break: the column's width when it starts, half a row of particles is ahead of it."""
    inside = points[~outside(scene, points)]
    ahead = np.sort(inside[:, 0])[-max(1, scene.counts[1] // 2)]
    width = scene.spacing * scene.counts[0]
    return 1.0 + (ahead - scene.spacing * (scene.counts[0] + 0.5)) / width


def by_rising_error(points):
    """Of (error, cost) points those that no other beats in both: indices."""
    return pareto(*zip(*points)) if points else []


def at_equal_error(points, error):
    """Cost at a given error, on the front of (error, cost) points: log-log interpolation, None outside of the front."""
    chosen = np.array([points[k] for k in by_rising_error(points) if points[k][0] > 0.0])
    if not len(chosen) or not chosen[0, 0] <= error <= chosen[-1, 0]:
        return None
    return float(np.exp(np.interp(np.log(error), *np.log(chosen).T)))

"""Stand-ins for what is drawn."""
from types import SimpleNamespace

import numpy as np

__all__ = ["DX", "FILL", "N", "VESSEL", "ball", "block", "cloud", "glass", "mug", "round_block"]

DX = 0.01
N = 10  # edge of the vessel, in spacings
FILL = 7  # height of the water, in spacings
VESSEL = DX * np.array([[0.0, 0.0, 0.0], [N, N, 1.5 * N]])


def cloud(points, **properties):
    """Stand-in for a particle array: ``points`` (n, 3) [m] and any properties."""
    x, y, z = np.asarray(points, dtype=float).reshape(-1, 3).T
    columns = {"x": x, "y": y, "z": z, **{k: np.broadcast_to(v, x.shape) for k, v in properties.items()}}
    return SimpleNamespace(properties=columns, **columns)


def block(*shape, low=(0, 0, 0)):
    return DX * (np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1).reshape(-1, 3) + low + 0.5)


def ball(centre, radius, points):
    return np.linalg.norm(points - DX * np.asarray(centre), axis=1) < radius * DX


def glass(water, *, heated=True, **properties):
    """Water in an open vessel with one layer of wall, its base heated in the middle, one site."""
    grid = block(N + 2, N + 2, int(1.5 * N) + 1, low=(-1, -1, -1))
    wall = grid[~np.all((grid > VESSEL[0]) & (grid[:, :] < [N * DX, N * DX, 1.0]), axis=1)]
    middle = np.all(np.abs(wall[:, :2] - 0.5 * N * DX) < 0.3 * N * DX, axis=1) & (wall[:, 2] < 0.0)
    return {"fluid": cloud(water, **properties), "wall": cloud(wall, heated=(middle & heated).astype(int)),
            "sites": cloud([[0.7 * N * DX, 0.3 * N * DX, 0.0]])}


def mug(water):
    """Water in a round vessel that stands on z = 0; its radius is half an edge."""
    angle = 2.0 * np.pi * np.arange(36) / 36
    ring = np.column_stack([np.cos(angle), np.sin(angle)]) * (0.5 * N + 0.5) * DX + 0.5 * N * DX
    side = np.concatenate([np.column_stack([ring, np.full(36, z)]) for z in DX * (np.arange(15) + 0.5)])
    floor = block(N, N, 1, low=(0, 0, -1))
    floor = floor[np.linalg.norm(floor[:, :2] - 0.5 * N * DX, axis=1) < 0.5 * N * DX]
    return {"fluid": cloud(water), "wall": cloud(np.concatenate([side, floor]))}


def round_block(height):
    points = block(N, N, height)
    return points[np.linalg.norm(points[:, :2] - 0.5 * N * DX, axis=1) < 0.5 * N * DX]

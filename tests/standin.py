"""Stand-ins for what is drawn."""
from types import SimpleNamespace

import numpy as np

__all__ = ["cloud"]


def cloud(points, **properties):
    """Stand-in for a particle array: ``points`` (n, 3) [m] and any properties."""
    x, y, z = np.asarray(points, dtype=float).reshape(-1, 3).T
    columns = {"x": x, "y": y, "z": z, **{k: np.broadcast_to(v, x.shape) for k, v in properties.items()}}
    return SimpleNamespace(properties=columns, **columns)

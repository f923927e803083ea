"""The level of the liquid in a pool, which splashes do not affect."""
from collections.abc import Iterable, Sequence

import numpy as np
from pysph.base.particle_array import ParticleArray

from pysph_boiling.files import load_output

__all__ = ["level_history", "surface_level"]

SHARE = 0.98  # fraction of the fluid below the mark, so that a few flying drops do not move it


def surface_level(fluids: Sequence[ParticleArray], *, dim: int) -> float:
    """Height of the surface [m] above the floor at 0; the vertical is y in 2-D and z in 3-D.

    ``fluids`` are particle arrays. The result is the height below which 98 % of all particles lie, divided by 0.98.
    It is exact for a uniform pool and 0 for a dry vessel.
    """
    height = np.concatenate([np.asarray(pa.y if dim == 2 else pa.z, float) for pa in fluids])
    return float(np.quantile(height, SHARE)) / SHARE if len(height) else 0.0


def level_history(files: Iterable, *, dim: int) -> tuple[np.ndarray, np.ndarray]:
    """Time [s] and level [m], each (files,), from the particle ``files`` of a run whose fluid array is "fluid"."""
    rows = []
    for file in files:
        arrays, t = load_output(file)
        rows.append((t, surface_level([arrays["fluid"]], dim=dim)))
    t, level = np.array(rows).reshape(-1, 2).T
    return t, level

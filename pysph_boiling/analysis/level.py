"""The level of the liquid: how high a pool stands, whatever splashes."""
import numpy as np

from pysph_boiling.analysis.rendering import load_output

__all__ = ["level_history", "surface_level"]

SHARE = 0.98  # of the fluid lies below the mark; a few drops that fly do not move it


def surface_level(fluids, *, dim):
    """Height of the surface [m] above the floor at 0; the vertical is y in 2-D and z in 3-D.

    ``fluids`` are particle arrays. The mark below which 98 % of all particles lie, liquid and vapour, over 0.98: exact
    for an even pool, and for one that swells evenly; 0 in a dry vessel.
    """
    height = np.concatenate([np.asarray(pa.y if dim == 2 else pa.z, float) for pa in fluids])
    return float(np.quantile(height, SHARE)) / SHARE if len(height) else 0.0


def level_history(files, *, dim, name="fluid"):
    """Time [s] and level [m], shape (files,) each, of a run's particle ``files``, in which the fluid is ``name``."""
    rows = []
    for file in files:
        arrays, t = load_output(file)
        rows.append((t, surface_level([arrays[name]], dim=dim)))
    return tuple(np.array(rows).reshape(-1, 2).T)

"""The neighbour search for devices finds what a search on the host finds, in an order that does not change.

PySPH's configuration holds for a process, so each case runs in one of its own.
"""
import os
import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial import cKDTree


def arrays(dim, double):
    """Three clouds with two smoothing lengths, and one particle far away."""
    from compyle.config import get_config
    from pysph.base.utils import get_particle_array

    get_config().use_opencl, get_config().use_double = True, double
    random, made = np.random.default_rng(1), []
    for name, n, low, high, h in (("fluid", 900, 0.0, 1.0, 0.05), ("wall", 500, -0.2, 1.3, 0.07),
                                  ("sites", 5, 0.2, 0.5, 0.05)):
        place = random.uniform(low, high, (3, n)) * np.array([[1.0], [2.0], [float(dim == 3)]])
        made.append(get_particle_array(name=name, backend="opencl", **dict(zip("xyz", place)), h=h, m=1.0))
    made[0].x[3] = 1e4
    made[0].gpu.push("x")
    return made


def found(search, d, s):
    """The list of each particle of array ``d`` among those of array ``s``, sorted, and all lists as they are."""
    begin, count, every = (one.get() for one in search.lists(d, s))
    rows = [every[b:b + n] for b, n in zip(begin, count)]
    return [sorted(row) for row in rows], np.concatenate([*rows, np.zeros(0, np.uint32)])


def assert_complete(search, particles):
    """All lists hold the particles within the larger of both supports, and nothing else."""
    total = 0
    places = [np.stack([pa.gpu.get_device_array(axis).get() for axis in "xyz"], -1).astype(float) for pa in particles]
    for d, s in np.ndindex(3, 3):
        reach = 2.0 * max(float(pa.gpu.h.get().max()) for pa in (particles[d], particles[s]))
        want = cKDTree(places[s]).query_ball_point(places[d], reach, return_sorted=True).tolist()
        assert found(search, d, s)[0] == want, (d, s)
        total += sum(map(len, want))
    return total


def complete(dim, double):
    from pysph_boiling.search import device_cell_nnps

    particles = arrays(dim, double)
    search = device_cell_nnps()(dim=dim, particles=particles, radius_scale=2.0)
    few = assert_complete(search, particles)
    order = found(search, 0, 0)[1]
    search.update()
    assert np.array_equal(order, found(search, 0, 0)[1])  # whichever particle comes first into a cell
    for axis in "xyz":  # closer, so that the room of cells and lists does not suffice
        for pa in particles:
            pa.gpu.get_device_array(axis).dev[:] *= 0.5
    search.update()
    assert assert_complete(search, particles) > 2 * few
    search.spatially_order_particles(0)
    search.update()
    assert_complete(search, particles)
    cells = np.floor(particles[0].gpu.y.get() * search.lattice[0])
    assert np.mean(np.abs(np.diff(cells)) <= 1.0) > 0.8, "neighbours in memory are not in neighbouring cells"
    particles[0].remove_particles(np.arange(100, dtype=np.int32))
    search.update()
    assert len(found(search, 0, 1)[0]) == 800
    assert_complete(search, particles)
    print("all complete")


@pytest.mark.parametrize("double", [True, False], ids=["double", "single"])
@pytest.mark.parametrize("dim", [2, 3])
def test_lists_are_complete(dim, double):
    done = subprocess.run([sys.executable, "-c", f"import test_device_cells as t; t.complete({dim}, {double})"],
                          cwd=os.path.dirname(__file__), env={"PYOPENCL_CTX": "0", **os.environ}, capture_output=True,
                          text=True, check=False)
    assert "all complete" in done.stdout, done.stdout + done.stderr[-2000:]

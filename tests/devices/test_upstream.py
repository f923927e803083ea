"""What PySPH 1.0b2 lacks on devices (docs/backends.md): a test that fails says that a workaround can go.

Each function shows one limit and returns whether it is still there. They run in processes of their own, as PySPH's
configuration holds for a process.
"""
import inspect
import os
import subprocess
import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np
import pytest


def array(n=6, single=False, **properties):
    """A particle array on an OpenCL device."""
    from compyle.config import get_config
    from pysph.base.utils import get_particle_array

    get_config().use_opencl, get_config().use_double = True, not single
    return get_particle_array(name="fluid", backend="opencl", x=np.arange(n, dtype=float), h=1.0, m=1.0, **properties)


def search(*arrays, **options):
    from pysph.base.gpu_nnps import ZOrderGPUNNPS

    return ZOrderGPUNNPS(dim=1, particles=list(arrays), radius_scale=1.5, backend="opencl", **options)


def edits_on_the_host_stay_there():
    pa = array()
    pa.x[:] = 9.0
    return not np.any(pa.gpu.x.get() == 9.0)


def a_property_hides_a_method():
    pa = array()
    pa.add_property("push")
    return not callable(pa.gpu.push)


def all_arrays_are_reordered():
    """Also those whose particles others know by their place."""
    from pysph.solver.solver import Solver

    fluid, sites = array(8), array(4)
    sites.x[:] = [3.0, 0.0, 2.0, 1.0]
    sites.gpu.push("x")
    solver = type("", (), dict(particles=[fluid, sites], nnps=search(fluid, sites)))()
    Solver.reorder_particles(solver)
    return sites.gpu.x.get().tolist() == [0.0, 1.0, 2.0, 3.0]


def an_order_brings_back_what_has_left():
    """It is by the indices of the last search."""
    pa = array(8)
    nnps = search(pa)
    pa.remove_particles(np.arange(4, dtype=np.int32))
    nnps.spatially_order_particles(0)
    return pa.get_number_of_particles() == 8


def files_hold_rounded_constants():
    from pysph.solver.output import dump, load

    with tempfile.TemporaryDirectory() as folder:
        file = str(Path(folder) / "one.hdf5")
        dump(file, [array(single=True, constants={"c": 0.1})], {}, detailed_output=True)
        return float(load(file)["arrays"]["fluid"].constants["c"].get_npy_array()[0]) != 0.1


def ghosts_count_as_real():
    pa = array()
    pa.tag[5] = 1
    pa.gpu.push("tag")
    pa.align_particles()
    return pa.get_number_of_particles(True) == 6


def lists_are_made_when_first_used():
    from compyle.api import wrap
    from cyarray.api import UIntArray

    pa = array()
    nnps = search(pa)
    nnps.update()
    pa.gpu.x.dev[:] = 100.0 * wrap(np.arange(6.0), backend="opencl").dev  # none is another's neighbour any more
    found = UIntArray()
    nnps.set_context(0, 0)
    nnps.get_nearest_particles(0, 0, 2, found)
    return found.length == 1


def neighbours_come_in_the_order_of_a_race():
    """An atomic counter gives each particle its place in its cell."""
    from pysph.base.z_order_gpu_nnps_kernels import count_cells

    return "atomic_inc" in inspect.getsource(count_cells)


def memory_grows_with_the_longest_way():
    pa = array(2)
    pa.x[:] = [0.0, 1e5]
    pa.gpu.push("x")
    try:
        search(pa)
    except Exception as error:
        return "BUFFER_SIZE" in str(error) or "MEM" in str(error)
    return False


def numpy_2_4_is_refused():
    """What warns up to 2.3: an array of one entry taken for a number."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        array().align_particles()
    return any("ndim > 0" in str(warning.message) for warning in caught)


def range_of_an_attribute_does_not_translate():
    from compyle.translator import OpenCLConverter

    class Sweeps:
        def __init__(self):
            self.n = 3

        def loop(self, d_idx, d_x):
            for _ in range(self.n):
                d_x[d_idx] += 1.0

    try:
        OpenCLConverter().parse_instance(Sweeps())
    except Exception:
        return True
    return False


def integrator_has_no_time_before_its_first_step():
    from pysph.sph.integrator_gpu_helper import GPUIntegrator

    return "self.t =" not in inspect.getsource(GPUIntegrator.__init__)


def cuda_integrator_leaves_out_an_argument():
    from pysph.sph.integrator_gpu_helper import CUDAIntegrator

    return "NP_MAX" not in inspect.getsource(CUDAIntegrator)


LIMITS = [value for name, value in list(globals().items())
          if inspect.isfunction(value) and value.__module__ == __name__ and name not in ("array", "search")]


@pytest.mark.parametrize("limit", LIMITS, ids=lambda limit: limit.__name__)
def test_limit_is_still_there(limit):
    done = subprocess.run(
        [sys.executable, "-c", f"import test_upstream; print('still there:', test_upstream.{limit.__name__}())"],
        cwd=Path(__file__).parent, env={"PYOPENCL_CTX": "0", **os.environ}, capture_output=True, text=True, check=False)
    assert "still there: True" in done.stdout, done.stdout + done.stderr[-2000:]

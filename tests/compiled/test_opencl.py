"""The motion kernels build on OpenCL and agree with Cython. Runs where pyopencl and a driver are installed."""
import os
import subprocess
import sys

import numpy as np
import pytest
from pysph.solver.utils import load

STEPS = 10


def last_state(folder, *backend):
    """Positions and velocities by uid after a few steps of a small dam break on one backend."""
    subprocess.run(
        [sys.executable, "-m", "pysph_boiling", "run", "dam_break", "--spacing", "0.05", "--max-steps", str(STEPS),
         "--no-pictures", "-d", str(folder), *backend],
        check=True, capture_output=True, env={"PYOPENCL_CTX": "0", **os.environ})
    fluid = load(str(folder / f"dam_break_{STEPS:05d}.hdf5"))["arrays"]["fluid"]
    order = np.argsort(fluid.uid)
    return np.stack([fluid.get(name)[order] for name in ("x", "y", "u", "v")])


def test_motion_on_opencl_agrees_with_cython(tmp_path):
    pytest.importorskip("pyopencl", reason="the extra 'opencl' is not installed")
    host = last_state(tmp_path / "cython", "--no-openmp")
    device = last_state(tmp_path / "opencl", "--opencl", "--use-double")
    assert np.max(np.abs(host[2:])) > 0.1, "nothing moved"
    # round-off in another order of summation, grown over ten steps; measured 1e-14
    np.testing.assert_allclose(device, host, rtol=0.0, atol=1e-10)

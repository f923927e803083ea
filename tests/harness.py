"""What compiled tests share: one way to compile equations, one way to compile a scheme, and the list of sets.

Compiling is what costs time here (about 20 s a module, cold), so everything compiled is made once a session, and a
scheme's stages are compiled side by side. Dimension, sizes and parameters are run-time values: 2-D and 3-D share a
module, as do all values of a parameter.
"""
import os

import numpy as np
import pytest
from compyle.config import get_config
from pysph.base.kernels import CubicSpline
from pysph.sph.acceleration_eval import AccelerationEval
from pysph.sph.equation import Group
from pysph.sph.sph_compiler import SPHCompiler

from pysph_boiling import native
from pysph_boiling.device import Mirrored, detached, neighbour_search
from pysph_boiling.runs import stepper
from pysph_boiling.schemes.solver import vectorised

__all__ = [
    "BACKEND", "OPTIONS", "Evaluator", "Stepper", "assert_repeated", "host_only", "native_only", "one_group_each",
    "random_cloud", "record", "use_backend", "vectors",
]

BACKEND = os.environ.get("PYSPH_BOILING_BACKEND", "openmp")  # that compiled tests run on: `make parity`
OPTIONS = {  # of the command line
    "cython": ("--no-openmp",), "openmp": ("--openmp",), "opencl": ("--opencl", "--use-double", "--results-every", "1"),
}.get(BACKEND)
host_only = pytest.mark.skipif(BACKEND == "opencl", reason="what it does by hand is the host's alone")
native_only = pytest.mark.skipif(not native.serves(), reason="the sums in C need GCC or Clang, and AVX2")


def use_backend():
    """Compiled tests run on OpenMP, as users do, if nothing else is asked for; on a device in double precision."""
    if BACKEND not in ("cython", "openmp", "opencl"):
        raise ValueError(f"PYSPH_BOILING_BACKEND must be cython, openmp or opencl, got {BACKEND!r}")
    config = get_config()
    config.use_openmp = stepper.Stepper.openmp = BACKEND == "openmp"
    config.use_opencl = config.use_double = BACKEND == "opencl"


use_backend()  # before the first particle array is made


def on_the_host_if_periodic(domain):
    """Skip what needs ghosts: on a device the solver refuses periodic domains (``StagedSolver.setup``)."""
    if domain is not None and BACKEND == "opencl":
        pytest.skip("a periodic domain is the host's alone")


class Stepper(stepper.Stepper):
    """Steps a scheme by hand, on the backend that is tested."""

    def __init__(self, scheme, arrays, *, domain=None, **options):
        on_the_host_if_periodic(domain)
        super().__init__(scheme, arrays, domain=domain, **options)


def record(stepper):
    """Names of the stages of a stepper as they run from now on."""
    calls = []
    for name, index in stepper.solver.integrator.stages.items():
        evaluation = stepper.solver.integrator.acceleration_evals[index]
        evaluation.compute = lambda t, dt, name=name, compute=evaluation.compute: (calls.append(name), compute(t, dt))
    return calls


class Evaluator:
    """Equations compiled on particle arrays; ``run(t, dt)`` evaluates them once on fresh neighbour lists."""

    def __init__(self, arrays, groups, *, dim, kernel=None, domain=None):
        on_the_host_if_periodic(domain)
        use_backend()
        self.arrays, self.kernel = arrays, kernel or CubicSpline(dim=dim)
        self.evaluation = AccelerationEval(arrays, groups, self.kernel)
        with vectorised():
            SPHCompiler(self.evaluation, None).compile()
        self.nnps = neighbour_search(arrays, dim=dim, radius_scale=self.kernel.radius_scale, domain=domain)
        self.evaluation.set_nnps(self.nnps)
        if BACKEND == "opencl":
            pairs = detached(arrays)
            self.nnps, self.evaluation = (
                Mirrored(target, pairs) for target in (self.nnps, self.evaluation))

    def run(self, t=0.0, dt=1.0):
        self.nnps.update_domain()
        self.nnps.update()
        self.evaluation.compute(t, dt)


def one_group_each(equations):
    """Groups of one equation each, named, so that the generated source does not depend on what ran before."""
    return [Group([equation], name=f"g{number}") for number, equation in enumerate(equations)]


def assert_repeated(again, first, *, roundoff, name=""):
    """A run made twice has the same bits; on a device, where lists of neighbours come in the order of a race, they
    differ by at most ``roundoff``.
    """
    np.testing.assert_allclose(again, first, rtol=0.0, atol=roundoff if BACKEND == "opencl" else 0.0, err_msg=name)


def random_cloud(n, dim, *, seed=0, box=1.0):
    """Positions (n, 3) drawn uniformly from a cube of edge ``box`` [m]; in 2-D in the plane."""
    points = np.zeros((n, 3))
    points[:, :dim] = np.random.default_rng(seed).uniform(0.0, box, (n, dim))
    return points


def vectors(pa, x="x", y="y", z="z"):
    """Three properties as an array (n, 3)."""
    return np.stack([pa.get(name) for name in (x, y, z)], -1)

"""What compiled tests share: one way to compile equations, one way to compile a scheme, and the list of sets.

Compiling is what costs time here (about 20 s a module, cold), so everything compiled is made once a session, and a
scheme's stages are compiled side by side. Dimension, sizes and parameters are run-time values: 2-D and 3-D share a
module, as do all values of a parameter.
"""
import numpy as np
from compyle.config import get_config
from pysph.base.kernels import CubicSpline
from pysph.base.nnps import LinkedListNNPS
from pysph.sph.acceleration_eval import AccelerationEval
from pysph.sph.equation import Group
from pysph.sph.sph_compiler import SPHCompiler

from pysph_boiling.problems.stepper import Stepper
from pysph_boiling.schemes.solver import vectorised

__all__ = ["Evaluator", "Stepper", "one_group_each", "random_cloud", "use_openmp"]


def use_openmp():
    """All compiled tests run on OpenMP, as users do."""
    get_config().use_openmp = True


class Evaluator:
    """Equations compiled on particle arrays; ``run(t, dt)`` evaluates them once on fresh neighbour lists."""

    def __init__(self, arrays, groups, *, dim, kernel=None, domain=None):
        use_openmp()
        self.arrays, self.kernel = arrays, kernel or CubicSpline(dim=dim)
        self.evaluation = AccelerationEval(arrays, groups, self.kernel)
        with vectorised():
            SPHCompiler(self.evaluation, None).compile()
        self.nnps = LinkedListNNPS(dim=dim, particles=arrays, radius_scale=self.kernel.radius_scale, cache=True,
                                   domain=domain)
        self.evaluation.set_nnps(self.nnps)

    def run(self, t=0.0, dt=1.0):
        self.nnps.update_domain()
        self.nnps.update()
        self.evaluation.compute(t, dt)


def one_group_each(equations):
    """Groups of one equation each, named, so that the generated source does not depend on what ran before."""
    return [Group([equation], name=f"g{number}") for number, equation in enumerate(equations)]


def random_cloud(n, dim, *, seed=0, box=1.0):
    """Positions (n, 3) drawn uniformly from a cube of edge ``box`` [m]; in 2-D in the plane."""
    points = np.zeros((n, 3))
    points[:, :dim] = np.random.default_rng(seed).uniform(0.0, box, (n, dim))
    return points

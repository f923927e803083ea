"""A PySPH solver that compiles its stages side by side.

PySPH builds one module per stage, one after the other, about 20 s each on a cold cache. Here each is built in a child
process first; PySPH then finds all of them in its own cache.
"""
import multiprocessing
import multiprocessing.connection
import os

from pysph.solver.solver import Solver
from pysph.sph.acceleration_eval import make_acceleration_evals
from pysph.sph.sph_compiler import SPHCompiler

__all__ = ["StagedSolver", "build_side_by_side"]


def build_side_by_side(arrays, equations, kernel, integrator, jobs=None):
    """Fill PySPH's cache of compiled modules for these equations, ``jobs`` at a time (all cores if not given).

    A failed build is not reported here: PySPH builds again, in the process that can raise the error.
    """
    compiler = SPHCompiler(make_acceleration_evals(arrays, equations, kernel), integrator)
    if compiler.backend != "cython" or "fork" not in multiprocessing.get_all_start_methods():
        return
    helpers = compiler.acceleration_eval_helpers
    sources = [compiler._get_code(), *(helper.get_code() for helper in helpers[1:])]
    context = multiprocessing.get_context("fork")
    waiting = [context.Process(target=helper.compile, args=(source,)) for helper, source in zip(helpers, sources)]
    running = []
    while waiting or running:
        while waiting and len(running) < (jobs or os.cpu_count() or 1):
            running.append(waiting.pop())
            running[-1].start()
        multiprocessing.connection.wait([process.sentinel for process in running])
        running = [process for process in running if process.is_alive()]


class StagedSolver(Solver):
    """PySPH's solver with its modules built side by side; ``before_output`` is called before each particle file."""

    before_output = None

    def dump_output(self):
        if self.before_output is not None:
            self.before_output()
        super().dump_output()

    def setup(self, particles, equations, nnps, kernel=None, fixed_h=False):
        if not self.in_parallel:
            build_side_by_side(particles, equations, kernel or self.kernel, self.integrator)
        super().setup(particles, equations, nnps, kernel, fixed_h)

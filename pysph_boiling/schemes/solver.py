"""A PySPH solver that compiles its stages side by side, for the vector unit of the processor.

PySPH builds one module per stage, one after the other, about 20 s each on a cold cache. Here each is built in a child
process first; PySPH then finds all of them in its own cache.
"""
import functools
import io
import multiprocessing
import multiprocessing.connection
import os
import platform
import shlex
import subprocess
import sysconfig
import zlib
from contextlib import contextmanager
from pathlib import Path

from compyle.ext_module import CONFIG_OPTS, get_openmp_flags
from Cython.Compiler.Options import get_directive_defaults
from pysph.solver.output import HDFOutput
from pysph.solver.solver import Solver
from pysph.sph.acceleration_eval import make_acceleration_evals
from pysph.sph.sph_compiler import SPHCompiler

from pysph_boiling.schemes import ranks

__all__ = ["StagedSolver", "build_side_by_side", "vector_flags", "vector_tag", "vectorised"]

# Sums may be reordered, which a vectorised sum over the neighbours needs; NaN and Inf keep their meaning. -O2 without
# debugging symbols compiles in half the time of -O3 with them, and vectorises the same sums.
REORDER = ("-O2", "-g0", "-ftree-vectorize", "-fvect-cost-model=dynamic", "-fno-math-errno", "-fno-trapping-math",
           "-fno-signed-zeros", "-fassociative-math")
AVX2 = "-march=x86-64-v3"  # not "native": every processor with AVX2 then computes the same to the last bit
AVX2_NEEDS = {"avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"}


@functools.cache
def vector_flags():
    """Compiler flags that vectorise the sums over the neighbours: none where the compiler does not know them.

    Empty too if the user's ``~/.compyle/config.py`` names OpenMP flags, which then are used as they stand.
    """
    compiler = shlex.split(sysconfig.get_config_var("CC") or "cc")

    def accepted(flags):
        test = [*compiler, *flags, "-E", "-x", "c", os.devnull]
        return subprocess.run(test, capture_output=True, check=False).returncode == 0

    if "OMP_CFLAGS" in CONFIG_OPTS or platform.system() == "Windows" or not accepted(REORDER):
        return ()
    processor = Path("/proc/cpuinfo")
    has = set(processor.read_text().split()) if processor.exists() else set()
    return (*REORDER, AVX2) if has >= AVX2_NEEDS and accepted([AVX2]) else REORDER


def vector_tag():
    """Ends the names of groups, so that PySPH's cache tells modules apart that differ in their flags alone."""
    flags = vector_flags()
    return f"_{zlib.crc32(' '.join(flags).encode()):08x}" if flags else ""


@contextmanager
def vectorised():
    """PySPH compiles with :func:`vector_flags` inside this block, and without the code that would pickle a kernel.

    Its cache knows a module by its source alone: sources must say which flags they are for, by :func:`vector_tag`.
    """
    flags, directives = vector_flags(), get_directive_defaults()
    before = directives["auto_pickle"]
    directives["auto_pickle"] = False  # a quarter of the compiler's work
    if flags:
        compile_flags, link_flags = get_openmp_flags()
        CONFIG_OPTS.update(OMP_CFLAGS=[*compile_flags, *flags], OMP_LINK=link_flags)
    try:
        yield
    finally:
        directives["auto_pickle"] = before
        if flags:
            del CONFIG_OPTS["OMP_CFLAGS"], CONFIG_OPTS["OMP_LINK"]


def build_side_by_side(arrays, equations, kernel, integrator, jobs=None, mode="serial"):
    """Fill PySPH's cache of compiled modules for these equations, ``jobs`` at a time (all cores if not given).

    ``mode`` is "mpi" where sums go over several ranks.

    A failed build is not reported here: PySPH builds again, in the process that can raise the error.
    """
    compiler = SPHCompiler(make_acceleration_evals(arrays, equations, kernel, mode), integrator)
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
    """PySPH's solver with its modules built side by side.

    ``before_output`` is called before each particle file; ``reach`` is how far neighbour lists reach, in supports.
    """

    before_output = None
    reach = 1.0

    def dump_output(self):
        """Write a particle file of PySPH's, whole or not at all: made in memory, written aside, renamed.

        Errors: ``OSError`` that names the file where it cannot be written. HDF5 itself would crash on a full disk.
        """
        if self.before_output is not None:
            self.before_output()
        if self.disable_output:
            return
        path = Path(self.output_directory) / f"{self.fname}_{self.count:05d}.hdf5"
        part, memory = path.with_suffix(".part"), io.BytesIO()
        comm = self.comm if self.in_parallel else None  # with ranks, the first gathers and writes
        HDFOutput(self.detailed_output, self.output_only_real, comm, self.compress_output).dump(
            memory, self.particles, self._get_solver_data())
        if ranks.rank() > 0:
            return
        try:
            part.write_bytes(memory.getbuffer())
            os.replace(part, path)
        except OSError as error:
            part.unlink(missing_ok=True)
            raise OSError(f"{path} cannot be written: {error.strerror}; earlier output is as it was") from error

    def setup(self, particles, equations, nnps, kernel=None, fixed_h=False):
        if self.in_parallel and nnps.domain.manager.is_periodic:
            raise ValueError("a periodic domain needs one rank: PySPH makes no periodic ghosts on several")
        if self.reach > 1.0:
            if nnps.domain.manager.is_periodic or self.in_parallel or any(pa.gpu is not None for pa in particles):
                raise ValueError("density.skin > 0 needs the CPU, one rank, and a domain that is not periodic")
            nnps.radius_scale *= self.reach
            nnps.domain.set_radius_scale(nnps.radius_scale)
        with vectorised():
            if ranks.rank() == 0:
                build_side_by_side(particles, equations, kernel or self.kernel, self.integrator,
                                   mode="mpi" if self.in_parallel else "serial")
            ranks.wait()
            super().setup(particles, equations, nnps, kernel, fixed_h)

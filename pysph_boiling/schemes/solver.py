"""A PySPH solver that compiles its stages in parallel, with vector instructions, and shares them between scenes.

PySPH builds one module per stage, one after the other, which takes about 20 s each. Here child processes build them
first, and PySPH then finds all of them in its cache. A module only declares the properties that it uses, so that scenes
which differ in others share it.
"""
import functools
import multiprocessing
import multiprocessing.connection
import os
import platform
import re
import shlex
import subprocess
import sysconfig
import time
import zlib
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from compyle.ext_module import CONFIG_OPTS
from Cython.Compiler.Options import get_directive_defaults
from pysph.solver.solver import Solver
from pysph.sph import acceleration_eval_cython_helper
from pysph.sph.acceleration_eval import make_acceleration_evals
from pysph.sph.sph_compiler import SPHCompiler

from pysph_boiling.device import on_host, order, send
from pysph_boiling.equations.lean import HostSum
from pysph_boiling.files import part_of, whole
from pysph_boiling.native import fluid_sums, has_avx2
from pysph_boiling.parallel import ranks
from pysph_boiling.schemes.cache import CheckedModule, load_as
from pysph_boiling.schemes.device_stages import on_devices
from pysph_boiling.schemes.particle_files import ParticleFiles, join_parts
from pysph_boiling.schemes.reductions import CompiledReductions
from pysph_boiling.threads import end_on_interrupt

__all__ = ["StagedSolver", "build_side_by_side", "edited", "step_few_alone", "strip_unused_declarations",
           "vector_flags", "vector_tag", "vectorised"]

NEVER = (-1.0,)  # step at which particles were sorted last
FEW = 100_000  # particles, whose prediction takes one thread less time than others take to wake up

# Vectorised sums over neighbours need reordering, which these flags allow; NaN and Inf keep their meaning. -O2 without
# debugging symbols compiles in half the time of -O3 with them, and vectorises the same sums.
REORDER = ("-O2", "-g0", "-ftree-vectorize", "-fvect-cost-model=dynamic", "-fno-math-errno", "-fno-trapping-math",
           "-fno-signed-zeros", "-fassociative-math")
AVX2 = "-march=x86-64-v3"  # not "native", so that all processors with AVX2 give equal results to the last bit


@functools.cache
def vector_flags():
    """Compiler flags that vectorise the sums over neighbours, if the compiler supports them.

    Empty also if the user's ``~/.compyle/config.py`` sets OpenMP flags, which are then used as they are.
    """
    compiler = shlex.split(sysconfig.get_config_var("CC") or "cc")

    def accepted(flags):
        test = [*compiler, *flags, "-E", "-x", "c", os.devnull]
        return subprocess.run(test, capture_output=True, check=False).returncode == 0

    if "OMP_CFLAGS" in CONFIG_OPTS or platform.system() == "Windows" or not accepted(REORDER):
        return ()
    return (*REORDER, AVX2) if has_avx2() and accepted([AVX2]) else REORDER


def vector_tag():
    """Suffix for names of groups, so that PySPH's cache distinguishes modules that only differ in compiler flags."""
    flags = vector_flags()
    return f"_{zlib.crc32(' '.join(flags).encode()):08x}" if flags else ""


def strip_unused_declarations(source):
    """The source of a PySPH module whose wrapper of particle arrays only declares the properties that it uses.

    PySPH declares all properties and constants, so that scenes with different effects could not share a module. Others
    become Python attributes, which only the host reads. For the same reason the number that PySPH gives a group of
    host code, one more for each group of the process, does not stay.
    """
    source = re.sub(r"AccelerationEval\.Group_\d+\.py_initialize", "AccelerationEval.py_initialize", source)
    used = set(re.findall(r"\b(?:dst|src)\.(\w+)\.data", source)) | set(re.findall(r"self\.\w+\.(\w+)\[0\]", source))

    def declared(line):
        names = [name for name in line[2].split(", ") if name in used]
        return f"    cdef public {line[1]} {', '.join(names)}\n" if names else ""

    head, begin, rest = source.partition("cdef class ParticleArrayWrapper:\n")
    wrapper, end, tail = rest.partition("    cdef public str name\n")
    if not end:
        raise RuntimeError("the wrapper of particle arrays that PySPH generates is not the one that this version of "
                           "pysph_boiling supports")
    wrapper = re.sub(r"    cdef public ((?!Particle)\w+Array) (.*)\n", declared, wrapper)
    return f"{head}{begin}    cdef dict __dict__\n{wrapper}{end}{tail}"


def step_few_alone(source):
    """The source of a PySPH module whose integrator takes ``FEW`` particles with one thread."""
    return source.replace("prange(0, NP_DEST, 1, ", f"prange(0, NP_DEST, 1, use_threads_if=NP_DEST > {FEW}, ")


def edited(source):
    """The source of a PySPH module as it is compiled here."""
    return step_few_alone(strip_unused_declarations(source))


class StrippedHelper(acceleration_eval_cython_helper.AccelerationEvalCythonHelper):
    """PySPH's generator of a module, with :func:`edited`."""

    def compile(self, code):
        return super().compile(edited(code))


class VectorModule(CheckedModule):
    """A module compiled with :func:`vector_flags`, with or without OpenMP."""

    def _get_extra_args(self):
        compile_flags, link_flags = super()._get_extra_args()
        return [*vector_flags(), *compile_flags], link_flags


@contextmanager
def vectorised():
    """Inside this block PySPH compiles with :func:`vector_flags`, and without code that a module does not need.

    The latter is unused declarations (:func:`strip_unused_declarations`) and code to pickle kernels. PySPH's cache
    identifies a module by its source, so sources must contain the :func:`vector_tag` of their flags.
    """
    directives, plain = get_directive_defaults(), StrippedHelper.__base__
    before = directives["auto_pickle"]
    directives["auto_pickle"] = False  # a quarter of the compiler's work
    acceleration_eval_cython_helper.AccelerationEvalCythonHelper = StrippedHelper
    try:
        with load_as(VectorModule), on_devices():
            yield
    finally:
        directives["auto_pickle"] = before
        acceleration_eval_cython_helper.AccelerationEvalCythonHelper = plain


def has_host_sums(equations):
    """Whether among the equations of a solver, in PySPH's groups and stages, are sums that run on the host."""
    if isinstance(equations, HostSum):
        return True
    parts = next((getattr(equations, name) for name in ("groups", "equations") if hasattr(equations, name)), equations)
    return isinstance(parts, list | tuple) and any(map(has_host_sums, parts))


def build_side_by_side(arrays, equations, kernel, integrator, stages, mode="serial", say=CheckedModule.say):
    """Fill PySPH's cache of compiled modules for these equations, one on each core at a time.

    ``stages`` are their names. ``mode`` is "mpi" if the run has several ranks. ``say`` is called with a sentence before
    and after compiling.

    A failed build is not reported here, because PySPH builds again in this process and raises the error.
    Errors: ``OSError`` if the cache cannot be written to.
    """
    compiler = SPHCompiler(make_acceleration_evals(arrays, equations, kernel, mode), integrator)
    if compiler.backend != "cython" or "fork" not in multiprocessing.get_all_start_methods():
        return
    helpers = compiler.acceleration_eval_helpers
    sources = [compiler._get_code(), *(helper.get_code() for helper in helpers[1:])]
    names = list(stages) or [f"stage {number}" for number in range(len(sources))]
    modules = [VectorModule.of(edited(source)) for source in sources]
    missing = [number for number, module in enumerate(modules) if not module.whole()]
    if not missing:
        return
    modules[missing[0]].check_writable()
    jobs = min(os.cpu_count() or 1, len(missing))
    say(f"compiling {len(missing)} of {len(sources)} stages of the time step ({', '.join(names[k] for k in missing)}), "
        f"{jobs} at a time; each takes 20 to 60 s, and later runs reuse it")
    context, start = multiprocessing.get_context("fork"), time.perf_counter()
    waiting = [context.Process(target=build, args=(helpers[k], sources[k]), name=names[k]) for k in missing]
    running = []
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                running.append(waiting.pop(0))
                running[-1].start()
            multiprocessing.connection.wait([process.sentinel for process in running])
            for process in [process for process in running if not process.is_alive()]:
                running.remove(process)
                done = "failed" if process.exitcode else "done"
                say(f"  {process.name}: {done} after {time.perf_counter() - start:.0f} s")
    finally:
        for process in running:
            process.terminate()


def write_anywhere(path, write):
    """Write a file by ``write(temporary path)``, or none if ``path`` is ``None``; if one rank fails, all raise.

    Errors: ``OSError`` that names the file.
    """
    problem = None
    try:
        if path is not None:
            with whole(path) as part:
                write(part)
    except OSError as error:
        problem = f"{path} cannot be written: {error.strerror}; earlier output is unchanged"
    problem = ranks.first_given(problem)
    if problem:
        raise OSError(problem)


def build(helper, source):
    """Compile one module in a child process, which Ctrl-C ends silently."""
    end_on_interrupt()
    VectorModule.announces = False
    helper.compile(source)


class StagedSolver(Solver):
    """PySPH's solver, whose modules are built in parallel.

    ``before_output`` is called before each particle file, and ``on_domain`` once with the periodic domain and the
    particles. ``reach`` is the range of neighbour lists in supports. ``say`` is called with messages on compiling.
    ``scratch`` maps names of arrays to the properties that every step writes before it reads them.
    """

    before_output = on_domain = writer = None
    scratch = {}
    say = CheckedModule.say
    reach = 1.0

    def dump_output(self):
        """Write a particle file of PySPH completely or not at all: in memory first, then to a temporary file.

        On several ranks each writes a file of its own particles, and the first one a file that joins them.

        Errors: ``OSError`` on all ranks that names the file if it cannot be written on one of them. HDF5 itself would
        crash on a full disk.
        """
        if self.before_output is not None:
            self.before_output()
        with on_host(self.particles):
            self._dump()

    def _dump(self):
        if self.disable_output:
            return
        path = Path(self.output_directory) / f"{self.fname}_{self.count:05d}.hdf5"
        writer = self.writer = self.writer or ParticleFiles()
        writer.detailed_output, writer.only_real = self.detailed_output, self.output_only_real
        writer.compress = self.compress_output
        writer.dump(None, self.particles, self._get_solver_data())
        parts = [part_of(path, rank) for rank in range(ranks.size())] if self.in_parallel else [path]

        def write_own(file):
            with open(file, "wb") as opened:
                opened.writelines(writer.pieces)

        write_anywhere(parts[ranks.rank()], write_own)
        if self.in_parallel:
            arrays = sorted(self.particles, key=lambda pa: pa.name)
            lengths, _ = ranks.gather(np.array([[pa.get_number_of_particles(True) for pa in arrays]]))
            write_anywhere(path if ranks.rank() == 0 else None, lambda file: join_parts(file, parts, lengths))

    def reorder_particles(self):
        """Sort the particles in memory: fluids at steps when it is due, arrays that do not move once per run.

        PySPH also calls this at every start, when a resumed run may have sorted already. On a device only fluids are
        sorted, and on several ranks no arrays, since particles change ranks.
        """
        fluids = self.integrator.arrays
        due = [pa for pa in fluids if self.count % self.reorder_freq == 0 and self.ordered(pa) != self.count]
        due += [pa for pa in self.particles if not any(pa is fluid for fluid in fluids) and pa.gpu is None
                and self.ordered(pa) == NEVER[0]]
        if not due or self.in_parallel:
            return
        order(self.nnps, due, None if self.detailed_output else self.scratch)  # a last file may follow
        for pa in due:
            if "ordered" not in pa.constants:
                pa.add_constant("ordered", NEVER)
            pa.constants["ordered"].get_npy_array()[0] = self.count  # stored in the particle files
        self.integrator.forget_lists()

    @staticmethod
    def ordered(pa):
        """The step at which an array was sorted last."""
        return pa.constants.get("ordered", NEVER)[0]

    def setup(self, particles, equations, nnps, kernel=None, fixed_h=False):
        if nnps.domain.manager.is_periodic and any(pa.gpu is not None for pa in particles) and (
                set(getattr(self.integrator, "stages", ())) - {"heat"}):
            raise ValueError("on a device a periodic domain only works for conduction at rest, because PySPH treats "
                             "ghosts as particles there; leave out --opencl and --cuda")
        if self.in_parallel and nnps.domain.manager.is_periodic:
            raise ValueError("a periodic domain needs a single rank: PySPH makes no periodic ghosts on several ranks")
        if self.reach > 1.0:
            if nnps.domain.manager.is_periodic or self.in_parallel or any(pa.gpu is not None for pa in particles):
                raise ValueError("density.skin > 0 only works on the CPU, on one rank, and without a periodic domain")
            nnps.radius_scale *= self.reach
            nnps.domain.set_radius_scale(nnps.radius_scale)
        if nnps.domain.manager.is_periodic and self.on_domain is not None:
            self.on_domain(nnps.domain, particles)
        send(particles)
        with vectorised():
            if ranks.rank() == 0:
                if has_host_sums(equations):
                    fluid_sums(self.say)
                build_side_by_side(particles, equations, kernel or self.kernel, self.integrator,
                                   getattr(self.integrator, "stages", ()),
                                   mode="mpi" if self.in_parallel else "serial", say=self.say)
            ranks.wait()
            super().setup(particles, equations, nnps, kernel, fixed_h)
        if has_host_sums(equations):
            self.integrator.reductions = CompiledReductions()

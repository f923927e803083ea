"""The class SortedCellNNPS, which is compiled when it is first used, like PySPH's own modules."""
import functools
import os
import shlex
import subprocess
import sysconfig
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from typing import Any

import cyarray
import pysph
from compyle.config import get_config

from pysph_boiling.search.checked_module import CheckedModule

__all__ = ["EmbeddedModule", "SearchModule", "device_cell_nnps", "search_for", "sorted_cell_nnps"]

HERE = Path(__file__).parent
EXACT = ("-ffp-contract=off",)  # round products and sums separately, as in PySPH's own search
HEAD = "# cython: language_level=3, boundscheck=False, wraparound=False, cdivision=True\n"


class EmbeddedModule(CheckedModule):
    """A compiled module whose loops are in C++ headers; :meth:`CheckedModule.load` compiles it if it must.

    ``pyx`` is its source in Cython, ``headers`` are those that it needs, in their order; it takes the last one in by a
    line ``cdef extern from "NAME" nogil:``.
    """

    pyx = headers = None  # paths
    modules = {}  # (class, with OpenMP) -> what was loaded

    @staticmethod
    def flags():
        """Flags that it is compiled with besides PySPH's."""
        return ()

    @classmethod
    def make(cls):
        """The module for PySPH's present configuration; nothing is compiled.

        The cache identifies a module by its source, so the source begins with the compiler, flags and versions.
        """
        flags = cls.flags()
        versions = [f"{name} {metadata.version(name)}" for name in ("pysph", "cyarray", "compyle", "cython", "numpy")]
        used = [*versions, compiler(), *flags, "OpenMP" if get_config().use_openmp else "one thread"]
        folders = [str(Path(package.__file__).parent.parent) for package in (pysph, cyarray)]
        return cls.of(f"{HEAD}# {', '.join(used)}\n{cls.source()}", extra_compile_args=list(flags),
                      cython_inc_dirs=folders)

    @classmethod
    def loaded(cls, say=None):
        """The module with OpenMP if PySPH's configuration asks for it; compiled once, and loaded once in a process.

        ``say`` is called with a sentence before compiling; it is printed if not given.

        Errors: ``OSError`` if the module must be compiled and PySPH's cache cannot be written to.
        """
        key = cls, bool(get_config().use_openmp)
        if key not in cls.modules:
            module = cls.make()
            module.say = say or module.say
            cls.modules[key] = module.load()
        return cls.modules[key]

    @classmethod
    def source(cls):
        """The source of the module: Cython, with the headers in it."""
        lines = [line for path in cls.headers
                 for line in path.read_text(encoding="utf-8").replace("\\", "\\\\").splitlines()
                 if not line.startswith('#include "')]
        verbatim = "".join(f"    {line}\n" if line else "\n" for line in lines)
        return cls.pyx.read_text(encoding="utf-8").replace(
            f'cdef extern from "{cls.headers[-1].name}" nogil:',
            f'cdef extern from *:\n    """\n{verbatim}    """\n\ncdef extern from * nogil:')


class SearchModule(EmbeddedModule):
    """The search as a compiled module."""

    what = "the neighbour search, which takes 10 to 30 s"
    pyx, headers = HERE / "sorted_cell_nnps.pyx", (HERE / "sorted_cells.h",)

    @staticmethod
    def flags():
        return exact_flags()


@functools.cache
def compiler():
    """The first line of the compiler's version; empty if it prints none."""
    command = shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc")
    try:
        told = subprocess.run([*command, "--version"], capture_output=True, text=True, check=False).stdout
    except OSError:
        return ""
    return told.partition("\n")[0]


@functools.cache
def exact_flags():
    """Compiler flags that keep the search exact; none unless the compiler is GCC or Clang."""
    return EXACT if any(name in compiler().lower() for name in ("gcc", "cc ", "clang")) else ()


def sorted_cell_nnps(say: Callable[[str], None] | None = None) -> type:
    """The class ``SortedCellNNPS``; compiling takes 10 to 30 s, once. All else is said at ``EmbeddedModule.loaded``."""
    return SearchModule.loaded(say).SortedCellNNPS


def device_cell_nnps() -> Any:
    """The class ``DeviceCellNNPS``, for OpenCL or CUDA."""
    from pysph_boiling.search.device_cells import DeviceCellNNPS

    return DeviceCellNNPS


def search_for(application: Any, say: Callable[[str], None] | None = None) -> Any:
    """The neighbour search for a PySPH ``Application``, to be returned from its ``create_nnps``.

    ``say`` is that of :func:`sorted_cell_nnps`. On a device it is a search for devices, which has no ``sort_gids``.
    """
    from pysph.base import kernels

    options, solver = application.options, application.solver
    kernel = getattr(kernels, options.kernel)(dim=solver.dim) if options.kernel else solver.kernel
    common = dict(dim=solver.dim, particles=application.particles, radius_scale=kernel.radius_scale,
                  domain=application.domain)
    if options.with_opencl or options.with_cuda:
        return device_cell_nnps()(**common)
    return sorted_cell_nnps(say)(
        **common, fixed_h=bool(solver.fixed_h or options.fixed_h), sort_gids=bool(options.sort_gids))

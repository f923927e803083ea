"""Sums over neighbours and density sweeps in C, for uniform masses and smoothing lengths, on the host.

Sums and extremes over the particles themselves are there too, for any masses (:mod:`pysph_boiling.schemes.reductions`).
They are compiled once, by GCC or Clang for AVX2 or AVX-512, as PySPH compiles its modules. The equations that call them
are :mod:`pysph_boiling.equations.lean`.
"""
import functools
from pathlib import Path

import numpy as np

from pysph_boiling.search.sorted_cells import EmbeddedModule, exact_flags

__all__ = ["FluidModule", "counts", "fluid_sums", "groups", "has", "has_avx2", "members", "serves"]

HERE = Path(__file__).parent
FLAGS = ("-O3", "-fno-math-errno", "-fno-trapping-math", "-mavx2", "-mfma")
AVX2_NEEDS = {"avx2", "bmi1", "bmi2", "f16c", "fma", "movbe"}


class FluidModule(EmbeddedModule):
    """The sums and sweeps as a compiled module."""

    what = "the sums over neighbours, which takes 10 to 20 s"
    pyx = HERE / "fluid_sums.pyx"
    headers = tuple(HERE / name for name in ("pair_sums.h", "density_sweeps.h", "bubble_labels.h", "particle_sums.h",
                                              "exchange.h"))

    @staticmethod
    def flags():
        return (*FLAGS, "-mavx512f") if "avx512f" in processor_features() else FLAGS


@functools.cache
def processor_features():
    """What the processor can do, as words of Linux; empty on other systems."""
    processor = Path("/proc/cpuinfo")
    return frozenset(processor.read_text().split()) if processor.exists() else frozenset()


def has_avx2():
    """Whether the processor has AVX2, and what else belongs to x86-64-v3."""
    return processor_features() >= AVX2_NEEDS


def serves():
    """Whether the sums can be compiled and run here: by GCC or Clang, on a processor with AVX2.

    Without AVX2 compilers make of the same code what is slower than the general equations.
    """
    return bool(exact_flags()) and has_avx2()


def fluid_sums(say=None):
    """The compiled module; all else is said at ``EmbeddedModule.loaded``."""
    return FluidModule.loaded(say)


def loaded():
    """The compiled module if a run has loaded it, else ``None``."""
    return next((module for (cls, _), module in FluidModule.modules.items() if cls is FluidModule), None)


def groups(label):
    """As ``np.unique`` of labels (n,): (labels, first, index, number); in C where a run has loaded the module."""
    module = loaded()
    if module is None or label.dtype != np.uintc:
        return np.unique(label, return_index=True, return_inverse=True, return_counts=True)
    return module.groups_of(label)


def counts(index, number, height, base, reach, uid, known):
    """Of the members (n,) of each of ``number`` groups, given by their ``index``: (low, met), (number,) each.

    ``low`` lie no more than ``reach`` above ``base`` [m], ``met`` have a uid among the sorted ``known``. In C as in
    :func:`groups`.
    """
    module = loaded()
    if module is None:
        return tuple(np.bincount(index, weights=which, minlength=number)
                     for which in (height - base <= reach, np.isin(uid, known)))
    return module.counts_of(index, number, height, base, reach, uid, known)


def has(numbers, low, high):
    """Whether one of the whole ``numbers`` (n,) lies in ``low`` .. ``high``; in C as in :func:`groups`."""
    module = loaded()
    if module is None:
        return bool(np.any((numbers >= low) & (numbers <= high)))
    return module.has_within(numbers, low, high)


def members(numbers, low, high):
    """Indices, in order, of the whole ``numbers`` (n,) that lie in ``low`` .. ``high``; in C as in :func:`groups`."""
    module = loaded()
    if module is None:
        return np.flatnonzero((numbers >= low) & (numbers <= high))
    return module.indices_within(numbers, low, high)

"""Lets PySPH compile and load its sets of equations as modules with checksums (:class:`CheckedModule`)."""
from contextlib import contextmanager

from pysph.sph import acceleration_eval_cython_helper

from pysph_boiling.search.checked_module import CheckedModule

__all__ = ["CheckedModule", "checked", "load_as"]


@contextmanager
def load_as(module):
    """Inside this block PySPH compiles and loads sets of equations as modules of the class ``module``."""
    before = acceleration_eval_cython_helper.ExtModule
    acceleration_eval_cython_helper.ExtModule = module
    try:
        yield
    finally:
        acceleration_eval_cython_helper.ExtModule = before


def checked():
    """Inside this block PySPH checks the checksums of its modules."""
    return load_as(CheckedModule)

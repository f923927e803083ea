"""PySPH compiles and loads its sets of equations as modules that are checked (:class:`CheckedModule`)."""
from contextlib import contextmanager

from pysph.sph import acceleration_eval_cython_helper

from pysph_boiling.search.checked_module import CheckedModule

__all__ = ["CheckedModule", "checked", "load_as"]


@contextmanager
def load_as(module):
    """PySPH compiles and loads sets of equations as this class of modules inside the block."""
    before = acceleration_eval_cython_helper.ExtModule
    acceleration_eval_cython_helper.ExtModule = module
    try:
        yield
    finally:
        acceleration_eval_cython_helper.ExtModule = before


def checked():
    """PySPH checks its modules inside the block."""
    return load_as(CheckedModule)

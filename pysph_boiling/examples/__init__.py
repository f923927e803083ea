"""One application a scene, each runnable by name."""
import importlib
import pkgutil

from pysph_boiling.names import unknown

__all__ = ["scene_class", "scenes"]


def scenes():
    """Names of the scenes that can be run, sorted: modules of ``pysph_boiling.examples`` that define one."""
    return sorted(info.name for info in pkgutil.iter_modules(__path__))


def scene_class(name):
    """The application class of a scene. Raises ``ValueError`` with the known names."""
    if name not in scenes():
        raise unknown("scene", name, scenes())
    module = importlib.import_module(f"pysph_boiling.examples.{name}")
    from pysph.solver.application import Application

    return next(value for value in vars(module).values() if isinstance(value, type)
                and issubclass(value, Application) and value.__module__ == module.__name__)

"""The example scenes: one module with one application for each, run by its name."""
import importlib
import pkgutil

from pysph_boiling.names import unknown

__all__ = ["scene_class", "scenes"]


def scenes() -> list[str]:
    """Sorted names of all scenes: the modules of ``pysph_boiling.examples`` that define one."""
    return sorted(info.name for info in pkgutil.iter_modules(__path__))


def scene_class(name: str) -> type:
    """The application class of the scene ``name``. Raises ``ValueError`` with the known names for an unknown one."""
    if name not in scenes():
        raise unknown("scene", name, scenes())
    module = importlib.import_module(f"pysph_boiling.examples.{name}")
    from pysph.solver.application import Application

    return next(value for value in vars(module).values() if isinstance(value, type)
                and issubclass(value, Application) and value.__module__ == module.__name__)

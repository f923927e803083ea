"""The example scenes: one module with one application for each, run by its name."""
import ast
import importlib
import pkgutil
import re
from pathlib import Path

from pysph_boiling.names import unknown

__all__ = ["picture_of", "said_of", "scene_class", "scenes"]

PICTURES = Path(__file__).parents[2] / "docs" / "pictures"  # of a checkout; an installed package has none


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


def said_of(name: str) -> tuple[str, str]:
    """(what it shows, how large it is and how long it takes): sentences of a scene's docstring. Imports nothing."""
    page = ast.get_docstring(ast.parse((Path(__file__).parent / f"{name}.py").read_text(encoding="utf-8")))
    time = re.search(r"^Run time +(.*?)(?=^\S)", page, re.M | re.S)[1]
    return tuple(" ".join(text.replace("``", "").split()) for text in (page.split("\n\n")[0], time))


def picture_of(name: str) -> Path | None:
    """Path of the picture of a scene, or ``None`` if there is none here."""
    path = PICTURES / f"{name}.webp"
    return path if path.is_file() else None

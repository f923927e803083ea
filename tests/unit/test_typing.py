"""The public functions and classes say what they take and give: ``make lint`` checks it by mypy."""
import inspect
import re
from dataclasses import is_dataclass
from pathlib import Path
from pkgutil import resolve_name

import pytest

from pysph_boiling.schemes.effects import Effect

ROOT = Path(__file__).parents[2]
API = re.findall(r"^   (pysph_boiling\.[\w.]+)$", (ROOT / "docs/api.md").read_text(encoding="utf-8"), re.M)
# PySPH translates equations, which have no annotations; the others are still without them.
WITHOUT = ("equations.", "runs.application")
PUBLIC = [name for name in API if not name.removeprefix("pysph_boiling.").startswith(WITHOUT)]


def functions(name):
    """(name, function) of a public function, or of all in a public module or class.

    Methods that a class overrides are those of its base, whose types hold for them. An effect is parameters for a user;
    what it computes with them is its own.
    """
    value = resolve_name(name)
    if inspect.ismodule(value):
        for public in value.__all__:
            yield from functions(f"{name}:{public}")
    elif inspect.isclass(value) and not (issubclass(value, Effect) and value is not Effect):
        made = {"__init__"} if is_dataclass(value) or issubclass(value, tuple) else set()
        inherited = {method for base in value.__mro__[1:] for method in vars(base)} - {"__init__"}
        for method, defined in vars(value).items():
            function = getattr(defined, "__func__", getattr(defined, "fget", getattr(defined, "func", defined)))
            if inspect.isfunction(function) and method not in made | inherited and (
                    method == "__init__" or not method.startswith("_")):
                yield f"{value.__qualname__}.{method}", function
    elif inspect.isfunction(value):
        yield name, inspect.unwrap(value)


def without_types(function):
    signature = inspect.signature(function)
    missing = [name for name, parameter in signature.parameters.items()
               if parameter.annotation is parameter.empty and name not in ("self", "cls")]
    return missing + ["return"] * (signature.return_annotation is signature.empty and function.__name__ != "__init__")


@pytest.mark.parametrize("name", PUBLIC)
def test_public_functions_have_types(name):
    assert not {where: missing for where, function in functions(name) if (missing := without_types(function))}

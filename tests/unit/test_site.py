"""The site: how docstrings are read, and that the page of the API names every module of equations."""
import importlib.util
import re
from pathlib import Path
from pkgutil import resolve_name

from pysph_boiling.schemes.effects import Heater

ROOT = Path(__file__).parents[2]
SPEC = importlib.util.spec_from_file_location("docstrings", ROOT / "docs/docstrings.py")
docstrings = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(docstrings)
INTERNAL = {"__init__", "helpers", "lean"}  # of the equations: nobody imports these

WRITTEN = """\
Does a thing.

Parameters
----------
k, e : float   A number [-], > 0. It has
               two lines.
**slots        Anything.
other          As above.

Reads    d_x [m],
d_y [m].   Writes   d_z [m], own index only.
Errors   ValueError if k <= 0."""
READ = """\
Does a thing.

Parameters
----------
k, e : float
    A number [-], > 0. It has two lines.
**slots
    Anything.
other
    As above.

Notes
-----
:Reads: d_x [m], d_y [m].
:Writes: d_z [m], own index only.
:Errors: ValueError if k <= 0."""


def test_docstrings_are_read_as_numpydoc():
    assert docstrings.spread(WRITTEN.splitlines()) == READ.splitlines()


def test_other_text_stays_as_it_is():
    text = "A docstring with  two blanks.\n\n    Reads as code   does.\n\n>>> f(x)   # a comment".splitlines()
    assert docstrings.spread(text) == text


def test_parameters_of_an_effect_have_unit_and_default():
    lines = docstrings.parameters(Heater)
    assert lines[:3] == ["", "Parameters", "----------"]
    meaning = lines[lines.index("temperature") + 1]
    assert "[K]" in meaning and meaning.startswith("    ")


def test_the_api_names_modules_that_exist_and_all_equations():
    named = set(re.findall(r"^   pysph_boiling\.([\w.]+)$", (ROOT / "docs/api.md").read_text(encoding="utf-8"), re.M))
    for name in named:
        resolve_name(f"pysph_boiling.{name}")
    equations = {path.stem for path in (ROOT / "pysph_boiling/equations").glob("*.py")} - INTERNAL
    assert {f"equations.{name}" for name in equations} <= named

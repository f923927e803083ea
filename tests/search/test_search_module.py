"""The search as a module: of use to any PySPH application, compiled once for each compiler, version and flag."""
import ast
import sys
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest
from compyle.config import get_config
from pysph.base.kernels import CubicSpline

import pysph_boiling.search as package
from pysph_boiling.search import search_for, sorted_cell_nnps, sorted_cells

FOLDER = Path(package.__file__).parent


def test_it_imports_nothing_of_ours():
    known = {"numpy", "pysph", "compyle", "cyarray", "Cython", "pysph_boiling.search"} | set(sys.stdlib_module_names)
    for path in FOLDER.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else \
                [node.module] if isinstance(node, ast.ImportFrom) else []
            assert all(any(name == one or name.startswith(f"{one}.") for one in known) for name in names), (path, names)


def test_sources_are_in_the_package():
    text = (Path(__file__).parents[2] / "setup.py").read_text()
    assert {path.suffix for path in FOLDER.iterdir() if path.suffix not in (".py", "")} == {".h", ".pyx"}
    assert '"pysph_boiling.search": ["*.h", "*.pyx"]' in text and '"pysph_boiling.native": ["*.h", "*.pyx"]' in text


@pytest.fixture
def name(monkeypatch):
    """The name of the module, which is the key of the cache."""
    monkeypatch.setattr(get_config(), "use_openmp", True)
    return lambda: sorted_cells.SearchModule.make().name


def test_another_compiler_version_or_flag_is_another_module(name, monkeypatch):
    first = name()
    assert name() == first
    version = metadata.version
    changes = [(sorted_cells, "compiler", lambda: "gcc 99"), (sorted_cells, "exact_flags", lambda: ("-O1",)),
               (sorted_cells.SearchModule, "source", lambda: "x = 1"), (get_config(), "use_openmp", False)]
    changes += [(metadata, "version", lambda asked, one=one: version(asked) + (".9" if asked == one else ""))
                for one in ("pysph", "cyarray", "compyle", "cython", "numpy")]
    for where, what, new in changes:
        with monkeypatch.context() as context:
            context.setattr(where, what, new)
            assert name() != first, what
    assert name() == first


def test_it_says_that_it_compiles(tmp_path, monkeypatch):
    told = []
    monkeypatch.setattr(sorted_cells.SearchModule, "say", told.append)
    monkeypatch.setattr(sorted_cells.SearchModule, "build", lambda self, force: Path(self.ext_path).write_text("made"))
    module = sorted_cells.SearchModule(sorted_cells.SearchModule.source(), root=str(tmp_path))
    for _ in range(2):
        module.write_and_build()
    assert told == ["compiling the neighbour search, which takes 10 to 30 s; later runs reuse it"] and module.whole()


def test_flags_keep_sums_exact_on_compilers_that_know_them(monkeypatch):
    for told, flags in (("gcc (Debian) 12", sorted_cells.EXACT), ("Apple clang version 15", sorted_cells.EXACT),
                        ("Microsoft (R) C/C++", ())):
        sorted_cells.exact_flags.cache_clear()
        monkeypatch.setattr(sorted_cells, "compiler", lambda told=told: told)
        assert sorted_cells.exact_flags() == flags
    sorted_cells.exact_flags.cache_clear()


def test_an_application_gets_the_search_for_its_kernel_and_options(monkeypatch):
    from types import SimpleNamespace

    from pysph.base.utils import get_particle_array

    pa = get_particle_array(name="fluid", x=np.arange(5.0), h=1.0)
    solver = SimpleNamespace(dim=1, kernel=CubicSpline(dim=1), fixed_h=False)
    options = SimpleNamespace(with_opencl=False, with_cuda=False, kernel=None, fixed_h=True, sort_gids=True)
    application = SimpleNamespace(options=options, solver=solver, particles=[pa], domain=None)
    found = search_for(application)
    assert isinstance(found, sorted_cell_nnps()) and found.fixed_h and found.sort_gids and found.radius_scale == 2.0
    options.kernel = "QuinticSpline"
    assert search_for(application).radius_scale == 3.0
    options.with_opencl = True
    monkeypatch.setattr(sorted_cells, "device_cell_nnps", lambda: dict)  # the class itself needs a device
    assert search_for(application) == dict(dim=1, particles=[pa], radius_scale=3.0, domain=None)

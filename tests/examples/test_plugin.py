"""Effects of other packages: ``example_plugin/`` as it would be installed, and packages that are broken."""
import os
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from pysph_boiling.schemes.effects.installed import GROUP, load_installed

PLUGIN = Path(__file__).parents[2] / "example_plugin"


@pytest.fixture(scope="module")
def environment(tmp_path_factory):
    """The variables of a process in which the plugin is installed: its modules, and what pip writes beside them."""
    site = tmp_path_factory.mktemp("site")
    info = site / "pysph_boiling_swirl-0.1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: pysph-boiling-swirl\nVersion: 0.1\n")
    (info / "entry_points.txt").write_text(f"[{GROUP}]\nswirl = pysph_boiling_swirl\n")
    paths = [str(site), str(PLUGIN), str(PLUGIN.parent), os.environ.get("PYTHONPATH", "")]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}


def run(environment, *arguments, **options):
    return subprocess.run([sys.executable, *arguments], env=environment, capture_output=True, text=True, timeout=900,
                          **options)


def test_entry_point_is_what_the_package_declares():
    text = (PLUGIN / "pyproject.toml").read_text()
    assert f'[project.entry-points."{GROUP}"]\nswirl = "pysph_boiling_swirl"' in text


def test_installed_effect_has_options_and_is_described(environment, tmp_path):
    done = run(environment, "-m", "pysph_boiling", "run", "steady_boiling", "--demo", "--swirl.rate", "3", "--describe",
               cwd=tmp_path)
    assert done.returncode == 0 and "swirl" in done.stdout, done.stdout + done.stderr
    wrong = run(environment, "-m", "pysph_boiling", "run", "steady_boiling", "--flat", "--swirl", "-d", "out",
                cwd=tmp_path)
    assert wrong.returncode == 2 and "a vertical axis needs a 3-D scene" in wrong.stderr + wrong.stdout
    assert not (tmp_path / "out").exists()


def test_tests_of_the_plugin_pass(environment):
    done = run(environment, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-c", os.devnull, "--rootdir", str(PLUGIN),
               str(PLUGIN / "tests"))
    assert done.returncode == 0 and "4 passed" in done.stdout, done.stdout + done.stderr


def test_broken_package_is_not_available_and_named():
    broken = EntryPoint(name="foam", value="no_such_module_of_anybody", group=GROUP)
    with pytest.warns(UserWarning, match="'foam' of no_such_module_of_anybody cannot be loaded and is not available: "
                                         "ModuleNotFoundError"):
        load_installed([broken])

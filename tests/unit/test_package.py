"""What setup.py installs: every file of the package, so that no command needs a checkout."""
import subprocess
from importlib import import_module
from pathlib import Path

import pytest
import setuptools

ROOT = Path(__file__).parents[2]


def test_installed_package_has_every_file(monkeypatch):
    if not (ROOT / ".git").exists():
        pytest.skip("this is not a checkout with its history")
    monkeypatch.chdir(ROOT)
    wanted = subprocess.run(["git", "ls-files", "pysph_boiling"], capture_output=True, text=True, check=True).stdout
    assert setuptools.__version__  # it provides distutils, which Python 3.12 and later lack
    build = import_module("distutils.core").run_setup("setup.py", stop_after="init").get_command_obj("build_py")
    build.ensure_finalized()
    data = {Path(source, name) for _, source, _, names in build.data_files for name in names}
    data = {path.relative_to(ROOT) if path.is_absolute() else path for path in data}
    found = {str(Path(file)) for *_, file in build.find_all_modules()} | set(map(str, data))
    assert len(wanted.split()) > 150 and set(wanted.split()) - found == set()

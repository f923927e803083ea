"""The tutorials: their commands are understood, their programs and the notebook run."""
import importlib.util
import shlex
import subprocess
import sys
from pathlib import Path

import nbclient
import nbformat
import numpy as np
import pytest

from pysph_boiling.cli import file_scene
from pysph_boiling.examples import scene_class
from pysph_boiling.files import output_files, read_output

ROOT = Path(__file__).parents[2]
SPEC = importlib.util.spec_from_file_location("tutorials", ROOT / "tools/tutorials.py")
tutorials = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(tutorials)
NAMES = sorted(path.stem for path in tutorials.TUTORIALS.glob("*.md"))
TUTORIAL = {name: tutorials.blocks(tutorials.TUTORIALS / f"{name}.md") for name in NAMES}
RUNS = [(name, shlex.split(line)[2:]) for name in NAMES for language, text, _ in TUTORIAL[name] if language == "sh"
        for line in text.splitlines() if line.startswith("pysph-boiling run ")]


@pytest.mark.parametrize("name, arguments", RUNS, ids=lambda value: value if isinstance(value, str) else value[0])
def test_runs_of_the_tutorials_have_options_that_exist(name, arguments, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for language, text, file in TUTORIAL[name]:
        if language == "toml":
            Path(file).write_text(text)
        elif file == "flask.py":
            exec(text, {})  # writes the mesh
    app = file_scene(arguments[0]) if arguments[0].endswith(".toml") else scene_class(arguments[0])()
    assert app.resolve(arguments[1:])


@pytest.mark.parametrize("name", NAMES)
def test_programs_of_the_tutorials_are_python(name):
    for language, text, file in TUTORIAL[name]:
        if language == "python":
            compile(text, file or name, "exec")


def test_heat_in_sph_conserves_energy(tmp_path):
    """The program of the tutorial, coarse and short: heat moves, none is lost, and no temperature leaves its range."""
    program = next(text for _, text, file in TUTORIAL["heat_in_sph"] if file == "warm_eddies.py")
    (tmp_path / "warm_eddies.py").write_text(program)
    subprocess.run([sys.executable, "warm_eddies.py", "--nx", "20", "--tf", "0.1", "--directory", "out"], cwd=tmp_path,
                   check=True, capture_output=True)
    files = output_files(tmp_path / "out")
    first, last = (read_output(file)[0]["fluid"] for file in (files[0], files[-1]))
    assert np.sum(last.m * last.e) == pytest.approx(np.sum(first.m * first.e), rel=1e-12)
    mixed = (last.T > 300.1) & (last.T < 319.9)
    assert mixed.sum() > 20 and last.T.min() >= 300.0 and last.T.max() <= 320.0


def test_the_notebook_runs(tmp_path):
    notebook = nbformat.read(tutorials.TUTORIALS / "reading_a_run.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "keep it without outputs"
    nbclient.NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(tmp_path)}}).execute()
    pictures = [output for cell in notebook.cells for output in cell.get("outputs", ()) if "image/png" in output.get(
        "data", ())]
    assert len(pictures) == 2 and (tmp_path / "small_boil_output/results.npz").exists()

"""What the command line says: whole sentences, plain words, and one line where a run is interrupted."""
import importlib
import inspect
from pathlib import Path

import pytest

from pysph_boiling import cli
from pysph_boiling.analysis.rendering import _pick_colour
from pysph_boiling.analysis.surface import camera_angles
from pysph_boiling.runs.progress import Stopped


def test_list_has_whole_sentences(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    assert cli.main(["list"]) == 0
    lines = [line.split("│") for line in capsys.readouterr().out.splitlines() if line.count("│") == 3]
    assert set(cli.scenes()) <= {name.strip() for _, name, *_ in lines}
    shown = " ".join(text.strip() for _, _, text, *_ in lines)
    for name in cli.scenes():
        page = inspect.getdoc(importlib.import_module(f"pysph_boiling.examples.{name}"))
        sentence = " ".join(page.split("\n\n")[0].split())
        assert sentence.endswith(".") and sentence in shown


@pytest.mark.parametrize("command", ["reproduce", "accuracy", "stress", "validate", "render"])
def test_help_is_for_readers_and_not_for_documentation_tools(command, capsys):
    with pytest.raises(SystemExit) as ended:
        cli.main([command, "--help"])
    out = capsys.readouterr().out
    assert ended.value.code == 0 and f"usage: pysph-boiling {command}" in out
    assert "``" not in out and ":class:" not in out and ":func:" not in out


@pytest.mark.parametrize(("error", "said"), [
    (KeyboardInterrupt(), "pysph-boiling: interrupted\n"),
    (Stopped("stopped at t = 0.2 s; what is there is written"),
     "pysph-boiling: stopped at t = 0.2 s; what is there is written\n"),
])
@pytest.mark.parametrize(("where", "command"), [
    ("pysph_boiling.examples.heated_slab.HeatedSlab.make_particles", "run heated_slab -q"),
    ("pysph_boiling.schemes.solver.build_side_by_side", "run heated_slab -q"),
    ("pysph_boiling.analysis.rendering.render_run", "render ."),
], ids=["start", "compiling", "drawing"])
def test_ctrl_c_is_one_line_and_a_status(tmp_path, monkeypatch, capsys, where, command, error, said):
    def interrupt(*_, **__):
        raise error

    monkeypatch.setattr(where, interrupt)
    monkeypatch.chdir(tmp_path)
    assert cli.main(command.split()) == 130 and capsys.readouterr().err == said


@pytest.mark.parametrize(("call", "meant"), [
    (lambda: _pick_colour([], "temprature", "2d"), "temperature"), (lambda: camera_angles("cornr"), "corner")])
def test_names_that_are_checked_when_it_is_drawn_have_their_nearest_too(call, meant):
    with pytest.raises(ValueError, match=f"; did you mean '{meant}'"):
        call()


def test_every_command_has_the_parser_that_names_the_nearest_option():
    package = Path(cli.__file__).parent
    own = {"names.py", "lint.py", "blender_sequence.py"}  # the parser itself, and tools that stand alone
    found = {path.name for path in package.rglob("*.py") if "ArgumentParser(" in path.read_text()}
    assert found <= own

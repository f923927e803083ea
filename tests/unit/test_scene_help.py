"""The help of a scene: a short one, and every other option under a topic that it names."""
import dataclasses

import pytest

from pysph_boiling import cli
from pysph_boiling.examples import scene_class, scenes
from pysph_boiling.names import Refused, option
from pysph_boiling.runs.scene_help import MAIN


def said(capsys, scene, *topic):
    with pytest.raises(SystemExit, match="^0$"):
        cli.main(["run", scene, "--help", *topic])
    return capsys.readouterr().out


def explained(text):
    """Options that a help explains: those of the section "parameters of the scene" are only named."""
    text = text.partition("parameters of the scene:")[0]
    return {word.strip(",") for line in text.splitlines() if line.startswith("  -")
            for word in line.strip().split("  ")[0].split() if word.startswith("--")}


@pytest.mark.parametrize("scene", scenes())
def test_short_help_is_about_twenty_options_and_each_other_one_has_a_topic(scene, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    parser = scene_class(scene)().arg_parse
    works = {action.option_strings[-1] for action in parser._actions if not isinstance(action, Refused)}
    short = said(capsys, scene)
    assert len(explained(short)) <= 26 and len(short.splitlines()) <= 80
    topics = {line.split()[1]: line for line in short.partition("more help:")[2].splitlines() if line.strip()}
    topics.pop("NAME", None)
    names = [*(topic for topic in topics if topic not in ("all", "effects")), *parser.slots]
    texts = [said(capsys, scene, name) for name in names]
    assert set().union(explained(short), *map(explained, texts)) == works, "an option without a topic"
    assert explained(said(capsys, scene, "all")) == works
    assert all(max(map(len, text.splitlines())) <= 100 for text in (short, *texts))


def test_every_option_of_the_short_help_is_one_of_ours():
    works = scene_class("steady_boiling")().arg_parse._option_string_actions
    assert [flag for flags in MAIN.values() for flag in flags if flag not in works] == []
    assert sum(map(len, MAIN.values())) <= 22


def test_effects_are_one_line_each_and_say_which_the_scene_has(capsys):
    lines = said(capsys, "steady_boiling", "effects").splitlines()
    scheme = scene_class("steady_boiling")().scheme
    rows = {line.split()[0]: line.split()[1] for line in lines if line.startswith("  --")}
    assert rows == {option(slot): "on" if slot in scheme.effects else "off" for slot in scheme.slots}


def test_help_on_an_effect_has_units_bounds_defaults_and_the_values_of_the_scene(capsys):
    app = scene_class("steady_boiling")()
    for slot in app.scheme.slots:
        for spelling in (slot, option(slot)):
            text = " ".join(said(capsys, "steady_boiling", spelling.lstrip("-")).split())
            effect = app.scheme.effects.get(slot)
            assert ("This scene leaves it out." in text) == (effect is None)
            for spec in dataclasses.fields(effect) if effect else ():
                if "unit" in spec.metadata and getattr(effect, spec.name) != spec.default:
                    assert f"{option(f'{slot}.{spec.name}')} {getattr(effect, spec.name)}" in text
    text = " ".join(said(capsys, "steady_boiling", "heater").split())
    assert "heat flux of the heater before the factor A; give this or temperature [W/m^2] (>= 0.0)" in text
    assert "This scene has it, with --heater.temperature 433.15." in text


def test_help_compiles_and_writes_nothing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("pysph_boiling.examples.steady_boiling.SteadyBoiling.make_particles",
                        lambda *_: pytest.fail("made particles"))
    said(capsys, "steady_boiling", "all")
    assert not list(tmp_path.iterdir())

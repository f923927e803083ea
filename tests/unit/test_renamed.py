"""Names that were changed: who gives an old one is told the new one, on the command line, in Python, at a restart."""
import dataclasses
import importlib
import json
import pkgutil

import numpy as np
import pytest
from pysph.base.utils import get_particle_array

import pysph_boiling.equations
from pysph_boiling.cli import main
from pysph_boiling.examples import scene_class, scenes
from pysph_boiling.names import RENAMED, check_renamed, current_name, current_quantity, former_names, option
from pysph_boiling.runs.application import SceneApplication
from pysph_boiling.runs.resume import compare, settings, use_new_names, with_units
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import EFFECTS

SCENES = {name: scene_class(name) for name in scenes() if issubclass(scene_class(name), SceneApplication)}


def fields(cls):
    return [spec.name for spec in dataclasses.fields(cls) if "unit" in spec.metadata]


def carriers(name):
    """The effects, or the parameters of scenes, that have a parameter ``"slot.name"``."""
    slot, _, parameter = name.partition(".")
    found = [one.Parameters for one in SCENES.values()] if slot == "scene" else EFFECTS[slot]
    return [cls for cls in found if parameter in fields(cls)]


@pytest.mark.parametrize(("old", "new"), RENAMED.items())
def test_every_row_leads_from_no_name_to_one_that_there_is(old, new):
    assert current_name(old) == new == current_name(new) and old in former_names(new)
    assert (new in EFFECTS and old not in EFFECTS) if "." not in old else (carriers(new) and not carriers(old))


@pytest.mark.parametrize(("old", "new"), RENAMED.items())
def test_old_name_in_python_is_refused_with_the_new_one(old, new):
    if "." not in old:
        with pytest.raises(ValueError, match=f"{old} is called {new} now"):
            BoilingScheme(["fluid"], [], dim=2, spacing=0.01, **{old: None})
        return
    for cls in carriers(new):
        for make in (cls, getattr(cls, "replaced", None) and cls().replaced):
            if make:
                with pytest.raises(ValueError, match=f"^{old} is called {new} now$"):
                    make(**{old.partition(".")[2]: 1.0})


def test_parameter_of_its_own_may_have_an_old_name():
    check_renamed("density", ["acceleration"], ["acceleration"])


def ending(arguments, capsys):
    """The message with which the parser ends a command."""
    with pytest.raises(SystemExit) as raised:
        main(arguments)
    assert raised.value.code == 2
    return capsys.readouterr().err.splitlines()[-1].partition("error: ")[2]


def options():
    """(scene, old option, new option) for every row, and for every parameter of a slot that has another name."""
    flags = []
    for slot in EFFECTS:
        flags += [(f"{prefix}{old}", f"{prefix}{slot}", "steady_boiling") for old in former_names(slot)
                  for prefix in ("", "no_")]
        flags += [(old, f"{slot}.{name}", "steady_boiling") for cls in EFFECTS[slot] for name in fields(cls)
                  for old in former_names(f"{slot}.{name}")]
    for scene, cls in SCENES.items():
        flags += [(old, name, scene) for name in fields(cls.Parameters)
                  for old in former_names(f"scene.{name}") if old != "scene.cohesion"]  # a switch now
    return [(scene, option(old), option(new)) for old, new, scene in flags]


@pytest.mark.parametrize(("scene", "old", "new"), options())
def test_old_option_is_refused_with_the_new_one(scene, old, new, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert ending(["run", scene, old, "1"], capsys) == f"{old} is called {new} now"
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("scene", SCENES)
def test_switch_with_a_value_is_refused_with_the_options_that_take_one(scene, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for slot in SCENES[scene]().scheme.slots:
        flag, no = option(slot), option(f"no_{slot}")
        given = {option(f"{slot}.{name}") for cls in EFFECTS[slot] for name in fields(cls)}
        for value in ("3", "-1e-3"):
            said, _, listed = ending(["run", scene, flag, value], capsys).partition(": ")
            assert said == f"{flag} takes no value, got '{value}'"
            assert {word.strip(",") for word in listed.split() if word.startswith("--")} == given
        assert ending(["run", scene, f"{no}=3"], capsys) == f"{no} takes no value, got '3'"
    assert ending(["run", scene, "--no-pictures", "out"], capsys) == "--no-pictures takes no value, got 'out'"
    assert not list(tmp_path.iterdir())


def test_what_an_old_file_holds_is_read_under_its_new_name():
    pa = get_particle_array(name="fluid", x=np.arange(3.0), aim=[0.9, 1.0, 1.1], au_by_tension=[1.0, 2.0, 3.0],
                            constants={"work_tension": 4.0, "work_drag": 5.0})
    use_new_names(pa)
    np.testing.assert_array_equal(pa.target_radius, [0.9, 1.0, 1.1])
    np.testing.assert_array_equal(pa.au_by_cohesion, [1.0, 2.0, 3.0])
    assert {name: values[0] for name, values in pa.constants.items()} == {"work_cohesion": 4.0, "work_drag": 5.0}
    assert {"target_radius", "au_by_cohesion"} <= set(pa.output_property_arrays)
    assert current_quantity("n_burst") == "n_burst" and current_quantity("work_drag") == "work_drag"


def test_no_effect_and_equation_share_a_name():
    equations = {name for module in pkgutil.iter_modules(pysph_boiling.equations.__path__)
                 for name in importlib.import_module(f"pysph_boiling.equations.{module.name}").__all__}
    assert len(equations) > 40 and not equations & {cls.__name__ for classes in EFFECTS.values() for cls in classes}


@pytest.mark.parametrize("scene", SCENES)
def test_record_with_old_names_is_compared_under_the_new_ones(scene):
    def old(name):
        return next(iter(former_names(name)), name)

    def parameters(slot, instance):
        return {old(f"{slot}.{name}").partition(".")[2]: row for name, row in with_units(instance).items()}

    application = SCENES[scene]()
    application.resolve([])
    record = json.loads(json.dumps({
        "scene": application.scene_name(), "arguments": [],
        **{name: setting.value for name, setting in settings(application)[1].items()},
        "parameters": parameters("scene", application.parameters),
        "effects": {old(slot): {"class": type(effect).__name__, **parameters(slot, effect)}
                    for slot, effect in application.scheme.effects.items()}}))
    assert compare(application, record, 1.0) == []
    if "density" in record["effects"]:
        record["effects"]["density"]["longest"]["value"] = 0.1
        with pytest.raises(ValueError, match=r"--density.max-displacement \(it was 0.1 and would become 0.5\)"):
            compare(application, record, 1.0)

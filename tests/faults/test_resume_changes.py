"""What may be other when a run goes on, and what is refused by name: every parameter of every scene and effect."""
import json
import os

import numpy as np
import pytest

from pysph_boiling.cli import main
from pysph_boiling.examples import scene_class, scenes
from pysph_boiling.files import output_files, read_output
from pysph_boiling.results import load_results
from pysph_boiling.runs.application import SceneApplication
from pysph_boiling.runs.resume import compare, settings, stored_settings, with_units

SCENES = [name for name in scenes() if issubclass(scene_class(name), SceneApplication)]
MAY = {"duration", "frame", "substeps", "heater.temperature", "heater.flux", "heater.until", "loss.coefficient",
       "viscosity.rate", "dt"}  # that a user steers; among others


def run(name, folder, *options):
    return main(["run", name, "--no-pictures", "-d", str(folder), *options])


def record(folder):
    return json.loads((folder / "run.json").read_text())


def stored(application):
    """What run.json would hold of an application."""
    effects = {slot: {"class": type(effect).__name__, **with_units(effect)} for slot, effect in
               application.scheme.effects.items()}
    table = {name: setting.value for name, setting in settings(application)[1].items()}
    return json.loads(json.dumps({"scene": application.scene_name(), "parameters": with_units(application.parameters),
                                  "effects": effects, "arguments": ["--flat"], **table}))


@pytest.mark.parametrize("name", SCENES)
def test_every_parameter_may_change_or_is_refused_by_its_option(name):
    application = scene_class(name)()
    application.resolve([])
    seen = set()
    assert compare(application, stored(application), 1.0) == []
    for table in settings(application):
        for parameter, setting in table.items():
            changed = stored(application)
            slot, _, field = parameter.partition(".")
            if parameter in changed["parameters"]:
                changed["parameters"][parameter]["value"] = "other"
            elif field:
                changed["effects"][slot][field]["value"] = "other"
            elif slot in application.scheme.slots:
                effect = changed["effects"].pop(slot, None)
                if effect is None:
                    changed["effects"][slot] = {"class": "Other"}
            else:
                changed[parameter] = "other"
            if setting.may_change:
                (row,) = compare(application, changed, 1.0)
                assert (row["t"], row["parameter"], row["before"]) == (1.0, parameter, "other")
                seen.add(parameter)
            else:
                with pytest.raises(ValueError, match="cannot be resumed with another") as caught:
                    compare(application, changed, 1.0)
                before = "off" if slot == parameter and setting.value != "off" and not field and slot in \
                    application.scheme.slots else "Other" if setting.value == "off" else "other"
                assert f"{setting.flag} (it was {before}" in str(caught.value)
                assert str(caught.value).endswith("It was started with: --flat")
    everything = {parameter for table in settings(application) for parameter in table}
    assert seen >= MAY & everything and "seed" not in seen and "dim" not in seen


def test_changes_after_the_restart_are_taken_back():
    rows = [{"t": 1.0, "parameter": "heater.temperature", "before": 400.0, "after": 410.0},
            {"t": 2.0, "parameter": "heater.temperature", "before": 410.0, "after": 420.0},
            {"t": 2.0, "parameter": "duration", "before": 2.0, "after": 3.0}]
    saved = {"parameters": {"duration": {"value": 3.0}}, "changes": rows,
             "effects": {"heater": {"class": "Heater", "temperature": {"value": 420.0}}}}
    for t, temperature, duration in ((0.5, 400.0, 2.0), (1.5, 410.0, 2.0), (2.5, 420.0, 3.0)):
        scene, _, effects = stored_settings(saved, ("heater",), t)
        assert (effects["heater.temperature"], scene["duration"]) == (temperature, duration)


def test_heater_of_another_temperature_heats_from_then_on(tmp_path, capsys):
    """Below the water's temperature heat flows out; header and run.json say so; a restart before it takes it back."""
    assert run("heated_slab", tmp_path, "--tf", "20") == 0
    assert run("heated_slab", tmp_path, "--tf", "40", "--resume", "--T-1", "280") == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "from t = 20 s on: heater.temperature = 280.0 K, was 353.15" in said
    assert "20 steps of 1000 ms, from t = 20 s to 40.0 s" in said
    assert "the final check was skipped: the exact solution needs a constant temperature of the plate" in said
    results, kept = load_results(tmp_path), record(tmp_path)
    heat = np.interp([19.0, 20.0, 21.0, 40.0], results["t"], results["energy_heater"])
    assert heat[1] > heat[0] + 10.0 and heat[2] < heat[1] - 10.0 and heat[3] < 0.9 * heat[1]
    assert kept["parameters"]["T_1"]["value"] == kept["effects"]["heater"]["temperature"]["value"] == 280.0
    assert {(row["parameter"], row["t"], row["before"], row["after"]) for row in kept["changes"]} == {
        ("T_1", 20.0, 353.15, 280.0), ("heater.temperature", 20.0, 353.15, 280.0), ("duration", 20.0, 20.0, 40.0)}
    assert run("heated_slab", tmp_path, "--tf", "40", "--restart-file", output_files(tmp_path)[2]) == 0
    assert {row["parameter"] for row in record(tmp_path)["changes"]} == {"duration"}
    assert load_results(tmp_path)["energy_heater"][-1] > 1.2 * heat[1]


@pytest.mark.parametrize(("options", "said"), [
    (["--spacing", "0.001"], "--spacing (it was 0.0005 m and would become 0.001 m)"),
    (["--thickness", "0.01"], "--thickness (it was 0.02 m and would become 0.01 m)"),
    (["--T-0", "300"], "--T-0 (it was 293.15 K and would become 300.0 K)"),
    (["--seed", "3"], "--seed (it was 0 and would become 3)"),
    (["--kernel", "WendlandQuintic"], "--kernel (it was CubicSpline and would become WendlandQuintic)"),
    (["--no-heater"], "--heater (it was Heater and would become off)"),
    (["--loss"], "--loss (it was off and would become AmbientLoss)"),
    (["--heat.time-scaling", "2"], "--heat.time-scaling (it was 1.0 and would become 2.0)"),
    (["--heater.flux", "1000"], "effects: it lacks"),
])
def test_another_vessel_or_other_effects_are_refused(tmp_path, slab, options, said, capsys):
    def files():  # but the log: as long as the process lives, it takes what PySPH says
        return {path.name: path.read_bytes() for path in slab.iterdir() if path.suffix != ".log"}

    before = files()
    for resume in (["-d", str(slab), "--resume"], ["-d", str(tmp_path / "other"), "--restart-file",
                                                   output_files(slab)[-1]]):
        assert main(["run", "heated_slab", "--tf", "20", "--no-pictures", *resume, *options]) == 2
        assert said in capsys.readouterr().err
    assert not (tmp_path / "other").exists()
    assert files() == before


@pytest.fixture(scope="module")
def slab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("slab")
    assert run("heated_slab", folder, "--tf", "10") == 0
    return folder


@pytest.mark.parametrize(("record", "what"), [
    (None, "missing"), ("[1, 2]", "missing"), ('{"scene": "heated_slab"}', "not of pysph_boiling"),
    ('{"scene": "heated_slab", "parameters": [], "effects": 3, "arguments": null}', "not of pysph_boiling"),
    ('{"scene": "heated_slab", "parameters": {"spacing": 1}, "effects": {}, "arguments": []}', "not of pysph_boiling"),
])
def test_file_without_its_record_is_refused(slab, tmp_path, capsys, record, what):
    file = tmp_path / os.path.basename(output_files(slab)[1])
    file.write_bytes(open(output_files(slab)[1], "rb").read())
    read_output(file)  # it is whole
    if record:
        (tmp_path / "run.json").write_text(record)
    assert run("heated_slab", tmp_path / "out", "--restart-file", str(file)) == 2
    assert f"the run.json in its folder, which says how it was made, is {what}" in capsys.readouterr().err

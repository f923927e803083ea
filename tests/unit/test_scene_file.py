"""Scenes in files: a dozen lines make a vessel with heaters, an obstacle and a lid; what is wrong is said with its key.

Nothing is compiled here; tests/examples/test_vessel.py runs scenes.
"""
import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest
from small_scenes import SMALL

from pysph_boiling import cli
from pysph_boiling.examples import scene_class
from pysph_boiling.particles import positions
from pysph_boiling.runs.scene_file import SceneFileError
from pysph_boiling.schemes.effects import BoxContainer, CylinderContainer, DistanceContainer

DOCS = Path(__file__).parents[2] / "docs" / "scenes.md"
DOZEN = re.search(r"```toml\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.S)[1]  # two heaters, an obstacle, a lid
PLAIN = """
duration = 0.5
spacing = 0.005
[vessel]
box = [0.05, 0.04, 0.06]
[[fluids]]
fill = 0.5
"""


def made(text, tmp_path, *options):
    """The application of a scene file, with its scheme and its arrays by name."""
    path = tmp_path / "scene.toml"
    path.write_text(text, encoding="utf-8")
    app = cli.file_scene(str(path))
    app.set_args([*options, "-d", str(tmp_path / "out")])
    app._parse_command_line(force=True)
    app._prepare()
    return app, {pa.name: pa for pa in app.prepared}


def test_a_dozen_lines_make_two_heaters_an_obstacle_and_a_lid(tmp_path):
    assert len([line for line in DOZEN.splitlines() if line.strip() and not line.startswith("#")]) <= 16
    app, arrays = made(DOZEN, tmp_path)
    room, _, _ = app.geometry(app.parameters)
    effects, wall, fluid = app.scheme.effects, arrays["wall"], arrays["fluid"]
    assert isinstance(effects["container"], DistanceContainer) and effects["venting"].mode == "lid"
    assert room(positions(fluid)).min() > 0.0  # not in the obstacle either
    hot = wall.heated == 1
    T = np.where(wall.T_heater[hot] == 0.0, effects["heater"].temperature, wall.T_heater[hot])
    assert len(set(T)) == 2 and min(np.unique(T, return_counts=True)[1]) > 10
    inside = (positions(wall) > 0.0).all(axis=1) & (positions(wall) < room.upper).all(axis=1)
    assert inside.sum() > 50  # those of the obstacle
    assert len(arrays["sites"].x) == app.file.description.sites.number
    assert np.abs(room(positions(arrays["sites"]))).max() < 0.3 * app.parameters.spacing


def test_fluid_has_the_volume_asked_for_and_its_temperatures(tmp_path):
    text = PLAIN.replace("fill = 0.5", "fill = 0.3\ntemperature = 360\n[[fluids]]\nfill = 0.2")
    app, arrays = made(text, tmp_path)
    fluid = arrays["fluid"]
    assert len(fluid.x) == 0.5 * 10 * 8 * 12
    assert isinstance(app.scheme.effects["container"], BoxContainer)
    cold = np.isclose(fluid.T, 360.0)
    assert cold.sum() == 0.3 * 960 and np.allclose(fluid.T[~cold], 371.15)
    assert fluid.z[cold].max() <= fluid.z[~cold].min() + 1e-3
    assert "preset_nucleation" not in app.scheme.effects and "heater" not in app.scheme.effects
    drops = PLAIN + "[[fluids]]\nbox = [[0.02, 0.0, 0.04], [0.03, 0.04, 0.05]]\n"
    _, arrays = made(drops, tmp_path)
    assert len(arrays["fluid"].x) == 480 + 2 * 8 * 2


@pytest.mark.parametrize(("vessel", "container", "volume"), [
    ("cylinder = {radius = 0.03, height = 0.06}", CylinderContainer, np.pi * 0.03**2 * 0.06),
    ("sphere = 0.03", DistanceContainer, 4.0 / 3.0 * np.pi * 0.03**3),
    ("box = [0.05, 0.04, 0.06]", BoxContainer, 0.05 * 0.04 * 0.06),
])
def test_vessels_have_their_volume_and_the_container_that_is_exact(vessel, container, volume, tmp_path):
    app, arrays = made(PLAIN.replace("box = [0.05, 0.04, 0.06]", vessel), tmp_path)
    assert isinstance(app.scheme.effects["container"], container)
    assert len(arrays["fluid"].x) * 0.005**3 == pytest.approx(0.5 * volume, rel=0.02)


def test_files_and_options_give_parameters_and_effects(tmp_path):
    text = PLAIN + "[effects]\ndrag = false\nexpansion = true\n[effects.buoyancy]\nk_bubble = 4.0\n" \
                   "[effects.heat]\ntime_scaling = 7.0\n"
    app, _ = made(text, tmp_path)
    effects = app.scheme.effects
    assert "drag" not in effects and "expansion" in effects
    assert effects["buoyancy"].k_bubble == 4.0 and effects["heat"].time_scaling == 7.0
    assert (app.parameters.duration, app.parameters.spacing, app.fname) == (0.5, 0.005, "scene")
    app, _ = made(text, tmp_path, "--duration", "0.1", "--buoyancy.k-bubble", "2", "--drag")
    assert app.parameters.duration == 0.1 and app.scheme.effects["buoyancy"].k_bubble == 2.0
    assert "drag" in app.scheme.effects


def test_a_file_chooses_the_fluid(tmp_path):
    app, arrays = made('material = "ethanol"\npressure = 2e5\n' + PLAIN, tmp_path)
    material = app.scheme.material
    assert "ethanol" in material.name.lower() and 365.0 < material.T_sat < 372.0
    assert np.allclose(arrays["fluid"].T, material.T_sat - 2.0) and app.parameters.time_scaling != 800.0
    app, _ = made('material = "ethanol"\ntime_scaling = 500\n' + PLAIN, tmp_path)
    assert app.parameters.time_scaling == 500.0  # as the file says


def test_power_becomes_the_flux_of_the_heated_area(tmp_path):
    heat = "[[heaters]]\nbox = [[0.0, 0.0, -0.001], [0.05, 0.02, 0.001]]\npower = 12.0\n"
    app, arrays = made(PLAIN + heat, tmp_path)
    assert 10 * 4 <= arrays["wall"].heated.sum() <= 10 * 4 + 18  # and those at three edges
    assert arrays["fluid"].heater_power[0] == pytest.approx(12.0 * 800.0)  # times A


@pytest.mark.parametrize("name", SMALL)
@pytest.mark.parametrize("more", [(), ("--no-viscosity",)], ids=["plain", "changed"])
def test_a_written_scene_is_the_scene(name, more, tmp_path):
    options, path = [*SMALL[name], *more], tmp_path / "again.toml"
    written = scene_class(name)()
    written.set_args([*options, "--write-scene", str(path)])
    written._parse_command_line(force=True)
    written._prepare()
    written.write_scene(path)
    again = cli.file_scene(str(path))
    again.set_args([])
    again._parse_command_line(force=True)
    again._prepare()
    for slot, effect in written.scheme.effects.items():
        if slot != "container":
            assert again.scheme.effects[slot] == effect, slot
    assert set(again.scheme.effects) == set(written.scheme.effects)
    ours, theirs = ({pa.name: pa for pa in app.prepared} for app in (written, again))
    assert set(ours) == set(theirs) and again.parameters.duration == written.parameters.duration
    assert len(ours["fluid"].x) == len(theirs["fluid"].x)
    assert abs(int(ours["wall"].heated.sum()) - int(theirs["wall"].heated.sum())) <= 2
    if "scene = " in path.read_text():
        assert again.parameters == written.parameters
        np.testing.assert_array_equal(positions(theirs["wall"]), positions(ours["wall"]))
    with pytest.raises(FileExistsError):
        written.write_scene(path)


@pytest.mark.parametrize(("old", "new", "message"), [
    ("spacing", "spacng", r"scene.toml: there is no key 'spacng'; did you mean 'spacing'\?"),
    ("fill = 0.5", "fil = 0.5", r"fluids\[1\] has no key 'fil'; did you mean 'fill'\?"),
    ("fill = 0.5", "fill = 1.5", r"fluids\[1\].fill must be <= 1.0, got 1.5"),
    ("fill = 0.5", "fill = 'half'", r"fluids\[1\].fill must be a number, got 'half'"),
    ("fill = 0.5", "fill = 0.5\ntemperature = 90", r"fluids\[1\].temperature must be >= 273.15 K.* are in kelvin"),
    ("fill = 0.5", "fill = 0.5\n[[fluids]]\nfill = 0.9", r"fluids\[2\]: fill = 0.9 needs 864 .* room for 480"),
    ("fill = 0.5", "", r"fluids\[1\]: give fill, .*, or box"),
    ("[[fluids]]\nfill = 0.5", "", "there is no fluid: add"),
    ("[[fluids]]", "[fluids]", r"write \[\[fluids\]\]"),
    ("[vessel]", "[vesel]", r"needs a table \[vessel\], or scene"),
    ("box = [0.05, 0.04, 0.06]", "", "vessel: give one of box, cylinder, sphere, mesh, got none"),
    ("box = [0.05, 0.04, 0.06]", "box = [0.05, 0.04]", r"vessel: the upper corner of a box must be 3 finite lengths"),
    ("box = [0.05, 0.04, 0.06]", "box = [5.0, 4.0, 6.0]\nsphere = 1.0", "got box and sphere"),
    ("box = [0.05, 0.04, 0.06]", "cylinder = {radius = 0.1}", "vessel.cylinder: .*missing.*height"),
    ("box = [0.05, 0.04, 0.06]", "mesh = 'no.stl'", "no.stl"),
    ("box = [0.05, 0.04, 0.06]", "box = [50.0, 40.0, 60.0]", "in metres, and not in millimetres"),
    ("spacing = 0.005", "spacing = -1", r"scene.toml: spacing must be > 0.0 m, got -1.0 m"),
    ("spacing = 0.005", "spacing = 0.005\ndim = 2", "vessel: the upper corner of a box must be 2 finite lengths"),
    ("duration = 0.5", "duration = ", "scene.toml is not TOML"),
    ("duration = 0.5", "name = 'a/b'", "name must have letters"),
    ("duration = 0.5", "material = 'water'\nscene = 'geyser'", "not both"),
    ("duration = 0.5", "material = 'mercury'", "mercury"),
    ("$", "[[heaters]]\nbelow = 0.01", r"heaters\[1\]: give a temperature \[K\] or a power \[W\]"),
    ("$", "[[heaters]]\ntemperature = 400.0", r"heaters\[1\]: give one of box, sphere, cylinder, mesh"),
    ("$", "[[heaters]]\ntemperature = 400.0\nbox = [[1, 1, 1], [2, 2, 2]]", r"heaters\[1\] covers no wall"),
    ("$", "[[heaters]]\ntemperature = 700.0\nbelow = 0.01", "must be below the critical point"),
    ("$", "[[heaters]]\ntemperature = 100.0\nbelow = 0.01", r"heaters\[1\].temperature must be >= 273.15 K"),
    ("$", "[sites]\nnumber = 3", r"sites: number puts sites on heaters, and there are none"),
    ("$", "[sites]\nplaces = [[0.02, 0.02, 0.02]]", r"the place \[0.02, 0.02, 0.02\] m is farther than a spac"),
    ("$", "[[obstacles]]\nsphere = {centre = [0, 0], radius = 1}", r"obstacles\[1\]: the centre of a sphere must be 3"),
    ("$", "[[obstacles]]\nsphere = {centre = [0.025, 0.02, 0.03], radius = 1}", "no room for fluid"),
    ("$", "[effects.bouyancy]\nk_bubble = 1", r"no effect 'bouyancy'; did you mean 'buoyancy'\?"),
    ("$", "[effects.buoyancy]\nk_buble = 1", r"effects.buoyancy has no parameter 'k_buble'; did you mean 'k_bubble'\?"),
    ("$", "[effects.buoyancy]\nk_bubble = -1", r"effects.buoyancy: k_bubble must be >= 0.0"),
    ("$", "[effects]\nbuoyancy = 3", "effects.buoyancy must be a table of parameters, true or false"),
])
def test_what_is_wrong_in_a_file_is_said_with_its_key(old, new, message, tmp_path, capsys):
    text = PLAIN + new + "\n" if old == "$" else PLAIN.replace(old, new, 1)
    assert text != PLAIN
    path = tmp_path / "scene.toml"
    path.write_text(text)
    assert cli.main(["run", str(path), "-d", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert re.search(message, said), said
    assert "--toml" not in said and not (tmp_path / "out").exists()


@pytest.mark.parametrize(("text", "message"), [
    ("scene = 'geysr'", "no scene 'geysr'; did you mean 'geyser'"),
    ("scene = 'geyser'\n[parameters]\nven = 1", "geyser has no parameter 'ven'; did you mean 'vent'"),
    ("scene = 'geyser'\n[parameters]\nvent = -1", "vent must be"),
    ("scene = 'geyser'\n[[heaters]]\nbelow = 1", "there is no key 'heaters'"),
    ("scene = 'reuse_edac'", "reuse_edac uses a scheme of PySPH"),
])
def test_files_that_start_from_a_scene_are_checked(text, message, tmp_path, capsys):
    path = tmp_path / "scene.toml"
    path.write_text(text)
    assert cli.main(["run", str(path), "-d", str(tmp_path / "out")]) == 2
    assert message in capsys.readouterr().err


def test_errors_are_value_errors_of_one_kind():
    assert issubclass(SceneFileError, ValueError)
    assert all(spec.metadata.get("unit") for spec in dataclasses.fields(scene_class("vessel").Parameters))

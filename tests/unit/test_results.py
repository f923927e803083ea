"""Reading a run: units, settings, particles at a time, events, xarray; what cannot be read says why."""
import json
import re
from pathlib import Path

import numpy as np
import pytest
from full import FULL, make
from pysph.base.utils import get_particle_array
from pysph.solver.output import dump
from small_scenes import SMALL, built

from pysph_boiling.examples import scene_class
from pysph_boiling.results import EVENT_UNITS, diameter, load_run
from pysph_boiling.runs.ledger import Ledger, save_results
from pysph_boiling.schemes.effects import EFFECTS, Effect

ROOT = Path(__file__).parents[2]
DX = 0.002
UNITS = {"-", "s", "m", "K", "kg", "kg/m", "J", "J/m", "m^2", "m^3"}
RECORD = {
    "scene": "glass", "command": "pysph-boiling run glass", "completed": True, "dim": 2, "spacing": DX,
    "material": "water at 1 atm", "particles": {"fluid": 2, "sites": 2},
    "constants": {"T_sat": {"value": 373.15, "unit": "K"}},
    "parameters": {"superheat": {"value": 60.0, "unit": "K"}, "region": {"value": 2.4, "unit": "-"}},
    "effects": {"heater": {"class": "Heater", "temperature": {"value": 433.15, "unit": "K"}}},
    "columns": {"t": {"unit": "s", "meaning": "time"}, "n_burst": {"unit": "-", "meaning": "particles that burst"},
                "energy_heater": {"unit": "J/m", "meaning": "heat from the heater"}},
    "departures": [[0.3, 9, 1]], "vents": [[0.45, 8]]}


@pytest.fixture
def folder(tmp_path):
    """A run with outputs at 0, 0.2 and 0.4 s whose particles are as warm as the clock says."""
    for step, t in enumerate((0.0, 0.2, 0.4)):
        fluid = get_particle_array(name="fluid", x=[0.0, DX], m=1.0, h=DX)
        fluid.add_property("T", data=[300.0 + t, 300.0 + t])
        fluid.add_output_arrays(["T"])
        sites = get_particle_array(name="sites", x=[0.008, 0.004], y=[0.0, 0.001], m=1.0, h=DX)
        dump(str(tmp_path / f"glass_{step}.hdf5"), [fluid, sites], {"t": t, "dt": 0.1, "count": step})
    t = np.linspace(0.0, 0.5, 6)
    save_results(tmp_path / "results.npz", {"t": t, "energy_heater": 40.0 * t,
                                            "n_burst": np.array([0.0, 0.0, 5.0, 5.0, 5.0, 7.0])})
    (tmp_path / "run.json").write_text(json.dumps(RECORD))
    return tmp_path


def change(folder, **changes):
    (folder / "run.json").write_text(json.dumps({**RECORD, **changes}))


# --- columns ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SMALL)
def test_every_column_of_a_scene_has_its_own_meaning_and_a_unit(name):
    ledger = built(name).ledger
    assert set(ledger.described()) == set(ledger.table()) == {column.name for column in ledger.columns}
    about = ledger.described().values()
    assert {row["unit"] for row in about} <= UNITS
    meanings = [row["meaning"] for row in about]
    assert all(len(meaning.split()) >= 2 for meaning in meanings) and len(set(meanings)) == len(meanings)
    assert ledger.described()["mass"]["unit"] == {2: "kg/m", 3: "kg"}[ledger.scene.dim]


def ledger_of(name, *options):
    application = scene_class(name)()
    application.resolve(options)
    return Ledger(application.scheme)


def test_every_effect_that_declares_columns_is_in_a_scheme_that_has_them_and_the_docs_list_them():
    seen, effects = {}, set()
    for ledger in (*(built(name).ledger for name in SMALL), ledger_of("pulsating_boil"), Ledger(make(effects=FULL)[0]),
                   ledger_of("superheat_sites", "--mode", "li_xiao"), ledger_of("steady_boiling", "--mechanics")):
        effects |= {type(effect) for effect in ledger.scheme.effects.values()}
        declared = [column for effect in ledger.scheme.effects.values() for column in effect.columns(ledger.scene)]
        assert {column.name for column in declared} <= set(ledger.table())
        seen |= {column.name: f"{column.unit_in(3)} | {column.meaning}" for column in ledger.columns}
    own = {cls for classes in EFFECTS.values() for cls in classes if cls.columns is not Effect.columns
           and cls.__module__.startswith("pysph_boiling.")}
    assert own <= effects, f"no scheme here has {own - effects}"
    page = (ROOT / "docs/results.md").read_text().partition("## Columns")[2]
    table = dict(re.findall(r"^\| `(\w+)` \| (.*) \|$", page, re.M))
    assert table == seen, "\n".join(f"| `{name}` | {row} |" for name, row in seen.items())


# --- a run ------------------------------------------------------------------------------------------------------------


def test_results_have_units_and_meanings(folder):
    results = load_run(folder).results
    assert results["energy_heater"][-1] == 20.0 and list(results) == ["t", "energy_heater", "n_burst"]
    assert (results.unit("energy_heater"), results.meaning("energy_heater")) == ("J/m", "heat from the heater")
    assert re.search(r"^energy_heater +\[J/m\] +heat from the heater$", repr(results), re.M)
    assert results.get("n_vapour", 3) == 3 and "n_vapour" not in results
    for ask in (results.__getitem__, results.unit):
        with pytest.raises(ValueError, match="^no column 'energy_heat'; did you mean 'energy_heater'.*n_burst"):
            ask("energy_heat")


def test_settings_have_units_and_present_names(folder):
    run = load_run(folder)
    assert run.settings["superheat"] == 60.0 and run.settings.unit("heater.temperature") == "K"
    assert run.settings["region_radius"] == 2.4  # called "region" by an earlier version
    assert run.settings["material.T_sat"] == 373.15 and run.material == "water at 1 atm"
    assert "heater.class" not in run.settings and "superheat           [K]  60.0" in repr(run.settings)


@pytest.mark.parametrize(("asked", "found"), [(0.0, 0.0), (0.19, 0.0), (0.2, 0.2), (0.2 - 1e-9, 0.2), (0.39, 0.2),
                                              (0.4 + 1e-9, 0.4)])
def test_particles_are_those_of_the_last_output_until_then(folder, asked, found):
    particles = load_run(folder).particles(asked)
    assert particles.time == found and particles["fluid"].T == pytest.approx(300.0 + found)


@pytest.mark.parametrize("asked", [-0.1, 0.5, float("nan")])
def test_a_time_without_output_names_those_that_there_are(folder, asked):
    with pytest.raises(ValueError, match=r"no output at t = .* s: 3 outputs, at 0, 0.2, 0.4 s"):
        load_run(folder).particles(asked)


def test_times_of_many_outputs_are_told_in_short(folder):
    run = load_run(folder)
    run.times = 0.02 * np.arange(101.0)
    with pytest.raises(ValueError, match="101 outputs from 0 to 2 s, about every 0.02 s"):
        run.particles(7.0)


def test_run_without_particle_files_says_so(folder):
    for file in folder.glob("*.hdf5"):
        file.unlink()
    run = load_run(folder)
    with pytest.raises(FileNotFoundError, match="no particle files"):
        run.particles(0.0)
    assert np.isnan(run.events[1].x) and "outputs     0 outputs" in repr(run)


def test_events_are_rows_with_time_place_and_size(folder):
    burst, departure, vent, last = load_run(folder).events
    assert (burst.kind, burst.time, burst.particles, burst.site) == ("burst", pytest.approx(0.2), 5, -1)
    assert (last.kind, last.time, last.particles) == ("burst", 0.5, 2)
    assert (departure.kind, departure.time, departure.particles, departure.site) == ("departure", 0.3, 9, 1)
    assert (departure.x, departure.y, departure.z) == (0.008, 0.0, 0.0)  # sites are numbered by x
    assert departure.diameter == pytest.approx(np.sqrt(36.0 / np.pi) * DX)
    assert (vent.kind, vent.time, vent.particles) == ("vent", 0.45, 8) and np.isnan([vent.x, vent.y, vent.z]).all()
    assert tuple(EVENT_UNITS) == departure._fields


def test_diameter_is_that_of_a_disc_or_ball_of_the_same_volume():
    assert np.pi / 4.0 * diameter(9, 2) ** 2 == pytest.approx(9.0)
    assert np.pi / 6.0 * diameter(9, 3) ** 3 == pytest.approx(9.0)


def test_xarray_has_units_and_the_time_as_coordinate(folder):
    data = load_run(folder).to_xarray()
    assert data["energy_heater"].dims == ("t",) and data["energy_heater"].attrs["units"] == "J/m"
    assert data["energy_heater"].attrs["long_name"] == "heat from the heater" and data.t.attrs["units"] == "s"
    assert float(data["energy_heater"].sel(t=0.2, method="nearest")) == pytest.approx(8.0)
    assert data.attrs["scene"] == "glass" and "t" not in data.data_vars


def test_without_xarray_it_is_said_how_to_get_it(folder, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "xarray", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'pysph_boiling\[analysis\]'"):
        load_run(folder).to_xarray()


def test_a_notebook_says_what_it_is(folder):
    said = repr(load_run(folder))
    for words in ("run of glass", "to 0.5 s", "2 fluid, 2 sites", "2 mm, 2-D", "3 columns, 6 rows", "3 outputs",
                  "2 bursts, 1 departures, 1 vents"):
        assert words in said, said
    change(folder, completed=False)
    assert "unfinished, until 0.5 s" in repr(load_run(folder, unfinished=True))


def test_what_cannot_be_read_says_why(folder, tmp_path):
    with pytest.raises(FileNotFoundError, match="no run.json in .*nothing, so it is not the output folder of a run"):
        load_run(tmp_path / "nothing")
    change(folder, completed=False)
    with pytest.raises(ValueError, match=r"unfinished: its results end at t = 0.5 s. Continue it with --resume"):
        load_run(folder)
    assert not load_run(folder, unfinished=True).completed
    (folder / "run.json").write_text("{}")
    with pytest.raises(ValueError, match="run.json is damaged"):
        load_run(folder)
    change(folder)
    (folder / "results.npz").unlink()
    with pytest.raises(FileNotFoundError, match="no results.npz"):
        load_run(folder)


def test_run_of_an_earlier_version_is_read_without_units(folder):
    (folder / "run.json").write_text(json.dumps({name: row for name, row in RECORD.items() if name != "columns"}))
    run = load_run(folder)
    assert run.results["n_burst"][-1] == 7.0 and run.to_xarray()["n_burst"].attrs == {}
    with pytest.raises(ValueError, match="does not tell the unit of the column 'n_burst'"):
        run.results.unit("n_burst")

"""What a scene says of itself is what was built, without each effect too; kelvin are told from Celsius."""
import dataclasses
import math

import numpy as np
import pytest
from small_scenes import SMALL, built

from pysph_boiling.cli import main
from pysph_boiling.examples import scene_class
from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.names import option
from pysph_boiling.particles import positions
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import AmbientLoss
from pysph_boiling.schemes.pbf import PBFScheme


def slots(name):
    scheme = PBFScheme if name == "dam_break" else BoilingScheme
    return scheme.slots


@pytest.mark.parametrize("name", ["steady_boiling", "superheat_sites", "cooling", "rolling_boil", "explosive_boiling",
                                  "geyser"])
def test_boiling_scene_has_rough_walls_with_multipliers_and_smooth_ones_without(name):
    def from_lattice(*options):
        (wall,) = [pa for pa in built(name, *options).particles if pa.name == "wall"]
        spacing = wall.h[0] / 1.2
        shift = positions(wall)[:, :2] / spacing - 0.5
        return np.abs(shift - shift.round())

    rough = from_lattice()
    assert 0.27 < rough.max() <= 0.3 and 0.12 < rough.mean() < 0.18  # uniform up to 0.3
    assert from_lattice("--no-wall-multipliers").max() < 1e-9


@pytest.mark.parametrize(("name", "slot"), [(name, slot) for name in SMALL for slot in slots(name)])
def test_scene_without_an_effect_is_told_rightly_or_refused(name, slot):
    try:
        application = built(name, option(f"no_{slot}"))
    except ValueError as refused:
        assert slot in str(refused) and len(str(refused).split()) > 5, refused
        return
    facts = application.facts()
    assert all(math.isfinite(value) and unit for value, unit in facts.values()), facts
    assert (slot in application.scheme.effects) is False
    assert not any("superheat" in fact for fact in facts) or slot != "heater" or name == "explosive_boiling"
    rows = application.recorded_parameters()
    for spec_name, row in rows.items():
        if row.get("replaced_by"):
            assert row["replaced_by"] == option(f"no_{slot}"), spec_name


def test_facts_are_those_of_the_heater_that_was_built():
    heater = {"plain": (60.0, []), "warmer": (413.0 - WATER.T_sat, ["--heater.temperature", "413"])}
    for superheat, options in heater.values():
        facts = built("steady_boiling", *options).facts()
        assert facts["q dx/k_eff (superheat across a spacing)"][0] == pytest.approx(superheat)
        assert facts["St = c_l superheat/L"][0] == pytest.approx(WATER.c_l * superheat / WATER.L)
    flux = built("steady_boiling", "--heater.flux", "30000")
    superheat = 30000 * flux.parameters.spacing / WATER.k_l  # A is in both
    assert flux.facts()["St = c_l superheat/L"][0] == pytest.approx(WATER.c_l * superheat / WATER.L)
    power = 30000 * 1000.0 * 0.7 * 12 * flux.parameters.spacing
    dry = flux.ledger.mass(flux.scheme.arrays) * WATER.L / power
    assert flux.facts()["time to boil dry at that flux"][0] == pytest.approx(dry)
    assert "time to boil dry at that flux" not in built("steady_boiling", "--heater.temperature", "300").facts()
    geyser = built("geyser", "--dynamic-nucleation.superheat-limit", "99")
    assert geyser.facts()["St = c_l (T - T_sat)/L of a burst"][0] == pytest.approx(WATER.c_l * 99.0 / WATER.L)


@pytest.mark.parametrize(("name", "options", "parameter", "by"), [
    ("steady_boiling", ["--heater.temperature", "413"], "superheat", "--heater"),
    ("steady_boiling", ["--heater.flux", "1e4"], "superheat", "--heater"),
    ("steady_boiling", ["--no-heater"], "superheat", "--no-heater"),
    ("steady_boiling", ["--heat.time-scaling", "7"], "time_scaling", "--heat"),
    ("heated_slab", ["--heater.temperature", "300"], "T_1", "--heater"),
    ("cooling", ["--heater.until", "9"], "heater_until", "--heater"),
    ("geyser", ["--expansion.v-exp", "2"], "v_exp", "--expansion"),
    ("superheat_sites", ["--mode", "gu"], "superheat_limit", "--no-dynamic-nucleation"),
])
def test_record_tells_which_parameters_an_option_has_replaced(name, options, parameter, by):
    rows = built(name, *options).recorded_parameters()
    assert rows[parameter]["replaced_by"] == by
    assert not any("replaced_by" in row for row in built(name).recorded_parameters().values())


START_TOO = {  # of the start, or of the whole scene, as well as of the effect
    "dim": {"adhesion.strength", "buoyancy.k_bubble"},
    "subcooling": {"venting.T_feed"}, "seed": {"dynamic_nucleation.seed", "preset_nucleation.seed"}}


def resolved(name, *options):
    """A scene with some options: the parameters of its effects, "slot.name" -> value, and the application."""
    application = scene_class(name)()
    application.resolve([*SMALL[name], *options])
    return {f"{slot}.{spec.name}": getattr(effect, spec.name) for slot, effect in application.scheme.effects.items()
            for spec in dataclasses.fields(effect)}, application


@pytest.mark.parametrize("name", SMALL)
def test_parameter_of_a_scene_sets_the_effects_own_whose_option_wins(name):
    plain, application = resolved(name)
    for spec in dataclasses.fields(application.parameters):
        value = getattr(application.parameters, spec.name)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or value == 0:
            continue
        factor = 0.99 if value == spec.metadata["high"] else 1.01
        other = value + 1 if isinstance(value, int) else factor * value
        asked = f"{option(spec.name)}={other}"
        try:
            changed, _ = resolved(name, asked)
        except SystemExit:  # an option that the small form of this scene does not have
            continue
        own = {one for one in changed if changed[one] != plain[one] and not one.startswith("container.")}  # its size
        assert own <= START_TOO.get(spec.name, {spec.metadata["sets"]}), f"{spec.name} sets {own}, undeclared"
        assert own or not spec.metadata["sets"]
        for one in own:
            wanted = changed[one] + (1 if isinstance(changed[one], int) else 0.01 * changed[one])
            both, built_so = resolved(name, asked, f"{option(one)}={wanted}")
            assert both[one] == pytest.approx(wanted), one
            row = built_so.recorded_parameters()[spec.name]
            assert row.get("replaced_by") == (None if spec.name in START_TOO else option(one.split(".")[0]))


@pytest.mark.parametrize(("name", "options", "said"), [
    ("steady_boiling", ["--heater.temperature", "140"], "--heater.temperature must be >= 273.15 K"),
    ("heated_slab", ["--T-1", "80"], "--T-1 must be >= 273.15 K"),
    ("heated_slab", ["--T-0", "20"], "--T-0 must be >= 273.15 K"),
    ("steady_boiling", ["--venting.T-feed", "95"], "--venting.T-feed must be >= 273.15 K"),
    ("heated_slab", ["--heater.temperature", "273"], "--heater.temperature must be >= 273.15 K"),
])
def test_celsius_for_kelvin_is_refused(name, options, said, tmp_path, capsys):
    assert main(["run", name, *SMALL[name], *options, "-d", str(tmp_path / "out")]) == 2
    complaint = capsys.readouterr().err
    assert said in complaint and "temperatures are in kelvin" in complaint
    if options[1] == "140":
        assert "140 degrees Celsius are 413.15 K" in complaint
    assert not (tmp_path / "out").exists()


def test_ambient_may_be_frost_but_not_celsius(tmp_path, capsys):
    assert main(["run", "superheat_sites", *SMALL["superheat_sites"], "--loss.T-ambient", "25", "-d",
                 str(tmp_path / "out")]) == 2
    assert "--loss.T-ambient must be >= 79.0 K, got 25.0 K" in capsys.readouterr().err
    AmbientLoss(T_ambient=253.15)


def test_start_temperature_must_be_one_of_liquid():
    application = built("heated_slab")
    fluid = application.scheme.arrays[0]
    for T in (20.0, np.linspace(20.0, 90.0, len(fluid.x))):
        with pytest.raises(ValueError, match=r"T of .fluid. must be >= 273.15 K, .* got 20.0 K: .*293.15 K"):
            application.scheme.set_temperature(fluid, T)
    application.scheme.set_temperature(fluid, 273.15)
    ice = WATER.with_(T_melt=None)  # who does not give it has no such limit
    ice.check_melted(20.0, "T")

"""A scene with another fluid: what follows from the fluid, what stays, what is refused, and what run.json says."""
import dataclasses
import json

import numpy as np
import pytest
from small_scenes import SMALL, built

from pysph_boiling.cli import main
from pysph_boiling.examples import scene_class, scenes
from pysph_boiling.examples.steady_boiling import SteadyBoiling
from pysph_boiling.materials import LAWS, WATER_1ATM, saturated
from pysph_boiling.names import option
from pysph_boiling.runs.application import SceneApplication
from pysph_boiling.runs.resume import compare
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import Expansion, Oscillation

ETHANOL, R134A = ["--material", "ethanol", "--pressure", "2e5"], ["--material", "R134a", "--pressure", "3e5"]
BOILING = [name for name in SMALL if name not in ("dam_break", "heated_slab")]
HOSTED = ["reuse_wcsph", "reuse_edac", "reuse_iisph"]


def numbers(application):
    """What compares the heat of a scene with its motion and its latent heat; none of them has a unit."""
    scheme, fluid = application.scheme, application.scheme.material
    effects, fluids, scene = scheme.effects, scheme.arrays, scheme.scene()
    heat, unit = effects["heat"], fluid.L / fluid.c_l
    found = {"Fo": heat.conductivity(fluid.k_l) / (fluid.rho_l * fluid.c_l) * scene.fall_time / scheme.spacing**2,
             "start": [float(extreme(pa.e)) / fluid.L for pa in fluids for extreme in (np.min, np.max)],
             "mass": [float(np.sum(pa.m)) / fluid.rho_l for pa in fluids],
             "sites": [value / unit for pa in application.particles if "activation" in pa.properties
                       for value in pa.activation]}
    if "heater" in effects:
        found["St"] = (effects["heater"].temperature - fluid.T_sat) / unit
    if "dynamic_nucleation" in effects:
        found["burst"] = effects["dynamic_nucleation"].onset(scene)[0] / unit
    if "loss" in effects:
        found["air"] = (effects["loss"].T_ambient - fluid.T_sat) / unit
        found["Bi"] = effects["loss"].coefficient * scheme.spacing / fluid.k_l
    if "venting" in effects and effects["venting"].T_feed is not None:
        found["feed"] = (effects["venting"].T_feed - fluid.T_sat) / unit
    return found


@pytest.mark.parametrize("name", BOILING)
def test_another_fluid_keeps_the_numbers_without_a_unit(name):
    water = numbers(built(name))
    assert len(water) >= 4
    for fluid in (ETHANOL, R134A):
        other = numbers(built(name, *fluid))
        assert set(other) == set(water)
        for number, value in water.items():
            np.testing.assert_allclose(other[number], value, rtol=2e-3, atol=1e-15, err_msg=number)  # four digits


@pytest.mark.parametrize("name", [name for name in scenes() if issubclass(scene_class(name), SceneApplication)])
def test_every_parameter_of_a_scene_says_whether_it_follows_from_the_fluid(name):
    for spec in dataclasses.fields(scene_class(name).Parameters):
        law = spec.metadata["law"]
        assert law is None or law in LAWS
        if not spec.metadata["temperature"]:
            assert (spec.metadata["unit"] == "K") is (law == "L/c_l"), spec.name
        assert (spec.metadata["unit"] in ("W/(m^2 K)", "N/m") or spec.name in ("time_scaling", "smallest_cavity",
                "largest_cavity")) is (law not in (None, "L/c_l")), spec.name


def test_what_is_given_is_not_changed():
    app = built("steady_boiling", *ETHANOL, "--superheat", "50", "--heat.time-scaling", "7")
    fluid = app.material
    assert app.scheme.effects["heater"].temperature == fluid.T_sat + 50.0
    assert app.scheme.effects["heat"].time_scaling == 7.0
    assert "superheat" not in app.laws and set(app.laws) == {
        "subcooling", "time_scaling", "smallest_cavity", "largest_cavity"}
    absolute = built("steady_boiling", *ETHANOL, "--heater.temperature", "400")
    assert absolute.scheme.effects["heater"].temperature == 400.0
    variant = built("steady_boiling", *R134A).parameters  # --flat has an A of its own, 1000
    assert variant.time_scaling == pytest.approx(1000.0 * LAWS["rho_l c_l/k_l"](saturated("R134a", 3e5)) / LAWS[
        "rho_l c_l/k_l"](WATER_1ATM), rel=1e-3)


@pytest.mark.parametrize("options", [[], ["--material", "water"], ["--pressure", "101325"],
                                     ["--material", "Water", "--pressure", "101325"]])
def test_water_is_that_of_the_table_to_the_last_bit(options):
    app, plain = built("superheat_sites", *options), built("superheat_sites")
    assert app.material is app.scheme.material is WATER_1ATM and not app.laws
    assert app.parameters == plain.parameters and app.scheme.effects == plain.scheme.effects
    assert app.scheme.effects["loss"].T_ambient == 293.15


def test_water_at_another_pressure():
    app = built("steady_boiling", "--pressure", "2e5")
    assert app.material.name == "Water at 200 kPa" and app.material.T_sat == pytest.approx(393.36, abs=0.01)


@pytest.mark.parametrize(("name", "options", "said"), [
    ("dam_break", ETHANOL, "dam_break cannot have another --material or --pressure: it computes motion alone"),
    ("steady_boiling", ["--material", "etanol"], "no fluid 'etanol' in CoolProp; did you mean 'ethanol'?"),
    ("steady_boiling", ["--pressure", "1e9"], "pressure of Water must be"),
    ("geyser", ["--flat", "--material", "hydrogen"],
     "--heater.temperature must be below the critical point of Hydrogen at 101.325 kPa, 33.14"),
    ("steady_boiling", ["--flat", *R134A, "--superheat", "101"],
     "--heater.temperature must be below the critical point of R134a at 300 kPa, 374.2"),
    ("explosive_boiling", [*R134A, "--flat", "--superheat", "150"], "temperature of liquid R134a at 300 kPa must lie"),
    ("cooling", ["--material", "nitrogen"], "--loss.T-ambient must be >= 79.0 K"),
    ("bubble_rise", ["--demo", *ETHANOL, "--oscillation.form", "rayleigh_plesset"],
     "give --oscillation.pressure and --oscillation.kappa, whose defaults are those of steam at one atmosphere; "
     "Ethanol at 200 kPa has 200000 Pa and 1.1"),
    ("reuse_wcsph", ["--material", "etanol"], "no fluid 'etanol'"),
])
def test_what_a_scene_cannot_have_is_refused(name, options, said, tmp_path, capsys):
    assert main(["run", name, *options, "-d", str(tmp_path / "out")]) == 2
    assert said in " ".join(capsys.readouterr().err.split())
    assert name in HOSTED or not (tmp_path / "out").exists()


class Own(SteadyBoiling):
    """A scene whose scheme does not take the fluid of the run."""

    def make_scheme(self, p):
        scheme = super().make_scheme(p)
        return BoilingScheme(["fluid"], ["wall"], dim=p.dim, spacing=p.spacing, sites=["sites"], **scheme.effects)


class Alcohol(SteadyBoiling):
    """A scene that is tuned for ethanol."""

    material = saturated("ethanol", 2e5)


def test_scenes_of_the_user():
    assert "superheat" in Own().resolve(["--flat"])
    with pytest.raises(ValueError, match="its make_scheme gives the scheme water at 1 atm, not self.material"):
        Own().resolve(["--flat", *ETHANOL])
    app = Alcohol()
    app.resolve(["--flat"])
    assert app.scheme.material is Alcohol.material and app.parameters.superheat == 60.0 and not app.laws
    app.resolve(["--flat", "--material", "water"])
    assert app.scheme.material is WATER_1ATM and app.parameters.superheat == pytest.approx(123.2, abs=0.1)


def test_the_gas_of_a_bubble_is_that_of_the_fluid():
    app = scene_class("pulsating_boil")()
    app.resolve([*R134A])
    oscillation, fluid = app.scheme.effects["oscillation"], app.material
    assert (oscillation.pressure, oscillation.kappa) == (3e5, fluid.kappa)
    bubble = oscillation.bubble(app.scheme.scene())
    assert (bubble.rho, bubble.sigma, bubble.mu) == (fluid.rho_l, fluid.sigma, fluid.mu_l)
    app.resolve([])
    assert app.scheme.effects["oscillation"] == Oscillation(form="rayleigh_plesset", slowdown=50.0)
    assert app.scheme.effects["expansion"] == Expansion(v_exp=1.5)


def test_record_has_the_fluid_and_all_its_constants():
    app = built("steady_boiling", *R134A, "--superheat", "20")
    constants = json.loads(json.dumps(app.scheme.material.constants()))
    assert {name: row["value"] for name, row in constants.items()} == {
        name: getattr(app.material, name) for name in app.material.UNITS}
    assert constants["pressure"] == {"value": 3e5, "unit": "Pa"} and len(constants) == len(app.material.UNITS) == 15
    rows = app.recorded_parameters()
    assert rows["subcooling"]["in_proportion_to"] == "L/c_l" and "in_proportion_to" not in rows["superheat"]


def stored(application):
    """What run.json holds of an application, as far as :func:`compare` reads it."""
    return json.loads(json.dumps({
        "scene": "steady_boiling", "arguments": ["--flat"], **application.recorded,
        "material": application.scheme.material.name, "constants": application.scheme.material.constants()}))


def test_run_of_another_fluid_is_not_resumed():
    water, ethanol = (built("steady_boiling", *options) for options in ((), ETHANOL))
    assert compare(ethanol, stored(ethanol), 1.0) == []
    with pytest.raises(ValueError, match=r"another --material \(it was Ethanol at 200 kPa and would become water at "
                                         r"1 atm\)\. It was started with: --flat"):
        compare(water, stored(ethanol), 1.0)
    older = stored(water)
    del older["constants"]
    assert compare(water, older, 1.0) == []
    changed = stored(water)
    changed["constants"]["c_v"]["value"] = 2030.0
    with pytest.raises(ValueError, match=r"another c_v of water at 1 atm \(it was 2030.0 J/\(kg K\) and would become"):
        compare(water, changed, 1.0)


@pytest.mark.parametrize("name", HOSTED)
def test_guest_in_another_scheme_has_the_fluid(name):
    app = scene_class(name)()
    app.set_args([option("material"), "R134a", "--pressure", "3e5"])
    app._parse_command_line(force=True)
    app.consume_user_options()
    app.configure_scheme()
    fluid = saturated("R134a", 3e5)
    arrays = app.create_particles()
    assert app.scheme.rho0 == fluid.rho_l == arrays[0].rho[0] and app.guest.scheme.material == fluid
    effects = app.guest.scheme.effects
    assert fluid.c_l * (effects["heater"].temperature - fluid.T_sat) / fluid.L == pytest.approx(
        WATER_1ATM.c_l * 60.0 / WATER_1ATM.L, rel=1e-3)
    assert arrays[0].T[0] == effects["venting"].T_feed < fluid.T_sat

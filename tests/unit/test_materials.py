"""Materials: what is refused, and that water is water."""
import dataclasses

import pytest

from pysph_boiling.materials import WATER_1ATM, Material

CONSTANTS = [field.name for field in dataclasses.fields(Material) if field.name != "name"]


def test_water_at_one_atmosphere():
    assert dataclasses.asdict(WATER_1ATM) == dict(
        name="water at 1 atm", T_sat=373.15, T_crit=647.1, rho_l=958.0, rho_v=0.597, c_l=4216.0, c_v=2030.0, k_l=0.679,
        k_v=0.025, L=2.257e6, sigma=0.0589, mu_l=2.8e-4, mu_v=1.2e-5, beta=7.5e-4)


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
@pytest.mark.parametrize("name", CONSTANTS)
def test_constant_that_is_not_positive_and_finite_is_refused(name, value):
    unit = Material.UNITS[name].replace("^", r"\^").replace("(", r"\(").replace(")", r"\)")
    with pytest.raises(ValueError, match=rf"^{name} of water at 1 atm must be > 0 {unit}, got {value}$"):
        WATER_1ATM.with_(**{name: value})


@pytest.mark.parametrize("T_sat", [647.1, 650.0])
def test_saturation_at_or_above_the_critical_temperature_is_refused(T_sat):
    with pytest.raises(ValueError, match=rf"T_sat must be below T_crit = 647\.1 K, got {T_sat} K"):
        WATER_1ATM.with_(T_sat=T_sat)


def test_with_changes_a_copy():
    thicker = WATER_1ATM.with_(mu_l=1, name="syrup")
    assert (thicker.mu_l, thicker.name, WATER_1ATM.mu_l) == (1.0, "syrup", 2.8e-4)
    assert type(thicker.mu_l) is float  # an int would change the type of a compiled attribute
    with pytest.raises(dataclasses.FrozenInstanceError):
        WATER_1ATM.L = 1.0
    with pytest.raises(TypeError, match="viscosity"):
        WATER_1ATM.with_(viscosity=1.0)


def test_every_constant_has_a_unit():
    assert list(Material.UNITS) == CONSTANTS

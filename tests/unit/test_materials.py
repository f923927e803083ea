"""Materials: what is refused, and that water is water."""
import dataclasses
import math
import re
from pathlib import Path

import numpy as np
import pytest
from CoolProp.CoolProp import PropsSI

from pysph_boiling.materials import WATER_1ATM, Material

CONSTANTS = [field.name for field in dataclasses.fields(Material) if field.name != "name"]


ATMOSPHERE = 101325.0  # Pa
COOLPROP = {  # constant -> name in CoolProp, and the quality of the state: 0 liquid, 1 vapour
    "rho_l": ("D", 0), "rho_v": ("D", 1), "c_l": ("C", 0), "c_v": ("C", 1), "k_l": ("L", 0), "k_v": ("L", 1),
    "sigma": ("I", 0), "mu_l": ("V", 0), "beta": ("isobaric_expansion_coefficient", 0)}
THREE_DIGITS = 5e-3  # half of the third digit, at a leading 1. Measured: 1.4e-3 (c_v), all others below
FOUR_DIGITS = 5e-4  # measured 2.3e-4 (L)


@pytest.mark.parametrize("name", COOLPROP)
def test_water_is_saturated_water_at_one_atmosphere(name):
    """Values of the IAPWS formulations, which CoolProp evaluates."""
    what, quality = COOLPROP[name]
    assert getattr(WATER_1ATM, name) == pytest.approx(
        PropsSI(what, "P", ATMOSPHERE, "Q", quality, "Water"), rel=THREE_DIGITS)


def test_water_boils_at_a_hundred_degrees_and_takes_its_latent_heat():
    liquid, vapour = (PropsSI("H", "P", ATMOSPHERE, "Q", quality, "Water") for quality in (0, 1))
    assert WATER_1ATM.L == pytest.approx(vapour - liquid, rel=FOUR_DIGITS)
    assert WATER_1ATM.T_crit == pytest.approx(PropsSI("Tcrit", "Water"), rel=FOUR_DIGITS)
    # 100 degrees Celsius: on the scale of 1990 water boils 0.026 K below that
    assert WATER_1ATM.T_sat == pytest.approx(PropsSI("T", "P", ATMOSPHERE, "Q", 0, "Water"), abs=0.03)


def test_every_constant_of_water_is_compared():
    assert set(COOLPROP) | {"L", "T_crit", "T_sat", "T_melt"} == set(CONSTANTS)


def test_water_melts_at_zero_degrees():
    assert WATER_1ATM.T_melt == pytest.approx(PropsSI("Ttriple", "Water"), abs=0.02)  # .01 K above: pressure lowers it


def _numbers(pattern):
    """Every number that stands at ``pattern`` in the documents and docstrings; at least one must."""
    root = Path(__file__).parents[2]
    text = " ".join(path.read_text(encoding="utf-8") for path in sorted(
        [root / "docs" / "limits.md", root / "docs" / "model.md", *(root / "pysph_boiling").rglob("*.py")]))
    found = [float(number.replace(",", "")) for number in re.findall(pattern, re.sub(r"\s+", " ", text))]
    assert found, pattern
    return found


def _superheat(dim):
    """Mean superheat [K] at which the heat of a region of two spacings is ten m_p L."""
    grid = np.indices((5,) * dim) - 2
    return 10.0 * WATER_1ATM.L / (np.count_nonzero(np.sum(grid**2, axis=0) <= 4) * WATER_1ATM.c_l)


@pytest.mark.parametrize("pattern, value", [
    (r"steam bubble of 4 mm (?:oscillates|rings) ([\d,]+)",  # Minnaert, of the bubble's gas at 1.33
     math.sqrt(3 * 1.33 * ATMOSPHERE / WATER_1ATM.rho_l) / (2 * math.pi * 4e-3)),
    (r"L/c_v (?:= |\()([\d,]+) K", WATER_1ATM.L / WATER_1ATM.c_v),
    (r"L/c_l (?:= |\()([\d,]+) K", WATER_1ATM.L / WATER_1ATM.c_l),
    (r"L/\(c_l - c_v\) = ([\d,]+) K", WATER_1ATM.L / (WATER_1ATM.c_l - WATER_1ATM.c_v)),
    (r"m_p L[:;] (\d+) K of superheat in 3-D", _superheat(3)),
    (r"in 3-D, (\d+) K \(past the critical point\) in 2-D", _superheat(2)),
    (r"(\d+) K for the 33 particles within 2 spacings", _superheat(3)),
    (r"and (\d+) K, which is beyond the critical point, for the 13", _superheat(2)),
    (r"density ratio of (\d+)", WATER_1ATM.rho_l / WATER_1ATM.rho_v),
    (r"water at 1 atm: (\d+)\)", WATER_1ATM.rho_l / WATER_1ATM.rho_v),
])
def test_numbers_in_the_documents_are_those_of_their_formulas(pattern, value):
    for number in _numbers(pattern):
        assert number == pytest.approx(value, rel=2e-3)  # written to three digits; the ratio 1602 as 1600


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
    assert (thicker.mu_l, thicker.name, WATER_1ATM.mu_l) == (1.0, "syrup", 2.82e-4)
    assert type(thicker.mu_l) is float  # an int would change the type of a compiled attribute
    with pytest.raises(dataclasses.FrozenInstanceError):
        WATER_1ATM.L = 1.0
    with pytest.raises(TypeError, match="viscosity"):
        WATER_1ATM.with_(viscosity=1.0)


def test_every_constant_has_a_unit():
    assert list(Material.UNITS) == CONSTANTS

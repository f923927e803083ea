"""What the figures of explosive boiling and the table of sensitivities measure, on made-up data."""
import math
from types import SimpleNamespace

import numpy as np
import pytest

from pysph_boiling.analysis.level import surface_level
from pysph_boiling.evaluation.reproduce.explosive import energy_parts, output_at_peak, settled
from pysph_boiling.evaluation.reproduce.sensitivity import bounds, bubble, grade, sensitivity
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.phases import Phase

L, C_L = WATER_1ATM.L, WATER_1ATM.c_l


def test_level_of_an_even_pool_is_its_height_and_drops_do_not_move_it():
    z = (np.arange(1000) + 0.5) * 1e-4  # a pool 0.1 m deep
    pool = SimpleNamespace(x=0 * z, y=0 * z, z=z)
    assert surface_level([pool], dim=3) == pytest.approx(0.1, rel=1e-3)
    assert surface_level([SimpleNamespace(y=1.2 * z)], dim=2) == pytest.approx(0.12, rel=1e-3)
    z[-10:] = 5.0  # 1 % of it flies
    assert surface_level([pool], dim=3) == pytest.approx(0.1, rel=2e-2)


def test_energy_parts_are_named_and_add_up():
    m = np.array([1.0, 2.0, 1.0, 1.0, 3.0, 1.0])
    e = np.array([-10.0 * C_L, 80.0 * C_L, 0.3 * L, 1.1 * L, 0.2 * L, 0.9 * L])
    phase = np.array([Phase.LIQUID, Phase.SUPERHEATED, Phase.TRANSITION, Phase.VAPOUR, Phase.SUPERHEATED,
                      Phase.VAPOUR])
    e_lat = np.array([0.0, 0.0, 0.0, 0.0, 0.15 * L, 0.0])
    parts = energy_parts(m, e, phase, e_lat)
    assert sum(parts.values()) == pytest.approx(np.sum(m * e), rel=1e-14)
    assert parts["excess sensible heat of superheated liquid"] == pytest.approx(160.0 * C_L + 3.0 * 0.05 * L)
    assert parts["latent heat of vapour"] == pytest.approx(1.9 * L)
    assert parts["latent heat stored in liquid"] == pytest.approx(0.3 * L + 3.0 * 0.15 * L)
    assert parts["sensible heat of vapour"] == pytest.approx(0.1 * L)
    assert parts["sensible heat of liquid below saturation"] == pytest.approx(-10.0 * C_L)


def test_swelling_of_a_level_and_what_is_left_of_it():
    t = np.linspace(0.0, 1.0, 11)
    level = 0.1 * np.array([1.0, 1.05, 1.1, 1.2, 1.15, 1.1, 1.08, 1.05, 1.05, 1.05, 1.05])
    assert settled(t, level) == pytest.approx((0.2, 0.3, 0.25))
    assert settled(t, np.full(11, 0.1)) == (0.0, 0.0, 0.0)


def test_output_at_the_peak_is_not_before_it():
    outputs, t = np.array([0.0, 0.1, 0.2]), np.array([0.0, 0.01, 0.1, 0.15])
    for number, at in (([0, 9, 8, 7], 0.1), ([0, 7, 9, 8], 0.1), ([0, 7, 8, 9], 0.2), ([9, 0, 0, 0], 0.0)):
        assert output_at_peak(outputs, t, np.array(number)) == at
    assert output_at_peak(outputs, np.array([0.3]), np.array([1])) == 0.2


@pytest.mark.parametrize("power, word", [(0.1, "low"), (-0.5, "moderate"), (2.0, "high")])
def test_sensitivity_is_the_power_of_a_power_law(power, word):
    values = np.array([5.0, 7.5, 10.0, 20.0])
    slope = sensitivity(values, 3.0 * values**power)
    assert slope == pytest.approx(power, abs=1e-12)
    assert grade(slope) == word


def test_sensitivity_leaves_out_what_has_no_logarithm():
    assert sensitivity([1.0, 2.0, 4.0], [4.0, 2.0, 0.0]) == pytest.approx(-1.0)
    assert math.isnan(sensitivity([1.0, 2.0], [1.0, 0.0]))


def test_bounds_are_the_papers():
    lower, upper = bounds(64, 3)
    at_rest = 0.4653 * 4.0
    assert (lower * at_rest, upper * at_rest) == pytest.approx((2.0 * 0.65, 2.0 * 1.05))
    assert bounds(64, 3, k_model=0.1)[0] * at_rest == pytest.approx(2.0 * 0.85)


def test_held_bubble_is_as_large_as_the_scene_makes_it():
    assert bubble(quick=True).n == 16  # 4 + 8 + 4 half-integer places within 2.5
    assert bubble(quick=False).n == 56  # 8 + 24 + 24

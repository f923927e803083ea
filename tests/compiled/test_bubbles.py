"""The table of bubbles, by hand: arrays are only read here, on the backend that is tested. All lengths in spacings."""
from types import SimpleNamespace

import numpy as np
import pytest
from harness import host_only

from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.particles import NO_BUBBLE, fluid_array
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.bubbles import bubble_table

VAPOUR = int(Phase.VAPOUR)


def vapour(points, label, *, m=1.0, T=WATER.T_sat, phase=VAPOUR):
    """An array as the table reads it: positions (n, 3) [m], labels, masses [kg], temperatures [K]."""
    pa = fluid_array(points, spacing=1.0, dim=2, rho0=WATER.rho_l)
    for name, kind, value in (("phase", "int", phase), ("bubble", "unsigned int", label),
                              ("e", "double", WATER.L + WATER.c_v * (np.asarray(T) - WATER.T_sat))):
        pa.add_property(name, type=kind)
        pa.get(name)[:] = value
    pa.m[:] = m
    return pa


def table(*arrays, dim=2, period=(0.0, 0.0, 0.0)):
    return bubble_table(arrays, SimpleNamespace(rho0=2.0, dim=dim, material=WATER), period)


SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])


@host_only
def test_table_of_four_points_in_a_square():
    T = WATER.T_sat + np.array([-10.0, 5.0, 0.0, -2.0])  # superheated vapour does not make up for the deficit
    bubbles = table(vapour(SQUARE + [3.0, 1.0, 0.5], 7, m=[1.0, 2.0, 3.0, 4.0], T=T))
    assert (bubbles.label, bubbles.n, bubbles.mass) == (7, 4, 10.0)
    np.testing.assert_allclose(bubbles.centroid, [[3.5, 1.5, 0.5]], rtol=1e-15)
    assert bubbles.mean_radius == pytest.approx(np.sqrt(0.5), rel=1e-15)
    assert bubbles.equivalent_radius == pytest.approx(np.sqrt(5.0 / np.pi), rel=1e-15)
    assert bubbles.deficit == pytest.approx(WATER.c_v * (1.0 * 10.0 + 4.0 * 2.0), rel=1e-12)  # L - e cancels 1e-2 of L


def test_equivalent_radius_is_that_of_a_sphere_in_3d():
    bubbles = table(vapour(SQUARE, 7, m=3.0), dim=3)
    assert bubbles.equivalent_radius == pytest.approx(np.cbrt(4.5 / np.pi), rel=1e-15)


@pytest.mark.parametrize("dim", [2, 3])
def test_equivalent_radius_swells_with_the_vapour(dim):
    """Two volumes for each particle make a sphere 26 % wider; of unlike swells the volumes add up."""
    pa = vapour(SQUARE, 7, m=3.0)
    pa.add_property("swell")
    pa.swell[:] = 1.0
    before = table(pa, dim=dim).equivalent_radius
    pa.swell[:] = 2.0
    assert table(pa, dim=dim).equivalent_radius == pytest.approx(before * 2.0 ** (1.0 / dim), rel=1e-14)
    pa.swell[:], pa.m[:] = [4.0, 1.0, 0.5, 0.5], [1.0, 2.0, 4.0, 4.0]
    other = table(pa, dim=dim)
    assert other.mass == 11.0
    assert other.equivalent_radius == pytest.approx(before * (10.0 / 12.0) ** (1.0 / dim), rel=1e-14)


@host_only
def test_table_of_several_bubbles_in_two_arrays():
    """Rows are sorted by label; liquid is left out; a bubble may lie in both arrays."""
    first = vapour(SQUARE, [5, 2, 2, NO_BUBBLE], phase=[VAPOUR, VAPOUR, VAPOUR, Phase.LIQUID])
    second = vapour(SQUARE + [0.0, 2.0, 0.0], [9, 2, 9, 9])
    bubbles = table(first, second)
    np.testing.assert_array_equal(bubbles.label, [2, 5, 9])
    np.testing.assert_array_equal(bubbles.n, [3, 1, 3])
    np.testing.assert_allclose(bubbles.centroid[:, :2], [[1.0, 1.0], [0.0, 0.0], [1 / 3, 8 / 3]], rtol=1e-15)
    np.testing.assert_allclose(bubbles.mean_radius[:2], [2.0 / 3.0, 0.0], atol=1e-15)


@host_only
@pytest.mark.parametrize("axis", [0, 1])
def test_table_of_a_bubble_across_a_periodic_border(axis):
    length, shift = 10.0, np.eye(3)[axis] * 9.5
    place = (SQUARE + shift) % length
    period = length * np.eye(3)[axis]
    bubbles = table(vapour(place, 7), period=period)
    np.testing.assert_allclose(bubbles.centroid[0] % length, (SQUARE.mean(0) + shift) % length, atol=1e-14)
    assert bubbles.mean_radius == pytest.approx(np.sqrt(0.5), rel=1e-14)
    assert table(vapour(place, 7)).mean_radius > 4.0  # without the period it is torn apart


def test_table_without_vapour_is_empty():
    bubbles = table(vapour(SQUARE, NO_BUBBLE, phase=Phase.LIQUID))
    assert len(bubbles.label) == len(bubbles.n) == len(bubbles.mean_radius) == 0
    assert bubbles.centroid.shape == (0, 3)

"""Sizes and radii of bubbles, by hand: arrays are only read, on the backend that is tested. Lengths are in spacings."""
from types import SimpleNamespace

import numpy as np
import pytest
from harness import host_only

from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.particles import NO_BUBBLE, fluid_array
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.bubbles import Departures, equivalent_radius, mean_radius
from pysph_boiling.schemes.vapour import Vapour

VAPOUR = int(Phase.VAPOUR)


def vapour(points, label, *, m=1.0, phase=VAPOUR):
    """An array with positions (n, 3) [m], labels and masses [kg]."""
    pa = fluid_array(points, spacing=1.0, dim=2, rho0=WATER.rho_l)
    for name, kind, value in (("phase", "int", phase), ("bubble", "unsigned int", label), ("departed", "int", 0)):
        pa.add_property(name, type=kind)
        pa.get(name)[:] = value
    pa.m[:] = m
    return pa


def bubbles_of(*arrays, dim=2, period=(0.0, 0.0, 0.0)):
    """The bubbles, and the scene that gives their density, dimension and period."""
    return Vapour(arrays), SimpleNamespace(rho0=2.0, dim=dim, period=period)


SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])


@host_only
def test_bubble_of_four_points_in_a_square():
    bubbles, scene = bubbles_of(vapour(SQUARE + [3.0, 1.0, 0.5], 7, m=[1.0, 2.0, 3.0, 4.0]))
    assert (bubbles.label, bubbles.n, bubbles.sum(bubbles.get("m"))) == (7, 4, 10.0)
    np.testing.assert_allclose(bubbles.places(scene.period)[1], [[3.5, 1.5, 0.5]], rtol=1e-15)
    assert mean_radius(bubbles, scene) == pytest.approx(np.sqrt(0.5), rel=1e-15)
    assert equivalent_radius(bubbles, scene) == pytest.approx(np.sqrt(5.0 / np.pi), rel=1e-15)


def test_equivalent_radius_is_that_of_a_sphere_in_3d():
    radius = equivalent_radius(*bubbles_of(vapour(SQUARE, 7, m=3.0), dim=3))
    assert radius == pytest.approx(np.cbrt(4.5 / np.pi), rel=1e-15)


@pytest.mark.parametrize("dim", [2, 3])
def test_equivalent_radius_swells_with_the_vapour(dim):
    """Two volumes for each particle make a sphere 26 % wider; of unlike swells the volumes add up."""
    pa = vapour(SQUARE, 7, m=3.0)
    pa.add_property("swell")
    pa.swell[:] = 1.0
    before = equivalent_radius(*bubbles_of(pa, dim=dim))
    pa.swell[:] = 2.0
    after = equivalent_radius(*bubbles_of(pa, dim=dim))
    assert after == pytest.approx(before * 2.0 ** (1.0 / dim), rel=1e-14)
    pa.swell[:], pa.m[:] = [4.0, 1.0, 0.5, 0.5], [1.0, 2.0, 4.0, 4.0]
    other = equivalent_radius(*bubbles_of(pa, dim=dim))
    assert other == pytest.approx(before * (10.0 / 12.0) ** (1.0 / dim), rel=1e-14)


@host_only
def test_several_bubbles_in_two_arrays():
    """Bubbles are sorted by label; liquid is left out; a bubble may lie in both arrays."""
    first = vapour(SQUARE, [5, 2, 2, NO_BUBBLE], phase=[VAPOUR, VAPOUR, VAPOUR, Phase.LIQUID])
    second = vapour(SQUARE + [0.0, 2.0, 0.0], [9, 2, 9, 9])
    bubbles, scene = bubbles_of(first, second)
    np.testing.assert_array_equal(bubbles.label, [2, 5, 9])
    np.testing.assert_array_equal(bubbles.n, [3, 1, 3])
    centroid = bubbles.places(scene.period)[1]
    np.testing.assert_allclose(centroid[:, :2], [[1.0, 1.0], [0.0, 0.0], [1 / 3, 8 / 3]], rtol=1e-15)
    np.testing.assert_allclose(mean_radius(bubbles, scene)[:2], [2.0 / 3.0, 0.0], atol=1e-15)


@host_only
@pytest.mark.parametrize("axis", [0, 1])
def test_bubble_across_a_periodic_border(axis):
    length, shift = 10.0, np.eye(3)[axis] * 9.5
    place = (SQUARE + shift) % length
    period = length * np.eye(3)[axis]
    bubbles, scene = bubbles_of(vapour(place, 7), period=period)
    centroid = bubbles.places(scene.period)[1]
    np.testing.assert_allclose(centroid[0] % length, (SQUARE.mean(0) + shift) % length, atol=1e-14)
    assert mean_radius(bubbles, scene) == pytest.approx(np.sqrt(0.5), rel=1e-14)
    assert mean_radius(*bubbles_of(vapour(place, 7))) > 4.0  # without the period it is torn apart


def test_without_vapour_there_are_no_bubbles():
    bubbles, scene = bubbles_of(vapour(SQUARE, NO_BUBBLE, phase=Phase.LIQUID))
    assert len(bubbles.label) == len(bubbles.n) == len(mean_radius(bubbles, scene)) == 0
    assert bubbles.places(scene.period)[1].shape == (0, 3)


# --- how they depart --------------------------------------------------------------------------------------------------


def departures(*arrays, sites=((6.0, 0.0, 0.0), (0.0, 0.0, 0.0), (3.0, 0.0, 0.0)), period=(0.0, 0.0, 0.0)):
    """The tool that records departures, and a function that ends a step after changing the first array."""
    pa = fluid_array(np.array(sites), spacing=1.0, dim=2, rho0=WATER.rho_l, name="sites")
    scheme = SimpleNamespace(arrays=list(arrays), sites=["sites"], scene=lambda: SimpleNamespace(
        up=(0.0, 1.0, 0.0), period=np.array(period)))
    tool = Departures(scheme, clearance=2.4)
    solver = SimpleNamespace(particles=[*arrays, pa], t=1.0, dt=0.1)
    tool.pre_step(solver)

    def step(dx=0.0, dy=0.0, label=None):
        arrays[0].x[:] += dx
        arrays[0].y[:] += dy
        if label is not None:
            arrays[0].bubble[:] = label
        tool.pre_step(solver)
        tool.post_step(solver)
        solver.t += solver.dt
        return tool.events

    return step


@host_only
def test_a_bubble_departs_once_and_from_the_site_next_to_its_lowest_particle():
    """Sites are numbered by x. Two particles of four bridge to the right, but the lowest is above the site at x = 3."""
    step = departures(vapour([[2.5, 1, 0], [3, 2, 0], [5, 2, 0], [6, 2, 0]], 7))
    assert step() == [] and step(dy=1.3) == []  # 2.3 above the sites
    assert step(dy=0.2) == [(pytest.approx(1.3), 4, 1)]
    step(dy=3.0)
    assert len(step(label=[7, 7, 8, 8])) == 1  # it splits as it rises


@host_only
def test_a_bubble_that_hovers_departs_once_and_new_vapour_in_it_departs_too():
    """It sinks back to its site twice, then most of it condenses there and becomes vapour anew."""
    pa = vapour([[3, 1, 0], [3, 2, 0], [4, 2, 0], [2, 2, 0]], 7)
    step = departures(pa)
    for _ in range(3):
        assert len(step(dy=1.5)) == 1 and pa.departed.tolist() == [1] * 4
        step(dy=-1.5)
    pa.phase[:3] = Phase.LIQUID
    step()
    assert pa.departed.tolist() == [0, 0, 0, 1]
    pa.phase[:3] = VAPOUR
    step()
    assert [n for _, n, _ in step(dy=1.5)] == [4, 4]


@host_only
def test_what_leaves_a_remainder_departs_and_what_forms_above_does_not():
    step = departures(vapour([[0.2, 3, 0], [0.2, 4, 0], [0.2, 5, 0], [0.2, 2, 0], [5, 9, 0]], [3, 3, 3, 3, 9]))
    assert step() == []
    assert step(label=[3, 3, 3, 4, 9]) == [(pytest.approx(1.2), 3, 0)]


@host_only
def test_the_site_is_the_nearest_image_in_a_periodic_domain():
    step = departures(vapour([[9.5, 2, 0], [9.5, 3, 0]], 7), period=(10.0, 0.0, 0.0))
    assert [site for *_, site in step(dy=1.0)] == [0]

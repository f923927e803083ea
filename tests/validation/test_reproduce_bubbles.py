"""What is read off the bubbles of a run, on made-up bubbles: shape, speed, pulsation, mergers and splits."""
from types import SimpleNamespace

import numpy as np
import pytest

from pysph_boiling.analysis.shapes import fall, lasting, mendelson, merger, pulsation, rise_speed, shapes, split
from pysph_boiling.evaluation.reproduce.single_bubbles import budget, rise
from pysph_boiling.particles import NO_BUBBLE
from pysph_boiling.phases import Phase

DX, RHO = 0.002, 958.0


def fluid(*clouds, dim, swell=1.0):
    """A stand-in for a fluid array: clouds (n, 3) of vapour, one bubble each, and ten particles of liquid far away."""
    places = [*clouds, np.full((10, 3), 100.0)]
    label = np.concatenate([np.full(len(cloud), number * 1000) for number, cloud in enumerate(places)])
    x, y, z = np.concatenate(places).T
    phase = np.where(label < len(clouds) * 1000, int(Phase.VAPOUR), int(Phase.LIQUID))
    columns = dict(x=x, y=y, z=z, m=np.full(len(x), RHO * DX**dim), phase=phase, swell=np.full(len(x), swell),
                   bubble=np.where(phase == Phase.VAPOUR, label, NO_BUBBLE))
    return SimpleNamespace(properties=columns, **columns)


def ellipse(dim, semi, centre=(0.0, 0.0, 0.0)):
    """Points of a fine lattice in an ellipse or ellipsoid with semi-axes ``semi`` (dim,)."""
    axis = np.arange(-1.0, 1.0, 0.04) + 0.02
    unit = np.zeros((len(axis) ** dim, 3))
    unit[:, :dim] = np.stack(np.meshgrid(*[axis] * dim, indexing="ij"), -1).reshape(-1, dim)
    unit = unit[np.linalg.norm(unit, axis=1) < 1.0]
    unit[:, :dim] *= semi
    return unit + centre


@pytest.mark.parametrize("dim, semi, volume", [(2, (3.0, 1.5), np.pi * 4.5),
                                               (3, (3.0, 3.0, 2.0), 4.0 / 3.0 * np.pi * 18.0)])
def test_shape_of_an_ellipse(dim, semi, volume):
    cloud = ellipse(dim, semi, (5.0, 6.0, 0.0 if dim == 2 else 7.0))
    small = ellipse(dim, np.full(dim, 0.3))[::3]
    one, two = shapes(fluid(small, cloud, dim=dim, swell=2.0), dim, RHO)
    assert (one.label, one.n, two.n) == (1000, len(cloud), len(small))
    assert one.volume == pytest.approx(2.0 * len(cloud) * DX**dim, rel=1e-12)
    np.testing.assert_allclose(one.centroid[:2], (5.0, 6.0), atol=1e-12)
    assert (one.width, one.height) == pytest.approx((2.0 * semi[0], 2.0 * semi[-1]), rel=2e-2)  # lattice of 25 a radius
    assert one.aspect == pytest.approx(semi[0] / semi[-1], rel=2e-2)
    assert one.occupied == pytest.approx(volume, rel=4e-2)


@pytest.mark.parametrize("axis", [0, 1])
def test_shape_does_not_know_where_a_periodic_domain_ends(axis):
    period = 10.0 * np.eye(3)[axis]
    whole = ellipse(2, (2.0, 1.5), (5.0, 5.0, 0.0))
    split = np.where(period > 0.0, (whole + 0.5 * period) % np.where(period > 0.0, period, 1.0), whole)
    assert np.ptp(split[:, axis]) > 9.0
    (want,), (got,) = shapes(fluid(whole, dim=2), 2, RHO), shapes(fluid(split, dim=2), 2, RHO, period)
    assert (got.width, got.height, got.mean_radius, got.occupied) == pytest.approx(
        (want.width, want.height, want.mean_radius, want.occupied), rel=1e-12)
    assert (got.centroid[axis] + 5.0) % 10.0 == pytest.approx(5.0, abs=1e-9)


def test_mean_radius_of_a_sphere_is_three_quarters_of_its_radius():
    (one,) = shapes(fluid(ellipse(3, (2.0, 2.0, 2.0)), dim=3), 3, RHO)
    assert one.mean_radius == pytest.approx(1.5, rel=1e-2)


def test_a_fluid_without_vapour_has_no_shapes():
    assert shapes(fluid(dim=2), 2, RHO) == []


def test_rise_speed_is_that_between_the_heights():
    t = np.linspace(0.0, 1.0, 50)
    height = np.where(t < 0.3, 0.1 * t, 0.03 + 0.25 * (t - 0.3))
    assert rise_speed(t, height, 0.05, 0.15) == pytest.approx(0.25, rel=1e-9)
    assert np.isnan(rise_speed(t, height, 0.9, 1.0))


def test_mendelson_for_large_bubbles_is_davies_and_taylor():
    assert mendelson(0.01, sigma=0.0589, rho=958.0) == pytest.approx(0.707 * np.sqrt(9.81 * 0.02), rel=0.04)
    assert mendelson(0.0025, sigma=0.0589, rho=958.0) == pytest.approx(np.sqrt(0.024525 + 0.024593), rel=1e-3)


def test_pulsation_finds_amplitude_and_period_on_a_trend():
    t = np.linspace(0.0, 0.6, 37)
    noise = np.random.default_rng(1).normal(0.0, 0.002, len(t))
    values = 5.0 * (1.0 + 0.04 * np.sin(2.0 * np.pi * t / 0.17 + 1.0) + noise) + 0.5 * t + 0.8 * t**2
    amplitude, period, share = pulsation(t, values, np.linspace(0.1, 0.3, 81))
    assert amplitude == pytest.approx(0.04 * 5.0 / values.mean(), rel=0.05)
    assert period == pytest.approx(0.17, rel=0.03)
    assert share > 0.95
    steady = pulsation(t, 5.0 + 0.5 * t + noise, np.linspace(0.1, 0.3, 81))
    assert steady[0] < 0.1 * amplitude and steady[2] < 0.6
    assert np.all(np.isnan(pulsation(t, values, [0.5])))  # 0.6 s is no period and a half


def test_lasting_asks_for_time():
    t = np.arange(10) * 0.1
    holds = np.array([0, 1, 0, 0, 1, 1, 1, 1, 1, 1], bool)
    assert lasting(t, holds, 0.3) == pytest.approx(0.4)
    assert np.isnan(lasting(t, holds, 0.6))


def test_a_bubble_sinks_until_it_bursts_and_what_is_left_of_it_does_not_count():
    history = {"n1": np.array([100.0, 100.0, 95.0, 8.0, 8.0]), "height1": np.array([5.0, 4.8, 9.0, 3.0, 4.0])}
    assert fall(history) == pytest.approx(0.2)
    assert fall({name: values[:3] for name, values in history.items()}) == pytest.approx(0.2)
    assert fall(history | {"n1": np.full(5, 100.0)}) == pytest.approx(6.0)


def made_up(bubbles, whole, n2, dt=0.02):
    """A history with the columns that events are read from; two particles are in no bubble of its own."""
    return {"t": dt * np.arange(len(bubbles)), "bubbles": np.array(bubbles, float), "whole": np.array(whole, float),
            "n": np.array(whole, float) + 2.0, "n2": np.array(n2, float)}


def test_merger_and_split_with_their_volumes():
    joined = made_up([2, 2, 2, 2, 2, 1, 2, 1, 1, 1, 1], [60] * 5 + [61, 61] + [62] * 4,
                     [20] * 5 + [np.nan, 20] + [np.nan] * 4)
    event = merger(joined)
    assert (event.t, event.before, event.after, event.smaller) == (pytest.approx(0.14), 63, 64, 20)
    assert event.satellites == 2 and event.ratio == pytest.approx(64 / 63)
    assert split(joined) is None, "two from the start is no split"

    torn = made_up([1, 1, 2, 1, 1, 2, 2, 3, 3], [80, 80, 79, 80, 80, 78, 78, 79, 79],
                   [np.nan, np.nan, 9, np.nan, 1, 30, 30, 25, 25])
    event = split(torn)
    assert (event.t, event.before, event.after, event.smaller) == (pytest.approx(0.1), 82, 80, 30)
    assert merger(torn) is None


def test_measures_of_a_rise():
    fill, period = 0.1, 0.14
    t = np.arange(0.0, 0.5, 1.0 / 60.0)
    history = {"t": t, "height1": 0.01 + 0.2 * t, "volume1": np.full(len(t), 50 * DX**2), "n1": np.full(len(t), 49.0),
               "n": np.full(len(t), 50.0), "aspect1": np.full(len(t), 1.7),
               "mean_radius1": 0.005 * (1.0 + 0.06 * np.cos(2.0 * np.pi * t / period)),
               "occupied1": 50 * DX**2 * (1.0 + 0.1 * np.cos(2.0 * np.pi * t / period))}
    found = rise(history, dim=2, spacing=DX, fill=fill, period=period)
    assert found["speed"] == pytest.approx(0.2) and found["upper"] == pytest.approx(found["lower"])
    assert found["law"] == pytest.approx(mendelson(np.sqrt(50.0 / np.pi) * DX, sigma=0.0589, rho=958.0), rel=1e-3)
    assert found["amplitude"] == pytest.approx(0.06, rel=0.02) and found["period"] == pytest.approx(period, rel=0.05)
    assert found["swing"] == pytest.approx(0.1, rel=0.02)
    assert (found["fall"], found["whole"], found["aspect"]) == (0.0, pytest.approx(0.98), pytest.approx(1.7))


def test_budget_counts_every_particle_of_vapour():
    last = dict(n_vapour=[30.0, 12.0], n_nucleated=[0.0, 5.0], n_burst=[0.0, 3.0], n_condensed=[0.0, 2.0],
                n_vented=[0.0, 24.0])
    result = SimpleNamespace(results={name: np.array(column) for name, column in last.items()})
    assert budget(result, {"n": np.array([30.0, 25.0])}) == 0.0
    assert budget(result, {"n": np.array([31.0, 25.0])}) == -1.0

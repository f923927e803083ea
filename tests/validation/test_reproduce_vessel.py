"""What figures 1, 3, 4, 13, 14 and 15 measure, on made-up tables whose answers are known."""
import numpy as np
import pytest

from pysph_boiling.evaluation.reproduce import modes, sites, steady
from pysph_boiling.particles import fluid_array
from pysph_boiling.phases import Phase
from pysph_boiling.results import Quantities

T = np.linspace(0.01, 4.0, 400)


# --- tables -----------------------------------------------------------------------------------------------------------


def test_means_and_rates_of_a_window():
    table = {"t": T, "count": 3.0 * T, "total": T**2}
    assert sites.mean_between(table, "count", 1.0, 3.0) == pytest.approx(6.0)
    assert sites.rate_between(table, "total", 1.0, 3.0) == pytest.approx(4.0)
    values, deviation = steady.variation(table, "total", 1.0, 3.0, 2)
    np.testing.assert_allclose(values, [3.0, 5.0])
    assert deviation == pytest.approx(0.25)
    assert steady.variation(table | {"total": 0.0 * T}, "total", 1.0, 3.0, 2)[1] == np.inf


def test_production_counts_every_way_to_vapour_and_back():
    table = {"t": T, "n_nucleated": 5.0 * T, "n_burst": 2.0 * T, "n_emitted": T, "n_condensed": 3.0 * T}
    np.testing.assert_allclose(sites.production(table)["produced"], 5.0 * T)
    saved = Quantities("column", {"t": T, "n_nucleated": T}, {})  # as a run on disk has them
    np.testing.assert_allclose(sites.production(saved)["produced"], T)


@pytest.mark.parametrize(("x", "y", "ranks"), [
    ([1, 4, 9, 16], [10.0, 20.0, 15.0, 40.0], ([0, 1, 2, 3], [0, 2, 1, 3])),
    ([1, 1, 4, 4, 9, 9], [3.0, 5.0, 5.0, 5.0, 9.0, 2.0], ([0.5, 0.5, 2.5, 2.5, 4.5, 4.5], [1, 3, 3, 3, 5, 0])),
    ([3, 2, 1], [1, 2, 3], ([2, 1, 0], [0, 1, 2])),
])
def test_rank_correlation_is_spearmans(x, y, ranks):
    assert sites.rank_correlation(x, y) == pytest.approx(np.corrcoef(*ranks)[0, 1])


def test_nothing_correlates_with_what_does_not_vary():
    assert sites.rank_correlation([1, 2, 3], [5.0, 5.0, 5.0]) == 0.0


@pytest.mark.parametrize(("values", "similar", "rising"), [
    ({1: [100.0, 104.0], 4: [110.0, 106.0], 9: [112.0, 115.0], 16: [120.0, 121.0]}, True, True),
    ({1: [50.0, 60.0], 4: [90.0, 100.0], 9: [110.0, 115.0], 16: [120.0, 121.0]}, False, True),
    ({1: [120.0, 121.0], 4: [110.0, 106.0], 9: [112.0, 115.0], 16: [100.0, 104.0]}, True, False),
    ({1: [0.0], 4: [0.0], 9: [0.0], 16: [0.0]}, True, False),
])
def test_verdicts_on_the_number_of_sites(values, similar, rising):
    assert (sites.difference(values) <= sites.SIMILAR, sites.rises(values)[0]) == (similar, rising)


@pytest.mark.parametrize(("column", "agrees", "ratio"), [
    (np.minimum(T, 1.0), True, 1.0),
    (T, False, 10.0 / 6.0),
    (0.0 * T, True, 1.0),
    (np.maximum(T - 3.0, 0.0), False, np.inf),
])
def test_bounded(column, agrees, ratio):
    assert modes.bounded({"t": T, "count": column}, "count") == (agrees, pytest.approx(ratio, rel=0.01))


def test_onset_and_end_of_boiling():
    table = {"t": T, "n_vapour": 10.0 * ((T > 1.0) & (T < 3.005))}
    assert modes.onset(table) == pytest.approx(1.01)
    assert steady.gone_after(table, 2.0) == pytest.approx(1.01)
    assert steady.gone_after(table, 3.5) == 0.0
    assert steady.gone_after(table | {"n_vapour": T}, 2.0) is None
    never = table | {"n_vapour": 0.0 * T}
    assert modes.onset(never) == T[-1] and steady.gone_after(never, 2.0) == 0.0


def test_peak_and_plateau_of_a_mean_radius():
    since = np.maximum(T - 0.4, 0.0)  # the first bubble
    radius = np.where(since > 0.0, 5e-3 + 4e-3 * np.exp(-((since - 0.9) / 0.5) ** 2), 0.0)
    peak, when, level, change = steady.phases_of_growth(T, radius)
    assert peak == pytest.approx(9e-3, rel=0.02) and when == pytest.approx(0.25, abs=0.01)
    assert level == pytest.approx(5e-3, rel=1e-3) and abs(change) < 1e-3
    peak, when, level, change = steady.phases_of_growth(T, 1e-3 * T)  # it only grows
    assert peak < level and change == pytest.approx((4.0 / 3.0) / (5.0 / 6.0 * 4.0), rel=0.1)
    with pytest.raises(ValueError, match="no bubble"):
        steady.phases_of_growth(T, 0.0 * T)


@pytest.mark.parametrize("quick", [True, False])
def test_figures_share_runs_of_one_name(quick):
    figures = [sites.Sites(), modes.ModesPictures(), modes.ModesCounts(), steady.SteadyBoiling(), steady.BubbleRadius()]
    asked = [run for figure in figures for run in figure.runs(quick)]
    ensemble = len(sites.seeds(quick))
    # as many sites, three models, steady boiling and the superheated start with and without oscillation
    assert len({run.name for run in asked}) == len(set(asked)) == ensemble * (len(sites.counts(quick)) + 3 + 2 + 2)
    assert set(modes.ModesPictures().runs(quick)) == set(modes.ModesCounts().runs(quick))


# --- surfaces ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dim", [2, 3])
def test_surface_of_a_pool_with_a_step(dim):
    """Half of the pool stands four spacings higher; the two upper layers move, and vapour above does not count."""
    dx, cells = 0.1, (12, 12)[: dim - 1]
    points = dx * (np.indices((*cells, 14)).reshape(dim, -1).T + 0.5)
    height = np.where(points[:, 0] < 0.6, 10, 6) * dx
    vapour = points[:, -1] > height
    points = np.column_stack([points, np.zeros((len(points), 3 - dim))])
    fluid = fluid_array(points, spacing=dx, dim=dim, rho0=1000.0)
    for name, values in (("phase", np.where(vapour, Phase.VAPOUR, Phase.LIQUID)), ("u", 7.0 * vapour)):
        fluid.add_property(name, type="int" if name == "phase" else "double", data=values)
    upper = ~vapour & (points[:, dim - 1] > height - 2.0 * dx)
    fluid.w[:] = upper * np.where(points[:, 0] < 0.6, 0.3, 0.1)
    level, roughness, speed = steady.surface(fluid, dim=dim, spacing=dx)
    assert (level, roughness) == (pytest.approx(0.75), pytest.approx(0.2))
    assert speed == pytest.approx(np.sqrt(0.5 * (0.3**2 + 0.1**2)))

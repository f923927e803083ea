"""What the comparison with other codes measures by: pure functions, no other code needed."""
import sys
from pathlib import Path

import numpy as np
import pytest
from pysph.base.kernels import CubicSpline

from pysph_boiling.particles import akinci_volume, box_vessel, fluid_block, lattice_density

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import peers  # noqa: E402
import scenes  # noqa: E402


@pytest.fixture(scope="module")
def scene():
    return scenes.Scene("column", (4, 4, 6), (6, 6, 9), 1.0, 0.5)


def test_kernel_is_that_of_pysph():
    kernel, h = CubicSpline(dim=3), 0.03
    for r in np.linspace(0.0, 2.2 * h, 12):
        assert scenes.cubic_spline(r, h) == pytest.approx(kernel.kernel(xij=[r, 0, 0], rij=r, h=h), abs=1e-9 / h**3)


def test_walls_and_their_volumes_are_those_of_a_vessel(scene):
    kernel = CubicSpline(dim=3)
    vessel = box_vessel((0.0,) * 3, scene.size, spacing=scene.spacing, dim=3, rho0=1000.0, kernel=kernel, hdx=1.0)
    np.testing.assert_allclose(np.stack([vessel.x, vessel.y, vessel.z], -1), scene.wall, atol=1e-12)
    volume = akinci_volume(scene.wall, kernel, h=scene.h, dim=3)
    np.testing.assert_allclose(scene.wall_volume, volume, rtol=1e-6)  # akinci_volume rounds distances


def test_a_lattice_is_at_rest_and_a_squeezed_one_is_denser(scene):
    """Inside, far from walls and surface: 0 on the lattice; squeezed by s in one direction, the lattice sum itself."""
    size = np.array([9, 9, 9]) * scene.spacing
    block = fluid_block((0, 0, 0), size, spacing=scene.spacing, dim=3, rho0=1000.0)
    points = np.stack([block.x, block.y, block.z], -1)
    middle = np.argmin(np.linalg.norm(points - 0.5 * size, axis=1))
    away = points + 100.0  # far from the tank
    assert scenes.compression(scene, away)[middle] == pytest.approx(0.0, abs=1e-9)
    squeezed = (away - 100.0) * 0.98 + 100.0
    expected = lattice_density(CubicSpline(dim=3), dim=3, hdx=1.0 / 0.98)[0] / 0.98**3 / lattice_density(
        CubicSpline(dim=3), dim=3, hdx=1.0)[0] - 1.0
    assert expected > 0.05
    assert scenes.compression(scene, squeezed)[middle] == pytest.approx(expected, rel=1e-9)


def test_walls_count_in_the_density(scene):
    """A fluid lattice that goes on where the walls are: what the walls add is their kernel sum, by hand."""
    point = np.array([[3.0, 3.0, 0.5]]) * scene.spacing
    near = np.linalg.norm(scene.wall - point, axis=1)
    by_hand = np.sum(scenes.cubic_spline(near, scene.h) * scene.wall_volume) + scenes.cubic_spline(0.0, scene.h) * (
        scene.spacing**3)
    crowd = np.repeat(point, 3, axis=0)  # three at one place: compressed
    own = 3.0 * scenes.cubic_spline(0.0, scene.h) * scene.spacing**3
    rest = lattice_density(CubicSpline(dim=3), dim=3, hdx=1.0)[0]
    alone = scenes.cubic_spline(0.0, scene.h) * scene.spacing**3
    assert scenes.compression(scene, crowd)[0] == pytest.approx((by_hand - alone + own) / rest - 1.0, rel=1e-9)


def test_level_and_front_of_the_start(scene):
    assert scene.level == pytest.approx(4 * 4 * 6 / 36 * scene.spacing)
    assert scenes.front(scene, scene.fluid) == pytest.approx(1.0, abs=0.01)
    assert scenes.front(scene, scene.fluid + [scene.spacing, 0.0, 0.0]) == pytest.approx(1.25, abs=0.01)
    assert not scenes.outside(scene, scene.fluid).any()
    assert scenes.outside(scene, scene.fluid - [0.0, 0.0, 2.2 * scene.spacing]).sum() == 16  # the lowest layer


def test_front_leaves_out_what_left_the_tank(scene):
    points = scene.fluid.copy()
    points[:3] = [10.0, 0.05, 0.05]  # more than half a row, which the front leaves out anyway
    assert scenes.front(scene, points) == pytest.approx(1.0, abs=0.01)


def test_cost_at_equal_error():
    line = [(1e-2, 1.0), (1e-4, 100.0)]
    assert scenes.at_equal_error(line, 1e-3) == pytest.approx(10.0)  # log-log
    assert scenes.at_equal_error(line, 1e-2) == pytest.approx(1.0)
    beaten = [*line, (1e-3, 50.0), (2e-2, 3.0)]  # worse than the line, but nothing beats it; beaten by the first
    assert scenes.at_equal_error(beaten, 1e-3) == pytest.approx(50.0)
    assert scenes.at_equal_error(beaten, 2e-2) is None
    assert scenes.at_equal_error(line, 2e-2) is None  # never beyond the settings that were run
    assert scenes.at_equal_error(line, 1e-5) is None
    assert scenes.at_equal_error([], 1e-3) is None


def test_pareto_keeps_what_nothing_beats_in_both():
    points = [(3.0, 1.0), (1.0, 3.0), (2.0, 4.0), (2.0, 2.0), (4.0, 1.0)]
    assert scenes.pareto(points) == [1, 3, 0]


def settings_run(scene, error, cost, *, outside=0):
    """A run of ours on two threads with this density error and cost [s/s]."""
    run = peers.Run(peers.OURS, scene, 0.1, {}, "settings")
    run.rounds[2] = [1e3 * cost * run.dt]
    run.record = dict(density_mean=error, outside=outside)
    return run


def test_settings_next_to_the_targets_are_run_again(scene):
    """Of the front, on either side of each error asked for; not what is beaten, nor what lost its particles."""
    high, low = peers.TARGETS
    between = np.sqrt(high * low)
    near = [settings_run(scene, *pair) for pair in ((1.5 * high, 2.0), (between, 3.0), (0.7 * low, 5.0))]
    far = [settings_run(scene, 4.0 * high, 1.0), settings_run(scene, 0.2 * low, 9.0)]
    beaten, lost = settings_run(scene, 1.1 * between, 4.0), settings_run(scene, 0.9 * low, 0.5, outside=96)
    assert set(peers.best([*far, beaten, lost, *near], 2)) == set(near)
    assert peers.best([far[0], near[0]], 2) == [near[0]]  # none is exact enough: the last one alone


def test_times_as_fast_at_equal_error(scene):
    """Twice the cost on a front of the same slope is a ratio of 2; where a front does not reach, none."""
    high, low = peers.TARGETS
    runs = [settings_run(scene, *pair) for pair in ((2.0 * high, 1.0), (0.5 * high, 4.0))]
    other = "Taichi PBF"
    for run in [settings_run(scene, *pair) for pair in ((2.0 * high, 2.0), (0.5 * high, 8.0))]:
        run.code = other
        runs.append(run)
    found = {row["error"]: row["median"] for row in peers.ratios(runs, 2) if row["peer"] == other}
    assert low < 0.5 * high
    assert found == pytest.approx({high: 2.0})

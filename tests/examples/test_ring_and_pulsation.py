"""A jet makes a ring of a bubble, which breaks up; the bubbles of a boil pulsate."""
import numpy as np
import pytest

from pysph_boiling.analysis.shapes import hole
from pysph_boiling.examples.bubble_ring import BubbleRing
from pysph_boiling.examples.pulsating_boil import PulsatingBoil
from pysph_boiling.files import load_output
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.particles import fluid_array
from pysph_boiling.phases import Phase


def vapour_of(points):
    """A fluid array whose particles (n, 3) [m] are vapour of one bubble, and a smaller bubble on its axis."""
    fluid = fluid_array(np.concatenate([points, [[0.0, 0.0, 9.0], [0.1, 0.0, 9.0]]]), spacing=0.1, dim=3,
                        rho0=WATER_1ATM.rho_l)
    fluid.add_property("phase", type="int", data=int(Phase.VAPOUR))
    fluid.add_property("bubble", type="unsigned int", data=np.r_[np.full(len(points), 3), 7, 7])
    return fluid


def test_hole_of_a_ring_is_its_inner_radius_and_other_shapes_have_none():
    turn = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    ring = np.concatenate([np.stack([r * np.cos(turn), r * np.sin(turn), 0.0 * turn], -1) for r in (1.0, 1.1, 1.3)])
    assert hole(vapour_of(ring), 3) == pytest.approx(1.0, rel=1e-6)
    assert hole(vapour_of(ring + [2.0, -3.0, 1.0]), 3) == pytest.approx(1.0, rel=1e-6), "wherever it is"
    assert hole(vapour_of(ring[np.abs(ring[:, 1]) > 0.7]), 3) == 0.0, "two arcs are no ring"
    filled = np.concatenate([ring, [[0.0, 0.0, 0.0]]])
    assert hole(vapour_of(filled), 3) == pytest.approx(0.0, abs=1e-9)
    assert hole(vapour_of(ring), 2) == 0.0


def test_flow_of_the_ring_vortex_is_free_of_divergence_and_fastest_on_its_axis():
    app = BubbleRing()
    p = BubbleRing.Parameters()
    rng, step = np.random.default_rng(1), 1e-4  # [spacings]
    place = rng.uniform(-6.0, 6.0, (40, 3)) + [0.0, 0.0, p.eddy_height]
    divergence = sum((app.flow(place + step * unit, p) - app.flow(place - step * unit, p))[:, axis]
                     for axis, unit in enumerate(np.eye(3))) / (2.0 * step)
    speed = p.eddy_speed * np.sqrt(9.81 * p.spacing)
    assert np.max(np.abs(divergence)) <= 1e-7 * speed
    np.testing.assert_allclose(app.flow(np.array([[0.0, 0.0, p.eddy_height]]), p), [[0.0, 0.0, -speed]])
    assert np.max(np.linalg.norm(app.flow(place, p), axis=1)) < speed


@pytest.mark.slow
def test_pierced_bubble_becomes_a_ring_and_breaks_up(tmp_path):
    app = BubbleRing(output_dir=str(tmp_path))
    app.run(["--demo", "--no-pictures", "--openmp"])  # its final check demands both
    history, results = app.history(), app.ledger.table()
    spacing = app.parameters.spacing
    assert history["bubbles"][0] == 1 and 2.0 <= np.max(history["hole"]) / spacing <= 8.0
    assert 2 <= np.max(history["bubbles"]) <= 60
    assert np.max(np.abs(results["energy_residual"])) <= 1e-10 and np.all(results["mass_residual"] == 0.0)


def test_bubbles_of_a_boil_pulsate_about_their_volume_at_rest(tmp_path):
    app = PulsatingBoil(output_dir=str(tmp_path))
    app.run(["--demo", "--duration", "0.9", "--frame", "0.02", "--no-pictures", "--openmp"])
    results, v_exp = app.ledger.table(), app.parameters.v_exp
    assert results["n_nucleated"][-1] >= 30 and results["n_pushed"][-1] >= 100
    histories = {}  # bubble -> its mean swell over that at rest, in the outputs
    for arrays, _ in map(load_output, app.output_files):
        fluid = arrays["fluid"]
        for label in np.unique(fluid.bubble[fluid.phase == Phase.VAPOUR]):
            histories.setdefault(int(label), []).append(np.mean(fluid.swell[fluid.bubble == label]) / v_exp)
    longest = np.array(max(histories.values(), key=len))
    most = app.scheme.effects["oscillation"].bounds()[1] ** 3
    assert 1.1 <= np.max(longest) <= 1.05 * most, "it swells beyond its volume at rest, up to the bound of its radius"
    assert np.count_nonzero((longest[1:] > 1.0) != (longest[:-1] > 1.0)) >= 4, "two periods at least"
    assert np.max(np.abs(results["energy_residual"])) <= 1e-10 and np.all(results["mass_residual"] == 0.0)

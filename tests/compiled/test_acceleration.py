"""Chebyshev's sweeps against a reference in NumPy, and neighbour lists with a skin against lists made anew."""
import numpy as np
import pytest
from harness import Stepper, host_only
from sets import scheme

from pysph_boiling.equations.density_constraint import PBFMoveAccelerated
from pysph_boiling.particles import box_vessel, fluid_block, host
from pysph_boiling.schemes.effects import BoxContainer, DensityConstraint

DX = 0.01
WIDTH, HEIGHT = 16, 24


def tank(width=8, fill=12, jitter=0.2, dt_factor=0.07, **density):
    """A column of water, disordered, in a wider tank; ready to step."""
    upper = (WIDTH * DX, HEIGHT * DX, 0.0)
    motion = scheme("motion", dim=2, spacing=DX, changes=dict(container=BoxContainer(upper=upper)))
    motion.set_effects(density=DensityConstraint(**density))
    common = dict(spacing=DX, dim=2, rho0=motion.rho0)
    arrays = [fluid_block((0.0, 0.0, 0.0), (width * DX, fill * DX, 0.0), jitter=jitter, seed=1, **common),
              box_vessel((0.0, 0.0), upper[:2], kernel=motion.kernel, **common)]
    motion.setup_properties(arrays)
    return Stepper(motion, arrays, dt=motion.time_step(dt_factor))


def error_after(sweeps, **density):
    """Mean density error [-] that so many sweeps of the first step leave in compressed water."""
    stepper = tank(width=WIDTH, fill=16, jitter=0.0, min_sweeps=sweeps + 1, max_sweeps=sweeps + 1, tolerance=0.0,
                   max_mean_error=10.0, settle=0, **density)
    fluid = stepper.arrays["fluid"]
    fluid.y *= 0.94
    stepper.step()
    return fluid.density_error[0]  # measured before the last sweep, so after all others


def test_accelerated_sweeps_reach_a_smaller_error():
    plain, accelerated = error_after(30), error_after(30, chebyshev_radius=0.97, omega=0.5)
    assert accelerated < 0.5 * plain


def test_weights_follow_chebyshev_and_restart_where_the_error_rises():
    """The host's part alone, on errors made up: three fall, one rises, then they fall again."""
    move = PBFMoveAccelerated("fluid", None, omega=0.5, max_displacement=1.0, radius=0.9, delay=2)

    class Array:
        gpu = None
        density_error, sweep_weight = np.zeros(2), np.array([1.0, np.inf, 0.0])

    rho2, weights = 0.81, []
    for error in (9.0, 8.0, 7.0, 6.0, 6.5, 6.0, 5.0, 4.0):
        Array.density_error[0] = error
        move.reduce(Array, 0.0, 0.1)
        weights.append(Array.sweep_weight[0])
    first = 2.0 / (2.0 - rho2)
    second = 4.0 / (4.0 - rho2 * first)
    third = 4.0 / (4.0 - rho2 * second)
    assert weights == pytest.approx([1.0, first, second, third, 1.0, 1.0, first, second], rel=1e-14)


def test_accelerated_moves_equal_the_reference():
    """One step replayed sweep by sweep from what the kernels were given: corrections and weights."""
    stepper = tank(chebyshev_radius=0.9, omega=0.6, min_sweeps=8, max_sweeps=8, tolerance=0.0, max_displacement=1.0,
                   max_mean_error=10.0)
    fluid, seen, weights = stepper.arrays["fluid"], [], [1.0]
    stepper.step(3)

    def watch():
        seen.append([host(fluid, name).copy() for name in ("dpx", "dpy", "qx", "qy")])
        weights.append(float(fluid.sweep_weight[0]))  # of the next sweep

    stage = stepper.equations.groups[stepper.solver.integrator.stages["density"]]
    [move] = [group for block in stage for group in block.equations if group.name == "density_move"]
    move.post.append(watch)
    stepper.step()
    assert len(seen) == 8 and max(weights) > 1.2
    qx = qy = 0.0
    for weight, (dpx, dpy, got_x, got_y) in zip(weights, seen):
        qx, qy = weight * 0.6 * dpx + (weight - 1.0) * qx, weight * 0.6 * dpy + (weight - 1.0) * qy
        np.testing.assert_allclose(got_x, qx, rtol=1e-12, atol=1e-12 * DX)
        np.testing.assert_allclose(got_y, qy, rtol=1e-12, atol=1e-12 * DX)
    assert np.abs(qx).max() > 1e-6 * DX  # it moved


@host_only
def test_lists_with_a_skin_are_kept_and_change_nothing():
    """Until round-off has grown: the same neighbours count, whatever the list holds beside them."""
    fresh, kept = (tank(dt_factor=0.02, jitter=0.01, skin=skin, min_sweeps=3, max_sweeps=3, settle=0)
                   for skin in (0.0, 0.3))
    start = fresh.arrays["fluid"].x.copy(), fresh.arrays["fluid"].y.copy()
    fresh.step(60)
    kept.step(60)
    searches = fresh.solver.integrator.searches, kept.solver.integrator.searches
    assert searches[0] == 60 and 2 <= searches[1] <= 30, searches  # some are kept, and some made anew
    moved = np.hypot(fresh.arrays["fluid"].x - start[0], fresh.arrays["fluid"].y - start[1]).max()
    assert moved > 0.5 * DX
    for name in "xy":
        np.testing.assert_allclose(kept.arrays["fluid"].get(name), fresh.arrays["fluid"].get(name), atol=1e-3 * DX)


@host_only
def test_lists_are_made_anew_where_particles_come_go_or_change_places():
    stepper = tank(skin=1.0, jitter=0.01, dt_factor=0.01)
    integrator, fluid = stepper.solver.integrator, stepper.arrays["fluid"]
    stepper.step(3)
    assert integrator.searches == 1
    fluid.remove_particles([5])
    stepper.step()
    assert integrator.searches == 2
    fluid.place[[0, 1]] = fluid.place[[1, 0]]
    stepper.step()
    assert integrator.searches == 3
    fluid.x[0] += 0.6 * DX
    stepper.step()
    assert integrator.searches == 4
    stepper.step()
    assert integrator.searches == 4

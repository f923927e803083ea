"""Warm start: its force against all pairs in NumPy, where its multipliers come from, and what a column gains by it."""
import inspect

import numpy as np
import pytest
from harness import host_only, vectors
from motion import DX, pairs, tank

from pysph_boiling.equations.density_constraint import PBFMove, PBFMoveAccelerated
from pysph_boiling.evaluation.problems.hydrostatic import HydrostaticColumn, compression
from pysph_boiling.particles import fluid_array, host
from pysph_boiling.schemes.effects import DensityConstraint
from pysph_boiling.schemes.integrator import PBFStep

ACCELERATION = ("au", "av", "aw")


@pytest.fixture
def kernels(kernels):
    """The cloud of all these tests, with multipliers to begin with."""
    fluid = kernels.fluid
    fluid.lmbda_start[:] = -np.random.default_rng(8).uniform(0.0, 2.0, len(fluid.x))
    fluid.lmbda_start[:10] = 0.0
    return kernels


@pytest.mark.parametrize("swollen", ["", "swollen_"])
def test_force_equals_the_reference(kernels, swollen):
    """It adds what pairs give each other, without a net force, and what walls give."""
    fluid, wall, start = kernels.fluid, kernels.wall, kernels.fluid.lmbda_start
    fills = fluid.m * fluid.swell if swollen else fluid.m
    gradient, near_wall = pairs(fluid, fluid, kernels.kernel)[1], pairs(fluid, wall, kernels.kernel)[1]
    share = fills[None, :] * start[:, None] + fills[:, None] * start[None, :]
    rho_rest = kernels.parameters["PBFDensity"].rho_rest
    own = (share[:, :, None] * gradient).sum(1) / rho_rest
    walls = start[:, None] * (wall.m[None, :, None] * near_wall).sum(1) / rho_rest
    for name in ACCELERATION:
        fluid.get(name)[:] = 7.0
    kernels.run(f"{swollen}warm_start")
    found = vectors(fluid, *ACCELERATION) - 7.0
    scale = np.abs(found).max()
    assert np.count_nonzero(np.linalg.norm(walls, axis=1) > 1e-3 * np.abs(walls).max()) > 10 and np.any(own)
    assert swollen == "" or np.ptp(fluid.swell) > 0.1
    np.testing.assert_allclose(found, (own + walls) / fluid.m[:, None], rtol=0.0, atol=1e-12 * scale)
    pairwise = fluid.m[:, None] * found - walls
    assert np.abs(pairwise.sum(0)).max() <= 1e-13 * np.abs(pairwise).sum()


def test_next_step_begins_with_a_share_of_what_the_last_one_found():
    """min(0, .4 (L + .3 (L - L'))), by hand; another length of the step changes nothing, a short step is left out."""
    fluid = fluid_array(np.zeros((3, 3)), spacing=DX, dim=2, rho0=1000.0)
    for name in ("sx", "sy", "sz", *ACCELERATION, "impulse", "lmbda_start", "lmbda_last"):
        fluid.add_property(name)
    fluid.add_constant("warm_start", [0.4, 0.3, 1.0])

    def run(method, dt):
        for i in range(3):
            names = set(inspect.signature(method).parameters) - {"d_idx", "dt"}
            method(i, **{name: getattr(fluid, name.removeprefix("d_")) for name in names}, dt=dt)

    step = PBFStep()
    fluid.lmbda_last[:] = -10.0, -10.0, -10.0
    fluid.impulse[:] = np.array([-10.0, -20.0, -2.0]) * 0.01**2
    run(step.stage2, 0.01)
    np.testing.assert_allclose(fluid.lmbda_start, [-4.0, -9.2, 0.0], rtol=1e-12)  # the last one: -.8 + .96 > 0
    np.testing.assert_allclose(fluid.lmbda_last, [-10.0, -20.0, -2.0], rtol=1e-12)
    run(step.stage1, 0.005)
    np.testing.assert_allclose(fluid.impulse, fluid.lmbda_start * 0.005**2, rtol=1e-12)
    fluid.impulse[:] = np.array([-20.0, -20.0, -2.0]) * 0.005**2
    run(step.stage2, 0.005)
    np.testing.assert_allclose(fluid.lmbda_start, [-9.2, -8.0, -0.8], rtol=1e-12)
    fluid.warm_start[2], fluid.impulse[:] = 0.0, -1.0  # a short step
    run(step.stage2, 1e-4)
    np.testing.assert_allclose(fluid.lmbda_start, [-9.2, -8.0, -0.8], rtol=1e-12)


@pytest.mark.parametrize("accelerated", [False, True], ids=["plain", "accelerated"])
def test_multipliers_add_up_as_displacements_do(accelerated):
    """Two passes of five sweeps over one particle whose correction is its multiplier, the second without a velocity."""
    move = dict(omega=0.7, max_displacement=1e9)
    equation = PBFMoveAccelerated("fluid", None, radius=0.9, delay=2, **move) if accelerated \
        else PBFMove("fluid", None, **move)
    constants = dict(prior=[1.0] * 3, sweeps=[0.0] * 2, density_error=[1.0] * 2)
    if accelerated:
        constants["sweep_weight"] = [1.0, np.inf, 0.0]
    fluid = fluid_array(np.zeros((1, 3)), spacing=DX, dim=2, rho0=1000.0)
    for name in ("sx", "sy", "sz", "dpx", "dpy", "dpz", "qx", "qy", "qz", "q_lmbda", "limited", "lmbda", "impulse"):
        fluid.add_property(name)
    for name, value in constants.items():
        fluid.add_constant(name, value)
    random, corrections = np.random.default_rng(5), []
    for felt in (1.0, 0.0):
        fluid.prior[1], fluid.sweeps[0] = felt, 0.0
        if accelerated:
            fluid.sweep_weight[:] = 1.0, np.inf, 0.0
        for error in (1.0, 0.8, 0.7, 0.9, 0.6):  # it rises once: weights start anew
            fluid.sweeps[0] += 1.0
            fluid.density_error[0] = error
            fluid.lmbda[0] = fluid.dpx[0] = random.uniform()
            corrections.append(0.7 * fluid.dpx[0])
            names = set(inspect.signature(equation.post_loop).parameters) - {"d_idx"}
            equation.post_loop(0, **{name: getattr(fluid, name.removeprefix("d_")) for name in names})
            if accelerated:
                equation.reduce(fluid, 0.0, 0.0)
    assert fluid.impulse[0] == pytest.approx(fluid.sx[0], rel=1e-12) and 0.5 < fluid.sx[0] < 0.8 * fluid.x[0]
    assert accelerated == (fluid.sx[0] > 1.1 * sum(corrections[:5]))


@pytest.mark.parametrize("parts, lean", [(1, True), (1, False), (2, False)])
def test_at_rest_it_bears_its_share_of_the_weight(parts, lean):
    """The walls' force by it is .4 m g in the mean of some steps, also where steps are split."""
    stepper = tank(width=16, fill=12, jitter=0.1, lean=lean, longest_step=0.15 / parts, min_sweeps=4, max_sweeps=4,
                   dt_factor=0.14)
    fluid, borne = stepper.arrays["fluid"], []
    stepper.step(300)
    for _ in range(50):
        stepper.step()
        assert fluid.substeps[0] == parts
        borne.append(np.mean(host(fluid, "av") / 9.81 + 1.0))
    assert np.mean(borne) == pytest.approx(0.4, abs=0.02) and np.ptp(borne) < 0.2


@host_only
def test_column_at_rest_is_less_compressed_by_that_share():
    """Two sweeps a step have to find .6 of the pressure, so .6 of the error is left; the level rises by some of it."""
    errors, levels = [], []
    for share in (0.0, 0.4):
        stepper = tank(width=16, fill=16, jitter=0.1, warm_start=share, min_sweeps=2, max_sweeps=2, max_mean_error=1.0)
        fluid = stepper.arrays["fluid"]
        stepper.step(600)
        found = []
        for _ in range(8):
            stepper.step(20)
            found.append(compression(fluid, [stepper.arrays["wall"]], stepper.scheme).mean())
        errors.append(np.mean(found))
        levels.append(fluid.y.mean())
    assert errors[0] > 2e-3 and 0.5 < errors[1] / errors[0] < 0.7, errors
    assert 0.0 < levels[1] - levels[0] < 0.1 * DX


@host_only
def test_without_it_a_step_begins_from_nothing():
    stepper = tank(warm_start=0.0)
    assert not any("WarmStart" in type(term.equation).__name__ for term in stepper.scheme.terms())
    stepper.step(20)
    fluid = stepper.arrays["fluid"]
    assert not fluid.lmbda_start.any() and fluid.impulse.min() < 0.0


@host_only
def test_accelerated_sweeps_begin_from_nothing_and_a_column_keeps_its_level():
    """With a warm start such a column heaved, with a level 24 % too high at .41 sqrt(g dx)."""
    density = DensityConstraint(min_sweeps=8, max_sweeps=8, chebyshev_radius=0.97, omega=0.5, skin=0.2)
    assert density.share_at_start == 0.0 and DensityConstraint().share_at_start == 0.4
    found = HydrostaticColumn(dim=2, layers=12, height=0.6, width=0.6, dt_factor=0.035, density=density).run().errors
    assert 1e-5 < found["density_mean"] < 1e-3 and abs(found["level"]) < 0.03 and found["speed"] < 0.01, found
    with pytest.raises(ValueError, match="warm_start = 0.2 is for plain sweeps.* both together lift water"):
        DensityConstraint(chebyshev_radius=0.9, warm_start=0.2)

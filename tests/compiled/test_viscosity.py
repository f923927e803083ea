"""Viscosity, friction at walls and gravity against a reference: all pairs, a few lines of NumPy, no lists."""
import numpy as np
import pytest
from harness import vectors
from motion import N_FLUID, RHO0, ROUND_OFF, close, pairs


@pytest.fixture
def moving(kernels):
    """Random velocities."""
    for axis, name in enumerate(("u", "v", "w")):
        kernels.fluid.get(name)[:] = np.random.default_rng(axis).normal(size=N_FLUID) * (axis < kernels.dim)
    return kernels


def test_viscosity_equals_the_reference_and_conserves_momentum(moving):
    fluid = moving.fluid
    v = vectors(fluid, "u", "v", "w")
    W, _ = pairs(fluid, fluid, moving.kernel)
    rate = moving.parameters["PBFXSPHViscosity"].rate
    a = rate / RHO0 * ((v[None, :] - v[:, None]) * (fluid.m[None, :] * W)[:, :, None]).sum(1)
    moving.run("viscosity")
    close(vectors(fluid, "au", "av", "aw"), a)
    momentum = fluid.m[:, None] * vectors(fluid, "au", "av", "aw")
    assert np.abs(momentum.sum(0)).max() <= ROUND_OFF * np.abs(momentum).sum()


def test_wall_friction_only_slows(moving):
    fluid = moving.fluid
    v = vectors(fluid, "u", "v", "w")
    W, _ = pairs(fluid, moving.wall, moving.kernel)
    share = moving.parameters["PBFWallFriction"].rate / RHO0 * (W @ moving.wall.m)
    assert 0 < np.count_nonzero(share == 0.0) < N_FLUID  # some touch no wall
    moving.run("friction")
    close(vectors(fluid, "au", "av", "aw"), -share[:, None] * v)


def test_gravity_is_set_anew_each_time(kernels):
    fluid = kernels.fluid
    for _ in range(2):
        kernels.run("gravity")
        expected = np.zeros(3)
        expected[kernels.dim - 1] = -9.81
        np.testing.assert_array_equal(vectors(fluid, "au", "av", "aw"), np.tile(expected, (N_FLUID, 1)))

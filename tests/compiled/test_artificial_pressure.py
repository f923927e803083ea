"""Artificial pressure: its sum against all pairs in NumPy, momentum, and the surface of a pool with and without it."""
import numpy as np
import pytest
from harness import vectors
from motion import N_FLUID, ROUND_OFF, STRENGTH, close, pairs

from pysph_boiling.evaluation.problems.drift import StillWater
from pysph_boiling.schemes.effects import ArtificialPressure, DensityConstraint

ACCELERATION = ("au", "av", "aw")


def accelerations(kernels, start=0.0):
    """Accelerations (n, 3) on top of ``start``."""
    for name in ACCELERATION:
        kernels.fluid.get(name)[:] = start
    kernels.run("artificial_pressure")
    return vectors(kernels.fluid, *ACCELERATION)


def test_force_equals_the_reference(kernels):
    """The formula over all pairs, with PySPH's own kernel."""
    fluid, kernel = kernels.fluid, kernels.kernel
    W, gradient = pairs(fluid, fluid, kernel)
    unit = kernel.kernel(rij=0.3 * kernels.spacing, h=1.2 * kernels.spacing)
    share = fluid.m[None, :] * (W / unit) ** 4
    want = -STRENGTH / kernels.parameters["PBFDensity"].rho_rest * (share[:, :, None] * gradient).sum(1)
    size = np.linalg.norm(want, axis=1)
    assert np.count_nonzero(size > 1e-3 * size.max()) > N_FLUID // 3
    close(accelerations(kernels), want)
    close(accelerations(kernels, start=7.0), want + 7.0)  # it adds


def test_momentum_is_conserved_with_unequal_masses(kernels):
    impulse = kernels.fluid.m[:, None] * accelerations(kernels)
    assert np.abs(impulse).max() > 0.0
    assert np.abs(impulse.sum(0)).max() <= 1e-14 * np.abs(impulse).sum()  # round-off of the sum


def test_pair_at_the_reference_distance_parts_with_the_strength(kernels):
    """The kernel is its own unit there: two particles part with 2 s m |dW/dr|/rho_rest."""
    fluid, dx = kernels.fluid, kernels.spacing
    for name in "xyz"[:kernels.dim]:
        fluid.get(name)[:2] = 5.0  # away from the others
    fluid.x[1] += 0.3 * dx
    fluid.m[:2] = fluid.m[:2].mean()
    gradient = [0.0, 0.0, 0.0]
    kernels.kernel.gradient([0.3 * dx, 0.0, 0.0], 0.3 * dx, 1.2 * dx, gradient)
    a = accelerations(kernels)[:2]
    want = STRENGTH * fluid.m[0] * abs(gradient[0]) / kernels.parameters["PBFDensity"].rho_rest
    np.testing.assert_allclose(a, [[-want, 0.0, 0.0], [want, 0.0, 0.0]], rtol=ROUND_OFF, atol=ROUND_OFF * want)


@pytest.mark.parametrize("dt_factor", [0.07, 0.14])
@pytest.mark.parametrize("dim", [2, 3])
def test_surface_of_a_pool_is_no_denser_than_twice_its_bulk(dim, dt_factor):
    """Without it a dense row forms, and particles pair; the level is the same to a twentieth of a spacing."""
    found = []
    for strength in (0.0, ArtificialPressure().strength):
        pool = StillWater(dim=dim, cells={2: 24, 3: 10}[dim], dt_factor=dt_factor, artificial_pressure=strength,
                          density=DensityConstraint(max_sweeps=4, tolerance=5e-3))
        stepper, fluid = pool.release(0.0)
        stepper.step(round(20.0 / dt_factor))
        found.append(pool.structure(fluid))
    without, with_it = found
    assert 1.2 < with_it["row"] < 2.1 < 2.5 < without["row"] < 3.5
    assert without["nearest"] < 0.3 and 0.65 < with_it["nearest"] < 1.0
    assert 0.0 < (with_it["level"] - without["level"]) * pool.cells < 0.05

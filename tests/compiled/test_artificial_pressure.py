"""Artificial pressure: its sum against all pairs in NumPy, momentum, and the surface of a pool with and without it."""
import numpy as np
import pytest
from harness import vectors
from motion import N_FLUID, ROUND_OFF, STRENGTH, close, cloud, compile_kernels, pairs, reset

DT = 2e-3
CORRECTION = ("dpx", "dpy", "dpz")


@pytest.fixture(params=[2, 3])
def kernels(request, made={}):
    dim = request.param
    if dim not in made:
        fluid, wall, spacing = cloud(dim)
        made[dim] = compile_kernels(fluid, wall, dim=dim, spacing=spacing)
    compiled = reset(made[dim])
    for name in CORRECTION:
        compiled.fluid.get(name)[:] = 0.0
    return compiled


def reference(kernels, dt):
    """Corrections (n, 3), by PySPH's own kernel."""
    fluid, kernel = kernels.fluid, kernels.kernel
    W, gradient = pairs(fluid, fluid, kernel)
    unit = kernel.kernel(rij=0.3 * kernels.spacing, h=1.2 * kernels.spacing)
    rho_rest = kernels.parameters["PBFDensity"].rho_rest
    share = fluid.m[None, :] * (W / unit) ** 4
    return -STRENGTH * dt**2 / rho_rest * (share[:, :, None] * gradient).sum(1)


@pytest.mark.parametrize("felt", [1.0, 0.25])
def test_correction_equals_the_reference(kernels, felt):
    want = felt * reference(kernels, DT)
    assert np.count_nonzero(np.abs(want).max(axis=1) > 1e-3 * np.abs(want).max()) > N_FLUID // 3
    kernels.fluid.prior[1] = felt
    kernels.run("artificial_pressure", dt=DT)
    close(vectors(kernels.fluid, *CORRECTION), want)


def test_it_adds_to_the_correction_of_the_density(kernels):
    kernels.run("density", "correction", dt=DT)
    before = vectors(kernels.fluid, *CORRECTION)
    assert np.abs(before).max() > 0.0
    kernels.run("artificial_pressure", dt=DT)
    close(vectors(kernels.fluid, *CORRECTION), before + reference(kernels, DT), np.abs(before).max())


def test_momentum_is_conserved_with_unequal_masses(kernels):
    kernels.run("artificial_pressure", dt=DT)
    momentum = kernels.fluid.m[:, None] * vectors(kernels.fluid, *CORRECTION)
    assert np.abs(momentum).max() > 0.0
    assert np.abs(momentum.sum(0)).max() <= 1e-14 * np.abs(momentum).sum()  # round-off of the sum


def test_pair_is_pushed_apart_by_the_force_of_the_formula_whatever_the_step(kernels):
    """Two particles at 0.3 spacings, where the kernel is its own unit: 2 s dt^2 m |dW/dr|/rho_rest apart."""
    fluid, dx = kernels.fluid, kernels.spacing
    for name in "xyz"[:kernels.dim]:
        fluid.get(name)[:2] = 5.0
    fluid.x[1] += 0.3 * dx
    fluid.m[:2] = fluid.m[:2].mean()
    gradient = [0.0, 0.0, 0.0]
    kernels.kernel.gradient([0.3 * dx, 0.0, 0.0], 0.3 * dx, 1.2 * dx, gradient)
    for dt in (DT, 0.5 * DT):
        for name in CORRECTION:
            fluid.get(name)[:] = 0.0
        kernels.run("artificial_pressure", dt=dt)
        want = 2.0 * STRENGTH * dt**2 * fluid.m[0] * abs(gradient[0]) / kernels.parameters["PBFDensity"].rho_rest
        assert fluid.dpx[1] - fluid.dpx[0] == pytest.approx(want, rel=ROUND_OFF)

"""Heat against exact solutions: the Laplacian on a lattice, a Fourier mode, a slab that is suddenly hot on one side."""
import math

import numpy as np
import pytest

from pysph_boiling.evaluation.problems.conduction import FourierMode, HotPlate, lattice_constant
from pysph_boiling.examples.heated_slab import HeatedSlab


@pytest.mark.parametrize("dim, hdx, ratio", [
    (2, 1.0, 1.005), (2, 1.3, 1.000), (2, 2.0, 0.987), (3, 1.0, 1.013), (3, 1.2, 0.973), (3, 1.5, 1.001),
])
def test_laplacian_of_a_quadratic_field(dim, hdx, ratio):
    assert lattice_constant(dim, hdx) == pytest.approx(ratio, abs=5e-4)  # the table has three decimals


@pytest.mark.parametrize("hdx", [1.2, 1.3])
def test_decay_of_a_fourier_mode_converges_with_second_order(hdx):
    """To the lattice constant, which no refinement takes away: .981 at h/dx = 1.2, 1.000 at 1.3.

    Both errors are of second order: the kernel's, and Euler's, since heat steps shrink with the square of h.
    """
    found = [FourierMode(layers=layers, hdx=hdx).run().errors for layers in (16, 32, 64)]
    assert all(one["shape"] <= 1e-9 for one in found)  # the mode keeps its shape; round-off
    errors = [abs(one["order"]) for one in found]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders.min() >= 1.9, f"orders {orders}, errors {errors}"  # measured 2.0 to 2.1
    assert errors[-1] <= 1e-3  # measured 4e-4 and 5e-4


@pytest.fixture
def heated_slab(tmp_path):
    """Runs the scene with command-line arguments, in this process."""
    def run(**arguments):
        app = HeatedSlab(output_dir=str(tmp_path))
        app.run(["--openmp", "--disable-output", "--tolerance=1", *(f"--{k}={v}" for k, v in arguments.items())])
        assert abs(app.ledger.rows[-1]["energy_residual"]) <= 1e-10  # round-off; measured below 1e-14
        return app
    return run


def test_heated_slab_converges_to_the_exact_profile():
    """Coarse grids profit from errors of unlike sign, so the order is taken over two halvings.

    In the end the plate decides: its isothermal surface lies .04 spacings beside the wall's face, an error of first
    order. Measured 1.73 %, 0.65 %, 0.47 % (and 0.27 % at 0.25 mm).
    """
    errors = [HotPlate(spacing=spacing).run().errors["L2"] for spacing in (2e-3, 1e-3, 5e-4)]
    assert math.log2(errors[0] / errors[2]) / 2.0 >= 0.8, f"errors {errors}"
    assert errors[1] <= 0.01


def test_step_far_beyond_the_explicit_limit_is_subcycled(heated_slab):
    """One step of 60 s at 1 mm: sixty heat steps, and the result of sixty steps of 1 s."""
    one = heated_slab(spacing=1e-3, frame=60.0, substeps=1)
    assert one.ledger.rows[-1]["heat_subcycles"] == 60
    limit = one.scheme.effects["heat"].step_limit(one.scheme.scene())
    assert 50 * limit < one.solver.dt < 60 * limit
    _, T, _ = one.profile()
    assert np.all((T >= 293.15 - 1e-9) & (T <= 353.15))  # no new extremes: stable
    small = heated_slab(spacing=1e-3, frame=60.0, substeps=60)
    assert small.ledger.rows[-1]["heat_subcycles"] == 1
    np.testing.assert_allclose(T, small.profile()[1], rtol=1e-12)
    smaller = heated_slab(spacing=1e-3, frame=60.0, substeps=240)
    # the time error of Euler steps of 1 s against 0.25 s: 0.1 K of 60 K
    np.testing.assert_allclose(T, smaller.profile()[1], atol=0.15)

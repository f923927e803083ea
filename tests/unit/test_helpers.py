"""The smoothing kernels as polynomials without branches equal PySPH's own."""
import numpy as np
import pytest
from pysph.base.kernels import CubicSpline, QuinticSpline, WendlandQuintic

from pysph_boiling.equations.helpers import boiling_kernel, boiling_kernel_slope, kernel_coefficients

H = 0.7
RADII = np.concatenate([[1e-6], np.linspace(0.05, 2.2, 44)]) * H  # inside, across both knots, outside


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("shape", [CubicSpline, WendlandQuintic])
def test_polynomials_equal_the_kernels_of_pysph(shape, dim):
    kernel = shape(dim=dim)
    c = kernel_coefficients(kernel)
    for r in RADII:
        x, slope = [0.6 * r, -0.8 * r, 0.0], [0.0] * 3
        kernel.gradient(x, r, H, slope)
        ours = [boiling_kernel_slope(r / H, *c) / H ** (dim + 2) * v for v in x]
        assert boiling_kernel(r / H, *c) / H**dim == pytest.approx(kernel.kernel(x, r, H), rel=1e-12, abs=1e-14)
        assert ours == pytest.approx(slope, rel=1e-12, abs=1e-14)
    assert boiling_kernel(0.0, *c) / H**dim == pytest.approx(kernel.kernel([0.0] * 3, 0.0, H), rel=1e-14)
    assert np.isfinite(boiling_kernel_slope(0.0, *c))


@pytest.mark.parametrize("kernel", [QuinticSpline(dim=3), CubicSpline(dim=1)])
def test_other_kernels_are_refused(kernel):
    with pytest.raises(ValueError, match=f"and WendlandQuintic in 2-D and 3-D, got {type(kernel).__name__} in"):
        kernel_coefficients(kernel)

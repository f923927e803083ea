"""Surface tension: bubbles become round, and what the case ``surface_tension`` measures with."""
import math

import numpy as np
import pytest

from pysph_boiling.analysis.drops import pieces
from pysph_boiling.evaluation.problems.capillary import (
    BubbleShape,
    LaplacePressure,
    fitted_swing,
    length,
    swing,
)
from pysph_boiling.phases import Phase


def corners(x):
    """How square a shape (n, dim) is along its first two axes: -0.43 for a square, 0 if it is round."""
    x = x - x.mean(0)
    z = x[:, 0] + 1j * x[:, 1]
    return float(np.sum(z**4).real / np.sum(np.abs(z) ** 4))


def test_square_bubble_becomes_round():
    problem, side = BubbleShape(box=4.0), 0.008 * math.sqrt(math.pi)
    stepper, fluid = problem.start(1, lambda x: np.all(np.abs(x) < 0.5 * side, axis=1))
    assert corners(problem.place(fluid)) == pytest.approx(-3.0 / 7.0, abs=0.06)
    stepper.step(round(1.5 * 2.0 * math.pi / problem.omega(fluid) / stepper.dt))
    after = problem.place(fluid)
    assert abs(corners(after)) < 0.08 and length(after) < 1.15 and len(pieces(after, 1.6 * problem.spacing)[1]) == 1


def test_two_bubbles_that_touch_become_one_round_bubble():
    """When they are shaken: in a packing at rest they stay 1.5 times as long as wide, since it is soft, but solid."""
    problem, ball = LaplacePressure(shake=0.1), 0.008 / math.sqrt(2.0)
    stepper, fluid = problem.start(1, lambda x: np.hypot(np.abs(x[:, 0]) - ball, x[:, 1]) < ball)
    assert length(problem.place(fluid)) > 2.0
    problem.calm(stepper, fluid, 1)
    after = problem.place(fluid)
    assert length(after) < 1.3 and len(pieces(after, 1.6 * problem.spacing)[1]) == 1


@pytest.mark.parametrize("dim, cells", [(2, 24), (3, 10)])
def test_virial_is_the_pressure_that_a_known_force_causes(dim, cells):
    """Liquid alone, pushed from both sides to the middle: p = -(rho A/k) cos(k x) + constant, k = 2 pi/L."""
    problem = LaplacePressure(dim=dim, radius=0.001 * cells, box=1.0, fill=1.0)
    stepper, fluid = problem.start(1, lambda x: np.zeros(len(x), bool))
    assert not np.any(fluid.phase == Phase.VAPOUR)
    k, rho = 2.0 * math.pi / problem.size, fluid.m.sum() / problem.size**dim
    strength, found = 2.0 * problem.sigma / problem.spacing, []  # rho A/k
    for step in range(500):
        fluid.u += stepper.dt * strength * k / rho * np.sin(k * fluid.x)
        stepper.step()
        if step >= 300:
            wave = -np.cos(k * fluid.x)
            found.append(np.polyfit(wave, problem.virial(fluid, stepper.scheme, stepper.dt), 1)[0])
    assert np.mean(found) / strength == pytest.approx(1.0, abs=0.03)  # measured .998 (2-D) and 1.010 (3-D)


def test_fit_finds_frequency_and_damping():
    t = np.linspace(0.0, 2.0 * math.pi, 120)
    exact = swing(t, 0.9, 0.2)
    assert exact[0] == 1.0 and exact[1] == pytest.approx(1.0 - 0.5 * 0.81 * t[1]**2, abs=1e-3)
    np.testing.assert_allclose(fitted_swing(t, exact), (0.9, 0.2), rtol=1e-6)
    assert not abs(fitted_swing(t, np.ones(len(t)))[0] - 1.0) < 0.25  # a shape that does not change
    noisy = exact + 0.05 * np.random.default_rng(1).normal(size=len(t))
    np.testing.assert_allclose(fitted_swing(t, noisy), (0.9, 0.2), atol=0.03)

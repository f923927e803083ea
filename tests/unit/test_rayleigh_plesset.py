"""The Rayleigh-Plesset equation of a bubble against formulas, energy and SciPy's integrator. Nothing is compiled."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.schemes.rayleigh_plesset import RayleighPlesset

P = 101325.0
STEAM = dict(rho=WATER.rho_l, pressure=P, sigma=WATER.sigma, mu=0.0, kappa=1.33)
RADII = [4e-3, 1e-3, 1e-5]  # surface tension adds 12 % to the gas pressure of the last


def minnaert(R0):
    """Angular frequency [1/s], from p = rho omega^2 R0^2 / (3 kappa) for small changes of R."""
    rest = P + 2.0 * WATER.sigma / R0
    return np.sqrt((3.0 * 1.33 * rest - 2.0 * WATER.sigma / R0) / WATER.rho_l) / R0


def history(bubble, R, R0, *, periods, steps=100, p_inf=P, U=0.0):
    """(t [s], R [m], U [m/s]) of one bubble, ``steps`` a period."""
    dt = 2.0 * np.pi / minnaert(R0) / steps
    rows = [(0.0, R, U)]
    for k in range(periods * steps):
        (r,), (u,), _ = bubble.advance([rows[-1][1]], [rows[-1][2]], R0, p_inf, dt)
        rows.append(((k + 1) * dt, r, u))
    return np.array(rows).T


def zeros(t, x):
    """Times at which x rises through zero."""
    k = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    return t[k] - x[k] * (t[k + 1] - t[k]) / (x[k + 1] - x[k])


def test_steam_rings_at_3_27_over_its_radius():
    bubble = RayleighPlesset(**{**STEAM, "sigma": 0.0})
    assert bubble.frequency(4e-3) / (2.0 * np.pi) * 4e-3 == pytest.approx(3.27, abs=5e-3)  # Hz m


@pytest.mark.parametrize("R0", RADII)
def test_period_of_a_small_oscillation_is_minnaerts(R0):
    bubble = RayleighPlesset(**STEAM)
    t, R, _ = history(bubble, 1.001 * R0, R0, periods=5)
    period = np.diff(zeros(t, R / R0 - 1.0))
    assert len(period) == 4
    np.testing.assert_allclose(period, 2.0 * np.pi / minnaert(R0), rtol=1e-5)  # O(amplitude^2); measured 5e-7
    assert bubble.frequency(R0) == pytest.approx(minnaert(R0), rel=1e-12)


@pytest.mark.parametrize(("R0", "mu"), [(1e-3, 0.2), (1e-5, 0.003)])
def test_damping_is_that_of_linear_theory(R0, mu):
    bubble = RayleighPlesset(**{**STEAM, "mu": mu})
    rate = 2.0 * mu / (WATER.rho_l * R0**2)
    assert 0.01 < rate / minnaert(R0) < 0.1 and bubble.damping(R0) == pytest.approx(rate, rel=1e-12)
    t, R, U = history(bubble, 1.001 * R0, R0, periods=6)
    x, v = R / R0 - 1.0, U / R0
    omega2 = minnaert(R0) ** 2
    phase2 = omega2 * x**2 + v**2 + 2.0 * rate * x * v  # of a damped oscillator, exp(-2 rate t) without ripple
    got = np.log(phase2[0] / phase2[-1]) / (2.0 * t[-1])
    np.testing.assert_allclose(got, rate, rtol=1e-3)  # O(amplitude); measured 1.1e-4


def energy(R, U, R0):
    """Kinetic energy of the liquid, work against the ambient pressure and surface, energy of the gas [J]."""
    V, rest = 4.0 / 3.0 * np.pi * R**3, P + 2.0 * WATER.sigma / R0
    gas = rest * 4.0 / 3.0 * np.pi * R0**3 * (R0 / R) ** (3.0 * 0.33) / 0.33
    return 2.0 * np.pi * WATER.rho_l * R**3 * U**2 + P * V + 4.0 * np.pi * WATER.sigma * R**2 + gas


@pytest.mark.parametrize("R0", RADII)
@pytest.mark.parametrize("start", [0.6, 1.05, 1.5])
def test_energy_is_conserved_without_viscosity(R0, start):
    _, R, U = history(RayleighPlesset(**STEAM), start * R0, R0, periods=10, steps=20)
    excess = energy(R, U, R0) - energy(R0, 0.0, R0)
    assert np.ptp(R) > 0.09 * R0
    np.testing.assert_allclose(excess, excess[0], rtol=2e-5)  # RK4 at a tenth of the fastest rate; measured 7.5e-6


@pytest.mark.parametrize("start", [0.6, 1.5])
def test_large_oscillation_equals_scipy(start):
    R0, mu, p_inf = 1e-3, 0.05, 1.1 * P
    bubble = RayleighPlesset(**{**STEAM, "mu": mu})
    t, R, U = history(bubble, start * R0, R0, periods=3, p_inf=p_inf)

    def rates(t, y):
        r, u = y
        gas = (P + 2.0 * WATER.sigma / R0) * (R0 / r) ** 3.99
        net = gas - p_inf - 2.0 * WATER.sigma / r - 4.0 * mu * u / r
        return u, net / (WATER.rho_l * r) - 1.5 * u**2 / r

    want = solve_ivp(rates, (0.0, t[-1]), (start * R0, 0.0), t_eval=t, rtol=1e-10, atol=1e-13).y
    np.testing.assert_allclose(R, want[0], rtol=1e-5)  # measured 5e-7
    np.testing.assert_allclose(U, want[1], atol=1e-5 * np.abs(want[1]).max())


def test_bubbles_do_not_disturb_each_other():
    """Each takes steps of its own: together they end as they do alone, to the bit."""
    bubble, random = RayleighPlesset(**{**STEAM, "mu": 0.01}), np.random.default_rng(1)
    R0 = 10.0 ** random.uniform(-3.5, -2.0, 30)
    R, U, p_inf = R0 * random.uniform(0.7, 1.3, 30), random.normal(size=30), P * random.uniform(0.9, 1.1, 30)
    together = bubble.advance(R, U, R0, p_inf, 3e-4)
    for k in range(30):
        alone = bubble.advance(R[k:k + 1], U[k:k + 1], R0[k], p_inf[k], 3e-4)
        assert [value[k] for value in together] == [value[0] for value in alone]
    assert np.all(bubble.advance(R, U, R0, p_inf, 0.0)[0] == R)
    assert bubble.advance(np.zeros(0), np.zeros(0), np.zeros(0), P, 1e-3)[0].shape == (0,)


def test_radius_is_held_between_its_bounds_and_counted():
    R0 = np.array([1e-3, 1e-3, 1e-3])
    start = R0 * [0.5, 1.01, 1.0]
    velocity = np.array([0.0, 0.0, -50.0])
    R, U, clamped = RayleighPlesset(**STEAM).advance(start, velocity, R0, P, 2e-5, lower=0.9, upper=1.1)
    np.testing.assert_array_equal(clamped, [True, False, True])
    assert np.all(R >= 0.9 * R0) and np.all(R <= 1.1 * R0) and U[2] > 0.0  # it bounces off, by its own pressure
    R, U, clamped = RayleighPlesset(**STEAM).advance(R0, [50.0] * 3, R0, 0.1 * P, 2e-5, upper=1.1)
    np.testing.assert_allclose(R, 1.1 * R0, rtol=1e-15)
    assert np.all(clamped) and np.all(U == 0.0)

"""Cavities: the distribution of their radii, and the superheat at which they become active."""
import numpy as np
import pytest
from scipy.stats import kstest, pareto

from pysph_boiling.cavities import activation_superheat, cavity_radii
from pysph_boiling.materials import WATER_1ATM as WATER


@pytest.mark.parametrize("exponent", [1.0, 2.5, 6.0])
def test_radii_follow_the_power_law(exponent):
    """A Kolmogorov-Smirnov test, which a wrong exponent by a tenth fails at this count."""
    radii = cavity_radii(5000, smallest=2e-6, exponent=exponent, seed=3)
    assert radii.min() >= 2e-6
    assert kstest(radii, pareto(exponent, scale=2e-6).cdf).pvalue > 0.05
    assert kstest(radii, pareto(1.1 * exponent, scale=2e-6).cdf).pvalue < 1e-3


def test_a_largest_radius_cuts_the_power_law_off():
    radii = cavity_radii(5000, smallest=2e-6, largest=3e-6, seed=3)
    assert radii.min() >= 2e-6 and 2.99e-6 < radii.max() <= 3e-6
    law, most = pareto(2.5, scale=2e-6).cdf, pareto(2.5, scale=2e-6).cdf(3e-6)
    assert kstest(radii, lambda r: law(r) / most).pvalue > 0.05
    assert kstest(radii, lambda r: pareto(4.0, scale=2e-6).cdf(r) / pareto(4.0, scale=2e-6).cdf(3e-6)).pvalue < 1e-3


def test_active_sites_grow_with_a_power_of_the_superheat():
    """Mikic & Rohsenow 1969: N ~ dT^2.5, up to the superheat of the smallest cavity, at which all are active."""
    needed = activation_superheat(cavity_radii(20_000, smallest=1e-6, seed=5), WATER)
    most = activation_superheat(1e-6, WATER)
    assert needed.max() <= most
    for share in (0.25, 0.5, 0.75, 1.0):
        expected = 20_000 * share**2.5
        assert abs(np.count_nonzero(needed <= share * most) - expected) < 4.0 * np.sqrt(expected) + 1e-9


def test_superheat_of_water_by_hand():
    """2 sigma T_sat/(rho_v L r): 0.1178 N/m 373.15 K/(0.598 kg/m^3 2.257e6 J/kg 1e-6 m) = 32.57 K."""
    assert activation_superheat(1e-6, WATER) == pytest.approx(32.57, abs=0.005)
    np.testing.assert_allclose(activation_superheat(np.array([2e-6, 4e-6]), WATER), [16.285, 8.1425], atol=0.005)


def test_the_seed_decides():
    first = cavity_radii(8, smallest=1e-6, seed=1)
    np.testing.assert_array_equal(cavity_radii(8, smallest=1e-6, seed=1), first)
    assert np.all(cavity_radii(8, smallest=1e-6, seed=2) != first)
    assert len(np.unique(first)) == 8


@pytest.mark.parametrize("call, message", [
    (lambda: cavity_radii(0, smallest=1e-6), "number of cavities must be a whole number >= 1, got 0"),
    (lambda: cavity_radii(3, smallest=0.0), "smallest radius of a cavity must be > 0 m, got 0.0 m"),
    (lambda: cavity_radii(3, smallest=np.nan), "smallest radius of a cavity must be > 0 m, got nan m"),
    (lambda: cavity_radii(3, smallest=2e-6, largest=1e-6), "largest radius of a cavity must be above the smallest"),
    (lambda: cavity_radii(3, smallest=1e-6, exponent=-1.0), "exponent of cavity radii must be > 0, got -1.0"),
    (lambda: activation_superheat([1e-6, -1e-6], WATER), "radius of a cavity must be > 0 m"),
])
def test_cavities_that_cannot_be_are_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()

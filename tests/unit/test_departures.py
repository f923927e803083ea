"""Departures of made-up events, whose statistics are known."""
import numpy as np
import pytest

from pysph_boiling.analysis.departures import departed

STEADY = [(t, 10, 0) for t in (1.0, 2.0, 3.0, 4.0, 5.0)]
UNEVEN = [(t, 30, 2) for t in (1.5, 2.0, 3.0, 3.5, 4.5)]  # periods of 0.5 and 1 in turn: 0.75 and 0.25 about it
RARE = [(t, 50, 1) for t in (2.2, 2.9)]


def test_rate_gap_sizes_and_periods():
    found = departed([*STEADY, *UNEVEN, *RARE], 5.8)
    assert (found.begin, found.end) == (1.0, 5.8)
    assert found.rate == pytest.approx(11 / 4.8)
    assert (found.gap, found.gap_at) == (pytest.approx(0.8), 5.0)  # to the end
    np.testing.assert_array_equal(np.sort(found.sizes), [10] * 5 + [30] * 5 + [50] * 2)
    assert [(site.number, site.left) for site in found.sites] == [(0, 5), (1, 2), (2, 5)]
    even, rare, uneven = found.sites
    assert (even.period, even.scatter) == pytest.approx((1.0, 0.0))
    assert (uneven.period, uneven.scatter) == pytest.approx((0.75, 1.0 / 3.0))
    assert np.isnan(rare.period) and np.isnan(rare.scatter)
    np.testing.assert_allclose(found.scatters, [0.0, 1.0 / 3.0], atol=1e-15)


def test_longest_time_without_a_bubble_between_two():
    found = departed(STEADY + [(7.5, 10, 0)], 8.0)
    assert (found.gap, found.gap_at) == (2.5, 5.0)


def test_order_of_the_events_does_not_matter():
    events = [*STEADY, *UNEVEN]
    one, other = departed(events, 6.0), departed(events[::-1], 6.0)
    assert (one.rate, one.gap, one.sites) == (other.rate, other.gap, other.sites)


def test_without_departures():
    found = departed([], 3.0)
    assert found.rate == 0.0 and np.isnan(found.gap) and not len(found.sizes) and not found.sites


def test_events_of_earlier_versions_are_refused():
    with pytest.raises(ValueError, match="did not record from which site"):
        departed([(1.0, 10)], 2.0)

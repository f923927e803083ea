"""Fronts and orders of hand-made points."""
import math

import numpy as np
import pytest

from pysph_boiling.evaluation.accuracy.front import cheapest, order, pareto, spread

NAN = math.nan


@pytest.mark.parametrize("costs, errors, front", [
    ([1, 2, 3], [3, 2, 1], [0, 1, 2]),
    ([3, 1, 2], [1, 3, 2], [1, 2, 0]),  # cheapest first
    ([1, 2, 3], [1, 2, 3], [0]),
    ([1, 2, 3], [3, 3, 1], [0, 2]),  # dearer at the same error
    ([1, 1, 2], [2, 3, 1], [0, 2]),  # worse at the same cost
    ([1, 1], [2, 2], [0]),  # twice the same
    ([2, 1, 4, 3], [2, 5, 1.9, 3], [1, 0, 2]),
    ([1, NAN, 2, 3], [NAN, 0, 2, math.inf], [2]),
    ([], [], []),
])
def test_front(costs, errors, front):
    assert pareto(costs, errors) == front


def test_front_against_its_definition():
    rng = np.random.default_rng(3)
    costs, errors = rng.integers(1, 30, (2, 200))
    beaten = [any(c <= cost and e <= error and (c < cost or e < error or j < i)
                  for j, (c, e) in enumerate(zip(costs, errors))) for i, (cost, error) in enumerate(zip(costs, errors))]
    front = pareto(costs, errors)
    assert sorted(front) == np.flatnonzero(~np.array(beaten)).tolist()
    assert np.all(np.diff(costs[front]) > 0) and np.all(np.diff(errors[front]) < 0)


def test_front_wants_columns_of_one_length():
    with pytest.raises(ValueError, match="equal length"):
        pareto([1.0, 2.0], [1.0])


def test_cheapest_within_a_bound():
    costs, errors = [1.0, 2.0, 3.0, 2.5], [0.3, 0.1, 0.01, 0.09]
    assert [cheapest(costs, errors, bound) for bound in (1.0, 0.3, 0.1, 0.09, 0.02, 0.001)] == [0, 0, 1, 3, 2, None]


@pytest.mark.parametrize("p", [0.5, 1.0, 2.0, -1.0])
def test_order_of_an_exact_power(p):
    h = np.array([1.0, 0.5, 0.25, 0.1])
    found = order(h, -3.0 * h**p)
    assert found.order == pytest.approx(p, abs=1e-12) and found.spread == pytest.approx(0.0, abs=1e-12)
    assert found.constant == pytest.approx(3.0, rel=1e-12) and found.points == 4


def test_order_and_its_spread_against_the_textbook():
    """Slope and its standard error of y = x + (+d, -d, -d, +d) at x = 0, 1, 2, 3: 1 and 2 d/sqrt(10)."""
    d = 0.1
    found = order(np.exp([0.0, 1.0, 2.0, 3.0]), np.exp([d, 1.0 - d, 2.0 - d, 3.0 + d]))
    assert found.order == pytest.approx(1.0, rel=1e-12)
    assert found.spread == pytest.approx(math.sqrt(4.0 * d**2 / 2.0 / 5.0), rel=1e-12)


def test_order_leaves_out_what_has_no_logarithm():
    found = order([1.0, 0.5, 0.25, 0.125], [4.0, 1.0, 0.0, NAN])
    assert found.order == pytest.approx(2.0) and found.points == 2 and math.isnan(found.spread)
    with pytest.raises(ValueError, match="two or more step sizes"):
        order([1.0, 1.0, 0.5], [1.0, 2.0, 0.0])


def test_spread_is_half_the_range_over_the_median():
    assert spread([1.0, 2.0, 4.0]) == (2.0, 0.75)
    assert spread([3.0]) == (3.0, 0.0)

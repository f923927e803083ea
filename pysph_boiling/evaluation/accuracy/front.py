"""Pareto fronts of error against cost, and orders of convergence, as functions of numbers only."""
import math
from typing import NamedTuple

import numpy as np

__all__ = ["Order", "cheapest", "order", "pareto", "spread"]


def pareto(costs, errors):
    """Indices of the points for which no other point is better in both cost and error, cheapest first.

    Of several equal points only the first counts. A point whose cost or error is not finite is never on the front.
    """
    costs, errors = np.asarray(costs, dtype=float), np.asarray(errors, dtype=float)
    if costs.shape != errors.shape or costs.ndim != 1:
        raise ValueError(f"costs and errors must have equal length, got the shapes {costs.shape} and {errors.shape}")
    known = np.flatnonzero(np.isfinite(costs) & np.isfinite(errors))
    front, best = [], math.inf
    for index in known[np.lexsort((known, errors[known], costs[known]))]:
        if errors[index] < best:
            front.append(int(index))
            best = errors[index]
    return front


def cheapest(costs, errors, bound):
    """Index of the cheapest point whose error is at most ``bound``; ``None`` if there is none."""
    within = [index for index in pareto(costs, errors) if errors[index] <= bound]
    return within[0] if within else None


class Order(NamedTuple):
    """error = constant * h^order; ``spread`` is the standard error of the order, NaN for two points."""

    order: float
    spread: float
    constant: float
    points: int


def order(h, errors):
    """Observed :class:`Order` of convergence by a least-squares fit of the logarithms; points with 0, NaN or Inf are
    left out.

    Errors: ``ValueError`` if fewer than two different values of ``h`` are left.
    """
    h, errors = np.asarray(h, dtype=float), np.abs(np.asarray(errors, dtype=float))
    good = np.isfinite(h) & np.isfinite(errors) & (h > 0.0) & (errors > 0.0)
    x, y = np.log(h[good]), np.log(errors[good])
    if len(np.unique(x)) < 2:
        raise ValueError(f"an order needs errors at two or more step sizes, got {len(np.unique(x))}")
    around = x - x.mean()
    slope = float(around @ y / (around @ around))
    level = float(y.mean() - slope * x.mean())
    rest = y - level - slope * x
    deviation = math.sqrt(rest @ rest / (len(x) - 2) / (around @ around)) if len(x) > 2 else math.nan
    return Order(slope, deviation, math.exp(level), len(x))


def spread(values):
    """Median of the values, and half of their range relative to it."""
    values = np.asarray(values, dtype=float)
    median = float(np.median(values))
    return median, float(np.ptp(values) / (2.0 * median)) if median else math.nan

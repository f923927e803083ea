"""Cavities of a heated surface: their radii, and the superheat from which each of them makes bubbles.

Example: four cavities of water whose smallest radius is at least 1 um.

>>> from pysph_boiling.cavities import activation_superheat, cavity_radii
>>> from pysph_boiling.materials import WATER_1ATM
>>> radii = cavity_radii(4, smallest=1e-6, seed=1)
>>> (1e6 * radii).round(2).tolist()  # um
[1.33, 3.33, 1.06, 3.28]
>>> activation_superheat(radii, WATER_1ATM).round(1).tolist()  # K
[24.4, 9.8, 30.6, 9.9]
"""
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from pysph_boiling.materials import Material
from pysph_boiling.names import whole_number

__all__ = ["activation_superheat", "cavity_radii"]


def cavity_radii(count: int, *, smallest: float, largest: float = np.inf, exponent: float = 2.5,
                 seed: int | Sequence[int] = 0) -> np.ndarray:
    r"""Radii (count,) [m] of cavities, drawn from ``seed``; the number of those larger than r follows a power law.

    .. math::  N(>r) = N \frac{r^{-m} - r_{max}^{-m}}{r_{min}^{-m} - r_{max}^{-m}}, \qquad r_{min} \le r \le r_{max}

    ``smallest`` is r_min [m], ``largest`` is r_max [m], and ``exponent`` is m [-]. With :func:`activation_superheat`
    the number of cavities that are active at a superheat dT grows as dT^m up to the superheat of the smallest, at which
    all of them are; with a largest radius it begins at the superheat of that.

    Source: Mikic & Rohsenow 1969, with their m = 2.5 and, without a largest radius, their law.
    Errors: ``ValueError`` for a count that is no whole number above 0, a radius or an exponent that is not positive,
    and a largest radius that is not above the smallest.
    """
    count = whole_number("the number of cavities", count, low=1)
    for name, value, unit in (("smallest radius of a cavity", smallest, " m"),
                              ("exponent of cavity radii", exponent, "")):
        if not 0.0 < value < np.inf:
            raise ValueError(f"{name} must be > 0{unit}, got {value}{unit}")
    if not largest > smallest:
        raise ValueError(f"the largest radius of a cavity must be above the smallest, {smallest} m, got {largest} m")
    share = np.random.default_rng(seed).random(count) * (1.0 - (smallest / largest)**exponent)
    return smallest * (1.0 - share) ** (-1.0 / exponent)


def activation_superheat(radius: ArrayLike, material: Material) -> np.ndarray:
    r"""Superheat [K] from which vapour grows out of a cavity of ``radius`` [m], a number or an array.

    .. math::  \Delta T_a = \frac{2 \sigma T_{sat}}{\rho_v L r}

    Source: Griffith & Wallis 1960; Hsu 1962: the liquid must be hotter than the vapour of an embryo whose pressure
    exceeds that of the liquid by 2 sigma/r, by Clausius and Clapeyron with rho_v << rho_l.
    Errors: ``ValueError`` for a radius that is not positive.
    """
    radius = np.asarray(radius, dtype=float)
    if not np.all(radius > 0.0):
        raise ValueError(f"radius of a cavity must be > 0 m, got {radius} m")
    return 2.0 * material.sigma * material.T_sat / (material.rho_v * material.L * radius)

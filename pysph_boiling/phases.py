"""The four states of a particle, the edges between them, and temperature as a view of enthalpy.

The thermal state of a particle is its specific enthalpy ``e`` [J/kg], zero for saturated liquid. A phase change never
changes ``e``; it changes how a temperature follows from ``e``. This is the dual channel of the paper (section 3.3.2,
Table 2, Fig. 2): sensible and latent heat are two interpretations of one conserved quantity.

The table ``EDGES`` defines the state machine. The kernels of :mod:`pysph_boiling.equations.phase_change` implement it,
the tests check it row by row, and the figure of the state machine is drawn from it.
"""
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike

from pysph_boiling.materials import Material

__all__ = ["EDGES", "Edge", "Phase", "at_saturation", "enthalpy", "heat_capacity", "temperature"]


class Phase(IntEnum):
    """State of a particle; the integer stored in the property ``phase``.

    Code that compares all particles in every step uses ``.value``, because NumPy is five times as fast with a plain
    integer.
    """

    LIQUID = 0  #: below saturation; sensible heat
    TRANSITION = 1  #: undergoing phase change at T_sat; latent heat
    SUPERHEATED = 2  #: at or above saturation without a nucleation site; sensible heat above what an interruption held
    VAPOUR = 3  #: gas; sensible heat


@dataclass(frozen=True)
class Edge:
    """One transition of the state machine.

    ``enthalpy`` names the range that ``e`` must lie in: "negative", "stored" (0 <= e < L), "full" (e >= L), "not
    negative", or "lacking" (e < L in vapour). ``kinetic`` says whether a nucleation site must be near (the kinetic
    condition), ``None`` where it does not matter. ``by`` names the mechanism of an edge that is not decided by the
    particle alone.
    """

    source: Phase
    target: Phase
    enthalpy: str
    kinetic: bool | None
    meaning: str
    by: str = "phase_change"


EDGES = (
    Edge(Phase.LIQUID, Phase.TRANSITION, "not negative", True, "saturation reached at a site"),
    Edge(Phase.LIQUID, Phase.SUPERHEATED, "not negative", False, "saturation reached without a site"),
    Edge(Phase.SUPERHEATED, Phase.TRANSITION, "not negative", True, "resumption: excess sensible heat reads as latent"),
    Edge(Phase.TRANSITION, Phase.SUPERHEATED, "stored", False, "interruption: the site is lost"),
    Edge(Phase.TRANSITION, Phase.LIQUID, "negative", None, "cooling below saturation"),
    Edge(Phase.SUPERHEATED, Phase.LIQUID, "negative", None, "cooling below saturation"),
    Edge(Phase.TRANSITION, Phase.VAPOUR, "full", None, "latent heat complete"),
    Edge(Phase.SUPERHEATED, Phase.VAPOUR, "not negative", None, "dynamic nucleation", "nucleation"),
    Edge(Phase.VAPOUR, Phase.LIQUID, "lacking", None, "condensation", "condensation"),
)


def heat_capacity(held: ArrayLike, material: Material) -> np.ndarray:
    """Heat capacity [J/(kg K)] of liquid that holds the latent heat ``held`` [J/kg], (n,) or a number.

    Liquid that holds the part x of its latent heat is a mixture of which x is vapour: c = c_l + (c_v - c_l) x. With the
    capacity c_l of liquid alone, a particle that holds nearly L would become vapour of c_l/c_v = 2 times its superheat.
    So its temperature is that of vapour where e_lat = L, and becoming vapour heats no particle whose superheat is below
    L/(c_l - c_v) = 1055 K.
    """
    return material.c_l + (material.c_v - material.c_l) * np.clip(np.asarray(held) / material.L, 0.0, 1.0)


def temperature(e: ArrayLike, phase: ArrayLike, material: Material, e_lat: ArrayLike = 0.0,
                subcooling: float = 1.0) -> np.ndarray:
    """Temperature [K] of particles, (n,); the NumPy equivalent of the kernel helper ``boiling_temperature``.

    A particle in transition is at T_sat while 0 <= e <= L. Its phase only changes at the end of the heat steps, so with
    an enthalpy outside this range it already warms or cools like the phase that it will enter. If it stayed at T_sat,
    it would absorb heat without limit. The capacity of superheated liquid is :func:`heat_capacity`.

    Parameters
    ----------
    e : array (n,)      Specific enthalpy [J/kg], 0 for saturated liquid.
    phase : array (n,)  :class:`Phase` of each particle.
    material : Material
    e_lat : array (n,) or float  Latent heat held since an interruption [J/kg] (``interrupt="hold"``).
    subcooling : float  Fraction of the deficit L - e of vapour that lowers its temperature [-]: 1, or 0 if the deficit
        is latent heat.
    """
    e, phase = np.asarray(e, dtype=float), np.asarray(phase)
    below = material.T_sat + np.minimum(e, 0.0) / material.c_l
    liquid = below + np.maximum(e - e_lat, 0.0) / heat_capacity(e_lat, material)
    vapour = material.T_sat + np.where(e < material.L, subcooling, 1.0) * (e - material.L) / material.c_v
    transition = below + np.maximum(e - material.L, 0.0) / material.c_v
    return np.where(phase == Phase.VAPOUR, vapour, np.where(phase == Phase.TRANSITION, transition, liquid))


def at_saturation(phase: np.ndarray, e: np.ndarray, e_lat: ArrayLike = 0.0) -> np.ndarray:
    """Mask (n,) of particles whose state is superheated but which are at T_sat: interrupted, or fed at saturation.

    ``phase`` (n,), ``e`` (n,) [J/kg] and ``e_lat`` [J/kg], (n,) or a number, as in :func:`temperature`.
    """
    return (np.asarray(phase) == Phase.SUPERHEATED) & (np.asarray(e) <= e_lat)


def enthalpy(T: ArrayLike, material: Material) -> np.ndarray:
    """Specific enthalpy [J/kg] of liquid at temperature ``T`` [K]; above saturation it is superheated liquid.

    Raises ``ValueError`` outside (0 K, critical temperature).
    """
    T = np.asarray(T, dtype=float)
    if np.any(~np.isfinite(T)) or np.any(T <= 0.0) or np.any(T >= material.T_crit):
        bad = T[~np.isfinite(T) | (T <= 0.0) | (T >= material.T_crit)].flat[0]
        raise ValueError(f"temperature of liquid {material.name} must lie in (0, {material.T_crit}) K, got {bad} K")
    return material.c_l * (T - material.T_sat)

"""Condensation: applies to each particle what the host has decided for its bubble.

The decision is made by :func:`pysph_boiling.schemes.effects.condensation.choose`.
"""
from pysph_boiling.equations.helpers import boiling_temperature
from pysph_boiling.equations.phase_change import PhaseEquation

__all__ = ["BubbleCondensation"]


class BubbleCondensation(PhaseEquation):
    r"""Turns the chosen vapour into liquid at saturation; the other vapour of its bubble shares the remaining deficit.

    .. math::  e_i = L - \delta_i \text{ (vapour)}, \qquad e_i = -\delta_i \text{ (new liquid)}

    Source: the paper, section 4.2.2, eqs. 20-22.

    Parameters
    ----------
    T_sat, L, c_l, c_v, subcooling : float   As :class:`PhaseEquation`.

    Reads    d_deficit [J/kg], d_condensing (1 shares, 2 condenses).   Writes   d_e [J/kg], d_phase, d_T [K],
    d_condensed (count), d_condensing (0 again), own index only.
    Needs    the decision of the host in the group before; vapour holds no latent heat (e_lat = 0).
    """

    def initialize(self, d_idx, d_e, d_phase, d_T, d_condensing, d_deficit, d_condensed):
        if d_condensing[d_idx] > 0:
            d_e[d_idx] = self.L - d_deficit[d_idx]
            if d_condensing[d_idx] == 2:
                d_e[d_idx] = -d_deficit[d_idx]
                d_phase[d_idx] = 0
                d_condensed[d_idx] += 1
            d_condensing[d_idx] = 0
            d_T[d_idx] = boiling_temperature(d_e[d_idx], 0.0, d_phase[d_idx], self.T_sat, self.L, self.c_l, self.c_v,
                                             self.subcooling)

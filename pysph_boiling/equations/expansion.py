"""Expansion: vapour swells, slowly enough not to throw the liquid around it."""
from pysph.sph.equation import Equation

__all__ = ["BubbleSwell", "BubbleSwellBack"]


class BubbleSwell(Equation):
    """Moves the rest volume of a particle, relative to the volume as liquid, towards that of its phase.

    Source: ours; without it liquid and vapour fill the same volume, so that a pool neither swells nor bursts.

    Parameters
    ----------
    expanded : float   Swell of vapour [-], >= 1; all other particles return to 1.
    rate : float       Largest rate of change of the swell [1/s], > 0.
    vapour : bool      Whether this equation changes vapour; ``False`` leaves it to the Rayleigh-Plesset oscillation.

    Reads    d_phase, the time step.   Writes   d_swell [-], d_swelling (its rate in this step) [1/s], own index only.
    Errors   ValueError if expanded < 1 or rate <= 0.   Limits   No work is done against the ambient pressure: enthalpy,
    not energy, is the thermal state.
    """

    def __init__(self, dest, sources, expanded, rate, vapour=True):
        if not expanded >= 1.0:
            raise ValueError(f"expanded must be >= 1, got {expanded}")
        if not rate > 0.0:
            raise ValueError(f"rate of the expansion must be > 0 1/s, got {rate}")
        self.expanded = float(expanded)
        self.rate = float(rate)
        self.vapour = float(vapour)
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_phase, d_swell, d_swelling, dt):
        goal = 1.0
        most = self.rate * dt
        if d_phase[d_idx] == 3:
            goal = self.expanded
            most = most * self.vapour
        change = min(max(goal - d_swell[d_idx], -most), most)
        d_swell[d_idx] += change
        d_swelling[d_idx] = change / max(dt, 1e-30)


class BubbleSwellBack(Equation):
    r"""Sets the swell back to that before a short step, or forward again: :math:`s \mathrel{+}= \pm \dot s\, \Delta t`.

    A short step may follow a long one, whose change of the swell still affects the next positions. The part of this
    change that exceeds the rate times the short step is treated as an earlier density error and causes no velocity.

    Source: ours.

    Parameters
    ----------
    sense : float   -1 for back, 1 for forward [-].

    Reads    d_swelling [1/s], the time step.   Writes   d_swell [-], own index only.
    Errors   ValueError if sense is neither -1 nor 1.
    """

    def __init__(self, dest, sources, sense):
        if sense not in (-1.0, 1.0):
            raise ValueError(f"sense must be -1 or 1, got {sense}")
        self.sense = float(sense)
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_swell, d_swelling, dt):
        d_swell[d_idx] += self.sense * dt * d_swelling[d_idx]

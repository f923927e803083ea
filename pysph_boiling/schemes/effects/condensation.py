"""Condensation: a bubble that has lost the latent heat of some particles returns these particles to the liquid."""
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from pysph_boiling.equations import condensation
from pysph_boiling.particles import Property
from pysph_boiling.schemes.effects.base import Effect, Rule, cumulative, param
from pysph_boiling.schemes.stages import Term

__all__ = ["Condensation", "choose", "random_key"]

SHARES, CONDENSES = 1, 2  # values of the property ``condensing``; particles with 0 do not change
STREAM = 20  # stream of the random numbers, named after eq. 20; each use of random numbers has its own


@dataclass(frozen=True, kw_only=True)
class Condensation(Effect):
    """Vapour below saturation condenses: as many particles of a bubble as the heat that the bubble has lost.

    In the form "latent", vapour that loses heat stays at T_sat, and its deficit is latent heat that is pooled over its
    bubble. In the form "paper" vapour cools, and a bubble condenses nothing until the subcooling of its particles adds
    up to L/c_v (1087 K in water). Small bubbles never reach this: 11 particles last forever in ice water.
    """

    slot: ClassVar[str] = "condensation"
    title: ClassVar[str] = "condensation"
    requires: ClassVar[tuple[str, ...]] = ("bubbles",)
    auto_rule: ClassVar[Rule] = Rule(
        lambda facts, chosen: facts.coldest < facts.T_sat,
        "something is below saturation", "nothing is below saturation")
    form: str = param("latent", "-", "latent: the deficit of vapour is latent heat, pooled per bubble; paper: it cools "
                      "the vapour", choices=("latent", "paper"))
    seed: int = param(0, "-", "seed of the choice of particles", low=0)

    @property
    def subcooling(self):
        """Fraction of the deficit of vapour that lowers its temperature [-]."""
        return 1.0 if self.form == "paper" else 0.0

    def properties(self, scene):
        return (
            Property("condensing", "-", "1: shares the bubble's deficit, 2: condenses; 0 when done", "int"),
            Property("deficit", "J/kg", "deficit of enthalpy that is left after its bubble has condensed"),
            Property("condensed", "-", "times the particle condensed", "int", True, True),
        )

    def constants(self, scene):
        return {"steps": 0.0, "relabel": 0.0}

    def columns(self, scene):
        return (cumulative("n_condensed", "-", "particles condensed since the start", "condensed"),)

    def hooks(self, scene):
        from pysph_boiling.parallel import ranks
        from pysph_boiling.schemes.integrator import set_constant
        from pysph_boiling.schemes.vapour import Vapour

        def decide(arrays):
            if any(pa.relabel[0] > 0.0 for pa in arrays):
                return  # the second pass only labels the remaining bubbles
            vapour, L = Vapour(arrays), scene.material.L
            m, e = vapour.get("m"), vapour.get("e")
            lightest = -vapour.max(-m, least=-np.inf)
            enough = vapour.sum(m * np.maximum(L - e, 0.0)) >= 0.999 * L * lightest  # sums differ by round-off
            who = np.flatnonzero(enough[vapour.index])
            if not enough.any():
                return
            uid, own = ranks.gather(vapour.get("uid")[who])  # the choice is made for a whole bubble, on all ranks
            key = random_key(uid, self.seed, STREAM, int(arrays[0].steps[0]))
            chosen = choose(*(ranks.gather(values[who])[0] for values in (vapour.index, m, e)), key, L)
            if chosen[0].any():
                for name, values in zip(("condensing", "deficit"), chosen):
                    everywhere = np.zeros(len(vapour), values.dtype)
                    everywhere[who] = values[own]
                    vapour.put(name, everywhere)
                for pa in arrays:
                    set_constant(pa, "relabel", 1.0)

        return {"bubbles.label": decide}

    def terms(self, scene, fluid):
        material = scene.material
        yield Term("bubbles.condense", condensation.BubbleCondensation(
            fluid, None, T_sat=material.T_sat, L=material.L, c_l=material.c_l, c_v=material.c_v,
            subcooling=self.subcooling))


def choose(bubble, m, e, key, L):
    """Choose the vapour that condenses, and the deficits of the other vapour of its bubble.

    The deficit of a bubble is Q = sum m (L - e) over its members with e < L (eq. 20). In the order of their keys, as
    many of these condense as sum m L <= Q allows (eq. 21, for any masses). The others share the rest of Q evenly by
    mass (eq. 22); if all condense, the new liquid shares it. The sum m e of a bubble never changes.

    Parameters
    ----------
    bubble : int array (n,)   Number of the bubble of each vapour particle, from 0.
    m, e : array (n,)         Mass [kg] and specific enthalpy [J/kg].
    key : array (n,)          Random numbers, all different.
    L : float                 Latent heat [J/kg].

    Returns (fate, deficit): 0, ``SHARES`` or ``CONDENSES`` (n,), and the new deficit [J/kg] (n,).
    """
    fate, deficit = np.zeros(len(e), int), np.zeros(len(e))
    members = np.flatnonzero(e < L)
    members = members[np.lexsort((key[members], bubble[members]))]  # so sums do not depend on the order
    m, e, bubble = m[members], e[members], bubble[members]
    lacks = np.bincount(bubble, weights=m * (L - e))
    for number in np.flatnonzero(lacks >= L * np.min(m, initial=np.inf)):
        here = slice(*np.searchsorted(bubble, [number, number + 1]))
        who, mass = members[here], m[here]
        paid = L * np.cumsum(mass)
        n = int(np.searchsorted(paid, lacks[number], side="right"))
        if n > 0:
            fate[who[:n]], fate[who[n:]] = CONDENSES, SHARES
            heirs = slice(n, None) if n < len(who) else slice(None)
            deficit[who[heirs]] = (lacks[number] - paid[n - 1]) / np.sum(mass[heirs])
    return fate, deficit


def random_key(uid, *counters):
    """Random uint32 for each uid from counters (seed, stream, step); two uids never get the same number."""
    h = np.asarray(uid, np.uint32)
    for counter in (0, *counters):  # the uids alone come first, since a seed would only shift them
        h = h + np.uint32(counter % 2**32)
        h = (h ^ (h >> 16)) * np.uint32(569420461)
        h = (h ^ (h >> 15)) * np.uint32(1935289751)
        h = h ^ (h >> 15)
    return h

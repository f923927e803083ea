"""``effects="auto"``: chooses the effects that a scene needs from its arrays and temperatures, and gives the reasons.

Each effect has its rule (``Effect.auto_rule``). Slots are processed in an order in which a rule can use the effects
that were chosen before.
"""
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pysph_boiling.particles import positions
from pysph_boiling.schemes.effects import EFFECTS, BoxContainer, Rule

__all__ = ["Choice", "Facts", "choose", "facts_of", "report"]


ASKED_FOR = Rule(None, "asked for", "only if asked for")


@dataclass(frozen=True)
class Facts:
    """Facts about a scene for the rules; temperatures in K, ``hottest`` and ``coldest`` include all sources."""

    g: float
    walls: bool
    heated: bool
    sites: bool
    coldest: float
    hottest: float
    uniform: bool
    T_sat: float
    fires_above: float
    candidates: dict


class Choice(NamedTuple):
    """A slot, the effect chosen for it or ``None``, and the reason."""

    slot: str
    effect: object
    reason: str


def facts_of(scheme, arrays, T, candidates):
    """The :class:`Facts` of arrays before they are set up; ``T`` [K] is the initial temperature, a number or (n,).

    Raises ``ValueError`` if walls are heated but there is no heater among the ``candidates``.
    """
    material, scene = scheme.material, scheme.scene()
    if material is None:  # motion alone
        return Facts(g=scene.g, walls=bool(scheme.solids), heated=False, sites=False, coldest=0.0, hottest=0.0,
                     uniform=True, T_sat=0.0, fires_above=0.0, candidates=candidates)
    T = np.asarray(material.T_sat if T is None else T, dtype=float)
    walls = [pa for pa in arrays if pa.name in scheme.solids and "heated" in pa.properties]
    heated = any(np.any(pa.get("heated") == 1) for pa in walls)
    heater = candidates.get("heater")
    if heated and heater is None:
        raise ValueError("walls are heated: effects='auto' needs heater=Heater(temperature=...) or Heater(flux=...)")
    temperatures = [float(T.min()), float(T.max())]
    if heated:
        temperatures.append(heater.temperature if heater.temperature is not None else math.inf)
    if "source" in candidates and candidates["source"].density > 0.0:
        temperatures.append(math.inf)
    cooling = [candidates["loss"].T_ambient] if "loss" in candidates else []
    feed = getattr(candidates.get("venting"), "T_feed", None)
    nucleation = candidates.get("dynamic_nucleation") or EFFECTS["dynamic_nucleation"][0]()
    return Facts(
        g=scene.g, walls=bool(scheme.solids), heated=heated, sites=bool(scheme.sites),
        coldest=min([*temperatures, *cooling, *([feed] if feed else [])]), hottest=max(temperatures),
        uniform=float(np.ptp(T)) < 1e-9, T_sat=material.T_sat, fires_above=max(nucleation.onset(scene)),
        candidates=candidates)


def needs(slot):
    """The slots that must be chosen before ``slot``."""
    effect = EFFECTS[slot][0]
    return {*effect.requires, *(effect.auto_rule.after if effect.auto_rule else ())}


def first(slot):
    """The slots that must be decided before ``slot``: those it needs, and others that its rule asks about."""
    rule = EFFECTS[slot][0].auto_rule
    return needs(slot) | set(rule.decided if rule else ())


def in_order(slots):
    """``slots`` in an order in which each comes after those decided first. Raises ``ValueError`` for a circle."""
    pending, order = list(slots), []
    while pending:
        free = [slot for slot in pending if not first(slot) & set(pending)]
        if not free:
            raise ValueError(f"effects need each other, or themselves: {', '.join(sorted(pending))}")
        pending.remove(free[0])
        order.append(free[0])
    return order


def choose(scheme, arrays, T=None, candidates=None, overrides=None):
    """A list of :class:`Choice`, one for each slot of the scheme.

    ``candidates`` (slot -> effect) have the parameters to use if they are chosen; other effects have their default
    parameters. ``overrides`` (slot -> effect or ``None``) are used as they are.
    """
    overrides, candidates = overrides or {}, dict(candidates or {})
    candidates.update((slot, effect) for slot, effect in overrides.items() if effect is not None)
    facts, on, choices = facts_of(scheme, arrays, T, candidates), {}, []
    for slot in in_order(scheme.slots):
        rule = EFFECTS[slot][0].auto_rule or ASKED_FOR
        lacks = sorted(needs(slot) - set(on))
        wanted = not lacks and (slot in candidates if rule is ASKED_FOR else rule.holds(facts, on))
        reason = f"it needs {lacks[0]}" if lacks else (rule.why if wanted else rule.why_not).format(wanted, f=facts)
        if slot in overrides:
            wanted, reason = overrides[slot] is not None, "as asked"
        effect = None
        if wanted:
            effect = candidates.get(slot) or default(slot, scheme, arrays)
            on[slot] = effect
        choices.append(Choice(slot, effect, reason))
    return choices


def default(slot, scheme, arrays):
    """The effect of a slot with default parameters."""
    if slot == "container":  # around the outside of the walls, it catches particles that leak through them
        half = 0.5 * scheme.spacing
        points = np.concatenate([positions(pa) for pa in arrays if pa.name in scheme.solids])
        return BoxContainer(lower=tuple(points.min(0) - half), upper=tuple(points.max(0) + half))
    return EFFECTS[slot][0]()


def report(choices):
    """Text that says which effects were chosen and why."""
    return "\n".join(f"{'with' if choice.effect is not None else 'without'} {choice.slot}: {choice.reason}"
                     for choice in choices)

"""``effects="auto"``: which effects a scene calls for, from what is in it, and why.

``RULES`` is the table: one row a slot, in an order in which a rule may ask what was chosen before it.
"""
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pysph_boiling.schemes.effects import EFFECTS, BoxContainer

__all__ = ["Choice", "Facts", "choose", "facts_of", "report"]


@dataclass(frozen=True)
class Facts:
    """What a scene shows of itself: temperatures in K, ``hottest`` and ``coldest`` over the start and every source."""

    g: float
    walls: bool
    heated: bool
    sites: bool
    coldest: float
    hottest: float
    uniform: bool
    T_sat: float
    burst_at: float
    candidates: dict


class Choice(NamedTuple):
    """A slot, its effect or ``None``, and why."""

    slot: str
    effect: object
    reason: str


def facts_of(scheme, arrays, T, candidates):
    """The :class:`Facts` of arrays that have not been set up yet; ``T`` [K] is the start temperature, or (n,) of them.

    Raises ``ValueError`` where walls are heated and no heater says how.
    """
    material, scene = scheme.material, scheme.scene()
    if material is None:  # motion alone
        return Facts(g=scene.g, walls=bool(scheme.solids), heated=False, sites=False, coldest=0.0, hottest=0.0,
                     uniform=True, T_sat=0.0, burst_at=0.0, candidates=candidates)
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
    burst = candidates.get("burst") or EFFECTS["burst"][0]()
    return Facts(
        g=scene.g, walls=bool(scheme.solids), heated=heated, sites=bool(scheme.sites),
        coldest=min([*temperatures, *cooling, *([feed] if feed else [])]), hottest=max(temperatures),
        uniform=float(np.ptp(T)) < 1e-9, T_sat=material.T_sat, burst_at=max(burst.onset(scene)), candidates=candidates)


def _heat(f, on):
    if f.heated or {"loss", "source"} & set(f.candidates):
        return "something heats or cools"
    return "temperatures differ" if not f.uniform else "it starts above saturation" if f.hottest > f.T_sat else ""


# slot -> (what must have been chosen before, function of facts and choices -> holds, why if so, why if not)
RULES = {
    "density": ((), lambda f, on: f.g > 0.0, "there is gravity", "no gravity: nothing sets the fluid in motion"),
    "container": (("density",), lambda f, on: f.walls, "a safety net behind the walls", "there are no walls"),
    "viscosity": (("density",), lambda f, on: True, "motion needs damping at the scale of a particle", ""),
    "heat": ((), _heat, "{}", "no heater, and uniform, not above saturation"),
    "heater": (("heat",), lambda f, on: f.heated, "walls are heated", "no wall is heated"),
    "loss": (("heat",), lambda f, on: "loss" in f.candidates, "asked for", "only if asked for"),
    "source": (("heat",), lambda f, on: "source" in f.candidates, "asked for", "only if asked for"),
    "phases": (("heat",), lambda f, on: f.hottest > f.T_sat, "something is above saturation",
               "nothing can reach saturation"),
    "nucleation": (("phases",), lambda f, on: f.sites, "there are sites", "there are no sites"),
    "storage": (("phases", "nucleation"), lambda f, on: "storage" in f.candidates, "asked for", "only mode li_xiao"),
    "burst": (("phases",), lambda f, on: f.hottest > f.T_sat + f.burst_at,
              "liquid may superheat to the {f.burst_at:.0f} K at which a region fires",
              "no superheat of {f.burst_at:.0f} K, at which a region fires"),
    "bubbles": (("phases",), lambda f, on: True, "there can be vapour", ""),
    "condensation": (("bubbles",), lambda f, on: f.coldest < f.T_sat, "something is below saturation",
                     "nothing is below saturation"),
    "pooling": (("bubbles",), lambda f, on: on["phases"].kinetic == "site" and on["phases"].vapour_as_site,
                "bubbles grow by the heat of the liquid round them", "bubbles do not grow by vapour as a site"),
    "buoyancy": (("bubbles", "density"), lambda f, on: f.g > 0.0, "bubbles rise", "no gravity"),
    "tension": (("phases", "density"), lambda f, on: True, "bubbles hold together", ""),
    "adhesion": (("nucleation", "density"), lambda f, on: True, "bubbles stick to their sites", ""),
    "drag": (("phases", "density"), lambda f, on: True, "bubbles drag the liquid along", ""),
    "convection": (("heat", "density"), lambda f, on: "phases" not in on and f.g > 0.0, "warm liquid rises",
                   "bubbles stir more than warm liquid does"),
    "expansion": (("burst", "density"), lambda f, on: True, "what bursts must swell", ""),
    "oscillation": (("bubbles", "density"), lambda f, on: "oscillation" in f.candidates, "asked for",
                    "only if asked for"),
    "venting": (("bubbles", "density"), lambda f, on: f.g > 0.0, "bubbles reach the surface", "no gravity"),
    "refill": (("venting", "container"), lambda f, on: on["venting"].mode == "remove", "what leaves is to come back",
               "the lid returns what is vented"),
    "mechanics": (("density",), lambda f, on: "mechanics" in f.candidates, "asked for", "only if asked for"),
}


def choose(scheme, arrays, T=None, candidates=None, overrides=None):
    """A list of :class:`Choice`, one for each slot of the scheme.

    ``candidates`` gives the parameters of effects that are chosen; an effect that is chosen without one has its
    defaults. ``overrides`` (slot -> effect or ``None``) are taken as they are.
    """
    overrides, candidates = overrides or {}, dict(candidates or {})
    candidates.update((slot, effect) for slot, effect in overrides.items() if effect is not None)
    facts, on, choices = facts_of(scheme, arrays, T, candidates), {}, []
    for slot, (needs, holds, why, why_not) in RULES.items():
        if slot not in scheme.slots:
            continue
        lacks = [needed for needed in needs if needed not in on]
        wanted = not lacks and holds(facts, on)
        reason = f"it needs {lacks[0]}" if lacks else (why if wanted else why_not).format(wanted, f=facts)
        if slot in overrides:
            wanted, reason = overrides[slot] is not None, "as asked"
        effect = None
        if wanted:
            effect = candidates.get(slot) or default(slot, scheme, arrays)
            on[slot] = effect
        choices.append(Choice(slot, effect, reason))
    return choices


def default(slot, scheme, arrays):
    """The effect of a slot that nobody gave parameters for."""
    if slot == "container":  # the outside of the walls: it catches what leaks through them
        half = 0.5 * scheme.spacing
        points = np.concatenate([np.stack([pa.x, pa.y, pa.z], -1) for pa in arrays if pa.name in scheme.solids])
        return BoxContainer(lower=tuple(points.min(0) - half), upper=tuple(points.max(0) + half))
    return EFFECTS[slot][0]()


def report(choices):
    """What was chosen and why, as text."""
    return "\n".join(f"{'with' if choice.effect is not None else 'without'} {choice.slot}: {choice.reason}"
                     for choice in choices)

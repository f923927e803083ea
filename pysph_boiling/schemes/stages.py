"""The order of a step: the stages and their groups, to which the terms of the effects belong.

``STAGES`` follows Algorithm 1 of the paper, with its loop rotated so that it needs one neighbour search. An effect only
says to which group a term belongs, and this table gives the order. A stage without terms is not built.
"""
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

from pysph.sph.equation import Equation, Group

from pysph_boiling.names import unknown

__all__ = ["PLACES", "STAGES", "Block", "GroupSpec", "Stage", "Term", "build_stage", "check_places"]


class Term(NamedTuple):
    """An equation and the group it belongs to, written ``"stage.group"``; ``owner`` is filled in by the scheme."""

    place: str
    equation: Equation
    owner: str = ""


@dataclass(frozen=True)
class GroupSpec:
    """A group: equations that share one loop over neighbours. ``refresh`` names properties to refresh on ghosts."""

    name: str
    meaning: str
    refresh: tuple[str, ...] = ()


@dataclass(frozen=True)
class Block:
    """Groups that run in order.

    ``iterate`` names a pair of limits (min, max) between which they repeat until they have converged, and ``when`` a
    condition under which they run.
    """

    groups: tuple[GroupSpec, ...]
    iterate: str | None = None
    when: str | None = None


@dataclass(frozen=True)
class Stage:
    """A stage with its own evaluator, which is one compiled module. ``when`` says under which condition it runs."""

    name: str
    when: str
    blocks: tuple[Block, ...]


STAGES = (
    Stage("heat", "n_sub times", (
        Block((
            GroupSpec("temperature", "temperature and conductivity from enthalpy", ("T", "k")),
            GroupSpec("weights", "weights of the heater's power"),
            GroupSpec("heater", "heat from heaters"),
            GroupSpec("interface", "conductivity of liquid in transition, by its distance from vapour", ("k",)),
            GroupSpec("exchange", "conduction, loss, source"),
            GroupSpec("update", "forward Euler step of the enthalpy, and its temperature", ("e", "T")),
        )),
    )),
    Stage("phases", "some liquid at or above saturation", (
        Block((
            GroupSpec("kinetic", "kinetic condition"),
            GroupSpec("dormant", "no kinetic condition at dormant sites"),
            GroupSpec("edges", "state machine", ("phase", "T")),
            GroupSpec("activate", "sites wake and fall asleep"),
        )),
        Block((
            GroupSpec("occupied", "sites that hold a bubble, the nearest site of each particle", ("site", "site_r2")),
            GroupSpec("choose", "the nearest liquid of each site, and the heat to vaporise it"),
            GroupSpec("absorb", "superheated liquid gives heat to the nearest site", ("e", "T", "paid")),
            GroupSpec("emit", "a site with enough heat emits a bubble"),
            GroupSpec("become", "the chosen liquid becomes vapour", ("phase", "T", "e")),
        )),
    )),
    Stage("dynamic_nucleation", "enough superheat for one region to fire", (
        Block((
            GroupSpec("held", "latent heat that superheated particles hold", ("held",)),
            GroupSpec("region", "sensible heat of the region around each superheated particle",
                      ("region_heat", "fire_key", "pick_key")),
            GroupSpec("claim", "the strongest region that claims a particle", ("claim",)),
            GroupSpec("fire", "regions with the strongest claim on all members fire, and choose some of them",
                      ("cut", "e_chosen", "e_others")),
            GroupSpec("share", "the chosen become vapour, the others share the rest", ("e", "phase", "T")),
        )),
    )),
    Stage("bubbles", "some vapour; again if bubbles have gained or lost particles", (
        Block((GroupSpec("start", "every particle is its own parent", ("grandparent",)),)),
        Block((
            GroupSpec("snap", "grandparents", ("grandparent",)),
            GroupSpec("hook", "hooking onto the smallest label in reach"),
            GroupSpec("shortcut", "pointer jumping"),
            GroupSpec("check", "converged?"),
        ), iterate="label_rounds"),
        Block((
            GroupSpec("label", "labels", ("bubble",)),
            GroupSpec("condense", "subcooled vapour condenses", ("e", "phase", "T")),
            GroupSpec("interface", "liquid in transition joins the nearest bubble", ("joined",)),
            GroupSpec("pool", "pooled latent heat turns the nearest liquid into vapour", ("e", "phase", "T")),
            GroupSpec("film", "liquid that is itself free surface", ("film",)),
            GroupSpec("free", "vapour with nothing but film above it"),
        )),
    )),
    Stage("density", "always; once more after the oscillation, if it is closing", (
        Block((
            GroupSpec("back", "in a short step: positions at its start, in the container", ("x", "y", "z", "swell")),
            GroupSpec("before", "in a short step: density at its start"),
            GroupSpec("left_over", "in a short step: density error at its start; back", ("x", "y", "z", "swell")),
        ), when="short_step"),
        Block((GroupSpec("contact", "predicted positions that lie in a wall", ("x", "y", "z")),)),
        Block((
            GroupSpec("multiplier", "density, its gradients, Lagrange multiplier; cohesion", ("lmbda",)),
            GroupSpec("walls", "multipliers of walls, from those of the fluid", ("wall_lmbda",)),
            GroupSpec("correction", "position correction"),
            GroupSpec("pull", "the displacement by cohesion applied"),
            GroupSpec("move", "the correction applied, containers", ("x", "y", "z")),
        ), iterate="sweeps"),
    )),
    Stage("oscillation", "some bubble outside its radii", (
        Block((GroupSpec("push", "displacement to the target radius, computed on the host", ("x", "y", "z")),)),
    )),
    Stage("forces", "always", (
        Block((
            GroupSpec("walls", "multipliers of walls with which a step begins", ("wall_start",)),
            GroupSpec("sum", "every acceleration of the next prediction"),
            GroupSpec("release", "free vapour falls"),
            GroupSpec("pressure", "pressure of the sweeps, for the mechanical ledger"),
            GroupSpec("next", "what the next step begins with: rest volume", ("swell",)),
        )),
    )),
)


PLACES = {f"{stage.name}.{spec.name}": stage.name for stage in STAGES for block in stage.blocks
          for spec in block.groups}  # place -> its stage


def check_places(terms: Sequence[Term], hooks: dict[str, Iterable[str]], conditions: dict[str, Iterable[str]]) -> None:
    """Raise ``ValueError`` for a place or stage that does not exist, or that has no equations.

    ``terms`` are all terms of a scheme; ``hooks`` and ``conditions`` map slots of effects to places and stages.
    """
    for term in terms:
        if term.place not in PLACES:
            raise unknown(f"place for {type(term.equation).__name__} of effect '{term.owner}':", term.place, PLACES)
    built = {term.place for term in terms}
    for slot, places in hooks.items():
        for place in places:
            if place not in PLACES:
                raise unknown(f"place for a hook of effect '{slot}':", place, PLACES)
            if place not in built:
                raise ValueError(f"effect '{slot}' hooks on '{place}', which has no equations here: the hook would "
                                 "never run")
    stages = dict.fromkeys(PLACES.values())
    for slot, names in conditions.items():
        for name in names:
            if name not in stages:
                raise unknown(f"stage for a condition of effect '{slot}':", name, stages)
            if name not in {PLACES[place] for place in built}:
                raise ValueError(f"effect '{slot}' has a condition for the stage '{name}', which has no equations here")


class Hooks(list):
    """Functions that run on the host after a group, in order."""

    def __call__(self):
        for hook in self:
            hook()


def build_stage(stage: Stage, terms: Sequence[Term], *, limits: dict[str, tuple[int, int]],
                conditions: dict[str, Callable], hooks: Callable, tag: str = "",
                apart: dict[str, Callable] | None = None) -> list[Group] | None:
    """The PySPH groups of one stage from its terms, or ``None`` if no term belongs to it.

    ``limits`` maps the name of an iterated block to (min, max), and ``conditions`` that of a conditional block to a
    function of (t, dt). ``hooks(place, spec)`` lists the functions that run on the host after a group. Groups have
    names because PySPH writes them into the generated source, which is the key of its cache; they end with ``tag``,
    which identifies the compiler flags. ``apart`` maps a place whose terms have one group per owner to a function that
    is called with the owner after each. Only parent groups iterate, and only sub-groups have hooks or conditions,
    because other combinations do not compile on every backend. A group finishes one array before it begins the next, so
    values that neighbours read must be written in another group (``tests/unit/test_order.py``).
    """
    blocks, apart = [], apart or {}
    for number, block in enumerate(stage.blocks):
        groups = []
        for spec in block.groups:
            place = f"{stage.name}.{spec.name}"
            here = [term for term in terms if term.place == place]
            if place in apart:
                owners = list(dict.fromkeys(term.owner for term in here))
                for owner in owners:
                    equations = [term.equation for term in here if term.owner == owner]
                    after = hooks(place, spec) if owner == owners[-1] else ()
                    groups.append(Group(equations, name=f"{place}_{owner}".replace(".", "_"),
                                        post=Hooks([partial(apart[place], owner), *after])))
            elif here:
                groups.append(Group([term.equation for term in here], name=place.replace(".", "_"),
                                    post=Hooks(hooks(place, spec)) or None,
                                    condition=conditions.get(block.when or "")))
        if groups:
            options = {}
            if block.iterate:
                low, high = limits[block.iterate]
                options = dict(iterate=True, min_iterations=low, max_iterations=high)
            blocks.append(Group(groups, name=f"{stage.name}{number}{tag}", **options))
    return blocks or None

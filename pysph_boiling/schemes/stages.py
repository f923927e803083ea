"""The order of a step: stages, their groups, and how the terms of the effects fall into place.

``STAGES`` reads like Algorithm 1 of the paper with its loop rotated so that one neighbour search serves it. An effect
says only to which group a term belongs; the table gives the order. A stage without terms is not built.
"""
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
    """A group: equations that share one neighbour sweep. ``refresh`` names what ghosts need once it has run."""

    name: str
    meaning: str
    refresh: tuple[str, ...] = ()


@dataclass(frozen=True)
class Block:
    """Groups that run in order: until converged, within the pair of limits (min, max) that ``iterate`` names, or only
    where the condition holds that ``when`` names.
    """

    groups: tuple[GroupSpec, ...]
    iterate: str | None = None
    when: str | None = None


@dataclass(frozen=True)
class Stage:
    """One evaluator, that is one compiled module. ``when`` says on which condition a step runs it."""

    name: str
    when: str
    blocks: tuple[Block, ...]


STAGES = (
    Stage("heat", "n_sub times", (
        Block((
            GroupSpec("temperature", "temperature and conductivity from enthalpy", ("T", "k")),
            GroupSpec("weights", "shares of the heater's power"),
            GroupSpec("exchange", "conduction, heater, loss, source"),
            GroupSpec("update", "forward Euler step of the enthalpy, and its temperature", ("e", "T")),
        )),
    )),
    Stage("phases", "some liquid at or above saturation", (
        Block((
            GroupSpec("kinetic", "kinetic condition"),
            GroupSpec("edges", "state machine", ("phase", "T")),
        )),
        Block((
            GroupSpec("occupied", "sites that hold a bubble, the nearest site of each particle", ("site", "site_r2")),
            GroupSpec("choose", "the nearest liquid of each site, and what its vapour would cost"),
            GroupSpec("absorb", "superheated liquid pays into the nearest site", ("e", "T", "paid")),
            GroupSpec("emit", "a site that can pay turns the nearest liquid into vapour"),
            GroupSpec("become", "the chosen liquid becomes vapour", ("phase", "T", "e")),
        )),
    )),
    Stage("dynamic_nucleation", "enough superheat for one region to fire", (
        Block((
            GroupSpec("held", "latent heat that superheated particles hold", ("held",)),
            GroupSpec("region", "sensible heat of the region round each superheated particle",
                      ("region_heat", "fire_key", "pick_key")),
            GroupSpec("claim", "the strongest region that claims a particle", ("claim",)),
            GroupSpec("fire", "regions that are the strongest for all members fire, and choose some of them",
                      ("cut", "e_chosen", "e_others")),
            GroupSpec("share", "the chosen become vapour, the others share the rest", ("e", "phase", "T")),
        )),
    )),
    Stage("bubbles", "some vapour; again if bubbles lost or gained particles by it", (
        Block((GroupSpec("start", "every particle its own parent", ("grandparent",)),)),
        Block((
            GroupSpec("snap", "grandparents", ("grandparent",)),
            GroupSpec("hook", "hook onto the smallest label in reach"),
            GroupSpec("shortcut", "pointer jumping"),
            GroupSpec("check", "converged?"),
        ), iterate="label_rounds"),
        Block((
            GroupSpec("label", "labels", ("bubble",)),
            GroupSpec("condense", "subcooled vapour condenses", ("e", "phase", "T")),
            GroupSpec("interface", "liquid in transition joins the nearest bubble", ("joined",)),
            GroupSpec("pool", "pooled latent heat turns the nearest liquid into vapour", ("e", "phase", "T")),
            GroupSpec("film", "liquid that is itself free surface", ("film",)),
            GroupSpec("free", "vapour under nothing but film"),
        )),
    )),
    Stage("density", "always; once more after the oscillation", (
        Block((
            GroupSpec("back", "in a short step: where it began, in the container", ("x", "y", "z", "swell")),
            GroupSpec("before", "in a short step: density there"),
            GroupSpec("left_over", "in a short step: density error there; forward again", ("x", "y", "z", "swell")),
        ), when="short_step"),
        Block((GroupSpec("contact", "predicted positions that lie in a wall", ("x", "y", "z")),)),
        Block((
            GroupSpec("multiplier", "density, its gradients, Lagrange multiplier", ("lmbda",)),
            GroupSpec("correction", "position correction"),
            GroupSpec("move", "the correction applied, containers", ("x", "y", "z", "impulse")),
        ), iterate="sweeps"),
        Block((GroupSpec("pressure", "pressure that the sweeps made, for the mechanical ledger"),)),
    )),
    Stage("oscillation", "some bubble outside its radii", (
        Block((GroupSpec("push", "what its radius lacks, measured on the host, as a displacement", ("x", "y", "z")),)),
    )),
    Stage("forces", "always", (
        Block((
            GroupSpec("sum", "every acceleration of the next prediction"),
            GroupSpec("release", "free vapour falls"),
            GroupSpec("volume", "rest volume of the next step", ("swell",)),
        )),
    )),
)


PLACES = {f"{stage.name}.{spec.name}": stage.name for stage in STAGES for block in stage.blocks
          for spec in block.groups}  # place -> its stage


def check_places(terms, hooks, conditions):
    """Raise ``ValueError`` for a place or stage that does not exist, or that nothing is built at.

    ``terms`` are all of a scheme; ``hooks`` and ``conditions`` map the slot of an effect to its places and stages.
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
    """What runs on the host after a group, in order."""

    def __call__(self):
        for hook in self:
            hook()


def build_stage(stage, terms, *, limits, conditions, hooks, tag="", apart=None):
    """PySPH groups of one stage from its terms, or ``None`` if no term belongs to it.

    ``limits`` maps the name of an iterated block to (min, max), ``conditions`` that of a conditional one to a function
    of (t, dt); ``hooks(place, spec)`` lists what runs on the host after a group. Groups are named, since PySPH writes
    the names into the generated source, whose text is the key of its cache; ``tag`` ends them, and says with which
    flags that source is compiled. ``apart`` maps a place whose terms stand in one group for each owner to what runs
    after each, called with the owner. Only parents iterate and only sub-groups have hooks or conditions: PySPH compiles
    nothing else on every backend. A group does all that it does to one array before it turns to the next one, so what
    neighbours read is written in another group (``tests/unit/test_order.py``).
    """
    blocks = []
    for number, block in enumerate(stage.blocks):
        groups = []
        for spec in block.groups:
            place = f"{stage.name}.{spec.name}"
            here = [term for term in terms if term.place == place]
            if place in (apart or {}):
                owners = list(dict.fromkeys(term.owner for term in here))
                for owner in owners:
                    equations = [term.equation for term in here if term.owner == owner]
                    after = hooks(place, spec) if owner == owners[-1] else ()
                    groups.append(Group(equations, name=f"{place}_{owner}".replace(".", "_"),
                                        post=Hooks([partial(apart[place], owner), *after])))
            elif here:
                groups.append(Group([term.equation for term in here], name=place.replace(".", "_"),
                                    post=Hooks(hooks(place, spec)) or None,
                                    condition=conditions.get(block.when)))
        if groups:
            options = {}
            if block.iterate:
                low, high = limits[block.iterate]
                options = dict(iterate=True, min_iterations=low, max_iterations=high)
            blocks.append(Group(groups, name=f"{stage.name}{number}{tag}", **options))
    return blocks or None

"""Looks of a boil over sites: named sets of parameters for those who want a picture and not a number.

``--look calm|rolling|violent`` uses a row of :data:`LOOKS`. Options of single parameters override it.
"""
from dataclasses import dataclass, field

from pysph_boiling.names import option
from pysph_boiling.schemes.modes import with_changes

__all__ = ["LOOKS", "Look", "effects_in_look", "parameters_in_look"]

FOR = "looks are for boils over sites, such as steady_boiling and rolling_boil"


@dataclass(frozen=True, kw_only=True)
class Look:
    """A look: what one sees, parameters of the scene (name -> value), and of its effects (slot -> name -> value)."""

    seen: str
    parameters: dict = field(default_factory=dict)
    changes: dict = field(default_factory=dict)


LOOKS = {
    "calm": Look(
        seen="few small bubbles, one after the other, under a surface that hardly moves",
        parameters=dict(superheat=25.0), changes=dict(buoyancy=dict(k_bubble=1.5))),
    "rolling": Look(
        seen="large bubbles, which lift the surface when they burst",
        parameters=dict(superheat=90.0), changes=dict(buoyancy=dict(k_bubble=0.8))),
    "violent": Look(
        seen="many bubbles in columns, and drops that fly",
        parameters=dict(superheat=200.0), changes=dict(buoyancy=dict(k_bubble=3.0))),
}


def parameters_in_look(look, known):
    """The parameters of a scene (name -> value) that a look sets; ``known`` are the names of those that it has.

    Raises ``ValueError`` for a scene that lacks one of them.
    """
    row = LOOKS[look]
    for name in row.parameters:
        if name not in known:
            raise ValueError(f"--look {look} sets {option(f'scene.{name}')}, which this scene lacks: {FOR}")
    return dict(row.parameters)


def effects_in_look(look, effects):
    """The effects (slot -> effect) of a scene with the changes of a look, as a new dict.

    Raises ``ValueError`` for a scene without preset sites, or that lacks an effect that the look changes.
    """
    row = LOOKS[look]
    for slot in ("preset_nucleation", *row.changes):
        if slot not in effects:
            raise ValueError(f"--look {look} needs the effect '{slot}', which this scene lacks: {FOR}")
    return with_changes(effects, row.changes)

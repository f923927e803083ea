"""Three models of boiling: that of the paper, and the two with which it is compared (its Table 1).

:data:`MODES` describes each model, and how it changes the effects of a scene. All three conserve mass and energy.
"""
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

from pysph.base.particle_array import ParticleArray

from pysph_boiling.names import unknown
from pysph_boiling.schemes.effects import Effect, SiteStorage

__all__ = ["MODES", "Mode", "effects_in_mode", "widen_sites", "with_changes"]


@dataclass(frozen=True, kw_only=True)
class Mode:
    """A model of boiling: its description, and how it changes the effects of a scene.

    ``latent_stage`` which liquid enters the latent stage; ``storage`` where latent heat is stored; ``vapour`` what
    becomes vapour. ``changes`` are parameters of effects (slot -> name -> value), ``without`` slots that are emptied,
    ``adds`` effects for empty slots, ``needs`` slots that must be there.
    """

    source: str
    latent_stage: str
    storage: str
    vapour: str
    changes: dict = field(default_factory=dict)
    without: tuple[str, ...] = ()
    adds: dict = field(default_factory=dict)
    needs: tuple[str, ...] = ()


MODES = {
    "dynamic": Mode(
        source="the paper",
        latent_stage="liquid at T_sat that meets the kinetic condition",
        storage="in the particle",
        vapour="a particle with e >= L, or dynamic nucleation"),
    "gu": Mode(
        source="Gu et al.",
        latent_stage="any liquid at T_sat, so that none is ever superheated",
        storage="in the particle",
        vapour="a particle with e >= L",
        changes={"phases": dict(kinetic="always"), "preset_nucleation": dict(attracts="transition")},
        without=("dynamic_nucleation", "pooling"), needs=("phases",)),
    "li_xiao": Mode(
        source="Li & Xiao",
        latent_stage="none, so that liquid superheats freely",
        storage="in the site, which absorbs the excess heat of the liquid near it",
        vapour="the n_emit particles nearest to a site that is free and holds enough heat",
        changes={"phases": dict(kinetic="never", vapour_as_site=False)},
        without=("dynamic_nucleation", "pooling", "adhesion"), adds=dict(storage=SiteStorage()),
        needs=("phases", "preset_nucleation")),
}  # adhesion would keep a few particles of an emitted bubble, which would occupy their site forever


def effects_in_mode(mode: str, effects: dict[str, Effect]) -> dict[str, Effect]:
    """The effects (slot -> effect) of a scene in another mode, as a new dict; ``"dynamic"`` changes nothing.

    Raises ``ValueError`` for an unknown mode, and for a scene that lacks an effect which the mode needs.
    """
    if mode not in MODES:
        raise unknown("mode", mode, MODES)
    row = MODES[mode]
    for slot in row.needs:
        if slot not in effects:
            raise ValueError(f"mode '{mode}' needs a scene with the effect '{slot}', but this one has "
                             f"{', '.join(effects) or 'none'}")
    return row.adds | with_changes(effects, row.changes, row.without)


def with_changes(effects: dict[str, Effect], changes: Any, without: Sequence[str] = ()) -> dict[str, Effect]:
    """The effects (slot -> effect) with ``changes`` (slot -> name -> value) of those that are there, as a new dict.

    Slots in ``without`` are left out.
    """
    return {slot: effect.replaced(**changes[slot]) if effect and slot in changes else effect
            for slot, effect in effects.items() if slot not in without}


def widen_sites(scheme: Any, arrays: Iterable[ParticleArray]) -> None:
    """Extend the reach of the site arrays to what storage in sites needs, if the scheme has that effect."""
    if "storage" in scheme.effects:
        h = scheme.effects["storage"].reach(scheme.scene()) / scheme.kernel.radius_scale
        for pa in arrays:
            if pa.name in scheme.sites:
                pa.h[:] = pa.h.clip(min=h)

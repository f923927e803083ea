"""Forms of the paper: where our model departs from its text, each row of :data:`FORMS` has the text's own form.

``forms="paper"`` (``--forms paper``) uses all of them at once, and a name or several names some of them. A row changes
parameters of the effects that a scene has, and adds no effect.
"""
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from pysph_boiling.names import SchemeError, option, unknown
from pysph_boiling.schemes.effects import Effect, SchemeContext
from pysph_boiling.schemes.effects.dynamic_nucleation import Q_CRIT
from pysph_boiling.schemes.modes import with_changes

__all__ = ["FORMS", "Form", "chosen", "effects_in_forms", "forms_in"]


@dataclass(frozen=True, kw_only=True)
class Form:
    """A form of the paper and why ours differs from it.

    ``source`` is its place in the paper, ``paper`` what stands there, and ``ours`` what we do and why. ``changes`` are
    the parameters (name -> value) that give the effect of ``slot`` this form, and ``without`` slots that are emptied.
    ``where`` are parameters that the effect must have, since the form has no meaning with others. ``refused(effect,
    scene)``, if given, is the reason why a scene cannot have the effect with these changes, or an empty string.
    """

    source: str
    paper: str
    ours: str
    slot: str
    changes: dict = field(default_factory=dict)
    without: tuple[str, ...] = ()
    where: dict = field(default_factory=dict)
    refused: Callable | None = None

    def concerns(self, effects: dict[str, Effect]) -> bool:
        """Whether the effects (slot -> effect) of a scene include the one that this form is about."""
        effect = effects.get(self.slot)
        return effect is not None and all(getattr(effect, name) == value for name, value in self.where.items())

    def applied(self, effects: dict[str, Effect]) -> dict[str, Effect]:
        """The effects (slot -> effect) of a scene in this form, as a new dict."""
        return with_changes(effects, {self.slot: self.changes}, self.without)

    def holds(self, effects: dict[str, Effect]) -> bool:
        """Whether the effects (slot -> effect) of a scene have this form."""
        return self.concerns(effects) and self.applied(effects) == effects


FORMS = {
    "order": Form(
        source="Algorithm 1, lines 1-14",
        paper="heat, phases and labels of bubbles follow after the positions have been corrected, with the neighbours "
              "of the predicted ones",
        ours="they follow the neighbour search at once, so that positions and neighbours fit each other",
        slot="heat", changes=dict(positions="corrected")),
    "conduction": Form(
        source="eqs. 16-17",
        paper="one k for all particles, and 4 rho_i/(rho_i + rho_j), which is not symmetric",
        ours="the form of Cleary & Monaghan with a k for each phase, since eq. 17 creates energy wherever densities "
             "differ, as at every surface",
        slot="heat", changes=dict(laplacian="paper")),
    "convection": Form(
        source="section 3.3.1",
        paper="liquid is accelerated along the temperature gradient (no formula)",
        ours="Boussinesq's force, since a force along a gradient is balanced by a pressure and stirs nothing unless it "
             "is limited",
        slot="convection", changes=dict(form="gradient")),
    "kinetic_condition": Form(
        source="section 3.3.2",
        paper="nucleation sites alone let liquid enter the transition",
        ours="vapour counts as a site, too, since otherwise a bubble cannot grow away from its site",
        slot="phases", changes=dict(vapour_as_site=False), where=dict(kinetic="site")),
    "interruption": Form(
        source="section 3.3.2, Fig. 2",
        paper="stored latent heat becomes sensible heat when a site is lost",
        ours="it is held, since as sensible heat it can be up to L/c_l = 535 K of superheat",
        slot="phases", changes=dict(interrupt="convert"), where=dict(kinetic="site")),
    "latent_heat": Form(
        source="section 3.3.2",
        paper="each particle stores its own latent heat until it is enough",
        ours="that of the liquid round a bubble is pooled, since otherwise a bubble in superheated liquid grows "
             "dendrites",
        slot="phases", without=("pooling",)),
    "dynamic_nucleation": Form(
        source="eqs. 5-7, Table 3",
        paper="a region bursts at Q_crit = 10 m_p L",
        ours="scenes give a superheat, since that of 10 m_p L depends on the number of particles in a region: it is "
             "162 K for 33 of them, and 412 K for 13, which is beyond the critical point",
        slot="dynamic_nucleation", changes=dict(q_crit=Q_CRIT),
        refused=lambda effect, scene: effect.too_hot(scene)),
    "buoyancy": Form(
        source="eqs. 18-19",
        paper="the force on each particle grows with the number of particles in its bubble (applied to each; limited "
              "to 3 g, which is ours)",
        ours="eq. 19 is the force on a bubble, so the acceleration is the same for all sizes, and nothing has to limit "
             "it",
        slot="buoyancy", changes=dict(form="paper")),
    "condensation": Form(
        source="eqs. 20-22",
        paper="vapour cools, until the subcooling of a bubble adds up to L/c_v = 1087 K for each particle that "
              "condenses",
        ours="vapour stays at T_sat, and what it lacks is latent heat, since small bubbles never condense by eqs. "
             "20-22",
        slot="condensation", changes=dict(form="paper")),
    "oscillation": Form(
        source="eqs. 23-30, Algorithm 1, lines 27-36",
        paper="a band for the mean radius, pushes with a net momentum (eq. 28), and no density sweeps after them",
        ours="pushes without a net momentum (eq. 27) and sweeps after them, which undo the overlap that they make",
        slot="oscillation", changes=dict(form="band", gradient="paper", closing=False)),
}


def chosen(forms: str | Sequence[str]) -> tuple[str, ...]:
    """The names of forms, in the order of the table: ``"ours"`` has none, ``"paper"`` all, else one or several names.

    Several are a sequence of names, or a text with commas. Raises ``ValueError`` for an unknown name.
    """
    names = forms.split(",") if isinstance(forms, str) else list(forms)
    for name in names:
        if name not in FORMS and names not in (["ours"], ["paper"]):
            raise unknown("form of the paper", name, ["ours", "paper", *FORMS])
    return tuple(FORMS) if names == ["paper"] else tuple(name for name in FORMS if name in names)


def effects_in_forms(forms: str | Sequence[str], effects: dict[str, Effect],
                     scene: Callable[[], SchemeContext]) -> tuple[dict[str, Effect], list[str]]:
    """The effects (slot -> effect) in forms of the paper as a new dict, and sentences about what is left out.

    ``"paper"`` leaves out a form whose effect is not there, and one that the scene cannot have, which gives a sentence
    with the reason. If the form is named, both are a ``ValueError``. ``scene()`` is the :class:`SchemeContext`.
    """
    result, sentences = dict(effects), []
    for name in chosen(forms):
        form = FORMS[name]
        if not form.concerns(result):
            if forms != "paper":
                given = ", ".join(f"{parameter}={value!r}" for parameter, value in form.where.items())
                raise SchemeError(
                    f"form '{name}' of the paper changes the effect '{form.slot}'{f' with {given}' if given else ''}, "
                    "which this scene lacks", f"pass {form.slot}=... to the scheme, or leave the form out",
                    " ".join(["add", option(form.slot), *(f"{option(form.slot)}.{parameter} {value}" for
                                                          parameter, value in form.where.items())])
                    + ", or leave the form out")
            continue
        changed = form.applied(result)
        reason = form.refused(changed[form.slot], scene()) if form.refused else ""
        if reason and forms != "paper":
            raise ValueError(f"form '{name}' of the paper: {reason}")
        if reason:
            sentences.append(f"the paper's form '{name}' is left out: {reason}")
        else:
            result = changed
    return result, sentences


def forms_in(effects: dict[str, Effect]) -> tuple[list[str], list[str]]:
    """The names of the forms of the paper that the effects (slot -> effect) of a scene have, and of ours instead."""
    there = [name for name, form in FORMS.items() if form.concerns(effects)]
    paper = [name for name in there if FORMS[name].holds(effects)]
    return paper, [name for name in there if name not in paper]

"""Forms of the paper: what each changes, what overrides it, and what a scene cannot have."""
import json
import warnings
from dataclasses import fields
from pathlib import Path

import pytest
from small_scenes import built

from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    EFFECTS,
    BubbleLabels,
    Buoyancy,
    Condensation,
    Convection,
    DynamicNucleation,
    HeatConduction,
    LatentPooling,
    Oscillation,
    PhaseChange,
    PresetNucleation,
)
from pysph_boiling.schemes.forms import FORMS, chosen, forms_in

OURS = dict(
    heat=HeatConduction(time_scaling=7.0), phases=PhaseChange(), preset_nucleation=PresetNucleation(),
    dynamic_nucleation=DynamicNucleation(superheat_limit=28.0), bubbles=BubbleLabels(), condensation=Condensation(),
    pooling=LatentPooling(), buoyancy=Buoyancy(), convection=Convection(), oscillation=Oscillation(form="relative"))
PAPER = dict(  # the literal forms, in the words of the options
    heat=HeatConduction(time_scaling=7.0, laplacian="paper", positions="corrected"),
    phases=PhaseChange(interrupt="convert", vapour_as_site=False), preset_nucleation=PresetNucleation(),
    dynamic_nucleation=DynamicNucleation(q_crit=10.0), bubbles=BubbleLabels(), condensation=Condensation(form="paper"),
    buoyancy=Buoyancy(form="paper"), convection=Convection(form="gradient"),
    oscillation=Oscillation(form="band", gradient="paper", closing=False))


def scheme(dim=3, **kwargs):
    return BoilingScheme(["fluid"], ["wall"], dim=dim, spacing=0.004, sites=["sites"], **kwargs)


@pytest.mark.parametrize("name", FORMS)
def test_row_names_a_slot_and_its_options(name):
    form = FORMS[name]
    (cls,) = EFFECTS[form.slot]
    assert set(form.changes) <= {spec.name for spec in fields(cls)} and set(form.without) <= set(EFFECTS)
    assert form.changes or form.without
    assert all(len(text) >= 10 for text in (form.source, form.paper, form.ours))


def test_all_forms_at_once_and_none():
    assert scheme(**OURS).effects == {"density": scheme().effects["density"]} | OURS
    assert scheme(**OURS, forms="paper").effects == {"density": scheme().effects["density"]} | PAPER
    assert forms_in(scheme(**OURS).effects) == ([], list(FORMS))
    assert forms_in(scheme(**OURS, forms="paper").effects) == (list(FORMS), [])


@pytest.mark.parametrize("name", FORMS)
def test_single_form_changes_its_row_alone(name):
    made = scheme(**OURS, forms=(name,))
    assert forms_in(made.effects)[0] == [name]
    changed = {slot for slot in OURS if made.effects.get(slot) != OURS[slot]}
    assert changed == ({FORMS[name].slot} if FORMS[name].changes else set(FORMS[name].without))


def test_names_of_forms():
    assert chosen("ours") == chosen(()) == () and chosen("paper") == tuple(FORMS)
    assert chosen("condensation,buoyancy") == chosen(["condensation", "buoyancy"]) == ("buoyancy", "condensation")
    for wrong in ("bouyancy", ("condensation", "bouyancy"), "condensation,bouyancy"):
        with pytest.raises(ValueError, match="no form of the paper 'bouyancy'; did you mean 'buoyancy'"):
            scheme(**OURS, forms=wrong)
    with pytest.raises(ValueError, match="no form of the paper 'paper'"):
        chosen("paper,buoyancy")


def test_effect_that_is_not_there_is_left_out_or_asked_for():
    few = {slot: OURS[slot] for slot in ("heat", "phases", "preset_nucleation")}
    made = scheme(**few, forms="paper")
    assert {slot: made.effects[slot] for slot in few} == {slot: PAPER[slot] for slot in few}
    assert set(made.effects) == {"density", *few}
    with pytest.raises(ValueError, match="form 'buoyancy' of the paper changes the effect 'buoyancy', which this scene "
                                         "lacks: pass buoyancy="):
        scheme(**few, forms="buoyancy")


def test_threshold_beyond_the_critical_point_is_left_out_or_refused():
    """13 particles within two spacings in 2-D share the heat of ten: L/c_l * 10/13 = 412 K of superheat."""
    with pytest.warns(UserWarning, match="the paper's form 'dynamic_nucleation' is left out: a full region of 13 "
                                         "particles would fire at a mean superheat of 411.8 K, but water"):
        made = scheme(dim=2, **OURS, forms="paper")
    assert made.effects["dynamic_nucleation"] == OURS["dynamic_nucleation"]
    assert forms_in(made.effects)[1] == ["dynamic_nucleation"]
    with pytest.raises(ValueError, match="form 'dynamic_nucleation' of the paper: a full region of 13 particles"):
        scheme(dim=2, **OURS, forms="dynamic_nucleation")


def test_effects_chosen_from_the_scene_have_the_forms_too():
    made = scheme(effects="auto", forms="paper", pooling=LatentPooling())
    made.derive = lambda particles, T, asked: made.set_effects(**OURS)  # the choice has tests of its own
    with pytest.raises(ValueError, match="the scene has"):  # no arrays: after the choice
        made.setup_properties([])
    assert forms_in(made.effects) == (list(FORMS), [])


ALL = ("--convection", "--oscillation", "--forms", "paper")


@pytest.mark.parametrize(("options", "ours"), [
    ((), []),
    (("--condensation.form", "latent"), ["condensation"]),
    (("--pooling",), ["latent_heat"]),
    (("--oscillation.closing", "yes", "--heat.laplacian", "cleary_monaghan"), ["conduction", "oscillation"]),
    (("--dynamic-nucleation.superheat-limit", "50"), ["dynamic_nucleation"]),
    (("--superheat-limit", "50"), ["dynamic_nucleation"]),  # of the scene
])
def test_single_options_override_the_table(options, ours):
    application = built("superheat_sites", *ALL, *options)
    assert forms_in(application.scheme.effects) == ([name for name in FORMS if name not in ours], ours)
    if "50" in options:
        assert application.scheme.effects["dynamic_nucleation"].superheat_limit == 50.0


def test_description_and_record_name_the_forms():
    application = built("superheat_sites", "--forms", "condensation,order")
    ours = [name for name in FORMS if name not in ("condensation", "order", "convection", "oscillation")]
    assert f"forms of the paper: order, condensation; our forms: {', '.join(ours)}\n" in application.scheme.describe()
    assert json.loads(json.dumps(application.recorded_forms)) == {"paper": ["order", "condensation"], "ours": ours}
    assert "forms of the paper" not in built("dam_break", "--forms", "paper").scheme.describe()


@pytest.mark.parametrize("mode", ["gu", "li_xiao"])
@pytest.mark.parametrize("form", ["kinetic_condition", "interruption"])
def test_forms_of_the_kinetic_condition_concern_the_paper_alone(mode, form):
    effects = built("superheat_sites", "--mode", mode).scheme.effects
    assert not any(form in names for names in forms_in(effects))
    assert any(form in names for names in forms_in(built("superheat_sites").scheme.effects))
    with pytest.raises((SystemExit, ValueError), match=f"form '{form}' of the paper changes the effect 'phases' with "
                                                       "kinetic='site', which this scene lacks"):
        built("superheat_sites", "--mode", mode, "--forms", form)


def test_forms_with_a_mode_and_with_effects_from_the_scene():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        effects = built("superheat_sites", *ALL, "--mode", "gu", "--effects", "auto").scheme.effects
    assert effects["phases"] == PhaseChange(kinetic="always")  # without a site nothing can be interrupted
    assert effects["preset_nucleation"].attracts == "transition"
    assert effects["convection"].form == "gradient" and "pooling" not in effects
    added = built("heated_slab", "--effects", "auto", "--forms", "convection").scheme.effects  # which it adds
    assert added["convection"].form == "gradient"


def test_page_has_the_table():
    page = (Path(__file__).parents[2] / "docs" / "forms.md").read_text(encoding="utf-8")
    for name, form in FORMS.items():
        assert f"| `{name}` | {form.source} | {form.paper} | {form.ours} | `--" in page, "run tools/forms.py"

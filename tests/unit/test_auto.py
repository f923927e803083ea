"""effects="auto": the set that a scene's arrays call for, and why. Nothing is compiled."""
import numpy as np
import pytest

from pysph_boiling.examples import scene_class, scenes
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.particles import box_vessel, fluid_block, site_array
from pysph_boiling.runs.application import SceneApplication
from pysph_boiling.schemes.auto import in_order, needs
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import EFFECTS, AmbientLoss, Drag, DynamicNucleation, Heater, Venting

DX, T_SAT = 0.004, WATER_1ATM.T_sat
MOTION = {"density", "container", "viscosity"}
BUBBLES = {"bubbles", "pooling", "buoyancy", "cohesion", "drag", "venting"}

# Scenes whose own set differs from what their arrays call for; the table in docs/model.md says why.
SINGLE = {"dynamic_nucleation", "condensation", "expansion"}
DIFFERS = {
    "heated_slab": {"density", "container", "viscosity", "convection"},
    **dict.fromkeys(("bubble_held", "bubble_merge", "bubble_ring", "bubble_rise", "bubble_split"), SINGLE),
    "cooling": {"dynamic_nucleation"}, "superheat_sites": {"expansion"},
}


def scheme(T=None, sites=False, heated=0.0, gravity=None, **given):
    """A scheme with effects="auto", set up on a small vessel."""
    upper = (8 * DX, 8 * DX, 0.0)
    found = BoilingScheme(["fluid"], ["wall"], dim=2, spacing=DX, effects="auto", T_start=T, gravity=gravity,
                          sites=["sites"] if sites else [], **given)
    common = dict(spacing=DX, dim=2, rho0=found.rho0)
    arrays = [fluid_block((0.0, 0.0, 0.0), upper, **common),
              box_vessel((0.0, 0.0), upper[:2], kernel=found.kernel, heated_fraction=heated, **common)]
    if sites:
        arrays.append(site_array([(4 * DX, 0.0, 0.0)], reach=2.4 * DX, spacing=DX))
    found.configure_solver(dt=1e-3)
    found.setup_properties(arrays)
    found.get_equations()
    return found


HOT = dict(heater=Heater(temperature=T_SAT + 60.0), heated=0.5)
WARM = dict(heater=Heater(temperature=350.0), heated=0.5)


@pytest.mark.parametrize(("given", "expected"), [
    (dict(T=300.0), MOTION),
    (dict(T=300.0, **WARM), MOTION | {"heat", "heater", "convection"}),
    (dict(T=np.linspace(300.0, 320.0, 64)), MOTION | {"heat", "convection"}),
    (dict(T=T_SAT - 2.0, sites=True, **HOT),
     MOTION | BUBBLES | {"heat", "heater", "phases", "preset_nucleation", "adhesion", "condensation"}),
    (dict(T=T_SAT, **HOT), MOTION | BUBBLES | {"heat", "heater", "phases"}),
    (dict(T=T_SAT - 2.0, heated=0.5, heater=Heater(flux=1e4),
          dynamic_nucleation=DynamicNucleation(superheat_limit=50.0)),
     MOTION | BUBBLES | {"heat", "heater", "phases", "dynamic_nucleation", "condensation", "expansion"}),
    (dict(T=T_SAT, gravity=(0.0, 0.0, 0.0), **HOT), {"heat", "heater", "phases", "bubbles", "pooling"}),
    (dict(T=300.0, loss=AmbientLoss()), MOTION | {"heat", "loss", "convection"}),
    (dict(T=T_SAT, venting=Venting(mode="remove"), **HOT), MOTION | BUBBLES | {"heat", "heater", "phases", "refill"}),
], ids=["cold", "warm base", "two temperatures", "boil", "boil without sites", "explosive", "weightless", "cooling",
        "open"])
def test_set_of_a_scene(given, expected):
    assert set(scheme(**given).effects) == expected


def test_what_is_asked_for_is_taken_as_it_is():
    drag = Drag(rate=3.0)
    found = scheme(T=T_SAT, drag=drag, cohesion=None, **HOT)
    assert found.effects["drag"] is drag and "cohesion" not in found.effects
    assert {choice.slot: choice.reason for choice in found.choices}["cohesion"] == "as asked"


def test_every_slot_has_a_place_and_every_choice_a_reason(capsys):
    found = scheme(T=T_SAT - 2.0, sites=True, **HOT)
    assert [choice.slot for choice in found.choices] == in_order(EFFECTS)
    assert all(choice.reason for choice in found.choices)
    out = capsys.readouterr().out.splitlines()
    assert "with preset_nucleation: there are sites" in out
    assert "without refill: the lid returns vented bubbles as liquid" in out
    order = in_order(EFFECTS)
    assert all(order.index(needed) < order.index(slot) for slot in EFFECTS for needed in needs(slot))
    for slot, classes in EFFECTS.items():
        for cls in classes:
            assert needs(slot) >= set(cls.requires), f"{slot} may be chosen without what it requires"


@pytest.mark.parametrize("name", [name for name in scenes() if issubclass(scene_class(name), SceneApplication)])
def test_shipped_scene_gets_its_own_set(name, tmp_path):
    sets = []
    for choice in ("scene", "auto"):
        app = scene_class(name)()
        app.set_args(["--effects", choice, "-d", str(tmp_path), *(["--flat"] if "flat" in app.variants else [])])
        app._parse_command_line(force=True)
        app._prepare()
        sets.append(app.scheme.effects)
    hand, auto = sets
    assert set(hand) ^ set(auto) == DIFFERS.get(name, set())
    assert all(auto[slot] == hand[slot] for slot in set(hand) & set(auto)), "parameters are the scene's own"


def test_switches_hold_with_auto(tmp_path):
    app = scene_class("steady_boiling")()
    app.set_args(["--effects", "auto", "--flat", "--no-drag", "--convection", "-d", str(tmp_path)])
    app._parse_command_line(force=True)
    app._prepare()
    assert "drag" not in app.scheme.effects and "convection" in app.scheme.effects


@pytest.mark.parametrize(("given", "message"), [
    (dict(heated=0.5), "walls are heated: effects='auto' needs heater="),
    (dict(effects_="all"), "effects must be 'auto' or left out"),
])
def test_refused(given, message):
    with pytest.raises(ValueError, match=message):
        if "effects_" in given:
            BoilingScheme(["fluid"], [], dim=2, spacing=DX, effects=given["effects_"])
        else:
            scheme(**given)

"""Figure 2 and Tables 1 and 2: drawn and made from the code, so that a change of the code changes them."""
from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace

import numpy as np
import pytest
from harness import Stepper
from sets import scheme

from pysph_boiling.evaluation.reproduce import states
from pysph_boiling.evaluation.reproduce.rules import Toy, call, evaluate
from pysph_boiling.evaluation.reproduce.states import StateDiagram, channels, draw_states, trigger
from pysph_boiling.evaluation.reproduce.tables import (
    ASPECTS,
    PAPER_MODELS,
    HeatChannels,
    Models,
    answers,
    hosted_method,
)
from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.particles import fluid_array, site_array
from pysph_boiling.phases import EDGES, Phase
from pysph_boiling.schemes.effects import Condensation, PhaseChange
from pysph_boiling.schemes.modes import MODES

L = WATER.L
IDS = [f"{edge.source.name}-{edge.target.name}" for edge in EDGES]

# --- the kernels, run as Python ---------------------------------------------------------------------------------------


def test_python_and_compiled_kernels_agree():
    """The state machine and its kinetic conditions on random states; the set that tests/compiled uses anyway."""
    n, dx, random = 60, 0.01, np.random.default_rng(4)
    points = np.zeros((n, 3))
    points[:, :2] = random.uniform(0.0, 8.0 * dx, (n, 2))
    fluid = fluid_array(points, spacing=dx, dim=2, rho0=WATER.rho_l)
    sites = site_array(points[:3] + 0.2 * dx, reach=2.4 * dx, spacing=dx)
    wall = fluid_array(points[:1] + [0.0, 20.0 * dx, 0.0], name="wall", spacing=dx, dim=2, rho0=WATER.rho_l)
    arrays, setting = [fluid, wall, sites], scheme("states_hold", dim=2, spacing=dx)
    setting.setup_properties(arrays)
    phase, e, e_lat = random.integers(0, 4, n), random.uniform(-L, 2.0 * L, n), random.uniform(0.0, L, n)
    outcomes = []
    stepper = Stepper(setting, arrays, dt=1e-3)
    for run in (lambda: stepper.run_stage("phases"), lambda: evaluate(setting, "phases", arrays, dt=1e-3)):
        fluid.phase[:], fluid.e[:], fluid.e_lat[:], fluid.vaporised[:] = phase, e, e_lat, 0
        run()
        outcomes.append({name: fluid.get(name).copy() for name in ("phase", "kinetic", "e_lat", "vaporised", "T")})
    assert set(outcomes[0]["phase"]) == set(Phase) and set(outcomes[0]["kinetic"]) == {0, 1}
    for name, compiled in outcomes[0].items():
        np.testing.assert_allclose(outcomes[1][name], compiled, rtol=4e-16, err_msg=name)


@pytest.mark.parametrize("mode", sorted(MODES))
def test_toy_moves_no_energy(mode):
    toy = Toy(mode).heat(0.8)
    before = float(np.sum(toy.fluid.m * toy.fluid.e))
    toy.step(4)
    stored = float(toy.sites.Q_s[0]) if mode == "li_xiao" else 0.0
    assert float(np.sum(toy.fluid.m * toy.fluid.e)) + stored == pytest.approx(before, rel=1e-13)


# --- figure 2 ---------------------------------------------------------------------------------------------------------


def test_each_edge_is_drawn_once_and_no_other(tmp_path):
    texts = draw_states(tmp_path / "a.png")
    assert len(texts) == len(Phase) + len(EDGES)
    for edge in EDGES:
        alike = [one for one in EDGES if (trigger(one), states.change_of_heat(one)) == (
            trigger(edge), states.change_of_heat(edge))]
        assert texts.count(f"{trigger(edge)}\n{states.change_of_heat(edge)}") == len(alike)
    assert len({(edge.source, trigger(edge)) for edge in EDGES}) == len(EDGES)  # a reader can tell them apart
    assert len(draw_states(tmp_path / "b.png", EDGES[:-1])) == len(texts) - 1
    assert (tmp_path / "a.png").stat().st_size > (tmp_path / "b.png").stat().st_size > 10_000


INSIDE = {"negative": (-0.3, -1e-9), "stored": (0.0, 0.4, 1.0 - 1e-9), "full": (1.0, 1.2), "not negative": (0.0, 0.4)}
BESIDE = {"negative": (0.0, 0.4), "stored": (-0.1, 1.0), "full": (-0.1, 0.0, 1.0 - 1e-9), "not negative": (-0.1,)}


def by_phase_change(edge):
    """Taken by all particles that meet the condition, with site or without, and by none beside it."""
    for e in INSIDE[edge.enthalpy] + BESIDE[edge.enthalpy]:
        toy = Toy().heat(e, edge.source)
        evaluate(toy.scheme, "phases", toy.arrays, dt=toy.DT)
        where = {True: toy.near, False: ~toy.near, None: np.ones_like(toy.near)}[edge.kinetic]
        assert 0 < np.count_nonzero(toy.near) < len(toy.near)
        where = where & (e in INSIDE[edge.enthalpy])
        np.testing.assert_array_equal(toy.fluid.phase == edge.target, where, err_msg=f"e = {e} L")


def by_nucleation(edge):
    for e, burst in ((0.3, True), (0.02, False)):  # limit 100 K, 0.19 L
        toy = Toy(site=False).heat(e, edge.source)
        evaluate(toy.scheme, "dynamic_nucleation", toy.arrays, dt=toy.DT)
        changed = toy.fluid.phase != edge.source
        assert np.any(changed) == burst and np.all(toy.fluid.phase[changed] == edge.target)


def by_condensation(edge):
    """A bubble of n particles that each lack x L: x n of them condense, rounded down."""
    for lack, condense in ((0.1, True), (0.01, False)):
        toy = Toy().heat(1.0 - lack, edge.source)
        toy.fluid.bubble[:] = toy.fluid.uid.min()
        effect, scene = toy.scheme.effects["condensation"], toy.scheme.scene()
        effect.hooks(scene)["bubbles.label"]([toy.fluid])
        kernels = [term.equation for term in toy.scheme.terms() if term.place == "bubbles.condense"]
        assert len(kernels) == 1
        call(kernels, "initialize", toy.fluid, dt=toy.DT)
        changed = toy.fluid.phase != edge.source
        assert np.count_nonzero(changed) == int(lack * Toy.SIDE**2) and np.any(changed) == condense
        assert np.all(toy.fluid.phase[changed] == edge.target)


@pytest.mark.parametrize("edge", EDGES, ids=IDS)
def test_each_edge_drawn_is_taken_by_the_kernels(edge):
    """A mechanism without a test here is a KeyError."""
    {"phase_change": by_phase_change, "nucleation": by_nucleation, "condensation": by_condensation}[edge.by](edge)


COMPILED = {  # mechanism -> the test of its edge on compiled kernels
    "phase_change": ("test_phase_change", "test_edge_is_taken_on_its_condition_and_not_beside_it"),
    "nucleation": ("test_dynamic_nucleation", "test_one_region_by_hand"),
    "condensation": ("test_condensation", "test_a_bubble_condenses_as_its_deficit_pays_for"),
}


@pytest.mark.parametrize("edge", EDGES, ids=IDS)
def test_each_edge_drawn_has_a_compiled_test(edge):
    module, name = COMPILED[edge.by]
    test = getattr(import_module(f"compiled.{module}"), name)
    if edge.by == "phase_change":
        cases = [row for mark in test.pytestmark if mark.args[0] == "edge" for row in mark.args[1]]
        assert cases.count(edge) == 1


def test_statements_follow_the_table(tmp_path, monkeypatch):
    before = StateDiagram().make({}, tmp_path, True)
    verdicts = [row.agrees for row in before.statements]
    cut = tuple(edge for edge in EDGES if (edge.source, edge.target) != (Phase.TRANSITION, Phase.VAPOUR))
    monkeypatch.setattr(states, "EDGES", tuple(
        replace(edge, kinetic=None) if edge.target == Phase.TRANSITION and edge.source == Phase.LIQUID else edge
        for edge in cut))
    after = [row.agrees for row in StateDiagram().make({}, tmp_path, True).statements]
    changed = [k for k, (a, b) in enumerate(zip(verdicts, after)) if a != b]
    assert changed == [0, 4]  # enters the phase change at a site; becomes vapour
    assert len(before.tables[0].rows) == len(EDGES)


# --- table 1 ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode, changes, aspect, answer", [
    ("dynamic", dict(changes={"phases": dict(kinetic="always")}), "Superheat capability", "No"),
    ("dynamic", dict(changes={"phases": dict(kinetic="always")}), "Phase transition condition", "Thermodynamic only"),
    ("dynamic", dict(without=("dynamic_nucleation",)), "Superheat treatment", "No"),
    ("gu", dict(changes={}), "Phase transition condition", "Thermodynamic + Kinetic"),
    ("gu", dict(changes={}), "Superheat capability", "Yes"),
    ("li_xiao", dict(without=()), "Superheat treatment", "Yes"),
])
def test_answers_come_from_the_model(monkeypatch, mode, changes, aspect, answer):
    assert answers(mode)[aspect] != answer
    monkeypatch.setitem(MODES, mode, replace(MODES[mode], **changes))
    assert answers(mode)[aspect] == answer


def hosted(scheme="WCSPHScheme", nucleated=7.0):
    """A finished run of the model of Gu et al. in a scheme of PySPH."""
    return SimpleNamespace(record={"scheme": scheme, "departures": [(0.3, 5, 1)]},
                           results={"n_nucleated": np.array([0.0, nucleated]), "n_superheated": np.zeros(2)})


def test_method_is_that_of_the_scheme_in_which_the_guest_boiled():
    assert hosted_method(hosted()) == PAPER_MODELS["gu"][0]
    assert hosted_method(hosted(nucleated=0.0)) == hosted_method(hosted("EulerScheme")) == "other"


def test_table_of_models_is_complete(tmp_path):
    section = Models().make({"gu_in_wcsph": hosted()}, tmp_path, True)
    assert set(PAPER_MODELS) == set(MODES)
    assert [row[:2] for row in section.tables[0].rows] == [
        (MODES[mode].source, aspect) for mode in PAPER_MODELS for aspect in ASPECTS]
    assert not any("other" in row for row in section.tables[0].rows)
    assert all(row.agrees or row.why for row in section.statements)


# --- table 2 ----------------------------------------------------------------------------------------------------------

PAPER = dict(phases=PhaseChange(interrupt="convert"), condensation=Condensation(form="paper"))


@pytest.mark.parametrize("phase, forms, kinds", [
    (Phase.LIQUID, {}, ["sensible"]), (Phase.TRANSITION, {}, ["latent"]),
    (Phase.SUPERHEATED, {}, ["sensible", "latent"]), (Phase.SUPERHEATED, PAPER, ["sensible"]),
    (Phase.VAPOUR, {}, ["sensible", "latent"]), (Phase.VAPOUR, PAPER, ["sensible", "sensible"]),
])
def test_channels_by_form(phase, forms, kinds):
    assert [kind for _, kind in channels(phase, **forms)] == kinds


def test_table_of_channels_has_every_state(tmp_path):
    section = HeatChannels().make({}, tmp_path, True)
    assert [row[0] for row in section.tables[0].rows] == [states.NAMES[phase] for phase in Phase]
    assert all(row.agrees or "With --" in row.why for row in section.statements)

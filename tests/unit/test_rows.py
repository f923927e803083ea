"""A row of the results: what its columns share is computed once, and every column is what it is on its own."""
import numpy as np
import pytest
from sets import SETS, scheme

from pysph_boiling.particles import fluid_block, site_array, wall_array
from pysph_boiling.phases import Phase, at_saturation
from pysph_boiling.runs.ledger import Ledger
from pysph_boiling.schemes import bubbles
from pysph_boiling.schemes.effects import Snapshot
from pysph_boiling.schemes.effects.base import computed_once
from pysph_boiling.schemes.vapour import Vapour

SPACING = 0.01


@pytest.fixture(params=("boil", "paper", "expand"))
def boil(request):
    """A ledger and the fluid of a scheme whose particles are in all states, with three bubbles; nothing compiled."""
    box = SETS["boil"]["container"].replaced(upper=(0.1, 0.1, 0.1))
    made = scheme(request.param, dim=2, spacing=SPACING, changes={"container": box})
    common = dict(spacing=SPACING, dim=2, rho0=made.rho0)
    fluid = fluid_block((0.0, 0.0), (0.1, 0.1), **common)
    wall = wall_array(np.array([[0.005, -0.005, 0.0], [0.015, -0.005, 0.0]]), kernel=made.kernel, heated=[1, 1],
                      **common)
    sites = site_array(np.array([[0.05, 0.0, 0.0]]), spacing=SPACING, reach=2.4 * SPACING)
    made.setup_properties([fluid, wall, sites])
    made.configure_solver(dt=1e-3)
    made.get_equations()
    made.arrays[:], made.site_arrays[:] = [fluid], [sites]
    generator, n = np.random.default_rng(3), fluid.get_number_of_particles()
    fluid.phase[:] = generator.integers(0, 4, n)
    fluid.e[:] = generator.uniform(-1e6, 3e6, n)
    fluid.T[:] = generator.uniform(350.0, 400.0, n)
    if made.effects["phases"].interrupt == "hold":
        fluid.e_lat[:] = np.where(generator.random(n) < 0.5, fluid.e + 1.0, 0.0)
    for name in ("vaporised", "condensed", "limited", "q_heater"):
        fluid.get(name)[:] = generator.integers(0, 5, n)
    vapour = np.flatnonzero(fluid.phase == Phase.VAPOUR)
    fluid.bubble[vapour] = fluid.uid[vapour[generator.integers(0, 3, len(vapour))]]
    fluid.bubble[vapour[0]] = 1 << 20  # alone
    ledger = Ledger(made)
    ledger.begin(made.arrays)
    return ledger, fluid


def test_columns_of_a_row_are_what_each_is_alone(boil):
    ledger, fluid = boil
    row = ledger.row(1.0, 1.0)
    ledger.balanced = ledger.balance([fluid])
    alone = {column.name: column.value([fluid], ledger.scene) for column in ledger.columns}
    assert {name: row[name] for name in alone} == alone  # to the last bit
    assert row["n_single_bubbles"] >= 1.0 and row["n_bubbles"] >= 3.0 and row["bubble_radius_mean"] > 0.0


def test_states_of_a_row_are_counted_and_weighed_as_masks_do(boil):
    ledger, fluid = boil
    row, energy = ledger.row(1.0, 1.0), fluid.m * fluid.e
    held = at_saturation(fluid.phase, fluid.e, fluid.e_lat)
    masks = {phase.name.lower(): fluid.phase == phase for phase in Phase}
    masks |= {"superheated": masks["superheated"] & ~held, "held": held}
    for name, mask in masks.items():
        assert row[f"n_{name}"] == np.count_nonzero(mask) > 0
        assert row[f"energy_{name}"] == np.sum(energy[mask])  # the same numbers in the same order
    if np.any(fluid.e_lat):
        hidden = (np.minimum(fluid.e, fluid.e_lat) * fluid.m)[fluid.phase == Phase.SUPERHEATED]
        assert row["energy_hidden"] == np.sum(hidden)


def test_mean_radius_of_the_bubbles_counts_the_swelling_of_their_vapour(boil):
    ledger, fluid = boil
    swell = np.ones_like(fluid.m)
    if "expansion" in ledger.scheme.effects:
        swell = fluid.swell[:] = np.random.default_rng(5).uniform(1.0, 3.0, len(fluid.m))
    vapour, radii = fluid.phase == Phase.VAPOUR, []
    for label in set(fluid.bubble[vapour].tolist()):
        mass = sum(fluid.m[i] * swell[i] for i in np.flatnonzero(vapour) if fluid.bubble[i] == label)
        radii.append((mass / ledger.scene.rho0 / np.pi) ** 0.5)
    assert ledger.row(1.0, 1.0)["bubble_radius_mean"] == pytest.approx(sum(radii) / len(radii), rel=1e-12)


def test_one_table_of_bubbles_a_row(boil, monkeypatch):
    ledger, _ = boil
    made = []
    monkeypatch.setattr(bubbles, "Vapour", lambda arrays: (made.append(1), Vapour(arrays))[1])
    for number in (1, 2):
        ledger.row(1.0, 1.0)
        assert len(made) == number


def test_a_row_sees_what_has_changed_since_the_last(boil):
    ledger, fluid = boil
    before = ledger.row(1.0, 1.0)
    fluid.e[:] *= 2.0
    fluid.phase[fluid.phase == Phase.VAPOUR] = Phase.LIQUID
    after = ledger.row(2.0, 1.0)
    assert after["energy"] == pytest.approx(2.0 * before["energy"], rel=1e-12) and after["n_bubbles"] == 0.0


def test_phases_are_called_for_where_anything_is_hot_or_not_liquid(boil):
    ledger, fluid = boil
    (needed,) = ledger.scheme.effects["phases"].conditions(ledger.scene).values()
    for e, phase, wanted in ((-1.0, Phase.LIQUID, False), (0.0, Phase.LIQUID, True), (-1.0, Phase.TRANSITION, True)):
        fluid.e[:], fluid.phase[:] = -1.0, Phase.LIQUID
        fluid.e[7], fluid.phase[7] = e, phase
        assert needed([fluid]) is wanted


def test_shared_is_once_a_moment_and_argument():
    calls = []

    @computed_once
    def number(arrays, name="a"):
        calls.append(name)
        return len(calls)

    moment = Snapshot([])
    assert [number(moment), number(moment), number(moment, "b"), number(moment, "b")] == [1, 1, 2, 2]
    assert number(Snapshot([])) == 3 and number([]) == 4 and number([]) == 5

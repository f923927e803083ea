"""Venting: which bubbles leave, where their mass and energy are booked, and the view of the free surface.

The tool acts on the host, between steps; only the kernels of the view are compiled.
"""
from types import SimpleNamespace

import numpy as np
import pytest
from forces import DX, RHO0, SUPPORT, VAPOUR, Forces, between, particles
from harness import vectors
from sets import SETS, scheme

from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.particles import NO_BUBBLE, fluid_array, fluid_block, site_array
from pysph_boiling.phases import Phase, temperature
from pysph_boiling.runs.ledger import Ledger
from pysph_boiling.schemes.effects import sum_over

L, N = WATER.L, 40
BIG, SMALL, LIQUID = slice(0, 20), slice(20, 24), slice(24, N)  # bubbles 3 and 50, and liquid
SETTING = {"lid": "boil", "remove": "paper"}


class Pool:
    """Two bubbles and some liquid of unequal masses in a scheme that is not compiled; ``vent()`` acts after a step."""

    def __init__(self, mode, **changes):
        name, random = SETTING[mode], np.random.default_rng(1)
        effect = SETS[name]["venting"].replaced(mode=mode, **changes)
        self.scheme = scheme(name, dim=2, spacing=0.01, changes={"venting": effect})
        kwargs = dict(spacing=0.01, dim=2, rho0=WATER.rho_l)
        self.pa = pa = fluid_array(random.uniform(0.0, 0.1, (N, 3)), **kwargs)
        wall, sites = fluid_array(np.zeros((1, 3)), name="wall", **kwargs), site_array(
            np.zeros((1, 3)), reach=0.024, spacing=0.01)
        wall.add_property("heated", type="int", data=np.ones(1, int))
        self.scheme.setup_properties([pa, wall, sites])
        self.scheme.configure_solver(dt=1e-3)
        self.scheme.get_equations()
        self.scheme.arrays[:] = [pa]  # as PBFIntegrator.set_nnps does

        pa.m[:] *= random.uniform(0.5, 2.0, N)
        pa.u[:], pa.v[:] = random.normal(size=(2, N))
        pa.e[:] = random.uniform(-L, L, N)
        pa.phase[:] = random.integers(0, 3, N)
        pa.bubble[:] = NO_BUBBLE
        for bubble, label in ((BIG, 3), (SMALL, 50)):
            pa.phase[bubble], pa.bubble[bubble] = Phase.VAPOUR, label
            pa.e[bubble] = random.uniform(0.9 * L, 1.5 * L, bubble.stop - bubble.start)
            pa.bubble_n[bubble] = bubble.stop - bubble.start
        for name in ("vaporised", "interrupted", "limited", "projected"):
            pa.get(name)[:] = random.integers(0, 5, N)
        if "e_lat" in pa.properties:
            pa.e_lat[:] = 0.1 * L

        self.ledger = Ledger(self.scheme)
        self.ledger.begin([pa])
        self.tool, = (tool for tool in self.scheme.tools() if type(tool).__name__ == "VentingTool")

    def heat(self):
        """The heater, and the leak of the literal Laplacian where there is one, bring some energy and book it."""
        for name in {"q_heater", "q_leak"} & set(self.pa.properties):
            received = np.random.default_rng(2).uniform(-0.1 * L, 0.2 * L, self.pa.get_number_of_particles())
            self.pa.e[:] += received
            self.pa.get(name)[:] += self.pa.m * received

    def free(self, big=0, small=0, steps=2):
        """Set how many particles of the two bubbles have been free for ``steps`` steps."""
        self.pa.free[:] = 0
        self.pa.free[BIG][:big] = steps
        self.pa.free[SMALL][:small] = steps

    def vent(self, t=1.0):
        self.tool.post_step(SimpleNamespace(t=t, dt=1e-3))

    def row(self):
        return self.ledger.row(1.0, 1e-3)

    @property
    def left(self):
        """Which bubbles have left, of 3 and 50."""
        return {3, 50} - set(self.pa.bubble)


@pytest.fixture(params=sorted(SETTING))
def pool(request):
    return Pool(request.param)


# --- which bubbles leave ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", sorted(SETTING))
@pytest.mark.parametrize("share, last, first", [(0.05, 0, 1), (0.5, 2, 3), (1.0, 4, 5)])  # of sqrt(20) = 4.5
def test_a_bubble_leaves_when_its_share_is_free_and_not_before(mode, share, last, first):
    pool = Pool(mode, free_fraction=share)
    pool.free(big=last)
    pool.vent()
    assert pool.left == set()
    pool.free(big=first)
    pool.vent()
    assert pool.left == {3}  # whole, and no other
    assert pool.pa.n_vented[0] == 20 and pool.pa.n_bubbles_vented[0] == 1


@pytest.mark.parametrize("steps", [1, 3])
def test_particles_count_as_free_only_after_some_steps(steps):
    pool = Pool("lid", free_steps=steps)
    pool.free(big=20, steps=steps - 1)
    pool.vent()
    assert pool.left == set()
    pool.free(big=20, steps=steps)
    pool.vent()
    assert pool.left == {3}


def test_departures_are_recorded(pool):
    pool.free(big=1, small=4)
    pool.vent(t=2.0)
    assert pool.tool.events == [(2.001, 20), (2.001, 4)]
    assert pool.pa.n_vented[0] == 24 and pool.pa.n_bubbles_vented[0] == 2
    assert pool.row()["n_vented"] == 24 and pool.row()["n_bubbles_vented"] == 2


# --- what they take along ---------------------------------------------------------------------------------------------


def test_ledger_closes(pool):
    """Heat, vent, heat, vent: nothing is made or lost, though particles vanish or are replaced."""
    for big, small in ((1, 0), (0, 1)):
        pool.heat()
        before = pool.row()
        if small:
            pool.pa.free[pool.pa.bubble == 50] = 2
        else:
            pool.free(big=big)
        pool.vent()
        row = pool.row()
        assert abs(before["energy_residual"]) <= 1e-12 and abs(row["energy_residual"]) <= 1e-12  # round-off of sums
        assert abs(row["mass_residual"]) <= 1e-15 * N
        for name in ("energy_heater", "n_nucleated", "n_interrupted", "n_limited", "n_projected"):
            # a count since the start does not change because a particle leaves
            assert row[name] == pytest.approx(before[name], rel=1e-14)
        assert row["energy_model_leak"] == pytest.approx(before["energy_model_leak"], rel=1e-13, abs=1e-13)
    assert pool.left == {3, 50}


def test_removal_books_mass_and_enthalpy_and_carries_sums():
    pool = Pool("remove")
    pool.heat()
    pa = pool.pa
    kept = {name: dict(zip(pa.uid, pa.get(name).copy())) for name in ("x", "m", "e", "phase", "q_heater", "vaporised")}
    mass, energy = pa.m[BIG].sum(), (pa.m * pa.e)[BIG].sum()
    sums = {name: (sum_over([pa], name), pa.get(name)[BIG].sum()) for name in ("q_heater", "q_leak", "vaporised")}
    pool.free(big=1)
    pool.vent()

    assert pa.mass_vented[0] == pytest.approx(mass, rel=1e-15)
    assert pa.energy_vented[0] == pytest.approx(energy, rel=1e-15)
    assert pool.row()["mass_out"] == pa.mass_vented[0] and pool.row()["energy_vented"] == pa.energy_vented[0]
    for name, (whole, share) in sums.items():
        assert pa.constants[f"carried_{name}"][0] == pytest.approx(share, rel=1e-15)
        assert sum_over([pa], name) == pytest.approx(whole, rel=1e-14)
    assert pa.get_number_of_particles() == N - 20
    assert set(pa.uid) == set(range(20, N))  # uids name the same particles as before
    for name, values in kept.items():
        np.testing.assert_array_equal(pa.get(name), [values[uid] for uid in pa.uid])


@pytest.mark.parametrize("T_feed", [None, 300.0])
def test_lid_returns_liquid_and_books_the_difference(T_feed):
    pool = Pool("lid", T_feed=T_feed)
    pa, T = pool.pa, T_feed or WATER.T_sat
    before = {name: pa.get(name).copy() for name in pa.properties}
    pool.free(big=1)
    pool.vent()

    m, e = before["m"][BIG], before["e"][BIG]
    feed = WATER.c_l * (T - WATER.T_sat)
    assert pa.energy_vented[0] == pytest.approx(np.sum(m * (e - feed)), rel=1e-14)
    assert pool.row()["energy_lid"] == pa.energy_vented[0] and pool.row()["mass_out"] == 0.0
    np.testing.assert_allclose(pa.T[BIG], T, rtol=1e-15)
    np.testing.assert_allclose(temperature(pa.e, pa.phase, WATER)[BIG], T, rtol=1e-15)
    assert np.all(pa.phase[BIG] == (Phase.LIQUID if T_feed else Phase.SUPERHEATED))  # e = 0 is not below saturation
    assert np.all(pa.bubble[BIG] == NO_BUBBLE)
    for name in ("u", "v", "w", "free", "bubble_n", "e_lat"):
        assert not pa.get(name)[BIG].any(), name
    for name in ("x", "y", "z", "m", "uid"):
        np.testing.assert_array_equal(pa.get(name), before[name])
    for name in before.keys() - {"free"}:  # all others are left alone
        np.testing.assert_array_equal(pa.get(name)[20:], before[name][20:])


def test_feed_above_saturation_is_refused():
    with pytest.raises(ValueError, match=r"venting\.T_feed must be <= T_sat = 373\.15 K, got 380\.0 K"):
        Pool("lid", T_feed=380.0)


# --- the view of the free surface, compiled: against a reference of all pairs -----------------------------------------


def in_cone(forces):
    """Whether particle j lies in the upward cone of particle i."""
    d, r, _ = between(forces.fluid)
    up = -(d @ forces.g) / np.linalg.norm(forces.g)
    return (up > 0.3 * DX) & (r < SUPPORT) & (up > 0.5 * r)


def test_film_and_free_vapour_equal_the_reference(cloud):
    vapour, above, before = cloud.fluid.phase == VAPOUR, in_cone(cloud), cloud.fluid.free.copy()
    film = ~vapour & ~above.any(axis=1)
    free = vapour & ~(above & ~film).any(axis=1)
    assert 2 <= np.count_nonzero(film) and 2 <= np.count_nonzero(free)
    cloud.run("film", "free", "release")
    np.testing.assert_array_equal(cloud.fluid.film, film)
    np.testing.assert_array_equal(cloud.fluid.covered, ~free)
    np.testing.assert_array_equal(cloud.fluid.free, np.where(free, before + 1, 0))


def test_release_leaves_gravity_alone_to_act_on_free_vapour(cloud):
    a = cloud.run("release", start=7.0)
    np.testing.assert_array_equal(a, np.where(cloud.fluid.free[:, None] > 0, cloud.g, 7.0))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("layers, free", [(0, True), (1, True), (2, False), (4, False)])
def test_a_bubble_is_free_under_at_most_a_film(layers, free, dim):
    """A block with a bubble two wide and two high below ``layers`` layers of liquid. The count is of steps in a row."""
    size = np.array([6.0, 6.0, 0.0]) if dim == 2 else np.array([6.0, 6.0, 6.0])
    block = fluid_block((0.0, 0.0, 0.0), size * DX, spacing=DX, dim=dim, rho0=RHO0)
    x = vectors(block) / DX
    depth = 6.0 - x[:, dim - 1]
    bubble = np.all(np.abs(x[:, :dim - 1] - 3.0) < 1.0, axis=1) & (depth > layers) & (depth < layers + 2)
    forces = Forces(block, dim=dim, phase=np.where(bubble, VAPOUR, int(Phase.LIQUID)))
    for step in (1, 2, 3):
        forces.run("film", "free", "release")
        top = bubble & (depth < layers + 1)
        np.testing.assert_array_equal(block.free, np.where(top, step * free, 0))
        np.testing.assert_array_equal(block.film, (depth < 1.0) & ~bubble)
    block.phase[:] = np.where(depth < layers + 1, int(Phase.LIQUID), block.phase)  # the upper half condenses
    forces.run("film", "free", "release")
    lower = bubble & (depth > layers + 1)
    np.testing.assert_array_equal(block.free, np.where(lower, 1 * (layers == 0), 0))  # counts start afresh


def test_what_covers():
    """Cover starts 0.3 spacings up, within 60 degrees of the vertical, and ends at the support, here 2.4 spacings."""
    places = np.array([(0.0, 0.29), (0.0, 0.31), (1.7, 1.0), (1.8, 1.0), (0.0, 2.39), (0.0, 2.41), (0.0, -1.0)])
    covers = np.array([False, True, True, False, True, False, False])
    below, above = np.zeros((2, len(places), 3))
    below[:, 0] = 10.0 * np.arange(len(places))
    above[:, :2] = below[:, :2] + places
    forces = Forces(particles(DX * np.concatenate([below, above]), 2), dim=2)
    for phase, name in ((VAPOUR, "free"), (Phase.LIQUID, "film")):
        forces.fluid.phase[:] = phase
        forces.run("film", "free", "release")
        np.testing.assert_array_equal(forces.fluid.get(name)[:len(places)], ~covers)

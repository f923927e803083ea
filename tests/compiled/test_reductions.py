"""Sums and extremes over particles: those in C against NumPy, and each against sums that are exact."""
import math

import numpy as np
import pytest
from harness import Stepper, host_only, native_only, random_cloud
from sets import scheme

from pysph_boiling import native
from pysph_boiling.particles import NO_BUBBLE, add_properties, fluid_array, site_array, wall_array
from pysph_boiling.phases import Phase
from pysph_boiling.runs.ledger import Ledger
from pysph_boiling.schemes.reductions import GENERAL, HELD, CompiledReductions

pytestmark = [host_only, native_only]

SPACING = 0.05
SIZES = (1, 3, 4, 5, 1023, 1024, 1026, 5000)  # around four lanes, and around a block


def cloud(n):
    """A fluid of ``n`` particles in all states, and ghosts behind them that must not count."""
    pa = fluid_array(random_cloud(n + 3, 3, seed=1), spacing=SPACING, dim=3, rho0=958.0)
    rows = scheme("boil", dim=3, spacing=SPACING).effect_rows("properties")
    add_properties(pa, rows)
    random = np.random.default_rng(n)
    for name in ("u", "v", "w", "e", "e_lat", "q_heater"):
        pa.get(name)[:] = random.normal(size=n + 3) * 10.0 ** random.integers(-3, 7, n + 3)
    pa.phase[:], pa.limited[:] = random.integers(0, 4, n + 3), random.integers(0, 9, n + 3)
    pa.m[:] *= random.uniform(0.5, 2.0, n + 3)
    pa.e_lat[::3] = pa.e[::3]  # at the edge of what it holds
    for name in ("u", "e", "q_heater", "limited"):
        pa.get(name)[n:] = 1 << 30
    pa.tag[n:] = 2
    pa.align_particles()
    return pa


@pytest.fixture(scope="module")
def compiled():
    return CompiledReductions()


@pytest.mark.parametrize("n", SIZES)
def test_sums_in_c_are_exact_to_round_off(n, compiled):
    """Against sums without rounding; a sum of doubles depends on its number of terms neither here nor there."""
    pa = cloud(n)
    for reductions, allowed in ((compiled, 4e-16), (GENERAL, 4e-15)):
        for name in ("m", "q_heater", "limited"):
            exact = math.fsum(pa.get(name))
            assert abs(reductions.sum(pa, name) - exact) <= allowed * math.fsum(np.abs(pa.get(name))), name
        number, energy, hidden = reductions.states(pa)
        hot, held = pa.phase == Phase.SUPERHEATED, pa.e <= pa.e_lat
        masks = [pa.phase == phase for phase in Phase]
        masks[Phase.SUPERHEATED] = hot & ~held
        masks.append(hot & held)
        assert len(number) == len(energy) == len(masks) == HELD + 1
        for mask, count, heat in zip(masks, number, energy):
            assert count == np.count_nonzero(mask)
            assert abs(heat - math.fsum((pa.m * pa.e)[mask])) <= allowed * math.fsum(np.abs(pa.m * pa.e)[mask])
        stored = (pa.m * np.minimum(pa.e, pa.e_lat))[hot]
        assert abs(hidden - math.fsum(stored)) <= allowed * math.fsum(np.abs(stored))


def test_sum_in_c_loses_nothing_however_many_particles(compiled):
    """A block of these sums up exactly, but from half a million on the last digit does not fit into a plain sum."""
    assert compiled.module.sum_of(np.full(1 << 20, 1.0 + 2.0**-44)) == 2.0**20 + 2.0**-24


@pytest.mark.parametrize("n", SIZES)
def test_extremes_in_c_are_those_of_numpy(n, compiled):
    pa = cloud(n)
    for name in ("u", "e", "x"):
        assert compiled.ends(pa, name) == GENERAL.ends(pa, name) == (np.min(pa.get(name)), np.max(pa.get(name)))
        assert compiled.largest_size(pa, name) == GENERAL.largest_size(pa, name) == np.max(np.abs(pa.get(name)))
    square = np.max(pa.u**2 + pa.v**2 + pa.w**2)
    for reductions in (compiled, GENERAL):
        assert reductions.largest_square(pa, ("u", "v", "w")) == pytest.approx(square, rel=4e-16)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_no_number_is_seen_wherever_it_is(value, compiled):
    pa = cloud(1026)
    for particle in (0, 3, 1023, 1024, 1025):
        before, pa.v[particle] = pa.v[particle], value
        for reductions in (compiled, GENERAL):
            assert reductions.not_finite(pa, ("u", "v", "w")) == "v"
            assert reductions.not_finite(pa, ("u", "w")) is None
            for found in (reductions.largest_square(pa, ("u", "v", "w")), reductions.largest_size(pa, "v")):
                assert np.isnan(found) if np.isnan(value) else found == np.inf
        pa.v[particle] = before


def test_no_particles_have_sums_and_extremes_of_nothing(compiled):
    pa = cloud(5)
    pa.remove_particles(np.arange(8))
    for reductions in (compiled, GENERAL):
        assert reductions.not_finite(pa, ("u",)) is None
        assert reductions.largest_square(pa, ("u", "v", "w")) == reductions.largest_size(pa, "e") == 0.0
        assert reductions.sum(pa, "m") == reductions.sum(pa, "limited") == 0.0
        assert reductions.states(pa) == ([0.0] * 5, [0.0] * 5, 0.0)


@pytest.mark.parametrize("n", (0, *SIZES))
def test_sums_of_several_are_those_of_each(n, compiled):
    pa, names = cloud(n), ("limited", "m", "q_heater", "phase")
    for reductions in (compiled, GENERAL):
        assert reductions.sums(pa, names) == [reductions.sum(pa, name) for name in names]
    with pytest.raises(TypeError):
        compiled.sums(pa, ["uid"])  # neither floats nor counters


@pytest.mark.parametrize("n", (0, *SIZES))
def test_what_lies_between_in_c_is_what_numpy_finds(n, compiled, monkeypatch):
    numbers = np.random.default_rng(n).integers(-3, 9, n).astype(np.intc)
    for low, high in ((3, 3), (-3, 0), (7, 2**31 - 1), (9, 20), (-9, -4)):
        where = np.flatnonzero((numbers >= low) & (numbers <= high))
        for module in (compiled.module, None):
            monkeypatch.setattr(native, "loaded", lambda module=module: module)
            assert native.has(numbers, low, high) == (len(where) > 0)
            np.testing.assert_array_equal(native.members(numbers, low, high), where)
        for k in {0, n // 2, n - 1} if n else ():  # alone, wherever it is
            alone = np.full(n, low - 1, np.intc)
            alone[k] = high
            assert compiled.module.has_within(alone, low, high)
            assert compiled.module.indices_within(alone, low, high).tolist() == [k]


@pytest.mark.parametrize("n", [0, 1, 7, 3000])
def test_members_counted_in_c_are_those_of_numpy(n, compiled, monkeypatch):
    """Heights in whole numbers, so that some lie at the limit."""
    random, groups = np.random.default_rng(n), 1 + n // 10
    index, height = random.integers(0, groups, n), random.integers(-3, 9, n).astype(float)
    uid = random.permutation(2 * n).astype(np.uintc)[:n]
    for known in (np.sort(uid[::3]), np.arange(n, dtype=np.uintc), np.zeros(0, np.uintc)):
        low = [np.count_nonzero(height[index == group] <= 5.0) for group in range(groups)]
        met = [np.count_nonzero(np.isin(uid[index == group], known)) for group in range(groups)]
        for module in (compiled.module, None):
            monkeypatch.setattr(native, "loaded", lambda module=module: module)
            found = native.counts(index, groups, height, 2.0, 3.0, uid, known)
            assert [one.tolist() for one in found] == [low, met]


@pytest.mark.parametrize("n", [0, 1, 7, 3000])
def test_groups_in_c_are_those_of_numpy(n, compiled):
    labels = np.random.default_rng(n).integers(0, 1 + n // 10, n).astype(np.uintc)
    labels[::2] = NO_BUBBLE
    for found, wanted in zip(compiled.module.groups_of(labels), np.unique(
            labels, return_index=True, return_inverse=True, return_counts=True)):
        np.testing.assert_array_equal(found, wanted)
        assert found.dtype == wanted.dtype


def boiling(lean):
    made = scheme("boil", dim=3, spacing=SPACING, lean=lean)
    common = dict(spacing=SPACING, dim=3, rho0=made.rho0)
    fluid = fluid_array(random_cloud(500, 3, seed=5), **common)
    wall = wall_array(np.array([[0.5, 0.5, -0.02]]), kernel=made.kernel, heated=[1], **common)
    sites = site_array([(0.5, 0.5, 0.0)], reach=2.4 * SPACING, spacing=SPACING)
    made.setup_properties([fluid, wall, sites])
    return made, Stepper(made, [fluid, wall, sites]), fluid


def test_a_run_with_lean_sums_makes_its_rows_in_c():
    """Every column is, to round-off, what NumPy gives; without lean sums NumPy serves."""
    assert boiling(lean=False)[0].reductions is GENERAL
    made, _, fluid = boiling(lean=True)
    assert isinstance(made.reductions, CompiledReductions)
    random, n = np.random.default_rng(6), len(fluid.x)
    fluid.phase[:], fluid.e[:], fluid.T[:] = random.integers(0, 4, n), random.normal(0.0, 1e6, n), 380.0
    fluid.e_lat[:], fluid.bubble[:] = random.uniform(0.0, 1e6, n), random.integers(0, 9, n)
    for name in ("vaporised", "condensed", "limited", "contacts", "projected", "interrupted", "q_heater"):
        fluid.get(name)[:] = random.integers(0, 5, n)
    ledger = Ledger(made)
    ledger.begin(made.arrays)
    fluid.e[:] *= 1.01
    here = ledger.row(1.0, 1.0)
    made.integrator.reductions = GENERAL
    general = ledger.row(1.0, 1.0)
    assert here.keys() == general.keys()
    for name, value in here.items():
        assert value == pytest.approx(general[name], rel=1e-13, abs=1e-13 if name.endswith("residual") else 0.0), name
    assert here["n_held"] > 0.0 and here["energy_hidden"] != 0.0 and here["n_limited"] > 0.0

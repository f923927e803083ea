"""Condensation: bubbles by hand, a slow reference, the collapse of a bubble in cold water, and its balance of energy.

One set of effects is compiled, on frozen particles. Where heat must not move, a step of no length is made.
"""
import numpy as np
import pytest
from harness import Stepper
from scipy.stats import chisquare

from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.particles import NO_BUBBLE, fluid_array, fluid_block, positions
from pysph_boiling.phases import Phase, temperature
from pysph_boiling.runs.ledger import Ledger
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    BubbleLabels,
    Condensation,
    HeatConduction,
    Heater,
    PhaseChange,
    heat_step_limit,
)
from pysph_boiling.schemes.integrator import set_constant

DX, L, T_SAT = 0.01, WATER.L, WATER.T_sat
NO_TIME = 1e-30  # s; no enthalpy of vapour changes by as much as its last digit
FAR = 10.0 * DX  # beyond every kernel
STREAM = 20


class Water:
    """Frozen particles with everything that condensation needs. All vapour at first stands at saturation."""

    def __init__(self, pa, *, dim, form="latent", seed=0, dt=NO_TIME, time_scaling=1.0, base=((-FAR, -FAR, 0.0),),
                 T_wall=T_SAT):
        wall = fluid_array(base, name="wall", spacing=DX, dim=dim, rho0=WATER.rho_l)
        wall.add_property("heated", type="int", data=np.ones(len(base), int))
        self.pa, self.subcooling = pa, {"latent": 0.0, "paper": 1.0}[form]
        self.scheme = BoilingScheme(
            ["fluid"], ["wall"], dim=dim, spacing=DX, material=WATER, density=None,
            heat=HeatConduction(time_scaling=time_scaling), heater=Heater(temperature=T_wall), phases=PhaseChange(),
            bubbles=BubbleLabels(), condensation=Condensation(form=form, seed=seed))
        self.scheme.setup_properties([pa, wall])
        self.scheme.set_temperature(pa, 273.15)
        self.stepper = Stepper(self.scheme, [pa, wall], dt=dt)
        if form == "paper":  # no guard: cases by hand lack so much that the paper's form reads less than 0 K
            self.stepper.tools = []
        self.scheme.arrays[:] = [pa]

    def vapour(self, who=slice(None), e=L):
        self.pa.phase[who], self.pa.e[who] = Phase.VAPOUR, e

    def step(self):
        self.stepper.step()

    def rows(self, steps):
        """Rows of the ledger, one a step."""
        ledger = Ledger(self.scheme)
        ledger.begin([self.pa])
        for _ in range(steps):
            self.step()
            yield ledger.row(self.stepper.t, self.stepper.dt)

    def state(self):
        """uid -> (phase, e, T, condensed, bubble, bubble_n), which tells no order of particles."""
        columns = [self.pa.get(name).tolist() for name in ("phase", "e", "T", "condensed", "bubble", "bubble_n")]
        return dict(zip(self.pa.uid.tolist(), zip(*columns)))


def rows(*sizes):
    """A row of particles one spacing apart for each bubble, all far from each other: positions (n, 3), bubble (n,)."""
    bubble = np.repeat(np.arange(len(sizes)), sizes)
    points = np.zeros((len(bubble), 3))
    points[:, 0] = DX * np.concatenate([np.arange(n) for n in sizes])
    points[:, 0] += (FAR + DX * max(sizes)) * (bubble // 40)  # folded: a device's search has no room for long rows
    points[:, 1] = FAR * (bubble % 40)
    return points, bubble


def bubbles(sizes, *, m=1.0, e=1.0, uid=None, order=None, dim=2, **kwargs):
    """Water that is all vapour: a row for each bubble. ``m`` in particle masses, ``e`` in L; ``order`` of the array."""
    points, bubble = rows(*sizes)
    order = np.arange(len(points)) if order is None else order
    pa = fluid_array(points[order], spacing=DX, dim=dim, rho0=WATER.rho_l)
    pa.uid[:] = np.arange(len(points))[order] if uid is None else np.asarray(uid)[order]
    pa.m[:] *= np.broadcast_to(m, bubble.shape)[order]
    water = Water(pa, dim=dim, **kwargs)
    water.vapour(e=L * np.broadcast_to(e, bubble.shape)[order])
    return water


# --- by hand ----------------------------------------------------------------------------------------------------------


BY_HAND = (  # e of the members, how many condense, e of the vapour and of the new liquid after; all in L
    ([0.8] * 4, 0, [0.8] * 4, []),  # Q = .8: less than one costs
    ([0.75] * 4, 1, [1.0] * 3, [0.0]),  # Q = 1, exactly
    ([0.7] * 5, 1, [0.875] * 4, [0.0]),  # Q = 1.5; the rest of .5 shared by four
    ([0.9, 0.6, 0.5, 0.2], 1, [1.0 - 0.8 / 3.0] * 3, [0.0]),  # Q = 1.8; the others then lack the same
    ([0.5] * 5, 2, [1.0 - 0.5 / 3.0] * 3, [0.0] * 2),  # Q = 2.5
    ([1.5, 0.5, 0.4], 1, [1.5, 0.9], [0.0]),  # what lies above L pays nothing, and is left alone
    ([1.5, 1.0, 0.5], 0, [1.5, 1.0, 0.5], []),
    ([-0.1, -0.3], 2, [], [-0.2] * 2),  # Q = 2.4: all condense, and what is left cools the new liquid
    ([1.2, -0.2], 1, [1.2], [-0.2]),  # all that were below L
    ([-1e-3], 1, [], [-1e-3]),
    ([1e-3], 0, [1e-3], []),
)


@pytest.mark.parametrize("form", ["latent", "paper"])
def test_a_bubble_condenses_as_its_deficit_pays_for(form):
    sizes = [len(e) for e, *_ in BY_HAND]
    start = L * np.concatenate([e for e, *_ in BY_HAND])
    water = bubbles(sizes, e=start / L, form=form)
    water.step()
    pa = water.pa
    gas = pa.phase == Phase.VAPOUR
    for number, (_, n, vapour, liquid) in enumerate(BY_HAND):
        here = np.repeat(np.arange(len(sizes)), sizes) == number
        assert np.sum(pa.condensed[here]) == n, number
        np.testing.assert_allclose(sorted(pa.e[here & gas] / L), sorted(vapour), atol=4e-16)  # ulp of 1
        np.testing.assert_allclose(sorted(pa.e[here & ~gas] / L), sorted(liquid), atol=4e-16)
        if n == 0:
            np.testing.assert_array_equal(pa.e[here], start[here])  # to the last bit
    np.testing.assert_array_equal(pa.condensed, ~gas)
    assert np.all(pa.phase[~gas] == Phase.LIQUID) and not np.any(pa.e_lat) and not np.any(pa.condensing)
    np.testing.assert_array_equal(pa.T, temperature(pa.e, pa.phase, WATER, subcooling=water.subcooling))
    assert np.any(pa.T[gas] < T_SAT) == (form == "paper")


# --- against a slow reference -----------------------------------------------------------------------------------------


def reference_key(uid, seed, step):
    """The hash in integers of Python, which have no size."""
    h = int(uid)
    for counter in (0, seed, STREAM, step):
        h = (h + counter) % 2**32
        h = (h ^ (h >> 16)) * 569420461 % 2**32
        h = (h ^ (h >> 15)) * 1935289751 % 2**32
        h = h ^ (h >> 15)
    return h


def reference(uid, bubble, m, e, seed, step):
    """uid -> new enthalpy, and the set of uids that condense; one particle after the other."""
    new, gone = dict(zip(uid, e)), set()
    for b in set(bubble):
        members = sorted((reference_key(u, seed, step), u, mass, enthalpy)
                         for u, mass, enthalpy, where in zip(uid, m, e, bubble) if where == b and enthalpy < L)
        heat, chosen, rest = sum(mass * (L - enthalpy) for _, _, mass, enthalpy in members), [], []
        for _, u, mass, _ in members:
            if rest or heat < mass * L:
                rest.append((u, mass))
            else:
                heat -= mass * L
                chosen.append((u, mass))
        if chosen:
            for u, _ in chosen:
                new[u] = 0.0
            for u, _ in rest or chosen:
                new[u] = (L if rest else 0.0) - heat / sum(mass for _, mass in rest or chosen)
            gone |= {u for u, _ in chosen}
    return new, gone


def cloud(seed, number=60):
    """Bubbles of 1 to 12 particles of mixed masses: sizes, uid, m [m_p], e [L]."""
    random = np.random.default_rng(seed)
    sizes = random.integers(1, 13, number)
    n = sizes.sum()
    level = np.repeat(random.uniform(-0.3, 1.1, number), sizes)
    return sizes, random.choice(NO_BUBBLE, n, replace=False), random.uniform(0.3, 2.0, n), level + random.uniform(
        -0.2, 0.4, n)


@pytest.mark.parametrize("seed", [0, 7])
def test_mixed_bubbles_equal_the_reference(seed):
    """Also: the sum of m e of each bubble is kept, and a second decision is another one."""
    sizes, uid, m, e = cloud(seed)
    bubble = np.repeat(np.arange(len(sizes)), sizes)
    water, sets = bubbles(sizes, m=m, e=e, uid=uid, seed=seed), []
    pa = water.pa
    for step in (1, 2, 3):
        water.vapour(e=L * e)
        pa.condensed[:] = 0
        water.step()
        assert pa.steps[0] == step
        new, gone = reference(uid.tolist(), bubble.tolist(), pa.m.tolist(), (L * e).tolist(), seed, step)
        np.testing.assert_allclose(pa.e / L, [new[u] / L for u in uid.tolist()], atol=1e-14)  # sums of up to 12
        np.testing.assert_array_equal(pa.condensed == 1, [u in gone for u in uid.tolist()])
        before, after = np.bincount(bubble, pa.m * L * e), np.bincount(bubble, pa.m * pa.e)
        np.testing.assert_allclose(after, before, atol=4e-15 * np.max(pa.m) * 12 * L)
        np.testing.assert_array_equal(pa.T, temperature(pa.e, pa.phase, WATER, subcooling=0.0))
        sets.append(gone)
    per_bubble = np.bincount(bubble, [u in sets[0] for u in uid.tolist()])
    assert len(set(per_bubble)) > 4 and np.any(per_bubble == sizes), "too little happened"
    assert sets[0] != sets[1] != sets[2]


def test_order_of_the_particles_is_no_matter():
    """The same choice and the same enthalpy, to the last bit."""
    sizes, uid, m, e = cloud(3)
    outcomes = []
    for order in (None, np.random.default_rng(1).permutation(len(uid))):
        water = bubbles(sizes, m=m, e=e, uid=uid, order=order)
        water.step()
        outcomes.append(water.state())
    assert outcomes[0] == outcomes[1]
    assert sum(row[3] for row in outcomes[0].values()) > 50


def test_bubbles_condense_each_for_itself():
    """.6 L of deficit twice do not pay for one; and a bubble fares as it would alone, to the last bit."""
    apart = bubbles([3, 3], e=0.8)
    apart.step()
    assert not np.any(apart.pa.condensed)

    sizes, uid, m, e = cloud(5)
    together, first = bubbles(sizes, m=m, e=e, uid=uid), 0
    together.step()
    for n in sizes[:4]:
        part = slice(first, first + n)
        alone = bubbles([n], m=m[part], e=e[part], uid=uid[part])
        alone.step()
        for name, row in alone.state().items():
            assert together.state()[name] == row
        first += n


# --- the choice -------------------------------------------------------------------------------------------------------


def test_choice_is_uniform_and_anew_in_each_step():
    """One of four and two of four, in 400 bubbles over 6 steps; each p-value above .001 (the seeds are fixed)."""
    number, steps = 400, 6
    water, uid = bubbles([4] * number), np.arange(4 * number)
    chosen = {1: [], 2: []}
    for n, taken in chosen.items():
        for _ in range(steps):
            water.vapour(e=L * (1.0 - (n + 0.2) / 4.0))
            water.pa.condensed[:] = 0
            water.step()
            taken.append(water.pa.condensed.reshape(number, 4).copy())
            assert np.all(taken[-1].sum(1) == n)
    ones = np.argmax(chosen[1], axis=2)  # (steps, bubbles): which of the four
    assert chisquare(np.bincount(ones.ravel())).pvalue > 1e-3
    pairs = np.bincount((4 * ones[1:] + ones[:-1]).ravel(), minlength=16)  # this step and the one before
    assert chisquare(pairs).pvalue > 1e-3
    neighbours = np.bincount((4 * ones[:, 1:] + ones[:, :-1]).ravel(), minlength=16)  # this bubble and the one beside
    assert chisquare(neighbours).pvalue > 1e-3
    both = np.concatenate(chosen[2]) @ [1, 2, 4, 8]
    assert chisquare([np.sum(both == pair) for pair in (3, 5, 6, 9, 10, 12)]).pvalue > 1e-3

    other = bubbles([4] * number, e=0.7, seed=1, uid=uid)
    other.step()
    same = np.mean(np.argmax(other.pa.condensed.reshape(number, 4), axis=1) == ones[0])
    assert 0.15 < same < 0.35  # 1/4 by chance, sigma .022


# --- labels -----------------------------------------------------------------------------------------------------------


def test_labels_are_current_when_a_bubble_splits():
    """A row of seven loses its middle: two bubbles in the same step, each known by its own smallest uid."""
    water = bubbles([7], e=[1.0, 1.1, 1.0, -0.1, 1.0, 1.3, 1.0], uid=[3, 9, 4, 5, 8, 6, 7])
    (row,) = water.rows(1)
    np.testing.assert_array_equal(water.pa.phase, [3, 3, 3, 0, 3, 3, 3])
    np.testing.assert_array_equal(water.pa.bubble, [3, 3, 3, NO_BUBBLE, 6, 6, 6])
    np.testing.assert_array_equal(water.pa.bubble_n, [3, 3, 3, 0, 3, 3, 3])
    assert water.pa.relabel[0] == 0.0
    assert (row["n_condensed"], row["n_bubbles"], row["n_vapour"]) == (1, 2, 6)


def test_labels_are_gone_with_the_last_vapour():
    water = bubbles([3], e=-0.1)
    water.step()
    assert np.all(water.pa.bubble == NO_BUBBLE) and not np.any(water.pa.bubble_n) and water.pa.relabel[0] == 0.0
    rounds = water.pa.bubble_rounds[0]
    water.step()  # no vapour: the stage does not run
    assert water.pa.bubble_rounds[0] == rounds and np.all(water.pa.condensed == 1)


def test_second_pass_only_labels():
    water = bubbles([5], e=0.5)
    water.pa.relabel[0] = 1.0
    water.stepper.run_stage("bubbles")
    np.testing.assert_array_equal(water.pa.e, 0.5 * L)
    assert water.pa.relabel[0] == 1.0 and not np.any(water.pa.condensed)  # the integrator clears it
    np.testing.assert_array_equal(water.pa.bubble, [0] * 5)


def test_labels_are_made_once_if_nothing_condenses():
    rounds = []
    for e in (0.9, 0.7):
        water = bubbles([5], e=e)
        water.step()
        rounds.append(water.pa.bubble_rounds[0])
    assert rounds[1] > rounds[0]


# --- whole runs -------------------------------------------------------------------------------------------------------


def block(n, dim):
    size = np.array([n * DX] * dim + [0.0] * (3 - dim))
    return fluid_block(np.zeros(3), size, spacing=DX, dim=dim, rho0=WATER.rho_l), size


A = 1000.0  # heat runs so much faster; nothing moves, so that it only sets the unit of time
DT = 0.9 * min(heat_step_limit(WATER.rho_l, c, A * k, 1.2 * DX) for c, k in (
    (WATER.c_l, WATER.k_l), (WATER.c_v, WATER.k_v)))


@pytest.mark.parametrize("form, dim", [("latent", 2), ("latent", 3), ("paper", 2)])
def test_bubble_of_11_in_ice_water_collapses_only_in_the_latent_form(form, dim):
    """The deficit of 11 particles at 273.15 K is 11 c_v 100 K = .99 L: in the paper's form they stay for ever."""
    pa, size = block({2: 21, 3: 11}[dim], dim)
    water = Water(pa, dim=dim, form=form, dt=DT, time_scaling=A)
    place = positions(pa) - 0.5 * size - 1e-4 * DX * np.array([1.0, 2.0, 3.0])  # no two as near
    water.vapour(np.argsort(np.linalg.norm(place, axis=1))[:11])
    gas, worst, n = pa.phase == Phase.VAPOUR, 0.0, []
    for row in water.rows(700 if form == "paper" else 1200):
        worst = max(worst, abs(row["energy_residual"]))
        n.append((row["n_vapour"], row["n_condensed"]))
        assert sum(n[-1]) == 11 and row["n_nucleated"] == 0
        if row["n_vapour"] == 0:
            break
    assert worst <= 1e-12  # measured 3e-14: sums of 441 or 1331 particles
    if form == "latent":
        assert n[-1] == (0, 11) and len(set(n)) > 5  # one after the other
        assert np.all(pa.phase == Phase.LIQUID) and np.all(pa.bubble == NO_BUBBLE)
    else:
        assert n[-1] == (11, 0)
        assert np.ptp(pa.T) < 0.1 and np.all(pa.T < 275.0)  # K: all is as cold as it gets
        assert 0.97 < np.sum(1.0 - pa.e[gas] / L) < 1.0


def test_ledger_closes_while_vapour_appears_and_condenses():
    """A hot base boils the layer above it, then it turns cold."""
    n = 16
    pa, size = block(n, 2)
    base = np.zeros((n, 3))
    base[:, 0], base[:, 1] = DX * (np.arange(n) + 0.5), -0.5 * DX
    water = Water(pa, dim=2, dt=DT, time_scaling=A, base=base, T_wall=640.0)
    low = pa.y < 4.0 * DX
    pa.phase[low], pa.e[low] = Phase.TRANSITION, 0.9 * L
    water.vapour(np.flatnonzero(low)[:1])
    for step, row in enumerate(water.rows(450)):
        if step == 40:
            set_constant(pa, "heater_T", 274.0)
        assert abs(row["energy_residual"]) <= 1e-12  # measured 6e-14
        assert row["n_vapour"] == 1 + row["n_nucleated"] - row["n_condensed"]
        assert not np.any(pa.e_lat[pa.phase == Phase.VAPOUR])  # so new liquid hides no heat
    assert row["n_nucleated"] >= 20 and row["n_condensed"] >= 5 and row["n_interrupted"] > 0


# --- temperature ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("form", ["latent", "paper"])
@pytest.mark.parametrize("stage", ["heat", "phases"])
def test_temperature_of_vapour_by_the_form(stage, form):
    e = np.linspace(-0.5, 1.5, 41)
    water = bubbles([1] * len(e), e=e, form=form)
    water.stepper.run_stage(stage)
    excess = e - 1.0
    want = T_SAT + np.where(excess < 0.0, excess * (form == "paper"), excess) * L / WATER.c_v
    np.testing.assert_allclose(water.pa.T, want, rtol=4e-15, atol=4e-13)  # ulp of L over c_v T_sat; some T are near 0
    twin = temperature(water.pa.e, water.pa.phase, WATER, subcooling=water.subcooling)
    np.testing.assert_array_equal(water.pa.T, twin)


@pytest.mark.parametrize("interrupt", ["hold", "convert"])
@pytest.mark.parametrize("effect, subcooling", [(None, 1.0), (Condensation(form="paper"), 1.0), (Condensation(), 0.0)])
def test_form_tells_how_vapour_below_saturation_is_read(effect, subcooling, interrupt):
    scheme = BoilingScheme(["fluid"], [], dim=2, spacing=DX, density=None, heat=HeatConduction(), phases=PhaseChange(
        interrupt=interrupt), bubbles=BubbleLabels(), condensation=effect)
    kernels = [term.equation for term in scheme.terms() if hasattr(term.equation, "subcooling")]
    assert len(kernels) == 3 + (effect is not None)
    assert {kernel.subcooling for kernel in kernels} == {subcooling}

"""Dynamic nucleation: the compiled stage against a slow and literal reference that makes the same choices.

All lengths in spacings, all heat in units of m_p L. One set of effects is compiled, with latent heat held back.
"""
import re
from itertools import combinations
from math import floor

import numpy as np
import pytest
from harness import Evaluator, Stepper, assert_repeated, random_cloud
from pysph.base.nnps import DomainManager
from pysph.base.omp_threads import get_number_of_threads, set_number_of_threads
from scipy.stats import chi2_contingency, chisquare

from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.particles import fluid_array, fluid_block
from pysph_boiling.phases import Phase, temperature
from pysph_boiling.runs.ledger import Ledger
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import DynamicNucleation, HeatConduction, PhaseChange

L, M_P = WATER.L, WATER.rho_l  # spacing 1
SUPERHEATED, VAPOUR = int(Phase.SUPERHEATED), int(Phase.VAPOUR)
STREAMS = (0, 1)  # regions, members
pytestmark = pytest.mark.filterwarnings("ignore:dynamic_nucleation. the threshold is")  # clusters here are small


def boiling(dim, interrupt="hold", fluids=("fluid",), **burst):
    return BoilingScheme(list(fluids), [], dim=dim, spacing=1.0, density=None, heat=HeatConduction(),
                         phases=PhaseChange(interrupt=interrupt), dynamic_nucleation=DynamicNucleation(**burst))


class Pool:
    """Superheated particles and the compiled stage: ``run()`` once. ``m`` is in m_p, ``e`` and ``e_lat`` in L."""

    def __init__(self, points, e, *, dim=3, m=1.0, uid=None, phase=SUPERHEATED, e_lat=0.0, period=0.0, **burst):
        self.scheme, self.period = boiling(dim, **burst), period
        self.pa = fluid_array(points, spacing=1.0, dim=dim, rho0=WATER.rho_l)
        if uid is not None:
            self.pa.uid[:] = uid
        self.scheme.setup_properties([self.pa])
        self.start = dict(e=e * L, e_lat=e_lat * L, m=m * M_P, phase=phase, T=np.nan)
        domain = DomainManager(xmin=0.0, xmax=period, periodic_in_x=True) if period else None
        self.scheme.configure_solver(dt=1e-3)
        stages, integrator = self.scheme.get_equations().groups, self.scheme.integrator
        self.reset()
        self.stage = Evaluator([self.pa], stages[integrator.stages["dynamic_nucleation"]], dim=dim, domain=domain)
        self.ghosts = self.scheme.ghosts
        self.ghosts.arrays = [self.pa]

    def reset(self):
        for name, value in self.start.items():
            self.pa.get(name, only_real_particles=True)[:] = value
        return self

    def run(self, count=0):
        self.pa.steps[0] = count
        self.stage.nnps.update_domain()
        self.stage.nnps.update()
        self.ghosts.search_done()
        self.stage.evaluation.compute(0.0, 1.0)
        return self

    def get(self, name):
        return self.pa.get(name, only_real_particles=True).copy()

    def state(self, *names):
        return {name: self.get(name) for name in names or ("uid", "x", "y", "z", "m", "phase", "e", "e_lat", "T")}

    @property
    def heat(self):
        return float(np.dot(self.get("m"), self.get("e")))

    @property
    def held(self):
        """Latent heat that superheated particles hold [J/kg], (n,)."""
        e, e_lat = self.get("e"), self.get("e_lat")
        return np.where(self.get("phase") == SUPERHEATED, np.clip(e_lat, 0.0, np.maximum(e, 0.0)), 0.0)


# --- the reference ----------------------------------------------------------------------------------------------------


def key(uid, seed, stream, count):
    """Random number of a particle, in Python's integers."""
    h = int(uid)
    for word in (0, 2 * seed + stream, count):
        h = (h + word) % 2**32
        h = (h ^ (h >> 16)) * 569420461 % 2**32
        h = (h ^ (h >> 15)) * 1935289751 % 2**32
        h = h ^ (h >> 15)
    return h


def units(share):
    return floor(share * 2**24 + 0.5)


def neighbourhood(pool):
    """Who is superheated and within the radius of whom, (n, n)."""
    x = np.stack([pool.get(name) for name in "xyz"], -1)
    offset = x[:, None] - x
    if pool.period:
        offset[..., 0] -= pool.period * np.round(offset[..., 0] / pool.period)
    near = np.sqrt(np.sum(offset**2, axis=-1)) < pool.scheme.effects["dynamic_nucleation"].radius * (1.0 + 1e-9)
    hot = pool.get("phase") == SUPERHEATED
    return near & hot & hot[:, None]


def capacity(held):
    """Heat capacity [J/(kg K)] of liquid and vapour mixed, (n,), where the vapour is worth the heat it holds."""
    return (1.0 - held / L) * WATER.c_l + held / L * WATER.c_v


def reference(pool, count):
    """(phase, e, regions): the state after one evaluation, and the members of each region that fires, by its centre.

    A region fires if no other that holds enough heat and shares a member with it is stronger. Sums in whole numbers.
    """
    m, e, phase, uid = (pool.get(name) for name in ("m", "e", "phase", "uid"))
    effect, near, held = pool.scheme.effects["dynamic_nucleation"], neighbourhood(pool), pool.held
    unit = [units(mass / M_P * heat / L) for mass, heat in zip(m, e - held)]
    heat, c = near @ np.array(unit, float), capacity(held)  # whole numbers: exact
    cost = [units(mass / M_P * (L - mine) / L) for mass, mine in zip(m, held)]
    if effect.superheat_limit is not None:
        enough = heat / 2**24 * M_P * L > effect.superheat_limit * (near @ (m * c))
    else:
        enough = heat > (10.0 if effect.q_crit is None else effect.q_crit) * 2**24
    candidates = np.flatnonzero(enough & (heat >= 2**24))
    rank = {i: (heat[i], key(uid[i], effect.seed, STREAMS[0], count)) for i in candidates}
    overlap = near[candidates].astype(float) @ near[candidates].T
    regions = {}
    for i, shared in zip(candidates, overlap):
        members = np.flatnonzero(near[i])
        if max(candidates[shared > 0], key=rank.get) != i:
            continue
        order = sorted(members, key=lambda j: key(uid[j], effect.seed, STREAMS[1], count))
        price = np.cumsum([cost[j] for j in order])
        n = int(np.sum(price <= heat[i]))
        if n == 0:
            continue
        regions[i] = members
        chosen, others = order[:n], order[n:]
        left = np.dot(m[members], (e - held)[members]) - np.dot(m[chosen], L - held[chosen])
        if others:
            e[others] = held[others] + c[others] * left / np.dot(m[others], c[others])  # equally hot
            e[chosen] = L
        else:
            e[chosen] = L + left / m[chosen].sum()
        phase[chosen] = VAPOUR
    return phase, e, regions


def fisher_yates(random, k, n):
    """First n of k after the shuffle of Fisher and Yates."""
    row = list(range(k))
    for i in range(k - 1, 0, -1):
        j = random.integers(0, i + 1)
        row[i], row[j] = row[j], row[i]
    return row[:n]


def compare(pool, count=0):
    """One evaluation against the reference; returns how many regions fired and how many particles became vapour."""
    before, own, (phase, e, regions) = pool.state(), pool.held, reference(pool, count)
    heat, fired, burst = pool.heat, pool.get("fired"), pool.get("burst")
    after = pool.run(count).state()
    np.testing.assert_array_equal(after["phase"], phase)
    # round-off of sums of some 100 terms, which the reference adds in another order
    np.testing.assert_allclose(after["e"], e, rtol=1e-13, atol=1e-13 * L)
    assert pool.heat == pytest.approx(heat, rel=1e-14)

    held = np.zeros(len(e), int)
    for members in regions.values():
        held[members] += 1
    assert held.max(initial=0) <= 1
    member = held == 1
    np.testing.assert_array_equal(pool.get("member"), held)
    np.testing.assert_array_equal(np.flatnonzero(pool.get("fires")), sorted(regions))
    np.testing.assert_array_equal(pool.get("fired") - fired, pool.get("fires"))
    new = (phase == VAPOUR) & (before["phase"] == SUPERHEATED)
    np.testing.assert_array_equal(pool.get("burst") - burst, new)
    np.testing.assert_array_equal(after["e_lat"], np.where(member, own * (phase == SUPERHEATED), before["e_lat"]))
    np.testing.assert_allclose(
        after["T"][member], temperature(after["e"], phase, WATER, after["e_lat"])[member], rtol=4e-16)
    for name, values in before.items():  # who is in no region is left alone, to the last bit
        np.testing.assert_array_equal(after[name][~member], values[~member])
    assert np.all(np.isin(phase[member], (SUPERHEATED, VAPOUR)))
    return len(regions), int(new.sum())


# --- the whole algorithm ----------------------------------------------------------------------------------------------


def cloud(dim, *, n=800, density=1.0, mixed=False, seed=0):
    """Particles at random, of all phases and masses of 0.3 to 2.5 m_p, most of them superheated."""
    random, box = np.random.default_rng(seed), (n / density) ** (1.0 / dim)
    return dict(
        points=random_cloud(n, dim, seed=seed, box=box), dim=dim, uid=random.choice(2**32 - 1, n, replace=False),
        e=random.uniform(0.0, 1.0, n), e_lat=random.choice([0.0, 0.1, 0.4], n),
        phase=random.choice(list(Phase), n, p=[0.05, 0.05, 0.85, 0.05]),
        m=random.uniform(0.3, 2.5, n) if mixed else 1.0), box


@pytest.mark.parametrize("dim, mixed, periodic, burst", [
    (3, False, False, {}),
    (3, True, True, dict(q_crit=6.0, seed=5)),
    (3, True, False, dict(superheat_limit=230.0, radius=1.6, seed=10**9)),
    (2, False, True, dict(superheat_limit=225.0)),
    (2, True, False, dict(q_crit=5.0, radius=2.4, seed=1)),
    (2, True, True, dict(q_crit=0.0, radius=1.7)),
])
def test_equals_the_reference(dim, mixed, periodic, burst):
    """Step after step the same regions, the same particles, the same enthalpies."""
    kwargs, box = cloud(dim, mixed=mixed, seed=dim)
    pool = Pool(period=box * periodic, **kwargs, **burst)
    fired, burst = zip(*(compare(pool, count) for count in range(5)))
    assert fired[0] >= 2 and sum(fired) >= 6 and sum(burst) >= 30


def lattice(n, dim=3):
    return np.pad(np.indices((n,) * dim).reshape(dim, -1).T.astype(float), ((0, 0), (0, 3 - dim)))


def test_a_lattice_equals_the_reference_and_ends_below_the_threshold():
    """Regions of a lattice hold the particles at the radius too (33 of them), and tie."""
    pool = Pool(lattice(9), 0.4)
    members = pool.scheme.effects["dynamic_nucleation"].members(pool.scheme.scene())
    assert np.max(np.sum(neighbourhood(pool), axis=1)) == members == 33
    fired = [compare(pool, count)[0] for count in range(9)]
    assert sum(fired) >= 8 and fired[-1] == 0
    assert np.all(neighbourhood(pool) @ pool.get("e") <= 10.0 * L * (1.0 + 1e-6))


@pytest.mark.parametrize("ties", [False, True], ids=["cloud", "ties"])
def test_neither_threads_nor_order_of_particles_matter(ties):
    """On a lattice with few values of e, many regions hold the same heat, but only if sums are exact."""
    kwargs, random = cloud(3, n=3000, mixed=True, seed=7)[0], np.random.default_rng(8)
    if ties:
        kwargs = dict(points=lattice(14), uid=np.arange(14**3), e=random.choice([0.3, 0.4, 0.5], 14**3))
    order = random.permutation(len(kwargs["e"]))
    shuffled = {name: value[order] if isinstance(value, np.ndarray) else value for name, value in kwargs.items()}
    before, states, used = get_number_of_threads(), [], []
    try:
        for threads in (1, 2, 4):
            set_number_of_threads(threads)
            used.append(get_number_of_threads())
            for case, back in ((kwargs, slice(None)), (shuffled, np.argsort(order))):
                pool = Pool(**case, q_crit=8.0)
                for count in range(6):
                    pool.run(count)
                states.append([pool.get(name)[back] for name in ("phase", "fired", "burst", "e")])
    finally:
        set_number_of_threads(before)
    assert used == [1, 2, 4]
    phase, fired, burst, e = (np.array(column) for column in zip(*states))
    assert fired[0].sum() > 25 and burst[0].sum() > 200
    for column in (phase, fired, burst):
        np.testing.assert_array_equal(column, [column[0]] * len(states))
    assert_repeated(e[::2], [e[0]] * 3, roundoff=1e-13 * L)
    np.testing.assert_allclose(e[1], e[0], rtol=1e-13, atol=1e-13 * L)  # order: round-off of the sums


# --- regions ----------------------------------------------------------------------------------------------------------


def test_literal_reading_spends_heat_twice_and_ours_does_not():
    """The paper's text taken at its word: each superheated particle above the threshold is a centre of its own."""
    pool = Pool(lattice(8), 0.4)
    near, e = neighbourhood(pool), pool.get("e")
    Q = near @ e
    literal = int(np.sum(np.floor(Q[Q > 10.0 * L] / L)))
    assert literal * L > 10.0 * e.sum()  # measured 13 times the heat there is
    fired, burst = compare(pool)
    assert fired > 1 and 0 < burst * L < e.sum()


def test_a_uniform_block_fires_in_many_places_at_once():
    """No sweep from a corner: 2-hop neighbourhoods fill the block, and no octant of it is spared."""
    n = 20
    points = lattice(n)
    centres = []
    pool = Pool(points, 0.4)
    for count in range(3):
        pool.reset().run(count)
        heat, place = pool.heat, points[pool.get("fires") == 1] - 0.5 * (n - 1)
        assert heat == pytest.approx(n**3 * M_P * 0.4 * L, rel=1e-14)
        assert len(place) >= 20  # measured 32 to 37; a sweep would fire 1
        assert len({tuple(row) for row in place > 0.0}) == 8
        # evenly over the inner 16 to 18 spacings: 4.6 to 5.2, measured 4.9 to 5.3; the mean measured within 0.9
        assert np.all(np.abs(place.std(axis=0) - 5.0) < 0.8) and np.all(np.abs(place.mean(axis=0)) < 2.0)
        centres.append({tuple(row) for row in place})
    assert len(centres[0] & centres[1]) < 10  # other places at another step


def test_equal_regions_fire_in_turns():
    """Clusters in which all regions are the same: one fires, each particle's as often as any other's."""
    k, clusters = 6, 500
    chosen, centres = burst_clusters(k, clusters, n=2, seeds=range(6))
    assert len(chosen) == len(centres) == 6 * clusters
    assert chisquare(np.bincount(centres, minlength=k)).pvalue > 1e-3
    both = [centre in pair for centre, pair in zip(centres, chosen)]
    assert abs(np.mean(both) - 2 / k) < 4.0 * np.sqrt(2 / k * (1 - 2 / k) / len(both))  # two streams: 4 sigma


# --- the choice -------------------------------------------------------------------------------------------------------


def burst_clusters(k, clusters, *, n, seeds, counts=(0,)):
    """Far clusters of k particles that pay for n: the subset each one chose, and its centre, as numbers 0 .. k - 1."""
    offset = random_cloud(k, 2, seed=1)  # closer than the radius to each other
    points = np.repeat(8.0 * lattice(int(np.ceil(np.sqrt(clusters))), 2)[:clusters], k, axis=0)
    points += np.tile(offset, (clusters, 1))
    chosen, centres = [], []
    for seed in seeds:
        pool = Pool(points, (n + 0.5) / k, dim=2, q_crit=1.0, radius=2.0, seed=seed)
        for count in counts:
            pool.reset().run(count)
            rows = (pool.get("phase") == VAPOUR).reshape(clusters, k)
            assert np.all(rows.sum(axis=1) == n)
            chosen += [tuple(np.flatnonzero(row)) for row in rows]
            fires = pool.get("fires").reshape(clusters, k)
            assert np.all(fires.sum(axis=1) == 1)
            centres += list(np.argmax(fires, axis=1))
    return chosen, centres


def test_choice_is_uniform_and_that_of_fisher_yates():
    """All subsets equally often, over seeds, steps and uids; not to be told from the shuffle of the paper."""
    k, n = 6, 2
    chosen, _ = burst_clusters(k, 400, n=n, seeds=range(8), counts=(0, 1))
    random = np.random.default_rng(0)
    shuffled = [tuple(sorted(fisher_yates(random, k, n))) for _ in chosen]
    table = [[sample.count(subset) for subset in combinations(range(k), n)] for sample in (chosen, shuffled)]
    assert len(chosen) == sum(table[0]) == sum(table[1]) == 6400
    assert chisquare(table[0]).pvalue > 1e-3
    assert chi2_contingency(table).pvalue > 1e-3
    assert chisquare([sum(table[0]) / 20] * 14 + [sum(table[0]) * 0.3]).pvalue < 1e-9  # such a bias would be seen


def test_choice_is_uniform_over_ten_thousand_seeds():
    """The keys alone, which are those of the kernel: one region of 33, one seed after the other, 8 to be chosen."""
    k, n, seeds = 33, 8, 10_000
    times = np.zeros(k)
    for seed in range(seeds):
        times[sorted(range(k), key=lambda uid: key(uid, seed, STREAMS[1], 3))[:n]] += 1
    # without replacement: the sum of squares is chi-square of k - 1 degrees once scaled by (k - 1)/(k - n)
    mean = seeds * n / k
    assert chisquare(mean + (times - mean) * np.sqrt((k - 1) / (k - n))).pvalue > 1e-3


# --- by hand ----------------------------------------------------------------------------------------------------------

ROW = 0.5 * lattice(5, 2)[:5]  # in y, half a spacing apart: one region


@pytest.mark.parametrize("k, e, burst, n, e_vapour, e_rest", [
    (5, 1.0, dict(q_crit=3.0), 5, 1.0, None),  # n == k
    (5, 1.3, dict(q_crit=3.0), 5, 1.3, None),  # more than all: it stays in the vapour
    (5, 0.62, dict(q_crit=3.0), 3, 1.0, 0.05),  # eq. 7
    (5, 0.6, dict(q_crit=2.9), 3, 1.0, 0.0),  # nothing left
    (1, 1.2, dict(q_crit=1.0), 1, 1.2, None),  # k == 1
    (1, 1.0, dict(q_crit=0.5), 1, 1.0, None),
    (5, 0.625, dict(q_crit=3.125), 0, None, 0.625),  # at the threshold, not above
    (5, 0.625 + 2**-24, dict(q_crit=3.125), 3, 1.0, None),
    (5, 0.19, dict(q_crit=0.5), 0, None, 0.19),  # above, but it does not pay for one
    (1, 0.99, dict(q_crit=0.5), 0, None, 0.99),
    (5, 0.5, dict(superheat_limit=260.0), 2, 1.0, 0.5 / 3.0),  # e/c_l is 267.7 K
    (5, 0.5, dict(superheat_limit=270.0), 0, None, 0.5),
    (5, 0.19, dict(superheat_limit=90.0), 0, None, 0.19),  # hot enough, but it does not pay for one
])
def test_one_region_by_hand(k, e, burst, n, e_vapour, e_rest):
    pool = Pool(ROW[:k], e, dim=2, radius=2.4, **burst)
    assert compare(pool) == (int(n > 0), n)
    vapour, e = pool.get("phase") == VAPOUR, pool.get("e") / L
    if e_vapour is not None:
        np.testing.assert_allclose(e[vapour], e_vapour, rtol=1e-15)
    if e_rest is not None:
        np.testing.assert_allclose(e[~vapour], e_rest, rtol=1e-14, atol=1e-15)


def test_masses_in_the_order_of_the_keys():
    """Members are taken while they can be paid for; if the first is too heavy already, nothing happens."""
    m, counts = np.array([3.0, 0.5, 0.7, 1.1, 0.4]), range(40)
    taken = set()
    pool = Pool(ROW, 1.5 / m.sum(), dim=2, m=m, radius=2.4, q_crit=1.2)
    for count in counts:
        fired, n = compare(pool.reset(), count)
        chosen = m[pool.get("phase") == VAPOUR]
        assert chosen.sum() <= 1.5 and fired == (n > 0)
        order = sorted(range(5), key=lambda uid: key(uid, 0, STREAMS[1], count))
        assert fired == (order[0] != 0)
        taken.add(n)
    assert taken == {0, 1, 2}


@pytest.mark.parametrize("burst", [dict(superheat_limit=100.0), dict(q_crit=0.0), dict(q_crit=1.0)])
@pytest.mark.parametrize("e_lat", [0.6, 0.9])
def test_latent_heat_that_is_held_drives_no_burst(e_lat, burst):
    """Particles exactly at T_sat, whatever they hold and whatever the threshold: 3 m_p L, none of it sensible."""
    pool = Pool(ROW, 0.6, dim=2, radius=2.4, e_lat=e_lat, **burst)
    assert compare(pool) == (0, 0)
    condition = pool.scheme.effects["dynamic_nucleation"].conditions(pool.scheme.scene())["dynamic_nucleation"]
    assert condition([pool.pa]) is False
    pool.pa.e_lat[:] = 0.0  # the same enthalpy, all of it sensible
    assert condition([pool.pa]) is True
    assert compare(pool)[1] == 3


def test_latent_heat_that_is_held_pays_for_its_own_particle():
    """Five particles that hold .4 L have .62 - .4 of sensible heat each: 1.1 in all, .6 for each that becomes vapour.

    One does; what is left, .5, is shared by the other four, which go on holding theirs and are equally hot.
    """
    pool = Pool(ROW, 0.62, dim=2, radius=2.4, q_crit=1.0, e_lat=0.4)
    assert compare(pool) == (1, 1)
    rest = pool.get("phase") == SUPERHEATED
    np.testing.assert_allclose(pool.get("e_lat")[rest], 0.4 * L, rtol=1e-15)
    np.testing.assert_allclose(pool.get("e")[rest], (0.4 + 0.125) * L, rtol=1e-14)
    superheat = 0.125 * L / (0.6 * WATER.c_l + 0.4 * WATER.c_v)
    np.testing.assert_allclose(pool.get("T")[rest], WATER.T_sat + superheat, rtol=1e-14)
    assert pool.get("e_lat")[~rest] == 0.0 and pool.get("e")[~rest] == L


def test_who_holds_more_is_cheaper_and_who_has_cooled_holds_less():
    """Unequal holdings, one of them partly lost by cooling: all sensible heat is spent, and none is lost."""
    e, e_lat = np.array([0.9, 0.3, 0.7, 1.2, 0.8]), np.array([0.1, 0.5, 0.0, 0.8, 0.2])
    pool = Pool(ROW, e, dim=2, radius=2.4, q_crit=1.0, e_lat=e_lat)
    before = pool.heat
    assert compare(pool) == (1, 3) or pool.get("burst").sum() > 2.5  # 2.5 m_p L of sensible heat
    assert pool.heat == pytest.approx(before, rel=1e-15)


@pytest.mark.parametrize("limit, fires", [(159.5, True), (160.5, False)])
def test_threshold_is_a_superheat_whatever_is_held_and_those_left_are_equally_hot(limit, fires):
    """At 160 K, of particles that hold 0 to 0.9 L; their own heat pays for at least one of them."""
    held = np.linspace(0.0, 0.9, 5)
    pool = Pool(ROW, held + capacity(L * held) * 160.0 / L, dim=2, radius=2.4, superheat_limit=limit, e_lat=held)
    condition = pool.scheme.effects["dynamic_nucleation"].conditions(pool.scheme.scene())["dynamic_nucleation"]
    assert condition([pool.pa]) is fires
    regions, burst = compare(pool, 2)
    assert (regions, burst > 0) == (int(fires), fires)
    rest = pool.get("T")[pool.get("phase") == SUPERHEATED]
    if fires:
        assert len(rest) >= 2 and WATER.T_sat < rest[0] < WATER.T_sat + 159.0
        np.testing.assert_allclose(rest, rest[0], rtol=1e-14)


def test_policy_of_interruptions_decides_whether_there_is_held_heat():
    def kernels(interrupt):
        return [type(term.equation).__name__ for term in boiling(3, interrupt).terms()
                if "dynamic_nucleation." in term.place]

    assert set(kernels("hold")) - set(kernels("convert")) == {"NucleationHeld", "NucleationRelease"}
    assert len(kernels("hold")) == len(kernels("convert")) + 2 == 7


# --- in a run ---------------------------------------------------------------------------------------------------------


def test_stage_runs_only_when_a_region_might_fire():
    """A frozen block in which conduction goes on: the ledger closes, and the columns count what burst."""
    scheme = boiling(3, superheat_limit=200.0)
    pa = fluid_block((0.0,) * 3, (8.0,) * 3, spacing=1.0, dim=3, rho0=WATER.rho_l)
    scheme.setup_properties([pa])
    scheme.set_temperature(pa, WATER.T_sat + np.where(pa.x < 4.0, 199.0, 20.0))
    stepper, integrator = Stepper(scheme, [pa], dt=1.0), scheme.integrator
    stepper.step()
    assert integrator.wall_time["dynamic_nucleation"] == 0.0 and not pa.member.any()

    pa.e[pa.x < 4.0] += WATER.c_l * 2.0
    ledger = Ledger(scheme)
    ledger.begin([pa])
    for step in range(4):
        stepper.step()
        row = ledger.row(step + 2.0, 1.0)
        assert abs(row["energy_residual"]) < 1e-10  # round-off; measured 1e-14
    assert integrator.wall_time["dynamic_nucleation"] > 0.0
    assert row["n_fired"] == pa.fired.sum() >= 3
    assert row["n_burst"] == pa.burst.sum() == row["n_vapour"] >= 20
    assert pa.steps[0] == 5.0


@pytest.mark.parametrize("burst, e, needed", [
    (dict(q_crit=12.0), 0.38, False), (dict(q_crit=12.0), 0.42, True),  # 30 particles: 11.4 and 12.6
    (dict(q_crit=0.5), 0.03, False), (dict(q_crit=0.5), 0.04, True),  # heat for one is needed in any case
    (dict(superheat_limit=200.0), 0.37, False), (dict(superheat_limit=200.0), 0.38, True),  # 198 K, 203 K
    (dict(superheat_limit=15.0), 0.03, False),
])
@pytest.mark.parametrize("held", [0.0, 0.5, 0.9])  # what is held is not counted, but makes hotter
def test_condition_of_the_stage(burst, e, needed, held):
    scheme = boiling(3, **burst)
    pa = fluid_array(lattice(4)[:40], spacing=1.0, dim=3, rho0=WATER.rho_l)
    scheme.setup_properties([pa])
    pa.phase[:] = np.r_[[SUPERHEATED] * 30, [VAPOUR] * 10]
    if "superheat_limit" in burst:
        e = e * capacity(held * L) / WATER.c_l
        needed = needed and 30.0 * e > 1.0
    pa.e[:] = np.r_[[(held + e) * L] * 30, [9.0 * L] * 10]
    pa.e_lat[:30] = held * L
    condition = scheme.effects["dynamic_nucleation"].conditions(scheme.scene())["dynamic_nucleation"]
    assert condition([pa]) is needed


# --- parameters -------------------------------------------------------------------------------------------------------


def setup(dim=3, fluids=("fluid",), **burst):
    scheme = boiling(dim, fluids=fluids, **burst)
    arrays = [fluid_block((0.0,) * 3, (3.0, 3.0, 3.0), spacing=1.0, dim=dim, rho0=WATER.rho_l, name=name)
              for name in fluids]
    scheme.setup_properties(arrays)
    return scheme


@pytest.mark.parametrize("build, message", [
    (lambda: DynamicNucleation(q_crit=10.0, superheat_limit=50.0), "give either q_crit [m_p L] or "),
    (lambda: setup(2), "full region of 13 particles would fire at a mean superheat of 411.8 K, but water at 1 atm "
                       "becomes critical at 274 K: give a superheat_limit [K]"),
    (lambda: setup(3, q_crit=17.0), "33 particles would fire at a mean superheat of 275.8 K"),
    (lambda: setup(3, superheat_limit=274.0), "33 particles would fire at a mean superheat of 274 K"),
    (lambda: setup(3, radius=0.9, superheat_limit=50.0), "1 particles would fire at a mean superheat of 535.3 K"),
    (lambda: setup(3, radius=2.5),
     "dynamic_nucleation.radius must be <= 2.4 spacings (the support of the kernel), got 2.5"),
    (lambda: setup(3, fluids=("water", "oil")), "all liquid must be in one fluid array, got ('water', "),
    (lambda: DynamicNucleation(seed=0.5), "dynamic_nucleation.seed must be a whole number, got 0.5"),
    (lambda: BoilingScheme(["fluid"], [], dim=3, spacing=1.0, dynamic_nucleation=DynamicNucleation()).scene(),
     "effect 'dynamic_nucleation' (DynamicNucleation) needs the effect 'phases'"),
])
def test_refused(build, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        build()


@pytest.mark.parametrize("dim, burst, members, onset", [
    (3, {}, 33, 162.2), (3, dict(q_crit=16.0), 33, 259.6), (3, dict(radius=2.4), 57, 93.9),
    (2, dict(superheat_limit=100.0), 13, 100.0), (2, dict(q_crit=6.0), 13, 247.1),
])
def test_threshold_as_a_superheat(dim, burst, members, onset):
    scheme = setup(dim, **burst)
    effect, scene = scheme.effects["dynamic_nucleation"], scheme.scene()
    assert effect.members(scene) == members
    assert effect.onset(scene)[0] == pytest.approx(onset, abs=0.05)
    assert not list(effect.warnings(scene, 1e-3))


def test_threshold_below_the_price_of_one_particle_warns():
    scheme = setup(2, superheat_limit=30.0)
    (sentence,) = scheme.effects["dynamic_nucleation"].warnings(scheme.scene(), 1e-3)
    assert "superheat of 30 K" in sentence and "13 particles" in sentence and "from 41.2 K on" in sentence


def test_one_threshold_takes_the_place_of_the_other():
    effect = DynamicNucleation(q_crit=5.0).replaced(superheat_limit=50.0)
    assert (effect.q_crit, effect.superheat_limit) == (None, 50.0)
    effect = effect.replaced(q_crit=8.0)
    assert (effect.q_crit, effect.superheat_limit) == (8.0, None)
    assert effect.replaced(radius=1.5).q_crit == 8.0
    with pytest.raises(ValueError, match="not both"):
        effect.replaced(q_crit=8.0, superheat_limit=50.0)

"""Pooled latent heat: cases by hand, random clouds against a slow reference, ties, the order of particles.

One set of effects is compiled, that of ``benchmarks/growth.py``. Cases by hand stand far apart, so that one evaluation
answers all of them.
"""
import math

import numpy as np
import pytest
from harness import Stepper, random_cloud
from pysph.base.nnps import DomainManager
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial.distance import cdist

from pysph_boiling.equations.pooling import PoolingJoin
from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.particles import NO_BUBBLE, fluid_array
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import BubbleLabels, HeatConduction, LatentPooling, PhaseChange

DX, L, REACH, LINK = 2.0**-7, WATER.L, 1.5, 1.4  # spacing [m], latent heat [J/kg], radii [spacings]; a lattice is exact
V, S, LIQUID = int(Phase.VAPOUR), int(Phase.TRANSITION), int(Phase.LIQUID)


class Pools:
    """Particles with the stage "bubbles" of a scheme that pools. Positions in spacings, masses and e in units."""

    def __init__(self, points, phase, e, *, m=1.0, uid=None, dim=2, period=0.0):
        points = np.asarray(points, float)
        self.scheme = BoilingScheme(["fluid"], [], dim=dim, spacing=DX, density=None, heat=HeatConduction(),
                                    phases=PhaseChange(kinetic_radius=REACH), bubbles=BubbleLabels(link_radius=LINK),
                                    pooling=LatentPooling())
        self.pa = fluid_array(DX * points, spacing=DX, dim=dim, rho0=WATER.rho_l)
        if uid is not None:
            self.pa.uid[:] = uid
        self.scheme.setup_properties([self.pa])
        self.pa.m[:] *= m
        self.pa.phase[:] = phase
        self.pa.e[:] = L * np.asarray(e)
        self.pa.T[:] = np.nan
        self.stepper = Stepper(self.scheme, [self.pa], dt=1e-6, domain=DomainManager(
            xmin=0.0, xmax=DX * period, periodic_in_x=True) if period else None)

    def run(self):
        """One pass over the bubbles; returns the new phases and enthalpies [L]."""
        self.stepper.run_stage("bubbles")
        return self.pa.get("phase").copy(), self.pa.get("e") / L

    @property
    def energy(self):
        return float(np.sum(self.pa.m * self.pa.e))


# --- by hand: what surrounds one vapour particle at the origin as (x, y, mass, e) -> e afterwards ---------------------

CASES = {
    "too little is shared": ([(1.0, 0.0, 1, 0.25), (0.0, 1.2, 1, 0.5)], [0.375, 0.375]),
    "just one": ([(0.0, 1.2, 1, 0.5), (1.0, 0.0, 1, 0.5)], [0.0, 1.0]),
    "one, the rest is shared": ([(1.1, 0.0, 1, 0.875), (0.0, 1.0, 1, 0.5), (-1.2, 0.0, 1, 0.125)], [0.25, 1.0, 0.25]),
    "two": ([(1.2, 0.0, 1, 0.875), (0.0, 1.0, 1, 0.875), (-1.1, 0.0, 1, 0.75)], [0.5, 1.0, 1.0]),
    "all, with an excess": ([(1.0, 0.0, 1, 0.875), (0.0, 1.2, 1, 1.375)], [1.125, 1.125]),
    "a heavy one comes first and waits": ([(1.0, 0.0, 3, 0.625), (0.0, 1.2, 1, 0.125)], [0.5, 0.5]),
    "a light one comes first": ([(1.0, 0.0, 1, 0.5), (0.0, 1.2, 4, 0.25)], [1.0, 0.125]),
    "alone": ([(1.0, 0.0, 1, 0.375)], [0.375]),
    "out of reach": ([(1.5 + 1e-9, 0.0, 1, 0.75), (0.0, 1.0, 1, 0.75)], [0.75, 0.75]),
    "just within reach": ([(1.5 - 1e-9, 0.0, 1, 0.75), (0.0, 1.0, 1, 0.75)], [0.5, 1.0]),
    "a tie goes to the smaller uid": ([(1.0, 0.0, 1, 0.5), (-1.0, 0.0, 1, 0.5), (0.0, 1.0, 1, 0.5)], [1.0, 0.25, 0.25]),
}


def test_pools_by_hand():
    points, m, e, want, starts = [], [], [], [], []
    for number, (rows, after) in enumerate(CASES.values()):
        starts.append(len(points))
        points += [(10.0 * number, 0.0, 0.0)] + [(10.0 * number + x, y, 0.0) for x, y, _, _ in rows]
        m += [1.0] + [row[2] for row in rows]
        e += [1.0] + [row[3] for row in rows]
        want += [1.0, *after]
    phase = np.full(len(points), S)
    phase[starts] = V
    pools = Pools(points, phase, e, m=m)
    before = pools.energy
    new, after = pools.run()

    names = np.repeat(list(CASES), np.diff([*starts, len(points)]))
    for name in CASES:
        np.testing.assert_allclose(after[names == name], np.array(want)[names == name], rtol=1e-14, err_msg=name)
    np.testing.assert_array_equal(new, np.where(np.array(want) >= 1.0, V, S))
    assert pools.energy == pytest.approx(before, rel=1e-15)
    np.testing.assert_array_equal(pools.pa.vaporised, (new == V) & (phase == S))
    beyond = np.abs(np.array(points)[:, 0] - 10.0 * np.repeat(range(len(CASES)), np.diff([*starts, len(e)]))) > REACH
    assert beyond.sum() == 1
    np.testing.assert_array_equal(pools.pa.joined == NO_BUBBLE, (phase == V) | beyond)
    served = pools.pa.joined != NO_BUBBLE
    np.testing.assert_allclose(pools.pa.T[served], WATER.T_sat + np.maximum(after[served] - 1.0, 0.0) * L / WATER.c_v,
                               rtol=1e-15)
    assert pools.pa.relabel[0] == 1.0


# --- against a reference ----------------------------------------------------------------------------------------------


def reference(points, phase, e, m, uid):
    """State, enthalpy [L] and joined bubble afterwards, bubble by bubble and candidate by candidate."""
    e, new, joined = np.array(e), np.array(phase), np.full(len(e), NO_BUBBLE)
    distance = cdist(points, points)
    vapour = np.flatnonzero(phase == V)
    _, component = connected_components(csr_array(distance[np.ix_(vapour, vapour)] < LINK), directed=False)
    members, pool = {}, {}
    for c in set(component):
        inside = vapour[component == c]
        members[min(uid[inside])] = inside
    bubble = {k: label for label, inside in members.items() for k in inside}
    for k in np.flatnonzero(phase == S):
        near = [(distance[k, j], bubble[j]) for j in vapour if distance[k, j] < REACH]
        if near:
            joined[k] = min(near)[1]
            pool.setdefault(joined[k], []).append(k)
    for label, candidates in pool.items():
        centroid = np.mean(points[members[label]], axis=0)
        candidates.sort(key=lambda k: (round(float(np.sum((points[k] - centroid) ** 2)), 9), uid[k]))
        left, chosen = math.fsum(m[candidates] * e[candidates]), []
        while candidates and left >= m[candidates[0]]:
            chosen.append(candidates.pop(0))
            left -= m[chosen[-1]]
            e[chosen[-1]], new[chosen[-1]] = 1.0, V
        if candidates:
            e[candidates] = left / m[candidates].sum()
        else:
            e[chosen] += left / m[chosen].sum()
    return new, e, joined


def cloud(n, dim, density, seed):
    """n particles of all states at random, with unlike masses and shuffled uids."""
    random = np.random.default_rng(seed)
    points = random_cloud(n, dim, seed=seed, box=(n / density) ** (1.0 / dim))
    phase = random.choice([V, S, LIQUID, int(Phase.SUPERHEATED)], n, p=[0.25, 0.55, 0.1, 0.1])
    e = np.where(phase == V, 1.0, np.where(phase == LIQUID, -0.1, random.uniform(0.0, 1.0, n)))
    return points, phase, e, random.uniform(0.5, 2.0, n), random.choice(NO_BUBBLE, n, replace=False)


@pytest.mark.parametrize("dim, density", [(2, 0.5), (2, 1.0), (3, 0.4)])
def test_pools_of_a_cloud_equal_the_reference(dim, density):
    points, phase, e, m, uid = cloud(500, dim, density, seed=dim)
    pools = Pools(points, phase, e, m=m, uid=uid, dim=dim)
    before = pools.energy
    new, after = pools.run()

    want, e_want, joined = reference(points, phase, e, m, uid)
    np.testing.assert_array_equal(new, want)
    np.testing.assert_allclose(after, e_want, rtol=1e-12, atol=1e-13)  # a rest is a difference of sums
    assert pools.energy == pytest.approx(before, rel=1e-14)
    np.testing.assert_array_equal(pools.pa.joined, joined)
    turned = (new == V) & (phase == S)
    np.testing.assert_array_equal(pools.pa.vaporised, turned)
    _, index = np.unique(joined[joined != NO_BUBBLE], return_inverse=True)
    times = np.bincount(np.bincount(index, weights=turned[joined != NO_BUBBLE]).astype(int), minlength=3)
    assert np.all(times[:2] >= 3) and times[2:].sum() >= 3  # bubbles that turned none, one and several


def test_result_does_not_depend_on_the_order_of_particles():
    """A disc on a lattice: distances from the centroid occur four or eight times, and differ by round-off."""
    points = np.array([(i, j, 0.0) for i in range(-8, 9) for j in range(-8, 9)])
    r2 = np.sum(points**2, axis=1)
    phase = np.where(r2 <= 20, V, S)
    e, uid = np.where(phase == V, 1.0, 0.55), np.random.default_rng(5).permutation(len(points))
    points = 1.01 * points  # no longer exact
    first = Pools(points, phase, e, uid=uid)
    new, after = first.run()
    chosen = np.flatnonzero((new == V) & (phase == S))
    pool = np.flatnonzero(first.pa.joined != NO_BUBBLE)
    assert len(chosen) == int(0.55 * len(pool)) > 8
    assert set(chosen) == set(sorted(pool, key=lambda k: (r2[k], uid[k]))[:len(chosen)])
    for seed in range(3):
        order = np.random.default_rng(seed).permutation(len(points))
        again = Pools(points[order], phase[order], e[order], uid=uid[order])
        new2, after2 = again.run()
        np.testing.assert_array_equal(new2, new[order])
        np.testing.assert_array_equal(after2, after[order])  # to the last bit


def test_pool_does_not_know_where_a_periodic_domain_ends():
    """A disc of vapour on a lattice, its liquid more on one side than on the other, in the middle and on the border."""
    period = 32.0
    points = np.array([(i + 0.03 * j, j, 0.0) for i in range(-7, 10) for j in range(-7, 8)], float)
    r2 = np.sum(points**2, axis=1)
    phase, uid = np.where(r2 <= 20, V, S), np.random.default_rng(7).permutation(len(points))
    e = np.where(phase == V, 1.0, 0.4)
    whole = Pools(points + (0.5 * period, 0.0, 0.0), phase, e, uid=uid)
    split = Pools(np.stack([points[:, 0] % period, points[:, 1], points[:, 2]], -1), phase, e, uid=uid, period=period)
    assert np.ptp(split.pa.get("x")) > 0.8 * period * DX
    new, after = whole.run()
    assert 5 < np.count_nonzero((new == V) & (phase == S)) < 0.5 * np.count_nonzero(whole.pa.joined != NO_BUBBLE)
    got = split.run()
    np.testing.assert_array_equal(got[0], new)
    np.testing.assert_allclose(got[1], after, rtol=1e-12)


@pytest.mark.parametrize("uid", [(7, 1, 2, 3, 4), (1, 7, 2, 3, 4)])
def test_between_two_bubbles_the_nearer_or_the_smaller_label_wins(uid):
    """Vapour at 0 and 2; liquid half-way between, and a little nearer to one of them."""
    points = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (1.0, 0.5, 0.0), (0.75, -0.5, 0.0), (1.25, 0.75, 0.0)]
    pools = Pools(points, [V, V, S, S, S], [1.0, 1.0, 0.25, 0.25, 0.25], uid=uid)
    pools.run()
    np.testing.assert_array_equal(pools.pa.joined[2:], [1, uid[0], uid[1]])


# --- the second pass, and whole steps ---------------------------------------------------------------------------------


def test_second_pass_leaves_pools_alone():
    """New vapour brings others into reach; their heat waits for the next step."""
    points = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 1.0, 0.0)]
    pools = Pools(points, [V, S, S, S], [1.0, 1.0, 0.75, 0.75])
    new, _ = pools.run()
    np.testing.assert_array_equal(new, [V, V, S, S])
    assert pools.pa.relabel[0] == 1.0
    new, e = pools.run()
    np.testing.assert_array_equal(pools.pa.joined, [NO_BUBBLE, NO_BUBBLE, 0, 0])
    np.testing.assert_array_equal(new, [V, V, S, S])
    np.testing.assert_array_equal(e, [1.0, 1.0, 0.75, 0.75])
    pools.pa.relabel[0] = 0.0
    new, e = pools.run()
    np.testing.assert_array_equal(new, [V, V, V, S])
    np.testing.assert_allclose(e, [1.0, 1.0, 1.0, 0.5], rtol=1e-15)


def test_condensation_in_the_same_pass_does_not_hold_pools_back():
    """Its request for new labels comes after the pass has begun."""
    pools = Pools([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], [V, S], [1.0, 0.25])
    pools.run()
    hooks = pools.scheme.effects["pooling"].hooks(pools.scheme.scene())
    for asked_before, given in ((0.0, 0.25 * L), (1.0, -1.0)):
        pools.pa.relabel[0] = asked_before
        hooks["bubbles.start"]([pools.pa])
        pools.pa.relabel[0] = 1.0
        hooks["bubbles.interface"]([pools.pa])
        np.testing.assert_array_equal(pools.pa.pooled, [-1.0, given])


def test_step_labels_new_vapour_at_once():
    points = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.0, 0.0, 0.0)]
    pools = Pools(points, [V, S, S, S], [1.0, 0.5, 0.5, 0.5], uid=[4, 3, 2, 1])
    pools.stepper.step()
    np.testing.assert_array_equal(pools.pa.phase, [V, S, S, V])
    np.testing.assert_array_equal(pools.pa.bubble, [1, NO_BUBBLE, NO_BUBBLE, 1])
    np.testing.assert_array_equal(pools.pa.bubble_n, [2, 0, 0, 2])
    assert pools.pa.relabel[0] == 0.0 and pools.pa.vaporised.sum() == 1
    pools.stepper.step()
    assert pools.pa.vaporised.sum() == 1  # half a latent heat is left


def test_radius_must_be_positive():
    with pytest.raises(ValueError, match="kinetic radius must be > 0 m, got 0"):
        PoolingJoin("fluid", ["fluid"], radius=0.0)


# --- the surface of the bubble ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("distance", [0.4, 0.5, 0.8, 1.0, 1.4])
def test_heat_arrives_at_the_surface_of_the_bubble(distance):
    """Liquid in transition and hot liquid a spacing apart, with the surface d - 1/2 beyond the former.

    The way of the heat is 1/2 + d instead of 1, if the surface is not before the centre; so is the resistance.
    """
    pools = Pools([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], [S, int(Phase.SUPERHEATED)], [0.2, 0.1])
    pools.pa.heat_dt[0] = 1e-9

    def given(at):
        """Rate of the enthalpy [W/kg] of the hot liquid, with vapour ``at`` spacings from the other, or none."""
        pools.pa.vapour_distance[:] = [DX * at, 0.0]
        pools.stepper.run_stage("heat")
        return pools.pa.ae[1]

    plain, measured = given(0.0), given(distance)
    assert plain < 0.0
    assert plain / measured == pytest.approx(max(1.0, 0.5 + distance), rel=1e-10)  # it changes T by 1e-12
    pools.pa.phase[0] = Phase.SUPERHEATED  # not at saturation: it conducts from its centre
    assert given(distance) == pytest.approx(given(0.0), rel=1e-10)

"""Storage of latent heat in sites against a slow reference. Only the stage "phases" is compiled."""
from types import SimpleNamespace

import numpy as np
import pytest
from harness import Stepper
from pysph.base.nnps import DomainManager

from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.particles import fluid_array, positions, site_array
from pysph_boiling.phases import Phase, temperature
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import HeatConduction, PhaseChange, PresetNucleation, SiteStorage
from pysph_boiling.schemes.modes import effects_in_mode, widen_sites

DX, DT, L = 0.01, 1e-3, WATER.L
RATE = 300.0  # 1/s: 0.3 of the excess in a step
FROZEN = dict(density=None, heat=HeatConduction(), phases=PhaseChange(),
              preset_nucleation=PresetNucleation(attraction=0.0))
VAPOUR, HOT, COLD = int(Phase.VAPOUR), int(Phase.SUPERHEATED), int(Phase.LIQUID)


def frozen_scheme(dim=2, fluids=("fluid",), **storage):
    effects = effects_in_mode("li_xiao", FROZEN)
    effects["storage"] = SiteStorage(**{"rate": RATE, "n_emit": 5, **storage})
    return BoilingScheme(list(fluids), [], dim=dim, spacing=DX, sites=["sites"], **effects)


class Sites:
    """Sites and particles at rest; ``run()`` is the stage of the phases alone. Positions in spacings."""

    def __init__(self, sites, points, *, dim=2, period=0.0, uid=None, **storage):
        self.scheme = frozen_scheme(dim, **storage)
        self.pa = fluid_array(DX * np.asarray(points, float), spacing=DX, dim=dim, rho0=WATER.rho_l)
        self.sites = site_array(DX * np.asarray(sites, float), reach=DX, spacing=DX)
        if uid is not None:
            self.pa.uid[:] = uid
        arrays = [self.pa, self.sites]
        widen_sites(self.scheme, arrays)
        self.scheme.setup_properties(arrays)
        domain = DomainManager(xmin=0.0, xmax=DX * period, periodic_in_x=True) if period else None
        self.period = DX * period
        self.stepper = Stepper(self.scheme, arrays, dt=DT, domain=domain)
        self.stepper.step()  # tells the evaluators the time step

    def set(self, e, phase=None, m=1.0, Q_s=0.0):
        """Enthalpy in L [-], phase (by the enthalpy if not given), mass in m_p, stored heat in m_p L."""
        pa, mass = self.pa, WATER.rho_l * DX**self.scheme.dim
        n, sites = pa.get_number_of_particles(True), self.sites.get_number_of_particles(True)
        put(pa, "e", np.broadcast_to(L * np.asarray(e, float), n))
        put(pa, "m", np.broadcast_to(mass * np.asarray(m, float), n))
        put(pa, "phase", np.where(np.broadcast_to(e, n) >= 0.0, HOT, COLD) if phase is None else phase)
        for name in ("emitted", "q_sites"):
            put(pa, name, np.zeros(n))
        put(self.sites, "Q_s", np.broadcast_to(mass * L * np.asarray(Q_s, float), sites))
        return self

    def run(self):
        self.stepper.run_stage("phases")
        return self.state()

    def state(self):
        """Copies of all that matters, of real particles and sites."""
        names = ("x", "y", "z", "uid", "m", "e", "T", "phase", "site", "paid", "q_sites", "emitted")
        fluid = {name: self.pa.get(name).copy() for name in names}
        site = {name: self.sites.get(name).copy() for name in ("Q_s", "occupied", "emits", "chosen", "cost")}
        return SimpleNamespace(**fluid, **site, place=positions(self.sites))

    def reference(self, before):
        """The same in plain Python: one particle, one site at a time."""
        scene, storage = self.scheme.scene(), self.scheme.effects["storage"]
        after, radius, reach = SimpleNamespace(**{k: v.copy() for k, v in vars(before).items()}), 1.6 * DX, \
            storage.reach(scene)
        x = np.stack([before.x, before.y, before.z], -1)
        apart = x[:, None] - before.place
        if self.period:
            apart[..., 0] -= self.period * np.round(apart[..., 0] / self.period)
        r2 = np.sum(apart**2, axis=-1)
        after.emits[:], after.occupied[:], after.site[:], after.paid[:] = 0, 0, -1, 0.0
        for i in range(len(x)):
            if before.phase[i] == VAPOUR:
                after.occupied |= r2[i] < radius**2
                continue
            after.phase[i] = HOT if before.e[i] >= 0.0 else COLD
            nearest = min(range(len(before.Q_s)), key=lambda s: (r2[i, s], s))
            if r2[i, nearest] < reach**2:
                after.site[i] = nearest
        chosen = []
        for s in range(len(before.Q_s)):
            own = sorted((i for i in range(len(x)) if after.site[i] == s), key=lambda i: (r2[i, s], before.uid[i]))
            chosen.append(own[:storage.n_emit])
            after.chosen[s] = len(chosen[s])
            cost = sum(before.m[i] * (L - before.e[i]) for i in chosen[s])
            if not after.occupied[s] and before.Q_s[s] < cost:
                for i in own:
                    if r2[i, s] < radius**2 and before.e[i] > 0.0:
                        share = min(1.0, storage.rate * DT) * before.e[i]
                        after.e[i] -= share
                        after.paid[i] = before.m[i] * share
                        after.q_sites[i] += after.paid[i]
                        after.Q_s[s] += after.paid[i]
        for s, members in enumerate(chosen):
            after.cost[s] = sum(before.m[i] * (L - after.e[i]) for i in members)
            if not after.occupied[s] and len(members) == storage.n_emit and after.Q_s[s] >= after.cost[s]:
                after.emits[s] = 1
                after.Q_s[s] -= after.cost[s]
                for i in members:
                    after.q_sites[i] -= before.m[i] * (L - after.e[i])
                    after.e[i], after.phase[i] = L, VAPOUR
                    after.emitted[i] += 1
        after.T = temperature(after.e, after.phase, WATER)
        return after


def put(pa, name, values):
    """Write a property of the real particles; a search copies it to their images."""
    pa.get(name)[:] = values


def assert_same(got, want):
    mass = WATER.rho_l * DX**2
    for name in ("phase", "site", "emitted", "occupied", "emits", "chosen"):
        np.testing.assert_array_equal(getattr(got, name), getattr(want, name), err_msg=name)
    for name in ("e", "T"):  # the same operations on the same numbers
        np.testing.assert_allclose(getattr(got, name), getattr(want, name), rtol=4e-16, atol=1e-16 * L, err_msg=name)
    for name in ("paid", "q_sites", "Q_s", "cost"):  # sums of up to 60 numbers in another order
        np.testing.assert_allclose(getattr(got, name), getattr(want, name), rtol=1e-13, atol=1e-13 * mass * L,
                                   err_msg=name)


def energy(state):
    return float(np.sum(state.m * state.e)) + float(np.sum(state.Q_s))


# --- kernels ----------------------------------------------------------------------------------------------------------


def cloud(dim, seed):
    """Sites 7 spacings apart in a cloud of particles in any order: as dense as a liquid or, every other time, thin."""
    random = np.random.default_rng(seed)
    sites = np.zeros((4 if dim == 2 else 8, 3))
    sites[:, :dim] = 3.5 + 7.0 * np.stack(np.unravel_index(np.arange(len(sites)), (2,) * dim), -1)
    sites += 0.3 * random.normal(size=sites.shape) * (np.arange(3) < dim)
    points = np.zeros((14**dim // (4 if seed % 2 else 1) // (2 if dim == 3 else 1), 3))
    points[:, :dim] = random.uniform(0.0, 14.0, (len(points), dim))
    return sites, points, random


@pytest.mark.parametrize("dim, period", [(2, 0.0), (2, 14.0), (3, 0.0)], ids=["2d", "periodic", "3d"])
def test_stage_against_reference(dim, period):
    """Random states in all steps of a few charges: every site absorbs, is occupied, full, cannot pay, and emits."""
    seen = dict.fromkeys(("absorbed", "occupied", "full", "cannot pay", "emitted"), 0)
    for seed in (0, 5, 7, 2):
        sites, points, random = cloud(dim, seed)
        sites[:, 0] -= 3.0 if period else 0.0  # nearer to the border than they reach
        n = len(points)
        case = Sites(sites, points, dim=dim, period=period, uid=random.choice(2**32 - 2, n, replace=False), n_emit=6)
        phase = np.where(random.uniform(size=n) < 0.003, VAPOUR, COLD)
        e = np.where(phase == VAPOUR, 1.0 + random.uniform(-0.1, 0.3, n), random.uniform(-0.05, 0.15, n))
        case.set(e, phase, m=random.uniform(0.5, 2.0, n), Q_s=random.uniform(0.0, 14.0, len(sites)))
        for _ in range(6):
            before = case.state()
            got, want = case.run(), case.reference(before)
            assert_same(got, want)
            assert energy(got) == pytest.approx(energy(before), rel=1e-14)
            absorbed = np.array([np.any(got.paid[got.site == s] > 0.0) for s in range(len(sites))])
            free = got.occupied == 0
            full = free & (before.Q_s >= want.cost) & (got.emits == 0) & ~absorbed
            for name, count in (("absorbed", absorbed), ("occupied", got.occupied), ("full", full),
                                ("cannot pay", free & (got.emits == 0)), ("emitted", got.emits)):
                seen[name] += int(np.sum(count))
            if period:
                gap = np.where(got.site >= 0, np.abs(got.x - got.place[got.site, 0]), 0.0)
                made = (got.phase == VAPOUR) & (before.phase != VAPOUR)
                for name, who in (("paid across", got.paid > 0.0), ("emitted across", made)):
                    seen[name] = seen.get(name, 0) + np.count_nonzero(who & (gap > 0.5 * DX * period))
    assert min(seen.values()) >= 1, seen


RING = [(x, y, 0.0) for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1))]  # four at one distance from the origin
FAR = [(9.0 + i, 9.0, 0.0) for i in range(2)]


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 1, 0, 2), (2, 3, 1, 0)])
def test_of_particles_at_one_distance_the_smaller_uids_are_chosen(order):
    uid = np.array([70, 2, 4_000_000_000, 50])
    points = [RING[k] for k in order]
    case = Sites([(0, 0, 0)], points, uid=uid[list(order)], n_emit=2).set(0.0, Q_s=2.0)
    got = case.run()
    assert set(got.uid[got.phase == VAPOUR]) == {2, 50}
    assert got.Q_s[0] == 0.0


def test_of_sites_at_one_distance_that_of_the_smaller_number_is_paid():
    """One particle half way between sites 1 and 2, which are in memory as 2, 1 for half of the cases."""
    for swap in (False, True):
        sites = [(-20, 0, 0), (1.5, 0, 0), (-1.5, 0, 0)]
        if swap:
            sites = [sites[0], sites[2], sites[1]]
        case = Sites(sites, [(0, 0, 0), (1.6, 0.5, 0), (-1.6, 0.5, 0)], n_emit=1).set(0.1)
        got = case.run()
        assert got.site[0] == 1
        assert sorted(got.site) == [1, 1, 2]
        np.testing.assert_allclose(got.Q_s / (got.m[0] * L), [0.0, 0.06, 0.03], rtol=1e-14)


@pytest.mark.parametrize("gap, occupied", [(1.6 - 1e-9, True), (1.6 + 1e-9, False)])
def test_an_occupied_site_neither_absorbs_nor_emits(gap, occupied):
    case = Sites([(0, 0, 0)], [*RING, (0.0, gap, 0.0)], n_emit=3)
    for Q_s, what in ((0.0, "absorbs"), (3.1, "emits")):
        got = case.set([0.01] * 4 + [1.0], [HOT] * 4 + [VAPOUR], Q_s=Q_s).run()
        assert got.occupied[0] == occupied
        assert np.any(got.paid > 0.0) == (not occupied and what == "absorbs")
        assert np.count_nonzero(got.phase == VAPOUR) == (1 if occupied or what == "absorbs" else 4)


@pytest.mark.parametrize("share, emits", [(1.0 - 1e-12, False), (1.0, True), (1.0 + 1e-12, True)])
def test_a_site_emits_if_it_can_pay_in_full_and_keeps_the_rest(share, emits):
    """Cost of the three nearest of five, masses unequal, two of them below saturation: nobody pays into the site."""
    e, m = np.array([-0.02, 0.0, -0.01, 0.0, 0.0]), np.array([0.5, 2.0, 1.25, 1.0, 1.0])
    case = Sites([(0, 0, 0)], [(0.5, 0, 0), (0, 0.6, 0), (-0.7, 0, 0), (0, 1.9, 0), (2, 0, 0)], n_emit=3)
    cost = float(np.sum((m * (1.0 - e))[:3]))
    got = case.set(e, m=m, Q_s=share * cost).run()
    assert list(got.phase == VAPOUR) == [emits] * 3 + [False] * 2
    assert list(got.emitted) == [emits] * 3 + [0] * 2
    scale = WATER.rho_l * DX**2 * L
    assert got.Q_s[0] / scale == pytest.approx(share * cost - emits * cost, abs=1e-15)
    if emits:
        assert np.all(got.e[:3] == L) and np.all(got.T[:3] == WATER.T_sat)


def test_a_full_site_that_lacks_particles_waits_and_absorbs_no_more():
    case = Sites([(0, 0, 0)], [*RING, *FAR], n_emit=5)
    for Q_s, absorbs in ((3.5, True), (4.0, False), (9.0, False)):
        got = case.set(0.01, Q_s=Q_s).run()
        assert got.chosen[0] == 4 and not np.any(got.phase == VAPOUR)
        assert np.any(got.paid > 0.0) == absorbs


@pytest.mark.parametrize("rate, share", [(0.0, 0.0), (300.0, 0.3), (1.0 / DT, 1.0), (9.0 / DT, 1.0)])
def test_rate_of_absorption_and_radius(rate, share):
    points = [(0.0, 0.4, 0), (1.6 - 1e-9, 0, 0), (1.6 + 1e-9, 0, 0), (-0.5, 0, 0)]
    e = np.array([0.02, 0.04, 0.08, -0.01])
    case = Sites([(0, 0, 0)], points, rate=rate, n_emit=4).set(e)
    got = case.run()
    np.testing.assert_allclose(got.e / L, e * [1.0 - share, 1.0 - share, 1.0, 1.0], rtol=1e-15)
    assert got.Q_s[0] / (got.m[0] * L) == pytest.approx(0.06 * share, rel=1e-14)
    np.testing.assert_allclose(got.T, WATER.T_sat + got.e / WATER.c_l, rtol=4e-16)


def test_default_rate_is_that_of_conduction():
    scheme = frozen_scheme(rate=None)
    assert scheme.effects["storage"].rate_in(scheme.scene()) == pytest.approx(
        4.0 * WATER.k_l / (WATER.rho_l * WATER.c_l * DX**2))


# --- what is refused --------------------------------------------------------------------------------------------------


def arrays_for(scheme, sites=((0.0, 0.0, 0.0),)):
    arrays = [fluid_array([(0, 0, 0)], spacing=DX, dim=2, rho0=WATER.rho_l, name=name) for name in scheme.fluids]
    return [*arrays, site_array(DX * np.array(sites), reach=1.7 * DX, spacing=DX)]


def test_storage_refuses_what_it_cannot_serve():
    scheme = frozen_scheme()
    with pytest.raises(ValueError, match=r"too small a reach to find 5 particles: make the array with site_array\("):
        scheme.setup_properties(arrays_for(scheme))
    scheme = frozen_scheme(n_emit=7)
    arrays = arrays_for(scheme, [(-1.2, 0, 0), (0, 0, 0), (1.2, 0, 0)])  # the middle one has 2 x 3 places to itself
    widen_sites(scheme, arrays)
    with pytest.raises(ValueError, match="storage.n_emit must be <= 6 for sites this close to each other, got 7"):
        scheme.setup_properties(arrays)
    scheme = frozen_scheme(fluids=("fluid", "more"))
    with pytest.raises(ValueError, match="one fluid array"):
        scheme.setup_properties(arrays_for(scheme))
    scheme.set_effects(phases=PhaseChange())
    with pytest.raises(ValueError, match="liquid must not store any"):
        scheme.setup_properties(arrays_for(scheme))
    with pytest.raises(ValueError, match="whole number, got 2.5"):
        SiteStorage(n_emit=2.5)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("n_emit", [1, 7, 20, 60])
def test_a_lone_site_reaches_far_enough(dim, n_emit):
    scheme = frozen_scheme(dim, n_emit=n_emit)
    assert scheme.effects["storage"].room(scheme.scene(), np.zeros((1, 3)))[0] >= n_emit

"""The state machine: every row of ``phases.EDGES`` on compiled particles, in both policies of an interruption.

Cases stand far apart, each with a nucleation site and a vapour particle of its own that are put near it or out of
reach. So one evaluation answers all of them.
"""
from itertools import product

import numpy as np
import pytest
from harness import Stepper
from sets import SETS, scheme

from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.particles import fluid_array, site_array
from pysph_boiling.phases import EDGES, Phase, temperature

DX, N, ROW = 0.01, 192, 16  # spacing [m], cases, cases side by side
L, T_SAT = WATER.L, WATER.T_sat
PITCH, NEAR, FAR = 10.0 * DX, 1.0 * DX, 5.0 * DX
SETTING = {"hold": "states_hold", "convert": "states"}

OWN = [edge for edge in EDGES if edge.by == "phase_change"]
RANGES = {"negative": (-np.inf, 0.0), "stored": (0.0, L), "full": (L, np.inf), "not negative": (0.0, np.inf)}
BELOW = {bound: np.nextafter(bound, -np.inf) for bound in (0.0, L)}
TABLE_E = (-L, BELOW[0.0], 0.0, 0.4 * L, BELOW[L], L, 1.7 * L)


def within(e, name):
    low, high = RANGES[name]
    return low <= e < high


def expected(phase, e, kinetic):
    """New state by the table; at most one row may apply."""
    targets = [edge.target for edge in OWN if edge.source == phase and within(e, edge.enthalpy)
               and edge.kinetic in (None, kinetic)]
    assert len(targets) <= 1
    return targets[0] if targets else phase


class Cases:
    """N particles of which each has a site and a vapour particle to itself, and the compiled scheme."""

    def __init__(self, interrupt, *, dim=2, **changes):
        self.hold = interrupt == "hold"
        points = np.zeros((N, 3))
        points[:, 0] = PITCH * (np.arange(N) % ROW)  # in rows: a device's search takes memory by the square of a length
        points[:, 1] = -2.0 * PITCH * (np.arange(N) // ROW)
        kwargs = dict(spacing=DX, dim=dim, rho0=WATER.rho_l)
        self.pa = fluid_array(np.concatenate([points, points]), **kwargs)  # the cases, then their vapour
        self.sites = site_array(points, reach=2.4 * DX, spacing=DX)
        wall = fluid_array(points[:1] + [0.0, 20.0 * DX, 0.0], name="wall", **kwargs)
        arrays, setting = [self.pa, wall, self.sites], scheme(SETTING[interrupt], dim=dim, spacing=DX, changes=changes)
        setting.setup_properties(arrays)
        self.stepper = Stepper(setting, arrays, dt=1e-3)
        self.stepper.tools = []  # no guard: states by hand go below 0 K and beyond the critical point

    def set(self, phase, e, near="", e_lat=0.0):
        """Set the first cases, the rest is cold; ``near`` names what stands near ("site", "vapour", both, neither)."""
        phase, e, near, e_lat = np.broadcast_arrays(phase, e, near, e_lat)
        self.n = len(phase)
        self.place(self.sites, np.where(np.char.find(near, "site") >= 0, NEAR, FAR))
        self.place(self.pa, np.where(np.char.find(near, "vapour") >= 0, NEAR, FAR), first=N)
        self.pa.phase[:] = np.r_[phase, [Phase.LIQUID] * (N - self.n), [Phase.VAPOUR] * N]
        self.pa.e[:] = np.r_[e, [-L] * (N - self.n), [L] * N]
        self.pa.T[:] = np.nan
        self.pa.vaporised[:] = 0
        self.pa.interrupted[:] = 0
        if self.hold:
            self.pa.e_lat[:] = 0.0
            self.pa.e_lat[:self.n] = e_lat

    def place(self, pa, offset, first=0):
        """Put one particle per case at ``offset`` from it: a distance [m] (n,) along y, or vectors [m] (n, 3)."""
        if offset.ndim == 1:
            offset = np.stack([0 * offset, offset, 0 * offset], -1)
        for k, name in enumerate("xyz"):
            pa.get(name)[first:first + len(offset)] = self.pa.get(name)[:len(offset)] + offset[:, k]

    def get(self, *names):
        return [self.pa.get(name)[:self.n].copy() for name in names]

    def run(self):
        """The stage of the phases; returns the new states."""
        self.stepper.run_stage("phases")
        return self.get("phase")[0]

    def step(self):
        """A whole step of the scheme, on a new neighbour search (a scene at rest searches only once)."""
        self.stepper.solver.integrator.searched = False
        self.stepper.step()


@pytest.fixture(scope="module", params=sorted(SETTING))
def cases(request):
    return Cases(request.param)


# --- edges ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("edge", OWN, ids=lambda edge: f"{edge.source.name}-{edge.target.name}")
def test_edge_is_taken_on_its_condition_and_not_beside_it(cases, edge):
    low, high = RANGES[edge.enthalpy]
    takes = [max(low, -L), BELOW.get(high, 3.0 * L)]
    beside = ([BELOW[low]] if low > -np.inf else []) + ([high] if high < np.inf else [])
    near = {True: ["site", "vapour", "site vapour"], False: [""], None: ["", "site"]}
    rows = [(e, name, True) for e in takes for name in near[edge.kinetic]]
    rows += [(e, name, False) for e in beside for name in near[edge.kinetic]]
    if edge.kinetic is not None:
        rows += [(e, name, False) for e in takes for name in near[not edge.kinetic]]
    e, name, taken = zip(*rows)
    cases.set([edge.source] * len(rows), e, name)
    np.testing.assert_array_equal(cases.run() == edge.target, taken)


def test_every_state_enthalpy_and_neighbourhood_follows_the_table(cases):
    rows = list(product(Phase, TABLE_E, ("", "site", "vapour"), (0.0, 0.3 * L)))
    phase, e, near, e_lat = (np.array(column) for column in zip(*rows))
    e_lat = e_lat * (phase == Phase.SUPERHEATED) * cases.hold  # no other state holds heat back
    cases.set(phase, e, near, e_lat)
    new = cases.run()

    np.testing.assert_array_equal(new, [expected(p, energy, name != "") for p, energy, name, _ in rows])
    moved = {(Phase(a), Phase(b)) for a, b in zip(phase, new) if a != b}
    assert moved == {(edge.source, edge.target) for edge in OWN}  # each edge seen, and no other transition
    np.testing.assert_array_equal(cases.get("e")[0], e)  # to the last bit: a change of phase moves no energy

    T, vaporised, interrupted = cases.get("T", "vaporised", "interrupted")
    lost = (new == Phase.SUPERHEATED) & (phase == Phase.TRANSITION)
    np.testing.assert_array_equal(vaporised, (new == Phase.VAPOUR) & (phase != Phase.VAPOUR))
    np.testing.assert_array_equal(interrupted, lost)
    if cases.hold:
        e_lat = np.where(lost, e, np.where(new == Phase.SUPERHEATED, e_lat, 0.0))
        np.testing.assert_array_equal(cases.get("e_lat")[0], e_lat)
    np.testing.assert_allclose(T, temperature(e, new, WATER, e_lat), rtol=4e-16)  # 2 ulp: the same three operations


def test_all_edges_see_the_same_old_state(cases):
    """A row of hot liquid beside vapour: each particle's site is a neighbour that changes in the same step.

    The front must advance by one particle every other step (latent stage, vapour), in either order of the particles.
    An update that saw new states would sweep along the row at once, in one of the two orders.
    """
    for order in (1, -1):
        cases.set([Phase.VAPOUR] + [Phase.LIQUID] * 7, 1.2 * L)
        cases.place(cases.pa, np.full(N, FAR), first=N)
        x = cases.pa.x[:8].copy()
        cases.pa.x[:8] = DX * np.arange(8.0)[::order]
        row, S = np.argsort(cases.pa.x[:8]), [Phase.SUPERHEATED]
        if order == -1:
            cases.pa.phase[:8] = cases.pa.phase[:8][::-1].copy()
        for front in range(1, 6):
            vapour = [Phase.VAPOUR] * front
            assert list(cases.run()[row]) == vapour + [Phase.TRANSITION] + S * (7 - front)
            assert list(cases.run()[row]) == vapour + [Phase.VAPOUR] + S * (7 - front)
        cases.pa.x[:8] = x


# --- temperature ------------------------------------------------------------------------------------------------------


def test_temperature_and_conductivity_of_random_states(cases):
    random = np.random.default_rng(1)
    phase, e, e_lat = random.integers(0, 4, N), random.uniform(-L, 2.0 * L, N), random.uniform(0.0, L, N)
    e_lat = e_lat * (phase == Phase.SUPERHEATED) * cases.hold  # no other state holds heat back
    cases.set(phase, e, e_lat=e_lat)
    cases.stepper.run_stage("heat")
    T, k, after = cases.get("T", "k", "e")
    np.testing.assert_allclose(T, temperature(e, phase, WATER, e_lat), rtol=4e-16)  # 2 ulp: the same operations
    pure = (e_lat == 0.0) | (e <= 0.0)
    np.testing.assert_array_equal(k[pure], np.where(phase == Phase.VAPOUR, WATER.k_v, WATER.k_l)[pure])
    x = np.minimum(e, e_lat)[~pure] / L  # of a mixture, the part that is vapour; its diffusivity is that of liquid
    capacity = (1.0 - x) * WATER.c_l + x * WATER.c_v
    np.testing.assert_allclose(k[~pure] / capacity, WATER.k_l / WATER.c_l, rtol=1e-14)
    assert np.ptp(x) > 0.8 if cases.hold else len(x) == 0
    np.testing.assert_array_equal(after, e)  # nothing to exchange with


def test_temperature_is_that_of_the_enthalpy_after_a_heat_step(cases):
    """Cold liquid beside vapour takes up heat. Without hot liquid only the heat stage sets its temperature."""
    e = np.linspace(-L, -0.9 * L, N)
    cases.set(Phase.LIQUID, e, "vapour")
    cases.pa.heat_dt[0] = 1e-3
    cases.stepper.run_stage("heat")
    T, after = cases.get("T", "e")
    assert np.all(after > e + 1e-9 * L) and np.all(after < 0.0)
    np.testing.assert_allclose(T, temperature(after, Phase.LIQUID, WATER), rtol=4e-16)


def test_becoming_vapour_heats_nothing(cases):
    """Liquid that holds any part of its latent heat, so hot that it becomes vapour as soon as a site is near."""
    x, superheat = np.meshgrid(np.linspace(0.0, 1.0, 12) * cases.hold, np.linspace(10.0, 1050.0, 16))
    e = L * x + ((1.0 - x) * WATER.c_l + x * WATER.c_v) * superheat
    x, superheat, e = (values[e >= L] for values in (x, superheat, e))
    cases.set(Phase.SUPERHEATED, e, "site", L * x)
    cases.stepper.run_stage("heat")
    np.testing.assert_allclose(cases.get("T")[0], T_SAT + superheat, rtol=1e-13)
    for state in (Phase.TRANSITION, Phase.VAPOUR):
        np.testing.assert_array_equal(cases.run(), state)
        np.testing.assert_allclose(cases.get("T")[0], T_SAT + (e - L) / WATER.c_v, rtol=1e-13)
        assert np.all(cases.get("T")[0] <= T_SAT + superheat + 1e-9)  # K, round-off


# --- interruption and resumption --------------------------------------------------------------------------------------


def test_interruption_and_resumption_at_a_site(cases):
    e = 0.4 * L
    cases.set([Phase.TRANSITION], e, "site")

    def state(change=0.0, site=None):
        """Phase, excess temperature [K] and counts after a step."""
        if site is not None:
            cases.place(cases.sites, np.array([site]))
        cases.pa.e[0] += change
        before = cases.pa.e[0]
        cases.step()
        phase, T, e, vaporised, interrupted = (values[0] for values in cases.get(
            "phase", "T", "e", "vaporised", "interrupted"))
        assert e == before
        return phase, T - T_SAT, vaporised, interrupted

    def close(dT):  # T - T_sat of a T of some 600 K
        return pytest.approx(dT, abs=1e-12)

    held = (lambda: cases.pa.e_lat[0]) if cases.hold else (lambda: 0.0)
    assert state() == (Phase.TRANSITION, 0.0, 0, 0)
    jump = 0.0 if cases.hold else e / WATER.c_l  # 214 K
    for _ in range(2):
        assert state(site=FAR) == (Phase.SUPERHEATED, close(jump), 0, 1)
        assert held() == (e if cases.hold else 0.0)
    dT = 0.1 * L / (0.6 * WATER.c_l + 0.4 * WATER.c_v if cases.hold else WATER.c_l)  # 0.4 of what holds it is vapour
    assert state(+0.1 * L) == (Phase.SUPERHEATED, close(jump + dT), 0, 1)
    cooler = state(-0.2 * L)  # below what was stored
    assert cooler == (Phase.SUPERHEATED, close(0.0 if cases.hold else jump - dT), 0, 1)
    assert held() == (e if cases.hold else 0.0)
    assert state(site=NEAR) == (Phase.TRANSITION, 0.0, 0, 1)
    assert held() == 0.0
    assert state(site=FAR) == (Phase.SUPERHEATED, close(0.0 if cases.hold else jump - dT), 0, 2)
    assert state(-L) == (Phase.LIQUID, close(-0.7 * L / WATER.c_l), 0, 2)
    assert held() == 0.0
    assert state(+0.7 * L, site=NEAR)[0] == Phase.TRANSITION
    phase, excess, vaporised, interrupted = state(+L)
    assert (phase, vaporised, interrupted) == (Phase.VAPOUR, 1, 2)
    assert excess == close((cases.pa.e[0] - L) / WATER.c_v)


# --- kinetic condition ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("radii", [None, (0.9, 1.1)], ids=["default", "other"])
@pytest.mark.parametrize("near", ["site", "vapour"])
def test_reach_of_sites_and_of_vapour(near, radii, dim):
    """Liquid at saturation enters the latent stage within the radius, and superheats outside of it."""
    phases, nucleation = SETS["states_hold"]["phases"], SETS["states_hold"]["preset_nucleation"]
    assert (nucleation.radius, phases.kinetic_radius) == (1.6, 1.5)  # spacings
    if radii:
        nucleation, phases = nucleation.replaced(radius=radii[0]), phases.replaced(kinetic_radius=radii[1])
    cases = Cases("hold", dim=dim, preset_nucleation=nucleation, phases=phases)
    radius = DX * (nucleation.radius if near == "site" else phases.kinetic_radius)
    cases.set([Phase.LIQUID] * N, 0.0)
    direction = np.random.default_rng(3).normal(size=(N, 3)) * [1.0, 1.0, dim - 2.0]
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    distance = np.linspace(0.1, 2.3, N) * DX
    distance[:2] = radius * np.array([1.0 - 1e-9, 1.0 + 1e-9])
    pa, first = (cases.sites, 0) if near == "site" else (cases.pa, N)
    cases.place(pa, direction * distance[:, None], first)
    want = np.where(distance < radius, Phase.TRANSITION, Phase.SUPERHEATED)
    np.testing.assert_array_equal(cases.run(), want)


@pytest.mark.parametrize("dim", [2, 3])
def test_only_the_first_layer_round_vapour_boils(dim):
    """A disordered lattice with a bubble of vapour, against all triples: liquid, its nearest vapour, what is between.

    On the lattice itself that is the layer of the next neighbours, though diagonal ones are in reach.
    """
    side = {2: 13, 3: 5}[dim]
    lattice = np.stack(np.meshgrid(*[np.arange(side) - side // 2] * dim, indexing="ij"), -1).reshape(-1, dim)
    vapour, n = np.linalg.norm(lattice, axis=1) < {2: 2.3, 3: 1.2}[dim], len(lattice)
    for disorder in (0.0, 0.3):
        cases, points = Cases("hold", dim=dim), np.zeros((n, 3))
        points[:, :dim] = lattice + disorder * np.random.default_rng(dim).uniform(-1.0, 1.0, lattice.shape)
        cases.set(np.where(vapour, Phase.VAPOUR, Phase.LIQUID), 0.1 * L)
        for name, column in zip("xyz", (DX * (points + [50.0, 60.0, 0.0])).T):  # far from the sites
            cases.pa.get(name)[:n] = column
        r = np.linalg.norm(points[:, None] - points[None, :], axis=-1)
        want, distance = np.zeros(n, bool), np.zeros(n)
        for i in np.flatnonzero(~vapour):
            v = np.flatnonzero(vapour)[np.argmin(r[i, vapour])]
            if r[i, v] < 1.5:
                between = ~vapour & (np.maximum(r[i], r[v]) < 0.98**0.5 * r[i, v])
                want[i], distance[i] = not between.any(), r[i, v]
        np.testing.assert_array_equal(cases.run() == Phase.TRANSITION, want)
        np.testing.assert_allclose(cases.pa.vapour_distance[:n], DX * distance, rtol=1e-12)
        if disorder == 0.0:
            near = np.where(vapour[:, None], r, 9.0).min(0)
            np.testing.assert_array_equal(want, ~vapour & (near < 1.1))
            assert np.any(~vapour & ~want & (near < 1.5))


def test_without_vapour_as_site_there_is_no_such_term():
    def kinetic(name):
        terms = scheme(name, dim=2, spacing=DX).terms()
        return [type(term.equation).__name__ for term in terms if "Condition" in type(term.equation).__name__]

    assert kinetic("paper") == ["NucleationSiteCondition"]
    assert kinetic("states") == ["PhaseVapourCondition", "NucleationSiteCondition"]

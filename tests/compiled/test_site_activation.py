"""Sites with an activation superheat: every change of their state, what it does to the liquid, and a short boil."""
from itertools import product

import numpy as np
import pytest
from harness import Stepper, host_only
from pysph.solver.tools import Tool
from sets import scheme

from pysph_boiling.evaluation.problems.from_scene import from_scene
from pysph_boiling.examples.steady_boiling import SteadyBoiling
from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.particles import fluid_array, site_array
from pysph_boiling.phases import Phase, enthalpy, temperature
from pysph_boiling.schemes.effects import PresetNucleation

DX, N, ROW = 0.01, 1024, 32  # spacing [m], sites, sites side by side
NEAR, RIM, FAR = 1.0 * DX, 2.0 * DX, 3.5 * DX  # within the radius of a site, between it and the reach, out of reach
NEEDED = 12.0  # activation superheat [K]
DORMANT, ACTIVE = 0, 1  # and 1 + n with n particles of vapour
CROWD = 3  # particles of vapour that are within the radius of a site in addition to one other
NONE = -1  # in place of a phase: there is no particle


class Cases:
    """N sites far apart, each with a particle within its radius, one over it, one beside it and a crowd near it."""

    def __init__(self, dim, **options):
        points = np.zeros((N, 3))
        points[:, 0], points[:, 1] = 0.1 * (np.arange(N) % ROW), -0.2 * (np.arange(N) // ROW)
        kwargs = dict(spacing=DX, dim=dim, rho0=WATER.rho_l)
        self.points, self.up = points, "xyz"[dim - 1]
        self.pa = fluid_array(np.tile(points, (3 + CROWD, 1)), **kwargs)
        self.sites = site_array(points, reach=2.4 * DX, spacing=DX, activation=NEEDED)
        arrays = [self.pa, fluid_array(points[:1] + [0.0, 0.2, 0.0], name="wall", **kwargs), self.sites]
        made = scheme("states_hold", dim=dim, spacing=DX, changes=dict(
            preset_nucleation=PresetNucleation(attraction=0.0, activation=True, **options)))
        made.setup_properties(arrays)
        self.stepper = Stepper(made, arrays, dt=1e-3)
        self.stepper.tools = []

    def run(self, awake, near, over, beside=NONE, crowd=False, superheat=0.0, e=None, tilt=0.0):
        """(states of the sites, phases within their radii, over them, beside them) after the stage of the phases.

        ``superheat`` [K] is that of superheated liquid; ``e`` [J/kg] the enthalpy of the particle within the radius, if
        that is not NaN. With ``crowd`` that much more vapour is within the radius. ``tilt`` [degrees] is the angle from
        the vertical to the particle over the site.
        """
        awake, near, over, beside, crowd, superheat, tilt = (np.array(row) for row in np.broadcast_arrays(
            awake, near, over, beside, crowd, superheat, tilt))
        n, L, pa = len(awake), WATER.L, self.pa
        stored = {Phase.TRANSITION: 0.4 * L, Phase.VAPOUR: L, Phase.LIQUID: -1e5, NONE: -L}

        def set_part(part, phases):
            own = np.array([stored.get(p, enthalpy(WATER.T_sat + dT, WATER)) for p, dT in zip(phases, superheat)])
            pa.phase[part * N:part * N + n], pa.e[part * N:part * N + n] = np.maximum(phases, 0), own

        pa.phase[:], pa.e[:], pa.e_lat[:] = Phase.LIQUID, -L, 0.0
        for axis, start in zip("xyz", self.points.T):
            pa.get(axis)[:] = np.tile(start, 3 + CROWD)
        pa.x[N:] += 2.0 * FAR
        for part, phases in enumerate((near, over, beside)):
            set_part(part, phases)
        pa.x[:n] += np.where(near == NONE, 2.0 * FAR, NEAR)
        there, angle = over != NONE, np.radians(tilt)
        pa.x[N:N + n] += np.where(there, RIM * np.sin(angle) - 2.0 * FAR, 0.0)
        pa.get(self.up)[N:N + n] += np.where(there, RIM * np.cos(angle), 0.0)
        pa.x[2 * N:2 * N + n] += np.where(beside == NONE, 0.0, RIM - 2.0 * FAR)
        for part in range(3, 3 + CROWD):
            set_part(part, np.where(crowd, Phase.VAPOUR, NONE))
            pa.x[part * N:part * N + n] += np.where(crowd, -2.0 * FAR, 0.0)
        if e is not None:
            pa.e[:n] = np.where(np.isnan(e), pa.e[:n], e)
        pa.T[:] = temperature(pa.e, pa.phase, WATER)
        self.sites.awake[:] = DORMANT
        self.sites.awake[:n] = awake
        self.stepper.run_stage("phases")
        return (self.sites.awake[:n].copy(), *(pa.phase[part * N:part * N + n].copy() for part in range(3)))


@pytest.fixture(scope="module", params=[2, 3], ids=["2-D", "3-D"])
def cases(request):
    return Cases(request.param)


def test_a_site_wakes_at_its_activation_superheat_and_not_below(cases):
    """Both bounds, to a billionth; a particle in transition is at T_sat, so it wakes no site however much it holds."""
    superheat = NEEDED * np.array([0.0, 0.5, 1.0 - 1e-9, 1.0 + 1e-9, 1.5])
    awake, near, *_ = cases.run(DORMANT, Phase.SUPERHEATED, Phase.SUPERHEATED, superheat=superheat)
    np.testing.assert_array_equal(awake, [DORMANT] * 3 + [ACTIVE] * 2)
    np.testing.assert_array_equal(near, Phase.SUPERHEATED)  # a step later
    awake, near, *_ = cases.run(ACTIVE, Phase.SUPERHEATED, Phase.SUPERHEATED, superheat=superheat)
    np.testing.assert_array_equal(near, Phase.TRANSITION)
    awake, _, over, _ = cases.run([DORMANT], NONE, Phase.TRANSITION)
    assert (awake[0], over[0]) == (DORMANT, Phase.SUPERHEATED) and cases.pa.e_lat[N] == cases.pa.e[N]


def test_only_liquid_over_the_embryo_counts(cases):
    """Neither hot liquid at the base, within the radius or beside it, nor what is more than 45 degrees off."""
    hot = dict(superheat=2.0 * NEEDED)
    assert cases.run([DORMANT], Phase.SUPERHEATED, NONE, Phase.SUPERHEATED, **hot)[0] == [DORMANT]
    tilt = np.array([-80.0, -46.0, -44.0, 0.0, 44.0, 46.0, 180.0])
    awake, *_ = cases.run(DORMANT, NONE, Phase.SUPERHEATED, tilt=tilt, **hot)
    np.testing.assert_array_equal(awake, [DORMANT] * 2 + [ACTIVE] * 3 + [DORMANT] * 2)


def test_superheats_of_embryos_are_uniform_and_drawn_anew():
    """From 1 to 4 times that of the cavity for embryos from a quarter of its radius on; to four standard deviations."""
    cases = Cases(2, embryo=0.25, seed=3)

    def woke(times):
        return cases.run([DORMANT] * N, NONE, Phase.SUPERHEATED, superheat=times * NEEDED)[0] == ACTIVE

    assert not woke(1.0 - 1e-9).any() and woke(4.0).all()
    shares = [np.mean(woke(times)) for times in (1.75, 2.5, 3.25)]
    np.testing.assert_allclose(shares, [0.25, 0.5, 0.75], atol=2.0 / np.sqrt(N))
    before = woke(2.5)
    cases.run([1 + 8] * (N // 2), Phase.SUPERHEATED, NONE)  # these fall asleep
    np.testing.assert_array_equal(cases.sites.drawn % 2**16, np.arange(N) < N // 2)
    after = woke(2.5)
    assert np.mean(before[:N // 2] != after[:N // 2]) == pytest.approx(0.5, abs=4.0 * 0.5 / np.sqrt(N // 2))
    np.testing.assert_array_equal(before[N // 2:], after[N // 2:])


def test_each_site_has_its_own_superheat(cases):
    cases.sites.activation[:4] = [2.0, 6.0, 10.0, 14.0]
    awake, *_ = cases.run([DORMANT] * 4, NONE, Phase.SUPERHEATED, superheat=8.0)
    cases.sites.activation[:] = NEEDED
    np.testing.assert_array_equal(awake, [ACTIVE, ACTIVE, DORMANT, DORMANT])


def test_every_change_of_state(cases):
    """A reference of a few lines, over states of the site and of the particles at it."""
    rows = list(product((DORMANT, ACTIVE, 1 + 3, 1 + 7, 1 + 8), Phase, (NONE, *Phase), (NONE, Phase.VAPOUR),
                        (False, True), (0.5 * NEEDED, 2.0 * NEEDED)))
    before, near, over, beside, crowd, superheat = (np.array(column) for column in zip(*rows))
    after, near_after, *_ = cases.run(before, near, over, beside, crowd, superheat)
    seen = set()
    for row, b, a, n, new, o, r, c, dT in zip(rows, before, after, near, near_after, over, beside, crowd, superheat):
        beyond = Phase.VAPOUR in (o, r)
        vapour = [n, o, r].count(Phase.VAPOUR) + c * CROWD
        most = max(b - 1, vapour)
        if b == DORMANT:
            expected = 1 + vapour if o == Phase.SUPERHEATED and dT > NEEDED else DORMANT
        elif not c and new == Phase.LIQUID or most and not beyond and vapour <= 0.5 * most:
            expected = DORMANT
        else:
            expected = 1 + most
        assert a == expected, row
        seen.add((int(b), int(a)))
    assert seen >= {(0, 0), (0, 1), (0, 5), (1, 0), (1, 1), (1, 7), (4, 0), (4, 4), (4, 7), (8, 0), (8, 8), (9, 0),
                    (9, 9)}


def test_an_embryo_of_half_the_bubble_is_what_it_leaves(cases):
    """Four particles within the radius: they are all of a nascent bubble, more than half of 7, and half of 8."""
    awake, *_ = cases.run([ACTIVE, 1 + 4, 1 + 7, 1 + 8, 1 + 8], Phase.VAPOUR, NONE,
                          [NONE] * 4 + [Phase.VAPOUR], crowd=True)
    np.testing.assert_array_equal(awake, [1 + 4, 1 + 4, 1 + 7, DORMANT, 1 + 8])


def test_a_dormant_site_stops_what_boils_within_its_reach(cases):
    """Liquid next to the embryo of a dormant site takes up no latent heat; at an active site it does."""
    _, near, _, beside = cases.run([DORMANT, ACTIVE, 1 + 3], Phase.VAPOUR, NONE, Phase.SUPERHEATED)
    np.testing.assert_array_equal(near, Phase.VAPOUR)
    np.testing.assert_array_equal(beside, [Phase.SUPERHEATED, Phase.TRANSITION, Phase.TRANSITION])


class Watch(Tool):
    """When each site became active, how hot the hottest liquid at it was then, and when it fell asleep."""

    def __init__(self, scheme, sites):
        self.scheme, self.sites, self.before = scheme, sites, sites.awake.copy()
        self.woke, self.slept = [[] for _ in sites.x], [[] for _ in sites.x]

    def post_step(self, solver):
        now, pa = self.sites.awake, self.scheme.arrays[0]
        for k in np.flatnonzero((now > 0) != (self.before > 0)):
            at = np.hypot(pa.x - self.sites.x[k], pa.y - self.sites.y[k]) < 2.4 * self.scheme.spacing
            (self.woke if now[k] else self.slept)[k].append((solver.t, float(pa.T[at].max()) - WATER.T_sat))
        self.before = now.copy()


@host_only  # it writes and watches host arrays; the other tests of this file run on devices too
def test_sites_of_a_boil_wake_in_the_order_of_their_superheats():
    """Three sites on a base that heats evenly: each wakes when liquid at it is hot enough, and sleeps after its bubble.
    """
    scene, stepper = from_scene(
        SteadyBoiling, ledger=True, dim=2, spacing=0.002, width=36, fill=16, sites=3, heated=0.9, time_scaling=1000.0,
        smallest_cavity=1e-6, embryo=1.0, pattern="regular", duration=2.0)
    (sites,), needed = scene.scheme.site_arrays, np.array([25.0, 6.0, 14.0])
    sites.activation[:] = needed
    watch = Watch(scene.scheme, sites)
    stepper.tools.append(watch)
    while stepper.t < 2.0:
        stepper.step(20)
    first = [times[0][0] for times in watch.woke]
    assert first[1] < first[2] < first[0], first
    for superheat, woke in zip(needed, watch.woke):
        assert all(hottest >= superheat for _, hottest in woke)
    assert sum(map(len, watch.slept)) >= 3 and len(scene.departures) >= 3
    assert np.max(np.abs(scene.ledger.table()["energy_residual"])) <= 1e-10


def test_what_cannot_be_is_refused():
    points = np.zeros((1, 3))

    def setup(needed, **options):
        made = scheme("states_hold", dim=2, spacing=DX, changes=dict(preset_nucleation=PresetNucleation(
            attraction=0.0, **options)))
        fluid, wall = (fluid_array(points, spacing=DX, dim=2, rho0=WATER.rho_l, name=name)
                       for name in ("fluid", "wall"))
        made.setup_properties([fluid, wall, site_array(points, reach=2.4 * DX, spacing=DX, activation=needed)])

    setup(0.0)
    with pytest.raises(ValueError, match="have activation superheats, which are not used: pass "):
        setup(5.0)
    with pytest.raises(ValueError, match="dormant_radius must be above preset_nucleation.radius = 1.6 spacings, got 1"):
        setup(5.0, activation=True, dormant_radius=1.0)


def test_sites_that_are_alike_build_what_they_built_before():
    def kernels(**options):
        made = scheme("states_hold", dim=2, spacing=DX, changes=dict(preset_nucleation=PresetNucleation(**options)))
        return {type(term.equation).__name__ for term in made.terms()}

    assert kernels(activation=True) - kernels() == {"NucleationActivation", "NucleationDormancy"}
    assert kernels() <= kernels(activation=True)

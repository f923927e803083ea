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

DX, N, ROW = 0.01, 192, 16  # spacing [m], sites, sites side by side
NEAR, RIM, FAR = 1.0 * DX, 2.0 * DX, 3.5 * DX  # within the radius of a site, at its rim, out of reach
NEEDED = 12.0  # activation superheat [K]
DORMANT, ACTIVE, BUBBLE = range(3)
ACTIVATION = PresetNucleation(attraction=0.0, activation=True)


class Cases:
    """N sites far apart, each with a particle within its radius and one at its rim, and the compiled scheme."""

    def __init__(self, dim):
        points = np.zeros((N, 3))
        points[:, 0], points[:, 1] = 0.1 * (np.arange(N) % ROW), -0.2 * (np.arange(N) // ROW)
        kwargs = dict(spacing=DX, dim=dim, rho0=WATER.rho_l)
        self.points, self.pa = points, fluid_array(np.concatenate([points, points]), **kwargs)
        self.pa.x[:N] += NEAR
        self.sites = site_array(points, reach=2.4 * DX, spacing=DX, activation=NEEDED)
        arrays = [self.pa, fluid_array(points[:1] + [0.0, 0.2, 0.0], name="wall", **kwargs), self.sites]
        made = scheme("states_hold", dim=dim, spacing=DX, changes=dict(preset_nucleation=ACTIVATION))
        made.setup_properties(arrays)
        self.stepper = Stepper(made, arrays, dt=1e-3)
        self.stepper.tools = []

    def run(self, awake, near, rim, superheat=0.0, e=None):
        """(states of the sites, phases within their radii, phases at their rims) after the stage of the phases.

        ``superheat`` [K] is that of superheated and liquid particles within the radius; ``e`` [J/kg] their enthalpy, if
        that is not NaN.
        """
        awake, near, rim, superheat = (np.array(row) for row in np.broadcast_arrays(awake, near, rim, superheat))
        n, L = len(awake), WATER.L
        stored = {Phase.TRANSITION: 0.4 * L, Phase.VAPOUR: L}
        own = np.array([stored.get(p, enthalpy(WATER.T_sat + dT, WATER)) for p, dT in zip(near, superheat)])
        own = own if e is None else np.where(np.isnan(e), own, e)
        self.pa.phase[:], self.pa.e[:], self.pa.e_lat[:] = Phase.LIQUID, -L, 0.0
        self.pa.x[N:N + n] = self.points[:n, 0] + np.where(rim == -1, FAR, RIM)
        self.pa.phase[:n], self.pa.e[:n] = near, own
        self.pa.phase[N:N + n] = np.where(rim == -1, Phase.LIQUID, rim)
        self.pa.e[N:N + n] = [stored.get(p, 0.0 if p >= 0 else -L) for p in rim]
        self.pa.T[:] = temperature(self.pa.e, self.pa.phase, WATER)
        self.sites.awake[:] = DORMANT
        self.sites.awake[:n] = awake
        self.stepper.run_stage("phases")
        return self.sites.awake[:n].copy(), self.pa.phase[:n].copy(), self.pa.phase[N:N + n].copy()


@pytest.fixture(scope="module", params=[2, 3], ids=["2-D", "3-D"])
def cases(request):
    return Cases(request.param)


def test_a_site_wakes_at_its_activation_superheat_and_not_below(cases):
    """Both bounds, to a billionth; a particle in transition is at T_sat, so it wakes no site however much it holds."""
    superheat = NEEDED * np.array([0.0, 0.5, 1.0 - 1e-9, 1.0 + 1e-9, 1.5])
    awake, near, _ = cases.run(DORMANT, Phase.SUPERHEATED, -1, superheat)
    np.testing.assert_array_equal(awake, [DORMANT] * 3 + [ACTIVE] * 2)
    np.testing.assert_array_equal(near, Phase.SUPERHEATED)  # a step later
    awake, near, _ = cases.run(ACTIVE, Phase.SUPERHEATED, -1, superheat)
    np.testing.assert_array_equal(near, Phase.TRANSITION)
    awake, near, _ = cases.run([DORMANT], Phase.TRANSITION, -1)
    assert (awake[0], near[0]) == (DORMANT, Phase.SUPERHEATED) and cases.pa.e_lat[0] == cases.pa.e[0]


def test_each_site_has_its_own_superheat(cases):
    cases.sites.activation[:4] = [2.0, 6.0, 10.0, 14.0]
    awake, _, _ = cases.run([DORMANT] * 4, Phase.SUPERHEATED, -1, 8.0)
    cases.sites.activation[:] = NEEDED
    np.testing.assert_array_equal(awake, [ACTIVE, ACTIVE, DORMANT, DORMANT])


def test_every_change_of_state(cases):
    """A reference of a few lines, over all states of the site and of the two particles at it."""
    rows = list(product((DORMANT, ACTIVE, BUBBLE), Phase, (-1, *Phase), (0.5 * NEEDED, 2.0 * NEEDED)))
    before, near, rim, superheat = (np.array(column) for column in zip(*rows))
    after, near_after, _ = cases.run(before, near, rim, superheat, np.where(near == Phase.LIQUID, -1e5, np.nan))
    seen = set()
    for row, b, a, n, new, r, dT in zip(rows, before, after, near, near_after, rim, superheat):
        hot = n == Phase.SUPERHEATED and dT > NEEDED
        if b == DORMANT:
            expected = ACTIVE if hot else DORMANT
        elif r == Phase.VAPOUR:
            expected = BUBBLE
        else:
            expected = DORMANT if b == BUBBLE or new == Phase.LIQUID else ACTIVE
        assert a == expected, row
        seen.add((int(b), int(a)))
    assert seen == {(0, 0), (0, 1), (1, 0), (1, 1), (1, 2), (2, 0), (2, 2)}


def test_a_dormant_site_stops_what_boils_within_its_reach(cases):
    """Liquid next to the embryo of a dormant site takes up no latent heat; at an active site it does."""
    _, near, rim = cases.run([DORMANT, ACTIVE, BUBBLE], Phase.VAPOUR, Phase.SUPERHEATED)
    np.testing.assert_array_equal(near, Phase.VAPOUR)
    np.testing.assert_array_equal(rim, [Phase.SUPERHEATED, Phase.TRANSITION, Phase.TRANSITION])


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
        smallest_cavity=1e-6, pattern="regular", duration=2.0)
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

"""The oscillation of bubbles: the push against the paper's equations, what each form does, shares of volume, the step.

Two things are compiled, in one set of effects: the stage "oscillation" alone, on vapour without liquid, and all stages
of a small pool. Each array carries the properties of every form, so that all forms share their modules.
"""
import re

import numpy as np
import pytest
from harness import Evaluator, Stepper, random_cloud, record, vectors
from pysph.base.nnps import DomainManager

from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.particles import NO_BUBBLE, add_properties, box_vessel, fluid_array, fluid_block
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    BoxContainer,
    BubbleLabels,
    Cohesion,
    Expansion,
    HeatConduction,
    Oscillation,
    PhaseChange,
    XSPHViscosity,
)
from pysph_boiling.schemes.vapour import Vapour

DX = 0.004
VAPOUR = int(Phase.VAPOUR)
ROUND_OFF = 1e-12  # sums of some 50 terms, in another order than those of the code
UNIT = {2: 2.0 / 3.0 / np.sqrt(np.pi), 3: 0.75 * (0.75 / np.pi) ** (1.0 / 3.0)}  # .3761, .4653: of N^(1/dim) spacings
FREE = dict(period=1e-6)  # so fast a swing that its speed bounds nothing
DT, G = 1e-3, 9.81


def make_scheme(dim, v_exp=1.0, box=(1.0, 1.0, 1.0), **oscillation):
    return BoilingScheme(
        ["fluid"], ["wall"], dim=dim, spacing=DX, container=BoxContainer(upper=box), viscosity=XSPHViscosity(),
        heat=HeatConduction(), phases=PhaseChange(), bubbles=BubbleLabels(), cohesion=Cohesion(),
        expansion=Expansion(v_exp=v_exp), oscillation=Oscillation(**oscillation))


def set_up(scheme, fluid, wall):
    """Give the arrays what the scheme asks for, and the fluid what the other forms would."""
    scheme.setup_properties([fluid, wall])
    for form in ("hysteresis", "rayleigh_plesset"):
        other = Oscillation(form=form)
        add_properties(fluid, other.properties(scheme.scene()))
        for name, value in other.constants(scheme.scene()).items():
            if name not in fluid.constants:
                fluid.add_constant(name, value)
    fluid.oscillation_dt[0] = DT


def at_rest(dim, size):
    """Mean distance from the centre of a disc or ball that fills as much as ``size`` particles [m]."""
    return UNIT[dim] * DX * size ** (1.0 / dim)


class Bubbles:
    """Vapour with given labels (``NO_BUBBLE``: liquid), and the stage "oscillation" once ``push`` asks for it."""

    def __init__(self, points, label=0, *, dim, m=1.0, v_exp=1.0, **oscillation):
        self.scheme = make_scheme(dim, v_exp, **oscillation)
        self.scene, self.effect = self.scheme.scene(), self.scheme.effects["oscillation"]
        common = dict(spacing=DX, dim=dim, rho0=WATER.rho_l)
        self.fluid, self.wall = fluid_array(points, **common), fluid_array([(2.0, 2.0, 0.0)], name="wall", **common)
        set_up(self.scheme, self.fluid, self.wall)
        self.fluid.m[:] *= m
        self.fluid.bubble[:] = label
        self.fluid.phase[:] = np.where(self.fluid.bubble == NO_BUBBLE, Phase.LIQUID, Phase.VAPOUR)
        self.stage = None

    def compile(self, domain=None):
        self.scheme.configure_solver(dt=1e-3)
        groups = self.scheme.get_equations().groups[self.scheme.integrator.stages["oscillation"]]
        self.stage = Evaluator([self.fluid, self.wall], groups, dim=self.scheme.dim, domain=domain)

    def push(self, moving=False):
        """A step's solves; displacement (n, 3) [m], or ``None`` if the step leaves the stage out.

        The step begins where the particles are, unless they are ``moving``: then by ``sx``, ``sy``, ``sz`` before.
        """
        if self.stage is None:
            self.compile()
        start, pushed = vectors(self.fluid), False
        self.fluid.pushes[0] = 0.0
        if not moving:
            self.fluid.sx[:] = self.fluid.sy[:] = self.fluid.sz[:] = 0.0
        while self.effect.conditions(self.scene)["oscillation"]([self.fluid]):
            pushed = True
            self.stage.run()
        return vectors(self.fluid) - start if pushed else None

    def radius(self, who=slice(None)):
        """Mean distance from the centroid [m]."""
        x = vectors(self.fluid)[who]
        return np.mean(np.linalg.norm(x - x.mean(axis=0), axis=1))

    def ring(self, steps=1):
        for _ in range(steps):
            self.effect.advance_volumes(self.scene, [self.fluid])

    def volume(self, who=slice(None)):
        return float(np.sum((self.fluid.m * self.fluid.swell)[who])) / WATER.rho_l

    def flow(self, who=slice(None)):
        return float(np.sum((self.fluid.m * self.fluid.swell_rate)[who])) / WATER.rho_l


def ball(radius, dim, jitter=0.1, seed=1):
    """Lattice points within ``radius`` spacings of a centre, shaken a little."""
    span = np.arange(-int(radius) - 1, int(radius) + 2) + 0.25
    points = np.zeros((len(span) ** dim, 3))
    points[:, :dim] = np.stack(np.meshgrid(*[span] * dim, indexing="ij"), -1).reshape(-1, dim)
    points = points[np.linalg.norm(points, axis=1) < radius]
    points[:, :dim] += np.random.default_rng(seed).uniform(-jitter, jitter, (len(points), dim))
    return DX * points


# --- the push against the paper's equations ---------------------------------------------------------------------------

SIZES = (40, 17, 2, 1)  # particles in the bubbles of the cloud, which also holds liquid


def cloud(dim):
    """Points, labels, masses: bubbles of ``SIZES`` too wide or too narrow, and liquid, in shuffled order."""
    random = np.random.default_rng(5)
    label = np.concatenate([np.repeat([7, 3, 30, 60], SIZES), np.full(12, NO_BUBBLE)])
    points = np.zeros((len(label), 3))
    for number, wide in zip((7, 3, 30, 60, NO_BUBBLE), (2.5, 0.8, 3.0, 1.0, 3.0)):
        who = label == number
        points[who] = wide * DX * np.sqrt(who.sum()) * (random_cloud(who.sum(), dim, seed=number % 97) + 0.1)
    order = random.permutation(len(label))
    return points[order], label[order], random.uniform(0.5, 2.0, len(label))[order]


def reference(points, label, w, *, bounds, omega, eps, exact, moved, period, dim):
    """Eqs. 23 to 30 of the paper in their order, particle by particle: (displacements, bubbles whose push was cut).

    The push is bounded by how far a wall may go in a step that began with the particles ``moved`` less far.
    """
    move, cut, up = np.zeros_like(points), set(), points[:, dim - 1]
    level = 2.0 * np.mean(up) - np.min(up)
    for b in set(label) - {NO_BUBBLE}:
        members = np.flatnonzero(label == b)
        N = len(members)
        low, high = bounds(b)
        centre = sum(points[i] for i in members) / N
        arm = {i: points[i] - centre for i in members}
        d = {i: arm[i] / max(np.linalg.norm(arm[i]), 1e-6 * DX) for i in members}
        mean = sum(np.linalg.norm(arm[i]) for i in members) / N
        C, sign = (low - mean, -1.0) if mean < low else (mean - high, 1.0)
        if N < 2 or C <= 0.0:
            continue
        old = [points[i] - moved[i] for i in members]
        before = np.mean([np.linalg.norm(x - np.mean(old, axis=0)) for x in old])
        reach = np.pi * (high - low) / period * DT
        if sign < 0.0:
            radius = mean / {2: 2.0 / 3.0, 3: 0.75}[dim]
            reach += 0.5 * G * max(level - centre[dim - 1], 0.0) / max(radius, 0.5 * DX) * DT**2
        most = max(reach + sign * (mean - before), 0.0)
        if C > most:
            C = most
            cut.add(b)
        net = sum(d[i] for i in members) / N**2 if exact else np.zeros(3)
        gradient = {i: sign * (d[i] / N - net) for i in members}
        squares = sum(w[i] * gradient[i] @ gradient[i] for i in members)
        multiplier = -C / (squares + eps * np.mean([w[i] for i in members]) / N)
        for i in members:
            move[i] = omega * w[i] * multiplier * gradient[i]
        longest = max(np.linalg.norm(move[i]) for i in members)
        if longest > most:
            move[members] *= most / longest
            cut.add(b)
    return move, cut


def band(label):
    """The paper's bounds of a bubble by its label [m], with 2 spacings for its unit of length."""
    def bounds(b):
        root = np.count_nonzero(label == b) ** (1.0 / 3.0)
        return 2.0 * DX * (0.45 + 0.05 * root), 2.0 * DX * (0.85 + 0.05 * root)
    return bounds


def relative(label, m, dim):
    """0.9 and 1.15 times the mean radius of a disc or ball that is as heavy as the bubble [m]."""
    def bounds(b):
        rest = at_rest(dim, np.sum(m[label == b]) / (WATER.rho_l * DX**dim))
        return 0.9 * rest, 1.15 * rest
    return bounds


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("form", ["band", "relative"])
@pytest.mark.parametrize(("gradient", "period"), [("exact", 1e-6), ("paper", 1e-6), ("exact", 0.2)])
def test_displacement_and_work_equal_the_reference(dim, form, gradient, period):
    points, label, m = cloud(dim)
    bubbles = Bubbles(points, label, dim=dim, m=m, form=form, gradient=gradient, omega=0.8, eps=1e-3, period=period)
    m = bubbles.fluid.m
    moved = 5e-3 * DX * random_cloud(len(points), dim, seed=8)
    want, cut = reference(points, label, 1.0 / m, omega=0.8, eps=1e-3, exact=gradient == "exact", moved=moved,
                          period=period, dim=dim, bounds=band(label) if form == "band" else relative(label, m, dim))
    pushed = {b for b in (7, 3, 30, 60) if np.any(want[label == b])}
    assert len(pushed) >= 2 and 60 not in pushed and len(cut) >= 2 * (period > 0.1)
    bubbles.fluid.push_multiplier[:] = 1.0  # what was there before is no matter
    for axis, name in enumerate(("sx", "sy", "sz")):
        bubbles.fluid.get(name)[:] = moved[:, axis]
    got = bubbles.push(moving=True)
    np.testing.assert_allclose(got, want, rtol=1e-9, atol=ROUND_OFF * DX)
    np.testing.assert_allclose(vectors(bubbles.fluid, "sx", "sy", "sz"), moved + want, rtol=1e-9, atol=ROUND_OFF * DX)
    assert bubbles.fluid.n_pushed[0] == len(pushed)
    work = sum(0.5 * m[i] * (np.sum((moved[i] + want[i])**2) - np.sum(moved[i]**2)) / DT**2 for i in range(len(m)))
    work += G * m @ want[:, dim - 1]  # lifted
    assert abs(work) > 0.0 and bubbles.fluid.work_oscillation[0] == pytest.approx(work, rel=1e-9)


def test_bubble_across_a_periodic_border_is_one():
    start = 1.5 * ball(2.0, 3)
    width = 4.0 * np.ptp(start)
    whole, split = Bubbles(start + 0.5 * width, dim=3), Bubbles(start + (0.0, 0.5 * width, 0.5 * width), dim=3)
    whole.wall.x[:], split.wall.x[:] = 0.5 * width, 0.5 * width
    split.fluid.x[:] %= width
    assert np.ptp(split.fluid.x) > 0.8 * width
    split.compile(DomainManager(xmin=0.0, xmax=width, periodic_in_x=True))
    split.scene.period[0] = width  # as the solver does
    split.stage.nnps.update_domain()
    split.stage.nnps.update()
    assert split.fluid.get_number_of_particles() > split.fluid.get_number_of_particles(True)
    want = whole.push()
    split.push()
    got = np.stack([split.fluid.get(name, only_real_particles=True) for name in ("sx", "sy", "sz")], -1)
    order = np.argsort(split.fluid.get("uid", only_real_particles=True))
    assert np.abs(want).max() > 0.01 * DX
    np.testing.assert_allclose(got[order], want, rtol=1e-9, atol=1e-9 * DX)


def test_mean_distance_of_the_results_sees_the_oscillation():
    bubbles = Bubbles(1.3 * ball(3.0, 2), dim=2, form="relative", **FREE)
    (column,) = (row for row in bubbles.effect.columns(bubbles.scene) if row.name == "bubble_distance_mean")
    before = column.value([bubbles.fluid], bubbles.scene)
    assert before == pytest.approx(bubbles.radius(), rel=1e-12)
    moved = bubbles.push()
    assert np.abs(moved).max() > 0.01 * DX
    after = column.value([bubbles.fluid], bubbles.scene)
    assert after == pytest.approx(bubbles.radius(), rel=1e-12) and abs(after / before - 1.0) > 0.01


def test_exact_gradient_exerts_no_net_push_and_the_papers_does():
    for gradient, m in (("exact", 1.0), ("exact", None), ("paper", 1.0)):
        points, label, masses = cloud(3)
        bubbles = Bubbles(2.0 * points, label, dim=3, m=masses if m is None else m, gradient=gradient, form="relative",
                          **FREE)
        moved = bubbles.push()
        for b in (7, 3):
            who = label == b
            drift = np.linalg.norm(bubbles.fluid.m[who] @ moved[who]) / bubbles.fluid.m[who].sum()  # of the mass centre
            size = np.linalg.norm(moved[who], axis=1).max()
            assert size > 0.01 * DX
            assert drift < 1e-14 * DX if gradient == "exact" else drift > 0.02 * size


# --- what each form does ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(("off", "edge"), [(0.8, 0), (1.1, 1)], ids=["expands", "shrinks"])
@pytest.mark.parametrize("form", ["band", "relative"])
def test_one_solve_reaches_the_edge_of_the_band(dim, off, edge, form):
    bubbles = Bubbles(ball({2: 3.0, 3: 2.0}[dim], dim), dim=dim, form=form, **FREE)
    label = np.zeros(len(bubbles.fluid.x))
    want = (band(label) if form == "band" else relative(label, bubbles.fluid.m, dim))(0)[edge]
    stretch = off * want / bubbles.radius()
    bubbles.fluid.x *= stretch
    bubbles.fluid.y *= stretch
    bubbles.fluid.z *= stretch
    assert bubbles.radius() == pytest.approx(off * want)
    assert bubbles.push() is not None
    assert bubbles.radius() == pytest.approx(want, abs=1e-4 * abs(1.0 - off) * want)  # measured 8e-6


def test_several_solves_a_step_come_nearer_within_the_same_limit():
    for sweeps, period in ((1, 1e-6), (3, 1e-6), (3, 0.05)):
        bubbles = Bubbles(1.7 * ball(2.0, 3), dim=3, form="relative", omega=0.5, sweeps=sweeps, period=period)
        want, before = 1.15 * at_rest(3, len(bubbles.fluid.x)), bubbles.radius()
        moved = bubbles.push()
        assert bubbles.fluid.pushes[0] == sweeps
        if period < 1e-3:
            assert bubbles.radius() - want == pytest.approx(0.5**sweeps * (before - want), rel=1e-2)
        else:
            reach = np.pi * 0.25 * at_rest(3, len(bubbles.fluid.x)) / period * DT
            assert 0.4 * reach < np.linalg.norm(moved, axis=1).max() <= reach * (1.0 + 1e-9)


def test_no_push_makes_a_wall_faster_than_its_own_swing():
    """Pushed again and again without anything in its way, whatever the step: it keeps the speed of one push."""
    for dt in (3e-3, 1e-3, 1e-4):
        bubbles = Bubbles(0.6 * ball(2.0, 3), dim=3, form="relative", period=0.1)
        fluid = bubbles.fluid
        fluid.oscillation_dt[0] = dt
        fastest = np.pi * 0.25 * at_rest(3, len(fluid.x)) / 0.1
        weight = 0.5 * G * dt * np.ptp(fluid.z) / (0.5 * DX)  # more than the liquid above can be
        speed = []
        for _ in range(20):
            step, before = vectors(fluid, "sx", "sy", "sz"), bubbles.radius()
            for axis, name in enumerate("xyz"):
                fluid.get(name)[:] += step[:, axis]  # as it moves on, with what the last push gave it
            bubbles.push(moving=True)
            speed.append((bubbles.radius() - before) / dt)
        assert 0.5 * fastest < max(speed) <= fastest + weight, dt
        assert fluid.n_pushed[0] >= 1 and fluid.work_oscillation[0] > 0.0


def test_bubble_inside_its_band_or_too_small_is_left_alone():
    inside = Bubbles(ball(2.0, 3), dim=3, form="relative", **FREE)
    narrow = Bubbles(0.5 * ball(2.0, 3), dim=3, form="relative", min_particles=40, **FREE)
    single = Bubbles([(0.0, 0.0, 0.0), (DX, 0.0, 0.0)], [0, 1], dim=3, form="band", **FREE)
    liquid = Bubbles(ball(2.0, 3), NO_BUBBLE, dim=3, form="relative", **FREE)
    assert 30 < len(narrow.fluid.x) < 40
    for bubbles in (inside, narrow, single, liquid):
        assert not bubbles.effect.conditions(bubbles.scene)["oscillation"]([bubbles.fluid])
        assert bubbles.fluid.n_pushed[0] == 0.0
    narrow.effect = narrow.effect.replaced(min_particles=30)
    assert narrow.push() is not None


def test_particles_at_one_place_are_no_harm():
    bubbles = Bubbles(np.zeros((5, 3)) + DX, dim=3, form="relative", **FREE)
    moved = bubbles.push()
    assert np.all(np.isfinite(moved)) and np.abs(moved).max() < 1e-6 * DX


@pytest.mark.parametrize("dim", [2, 3])
def test_hysteresis_runs_from_bound_to_bound_in_half_a_period(dim):
    """A bubble without liquid: its positions alone tell the period, and both bounds are reached."""
    dt, steps = 1e-3, 40
    bubbles = Bubbles(ball({2: 3.0, 3: 2.0}[dim], dim), dim=dim, form="hysteresis", lower=0.9, upper=1.2,
                      period=steps * dt)
    radius = []
    for _ in range(3 * steps):
        bubbles.push()
        radius.append(bubbles.radius() / at_rest(dim, len(bubbles.fluid.x)))
    late = np.array(radius[steps:])
    assert late.min() == pytest.approx(0.9, abs=0.01) and late.max() == pytest.approx(1.2, abs=0.01)
    middle = np.flatnonzero((late[:-1] < 1.05) & (late[1:] >= 1.05))
    np.testing.assert_array_equal(np.diff(middle), steps)
    np.testing.assert_allclose(np.median(np.abs(np.diff(late))), 2.0 * 0.3 / steps, rtol=1e-2)  # at a steady rate


def test_majority_tells_target_and_direction_of_a_merged_bubble():
    points = ball(2.0, 3)
    n = len(points)
    bubbles = Bubbles(points, dim=3, form="hysteresis", period=1.0, lower=0.9, upper=1.1)
    target = bubbles.fluid.target_radius
    target[:] = np.where(np.arange(n) < 0.6 * n, -1.02, 1.07)
    target[-2:] = 0.0  # new vapour
    bubbles.effect.solve(bubbles.scene, [bubbles.fluid])
    np.testing.assert_allclose(target, -(1.02 - 2.0 * 0.2 * 1e-3), rtol=1e-12)
    target[:] = 1.0999
    bubbles.fluid.pushes[0] = 0.0
    bubbles.effect.solve(bubbles.scene, [bubbles.fluid])
    np.testing.assert_allclose(target, -(1.1 - (4e-4 - 1e-4)), rtol=1e-12)  # turned at the bound
    bubbles.fluid.phase[:3], bubbles.fluid.pushes[0] = Phase.LIQUID, 0.0
    bubbles.effect.solve(bubbles.scene, [bubbles.fluid])
    assert np.all(target[:3] == 0.0) and np.all(target[3:] != 0.0)


# --- volumes by the Rayleigh-Plesset equation -------------------------------------------------------------------------


def ringing(points=None, label=0, v_exp=1.0, dt=1e-3, **kwargs):
    """Vapour whose volume rings; the surface lies at its height unless given."""
    kwargs = {"slowdown": 20.0, "surface": 0.0, **kwargs}
    points = ball(2.0, 3) if points is None else points
    bubbles = Bubbles(points, label, dim=3, v_exp=v_exp, form="rayleigh_plesset", **kwargs)
    bubbles.fluid.oscillation_dt[0] = dt
    return bubbles


def test_volume_follows_the_equation_in_its_own_time():
    """Two bubbles, unequal masses, some depth: the sums of their shares follow the equation of each alone."""
    n = len(ball(2.0, 3))
    points = np.concatenate([ball(2.0, 3), ball(2.0, 3) + 0.1])
    label = np.repeat([4, 1], n)
    bubbles = ringing(points, label, v_exp=1.5, m=np.random.default_rng(1).uniform(0.8, 1.2, 2 * n), pressure=2e3,
                      surface=0.5, viscosity=0.05)
    bubbles.fluid.swell[:] = np.where(label == 4, 1.3, 1.6)
    model = bubbles.effect.bubble(bubbles.scene)
    assert (model.pressure, model.mu, model.sigma, model.rho) == (2e3, 0.05, WATER.sigma, WATER.rho_l)
    state = {}
    for b in (4, 1):
        who = label == b
        equilibrium, depth = 1.5 * bubbles.fluid.m[who].sum() / WATER.rho_l, 0.5 - points[who, 2].mean()
        R0, R = (np.cbrt(0.75 * volume / np.pi) for volume in (equilibrium, bubbles.volume(who)))
        state[b] = [R, 0.0, R0, 2e3 + WATER.rho_l * 9.81 * depth]
    for _ in range(30):
        bubbles.ring()
        for b, (R, U, R0, p) in state.items():
            (R,), (U,), _ = model.advance([R], [U], R0, p, 1e-3 / 20.0, *bubbles.effect.bounds())
            state[b][:2] = R, U
            who = label == b
            assert bubbles.volume(who) == pytest.approx(4.0 / 3.0 * np.pi * R**3, rel=1e-12)
            assert bubbles.flow(who) == pytest.approx(4.0 * np.pi * R**2 * U, rel=1e-9, abs=1e-12 * R**2)
    assert abs(state[4][0] / state[1][0] - 1.0) > 1e-3 and abs(state[4][1]) > 0.0


def test_target_radius_is_that_of_the_volume():
    bubbles = ringing(slowdown=1e-6)  # so fast a ring that its speed bounds nothing
    bubbles.fluid.swell[:] = 1.3
    bubbles.push()
    assert bubbles.radius() == pytest.approx(at_rest(3, 1.3 * len(bubbles.fluid.x)), rel=1e-3)


def test_merging_adds_volumes_and_rates_and_splitting_hands_out_shares():
    points = np.concatenate([ball(2.0, 3), ball(1.6, 3) + 5.0 * DX])
    first = np.arange(len(points)) < len(ball(2.0, 3))
    bubbles = ringing(points, np.where(first, 0, 40), dt=1e-5)
    bubbles.fluid.swell[:] = np.where(first, 0.8, 1.2)
    bubbles.ring(40)
    swell, volume, flow = bubbles.fluid.swell.copy(), bubbles.volume(), bubbles.flow()
    parts = [bubbles.volume(first), bubbles.volume(~first)]
    assert bubbles.flow(first) > 0.0 > bubbles.flow(~first)
    bubbles.fluid.bubble[:] = 0
    bubbles.fluid.oscillation_dt[0] = 0.0
    bubbles.ring()
    assert bubbles.volume() == pytest.approx(volume, rel=1e-13) and bubbles.flow() == pytest.approx(flow, rel=1e-9)
    np.testing.assert_allclose(bubbles.fluid.swell, swell, rtol=1e-13)  # nobody jumps
    bubbles.fluid.oscillation_dt[0] = 1e-5
    bubbles.ring()
    assert bubbles.volume() == pytest.approx(volume, rel=1e-2) and bubbles.volume() != volume
    swell, volume = bubbles.fluid.swell.copy(), bubbles.volume()
    bubbles.fluid.bubble[:] = np.where(first, 0, 40)
    bubbles.ring()
    np.testing.assert_allclose(bubbles.fluid.swell, swell, rtol=2e-3)
    assert [bubbles.volume(first), bubbles.volume(~first)] == pytest.approx(parts, rel=1e-2)


def test_new_vapour_joins_with_the_volume_of_its_liquid_and_starts_a_swing():
    bubbles = ringing(v_exp=2.0)
    n = len(bubbles.fluid.x)
    bubbles.fluid.phase[-5:] = Phase.LIQUID
    bubbles.fluid.swell[:-5], bubbles.fluid.swell_rate[-5:] = 2.0, 77.0
    bubbles.ring()
    np.testing.assert_allclose(bubbles.fluid.swell, np.where(np.arange(n) < n - 5, 2.0, 1.0), rtol=1e-9)  # at rest
    assert np.all(bubbles.fluid.swell_rate[-5:] == 0.0)
    bubbles.fluid.phase[-5:] = VAPOUR
    volume = bubbles.volume()
    bubbles.fluid.oscillation_dt[0] = 1e-6
    bubbles.ring()
    assert bubbles.volume() == pytest.approx(volume, rel=1e-6) and bubbles.flow() > 0.0
    bubbles.fluid.oscillation_dt[0] = 1e-3
    volumes = []
    for _ in range(200):
        bubbles.ring()
        volumes.append(bubbles.volume())
    equilibrium = 2.0 * n * DX**3
    assert max(volumes) > equilibrium + 0.8 * (equilibrium - volume)  # swings beyond by about as much


def test_particles_of_a_bubble_come_to_equal_swell_while_their_sum_is_kept():
    bubbles = ringing(v_exp=1.2)
    n, t_star = len(bubbles.fluid.x), bubbles.scene.fall_time
    bubbles.fluid.swell[:] = np.where(np.arange(n) < n // 2, 1.0, 1.4)
    bubbles.fluid.swell[:] *= 1.2 / bubbles.fluid.swell.mean()
    start, volume = bubbles.fluid.swell - 1.2, bubbles.volume()
    steps = int(round(10.0 * t_star / 1e-3))
    bubbles.ring(steps)
    assert bubbles.volume() == pytest.approx(volume, rel=1e-9)
    np.testing.assert_allclose(bubbles.fluid.swell - 1.2, start * np.exp(-steps * 1e-3 / (10.0 * t_star)), rtol=1e-6)


def test_clamped_volumes_are_counted():
    bubbles = ringing(lower=0.95, upper=1.05)
    bubbles.fluid.swell[:] = 0.7
    bubbles.ring(3)
    assert bubbles.fluid.n_clamped[0] >= 1.0
    assert 0.95**3 * (1.0 - 1e-12) <= bubbles.fluid.swell.min() and bubbles.fluid.swell.max() <= 1.05**3 * (1.0 + 1e-12)


def test_pressure_counts_the_liquid_above():
    bubbles = ringing(np.concatenate([ball(2.0, 3), [[0.0, 0.0, 0.2], [0.0, 0.0, 0.1]]]), surface=None)
    bubbles.fluid.phase[-2:] = Phase.LIQUID
    arrays = [bubbles.fluid]
    assert bubbles.effect.outer_pressure(bubbles.scene, arrays, Vapour(arrays)) == pytest.approx(
        101325.0 + WATER.rho_l * 9.81 * (0.2 - bubbles.fluid.z[:-2].mean()), rel=1e-9)
    bubbles.fluid.phase[-2:] = VAPOUR  # no liquid at all
    bubbles.ring()
    assert np.all(np.isfinite(bubbles.fluid.swell))


@pytest.mark.parametrize(("oscillation", "message"), [
    (dict(form="rayleigh_plesset", dim=2), "'rayleigh_plesset' needs a 3-D scene"),
    (dict(form="rayleigh_plesset", dim=3, expansion=None), "needs the effect 'expansion': pass expansion=Expansion"),
    (dict(form="relative", dim=2, lower=1.2), "oscillation.lower must be below oscillation.upper, got 1.2 and 1.15"),
])
def test_refused(oscillation, message):
    dim, without = oscillation.pop("dim"), "expansion" in oscillation
    oscillation.pop("expansion", None)
    with pytest.raises(ValueError, match=message):
        scheme = make_scheme(dim, **oscillation)
        if without:
            scheme.set_effects(expansion=None)
        scheme.effects["oscillation"].check(scheme.scene(), {})


@pytest.mark.parametrize(("oscillation", "words"), [
    (dict(form="hysteresis", period=0.01), "oscillation.period = 0.01 s has 10 steps"),
    (dict(form="rayleigh_plesset", slowdown=2.0), "a period of .* steps; it needs at least 20, with a slowdown of"),
    (dict(form="rayleigh_plesset"), None),
    (dict(form="hysteresis"), None),
])
def test_period_that_frames_cannot_show_is_reported(oscillation, words):
    scheme = make_scheme(3, **oscillation)
    sentences = list(scheme.effects["oscillation"].warnings(scheme.scene(), 1e-3))
    assert len(sentences) == (words is not None)
    if words:
        assert re.search(words, sentences[0])


# --- the step ---------------------------------------------------------------------------------------------------------


def pool(width, radius, *, dim, v_exp=1.0, **oscillation):
    """A bubble at rest in the middle of a pool of ``width`` spacings; vapour is as heavy as liquid: it stays put."""
    upper = np.array([width * DX] * dim + [0.0] * (3 - dim))
    scheme = make_scheme(dim, v_exp, box=tuple(upper + DX), **oscillation)
    common = dict(spacing=DX, dim=dim, rho0=WATER.rho_l)
    fluid = fluid_block((0.0,) * 3, upper, jitter=0.01, seed=1, **common)
    rim = upper + 3.0 * DX * (np.arange(3) == dim - 1)
    wall = box_vessel((0.0,) * 3, rim, kernel=scheme.kernel, **common)
    set_up(scheme, fluid, wall)
    scheme.set_temperature(fluid, WATER.T_sat - 2.0)
    middle = np.linalg.norm(vectors(fluid) - 0.5 * upper, axis=1) < radius * DX
    fluid.phase[middle], fluid.e[middle] = VAPOUR, WATER.L
    return Stepper(scheme, [fluid, wall]), fluid, middle


def test_stage_runs_only_while_a_bubble_is_off_its_bounds():
    stepper, fluid, _ = pool(16, 2.5, dim=2, form="relative", lower=0.5, upper=2.0, sweeps=2)
    stepper.settle()
    calls = record(stepper)
    stepper.step()
    assert calls == ["heat", "phases", "bubbles", "density", "forces"]
    object.__setattr__(stepper.scheme.effects["oscillation"], "lower", 1.9)
    calls.clear()
    stepper.step(2)
    assert calls == 2 * ["heat", "phases", "bubbles", "density", "oscillation", "oscillation", "density", "forces"]
    assert fluid.n_pushed[0] == 4 and fluid.sweeps[1] >= 4
    fluid.phase[:], fluid.e[:] = Phase.LIQUID, np.minimum(fluid.e, -1.0)  # no liquid has vapour's enthalpy
    calls.clear()
    stepper.step()
    assert "oscillation" not in calls


def test_no_sweeps_follow_the_pushes_if_they_are_not_closing():
    """The bubble then keeps all of the push, and the liquid round it is denser than the sweeps would leave it."""
    left = {}
    for closing in (True, False):
        stepper, fluid, _ = pool(16, 2.5, dim=2, form="relative", lower=1.2, upper=2.0, period=1e-3, closing=closing)
        stepper.settle()
        calls = record(stepper)
        stepper.step()
        assert calls == ["heat", "phases", "bubbles", "density", "oscillation", *(["density"] * closing), "forces"]
        place = vectors(fluid)[fluid.phase == VAPOUR]
        left[closing] = np.linalg.norm(place - place.mean(0), axis=1).mean() / DX
    assert left[False] > left[True] + 0.01, left


def test_pool_follows_a_hysteresis_and_stays_incompressible():
    """2-D: the radius swings with the period given, and the density error is no more than without the effect."""
    steps, error, radius = 60, {}, {}
    for smallest in (2, 1000):
        stepper, fluid, bubble = pool(24, 3.5, dim=2, form="hysteresis", min_particles=smallest,
                                      period=steps * 0.07 * np.sqrt(DX / 9.81))
        error[smallest], radius[smallest] = [], []
        for _ in range(4 * steps):
            stepper.step()
            x = vectors(fluid)[bubble]
            radius[smallest].append(np.mean(np.linalg.norm(x - x.mean(axis=0), axis=1)))
            error[smallest].append(fluid.density_error[0])
        assert (fluid.n_pushed[0] > 3 * steps) == (smallest == 2)
    with_it, without = (np.array(radius[key][steps:]) / at_rest(2, bubble.sum()) for key in (2, 1000))
    assert np.ptp(with_it) > 0.1 and np.ptp(with_it) > 2.0 * np.ptp(without)
    assert np.argmax(np.abs(np.fft.rfft(with_it - with_it.mean()))) == 3  # three periods in the record
    assert np.mean(error[2][steps:]) < 1.1 * np.mean(error[1000][steps:])
    assert max(error[2][steps:]) <= 1.1 * stepper.scheme.effects["density"].tolerance


def test_two_bubbles_of_a_pool_merge_without_a_jump():
    """One is compressed, the other expanded; they are thrown at each other."""
    stepper, fluid, _ = pool(12, 0.0, dim=3, form="rayleigh_plesset", slowdown=30.0)
    x = vectors(fluid) / DX
    for side, swell in ((-1.0, 0.85), (1.0, 1.15)):
        ball = np.linalg.norm(x - (6.0 + 2.4 * side, 6.0, 6.0), axis=1) < 1.9
        fluid.phase[ball], fluid.e[ball], fluid.swell[ball], fluid.u[ball] = VAPOUR, WATER.L, swell, -0.5 * side
    vapour, bubbles = fluid.phase == VAPOUR, []
    while stepper.t < 0.1 and bubbles[-1:] != [1]:
        swell, volume = fluid.swell.copy(), np.sum((fluid.m * fluid.swell)[vapour])
        stepper.step()
        bubbles.append(len(np.unique(fluid.bubble[vapour])))
        assert np.abs(fluid.swell - swell).max() < 0.03  # a jump to equal shares would be 0.15
    assert bubbles[0] == 2 and bubbles[-1] == 1
    assert np.sum((fluid.m * fluid.swell)[vapour]) == pytest.approx(volume, rel=1e-2) and np.ptp(swell[vapour]) > 0.1


@pytest.mark.filterwarnings("ignore:.*particles a period of")
def test_wall_moves_no_faster_than_a_step_allows():
    """In its own time this bubble rings more than once a step: it would collapse and rebound in one."""
    stepper, fluid, bubble = pool(12, 2.6, dim=3, v_exp=1.5, form="rayleigh_plesset", slowdown=1.0, lower=0.05)
    fluid.swell[bubble] = 2.2

    def radius():
        return np.cbrt(3.0 / (4.0 * np.pi) * np.sum((fluid.m * fluid.swell)[bubble]) / WATER.rho_l)

    before, moved, held = radius(), [], 0
    for _ in range(8):
        clamped = fluid.n_clamped[0]
        stepper.step()
        whole = len(np.unique(fluid.bubble[bubble])) == 1  # a particle that is torn off has a wall of its own
        moved += [abs(radius() - before) / DX] if whole else []
        before = radius()
        if whole and fluid.n_clamped[0] > clamped:
            held += 1
            flow = np.sum((fluid.m * fluid.swell_rate)[bubble]) / WATER.rho_l
            assert abs(flow) / (4.0 * np.pi * before**2) <= 0.1 * DX / stepper.dt * (1.0 + 1e-9)
    assert max(moved) == pytest.approx(0.1, rel=1e-6) and held >= 1

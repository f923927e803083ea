"""Cohesion of vapour, and its adhesion to sites, against a reference: all pairs, no neighbour lists."""
import numpy as np
import pytest
from forces import (
    DX,
    MAX_DISPLACEMENT,
    PULL,
    PULL_START,
    PULLED,
    SHARE,
    STIFFNESS,
    STRENGTH,
    VAPOUR,
    Forces,
    N,
    assert_equals_reference,
    between,
    particles,
    to_sites,
)
from harness import vectors
from scipy.optimize import brentq

DT = 4e-3  # s: STIFFNESS STRENGTH DT^2 = 0.24


def adhesion(forces):
    d, r = to_sites(forces)
    a = np.zeros((N, 3))
    for i, s in np.ndindex(*r.shape):
        if forces.fluid.phase[i] == VAPOUR and r[i, s] < 2.1 * DX:
            pull = 80.0 * np.sqrt(1.0 - r[i, s] / (2.1 * DX)) * min(1.0, r[i, s] / DX)
            a[i] += pull * d[i, s] / r[i, s]
    return a


def shape(q):
    """C(q) of Akinci et al. 2013, with a peak of 1."""
    return (64.0 * (1.0 - q) ** 3 * q**3) * (1.0 if q > 0.5 else 2.0) - (0.0 if q > 0.5 else 1.0) if q < 1.0 else 0.0


def cohesion(forces):
    """Accelerations (n, 3) by cohesion."""
    d, r, both = between(forces.fluid)
    m = forces.fluid.m
    a = np.zeros((len(m), 3))
    for i, j in np.ndindex(*r.shape):
        if i != j and both[i, j]:
            a[i] += STRENGTH * 2.0 * m[j] / (m[i] + m[j]) * shape(r[i, j] / (2.3 * DX)) * d[i, j] / r[i, j]
    return a


@pytest.fixture
def bubbles(cloud):
    """The random cloud in its initial state, without displacements by cohesion."""
    x, phase = vectors(cloud.fluid), cloud.fluid.phase.copy()
    for name in (*PULL, *PULLED, *PULL_START, "sx", "sy", "sz", "limited"):
        cloud.fluid.get(name)[:] = 0.0
    yield cloud
    cloud.fluid.prior[:], cloud.fluid.phase[:] = 1.0, phase
    for axis, name in enumerate("xyz"):
        cloud.fluid.get(name)[:] = x[:, axis]


def sweep(forces, dt):
    """One sweep of cohesion alone, and its displacement (n, 3)."""
    forces.run("cohesion", dt=dt)
    p = vectors(forces.fluid, *PULL)
    forces.run("cohesion_move", dt=dt)
    return p


def test_adhesion_equals_the_reference(cloud):
    assert_equals_reference(cloud, adhesion)


@pytest.mark.parametrize("felt", [1.0, 0.25])
def test_sweep_goes_a_share_of_the_way_to_the_force_where_the_particles_are(bubbles, felt):
    fluid, a = bubbles.fluid, cohesion(bubbles)
    done = 1e-5 * np.random.default_rng(5).normal(size=(N, 3))
    for axis, name in enumerate(PULLED):
        fluid.get(name)[:] = done[:, axis]
    begun = 2.0 * np.random.default_rng(6).normal(size=(N, 3))
    for axis, name in enumerate(PULL_START):
        fluid.get(name)[:] = begun[:, axis]
    fluid.prior[1] = felt
    bubbles.run("cohesion", dt=DT)
    theta = 1.0 / (1.0 + STIFFNESS * STRENGTH * DT**2)
    want = np.where((fluid.phase == VAPOUR)[:, None], felt * theta * (DT**2 * (a - begun) - done), 0.0)
    assert np.count_nonzero(np.any(want != 0.0, axis=1)) >= 8 and not fluid.limited.any()
    np.testing.assert_allclose(vectors(fluid, *PULL), want, rtol=0.0, atol=1e-12 * np.abs(want).max())
    np.testing.assert_allclose(vectors(fluid, *PULLED), done + want, rtol=0.0, atol=1e-12 * np.abs(want).max())


@pytest.mark.parametrize("dt", [0.0, DT, 10.0 * DT])
def test_force_for_other_schemes_is_that_of_the_sweeps_less_in_long_steps(bubbles, dt):
    a, fluid = cohesion(bubbles), bubbles.fluid
    got = bubbles.run("cohesion_force", start=7.0, dt=dt) - 7.0
    np.testing.assert_allclose(got, a / (1.0 + STIFFNESS * STRENGTH * dt**2), rtol=0.0, atol=1e-12 * np.abs(a).max())
    moved = np.any(got != 0.0, axis=1)
    assert moved.sum() >= 8 and np.all(fluid.phase[moved] == VAPOUR)
    impulse = fluid.m[:, None] * got
    np.testing.assert_allclose(impulse.sum(0), 0.0, atol=1e-12 * np.abs(impulse).sum())


def test_only_vapour_is_moved_and_by_what_its_velocity_feels(bubbles):
    fluid, x = bubbles.fluid, vectors(bubbles.fluid)
    p = sweep(bubbles, DT)
    np.testing.assert_allclose(vectors(fluid) - x, p, rtol=0.0, atol=1e-16)
    np.testing.assert_array_equal(vectors(fluid, "sx", "sy", "sz"), p)
    moved = np.any(p != 0.0, axis=1)
    assert moved.sum() >= 8 and np.all(fluid.phase[moved] == VAPOUR)


def test_displacement_in_a_sweep_is_limited(bubbles):
    bubbles.run("cohesion", dt=40.0 * DT)
    fluid = bubbles.fluid
    size = np.linalg.norm(vectors(fluid, *PULL), axis=1)
    assert size.max() == pytest.approx(MAX_DISPLACEMENT, rel=1e-14)
    np.testing.assert_array_equal(fluid.limited, size > 0.999999 * MAX_DISPLACEMENT)
    assert 2 <= fluid.limited.sum() < np.count_nonzero(size)
    np.testing.assert_array_equal(vectors(fluid, *PULLED), vectors(fluid, *PULL))


def test_momentum_is_conserved_with_unequal_masses_whatever_the_number_of_sweeps(bubbles):
    fluid = bubbles.fluid
    for _ in range(5):
        sweep(bubbles, DT)
        impulse = fluid.m[:, None] * vectors(fluid, *PULLED)
        np.testing.assert_allclose(impulse.sum(0), 0.0, atol=1e-14 * np.abs(impulse).sum())  # round-off of the sum
    assert not fluid.limited.any()


@pytest.mark.parametrize("dt", [DT, 4.0 * DT])
def test_pair_ends_where_the_force_of_the_end_brings_it(dt):
    """1.6 spacings apart: r = r0 - 2 dt^2 a(r), whose root SciPy finds; the force of the start leads elsewhere."""
    points, start = np.zeros((2, 3)), 1.6 * DX
    points[1, 0] = start
    forces = Forces(particles(points, 2), dim=2)
    for _ in range(100):
        sweep(forces, dt)
    end = brentq(lambda r: r - start + 2.0 * dt**2 * STRENGTH * shape(r / (2.3 * DX)), 0.1 * DX, start, xtol=1e-16)
    assert forces.fluid.x[1] - forces.fluid.x[0] == pytest.approx(end, rel=1e-9)
    explicit = start - 2.0 * dt**2 * STRENGTH * shape(start / (2.3 * DX))
    assert start - end > 0.02 * DX and abs(end - explicit) > 1e-3 * DX


def test_dense_bubble_settles_in_one_long_step():
    """A disc of 37 particles: the sweeps bring c to dt^2 a(x), though the first force alone moves it by .3 spacings."""
    side = np.arange(-4.0, 5.0)
    points = DX * np.array([(x, y, 0.0) for x in side for y in side if x * x + y * y < 3.5**2])
    forces, dt, left = Forces(particles(points, 2), dim=2), 2.0 * DT, []
    for _ in range(40):
        sweep(forces, dt)
        left.append(np.abs(dt**2 * cohesion(forces) - vectors(forces.fluid, *PULLED)).max() / DX)
    assert left[0] > 0.1 and left[-1] < 1e-3 and not forces.fluid.limited.any()


def test_next_step_begins_with_a_share_of_the_last_cohesion_whatever_its_length(bubbles):
    """As an acceleration, which the prediction applies; vapour that has become liquid begins without."""
    fluid = bubbles.fluid
    sweep(bubbles, DT)
    before = vectors(fluid, *PULLED) / DT**2
    assert np.count_nonzero(np.any(before != 0.0, axis=1)) >= 8
    for _ in range(2):  # the second time nothing has been moved in between
        np.testing.assert_allclose(bubbles.run("cohesion_start", dt=DT), SHARE * before, rtol=1e-14)
        np.testing.assert_allclose(vectors(fluid, *PULL_START), SHARE * before, rtol=1e-14)
        assert not vectors(fluid, *PULLED).any()
        before *= SHARE
    fluid.phase[:] = 0
    assert not bubbles.run("cohesion_start", dt=DT).any() and not vectors(fluid, *PULL_START).any()


def test_a_settled_bubble_stays_where_it_begins(bubbles):
    """What is in the prediction is not applied again: with c = dt^2 a of the last step, the sweeps move nothing."""
    fluid = bubbles.fluid
    for axis, name in enumerate(PULL_START):
        fluid.get(name)[:] = cohesion(bubbles)[:, axis]
    assert np.abs(cohesion(bubbles)).max() > 1.0
    np.testing.assert_allclose(sweep(bubbles, 2.0 * DT), 0.0, atol=1e-14)


@pytest.mark.parametrize("q, towards", [(0.8, 1), (0.5, 1), (0.1, -1)])
def test_cohesion_attracts_from_afar_and_repels_nearby(q, towards):
    points = np.zeros((2, 3))
    points[1, 0] = q * 2.3 * DX
    forces = Forces(particles(points, 2, [1.0, 3.0]), dim=2)
    p = sweep(forces, DT)
    assert p[0, 0] * towards > 0.0 and p[1, 0] * towards < 0.0
    if q == 0.5:  # the peak of the curve is 1: the strength is an acceleration between equals
        theta = 1.0 / (1.0 + STIFFNESS * STRENGTH * DT**2)
        assert p[0, 0] == pytest.approx(theta * DT**2 * STRENGTH * 2.0 * 3.0 / 4.0, rel=1e-14)


def test_coincident_vapour_stays_finite():
    points = np.zeros((3, 3))
    points[2, 0] = 10.0 * DX  # PySPH loses neighbours where all particles of a scene coincide
    forces = Forces(particles(points, 2), dim=2)
    assert not forces.run("adhesion").any() and not sweep(forces, DT).any()

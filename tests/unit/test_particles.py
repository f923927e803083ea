"""Particle factories: blocks, vessels, sites; what they hold, and what they refuse."""
from functools import partial

import numpy as np
import pytest
from pysph.base.kernels import CubicSpline, Gaussian, WendlandQuintic
from pysph.base.nnps import DomainManager, LinkedListNNPS

from pysph_boiling.particles import (
    BASE_PROPERTIES,
    NO_BUBBLE,
    Property,
    add_properties,
    akinci_volume,
    box_vessel,
    cylinder_vessel,
    fluid_array,
    fluid_block,
    lattice_density,
    lattice_stiffness,
    positions,
    site_array,
    sites_on_base,
    sites_on_disc,
    wall_array,
    weigh_walls,
)
from pysph_boiling.schemes.effects import BoxContainer
from pysph_boiling.schemes.pbf import PBFScheme

DX, RHO0 = 0.01, 958.0
ROUND_OFF = 1e-12


# --- fluid ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dim, upper, count", [
    (2, (0.05, 0.03), 15), (3, (0.05, 0.03, 0.02), 30), (2, (0.01, 0.01), 1)])
def test_block_fills_its_box_with_a_lattice(dim, upper, count):
    block = fluid_block((0.0,) * dim, upper, spacing=DX, dim=dim, rho0=RHO0, hdx=1.3)
    points = positions(block)
    assert len(points) == count == len(np.unique(points.round(9), axis=0))
    np.testing.assert_allclose(points[:, :dim].min(0), 0.5 * DX, rtol=ROUND_OFF)
    np.testing.assert_allclose(points[:, :dim].max(0), np.array(upper) - 0.5 * DX, rtol=ROUND_OFF)
    assert not points[:, dim:].any()
    np.testing.assert_array_equal(block.uid, np.arange(count))
    assert block.m.sum() == pytest.approx(RHO0 * np.prod(upper), rel=ROUND_OFF)  # the mass of what it fills
    np.testing.assert_allclose(block.h, 1.3 * DX, rtol=1e-15)


def test_block_jitter_is_bounded_and_reproducible():
    def block(seed, jitter=0.2):
        return positions(fluid_block((0, 0), (0.1, 0.1), spacing=DX, dim=2, rho0=RHO0, jitter=jitter, seed=seed))

    moved = block(1) - block(1, jitter=0.0)
    assert 0.1 * DX < np.abs(moved).max() <= 0.2 * DX and not moved[:, 2].any()
    np.testing.assert_array_equal(block(1), block(1))
    assert np.any(block(1) != block(2))


def test_block_keeps_what_is_inside():
    block = fluid_block((-0.05, -0.05), (0.05, 0.05), spacing=DX, dim=2, rho0=RHO0,
                        inside=lambda points: np.hypot(points[:, 0], points[:, 1]) < 0.031)
    assert len(block.x) == 32 and np.hypot(block.x, block.y).max() < 0.031
    np.testing.assert_array_equal(block.uid, np.arange(32))


def test_uid_and_no_bubble_fit_their_type():
    pa = fluid_array(np.zeros((2, 3)), spacing=DX, dim=2, rho0=RHO0)
    assert NO_BUBBLE == np.iinfo(pa.uid.dtype).max and pa.uid.dtype == np.uint32
    pa.uid[1] = NO_BUBBLE
    assert pa.uid[1] == NO_BUBBLE and pa.uid[1] > 2**31


@pytest.mark.parametrize("points, changes, message", [
    (np.zeros((0, 3)), {}, "particle array 'fluid' is empty"),
    ([[0.0, np.nan, 0.0]], {}, "positions of 'fluid' hold NaN or Inf"),
    ([[0.0, 0.0]], {}, r"positions of 'fluid' must have shape \(n, 3\), got \(1, 2\)"),
    ([[0.0] * 3], dict(spacing=0.0), "spacing must be > 0 m, got 0.0 m"),
    ([[0.0] * 3], dict(spacing=np.inf), "spacing must be > 0 m, got inf m"),
    ([[0.0] * 3], dict(rho0=-1.0), r"rho0 must be > 0 kg/m\^3, got -1.0"),
])
def test_cloud_that_cannot_be_is_refused(points, changes, message):
    with pytest.raises(ValueError, match=message):
        fluid_array(points, **{**dict(spacing=DX, dim=2, rho0=RHO0), **changes})


@pytest.mark.parametrize("upper, spacing, message", [
    ((0.1, 0.1), 0.0, "spacing must be > 0 m, got 0.0 m"),
    ((0.1, 0.1), -0.01, "spacing must be > 0 m, got -0.01 m"),
    ((0.1, -0.1), 0.01, "particle array 'fluid' is empty"),
    ((0.1, 0.004), 0.01, "particle array 'fluid' is empty"),
])
def test_block_that_cannot_be_is_refused(upper, spacing, message):
    with pytest.raises(ValueError, match=message):
        fluid_block((0.0, 0.0), upper, spacing=spacing, dim=2, rho0=RHO0)


def test_properties_are_added_once_and_state_is_written():
    pa = fluid_array(np.zeros((2, 3)), spacing=DX, dim=2, rho0=RHO0)
    pa.uid[:] = [5, 7]
    add_properties(pa, [*BASE_PROPERTIES, Property("e", "J/kg", "", state=True), Property("tmp", "-", "", "int")])
    np.testing.assert_array_equal(pa.uid, [5, 7])
    assert {"e", "uid", "x"} <= set(pa.output_property_arrays) and "tmp" not in pa.output_property_arrays
    assert pa.tmp.dtype == np.int32


# --- lattice and walls ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kernel", [CubicSpline, WendlandQuintic])
def test_lattice_density_is_that_of_a_large_block(kernel, dim):
    kernel, grad = kernel(dim=dim), [0.0, 0.0, 0.0]
    points = positions(fluid_block((-3.5,) * dim, (3.5,) * dim, spacing=1.0, dim=dim, rho0=1.0))
    density = squares = 0.0
    for point in points:
        r = float(np.linalg.norm(point))
        density += kernel.kernel(point, r, 1.2)
        kernel.gradient(point, r, 1.2, grad)
        squares += np.dot(grad, grad)
    np.testing.assert_allclose(lattice_density(kernel, dim=dim, hdx=1.2), (density, squares), rtol=ROUND_OFF)
    assert density == pytest.approx(1.0, abs=0.02)  # a lattice of unit volumes: the kernel integrates to 1


@pytest.mark.parametrize(("dim", "cells"), [(2, 12), (3, 8)])
@pytest.mark.parametrize("kernel", [CubicSpline, WendlandQuintic])
def test_lattice_stiffness_is_the_largest_eigenvalue_of_a_sweep(kernel, dim, cells):
    """A periodic lattice has the waves whose length divides it; its sweep is the matrix J J^T over its diagonal."""
    kernel, grad = kernel(dim=dim), [0.0, 0.0, 0.0]
    points = np.zeros((cells**dim, 3))
    points[:, :dim] = np.array(list(np.ndindex(*(cells,) * dim)))
    gradients = np.zeros((len(points), len(points), 3))  # of the density at the first with respect to the second
    apart = (points[:, None] - points[None] + cells // 2) % cells - cells // 2
    apart[..., dim:] = 0.0
    for i, j in zip(*np.nonzero(np.linalg.norm(apart, axis=2) < 2.4)):
        kernel.gradient(apart[i, j], float(np.linalg.norm(apart[i, j])), 1.2, grad)
        gradients[i, j] = np.negative(grad)
    jacobian = gradients.reshape(len(points), -1)  # the own gradient of a lattice is zero
    sweep = jacobian @ jacobian.T / np.sum(jacobian[0]**2)
    largest = np.linalg.eigvalsh(sweep)[-1]
    assert lattice_stiffness(kernel, dim=dim, hdx=1.2, waves=cells // 2 + 1) == pytest.approx(largest, rel=1e-9)
    assert lattice_stiffness(kernel, dim=dim, hdx=1.2) == pytest.approx(largest, rel=0.1)


@pytest.mark.parametrize("dim", [2, 3])
def test_akinci_volume_of_a_lone_particle_and_of_a_plane(dim):
    kernel, h = CubicSpline(dim=dim), 1.2 * DX
    lone = akinci_volume(np.array([[0.3, 0.2, 0.1 * (dim - 2)]]), kernel, h=h, dim=dim)
    np.testing.assert_allclose(lone, 1.0 / kernel.kernel([0.0] * 3, 0.0, h), rtol=ROUND_OFF)

    plane = positions(fluid_block((-0.045,) * (dim - 1), (0.045,) * (dim - 1), spacing=DX, dim=dim - 1, rho0=1.0))
    total = sum(kernel.kernel(point, float(np.linalg.norm(point)), h) for point in plane)
    volume = akinci_volume(plane, kernel, h=h, dim=dim)
    middle = np.linalg.norm(plane, axis=1) < 1e-9
    np.testing.assert_allclose(volume[middle], [1.0 / total], rtol=1e-9)  # of the spline through the kernel
    assert np.all(volume >= volume[middle] * (1.0 - 1e-8))  # fewer neighbours at the rim: a larger volume


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kernel", [CubicSpline, WendlandQuintic, Gaussian])
def test_akinci_volume_of_irregular_particles_is_the_plain_sum(kernel, dim, monkeypatch):
    kernel, h, n = kernel(dim=dim), 1.2 * DX, 200
    points = np.zeros((n, 3))
    points[:, :dim] = np.random.default_rng(0).uniform(0.0, n**(1.0 / dim) * DX, (n, dim))
    apart = points[:, None] - points[None]
    r = np.linalg.norm(apart, axis=2)
    plain = [sum(kernel.kernel(apart[i, j], r[i, j], h) for j in range(n)) for i in range(n)]
    monkeypatch.setattr("pysph_boiling.particles.NEIGHBOUR_CHUNK", 60)
    np.testing.assert_allclose(akinci_volume(points, kernel, h=h, dim=dim) * plain, 1.0, rtol=3e-10)  # of the spline


def test_wall_particles_weigh_their_akinci_volume():
    kernel, points = CubicSpline(dim=2), positions(fluid_block((0, 0), (0.1, 0.02), spacing=DX, dim=2, rho0=RHO0))
    hot = points[:, 0] < 0.04
    wall = wall_array(points, spacing=DX, dim=2, rho0=RHO0, kernel=kernel, hdx=1.3, heated=hot)
    np.testing.assert_array_equal(wall.m, RHO0 * akinci_volume(points, kernel, h=1.3 * DX, dim=2))
    np.testing.assert_array_equal(wall.heated, hot)
    assert np.all(wall.h == 1.3 * DX) and np.all(wall.rho == RHO0)


# --- walls of a periodic domain ---------------------------------------------------------------------------------------

CELLS = 16


def floor(dim, domain=None):
    """Two layers of wall under a domain that is periodic along the floor, their start off its border."""
    sides = (CELLS * DX,) * (dim - 1)
    slab = fluid_block((0.0,) * (dim - 1) + (-2 * DX,), (*sides, 0.0), spacing=DX, dim=dim, rho0=RHO0)
    return wall_array(positions(slab), spacing=DX, dim=dim, rho0=RHO0, kernel=CubicSpline(dim=dim), domain=domain)


def periodic(dim, cells=CELLS):
    axes = "xy"[:dim - 1]
    return DomainManager(**{f"{axis}max": cells * DX for axis in axes}, **{f"{axis}min": 0.0 for axis in axes},
                         **{f"periodic_in_{axis}": True for axis in axes})


def layers(wall):
    """Masses of each layer of a floor."""
    height = wall.z if np.ptp(wall.z) else wall.y
    return [wall.m[np.abs(height - middle) < 0.1 * DX] for middle in (-0.5 * DX, -1.5 * DX)]


@pytest.mark.parametrize("dim", [2, 3])
def test_walls_weigh_the_same_everywhere_in_a_periodic_domain(dim):
    given, told = floor(dim, periodic(dim)), floor(dim)
    assert np.ptp(layers(told)[0]) > 0.2 * layers(told)[0].min()  # the border counts as a rim
    weigh_walls([told], kernel=CubicSpline(dim=dim), dim=dim, domain=periodic(dim))
    np.testing.assert_array_equal(told.m, given.m)
    for m in layers(given):
        np.testing.assert_allclose(m, m[0], rtol=1e-9)
    middle = np.hypot(*(positions(told)[:, :2] - 0.5 * CELLS * DX * (np.arange(2) < dim - 1)).T).argmin()
    assert told.m[middle] == pytest.approx(floor(dim).m[middle], rel=1e-8)  # far from the border nothing changes


def test_masses_of_the_users_own_stay_in_a_periodic_domain():
    wall = floor(2)
    wall.m[::2] = 7.0
    weigh_walls([wall], kernel=CubicSpline(dim=2), dim=2, domain=periodic(2))
    assert np.all(wall.m[::2] == 7.0)
    np.testing.assert_array_equal(wall.m[1::2], floor(2, periodic(2)).m[1::2])


def scheme_in(domain, container):
    """A scheme that has met its domain, and its wall."""
    scheme, wall = PBFScheme(["fluid"], ["wall"], dim=2, spacing=DX, rho0=RHO0, container=container), floor(2)
    arrays = [fluid_block((0.0, 0.0), (CELLS * DX, 4 * DX), spacing=DX, dim=2, rho0=RHO0), wall]
    scheme.setup_properties(arrays)
    LinkedListNNPS(dim=2, particles=arrays, radius_scale=2.0, domain=domain)
    scheme.enter_domain(domain, arrays)
    return scheme, wall


WIDE = BoxContainer(lower=(-1.0, -0.1, 0.0), upper=(1.0, 0.5, 0.0))


def test_scheme_that_meets_a_periodic_domain_sets_its_walls_right():
    scheme, wall = scheme_in(periodic(2), WIDE)
    n = wall.get_number_of_particles(True)
    np.testing.assert_array_equal(wall.m[:n], floor(2, periodic(2)).m)
    np.testing.assert_allclose(scheme.scene().period, (CELLS * DX, 0.0, 0.0))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("closed", [False, True])
def test_walls_in_two_arrays_weigh_what_they_do_in_one(dim, closed):
    """A floor cut at a third of its width. Each array counts its own particles alone until the scheme has seen both."""
    one, domain = floor(dim, periodic(dim) if closed else None), periodic(dim) if closed else None
    points, halves = positions(one), [one.x < 5.0 * DX, one.x >= 5.0 * DX]
    walls = [wall_array(points[half], spacing=DX, dim=dim, rho0=RHO0, kernel=CubicSpline(dim=dim), name=name,
                        heated=1.0 * (name == "right"))
             for name, half in zip(("left", "right"), halves)]
    lone = [wall.m.copy() for wall in walls]
    walls[0].m[3] = 7.0  # the user's own
    container = BoxContainer(lower=(-1.0,) * 3, upper=(1.0,) * 3)
    scheme = PBFScheme(["fluid"], ["left", "right"], dim=dim, spacing=DX, rho0=RHO0, container=container)
    arrays = [fluid_block((0.0,) * dim, (CELLS * DX,) * dim, spacing=DX, dim=dim, rho0=RHO0), *walls]
    scheme.setup_properties(arrays)
    if closed:
        LinkedListNNPS(dim=dim, particles=arrays, radius_scale=2.0, domain=domain)
        scheme.enter_domain(domain, arrays)
    assert walls[0].m[3] == 7.0 and np.all(walls[1].heated == 1)
    for wall, half, m in zip(walls, halves, lone):
        n, others = len(m), np.arange(len(m)) != (3 if wall is walls[0] else -1)
        np.testing.assert_allclose(wall.m[:n][others], one.m[half][others], rtol=1e-8)  # distances: nine digits
        assert np.any(m > 1.2 * one.m[half]), "the joint made no difference"
    before = [wall.m.copy() for wall in walls]
    scheme.setup_properties(arrays)
    for wall, m in zip(walls, before):
        np.testing.assert_allclose(wall.m, m, rtol=1e-15)  # right already


@pytest.mark.parametrize("domain, container, message", [
    (periodic(2, 4), WIDE, "periodic domain must be at least 0.048 m long along x.*got 0.04 m"),
    (periodic(2), BoxContainer(lower=(0.0, 0.0, 0.0), upper=(CELLS * DX, 0.5, 0.0)),
     "periodic along x, from 0 to 0.16 m, but the container holds particles between 0.001 and 0.159 m"),
])
def test_periodic_domain_that_cannot_be_is_refused(domain, container, message):
    with pytest.raises(ValueError, match=message):
        scheme_in(domain, container)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("layers", [1, 2, 3])
def test_box_vessel_is_hollow_and_closed_but_for_its_top(dim, layers):
    lower, cells = np.array([0.1, -0.05, 0.2])[:dim], np.array([8, 4, 5])[:dim]
    upper = lower + DX * cells
    wall = box_vessel(lower, upper, spacing=DX, dim=dim, rho0=RHO0, kernel=CubicSpline(dim=dim), layers=layers,
                      heated_fraction=0.5)
    points = positions(wall)[:, :dim]
    grown = cells + 2 * layers * (np.arange(dim) < dim - 1) + layers * (np.arange(dim) == dim - 1)
    assert len(points) == len(np.unique(points.round(9), axis=0)) == np.prod(grown) - np.prod(cells)
    outside = np.maximum(lower - points, points - upper).max(1)
    assert outside.min() == pytest.approx(0.5 * DX, rel=1e-9)  # nothing inside; the first layer is half a spacing off
    assert points[:, -1].max() < upper[-1]  # no lid

    hot = points[wall.heated == 1]
    assert len(hot) == np.prod(cells[:-1] / 2)  # the middle half
    np.testing.assert_allclose(hot[:, -1], lower[-1] - 0.5 * DX, rtol=ROUND_OFF)
    middle = 0.5 * (lower + upper)
    assert np.all(np.abs(hot - middle)[:, :-1] < 0.25 * (upper - lower)[:-1])


def test_box_vessel_without_heated_fraction_is_cold():
    wall = box_vessel((0, 0), (0.1, 0.1), spacing=DX, dim=2, rho0=RHO0, kernel=CubicSpline(dim=2))
    assert not wall.heated.any()


def test_cylinder_vessel_is_hollow_and_closed_but_for_its_top():
    radius, height = 0.05, 0.06
    wall = cylinder_vessel(radius, height, spacing=DX, rho0=RHO0, kernel=CubicSpline(dim=3), heated_fraction=0.5)
    points, r = positions(wall), np.hypot(wall.x, wall.y)
    side, floor = r > radius, r <= radius
    assert np.all(points[floor, 2] < 0.0) and points[:, 2].max() < height  # nothing inside, no lid
    np.testing.assert_allclose(np.unique(r[side].round(9)), [radius + 0.5 * DX, radius + 1.5 * DX], rtol=1e-7)
    np.testing.assert_allclose(np.unique(points[:, 2].round(9)), DX * (np.arange(-2, 6) + 0.5), rtol=1e-7)
    for z in (-0.5 * DX, -1.5 * DX):  # each layer of the floor has its area, to a ring of half a spacing
        count = np.count_nonzero(floor & np.isclose(points[:, 2], z))
        assert np.pi * (radius - 0.5 * DX) ** 2 < count * DX**2 < np.pi * (radius + 0.5 * DX) ** 2
    ring = points[side & np.isclose(points[:, 2], 0.5 * DX) & np.isclose(r, radius + 0.5 * DX)]
    gaps = np.linalg.norm(ring - np.roll(ring, 1, axis=0), axis=1)
    assert np.all(gaps <= DX) and np.all(gaps > 0.9 * DX)
    hot = wall.heated == 1
    np.testing.assert_array_equal(hot, (r < 0.5 * radius) & (points[:, 2] > -DX) & (points[:, 2] < 0.0))
    assert hot.any()


# --- sites ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("pattern", ["regular", "random"])
@pytest.mark.parametrize("count", [1, 2, 5, 7, 12, 50])
def test_sites_lie_apart_on_the_floor(count, pattern, dim):
    lower, upper = np.array([0.1, -0.2, 0.3])[:dim], np.array([0.5, 0.2, 0.6])[:dim]
    sites = sites_on_base(count, lower=lower, upper=upper, dim=dim, pattern=pattern, seed=3)
    assert sites.shape == (count, 3)
    np.testing.assert_array_equal(sites[:, dim - 1], lower[-1])
    assert np.all((sites[:, :dim - 1] > lower[:-1]) & (sites[:, :dim - 1] < upper[:-1]))
    assert not sites[:, dim:].any()
    if count > 1 and pattern == "regular":
        near = np.linalg.norm(sites[:, None] - sites, axis=2)[~np.eye(count, dtype=bool)].min()
        cell = 0.4 / count if dim == 2 else 0.4 / (count // int(np.sqrt(count)) + 1)  # each has a cell to itself
        assert near >= cell * (1.0 - 1e-9)


def test_regular_sites_by_hand():
    """2-D: the middles of equal parts. 3-D: rows of a near-square grid, the first rows one longer."""
    flat = sites_on_base(4, lower=(0.0, 1.0), upper=(8.0, 9.0), dim=2)
    np.testing.assert_allclose(flat, [[1, 1, 0], [3, 1, 0], [5, 1, 0], [7, 1, 0]], rtol=ROUND_OFF)
    grid = sites_on_base(5, lower=(0.0, 0.0, 2.0), upper=(12.0, 4.0, 9.0), dim=3)
    np.testing.assert_allclose(grid, [[2, 1, 2], [6, 1, 2], [10, 1, 2], [3, 3, 2], [9, 3, 2]], rtol=ROUND_OFF)


def test_random_sites_are_reproducible():
    def sites(seed):
        return sites_on_base(9, lower=(0, 0, 0), upper=(1, 1, 1), dim=3, pattern="random", seed=seed)

    np.testing.assert_array_equal(sites(4), sites(4))
    assert np.all(sites(4)[:, :2] != sites(5)[:, :2])


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("count", [6, 40])
def test_random_sites_keep_their_distance_and_fill_the_floor(count, dim):
    """In each of 60 draws they are 0.7 mean distances apart; all together they are uniform over the floor."""
    places = []
    for seed in range(60):
        sites = sites_on_base(count, lower=(0, 0, 0), upper=(1, 1, 1), dim=dim, pattern="random", seed=seed)
        near = np.linalg.norm(sites[:, None] - sites, axis=2)[~np.eye(count, dtype=bool)]
        assert near.min() >= 0.7 * count ** (-1.0 / (dim - 1))
        places.append(sites[:, :dim - 1])
    number = 60 * count
    assert len(np.unique(np.concatenate(places))) == number * (dim - 1)
    counts = np.histogram(np.concatenate(places)[:, 0], 4, (0.0, 1.0))[0]
    assert np.all(abs(counts - number / 4) < 4.0 * np.sqrt(number * 0.1875)), counts  # to four standard deviations


@pytest.mark.parametrize("count", [1, 2, 7, 40])
def test_regular_sites_on_a_disc_share_its_area(count):
    """Half of the area holds half of the sites, each half of the disc too, and none is crowded."""
    sites = sites_on_disc(count, radius=3.0)
    assert sites.shape == (count, 3) and not sites[:, 2].any()
    r = np.hypot(sites[:, 0], sites[:, 1])
    np.testing.assert_allclose(np.sort(r), 3.0 * np.sqrt((np.arange(count) + 0.5) / count), rtol=ROUND_OFF)
    if count == 40:
        assert abs(np.count_nonzero(sites[:, 0] > 0.0) - 20) <= 2 and abs(np.count_nonzero(sites[:, 1] > 0.0) - 20) <= 2
        near = np.linalg.norm(sites[:, None] - sites, axis=2)[~np.eye(count, dtype=bool)].min()
        assert near > 0.8 * 3.0 * np.sqrt(np.pi / count)  # mean distances, 0.87 measured


@pytest.mark.parametrize("count", [1, 5, 48])
def test_random_sites_on_a_disc_keep_their_distance(count):
    places = []
    for seed in range(40):
        sites = sites_on_disc(count, radius=2.0, pattern="random", seed=seed)
        near = np.linalg.norm(sites[:, None] - sites, axis=2)[~np.eye(count, dtype=bool)]
        assert np.all(near > 0.58 * 2.0 * np.sqrt(np.pi / count))  # 0.6 of a mean distance, whose area was sampled
        places.append(sites)
    r = np.hypot(*np.concatenate(places).T[:2])
    assert r.max() < 2.0 and np.mean(r < 1.0) == pytest.approx(0.25, abs=0.15 if count < 48 else 0.03)
    np.testing.assert_array_equal(places[3], sites_on_disc(count, radius=2.0, pattern="random", seed=3))


def test_sites_on_no_disc_are_refused():
    with pytest.raises(ValueError, match="radius of the floor must be > 0 m, got 0.0 m"):
        sites_on_disc(3, radius=0.0)
    with pytest.raises(ValueError, match="must be a whole number >= 1, got 0"):
        sites_on_disc(0, radius=1.0)
    with pytest.raises(ValueError, match="'regular' or 'random', got 'ring'"):
        sites_on_disc(3, radius=1.0, pattern="ring")


@pytest.mark.parametrize("count, pattern, message", [
    (0, "regular", "number of nucleation sites must be a whole number >= 1, got 0"),
    (2.5, "regular", "number of nucleation sites must be a whole number >= 1, got 2.5"),
    (3, "hexagonal", "pattern of sites must be 'regular' or 'random', got 'hexagonal'"),
])
def test_sites_that_cannot_be_are_refused(count, pattern, message):
    with pytest.raises(ValueError, match=message):
        sites_on_base(count, lower=(0, 0), upper=(1, 1), dim=2, pattern=pattern)


def test_sites_reach_as_far_as_asked():
    sites = site_array([[0.0, 0.0, 0.0]], reach=2.4 * DX, spacing=DX, radius_scale=2.0)
    assert sites.name == "sites" and sites.h[0] * 2.0 == pytest.approx(2.4 * DX, rel=1e-15)
    with pytest.raises(ValueError, match="reach of the sites must be > 0 m, got 0.0 m"):
        site_array([[0.0] * 3], reach=0.0, spacing=DX)


def test_activation_superheats_of_sites():
    points = np.eye(3)
    np.testing.assert_array_equal(site_array(points, reach=DX, spacing=DX).activation, 0.0)
    np.testing.assert_array_equal(site_array(points, reach=DX, spacing=DX, activation=[1, 2, 3]).activation, [1, 2, 3])
    for activation, message in (([1.0, 2.0], r"must be a number or have shape \(3,\), got \(2,\)"),
                                (-1.0, "must be finite and >= 0 K"), ([1.0, np.inf, 2.0], "must be finite and >= 0 K")):
        with pytest.raises(ValueError, match=message):
            site_array(points, reach=DX, spacing=DX, activation=activation)


def test_output_properties_of_one_array_are_its_own():
    """PySPH's schemes give one list to several arrays: what is added to one must not be asked of another."""
    fluid, wall = (fluid_block((0.0, 0.0), (2 * DX, 2 * DX), spacing=DX, dim=2, rho0=RHO0, name=name)
                   for name in ("fluid", "wall"))
    shared = ["x", "y", "rho"]
    for pa in (fluid, wall):
        pa.set_output_arrays(shared)
    rows = [Property("e", "J/kg", "enthalpy", state=True), Property("x", "m", "position", state=True),
            Property("k", "W/(m K)", "conductivity")]
    add_properties(fluid, rows)
    add_properties(fluid, rows)
    assert fluid.output_property_arrays == ["x", "y", "rho", "e"]
    assert wall.output_property_arrays == shared == ["x", "y", "rho"] and "e" not in wall.properties


@pytest.mark.parametrize("inside", [None, lambda at: np.linalg.norm(at[:, :2] - 0.05, axis=1) < 0.04],
                         ids=["box", "cylinder"])
@pytest.mark.parametrize("of", [1, 3, 50])
def test_parts_of_a_block_are_the_block(inside, of):
    """With the same numbers and random displacements, also where a part is empty."""
    block = partial(fluid_block, (0.0, 0.0, 0.0), (0.1, 0.1, 0.13), spacing=0.01, dim=3, rho0=1.0, jitter=0.3, seed=5,
                    inside=inside)
    whole, parts = block(), [block(part=(number, of)) for number in range(of)]
    assert whole.get_number_of_particles() > 500
    for name in ("x", "y", "z", "uid", "m"):
        np.testing.assert_array_equal(np.concatenate([pa.get(name) for pa in parts]), whole.get(name))
    if inside is not None and of == 50:
        assert 0 in [pa.get_number_of_particles() for pa in parts]

"""The neighbour search finds what PySPH's linked lists find, in one order whatever the threads."""
import ctypes
import itertools
import unittest

import numpy as np
import pytest
from compyle.config import get_config
from cyarray.carray import LongArray, UIntArray
from pysph.base.nnps import DomainManager, LinkedListNNPS, get_number_of_threads
from pysph.base.nnps_base import set_number_of_threads
from pysph.base.utils import get_particle_array

from pysph_boiling.search import sorted_cell_nnps

THREADS = (1, 2, 3)


@pytest.fixture(autouse=True)
def threads_as_before(monkeypatch):
    """The search is compiled with OpenMP; a test may change the number of threads."""
    monkeypatch.setattr(get_config(), "use_openmp", True)
    before = get_number_of_threads()
    yield
    set_number_of_threads(before)


def array(points, h, name="fluid", **properties):
    """A particle array at ``points`` (n, dim) with smoothing lengths ``h``, a number or (n,)."""
    points = np.asarray(points, float)
    places = {axis: points[:, k] if k < points.shape[1] else np.zeros(len(points)) for k, axis in enumerate("xyz")}
    return get_particle_array(name=name, h=h * np.ones(len(points)), **places, **properties)


def lists(nnps):
    """(destination, source) -> the list of each particle."""
    found, number = {}, UIntArray()
    for d, s in itertools.product(range(nnps.narrays), repeat=2):
        found[d, s] = []
        nnps.set_context(s, d)  # without which PySPH's own crash
        for i in range(nnps.particles[d].get_number_of_particles()):
            nnps.get_nearest_particles(s, d, i, number)
            found[d, s].append(number.get_npy_array()[:number.length].copy())
    return found


def sets(found):
    return {pair: [np.sort(one) for one in rows] for pair, rows in found.items()}


def assert_same(found, expected):
    assert found.keys() == expected.keys()
    for pair, rows in expected.items():
        np.testing.assert_array_equal([len(row) for row in found[pair]], [len(row) for row in rows], err_msg=f"{pair}")
        if rows:
            np.testing.assert_array_equal(*(np.concatenate(one) for one in (found[pair], rows)), err_msg=f"{pair}")


def raw(nnps, d, s):
    """The lists as loops of one's own read them, filled up to a multiple of eight; and their lengths."""
    begin, count = (np.asarray(one) for one in nnps.lists(d, s))
    return [np.array((ctypes.c_uint * (-(-int(n) // 8) * 8)).from_address(int(at))) if n else np.zeros(0, int)
            for at, n in zip(begin, count)], count


def brute(arrays, scale):
    """Neighbours by PySPH's expression, over all pairs."""
    found = {}
    for (d, dest), (s, source) in itertools.product(enumerate(arrays), repeat=2):
        places = [[pa.get(axis, only_real_particles=False) for axis in "xyzh"] for pa in (dest, source)]
        apart = [places[1][k][None, :] - places[0][k][:, None] for k in range(3)]
        r2 = apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2]
        reach = [(scale * h) * (scale * h) for h in (places[0][3], places[1][3])]
        near = (r2 < reach[0][:, None]) | (r2 < reach[1][None, :])
        found[d, s] = [np.flatnonzero(row) for row in near]
    return found


def check(arrays, dim, *, scale=2.0, domain=None, expected=None):
    """Every way of ours to find neighbours gives PySPH's; the lists."""
    ours = sorted_cell_nnps()(dim, arrays, scale, domain=domain and domain())
    if expected is None:
        theirs = LinkedListNNPS(dim, arrays, scale, domain=domain and domain(), cache=True)
        expected = sets(lists(theirs))
        ours.update_domain()
        ours.update()
    found = lists(ours)
    assert_same(sets(found), expected)
    for threads in THREADS:
        set_number_of_threads(threads)
        ours.update()
        assert_same(lists(ours), found)
    ours.use_lanes(False)
    assert_same(lists(ours), found)
    ours.set_use_cache(False)
    assert_same(lists(ours), found)
    return found


def grid(*axes):
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(axes))


# --- the same neighbours ----------------------------------------------------------------------------------------------

@pytest.mark.parametrize("dim", [1, 2, 3])
def test_random_clouds(dim):
    rng = np.random.default_rng(dim)
    h = {1: 0.002, 2: 0.03, 3: 0.06}[dim]
    check([array(rng.random((n, dim)), h, name) for name, n in (("a", 1500), ("b", 400), ("c", 3))], dim)


@pytest.mark.parametrize("spacing", [0.5, 0.1, 1.0 / 3.0, 4e-3])
@pytest.mark.parametrize("dim", [2, 3])
def test_lattice_with_pairs_at_the_support_exactly(dim, spacing):
    points = spacing * grid(*[np.arange({2: 40, 3: 12}[dim])] * dim)
    found = check([array(points, spacing), array(points + spacing, spacing, "wall")], dim)
    middle = np.argmin(np.sum((points - points.mean(axis=0) - 1e-3 * spacing)**2, axis=1))
    if spacing == 0.5:  # two spacings are the support, and a pair at the support is none
        assert len(found[0, 0][middle]) == {2: 9, 3: 27}[dim]


@pytest.mark.parametrize("most", [2.0, 30.0])
def test_smoothing_lengths_that_vary(most):
    rng = np.random.default_rng(7)
    arrays = [array(rng.random((n, 3)), 0.01 * most**rng.random(n), name) for name, n in (("a", 1200), ("b", 300))]
    check(arrays, 3)


def test_arrays_of_different_smoothing_lengths():
    """Cells fit the smaller one; the larger one, here 20 times, reaches over several."""
    rng = np.random.default_rng(8)
    for large in (0.05, 0.2, 0.6):
        check([array(rng.random((1500, 3)), 0.03), array(rng.random((5, 3)), large, "sites")], 3)


@pytest.mark.parametrize("scale", [1.0, 3.0])
def test_radius_scale(scale):
    check([array(np.random.default_rng(2).random((900, 3)), 0.06)], 3, scale=scale)


def test_empty_arrays_and_single_particles():
    empty, one = np.zeros((0, 3)), [[0.3, 0.0, 0.0]]
    cls = sorted_cell_nnps()
    assert lists(cls(3, [array(empty, 0.1)]))[0, 0] == []
    assert [len(rows) for rows in lists(cls(3, [array(empty, 0.1), array(empty, 0.1, "b")])).values()] == [0] * 4
    found = check([array(one, 0.1), array(empty, 0.1, "none")], 3)
    assert [row.tolist() for row in found[0, 0]] == [[0]] and [row.tolist() for row in found[0, 1]] == [[]]
    check([array(empty, 0.1, "none"), array(np.random.default_rng(0).random((300, 3)), 0.1)], 3)
    assert sets(lists(cls(3, [array(one * 2, 0.0)])))[0, 0][0].tolist() == []  # no smoothing length, no neighbours


def test_particles_far_from_all_others():
    """Threads whose first cells have no candidates have no buffer yet."""
    a, b = array(grid([0.0, 5.0], [0.0, 3.0], [0.0]), 0.1), array([[9.0, 9.0, 0.5]], 0.1, "b")
    for _ in range(10):
        assert [len(row) for row in check([a, b], 3)[0, 1]] == [0] * 4


def test_particles_in_one_place():
    found = check([array(np.full((200, 3), 0.7), 0.1)], 3)
    assert all(len(row) == 200 for row in found[0, 0])


@pytest.mark.parametrize("axis", range(3))
def test_long_thin_domain(axis):
    points = np.random.default_rng(3).random((4000, 3)) * 0.2
    points[:, axis] *= 2000.0
    check([array(points, 0.1)], 3)


@pytest.mark.parametrize("offset", [1e4, -1e4, 1e7])
def test_far_from_the_origin(offset):
    rng = np.random.default_rng(4)
    arrays = [array(offset + 0.05 * rng.random((n, 3)), 0.004, name) for name, n in (("a", 1000), ("b", 200))]
    check(arrays, 3, expected=brute(arrays, 2.0))


@pytest.mark.parametrize("unit", [1e-9, 1e-6, 1e6, 1e15])
def test_any_unit(unit):
    arrays = [array(unit * np.random.default_rng(5).random((700, 3)), unit * 0.07)]
    check(arrays, 3, expected=brute(arrays, 2.0))


@pytest.mark.parametrize("away", [[1e3, 0.0, 0.0], [1e6, -1e6, 1e6], [1e18, 0.0, 1e18], [0.0, 1e300, 0.0]])
def test_particles_that_flew_away(away):
    """Cells stay as many as the particles call for, and those that are left are found where they are."""
    rng = np.random.default_rng(6)
    points = np.concatenate([rng.random((1000, 3)), [away], np.array(away) + 0.3 * rng.random((15, 3))])
    arrays = [array(points, 0.05)]
    with np.errstate(over="ignore"):
        check(arrays, 3, expected=brute(arrays, 2.0))
    assert sorted_cell_nnps()(3, arrays).n_cells <= 1 << 20


def test_few_particles_in_a_wide_space():
    arrays = [array(1e5 * np.random.default_rng(9).random((1200, 3)), 0.5 * 1e3)]
    arrays[0].h[:5] = 1e-3
    check(arrays, 3, expected=brute(arrays, 2.0))
    arrays = [array(1e8 * np.random.default_rng(9).random((1200, 3)), 1.0)]
    check(arrays, 3, expected=brute(arrays, 2.0))
    assert sorted_cell_nnps()(3, arrays).n_cells <= 1 << 20


@pytest.mark.parametrize("seed", range(40))
def test_any_scene(seed):
    """Clouds, lattices and clusters of any size, shape, place and smoothing length, next to each other."""
    rng = np.random.default_rng(1000 + seed)
    dim, arrays = int(rng.integers(1, 4)), []
    place, size = rng.normal(0.0, 10.0**rng.uniform(-3, 5), dim), 10.0**rng.uniform(-2, 2, dim)
    for k in range(rng.integers(1, 4)):
        n = int(rng.integers(0, 400))
        points = rng.random((n, dim)) if rng.random() < 0.4 else rng.integers(0, 8, (n, dim)) / 8.0
        if rng.random() < 0.3:
            points = points**4
        h = 10.0**rng.uniform(-1.5, 0.0) * size.mean() * (1.0 if rng.random() < 0.5 else rng.uniform(0.3, 3.0, n))
        arrays.append(array(place + size * points, h / 8.0, f"a{k}"))
    check(arrays, dim, scale=float(rng.choice([1.0, 2.0, 3.0])))


# --- periodic domains -------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("dim", [2, 3])
def test_periodic_domain(dim):
    def domain():
        ends = {f"{axis}{end}": float(end == "max") for axis in "xyz"[:dim] for end in ("min", "max")}
        return DomainManager(**ends, **{f"periodic_in_{axis}": True for axis in "xyz"[:dim]})

    rng = np.random.default_rng(dim)
    h = {2: 0.04, 3: 0.09}[dim]
    arrays = [array(rng.random((n, dim)), h, name) for name, n in (("a", 500), ("b", 60))]
    check(arrays, dim, domain=domain)
    assert all(pa.get_number_of_particles() > pa.get_number_of_particles(True) for pa in arrays)


def test_mirrored_domain():
    arrays = [array(np.random.default_rng(1).random((300, 2)), 0.04)]
    check(arrays, 2, domain=lambda: DomainManager(xmin=0.0, xmax=1.0, mirror_in_x=True))
    assert arrays[0].get_number_of_particles() > 300


def test_as_many_threads_as_are_asked_for_take_part():
    """Each thread has lists of its own, so that their memory tells."""
    points = np.random.default_rng(19).random((20000, 3))
    for threads in THREADS:
        set_number_of_threads(threads)
        nnps = sorted_cell_nnps()(3, [array(points, 0.03)])
        for _ in range(200):  # on a busy machine one may come too late
            nnps.update()
            nnps.set_context(0, 0)
            if nnps.busy_threads() == threads:
                break
        assert nnps.busy_threads() == threads


def test_ghosts_follow_their_originals():
    domain = DomainManager(xmin=0.0, xmax=1.0, periodic_in_x=True)
    pa = array([[0.02, 0.0], [0.97, 0.0], [0.5, 0.0]], 0.05)
    nnps = sorted_cell_nnps()(2, [pa], domain=domain)
    assert len(lists(nnps)[0, 0][0]) == 2
    pa.x[0] += 0.2
    nnps.update_domain()
    nnps.update()
    assert [len(row) for row in lists(nnps)[0, 0][:3]] == [1, 1, 1]


# --- what changes -----------------------------------------------------------------------------------------------------

def test_particles_that_move_and_come_and_go():
    rng = np.random.default_rng(11)
    pa, wall = array(rng.random((400, 3)), 0.1), array(rng.random((100, 3)), 0.1, "wall")
    nnps = sorted_cell_nnps()(3, [pa, wall])
    for n in (0, 700, -500, 30):
        if n > 0:
            pa.add_particles(**dict(zip("xyz", rng.random((3, n)))), h=np.full(n, 0.1))
        else:
            pa.remove_particles(np.arange(-n))
        pa.x[:] += 0.3
        nnps.update_domain()
        nnps.update()
        assert_same(sets(lists(nnps)), brute([pa, wall], 2.0))


def test_smoothing_lengths_that_grow():
    pa = array(np.random.default_rng(12).random((500, 3)), 0.05)
    nnps = sorted_cell_nnps()(3, [pa])
    pa.h[:] = 0.12
    nnps.update()  # PySPH's linked lists miss neighbours here, without update_domain
    assert_same(sets(lists(nnps)), brute([pa], 2.0))


def test_lists_are_of_the_positions_at_the_update():
    """Whenever a list is asked for first: PySPH's would mix the cells of then with the positions of now."""
    pa = array(np.random.default_rng(13).random((300, 2)), 0.05)
    nnps = sorted_cell_nnps()(2, [pa])
    expected = brute([pa], 2.0)
    pa.x[:] += np.linspace(0.0, 5.0, 300)
    assert_same(sets(lists(nnps)), expected)


def test_support_may_be_enlarged():
    """As a solver does that keeps lists for several steps."""
    pa = array(np.random.default_rng(14).random((600, 3)), 0.06)
    nnps = sorted_cell_nnps()(3, [pa])
    nnps.radius_scale *= 1.3
    nnps.domain.set_radius_scale(nnps.radius_scale)
    nnps.update_domain()
    nnps.update()
    assert_same(sets(lists(nnps)), brute([pa], nnps.radius_scale))


# --- order ------------------------------------------------------------------------------------------------------------

def test_order_of_a_list_does_not_depend_on_where_others_are():
    """Cells lie on a lattice fixed in space, not at the lowest particle."""
    points = np.random.default_rng(15).random((400, 3))
    alone = lists(sorted_cell_nnps()(3, [array(points, 0.1)]))[0, 0]
    with_other = lists(sorted_cell_nnps()(3, [array(np.concatenate([points, [[-3.33, -2.1, -7.7]]]), 0.1)]))[0, 0]
    for ours, theirs in zip(with_other, alone):
        np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize("gids", [False, True])
def test_sorted_by_number(gids):
    rng = np.random.default_rng(16)
    pa = array(rng.random((500, 3)), 0.1)
    if gids:
        pa.gid[:] = rng.permutation(500)
    ours, theirs = (cls(3, [pa], cache=True, sort_gids=True) for cls in (sorted_cell_nnps(), LinkedListNNPS))
    assert_same(lists(ours), lists(theirs))
    ours.set_use_cache(False)
    assert_same(lists(ours), lists(theirs))


def test_spatial_order():
    """Every property follows; particles of a cell are next to each other; ghosts stay behind the others."""
    rng = np.random.default_rng(17)
    domain = DomainManager(xmin=0.0, xmax=1.0, periodic_in_x=True)
    pa = array(rng.random((800, 3)), 0.05, mark=np.arange(800.0))
    pa.add_property("vector", data=np.repeat(np.arange(800.0), 3), stride=3)
    nnps = sorted_cell_nnps()(3, [pa], domain=domain)
    before = {mark: (x, y) for mark, x, y in zip(pa.mark, pa.x, pa.y)}
    total = pa.get_number_of_particles()
    nnps.spatially_order_particles(0)
    assert total == pa.get_number_of_particles() > 800 == pa.get_number_of_particles(True)
    assert np.all(pa.get("tag", only_real_particles=False)[800:] != 0) and not np.any(pa.tag)
    assert {mark: (x, y) for mark, x, y in zip(pa.mark, pa.x, pa.y)} == before
    np.testing.assert_array_equal(pa.vector, np.repeat(pa.mark, 3))
    assert np.all(np.diff(np.floor(pa.z / 0.1)) >= 0.0)  # cells are a little wider than 0.1, which no particle feels
    nnps.update()
    assert_same(sets(lists(nnps)), brute([pa], 2.0))


def test_spatial_order_after_particles_were_removed():
    pa = array(np.random.default_rng(18).random((100, 2)), 0.1)
    nnps = sorted_cell_nnps()(2, [pa])
    pa.remove_particles(np.arange(40))
    indices = LongArray()
    nnps.get_spatially_ordered_indices(0, indices)
    assert sorted(indices.get_npy_array()) == list(range(60))


# --- what cannot be ---------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("axis", "xyz")
def test_positions_that_are_not_numbers(axis, value):
    fluid, wall = (array(np.random.default_rng(0).random((60, 3)), 0.1, name) for name in ("fluid", "wall"))
    nnps = sorted_cell_nnps()(3, [fluid, wall])
    wall.get(axis)[[17, 30]] = value
    with pytest.raises(FloatingPointError, match=f"{axis} of particle 17 of array 'wall' must be finite, got "
                                                 f"{value}; 2 particles in all"):
        nnps.update()
    wall.get(axis)[[17, 30]] = 0.5
    nnps.update()
    assert_same(sets(lists(nnps)), brute([fluid, wall], 2.0))


@pytest.mark.parametrize("value", [np.nan, np.inf, -0.1])
def test_smoothing_lengths_that_cannot_be(value):
    pa = array(np.random.default_rng(0).random((60, 3)), 0.1)
    nnps = sorted_cell_nnps()(3, [pa])
    pa.h[5] = value
    with pytest.raises(ValueError, match=f"h of particle 5 of array 'fluid' must be a number >= 0, got {value}"):
        nnps.update()


def test_questions_about_particles_that_are_not_there():
    pa = array(np.random.default_rng(0).random((60, 3)), 0.1)
    for cache in (True, False):
        nnps = sorted_cell_nnps()(3, [pa], cache=cache)
        with pytest.raises(IndexError, match="array 'fluid' had 60 particles .*: there is no particle 60"):
            nnps.get_nearest_particles(0, 0, 60, UIntArray())


# --- PySPH's own tests ------------------------------------------------------------------------------------------------

def test_pysphs_own_tests_of_a_search(monkeypatch):
    from pysph.base import nnps
    from pysph.base.tests import test_neighbor_cache, test_nnps, test_periodic_nnps

    ours = sorted_cell_nnps()

    class SortedCells(test_nnps.DictBoxSortNNPSTestCase):
        def setUp(self):
            test_nnps.NNPSTestCase.setUp(self)
            self.nps = ours(dim=3, particles=self.particles, radius_scale=2.0)

    class Caches(test_neighbor_cache.TestNeighborCache):
        test_setting_use_cache_does_cache = None  # reads how PySPH's own keep their lists

    for module in (nnps, test_neighbor_cache, test_periodic_nnps):
        monkeypatch.setattr(module, "LinkedListNNPS", ours)
    suite, result = unittest.TestSuite(), unittest.TestResult()
    for case in (SortedCells, Caches, test_nnps.TestLinkedListNNPSWithSorting,
                 test_periodic_nnps.PeriodicChannel2DLinkedList, test_periodic_nnps.TestPeriodicXYZ3D,
                 test_periodic_nnps.TestPeriodicZ3D, test_periodic_nnps.TestPeriodicXY3D):
        suite.addTests(unittest.defaultTestLoader.loadTestsFromTestCase(case))
    suite.run(result)
    assert result.testsRun > 15 and not result.failures + result.errors


def test_lists_for_loops_of_ones_own():
    random = np.random.default_rng(5)
    arrays = [array(random.random((300, 3)), 0.1), array(random.random((40, 3)), 0.07, name="wall"),
              array(np.zeros((0, 3)), 0.1, name="none")]
    nnps = sorted_cell_nnps()(dim=3, particles=arrays, radius_scale=2.0)
    expected = lists(nnps)
    for pair, rows in expected.items():
        filled, count = raw(nnps, *pair)
        np.testing.assert_array_equal(count, [len(row) for row in rows])
        for whole, row in zip(filled, rows):
            np.testing.assert_array_equal(whole[:len(row)], row)
            assert set(whole) == set(row)
    assert any(len(row) % 4 for row in expected[0, 0])
    arrays[0].x += 1e-3
    nnps.update()
    assert len(raw(nnps, 0, 1)[0]) == 300

"""Groups of bubbles: labels against ``scipy.sparse.csgraph``, and rounds on long chains.

The stage "bubbles" of the set "boil" is compiled as the scheme builds it, with its hooks. All lengths in spacings.
"""

import numpy as np
import pytest
from harness import Evaluator, host_only, native_only, random_cloud
from pysph.base.nnps import DomainManager
from pysph.base.omp_threads import get_number_of_threads, set_number_of_threads
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial.distance import pdist, squareform
from sets import scheme

from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.particles import NO_BUBBLE, fluid_array, site_array
from pysph_boiling.phases import Phase

LINK = 1.4  # link radius, spacings
VAPOUR = int(Phase.VAPOUR)


class Bubbles:
    """The stage "bubbles" on a cloud of particles; ``run()`` labels it anew and counts the rounds."""

    lean = False  # equations: the general ones, or BubbleLabelsLean

    def __init__(self, points, *, dim, uid=None, phase=VAPOUR, period=0.0):
        self.scheme = scheme("boil", dim=dim, spacing=1.0, lean=self.lean)
        kwargs = dict(spacing=1.0, dim=dim, rho0=WATER.rho_l)
        self.pa = fluid_array(points, **kwargs)
        if uid is not None:
            self.pa.uid[:] = uid
        wall, sites = fluid_array(points[:1], name="wall", **kwargs), site_array(points[:1], reach=2.4, spacing=1.0)
        wall.add_property("heated", type="int", data=np.ones(1, int))
        arrays = [self.pa, wall, sites]
        self.scheme.setup_properties(arrays)
        self.pa.phase[:] = phase
        self.pa.e[:] = WATER.L * (self.pa.phase == VAPOUR)  # nothing condenses, nothing is stored
        domain = DomainManager(xmin=0.0, xmax=period, periodic_in_x=True) if period else None
        self.scheme.configure_solver(dt=1e-3)
        stages, integrator = self.scheme.get_equations().groups, self.scheme.integrator
        self.stage = Evaluator(arrays, stages[integrator.stages["bubbles"]], dim=dim, domain=domain)
        self.scheme.arrays[:] = [self.pa]  # as PBFIntegrator.set_nnps does
        integrator.nnps = self.stage.nnps
        self.ghosts = self.scheme.ghosts
        self.ghosts.arrays = self.scheme.arrays

    def run(self):
        self.pa.bubble_rounds[0] = 0.0
        self.stage.nnps.update_domain()
        self.stage.nnps.update()
        self.ghosts.search_done()
        self.stage.evaluation.compute(0.0, 1.0)
        return self.get("bubble")

    def get(self, name):
        return self.pa.get(name, only_real_particles=True).copy()

    @property
    def rounds(self):
        return int(self.pa.bubble_rounds[0])


def reference(points, uid, phase, period=0.0):
    """Label of each particle: the smallest uid of its component of vapour, found among all pairs."""
    x = points[:, :1]
    distance2 = squareform(pdist(points, "sqeuclidean"))
    if period:
        dx = x - x.T
        distance2 += (dx - period * np.round(dx / period)) ** 2 - dx**2
    vapour = phase == VAPOUR
    linked = (distance2 < LINK**2) & vapour & vapour[:, None]
    number, component = connected_components(csr_array(linked), directed=False)
    smallest = np.full(number, NO_BUBBLE)
    np.minimum.at(smallest, component, uid)
    return np.where(vapour, smallest[component], NO_BUBBLE)


def cloud(n, dim, density, seed):
    """n particles at random, ``density`` of them in a spacing^dim, of all phases, with shuffled uids."""
    box, random = (n / density) ** (1.0 / dim), np.random.default_rng(seed)
    points = random_cloud(n, dim, seed=seed, box=box)
    uid = random.choice(NO_BUBBLE, n, replace=False)  # up to the largest that there is
    return points, uid, random.choice(list(Phase), n, p=[0.1, 0.1, 0.1, 0.7]), box


@pytest.fixture(params=[False, pytest.param(True, marks=[host_only, native_only])], ids=["general", "lean"])
def form(request, monkeypatch):
    """Both forms of the labels, where both are built."""
    monkeypatch.setattr(Bubbles, "lean", request.param)


both_forms = pytest.mark.usefixtures("form")


# --- labels -----------------------------------------------------------------------------------------------------------


@both_forms
@pytest.mark.parametrize("dim, density", [(2, 0.3), (2, 0.8), (2, 1.2), (3, 0.1), (3, 0.3), (3, 0.5)])
@pytest.mark.parametrize("periodic", [False, True], ids=["open", "periodic"])
def test_labels_equal_connected_components(dim, density, periodic):
    points, uid, phase, box = cloud(600, dim, density, seed=int(10 * density))
    period = box * periodic
    bubbles = Bubbles(points, dim=dim, uid=uid, phase=phase, period=period)
    label = bubbles.run()

    want = reference(points, uid, phase, period)
    np.testing.assert_array_equal(label, want)
    assert np.all((label == NO_BUBBLE) == (phase != VAPOUR))
    name, size = np.unique(label[phase == VAPOUR], return_counts=True)
    assert 2 < len(name) and 1 < max(size)
    if periodic:
        assert np.any(want != reference(points, uid, phase))  # some bubble lies across the border
    counts = dict(zip(name, size))
    np.testing.assert_array_equal(bubbles.get("bubble_n"), [counts.get(value, 0) for value in label])


@both_forms
def test_labels_do_not_depend_on_the_order_of_particles():
    points, uid, phase, _ = cloud(600, 2, 0.8, seed=1)
    label = Bubbles(points, dim=2, uid=uid, phase=phase).run()
    order = np.random.default_rng(2).permutation(600)
    shuffled = Bubbles(points[order], dim=2, uid=uid[order], phase=phase[order]).run()
    np.testing.assert_array_equal(shuffled, label[order])


@both_forms
def test_labels_follow_particles_that_move_and_vanish():
    """Labels start afresh: a bubble that is cut in two is two bubbles, and vapour that condensed is in none."""
    points = np.zeros((7, 3))
    points[:, 0] = np.arange(7.0)
    bubbles = Bubbles(points, dim=2, uid=[3, 9, 4, 5, 8, 6, 7])
    np.testing.assert_array_equal(bubbles.run(), [3] * 7)
    bubbles.pa.phase[3] = Phase.LIQUID
    np.testing.assert_array_equal(bubbles.run(), [3, 3, 3, NO_BUBBLE, 6, 6, 6])
    np.testing.assert_array_equal(bubbles.get("bubble_n"), [3, 3, 3, 0, 3, 3, 3])
    bubbles.pa.y[5] = 1.5
    np.testing.assert_array_equal(bubbles.run(), [3, 3, 3, NO_BUBBLE, 8, 6, 7])


@both_forms
def test_link_radius():
    """Spaced by 1.4 spacings: linked just below, not above."""
    points = np.zeros((4, 3))
    points[:, 0] = [0.0, LINK * (1.0 - 1e-12), 5.0, 5.0 + LINK * (1.0 + 1e-12)]
    np.testing.assert_array_equal(Bubbles(points, dim=2).run(), [0, 0, 2, 3])


@both_forms
@pytest.mark.parametrize("period", [40.0, 0.0])
def test_a_row_through_the_border_is_one_bubble_only_if_periodic(period):
    points = np.zeros((20, 3))
    points[:, 0] = np.r_[np.arange(10.0) + 0.5, 39.5 - np.arange(10.0)]
    label = Bubbles(points, dim=2, period=period, uid=np.arange(20)[::-1]).run()
    np.testing.assert_array_equal(label, [0] * 20 if period else [10] * 10 + [0] * 10)


@both_forms
def test_any_number_of_threads_gives_the_same_labels():
    points, uid, phase, _ = cloud(4000, 2, 0.9, seed=5)
    before, labels, used = get_number_of_threads(), [], []
    try:
        for threads in (1, 2, 4):
            set_number_of_threads(threads)
            used.append(get_number_of_threads())
            bubbles = Bubbles(points, dim=2, uid=uid, phase=phase)
            labels += [bubbles.run() for _ in range(3)]
    finally:
        set_number_of_threads(before)
    assert used == [1, 2, 4]
    np.testing.assert_array_equal(labels, [labels[0]] * len(labels))


# --- rounds -----------------------------------------------------------------------------------------------------------


def serpentine(n, width, inset=0):
    """A chain of n unit links, folded into rows two apart; the first row starts ``inset`` further to the left."""
    points, row, y = [], np.arange(-inset, width), 0
    while len(points) < n:
        points += [(x, y) for x in row] + [(row[-1], y + 1)]
        row, y = np.arange(width)[:: -1 if row[-1] else 1], y + 2
    return np.array(points[:n], float)


def chain(n, form):
    """Positions (n, 3) and uids of a chain, or of a star of four arms whose uids rise from the centre outwards."""
    width = int(np.sqrt(n))
    if form == "star":
        x, y = serpentine(-(-(n - 1) // 4), width, inset=2).T
        x = x + 3.0
        x, y = np.stack([x, -y, -x, y], 1).ravel(), np.stack([y, x, -y, -x], 1).ravel()
        x, y, uid = np.r_[0.0, x[:n - 1]], np.r_[0.0, y[:n - 1]], np.arange(n)
    else:
        x, y = serpentine(n, width).T
        uid = {"ordered": np.arange(n), "reversed": np.arange(n)[::-1],
               "shuffled": np.random.default_rng(n).permutation(n)}[form]
    return np.stack([x, y, np.zeros(n)], -1), uid


@pytest.mark.parametrize("form", ["ordered", "reversed", "shuffled", "star"])
@pytest.mark.parametrize("n", [100, 1_000, 10_000])
def test_long_chains_settle_in_logarithmically_many_rounds(n, form):
    points, uid = chain(n, form)
    order = np.random.default_rng(n + 1).permutation(n)  # nor may the order of the particles matter
    bubbles = Bubbles(points[order], dim=2, uid=uid[order])
    assert np.all(bubbles.run() == 0)
    assert bubbles.rounds <= 2.0 * np.log2(n) + 4.0  # measured: at most log2(n) + 1, whatever the form and the order
    assert np.all(bubbles.get("bubble_n") == n)

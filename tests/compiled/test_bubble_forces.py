"""Forces on bubbles and the view of the free surface, against a reference: all pairs, no neighbour lists.

All kernels sit in one compiled module; a group runs when its name is asked for. Random clouds of all phases and unequal
masses, in 2-D and 3-D; then what each force must do by its meaning.
"""
import numpy as np
import pytest
import sets
from harness import Evaluator, random_cloud
from pysph.sph.equation import Group

from pysph_boiling.equations.buoyancy import BubbleBuoyancy, BubbleBuoyancyIhmsen, BubbleBuoyancyPaper, BubbleDrag
from pysph_boiling.equations.cohesion import BubbleCohesion, BubbleSiteAdhesion
from pysph_boiling.equations.preset_nucleation import NucleationSiteAttraction
from pysph_boiling.equations.venting import VentingFilm, VentingFree, VentingRelease
from pysph_boiling.equations.viscosity import PBFBodyForce
from pysph_boiling.particles import fluid_array, fluid_block, site_array
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.effects import Buoyancy

DX, RHO0, HDX = 0.01, 958.0, 1.2
SUPPORT = 2.0 * HDX * DX
VAPOUR = int(Phase.VAPOUR)
N, N_SITES = 60, 8
G = {2: np.array([0.0, -9.81, 0.0]), 3: np.array([0.0, 0.0, -9.81])}
ROUND_OFF = 1e-12  # sums of some 40 terms, in another order than the compiled ones


class Forces:
    """One fluid array and its sites, with every kernel that acts on bubbles; ``run("drag")`` gives accelerations."""

    def __init__(self, fluid, sites=((0.0, 0.0, 0.0),), *, dim, phase=VAPOUR, g=None, k=1.5, a_max=3.0):
        self.g = G[dim] if g is None else np.asarray(g, float)
        gravity = dict(zip(("gx", "gy", "gz"), self.g))
        up = -self.g / (np.linalg.norm(self.g) or 1.0)
        cone = dict(ux=up[0], uy=up[1], uz=up[2], cone_cosine=0.5, min_cover_height=0.3 * DX)
        self.fluid, self.sites = fluid, site_array(sites, reach=SUPPORT, spacing=DX)
        for name in ("phase", "bubble_n", "film", "covered", "free", "vapour_near"):
            fluid.add_property(name, type="int")
        fluid.phase[:] = phase
        groups = {
            "gravity": PBFBodyForce("fluid", None, **gravity),
            "attraction": NucleationSiteAttraction("fluid", ["sites"], strength=5.0, radius=2.2 * DX),
            "archimedes": BubbleBuoyancy("fluid", None, k_bubble=k, **gravity),
            "paper": BubbleBuoyancyPaper("fluid", None, k_bubble=k, a_max=a_max, **gravity),
            "ihmsen": BubbleBuoyancyIhmsen("fluid", ["fluid"], k_min=k, k_max=1.7, **gravity),
            "drag": BubbleDrag("fluid", ["fluid"], rate=11.0, rho0=RHO0),
            "cohesion": BubbleCohesion("fluid", ["fluid"], strength=30.0, radius=2.3 * DX),
            "adhesion": BubbleSiteAdhesion("fluid", ["sites"], strength=80.0, radius=2.1 * DX, spacing=DX),
            "film": VentingFilm("fluid", ["fluid"], **cone),
            "free": VentingFree("fluid", ["fluid"], **cone),
            "release": VentingRelease("fluid", None, **gravity),
        }
        self.wanted = ()
        self.evaluator = Evaluator([fluid, self.sites], [
            Group([equation], name=name, condition=lambda t, dt, name=name: name in self.wanted)
            for name, equation in groups.items()], dim=dim)
        self.kernel = self.evaluator.kernel

    def run(self, *wanted, start=0.0):
        """Accelerations (n, 3) from the groups named, on top of ``start``."""
        self.wanted = wanted
        for name in ("au", "av", "aw"):
            self.fluid.get(name)[:] = start
        self.evaluator.run()
        return vectors(self.fluid, "au", "av", "aw")


def vectors(pa, x="x", y="y", z="z"):
    """Three properties as an array (n, 3)."""
    return np.stack([pa.get(name) for name in (x, y, z)], -1)


def particles(points, dim, m=1.0):
    pa = fluid_array(points, spacing=DX, dim=dim, rho0=RHO0)
    pa.m[:] *= m
    return pa


@pytest.fixture(scope="module", params=[2, 3], ids=["2-D", "3-D"])
def cloud(request):
    """Random particles of random masses, phases, velocities and bubble sizes, with random sites among them."""
    dim, random = request.param, np.random.default_rng(4)
    box = {2: 0.06, 3: 0.04}[dim]
    fluid = particles(random_cloud(N, dim, seed=1, box=box), dim, random.uniform(0.5, 2.0, N))
    for name in "uvw"[:dim]:
        fluid.get(name)[:] = random.normal(size=N)
    forces = Forces(fluid, random_cloud(N_SITES, dim, seed=2, box=box), dim=dim,
                    phase=random.choice(list(Phase), N, p=[0.2, 0.1, 0.2, 0.5]), g=[1.0, -5.0, 3.0 * (dim - 2)])
    fluid.bubble_n[:] = (fluid.phase == VAPOUR) * random.integers(1, 5, N)
    fluid.free[:] = random.integers(0, 3, N)
    forces.dim = dim
    return forces


# --- against the reference --------------------------------------------------------------------------------------------


def to_sites(forces):
    """Vectors (n, sites, 3) from each particle to each site, and their lengths."""
    d = vectors(forces.sites)[None] - vectors(forces.fluid)[:, None]
    return d, np.linalg.norm(d, axis=-1)


def between(fluid):
    """Vectors (n, n, 3) from i to j, their lengths, and which pairs are two vapour particles."""
    x, vapour = vectors(fluid), fluid.phase == VAPOUR
    d = x[None] - x[:, None]
    return d, np.linalg.norm(d, axis=-1), vapour[:, None] & vapour


def attraction(forces):
    d, r = to_sites(forces)
    a = np.zeros((N, 3))
    for i, s in enumerate(np.argmin(r, axis=1)):
        if forces.fluid.phase[i] != VAPOUR and r[i, s] < 2.2 * DX:
            a[i] = 5.0 * (1.0 - r[i, s] / (2.2 * DX)) ** 2 * d[i, s] / r[i, s]
    return a


def adhesion(forces):
    d, r = to_sites(forces)
    a = np.zeros((N, 3))
    for i, s in np.ndindex(*r.shape):
        if forces.fluid.phase[i] == VAPOUR and r[i, s] < 2.1 * DX:
            pull = 80.0 * np.sqrt(1.0 - r[i, s] / (2.1 * DX)) * min(1.0, r[i, s] / DX)
            a[i] += pull * d[i, s] / r[i, s]
    return a


def archimedes(forces):
    return -1.5 * forces.g * (forces.fluid.phase == VAPOUR)[:, None]


def paper(forces):
    factor = [min(1.5 * n, 3.0) * (p == VAPOUR) for n, p in zip(forces.fluid.bubble_n, forces.fluid.phase)]
    return -np.outer(factor, forces.g)


def ihmsen(forces):
    _, r, both = between(forces.fluid)
    near = np.sum(both & (r < SUPPORT), axis=1) - 1
    return -np.outer(1.5 * (1.7 - 0.7 * np.exp(-0.1 * near)) * (forces.fluid.phase == VAPOUR), forces.g)


def drag(forces):
    fluid, v = forces.fluid, vectors(forces.fluid, "u", "v", "w")
    d, r, _ = between(fluid)
    a = np.zeros((N, 3))
    for i, j in np.ndindex(N, N):
        if (fluid.phase[i] == VAPOUR) != (fluid.phase[j] == VAPOUR):
            W = forces.kernel.kernel(d[i, j], r[i, j], HDX * DX)
            a[i] += 11.0 * fluid.m[j] / RHO0 * (v[j] - v[i]) * W
    return a


def cohesion(forces):
    d, r, both = between(forces.fluid)
    m = forces.fluid.m
    a = np.zeros((N, 3))
    for i, j in np.ndindex(N, N):
        q = r[i, j] / (2.3 * DX)
        if i != j and both[i, j] and q < 1.0:
            shape = 64.0 * (1.0 - q) ** 3 * q**3
            shape = 2.0 * shape - 1.0 if q <= 0.5 else shape
            a[i] += 30.0 * 2.0 * m[j] / (m[i] + m[j]) * shape * d[i, j] / r[i, j]
    return a


@pytest.mark.parametrize("reference", [attraction, adhesion, archimedes, paper, ihmsen, drag, cohesion],
                         ids=lambda reference: reference.__name__)
def test_acceleration_equals_the_reference(cloud, reference):
    want = reference(cloud)
    assert np.count_nonzero(np.any(want != 0.0, axis=1)) >= 8
    got = cloud.run(reference.__name__)
    np.testing.assert_allclose(got, want, rtol=ROUND_OFF, atol=ROUND_OFF * np.abs(want).max())
    np.testing.assert_allclose(cloud.run(reference.__name__, start=7.0), want + 7.0, rtol=ROUND_OFF)  # it adds


def in_cone(forces):
    """Whether particle j lies in the upward cone of particle i."""
    d, r, _ = between(forces.fluid)
    up = -(d @ forces.g) / np.linalg.norm(forces.g)
    return (up > 0.3 * DX) & (r < SUPPORT) & (up > 0.5 * r)


def test_film_and_free_vapour_equal_the_reference(cloud):
    vapour, above, before = cloud.fluid.phase == VAPOUR, in_cone(cloud), cloud.fluid.free.copy()
    film = ~vapour & ~above.any(axis=1)
    free = vapour & ~(above & ~film).any(axis=1)
    assert 2 <= np.count_nonzero(film) and 2 <= np.count_nonzero(free)
    cloud.run("film", "free", "release")
    np.testing.assert_array_equal(cloud.fluid.film, film)
    np.testing.assert_array_equal(cloud.fluid.covered, ~free)
    np.testing.assert_array_equal(cloud.fluid.free, np.where(free, before + 1, 0))


def test_release_leaves_gravity_alone_to_act_on_free_vapour(cloud):
    a = cloud.run("release", start=7.0)
    np.testing.assert_array_equal(a, np.where(cloud.fluid.free[:, None] > 0, cloud.g, 7.0))


# --- what they must do ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("force", ["cohesion", "drag"])
def test_momentum_is_conserved_with_unequal_masses(cloud, force):
    impulse = cloud.fluid.m[:, None] * cloud.run(force)
    np.testing.assert_allclose(impulse.sum(0), 0.0, atol=1e-14 * np.abs(impulse).sum())  # round-off of the sum


def test_drag_slows_and_spares_particles_of_the_same_phase(cloud):
    v, kind = vectors(cloud.fluid, "u", "v", "w"), cloud.fluid.phase.copy()
    assert np.sum(cloud.fluid.m[:, None] * v * cloud.run("drag")) < 0.0
    for same in (VAPOUR, Phase.LIQUID):
        cloud.fluid.phase[:] = same
        assert not cloud.run("drag").any()
    cloud.fluid.phase[:] = kind


@pytest.mark.parametrize("q, towards", [(0.8, 1), (0.5, 1), (0.1, -1)])
def test_cohesion_attracts_from_afar_and_repels_nearby(q, towards):
    points = np.zeros((2, 3))
    points[1, 0] = q * 2.3 * DX
    a = Forces(particles(points, 2, [1.0, 3.0]), dim=2).run("cohesion")
    assert a[0, 0] * towards > 0.0 and a[1, 0] * towards < 0.0
    if q == 0.5:  # the peak of the curve is 1: the strength is an acceleration between equals
        assert a[0, 0] == pytest.approx(30.0 * 2.0 * 3.0 / 4.0, rel=1e-14)


def test_coincident_vapour_stays_finite():
    points = np.zeros((3, 3))
    points[2, 0] = 10.0 * DX  # PySPH loses neighbours where all particles of a scene coincide
    forces = Forces(particles(points, 2), dim=2)
    for force in ("cohesion", "adhesion"):
        assert not forces.run(force).any()


@pytest.mark.parametrize("g", [(0.0, -9.81, 0.0), (9.81, 0.0, 0.0), (3.0, 4.0, -12.0)])
def test_buoyancy_is_opposite_to_any_gravity_and_cancels_it_at_one(g):
    """A row of three vapour particles and one liquid."""
    points = np.zeros((4, 3))
    points[:, 0] = DX * np.arange(4)
    phase, g = [VAPOUR] * 3 + [Phase.LIQUID], np.array(g)

    def forces(k):
        made = Forces(particles(points, 3), dim=3, phase=phase, g=g, k=k)
        made.fluid.bubble_n[:] = [3, 3, 3, 0]
        return made

    strong, weightless = forces(0.7), forces(1.0)
    for form, factors in (("archimedes", [0.7] * 3), ("paper", [2.1] * 3), ("ihmsen", None)):
        a = strong.run(form)
        assert not a[3].any()
        if factors is None:  # more vapour neighbours: more force; all within 2.4 spacings are seen
            factors = 0.7 * (1.7 - 0.7 * np.exp(-0.1 * np.array([2, 2, 2])))
        np.testing.assert_allclose(a[:3], -np.outer(factors, g), rtol=1e-14)
    total = weightless.run("gravity", "archimedes")
    np.testing.assert_array_equal(total[:3], 0.0)
    np.testing.assert_array_equal(total[3], g)


def test_sites_pull_along_the_line_to_them():
    """Adhesion acts on vapour, attraction on all else towards the nearest site; at a site itself nothing is left."""
    sites = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0]]) * DX
    points = np.array([[1.0, 1.0, 0.0], [1.6, 0.5, 0.0], [0.0, 0.0, 0.0]]) * DX
    forces = Forces(particles(points, 2), sites, dim=2)
    nearest = np.array([-points[0], sites[1] - points[1], [0.0, 0.0, 0.0]])
    for state in Phase:
        forces.fluid.phase[:] = state
        a, b = forces.run("attraction"), forces.run("adhesion")
        if state == VAPOUR:
            assert not a.any()
            assert b[0] @ nearest[0] > 0.0 and not b[2].any()
        else:
            assert not b.any() and not a[2].any()
            np.testing.assert_allclose(np.cross(a, nearest)[:, 2], 0.0, atol=1e-16)
            assert np.all(np.sum(a * nearest, axis=1)[:2] > 0.0)


# --- the free surface -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("layers, free", [(0, True), (1, True), (2, False), (4, False)])
def test_a_bubble_is_free_under_at_most_a_film(layers, free, dim):
    """A block with a bubble two wide and two high below ``layers`` layers of liquid. The count is of steps in a row."""
    size = np.array([6.0, 6.0, 0.0]) if dim == 2 else np.array([6.0, 6.0, 6.0])
    block = fluid_block((0.0, 0.0, 0.0), size * DX, spacing=DX, dim=dim, rho0=RHO0)
    x = vectors(block) / DX
    depth = 6.0 - x[:, dim - 1]
    bubble = np.all(np.abs(x[:, :dim - 1] - 3.0) < 1.0, axis=1) & (depth > layers) & (depth < layers + 2)
    forces = Forces(block, dim=dim, phase=np.where(bubble, VAPOUR, int(Phase.LIQUID)))
    for step in (1, 2, 3):
        forces.run("film", "free", "release")
        top = bubble & (depth < layers + 1)
        np.testing.assert_array_equal(block.free, np.where(top, step * free, 0))
        np.testing.assert_array_equal(block.film, (depth < 1.0) & ~bubble)
    block.phase[:] = np.where(depth < layers + 1, int(Phase.LIQUID), block.phase)  # the upper half condenses
    forces.run("film", "free", "release")
    lower = bubble & (depth > layers + 1)
    np.testing.assert_array_equal(block.free, np.where(lower, 1 * (layers == 0), 0))  # counts start afresh


def test_what_covers():
    """Cover starts 0.3 spacings up, within 60 degrees of the vertical, and ends at the support, here 2.4 spacings."""
    places = np.array([(0.0, 0.29), (0.0, 0.31), (1.7, 1.0), (1.8, 1.0), (0.0, 2.39), (0.0, 2.41), (0.0, -1.0)])
    covers = np.array([False, True, True, False, True, False, False])
    below, above = np.zeros((2, len(places), 3))
    below[:, 0] = 10.0 * np.arange(len(places))
    above[:, :2] = below[:, :2] + places
    forces = Forces(particles(DX * np.concatenate([below, above]), 2), dim=2)
    for phase, name in ((VAPOUR, "free"), (Phase.LIQUID, "film")):
        forces.fluid.phase[:] = phase
        forces.run("film", "free", "release")
        np.testing.assert_array_equal(forces.fluid.get(name)[:len(places)], ~covers)


@pytest.mark.parametrize(("given", "want"), [({}, [0.03, 0.3, 3.0, 3.0]), (dict(k_bubble=1.5), [3.0] * 4)])
def test_papers_buoyancy_differs_over_the_sizes_that_occur(given, want):
    """Bubbles of 2, 20, 200 and 400 particles; the paper's own constant pushes all of them alike."""
    scheme = sets.scheme("boil", dim=2, spacing=DX, changes=dict(buoyancy=Buoyancy(form="paper", **given)))
    (term,) = scheme.effects["buoyancy"].terms(scheme.scene(), "fluid")
    fluid = fluid_array(DX * np.arange(12.0).reshape(4, 3), spacing=DX, dim=2, rho0=RHO0)
    forces = Forces(fluid, dim=2, k=term.equation.k_bubble, a_max=term.equation.a_max)
    fluid.bubble_n[:] = 2, 20, 200, 400
    np.testing.assert_allclose(forces.run("paper")[:, 1] / 9.81, want, rtol=1e-12)

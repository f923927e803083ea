"""A cloud of bubbles, with every kernel that acts on them, for the tests of forces on bubbles and of the free surface.

All kernels sit in one compiled module, so that the files that use it compile nothing of their own; a group runs when
its name is asked for. Clouds are of all phases and of unequal masses, in 2-D and 3-D.
"""
import numpy as np
from harness import Evaluator, random_cloud, vectors
from pysph.sph.equation import Group

from pysph_boiling.equations.buoyancy import BubbleBuoyancy, BubbleBuoyancyIhmsen, BubbleBuoyancyPaper, BubbleDrag
from pysph_boiling.equations.cohesion import (
    BubbleCohesion,
    BubbleCohesionForce,
    BubbleCohesionMove,
    BubbleCohesionStart,
    BubbleSiteAdhesion,
)
from pysph_boiling.equations.preset_nucleation import NucleationSiteAttraction
from pysph_boiling.equations.venting import VentingFilm, VentingFree, VentingRelease
from pysph_boiling.equations.viscosity import PBFBodyForce
from pysph_boiling.particles import fluid_array, site_array
from pysph_boiling.phases import Phase

__all__ = [
    "DX", "HDX", "MAX_DISPLACEMENT", "N", "PULL", "PULLED", "PULL_START", "RHO0", "SHARE", "STIFFNESS", "STRENGTH",
    "SUPPORT", "VAPOUR", "Forces", "assert_equals_reference", "assert_momentum_is_conserved", "between", "particles",
    "random_bubbles", "to_sites",
]

DX, RHO0, HDX = 0.01, 958.0, 1.2
SUPPORT = 2.0 * HDX * DX
VAPOUR = int(Phase.VAPOUR)
N, N_SITES = 60, 8
G = {2: np.array([0.0, -9.81, 0.0]), 3: np.array([0.0, 0.0, -9.81])}
STRENGTH, STIFFNESS, MAX_DISPLACEMENT = 30.0, 5.0 / DX, 0.5 * DX  # of cohesion
SHARE = 0.7  # of the last displacement by cohesion, with which a step begins
PULL, PULLED, PULL_START = (tuple(f"{name}_{axis}" for axis in "xyz") for name in ("pull", "pulled", "pull_start"))
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
        for name in ("limited", "sx", "sy", "sz", *PULL, *PULLED, *PULL_START):
            fluid.add_property(name)
        fluid.add_constant("prior", [1.0, 1.0, 1.0])
        fluid.phase[:] = phase
        groups = {
            "gravity": PBFBodyForce("fluid", None, **gravity),
            "attraction": NucleationSiteAttraction("fluid", ["sites"], strength=5.0, radius=2.2 * DX),
            "attraction_transition": NucleationSiteAttraction("fluid", ["sites"], strength=5.0, radius=2.2 * DX,
                                                              transition=True),
            "archimedes": BubbleBuoyancy("fluid", None, k_bubble=k, **gravity),
            "paper": BubbleBuoyancyPaper("fluid", None, k_bubble=k, a_max=a_max, **gravity),
            "ihmsen": BubbleBuoyancyIhmsen("fluid", ["fluid"], k_min=k, k_max=1.7, **gravity),
            "drag": BubbleDrag("fluid", ["fluid"], rate=11.0, rho0=RHO0),
            "cohesion": BubbleCohesion("fluid", ["fluid"], strength=STRENGTH, radius=2.3 * DX, stiffness=STIFFNESS,
                                       max_displacement=MAX_DISPLACEMENT),
            "cohesion_force": BubbleCohesionForce("fluid", ["fluid"], strength=STRENGTH, radius=2.3 * DX,
                                                  stiffness=STIFFNESS),
            "cohesion_move": BubbleCohesionMove("fluid", None),
            "cohesion_start": BubbleCohesionStart("fluid", None, share=SHARE),
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

    def run(self, *wanted, start=0.0, dt=1.0):
        """Accelerations (n, 3) from the groups named, on top of ``start``."""
        self.wanted = wanted
        for name in ("au", "av", "aw"):
            self.fluid.get(name)[:] = start
        self.evaluator.run(dt=dt)
        return vectors(self.fluid, "au", "av", "aw")


def particles(points, dim, m=1.0):
    pa = fluid_array(points, spacing=DX, dim=dim, rho0=RHO0)
    pa.m[:] *= m
    return pa


def random_bubbles(dim):
    """Random particles of random masses, phases, velocities and bubble sizes, with random sites among them."""
    random = np.random.default_rng(4)
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


def to_sites(forces):
    """Vectors (n, sites, 3) from each particle to each site, and their lengths."""
    d = vectors(forces.sites)[None] - vectors(forces.fluid)[:, None]
    return d, np.linalg.norm(d, axis=-1)


def between(fluid):
    """Vectors (n, n, 3) from i to j, their lengths, and which pairs are two vapour particles."""
    x, vapour = vectors(fluid), fluid.phase == VAPOUR
    d = x[None] - x[:, None]
    return d, np.linalg.norm(d, axis=-1), vapour[:, None] & vapour


def assert_equals_reference(cloud, reference, least=8):
    """The force of that name is the ``reference``, a function of the cloud, and adds to the acceleration.

    It acts on ``least`` particles or more.
    """
    want = reference(cloud)
    assert np.count_nonzero(np.any(want != 0.0, axis=1)) >= least
    got = cloud.run(reference.__name__)
    np.testing.assert_allclose(got, want, rtol=ROUND_OFF, atol=ROUND_OFF * np.abs(want).max())
    np.testing.assert_allclose(cloud.run(reference.__name__, start=7.0), want + 7.0, rtol=ROUND_OFF)  # it adds


def assert_momentum_is_conserved(cloud, force):
    """Also with unequal masses."""
    impulse = cloud.fluid.m[:, None] * cloud.run(force)
    np.testing.assert_allclose(impulse.sum(0), 0.0, atol=1e-14 * np.abs(impulse).sum())  # round-off of the sum

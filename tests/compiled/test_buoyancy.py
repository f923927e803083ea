"""Buoyancy of bubbles in its three forms, and drag, against a reference: all pairs, no neighbour lists."""
import numpy as np
import pytest
import sets
from forces import (
    DX,
    HDX,
    RHO0,
    SUPPORT,
    VAPOUR,
    Forces,
    N,
    assert_equals_reference,
    assert_momentum_is_conserved,
    between,
    particles,
)
from harness import vectors

from pysph_boiling.particles import fluid_array
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.effects import Buoyancy


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


@pytest.mark.parametrize("reference", [archimedes, paper, ihmsen, drag], ids=lambda reference: reference.__name__)
def test_acceleration_equals_the_reference(cloud, reference):
    assert_equals_reference(cloud, reference)


def test_drag_conserves_momentum_with_unequal_masses(cloud):
    assert_momentum_is_conserved(cloud, "drag")


def test_drag_slows_and_spares_particles_of_the_same_phase(cloud):
    v, kind = vectors(cloud.fluid, "u", "v", "w"), cloud.fluid.phase.copy()
    assert np.sum(cloud.fluid.m[:, None] * v * cloud.run("drag")) < 0.0
    for same in (VAPOUR, Phase.LIQUID):
        cloud.fluid.phase[:] = same
        assert not cloud.run("drag").any()
    cloud.fluid.phase[:] = kind


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


@pytest.mark.parametrize(("given", "want"), [({}, [0.03, 0.3, 3.0, 3.0]), (dict(k_bubble=1.5), [3.0] * 4)])
def test_papers_buoyancy_differs_over_the_sizes_that_occur(given, want):
    """Bubbles of 2, 20, 200 and 400 particles; the paper's own constant pushes all of them alike."""
    scheme = sets.scheme("boil", dim=2, spacing=DX, changes=dict(buoyancy=Buoyancy(form="paper", **given)))
    (term,) = scheme.effects["buoyancy"].terms(scheme.scene(), "fluid")
    fluid = fluid_array(DX * np.arange(12.0).reshape(4, 3), spacing=DX, dim=2, rho0=RHO0)
    forces = Forces(fluid, dim=2, k=term.equation.k_bubble, a_max=term.equation.a_max)
    fluid.bubble_n[:] = 2, 20, 200, 400
    np.testing.assert_allclose(forces.run("paper")[:, 1] / 9.81, want, rtol=1e-12)

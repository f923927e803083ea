"""The pull of nucleation sites on liquid, against a reference, and beside that on vapour."""
import numpy as np
import pytest
from forces import DX, VAPOUR, Forces, N, assert_equals_reference, particles, to_sites

from pysph_boiling.phases import Phase


def attraction(forces, states=(Phase.LIQUID, Phase.TRANSITION, Phase.SUPERHEATED)):
    d, r = to_sites(forces)
    a = np.zeros((N, 3))
    for i, s in enumerate(np.argmin(r, axis=1)):
        if forces.fluid.phase[i] in states and r[i, s] < 2.2 * DX:
            a[i] = 5.0 * (1.0 - r[i, s] / (2.2 * DX)) ** 2 * d[i, s] / r[i, s]
    return a


def attraction_transition(forces):
    return attraction(forces, (Phase.TRANSITION,))


@pytest.mark.parametrize(("reference", "least"), [(attraction, 8), (attraction_transition, 3)])
def test_acceleration_equals_the_reference(cloud, reference, least):
    assert_equals_reference(cloud, reference, least)


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

"""Cohesion of vapour, and its adhesion to sites, against a reference: all pairs, no neighbour lists."""
import numpy as np
import pytest
from forces import (
    DX,
    VAPOUR,
    Forces,
    N,
    assert_equals_reference,
    assert_momentum_is_conserved,
    between,
    particles,
    to_sites,
)


def adhesion(forces):
    d, r = to_sites(forces)
    a = np.zeros((N, 3))
    for i, s in np.ndindex(*r.shape):
        if forces.fluid.phase[i] == VAPOUR and r[i, s] < 2.1 * DX:
            pull = 80.0 * np.sqrt(1.0 - r[i, s] / (2.1 * DX)) * min(1.0, r[i, s] / DX)
            a[i] += pull * d[i, s] / r[i, s]
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


@pytest.mark.parametrize("reference", [adhesion, cohesion], ids=lambda reference: reference.__name__)
def test_acceleration_equals_the_reference(cloud, reference):
    assert_equals_reference(cloud, reference)


def test_cohesion_conserves_momentum_with_unequal_masses(cloud):
    assert_momentum_is_conserved(cloud, "cohesion")


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

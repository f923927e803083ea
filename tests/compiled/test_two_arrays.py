"""Fluid in two arrays: what happens to a pair of particles does not depend on the arrays they are in."""
import numpy as np
import pytest
from harness import Stepper

from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.particles import fluid_array
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import DensityConstraint, HeatConduction, PhaseChange
from pysph_boiling.schemes.pbf import PBFScheme

DX = 0.004
SPLITS = ((["fluid"], False), (["first", "second"], False), (["first", "second"], True))  # names; which half is first


def block(spacing, seed=3):
    """A square of 14 x 14 particles at ``spacing`` (of DX), displaced at random; which are in the left half."""
    points = np.zeros((196, 3))
    lattice = np.stack(np.meshgrid(np.arange(14.0), np.arange(14.0), indexing="ij"), -1).reshape(-1, 2)
    points[:, :2] = spacing * DX * (lattice + np.random.default_rng(seed).uniform(-0.1, 0.1, lattice.shape))
    return points, lattice[:, 0] < 6.5


def arrays(names, points, first, rho0):
    """The points in one array, or in two, of which the first holds the particles ``first`` (n,)."""
    parts = [first, ~first] if len(names) == 2 else [np.ones(len(first), bool)]
    made = [fluid_array(points[part], spacing=DX, dim=2, rho0=rho0, name=name) for name, part in zip(names, parts)]
    for pa, part in zip(made, parts):
        pa.uid[:] = np.flatnonzero(part)
    return made


def gathered(made, *names):
    """Properties of all particles in the order of their uids, (n,) each."""
    order = np.argsort(np.concatenate([pa.uid for pa in made]))
    return [np.concatenate([pa.get(name) for pa in made])[order] for name in names]


@pytest.mark.parametrize("settle", [0, 50])
def test_a_squeezed_block_keeps_its_momentum_in_any_arrays(settle):
    """In free space, 10 % too close. Seen before in two arrays: 1.7e-4 of the sum of m |v|."""
    final = []
    points, left = block(0.95)
    for names, swapped in SPLITS:
        scheme = PBFScheme(names, [], dim=2, spacing=DX, gravity=(0.0, 0.0, 0.0),
                           density=DensityConstraint(settle=settle, min_sweeps=6))
        made = arrays(names, points, left ^ swapped, 1000.0)
        scheme.setup_properties(made)
        stepper = Stepper(scheme, made, dt=1e-3)
        stepper.step(12)
        m, x, y, u, v = gathered(made, "m", "x", "y", "u", "v")
        assert np.hypot(u, v).max() > 1e-3 and np.ptp(x) > 1.001 * np.ptp(points[:, 0]), "nothing moved"
        total = np.array([np.sum(m * u), np.sum(m * v)])
        assert np.abs(total).max() <= 1e-12 * np.sum(m * np.hypot(u, v))
        assert np.abs([x.mean(), y.mean()] - points[:, :2].mean(0)).max() <= 1e-12 * DX
        final.append(np.stack([x, y]))
    for other in final[1:]:  # round-off of 12 steps of 6 sweeps; the bounds of sweeps are those of each array
        np.testing.assert_allclose(other, final[0], rtol=0.0, atol=1e-9 * DX)


def test_phases_next_to_vapour_change_alike_in_any_arrays():
    """Liquid at saturation starts its transition where vapour is near, of whichever array; some turns to vapour."""
    final = []
    points, left = block(1.0)
    for names, swapped in SPLITS:
        scheme = BoilingScheme(names, [], dim=2, spacing=DX, density=None, heat=HeatConduction(time_scaling=2000.0),
                               phases=PhaseChange(), material=WATER_1ATM)
        made = arrays(names, points, left ^ swapped, scheme.rho0)
        scheme.setup_properties(made)
        for pa in made:
            scheme.set_temperature(pa, WATER_1ATM.T_sat + 40.0)
            near = np.abs(pa.x - 6.5 * DX) + np.abs(pa.y - 6.5 * DX) < 2.6 * DX  # a square of vapour across the border
            pa.phase[near], pa.e[near] = Phase.VAPOUR, WATER_1ATM.L
            ready = (pa.y < 2.5 * DX) & (np.abs(pa.x - 4.0 * DX) < 2.0 * DX)
            pa.phase[ready], pa.e[ready] = Phase.TRANSITION, 0.999 * WATER_1ATM.L
        Stepper(scheme, made, dt=1.4e-3).step(40)
        final.append(gathered(made, "e", "phase", "vaporised"))
    (e, phase, vaporised), *others = final
    assert vaporised.sum() > 5 and np.count_nonzero(phase == Phase.TRANSITION) > 5, "nothing happened"
    for other in others:
        np.testing.assert_array_equal(other[1], phase)
        np.testing.assert_array_equal(other[2], vaporised)
        np.testing.assert_allclose(other[0], e, rtol=0.0, atol=1e-9 * WATER_1ATM.L)

"""The smallest form of each problem of motion tells finite numbers of the size that is expected."""
import math
from dataclasses import replace

import numpy as np
import pytest

from pysph_boiling.evaluation.problems.bubble_rise import BubbleRise
from pysph_boiling.evaluation.problems.dam_break import DamBreak
from pysph_boiling.evaluation.problems.drift import PeriodicBox, SloshingTank, StillWater
from pysph_boiling.evaluation.problems.hydrostatic import HydrostaticColumn, compression, nearest
from pysph_boiling.particles import fluid_block, wall_array
from pysph_boiling.schemes.effects import DensityConstraint
from pysph_boiling.schemes.pbf import PBFScheme

# Default settings end some steps before their tolerance; the outcome says how many.

COLUMN = HydrostaticColumn(layers=8, width=0.5, settle=6.0, watch=1.0)
SMALLEST = {
    "column, 2-D": (COLUMN, dict(density_mean=0.005, density_max=0.03, level=0.06, speed=0.05, pairs=0.2)),
    "column, 3-D": (replace(COLUMN, dim=3), dict(density_mean=0.005, density_max=0.03, level=0.09, speed=0.06,
                                                 pairs=0.4)),
    "dam break": (DamBreak(layers=8), dict(front=0.15, density_mean=0.005, density_max=0.1)),
    "sloshing": (SloshingTank(cells=16, settle=6.0), dict(gain=0.02, loss=0.9, period=0.05)),
    "still water": (StillWater(cells=8, duration=20.0), dict(speed=0.04, difference=1e-8)),
    "periodic box": (PeriodicBox(cells=8, steps=40), dict(momentum=1e-13, mass=0.0)),
}


@pytest.fixture(scope="module")
def outcomes():
    return {name: problem.run() for name, (problem, _) in SMALLEST.items()}


@pytest.mark.parametrize("name", SMALLEST)
def test_outcome_is_finite_and_of_the_expected_size(outcomes, name):
    found, (_, bounds) = outcomes[name], SMALLEST[name]
    assert found.errors.keys() == bounds.keys()
    for error, bound in bounds.items():
        assert abs(found.errors[error]) <= bound, f"{error} {found.errors[error]}"
    assert all(map(math.isfinite, found.facts.values()))
    assert found.seconds > 0.0 and found.simulated > 0.0 and found.steps > 0 and found.particles > 0
    for values in found.curves.values():
        assert len(values) == len(next(iter(found.curves.values())))


def test_sweeps_until_a_tolerance_reach_it(outcomes):
    fine = replace(COLUMN, density=DensityConstraint(max_sweeps=60, tolerance=1e-3)).run()
    assert fine.errors["density_mean"] <= 1e-3 < 2.0 * outcomes["column, 2-D"].errors["density_mean"]
    assert fine.facts["unconverged"] == 0.0


def test_start_gives_the_dam_no_velocity():
    """Unless it is settled the walls throw the column out, the faster the smaller the step."""
    front = {passes: DamBreak(layers=8, dt_factor=0.035, duration=0.25, density=DensityConstraint(
        max_sweeps=16, tolerance=1e-3, settle=passes)).run().errors["front"] for passes in (0, 50)}
    assert front[50] < 0.1 < front[0]


@pytest.mark.slow
def test_bubble_rises():
    found = BubbleRise(cells=5.0, settle=2.0, starts=2).run()
    assert 0.2 < found.facts["speed_low"] <= found.facts["speed"] <= found.facts["speed_high"] < 1.0
    assert found.errors["shredded"] <= 0.2 and np.all(np.isfinite(found.curves["height [diameters]"]))


def test_compression_against_the_plain_sum():
    """Over fluid and walls, by pairs one at a time."""
    dx = 0.1
    scheme = PBFScheme(["fluid"], ["wall"], dim=2, spacing=dx, rho0=1000.0)
    fluid = fluid_block((0.0, 0.0, 0.0), (0.9, 0.7, 0.0), spacing=dx, dim=2, rho0=1000.0, jitter=0.3, seed=2)
    fluid.y *= 0.8
    wall = wall_array([(x, -0.5 * dx, 0.0) for x in np.arange(0.05, 0.9, dx)], spacing=dx, dim=2, rho0=1000.0,
                      kernel=scheme.kernel)
    found = compression(fluid, [wall], scheme)
    h, rest = 1.2 * dx, 0.0
    for i, j in np.ndindex(9, 9):
        r = dx * math.hypot(i - 4, j - 4)
        rest += 1000.0 * dx**2 * scheme.kernel.kernel(xij=[r, 0.0, 0.0], rij=r, h=h)
    for i in range(len(fluid.x)):
        rho = sum(pa.m[j] * scheme.kernel.kernel(xij=[0.0] * 3, rij=math.hypot(
            fluid.x[i] - pa.x[j], fluid.y[i] - pa.y[j]), h=h) for pa in (fluid, wall) for j in range(len(pa.x)))
        assert found[i] == pytest.approx(max(rho / rest - 1.0, 0.0), abs=1e-5)  # the kernel is read from a table
    assert found.max() > 0.1


def test_distance_to_the_nearest_other_particle():
    """Two that nearly meet, two apart by 0.6 spacings, one alone at a distance of two."""
    block = fluid_block((0.0, 0.0, 0.0), (0.5, 0.1, 0.0), spacing=0.1, dim=2, rho0=1000.0)
    block.x[:], block.y[:] = [0.0, 0.001, 1.0, 1.0, 1.2], [0.0, 0.0, 0.0, 0.06, 0.0]
    np.testing.assert_allclose(nearest(block, 0.1), [0.01, 0.01, 0.6, 0.6, 2.0], rtol=1e-12)

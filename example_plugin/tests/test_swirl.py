"""The stirrer: its kernel against a formula in a real scheme, its options, its place among the effects, its lint."""
import argparse
from pathlib import Path

import numpy as np
import pysph_boiling_swirl
import pytest
from pysph_boiling_swirl import Swirl

from pysph_boiling import lint
from pysph_boiling.particles import fluid_block
from pysph_boiling.runs.stepper import Stepper
from pysph_boiling.schemes.auto import choose
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import EFFECTS, DensityConstraint
from pysph_boiling.schemes.pbf import PBFScheme

DX = 0.01


def block(dim=3, **effects):
    """A cube of water (in 2-D a square) without walls and gravity, not set up yet."""
    scheme = PBFScheme(["fluid"], [], dim=dim, spacing=DX, gravity=(0.0, 0.0, 0.0), density=DensityConstraint(),
                       **effects)
    upper = (6 * DX, 6 * DX, 6 * DX if dim == 3 else 0.0)
    return scheme, [fluid_block((0.0, 0.0, 0.0), upper, spacing=DX, dim=dim, rho0=1000.0)]


def angular_momentum(fluid, x, y):
    return float(np.sum(fluid.m * ((fluid.x - x) * fluid.v - (fluid.y - y) * fluid.u)))


def test_it_turns_the_water_and_says_what_it_gave():
    """From rest, L grows by grip * omega * I * dt a step; I is that of the lattice about the axis."""
    axis = (0.03, 0.03)
    scheme, arrays = block(swirl=Swirl(rate=2.0, grip=5.0, axis=axis))
    scheme.setup_properties(arrays)
    stepper = Stepper(scheme, arrays, dt=1e-3)
    fluid = stepper.arrays["fluid"]
    stepper.settle()
    inertia = float(np.sum(fluid.m * ((fluid.x - axis[0])**2 + (fluid.y - axis[1])**2)))
    stepper.step(1)  # forces are summed at the end of a step, for the next
    assert fluid.swirl.sum() == pytest.approx(5.0 * 2.0 * inertia * 1e-3, rel=1e-3)
    assert angular_momentum(fluid, *axis) == pytest.approx(0.0, abs=1e-9 * fluid.swirl.sum())
    stepper.step(1)
    assert angular_momentum(fluid, *axis) == pytest.approx(5.0 * 2.0 * inertia * 1e-3, rel=0.02)


def test_it_has_options_a_slot_and_a_rule():
    assert EFFECTS["swirl"] == [Swirl]
    assert "swirl" in PBFScheme.slots and "swirl" in BoilingScheme.slots
    scheme, arrays = block()
    parser = argparse.ArgumentParser()
    scheme.add_user_options(parser)
    scheme.consume_user_options(parser.parse_args(["--swirl.rate", "3", "--swirl.axis", "0.1,0.2"]))
    assert scheme.effects["swirl"] == Swirl(rate=3.0, axis=(0.1, 0.2))
    reasons = {choice.slot: choice for choice in choose(scheme, arrays)}
    assert reasons["swirl"].effect is None


def test_it_is_refused_in_2d_and_with_bad_numbers():
    scheme, arrays = block(dim=2, swirl=Swirl())
    with pytest.raises(ValueError, match="swirl: a vertical axis needs a 3-D scene"):
        scheme.setup_properties(arrays)
    with pytest.raises(ValueError, match="swirl.grip must be >= 0.0 1/s, got -1.0 1/s"):
        Swirl(grip=-1.0)


def test_the_lint_finds_nothing(capsys):
    assert lint.main(["--docstrings", str(Path(pysph_boiling_swirl.__file__).parent)]) == 0, capsys.readouterr().out

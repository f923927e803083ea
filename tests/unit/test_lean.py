"""Where lean sums take the place of general equations: what decides it, and what tells of it."""
from argparse import ArgumentParser

import numpy as np
import pytest
import sets
from full import make, subgroups
from harness import native_only
from pysph.base.kernels import Gaussian
from sets import scheme

from pysph_boiling.equations.cohesion import BubbleCohesion
from pysph_boiling.equations.density_constraint import PBFLambda, PBFMove
from pysph_boiling.equations.lean import LEAN, HostSum, LeanSum, PBFForcesLean, PBFSweepsLean
from pysph_boiling.equations.viscosity import PBFBodyForce, PBFXSPHViscosity
from pysph_boiling.particles import box_vessel, fluid_block
from pysph_boiling.schemes import lean
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import BoxContainer, HeatConduction, MechanicalLedger
from pysph_boiling.schemes.solver import has_host_sums

DX = 0.01
CORNERS = (0.0, 0.0, 0.0), (6 * DX, 6 * DX, 0.0)


def build(change=None, **kwargs):
    """A scheme and the classes that are built of it, on arrays that ``change`` (fluid, wall) may edit."""
    made = scheme("motion", dim=2, spacing=DX, **kwargs)
    common = dict(spacing=DX, dim=2, rho0=made.rho0)
    fluid, wall = fluid_block(*CORNERS, **common), box_vessel(*CORNERS, kernel=made.kernel, **common)
    made.setup_properties([fluid, wall])
    made.configure_solver(dt=1e-3)
    if change:
        change(fluid, wall)
    groups = made.get_equations().groups
    return made, {type(e) for stage in groups for parent in stage for group in parent.equations
                  for e in group.equations}


@native_only
def test_lean_sums_serve_where_masses_and_smoothing_lengths_are_uniform():
    made, built = build()
    asked_for = {type(term.equation) for term in made.terms()}
    assert {LEAN[cls] for cls in asked_for & set(LEAN)} <= built and not built & set(LEAN)
    assert {PBFSweepsLean, PBFForcesLean} <= built and not built & {PBFLambda, PBFMove, PBFXSPHViscosity, PBFBodyForce}
    assert "lean sums are used: the equations named ...Lean" in made.describe() and "PBFSweepsLean" in made.describe()


@pytest.mark.parametrize(("change", "why"), [
    (lambda fluid, wall: fluid.m.__setitem__(3, 1.001 * fluid.m[3]), "masses differ"),
    (lambda fluid, wall: fluid.h.__setitem__(3, 1.001 * fluid.h[3]), "smoothing lengths differ"),
    (lambda fluid, wall: wall.h.__setitem__(3, 1.001 * wall.h[3]), "smoothing lengths differ"),
])
def test_general_equations_serve_where_arrays_are_not_uniform(change, why):
    """Arrays are looked at when the scheme is built, so that what a run that goes on has read counts too."""
    made, built = build(change)
    assert not any(issubclass(cls, (HostSum, LeanSum)) for cls in built)
    assert f"lean sums are not used: {why}" in made.describe()


@native_only
def test_masses_of_walls_may_differ():
    _, built = build(lambda fluid, wall: wall.m.__imul__(np.linspace(1.0, 1.5, len(wall.m))))
    assert any(issubclass(cls, LeanSum) for cls in built)


def test_lean_sums_can_be_turned_off():
    made, built = build(lean=False)
    assert not any(issubclass(cls, (HostSum, LeanSum)) for cls in built)
    assert "lean sums are not used: as asked" in made.describe()


@pytest.mark.parametrize(("arguments", "wanted"), [([], True), (["--no-lean"], False)])
def test_one_option_turns_them_off(arguments, wanted):
    made, parser = scheme("motion", dim=2, spacing=DX), ArgumentParser()
    made.add_user_options(parser)
    made.consume_user_options(parser.parse_args(arguments))
    assert made.lean is wanted


def test_general_equations_serve_on_a_device_and_with_other_kernels(monkeypatch):
    made = BoilingScheme(["fluid"], [], dim=2, spacing=DX, density=None, heat=HeatConduction(), kernel=Gaussian(dim=2))
    fluid = fluid_block(*CORNERS, spacing=DX, dim=2, rho0=made.rho0)
    assert lean.why_general(made, {"fluid": fluid}) == "the kernel is Gaussian"
    monkeypatch.setattr(lean, "get_backend", lambda: "opencl")
    assert lean.why_general(made, {"fluid": fluid}) == "on a device"


def test_nothing_is_lean_before_the_particles_are_known():
    made = scheme("motion", dim=2, spacing=DX)
    assert made.built_terms()[1] == "particles are not known yet"


@pytest.mark.parametrize(("fluids", "effects", "served", "why"), [
    (["fluid", "other"], {}, True, "there are several fluids"),
    (["fluid"], {"mechanics": MechanicalLedger()}, True, "the mechanical ledger looks at what each equation does"),
    (["fluid"], {}, False, "they need GCC or Clang, and a processor with AVX2"),
])
def test_where_general_equations_serve(fluids, effects, served, why, monkeypatch):
    monkeypatch.setattr(lean, "serves", lambda: served)
    made = BoilingScheme(fluids, [], dim=2, spacing=DX, container=BoxContainer(), **effects)
    arrays = {name: fluid_block(*CORNERS, spacing=DX, dim=2, rho0=made.rho0, name=name) for name in fluids}
    assert lean.why_general(made, arrays) == why


def built_of(effects):
    """Names of the classes that are built of the effects."""
    return {type(e).__name__ for _, group in subgroups(make(effects=effects)[2]) for e in group.equations}


@native_only
def test_terms_that_lean_ones_do_not_know_stay(monkeypatch):
    """With a term among the density sweeps that they do not know the sweeps stay, and what else is lean is lean."""
    monkeypatch.setattr(lean, "IN_SWEEPS", lean.IN_SWEEPS - {BubbleCohesion})
    built = built_of(sets.SETS["expand"])
    assert {"PBFDensitySwollen", "PBFMove", "PBFForcesLean", "HeatConductionClearyMonaghanLean"} <= built
    assert not {"PBFSweepsLean", "PBFDensityLean"} & built


@native_only
def test_lean_sums_serve_vapour_that_swells():
    """What changes the swell itself stays."""
    built = built_of(sets.SETS["expand"])
    assert {"PBFDensityLean", "PBFSweepsLean", "PBFForcesLean", "BubbleSwell", "BubbleSwellBack"} <= built
    assert not {name for name in built if "Swollen" in name}


@native_only
def test_solver_knows_whether_the_sums_in_c_are_called_for():
    assert has_host_sums(make(effects=sets.SETS["motion"])[2])
    assert not has_host_sums(make(effects=sets.SETS["motion"], lean=False)[2])
    assert not has_host_sums([PBFBodyForce("fluid", None)])

"""A cloud of fluid beside walls, with every kernel that moves it, and a column of water in a tank.

All kernels of the cloud sit in one compiled module; a group runs when its name is asked for. Masses are unequal and
wall particles lie at random: half of the fluid is compressed, some of it hardly has a neighbour.
"""
from copy import copy
from functools import cache

import numpy as np
from harness import Evaluator, Stepper, random_cloud
from pysph.sph.equation import Group
from sets import scheme

from pysph_boiling.equations.artificial_pressure import PBFArtificialPressure
from pysph_boiling.equations.container import PBFBoxContainer, PBFCylinderContainer, PBFDistanceContainer
from pysph_boiling.equations.density_constraint import (
    PBFDensitySwollen,
    PBFMove,
    PBFMoveAccelerated,
    PBFPositionCorrectionSwollen,
    PBFPressure,
)
from pysph_boiling.equations.wall_multipliers import (
    PBFWallCorrection,
    PBFWallMultiplier,
    PBFWallStart,
    PBFWallWarmStart,
)
from pysph_boiling.equations.warm_start import PBFWarmStartSwollen
from pysph_boiling.particles import box_vessel, fluid_array, fluid_block
from pysph_boiling.rooms import Room, ball, box
from pysph_boiling.schemes.effects import BoxContainer, DensityConstraint

__all__ = [
    "CYLINDER", "DEPTH", "DX", "INSET", "N_FLUID", "RHO0", "ROUND_OFF", "STRENGTH", "WIDTH", "Kernels", "close",
    "cloud", "column", "compile_kernels", "inside_box", "pairs", "reset", "room_of", "tank",
]

ROUND_OFF = 1e-12  # sums of some 80 terms, in another order than the compiled ones
RHO0 = 958.0
N_FLUID, N_WALL = 60, 20
LOWER, UPPER = (0.1, 0.2, 0.15), (0.8, 0.7, 0.9)
CYLINDER = dict(centre=(0.4, 0.6), radius=0.3, bottom=0.1, top=0.8)
DEPTH, INSET = 0.1, 0.02  # of a contact, and of a room
STRENGTH = 3.0  # of the artificial pressure [m^2/s^2]
DX = 0.01  # of the tank
WIDTH, HEIGHT = 16, 24  # of the tank, spacings


class Kernels:
    """Groups of equations compiled once; ``run("density", "move")`` evaluates only the groups named."""

    def __init__(self, arrays, groups, *, dim, domain=None):
        self.wanted = ()
        self.evaluator = Evaluator(arrays, [
            Group(equations, name=name, condition=lambda t, dt, name=name: name in self.wanted)
            for name, equations in groups.items()], dim=dim, domain=domain)
        self.kernel = self.evaluator.kernel
        self.fluid, self.wall = arrays

    def run(self, *wanted, dt=1.0):
        self.wanted = wanted
        self.evaluator.run(dt=dt)


def pairs(a, b, kernel):
    """Kernel values (n, m) and gradients (n, m, 3) of each pair of two arrays."""
    W, G = np.zeros((len(a.x), len(b.x))), np.zeros((len(a.x), len(b.x), 3))
    for i, j in np.ndindex(*W.shape):
        x = np.array([a.x[i] - b.x[j], a.y[i] - b.y[j], a.z[i] - b.z[j]])
        r, h = np.linalg.norm(x), 0.5 * (a.h[i] + b.h[j])
        W[i, j] = kernel.kernel(x, r, h)
        kernel.gradient(x, r, h, G[i, j])
    return W, G


@cache
def room_of(dim):
    """The box of the cloud without a ball in its middle, on a coarse grid."""
    middle = 0.5 * (np.array(LOWER) + UPPER)
    return Room.of(box(LOWER[:dim], UPPER[:dim], dim).without([ball(middle[:dim], 0.12, dim)]), spacing=0.07)


def compile_kernels(fluid, wall, *, dim, spacing):
    """The equations of the set "motion" with the parameters that the scheme gives them, and a cylinder."""
    motion = scheme("motion", dim=dim, spacing=spacing, changes=dict(container=BoxContainer(upper=(100.0,) * 3)))
    motion.setup_properties([fluid, wall])
    for name in ("swell", "qx", "qy", "qz", "q_lmbda", "pressure"):
        fluid.add_property(name)
    for name in ("wall_lmbda", "wall_start", "wall_weight"):
        wall.add_property(name)
    fluid.add_constant("sweep_weight", [1.0, np.inf, 0.0])
    fluid.add_constant("room", room_of(dim).values.ravel())
    by_name = {type(equation).__name__: equation for _, equation, _ in motion.terms()}
    container = dict(lower=LOWER, upper=UPPER) if dim == 3 else dict(lower=(*LOWER[:2], 0.0), upper=(*UPPER[:2], 0.0))
    kernels = Kernels([fluid, wall], {
        "back": [by_name["PBFStepBack"]],
        "before": [copy(by_name["PBFDensity"]), copy(by_name["PBFBoundaryDensity"])],
        "left_over": [by_name["PBFLeftOver"]],
        "density": [by_name["PBFDensity"], by_name["PBFBoundaryDensity"], by_name["PBFLambda"]],
        "swollen_density": [PBFDensitySwollen("fluid", ["fluid"], rho_rest=by_name["PBFDensity"].rho_rest,
                                              kernel=motion.kernel),
                            copy(by_name["PBFBoundaryDensity"]), copy(by_name["PBFLambda"])],
        "correction": [by_name["PBFPositionCorrection"], by_name["PBFBoundaryCorrection"]],
        "swollen_correction": [
            PBFPositionCorrectionSwollen("fluid", ["fluid"], rho_rest=by_name["PBFDensity"].rho_rest,
                                         kernel=motion.kernel, nudge=by_name["PBFPositionCorrection"].nudge),
            copy(by_name["PBFBoundaryCorrection"])],
        "artificial_pressure": [PBFArtificialPressure(
            "fluid", ["fluid"], rho_rest=by_name["PBFDensity"].rho_rest, kernel=motion.kernel, hdx=motion.hdx,
            strength=STRENGTH)],
        "warm_start": [by_name["PBFWarmStart"], by_name["PBFBoundaryWarmStart"]],
        "swollen_warm_start": [PBFWarmStartSwollen("fluid", ["fluid"], rho_rest=by_name["PBFDensity"].rho_rest),
                               copy(by_name["PBFBoundaryWarmStart"])],
        "wall_multipliers": [PBFWallMultiplier("wall", ["fluid"])],
        "wall_correction": [PBFWallCorrection("fluid", ["wall"], rho_rest=by_name["PBFDensity"].rho_rest)],
        "wall_start": [PBFWallStart("wall", ["fluid"])],
        "wall_warm_start": [PBFWallWarmStart("fluid", ["wall"], rho_rest=by_name["PBFDensity"].rho_rest)],
        "pressure": [PBFPressure("fluid", ["fluid"], rho0=RHO0, rho_rest=by_name["PBFDensity"].rho_rest)],
        "move": [PBFMove("fluid", None, omega=0.7, max_displacement=0.25 * spacing)],
        "move_accelerated": [PBFMoveAccelerated("fluid", None, omega=0.7, max_displacement=0.25 * spacing, radius=0.9,
                                                delay=2)],
        "box": [PBFBoxContainer("fluid", None, depth=DEPTH, **container)],
        "cylinder": [PBFCylinderContainer("fluid", None, depth=DEPTH, dim=dim, **CYLINDER)],
        "room": [PBFDistanceContainer("fluid", None, room=room_of(dim), inset=INSET, depth=DEPTH)],
        "gravity": [by_name["PBFBodyForce"]],
        "viscosity": [by_name["PBFXSPHViscosity"]],
        "friction": [by_name["PBFWallFriction"]],
    }, dim=dim)
    kernels.parameters, kernels.spacing, kernels.dim = by_name, spacing, dim
    return kernels


def cloud(dim, scale=1.0):
    """Fluid at random in a cube of edge ``scale``, walls at random about its face x = 0; some fluid is compressed."""
    spacing = {2: 0.7, 3: 1.0}[dim] * scale * N_FLUID ** (-1.0 / dim)
    fluid = fluid_array(scale * random_cloud(N_FLUID, dim, seed=1), spacing=spacing, dim=dim, rho0=RHO0)
    wall = fluid_array(scale * random_cloud(N_WALL, dim, seed=2), spacing=spacing, dim=dim, rho0=RHO0, name="wall")
    wall.x[:] = 0.5 * wall.x - 0.25 * scale
    wall.add_property("heated", type="int")
    random = np.random.default_rng(3)
    fluid.m *= random.uniform(0.5, 2.0, N_FLUID)
    wall.m *= random.uniform(0.5, 2.0, N_WALL)
    return fluid, wall, spacing


def reset(compiled):
    """The random cloud in its initial state."""
    fluid, wall, _ = cloud(compiled.dim)
    for pa, start in ((compiled.fluid, fluid), (compiled.wall, wall)):
        for name in ("x", "y", "z", "m"):
            pa.get(name)[:] = start.get(name)
    compiled.fluid.swell[:] = np.random.default_rng(6).uniform(0.3, 1.7, N_FLUID)
    for name in ("sx", "sy", "sz", "limited", "contacts", "projected", "au", "av", "aw"):
        compiled.fluid.get(name)[:] = 0
    compiled.fluid.sweeps[0] = 0.0
    compiled.fluid.prior[:] = 1.0
    return compiled


def close(actual, expected, scale=None):
    """Equal to round-off of the largest value."""
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=ROUND_OFF * (scale or np.abs(expected).max()))


def column(width=8, fill=12, *, height=HEIGHT, jitter=0.1, lean=True, **density):
    """A column of water, disordered, in a wider tank, and the scheme of the set "motion": (scheme, arrays)."""
    upper = (WIDTH * DX, height * DX, 0.0)
    motion = scheme("motion", dim=2, spacing=DX, changes=dict(container=BoxContainer(upper=upper)), lean=lean)
    motion.set_effects(density=DensityConstraint(**density))
    common = dict(spacing=DX, dim=2, rho0=motion.rho0)
    arrays = [fluid_block((0.0, 0.0, 0.0), (width * DX, fill * DX, 0.0), jitter=jitter, seed=1, **common),
              box_vessel((0.0, 0.0), upper[:2], kernel=motion.kernel, **common)]
    motion.setup_properties(arrays)
    return motion, arrays


def tank(width=8, fill=12, jitter=0.2, dt_factor=0.07, **density):
    """The same, ready to step."""
    motion, arrays = column(width, fill, jitter=jitter, **density)
    return Stepper(motion, arrays, dt=motion.time_step(dt_factor))


def inside_box(x, dim):
    return np.clip(x, (*LOWER[:dim], *[0.0] * (3 - dim)), (*UPPER[:dim], *[0.0] * (3 - dim)))

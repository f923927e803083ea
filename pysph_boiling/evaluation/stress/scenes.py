"""The scenes of the difficult cases: three sets of effects in a vessel of water."""
import numpy as np

from pysph_boiling.evaluation.stress.case import Setup
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.particles import box_vessel, fluid_array, site_array
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    AmbientLoss,
    BoxContainer,
    BubbleLabels,
    Buoyancy,
    Cohesion,
    Condensation,
    Convection,
    DensityConstraint,
    Drag,
    DynamicNucleation,
    Expansion,
    HeatConduction,
    Heater,
    HeatSource,
    LatentPooling,
    Oscillation,
    PhaseChange,
    PresetNucleation,
    Refill,
    SiteAdhesion,
    Venting,
    XSPHViscosity,
)

__all__ = ["BOIL", "DX", "EVERYTHING", "L", "MOTION", "NO_HEAT", "T_SAT", "ball", "block", "vessel"]

DX, T_SAT, L = 0.004, WATER_1ATM.T_sat, WATER_1ATM.L

MOTION = dict(viscosity=XSPHViscosity(wall=1.0))
BOIL = dict(
    viscosity=XSPHViscosity(), heat=HeatConduction(time_scaling=800.0), heater=Heater(temperature=T_SAT + 60.0),
    phases=PhaseChange(), preset_nucleation=PresetNucleation(), bubbles=BubbleLabels(), condensation=Condensation(),
    pooling=LatentPooling(), buoyancy=Buoyancy(), cohesion=Cohesion(), adhesion=SiteAdhesion(), drag=Drag(),
    venting=Venting())
EVERYTHING = {
    **BOIL, "loss": AmbientLoss(), "source": HeatSource(density=1e3),
    "dynamic_nucleation": DynamicNucleation(superheat_limit=30.0),
    "convection": Convection(), "expansion": Expansion(), "oscillation": Oscillation(form="relative"),
    "venting": Venting(mode="remove"), "refill": Refill()}
NO_HEAT = dict(loss=AmbientLoss(coefficient=0.0), source=HeatSource(density=0.0))  # same modules, no exchange


def block(dim, lower, upper, *, spacing=1.0, jitter=0.01, seed=0):
    """Points (n, 3) of a lattice that fills a box, in spacings; the corners have ``dim`` components."""
    counts = np.round((np.array(upper, float) - lower) / spacing).astype(int)
    points = np.zeros((int(np.prod(counts)), 3))
    points[:, :dim] = np.array(lower) + spacing * (np.indices(counts).reshape(dim, -1).T + 0.5)
    points[:, :dim] += jitter * np.random.default_rng(seed).uniform(-1.0, 1.0, (len(points), dim))
    return points


def ball(centre, radius):
    """A function that returns which points lie in a disc or ball; lengths in spacings."""
    return lambda points: np.sum((points[:, :len(centre)] - centre) ** 2, axis=1) < radius**2


def vessel(dim, size, points, effects, *, velocity=None, temperature=T_SAT - 2.0, vapour=None, e_vapour=L, mass=1.0,
           smoothing=1.0, heated=0.7, sites=None, density=None, material=WATER_1ATM, gravity=None, uid=None, lean=True,
           **setup):
    """A box of ``size`` (dim numbers) with fluid at ``points`` (n, 3), lengths in spacings.

    ``velocity`` [m/s], ``temperature`` [K], ``vapour`` (bool), ``mass`` and ``smoothing`` (both relative to the usual
    values) are one value for all, an array, or a function of the points. ``density`` overrides
    :class:`DensityConstraint`, ``lean`` is that of the scheme. Further keywords are passed to :class:`Setup`.
    """
    points = np.asarray(points, float)
    upper = (*(DX * component for component in size), *(0.0,) * (3 - dim))
    names = ["sites"] if "preset_nucleation" in effects else []
    scheme = BoilingScheme(["fluid"], ["wall"], dim=dim, spacing=DX, sites=names, material=material, gravity=gravity,
                           density=density or DensityConstraint(), lean=lean,
                           **{"container": BoxContainer(upper=upper), **effects})
    common = dict(spacing=DX, dim=dim, rho0=scheme.rho0)
    fluid = fluid_array(DX * points, **common)
    beyond = np.array([4.0 * DX if setup.get("domain") else 0.0, 0.0, 0.0])  # cut off again: periodic
    wall = box_vessel(-beyond, upper + beyond, kernel=scheme.kernel, heated_fraction=heated, **common)
    wall.remove_particles(np.flatnonzero((wall.x < 0.0) | (wall.x > upper[0])) if beyond.any() else [])
    arrays = [fluid, wall]
    if names:
        middle = np.zeros((1, 3))
        middle[0, :dim - 1] = np.array(size[:dim - 1]) / 2.0
        arrays.append(site_array(DX * (middle if sites is None else np.asarray(sites, float)), reach=2.4 * DX,
                                 spacing=DX))
    if uid is not None:
        fluid.uid[:] = uid
    fluid.m[:] *= value(mass, points)
    fluid.h[:] *= value(smoothing, points)
    if velocity is not None:
        fluid.u[:], fluid.v[:], fluid.w[:] = np.broadcast_to(value(velocity, points), points.shape).T
    scheme.setup_properties(arrays)
    if "heat" in effects:
        scheme.set_temperature(fluid, value(temperature, points))
    if vapour is not None:
        chosen = np.broadcast_to(value(vapour, points), len(points))
        fluid.phase[chosen], fluid.e[chosen] = Phase.VAPOUR, e_vapour
    return Setup(scheme=scheme, arrays=arrays, **setup)


def value(given, points):
    return given(points) if callable(given) else given

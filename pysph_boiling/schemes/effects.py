"""Effects: what a scene may ask for. One frozen dataclass each, nothing else to change when one is added.

An effect states its parameters (with unit, bounds and meaning), the effects it needs, the properties, constants,
energy flows and result columns it adds, and yields its equations as :class:`Term`. A scene that leaves an effect out
has none of these. A class registers itself by its ``slot``; several classes may share a slot (two containers).
"""
import dataclasses
import math
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import numpy as np
from pysph.solver.tools import Tool

from pysph_boiling.equations import (
    bubble_groups,
    buoyancy,
    container,
    density_constraint,
    heat,
    nucleation,
    phase_change,
    surface_tension,
    venting,
    viscosity,
)
from pysph_boiling.particles import Property, lattice_density
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.stages import Term

__all__ = [
    "AmbientLoss", "BoxContainer", "BubbleLabels", "Buoyancy", "Cohesion", "Column", "CylinderContainer",
    "DensityConstraint", "Drag",
    "EFFECTS", "Effect", "Flow", "HeatConduction", "HeatSource", "Heater", "PhaseChange", "PresetNucleation", "Scene",
    "SiteAdhesion", "Venting", "XSPHViscosity", "heat_step_limit", "param",
]

EFFECTS: dict[str, list[type]] = {}  # slot -> effect classes, in the order in which their terms stand in a group


@dataclass(frozen=True, kw_only=True)
class Scene:
    """What an effect may know about the scene it belongs to. Lengths in m, times in s, masses in kg."""

    fluids: tuple[str, ...]
    solids: tuple[str, ...]
    sites: tuple[str, ...]
    dim: int
    spacing: float
    h: float
    kernel: Any
    rho0: float
    material: Any
    gravity: tuple[float, float, float]
    effects: dict[str, "Effect"]

    @property
    def g(self):
        """Magnitude of gravity [m/s^2]."""
        return float(np.linalg.norm(self.gravity))

    @property
    def up(self):
        """Unit vector against gravity; along the last axis where there is none."""
        if self.g == 0.0:
            return tuple(float(axis == self.dim - 1) for axis in range(3))
        return tuple(-component / self.g for component in self.gravity)

    @property
    def particle_mass(self):
        """Mass of a particle of the rest lattice [kg, or kg/m in 2-D]."""
        return self.rho0 * self.spacing**self.dim

    @property
    def fall_time(self):
        """t* = sqrt(spacing/|g|) [s], the unit of time of the tuned rates; infinite without gravity."""
        return math.sqrt(self.spacing / self.g) if self.g else math.inf

    @property
    def support(self):
        """Support radius of the kernel [m]."""
        return self.kernel.radius_scale * self.h


class Column(NamedTuple):
    """A column of ``results.npz``; ``value(arrays, scene)`` takes the fluid arrays."""

    name: str
    unit: str
    meaning: str
    value: Callable


class Flow(NamedTuple):
    """Enthalpy that crosses the border of the domain [J]: the sum of a per-particle property, or a constant.

    ``sign`` is +1 where a positive value brings energy in. ``leak`` marks energy made or lost by a literal form of the
    paper: it is no flow, but the ledger closes with it.
    """

    name: str
    sign: int
    prop: str | None = None
    constant: str | None = None
    leak: bool = False


def param(default, unit, meaning, *, low=None, high=None, above=None, choices=None):
    """A parameter of an effect: a dataclass field that carries unit, meaning and bounds.

    ``low`` and ``high`` are allowed values, ``above`` is not. ``None`` as the default means that the scene decides.
    """
    meta = dict(unit=unit, meaning=meaning, low=low, high=high, above=above, choices=choices)
    return field(default=default, metadata=meta)


def check_parameters(instance, label):
    """Coerce the parameters of a dataclass made of :func:`param` and check them against their bounds."""
    for spec in dataclasses.fields(instance):
        value, meta = getattr(instance, spec.name), spec.metadata
        if "unit" not in meta or (value is None and spec.default is None):
            continue
        name, unit = f"{label}.{spec.name}", "" if meta["unit"] == "-" else f" {meta['unit']}"
        if meta["choices"]:
            if value not in meta["choices"]:
                raise ValueError(f"{name} must be one of {', '.join(map(str, meta['choices']))}; got {value!r}")
            continue
        if isinstance(value, bool) or isinstance(spec.default, bool):
            if not isinstance(value, bool):
                raise ValueError(f"{name} must be True or False, got {value!r}")
            continue
        try:
            numbers = tuple(float(v) for v in value) if isinstance(value, (tuple, list, np.ndarray)) else float(value)
        except (TypeError, ValueError):
            raise ValueError(f"{name} must be a number{' in' + unit if unit else ''}, got {value!r}") from None
        for number in numbers if isinstance(numbers, tuple) else (numbers,):
            for bad, text in (
                (not math.isfinite(number), "be finite"),
                (meta["low"] is not None and number < meta["low"], f"be >= {meta['low']}{unit}"),
                (meta["high"] is not None and number > meta["high"], f"be <= {meta['high']}{unit}"),
                (meta["above"] is not None and number <= meta["above"], f"be > {meta['above']}{unit}"),
            ):
                if bad:
                    raise ValueError(f"{name} must {text}, got {number}{unit}")
        if isinstance(spec.default, int) and not isinstance(numbers, tuple):
            if numbers != int(numbers):
                raise ValueError(f"{name} must be a whole number, got {value}")
            numbers = int(numbers)
        object.__setattr__(instance, spec.name, numbers)


@dataclass(frozen=True, kw_only=True)
class Effect:
    """Base of all effects. Subclasses are frozen dataclasses whose fields are made by :func:`param`."""

    slot: ClassVar[str] = ""
    title: ClassVar[str] = ""
    requires: ClassVar[tuple[str, ...]] = ()
    on_device: ClassVar[bool] = False  # whether it was shown to run on OpenCL

    @property
    def removes_particles(self):
        """Whether particles leave the arrays, so that what they summed up must be carried on."""
        return False

    def __init_subclass__(cls, **kwargs):
        super().__init_subclass__(**kwargs)
        EFFECTS.setdefault(cls.slot, []).append(cls)

    def __post_init__(self):
        check_parameters(self, self.slot)

    def replaced(self, **changes):
        """A copy with some parameters changed."""
        unknown = changes.keys() - {spec.name for spec in dataclasses.fields(self)}
        if unknown:
            raise ValueError(f"{self.title} has no parameter {', '.join(sorted(unknown))}")
        return dataclasses.replace(self, **changes)

    def properties(self, scene) -> tuple[Property, ...]:
        """Properties this effect adds to each fluid array."""
        return ()

    def constants(self, scene) -> dict[str, Any]:
        """Constants this effect adds to each fluid array, with their initial values."""
        return {}

    def flows(self, scene) -> tuple[Flow, ...]:
        """Enthalpy that this effect carries across the border of the domain."""
        return ()

    def columns(self, scene) -> tuple[Column, ...]:
        """Columns this effect adds to the results."""
        return ()

    def check(self, scene, arrays):
        """Raise ``ValueError`` where the scene's arrays cannot serve this effect."""

    def prepare(self, scene, arrays):
        """Set constants that depend on the arrays, once they have all their properties."""

    def warnings(self, scene, dt) -> Iterator[str]:
        """Sentences about parameters that are known to give poor results at time step ``dt`` [s]."""
        return iter(())

    def terms(self, scene, fluid) -> Iterator[Term]:
        """Equations with ``fluid`` as their destination."""
        return iter(())

    def hooks(self, scene) -> dict[str, Callable]:
        """What runs on the host after a group: place -> function of the fluid arrays."""
        return {}

    def tools(self, scheme) -> Iterator:
        """PySPH tools that act between steps, before the ledger looks."""
        return iter(())


def total(arrays, name, carried=True):
    """Sum of a property over the real particles of all arrays, with what removed particles took along."""
    value = 0.0
    for pa in arrays:
        if pa.gpu is not None:
            pa.gpu.pull(name)
        value += float(np.sum(pa.get(name, only_real_particles=True), dtype=float))
        if carried and f"carried_{name}" in pa.constants:
            value += float(pa.constants[f"carried_{name}"].get_npy_array()[0])
    return value


def gather(arrays, name):
    """A property of the real particles of all arrays, in one array."""
    for pa in arrays:
        if pa.gpu is not None:
            pa.gpu.pull(name)
    return np.concatenate([pa.get(name, only_real_particles=True) for pa in arrays])


def cumulative(name, unit, meaning, prop):
    """Column that sums a cumulative per-particle property."""
    return Column(name, unit, meaning, lambda arrays, scene: total(arrays, prop))


def heat_step_limit(rho0, c, k, h):
    """Explicit limit of the heat step [s], 0.1 rho c h^2 / k (Cleary & Monaghan 1999)."""
    return 0.1 * rho0 * c * h * h / k


# --- motion -----------------------------------------------------------------------------------------------------------


class Sweeps(Tool):
    """Counts the steps whose density sweeps ended at their maximum, above the tolerance; warns at the first."""

    def __init__(self, scheme, effect):
        self.scheme, self.effect = scheme, effect

    def post_step(self, solver):
        for pa in self.scheme.arrays:
            error = float(pa.density_error[0])
            if pa.sweeps[0] >= self.effect.max_sweeps and error > self.effect.tolerance:
                pa.unconverged[0] += 1.0
                if pa.unconverged[0] == 1.0:
                    warnings.warn(
                        f"at t = {solver.t + solver.dt:.4g} s the density sweeps of '{pa.name}' ended at their maximum "
                        f"of {self.effect.max_sweeps} with a mean error of {error:.2%} (tolerance "
                        f"{self.effect.tolerance:.2%}); more such steps are counted as n_unconverged", stacklevel=2)


@dataclass(frozen=True, kw_only=True)
class DensityConstraint(Effect):
    """Incompressible motion by Position Based Fluids, under gravity. A scene without it stands still."""

    slot: ClassVar[str] = "density"
    title: ClassVar[str] = "density constraint"
    on_device: ClassVar[bool] = True
    min_sweeps: int = param(2, "-", "sweeps that are always done", low=1)
    max_sweeps: int = param(6, "-", "sweeps after which a step ends whatever its residual", low=1)
    tolerance: float = param(4e-3, "-", "mean positive density error below which the sweeps end", low=0.0)
    omega: float = param(0.7, "-", "under-relaxation", above=0.0, high=1.0)
    eps: float = param(0.1, "-", "relaxation, relative to sum w |grad C|^2 of the rest lattice", low=0.0)
    longest: float = param(0.25, "-", "displacement limit of a sweep, in spacings", above=0.0)

    def __post_init__(self):
        super().__post_init__()
        if self.min_sweeps > self.max_sweeps:
            raise ValueError(f"density.min_sweeps = {self.min_sweeps} is above density.max_sweeps = {self.max_sweeps}")

    def properties(self, scene):
        return (
            Property("au", "m/s^2", "acceleration that enters the next prediction", state=True),
            Property("av", "m/s^2", "acceleration", state=True),
            Property("aw", "m/s^2", "acceleration", state=True),
            Property("sx", "m", "displacement of this step, x* - x"),
            Property("sy", "m", "displacement of this step"),
            Property("sz", "m", "displacement of this step"),
            Property("lmbda", "kg m^2", "Lagrange multiplier of the density constraint"),
            Property("compression", "-", "positive part of the density constraint C"),
            Property("gcx", "1/m", "gradient of C with respect to the particle itself"),
            Property("gcy", "1/m", "gradient of C"),
            Property("gcz", "1/m", "gradient of C"),
            Property("gc2", "1/(kg m^2)", "sum over the others of |grad C|^2 / m"),
            Property("dpx", "m", "position correction of one sweep"),
            Property("dpy", "m", "position correction of one sweep"),
            Property("dpz", "m", "position correction of one sweep"),
            Property("limited", "-", "corrections cut by the displacement limiter since the start", "int", True, True),
        )

    def constants(self, scene):
        return {"density_error": [0.0, 0.0], "sweeps": 0.0, "unconverged": 0.0}

    def columns(self, scene):
        return (
            Column("sweeps", "-", "density sweeps of the last step",
                   lambda arrays, scene: max(float(pa.sweeps[0]) for pa in arrays)),
            Column("density_error_mean", "-", "mean positive density error before the last sweep",
                   lambda arrays, scene: max(float(pa.density_error[0]) for pa in arrays)),
            Column("density_error_max", "-", "largest positive density error before the last sweep",
                   lambda arrays, scene: max(float(pa.density_error[1]) for pa in arrays)),
            Column("n_unconverged", "-", "steps since the start whose sweeps ended above the tolerance",
                   lambda arrays, scene: max(float(pa.unconverged[0]) for pa in arrays)),
            cumulative("n_limited", "-", "corrections cut by the displacement limiter since the start", "limited"),
        )

    def tools(self, scheme):
        yield Sweeps(scheme, self)

    def terms(self, scene, fluid):
        fluids, walls = list(scene.fluids), list(scene.solids)
        density, squares = lattice_density(scene.kernel, dim=scene.dim, hdx=scene.h / scene.spacing)
        rho_rest = scene.rho0 * density
        eps = self.eps * squares / (scene.spacing**2 * scene.particle_mass)
        yield Term("density.multiplier", density_constraint.PBFDensity(fluid, fluids, rho_rest=rho_rest))
        yield Term("density.correction", density_constraint.PBFPositionCorrection(
            fluid, fluids, rho_rest=rho_rest, nudge=0.05 * scene.spacing, dim=scene.dim))
        if walls:
            yield Term("density.multiplier", density_constraint.PBFBoundaryDensity(fluid, walls, rho_rest=rho_rest))
            yield Term("density.correction", density_constraint.PBFBoundaryCorrection(fluid, walls, rho_rest=rho_rest))
        yield Term("density.multiplier", density_constraint.PBFLambda(
            fluid, None, rho_rest=rho_rest, eps=eps, tolerance=self.tolerance))
        yield Term("density.correction", density_constraint.PBFMove(
            fluid, None, omega=self.omega, longest=self.longest * scene.spacing))
        gx, gy, gz = scene.gravity
        yield Term("forces.sum", viscosity.PBFBodyForce(fluid, None, gx=gx, gy=gy, gz=gz))


PROJECTED = Property("projected", "-", "projections into the container since the start", "int", True, True)
N_PROJECTED = cumulative("n_projected", "-", "projections into the container since the start", "projected")


@dataclass(frozen=True, kw_only=True)
class BoxContainer(Effect):
    """A box that particles cannot leave: they are projected back to its inside."""

    slot: ClassVar[str] = "container"
    title: ClassVar[str] = "box container"
    on_device: ClassVar[bool] = True
    requires: ClassVar[tuple[str, ...]] = ("density",)
    lower: tuple = param((0.0, 0.0, 0.0), "m", "lower corner of the inside")
    upper: tuple = param((1.0, 1.0, 1.0), "m", "upper corner of the inside; the top is a lid")
    margin: float = param(0.1, "-", "particles stop this many spacings before a face", low=0.0, high=0.5)

    def __post_init__(self):
        super().__post_init__()
        if len(self.lower) != 3 or len(self.upper) != 3:
            raise ValueError("container.lower and container.upper must hold three lengths [m] each")

    def properties(self, scene):
        return (PROJECTED,)

    def columns(self, scene):
        return (N_PROJECTED,)

    def bounds(self, scene):
        """Corners that particle centres may reach [m]."""
        inset = self.margin * scene.spacing
        lower = [v + inset if axis < scene.dim else 0.0 for axis, v in enumerate(self.lower)]
        upper = [v - inset if axis < scene.dim else 0.0 for axis, v in enumerate(self.upper)]
        return lower, upper

    def check(self, scene, arrays):
        lower, upper = self.bounds(scene)
        for axis in range(scene.dim):
            if not lower[axis] < upper[axis]:
                raise ValueError(f"container: lower {'xyz'[axis]} must be below upper {'xyz'[axis]}, got "
                                 f"{self.lower[axis]} and {self.upper[axis]} m")

    def terms(self, scene, fluid):
        lower, upper = self.bounds(scene)
        yield Term("density.correction", container.PBFBoxContainer(fluid, None, lower=lower, upper=upper))


@dataclass(frozen=True, kw_only=True)
class CylinderContainer(Effect):
    """An upright cylinder that particles cannot leave; in 2-D its section through the axis."""

    slot: ClassVar[str] = "container"
    title: ClassVar[str] = "cylinder container"
    on_device: ClassVar[bool] = True
    requires: ClassVar[tuple[str, ...]] = ("density",)
    centre: tuple = param((0.0, 0.0), "m", "axis position (x, y); only x counts in 2-D")
    radius: float = param(1.0, "m", "inner radius", above=0.0)
    bottom: float = param(0.0, "m", "height of the floor")
    top: float = param(1.0, "m", "height of the lid")
    margin: float = param(0.1, "-", "particles stop this many spacings before a face", low=0.0, high=0.5)

    def properties(self, scene):
        return (PROJECTED,)

    def columns(self, scene):
        return (N_PROJECTED,)

    def check(self, scene, arrays):
        inset = self.margin * scene.spacing
        if self.radius <= inset or self.top - self.bottom <= 2.0 * inset:
            raise ValueError(f"container: a cylinder of radius {self.radius} m from {self.bottom} to {self.top} m has "
                             f"no inside at a spacing of {scene.spacing} m")

    def terms(self, scene, fluid):
        inset = self.margin * scene.spacing
        yield Term("density.correction", container.PBFCylinderContainer(
            fluid, None, centre=self.centre, radius=self.radius - inset, bottom=self.bottom + inset,
            top=self.top - inset, dim=scene.dim))


@dataclass(frozen=True, kw_only=True)
class XSPHViscosity(Effect):
    """XSPH viscosity between all fluid particles, and friction at the walls."""

    slot: ClassVar[str] = "viscosity"
    title: ClassVar[str] = "XSPH viscosity"
    on_device: ClassVar[bool] = True
    requires: ClassVar[tuple[str, ...]] = ("density",)
    rate: float = param(None, "1/s", "share of a velocity difference evened out in a unit of time; "
                        "0.7 sqrt(|g|/spacing) if not given", low=0.0)
    wall: float = param(0.0, "-", "friction at walls, as a multiple of the rate; 0 slips", low=0.0)

    RATE: ClassVar[float] = 0.7  # of 1/t*; tuned

    def resolved(self, scene):
        return self.rate if self.rate is not None else self.RATE / scene.fall_time

    def warnings(self, scene, dt):
        if self.resolved(scene) * dt > 0.5:
            yield f"viscosity.rate * dt = {self.resolved(scene) * dt:.2g} is above 0.5: velocities will overshoot"

    def terms(self, scene, fluid):
        yield Term("forces.sum", viscosity.PBFXSPHViscosity(
            fluid, list(scene.fluids), rate=self.resolved(scene), rho0=scene.rho0))
        if self.wall > 0.0 and scene.solids:
            yield Term("forces.sum", viscosity.PBFWallFriction(
                fluid, list(scene.solids), rate=self.wall * self.resolved(scene), rho0=scene.rho0))


# --- heat -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class HeatConduction(Effect):
    """Conduction between particles; the state is the specific enthalpy."""

    slot: ClassVar[str] = "heat"
    title: ClassVar[str] = "heat conduction"
    laplacian: str = param("cleary_monaghan", "-", "form of the Laplacian", choices=("cleary_monaghan", "paper"))
    acceleration: float = param(1.0, "-", "A: heat runs this many times faster against motion", above=0.0)
    enhancement: float = param(1.0, "-", "E: conductivity alone, for the convection that is not resolved", above=0.0)
    subcycle_share: float = param(0.1, "-", "largest change of e in one heat step, in units of L", above=0.0)

    def conductivity(self, k):
        """Effective conductivity [W/(m K)]."""
        return k * self.acceleration * self.enhancement

    def properties(self, scene):
        rows = [
            Property("e", "J/kg", "specific enthalpy, 0 for saturated liquid", state=True),
            Property("T", "K", "temperature", state=True),
            Property("k", "W/(m K)", "effective thermal conductivity"),
            Property("ae", "J/(kg s)", "rate of enthalpy", state=True),
        ]
        if self.laplacian == "paper":
            rows.append(Property("q_leak", "J", "energy made by the literal Laplacian since the start", state=True,
                                 cumulative=True))
        return tuple(rows)

    def constants(self, scene):
        return {"heat_dt": 0.0}

    def flows(self, scene):
        if self.laplacian == "paper":
            return (Flow("energy_model_leak", +1, prop="q_leak", leak=True),)
        return ()

    def columns(self, scene):
        return (
            Column("T_mean", "K", "mean temperature", lambda arrays, scene: float(np.mean(gather(arrays, "T")))),
            Column("T_max", "K", "highest temperature", lambda arrays, scene: float(np.max(gather(arrays, "T")))),
        )

    def step_limit(self, scene):
        """Explicit limit of the heat step [s] over the phases present."""
        material = scene.material
        pairs = [(material.c_l, material.k_l)]
        if "phases" in scene.effects:
            pairs.append((material.c_v, material.k_v))
        return min(heat_step_limit(scene.rho0, c, self.conductivity(k), scene.h) for c, k in pairs)

    def terms(self, scene, fluid):
        material = scene.material
        if "phases" not in scene.effects:
            yield Term("heat.temperature", heat.HeatTemperature(
                fluid, None, T0=material.T_sat, c=material.c_l, k=self.conductivity(material.k_l)))
        if self.laplacian == "paper":
            yield Term("heat.exchange", heat.HeatConductionPaper(fluid, list(scene.fluids)))
        else:
            yield Term("heat.exchange", heat.HeatConduction(fluid, list(scene.fluids), rho0=scene.rho0))
        yield Term("heat.update", heat.HeatUpdate(fluid, None))


@dataclass(frozen=True, kw_only=True)
class Heater(Effect):
    """Heated wall particles: at a fixed temperature, or of a given heat flux that is delivered exactly.

    Limits: with a flux, each heated particle counts spacing^(dim-1) of area, so mark one layer of the wall only; and
    there must be one fluid array, or each would get the whole power.
    """

    slot: ClassVar[str] = "heater"
    title: ClassVar[str] = "heater"
    requires: ClassVar[tuple[str, ...]] = ("heat",)
    temperature: float = param(None, "K", "temperature of the heater; give this or flux", above=0.0)
    flux: float = param(None, "W/m^2", "heat flux of the heater before the factor A; give this or temperature", low=0.0)

    def __post_init__(self):
        super().__post_init__()
        if (self.temperature is None) == (self.flux is None):
            raise ValueError("heater: give exactly one of temperature [K] and flux [W/m^2]")

    def replaced(self, **changes):
        if len(changes.keys() & {"temperature", "flux"}) == 1:  # the one that is given takes the other's place
            changes = {"temperature": None, "flux": None, **changes}
        return super().replaced(**changes)

    def check(self, scene, arrays):
        if not any(np.any(arrays[name].heated == 1) for name in scene.solids if "heated" in arrays[name].properties):
            raise ValueError("heater: no wall particle is heated (property 'heated' of the solids is 0 everywhere)")
        if self.temperature is not None and self.temperature >= scene.material.T_crit:
            raise ValueError(f"heater.temperature must be below the critical point of {scene.material.name}, "
                             f"{scene.material.T_crit} K, got {self.temperature} K")
        if self.flux is not None and len(scene.fluids) > 1:
            raise ValueError(f"heater: a flux heats one fluid array, got {scene.fluids}: each would get all of it")

    def properties(self, scene):
        rows = [Property("q_heater", "J", "heat received from the heater since the start", state=True, cumulative=True)]
        if self.flux is not None:
            rows += [Property("heater_wet", "1/m^dim", "weight of a liquid particle in the heater's power"),
                     Property("heater_dry", "1/m^dim", "weight of a vapour particle in the heater's power")]
        return tuple(rows)

    def constants(self, scene):
        if self.flux is None:
            return {"heater_on": 1.0, "heater_T": self.temperature}
        return {"heater_on": 1.0, "heater_power": 0.0, "heater_weight": [0.0, 0.0], "energy_undelivered": 0.0}

    def prepare(self, scene, arrays):
        """Set the heater's power [W, or W/m in 2-D] from its area, once the walls are known."""
        if self.flux is not None:
            area = sum(int(np.sum(arrays[name].heated)) for name in scene.solids) * scene.spacing ** (scene.dim - 1)
            for name in scene.fluids:
                arrays[name].heater_power[0] = self.flux * area * scene.effects["heat"].acceleration

    def flows(self, scene):
        return (Flow("energy_heater", +1, prop="q_heater"),)

    def columns(self, scene):
        if self.flux is None:
            return ()
        return (Column("energy_undelivered", "J", "heater energy with nothing in reach to take it, since the start",
                       lambda arrays, scene: sum(float(pa.energy_undelivered[0]) for pa in arrays)),)

    def terms(self, scene, fluid):
        walls = list(scene.solids)
        if self.flux is None:
            yield Term("heat.exchange", heat.HeatFixedTemperature(
                fluid, walls, rho0=scene.rho0, spacing=scene.spacing, dim=scene.dim))
        else:
            k = scene.effects["heat"].conductivity
            k_wet = math.sqrt(k(scene.material.k_l) * k(scene.material.k_v))
            yield Term("heat.weights", heat.HeatFluxWeight(fluid, walls, k_wet=k_wet))
            yield Term("heat.exchange", heat.HeatFlux(fluid, None))


@dataclass(frozen=True, kw_only=True)
class AmbientLoss(Effect):
    """Newton cooling at the free surface."""

    slot: ClassVar[str] = "loss"
    title: ClassVar[str] = "ambient loss"
    requires: ClassVar[tuple[str, ...]] = ("heat",)
    coefficient: float = param(10.0, "W/(m^2 K)", "heat transfer coefficient before the factor A", low=0.0)
    T_ambient: float = param(293.15, "K", "ambient temperature", above=0.0)

    THRESHOLD: ClassVar[float] = 0.2  # of 1/spacing: half the value in the second layer of a flat surface

    def properties(self, scene):
        return (
            Property("gsx", "1/m", "gradient of the indicator function, normal to the free surface"),
            Property("gsy", "1/m", "gradient of the indicator function"),
            Property("gsz", "1/m", "gradient of the indicator function"),
            Property("q_loss", "J", "heat lost to the ambient since the start", state=True, cumulative=True),
        )

    def flows(self, scene):
        return (Flow("energy_loss", -1, prop="q_loss"),)

    def factor(self, scene):
        """Calibration that makes the area of a flat lattice surface exact [-]."""
        hdx, reach = scene.h / scene.spacing, int(math.ceil(scene.support / scene.spacing)) + 1
        density = 0.0
        for layer in range(reach):
            gradient, grad = 0.0, [0.0, 0.0, 0.0]
            for index in np.ndindex(*(2 * reach + 1,) * scene.dim):
                offset = np.zeros(3)
                offset[:scene.dim] = np.array(index, float) - reach
                if offset[scene.dim - 1] < -layer - 0.5:  # above the surface: no fluid
                    continue
                scene.kernel.gradient(xij=offset, rij=float(np.linalg.norm(offset)), h=hdx, grad=grad)
                gradient += grad[scene.dim - 1]
            if abs(gradient) > self.THRESHOLD:
                density += abs(gradient)
        return 1.0 / density

    def terms(self, scene, fluid):
        yield Term("heat.exchange", heat.HeatAmbientLoss(
            fluid, list(scene.fluids),
            coefficient=self.coefficient * scene.effects["heat"].acceleration, T_ambient=self.T_ambient,
            rho0=scene.rho0, threshold=self.THRESHOLD / scene.spacing, factor=self.factor(scene)))
        if scene.solids:
            yield Term("heat.exchange", heat.HeatAmbientWall(
                fluid, list(scene.solids), spacing=scene.spacing, dim=scene.dim))


@dataclass(frozen=True, kw_only=True)
class HeatSource(Effect):
    """Uniform volumetric heating."""

    slot: ClassVar[str] = "source"
    title: ClassVar[str] = "volumetric source"
    requires: ClassVar[tuple[str, ...]] = ("heat",)
    density: float = param(0.0, "W/m^3", "power density before the factor A")

    def properties(self, scene):
        return (Property("q_source", "J", "heat received from the volumetric source since the start", state=True,
                         cumulative=True),)

    def flows(self, scene):
        return (Flow("energy_source", +1, prop="q_source"),)

    def terms(self, scene, fluid):
        yield Term("heat.exchange", heat.HeatSource(
            fluid, None, density=self.density * scene.effects["heat"].acceleration, rho0=scene.rho0))


# --- phases -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class PhaseChange(Effect):
    """The four states of a particle and the edges between them."""

    slot: ClassVar[str] = "phases"
    title: ClassVar[str] = "phase change"
    requires: ClassVar[tuple[str, ...]] = ("heat",)
    interrupt: str = param("hold", "-", "stored latent heat when a site is lost: held, or converted (paper)",
                           choices=("hold", "convert"))
    vapour_as_site: bool = param(True, "-", "vapour near a liquid particle counts as a nucleation site")
    kinetic_radius: float = param(1.5, "-", "reach of vapour as a site, in spacings", above=0.0, high=2.0)

    def properties(self, scene):
        rows = [
            Property("phase", "-", "state of the particle, see pysph_boiling.phases.Phase", "int", True),
            Property("kinetic", "-", "1 where a nucleation site is near", "int"),
            Property("vaporised", "-", "times the particle completed its latent heat", "int", True, True),
            Property("interrupted", "-", "times its transition was interrupted", "int", True, True),
        ]
        if self.interrupt == "hold":
            rows.append(Property("e_lat", "J/kg", "latent heat frozen at an interruption", state=True))
        return tuple(rows)

    def columns(self, scene):
        def count(phase):
            return lambda arrays, scene: float(np.count_nonzero(gather(arrays, "phase") == phase))

        def energy(phase):
            return lambda arrays, scene: float(np.sum(
                (gather(arrays, "m") * gather(arrays, "e"))[gather(arrays, "phase") == phase]))

        columns = []
        for phase in Phase:
            name = phase.name.lower()
            columns.append(Column(f"n_{name}", "-", f"particles in state {name}", count(phase)))
            columns.append(Column(f"energy_{name}", "J", f"enthalpy of the particles in state {name}", energy(phase)))
        columns += [
            cumulative("n_nucleated", "-", "particles vaporised by completing their latent heat, since the start",
                       "vaporised"),
            cumulative("n_interrupted", "-", "interrupted transitions since the start", "interrupted"),
        ]
        if self.interrupt == "hold":
            columns.append(Column("energy_hidden", "J", "held latent heat that no temperature shows", hidden_heat))
        return tuple(columns)

    def terms(self, scene, fluid):
        material, k = scene.material, scene.effects["heat"].conductivity
        state = dict(T_sat=material.T_sat, L=material.L, c_l=material.c_l, c_v=material.c_v)
        conductivities = dict(k_l=k(material.k_l), k_v=k(material.k_v))
        hold = self.interrupt == "hold"
        temperature = phase_change.PhaseTemperatureHold if hold else phase_change.PhaseTemperature
        edges = phase_change.PhaseEdgesHold if hold else phase_change.PhaseEdges
        yield Term("heat.temperature", temperature(fluid, None, **state, **conductivities))
        yield Term("phases.edges", phase_change.PhaseKineticReset(fluid, None))
        if self.vapour_as_site:
            yield Term("phases.edges", phase_change.PhaseVapourCondition(
                fluid, list(scene.fluids), radius=self.kinetic_radius * scene.spacing))
        yield Term("phases.edges", edges(fluid, None, **state))


def hidden_heat(arrays, scene):
    """Held latent heat of superheated particles [J]."""
    held = np.minimum(gather(arrays, "e"), gather(arrays, "e_lat")) * gather(arrays, "m")
    return float(np.sum(held[gather(arrays, "phase") == Phase.SUPERHEATED]))


@dataclass(frozen=True, kw_only=True)
class PresetNucleation(Effect):
    """Preset nucleation sites: the kinetic condition near them, and their pull on the liquid."""

    slot: ClassVar[str] = "nucleation"
    title: ClassVar[str] = "preset nucleation sites"
    requires: ClassVar[tuple[str, ...]] = ("phases",)
    radius: float = param(1.6, "-", "radius of a site, in spacings", above=0.0)
    attraction: float = param(0.5, "-", "pull of a site on liquid, in units of gravity", low=0.0)
    attraction_radius: float = param(2.4, "-", "reach of the pull, in spacings; beyond the kernel support it slows the "
                                     "neighbour search of the whole scene", above=0.0)

    @property
    def reach(self):
        """Largest radius at which a site acts, in spacings."""
        return max(self.radius, self.attraction_radius if self.attraction else 0.0)

    def check(self, scene, arrays):
        if not scene.sites:
            raise ValueError("nucleation: preset sites need a particle array of sites: pass sites=['sites'] to the "
                             "scheme and create that array (particles.site_array)")
        if len(scene.sites) > 1:
            raise ValueError(f"nucleation: put all preset sites into one array, got {scene.sites}: the pull is towards "
                             "the nearest site of an array")
        for name in scene.sites:
            reach = float(arrays[name].h.min()) * scene.kernel.radius_scale / scene.spacing
            needed = max([self.reach] + [effect.radius for effect in scene.effects.values()
                                         if isinstance(effect, SiteAdhesion)])
            if reach < needed * (1.0 - 1e-9):
                raise ValueError(f"sites '{name}' reach {reach:.3g} spacings, the effects need {needed:.3g}: make the "
                                 f"array with site_array(reach={needed * scene.spacing:.3g})")

    def tools(self, scheme):
        from pysph_boiling.analysis.bubbles import Departures

        if "bubbles" in scheme.effects:
            yield Departures(scheme, clearance=self.reach * scheme.spacing)

    def terms(self, scene, fluid):
        yield Term("phases.edges", nucleation.NucleationSiteCondition(
            fluid, list(scene.sites), radius=self.radius * scene.spacing))
        if self.attraction > 0.0 and scene.g > 0.0 and "density" in scene.effects:
            yield Term("forces.sum", nucleation.NucleationSiteAttraction(
                fluid, list(scene.sites), strength=self.attraction * scene.g,
                radius=self.attraction_radius * scene.spacing))


# --- bubbles ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class BubbleLabels(Effect):
    """Bubbles as connected components of vapour, labelled by their smallest uid."""

    slot: ClassVar[str] = "bubbles"
    title: ClassVar[str] = "bubble labels"
    requires: ClassVar[tuple[str, ...]] = ("phases",)
    link_radius: float = param(1.4, "-", "vapour particles nearer than this, in spacings, belong together",
                               above=0.0, high=2.0)

    MAX_ROUNDS: ClassVar[int] = 200  # a shuffled chain of n settles in about log2(n); 200 is never reached

    def properties(self, scene):
        return (
            Property("parent", "-", "parent in the label forest (index)", "int"),
            Property("grandparent", "-", "grandparent in the label forest (index)", "int"),
            Property("unsettled", "-", "1 where a grandparent changed in the last round", "int"),
            Property("bubble", "-", "smallest uid of the bubble; NO_BUBBLE outside", "unsigned int", True),
            Property("bubble_n", "-", "particles in the bubble; 0 outside", "int", True),
        )

    def constants(self, scene):
        return {"bubble_rounds": 0.0}

    def check(self, scene, arrays):
        if len(scene.fluids) > 1:
            raise ValueError(f"bubbles: labels need all liquid and vapour in one fluid array, got {scene.fluids}")

    def columns(self, scene):
        from pysph_boiling.analysis.bubbles import bubble_table

        def number(arrays, scene):
            return float(len(bubble_table(arrays, scene).label))

        def single(arrays, scene):
            return float(np.count_nonzero(bubble_table(arrays, scene).n == 1))

        def radius(arrays, scene):
            table = bubble_table(arrays, scene)
            return float(np.mean(table.equivalent_radius)) if len(table.label) else 0.0

        return (
            Column("n_bubbles", "-", "bubbles", number),
            Column("bubble_radius_mean", "m", "mean equivalent radius of the bubbles; 0 without bubbles", radius),
            Column("n_single_bubbles", "-", "bubbles of one particle", single),
        )

    def hooks(self, scene):
        from pysph_boiling.analysis.bubbles import store_sizes

        return {"bubbles.label": store_sizes}

    def terms(self, scene, fluid):
        yield Term("bubbles.start", bubble_groups.BubbleStart(fluid, None))
        yield Term("bubbles.snap", bubble_groups.BubbleSnap(fluid, None))
        yield Term("bubbles.hook", bubble_groups.BubbleHook(
            fluid, list(scene.fluids), radius=self.link_radius * scene.spacing))
        yield Term("bubbles.shortcut", bubble_groups.BubbleShortcut(fluid, None))
        yield Term("bubbles.check", bubble_groups.BubbleCheck(fluid, None))
        yield Term("bubbles.label", bubble_groups.BubbleLabel(fluid, None))


@dataclass(frozen=True, kw_only=True)
class Buoyancy(Effect):
    """Upward force on bubbles, their total force added to gravity."""

    slot: ClassVar[str] = "buoyancy"
    title: ClassVar[str] = "buoyancy"
    requires: ClassVar[tuple[str, ...]] = ("bubbles", "density")
    form: str = param("archimedes", "-", "form of the force", choices=("archimedes", "paper", "ihmsen"))
    k_bubble: float = param(1.5, "-", "paper, eq. 19, in units of m_p/rho_l; 1 is neutral", low=0.0)
    a_max: float = param(3.0, "-", "form 'paper': largest acceleration, in units of gravity", above=0.0)
    k_min: float = param(1.2, "-", "form 'ihmsen': smallest factor", low=0.0)
    k_max: float = param(1.5, "-", "form 'ihmsen': growth with the number of vapour neighbours", low=1.0)

    def properties(self, scene):
        if self.form == "ihmsen":
            return (Property("vapour_near", "-", "vapour neighbours", "int"),)
        return ()

    def warnings(self, scene, dt):
        if scene.g == 0.0:
            yield "buoyancy: without gravity it does nothing"

    def terms(self, scene, fluid):
        gravity = dict(zip(("gx", "gy", "gz"), scene.gravity))
        if self.form == "archimedes":
            yield Term("forces.sum", buoyancy.BubbleBuoyancy(fluid, None, k_bubble=self.k_bubble, **gravity))
        elif self.form == "paper":
            yield Term("forces.sum", buoyancy.BubbleBuoyancyPaper(
                fluid, None, k_bubble=self.k_bubble, a_max=self.a_max, **gravity))
        else:
            yield Term("forces.sum", buoyancy.BubbleBuoyancyIhmsen(
                fluid, list(scene.fluids), k_min=self.k_min, k_max=self.k_max, **gravity))


@dataclass(frozen=True, kw_only=True)
class Cohesion(Effect):
    """Cohesion between vapour particles, which keeps a bubble round and in one piece."""

    slot: ClassVar[str] = "tension"
    title: ClassVar[str] = "cohesion of vapour"
    requires: ClassVar[tuple[str, ...]] = ("phases", "density")
    strength: float = param(None, "-", "in units of gravity; 8 in 2-D and 3 in 3-D if not given", low=0.0)
    radius: float = param(2.4, "-", "range, in spacings", above=0.0)

    CLEAN, SHREDS = 0.05, 0.16  # strength g dt^2/spacing: measured in the calibration

    def resolved(self, scene):
        return self.strength if self.strength is not None else {2: 8.0, 3: 3.0}[scene.dim]

    def check(self, scene, arrays):
        if self.radius * scene.spacing > scene.support * (1.0 + 1e-9):
            raise ValueError(f"tension.radius must be <= {scene.support / scene.spacing:.3g} spacings (the support of "
                             f"the kernel), got {self.radius}")

    def warnings(self, scene, dt):
        number = self.resolved(scene) * scene.g * dt * dt / scene.spacing
        if number > self.CLEAN:
            yield (f"tension.strength g dt^2/spacing = {number:.2g} is above {self.CLEAN}: bubbles get noisy"
                   f"{' and shred' if number >= self.SHREDS else ''}; use more substeps or less cohesion")

    def terms(self, scene, fluid):
        yield Term("forces.sum", surface_tension.BubbleCohesion(
            fluid, list(scene.fluids), strength=self.resolved(scene) * scene.g, radius=self.radius * scene.spacing))


@dataclass(frozen=True, kw_only=True)
class SiteAdhesion(Effect):
    """Adhesion of vapour to its site, which sets the size at which a bubble departs."""

    slot: ClassVar[str] = "adhesion"
    title: ClassVar[str] = "adhesion to sites"
    requires: ClassVar[tuple[str, ...]] = ("nucleation", "density")
    strength: float = param(None, "-", "in units of gravity; 15 in 2-D and 8 in 3-D if not given", low=0.0)
    radius: float = param(2.4, "-", "range, in spacings", above=0.0)

    def resolved(self, scene):
        return self.strength if self.strength is not None else {2: 15.0, 3: 8.0}[scene.dim]

    def terms(self, scene, fluid):
        yield Term("forces.sum", surface_tension.BubbleSiteAdhesion(
            fluid, list(scene.sites), strength=self.resolved(scene) * scene.g, radius=self.radius * scene.spacing,
            spacing=scene.spacing))


@dataclass(frozen=True, kw_only=True)
class Drag(Effect):
    """Drag between vapour and liquid, beyond the viscosity that all pairs share."""

    slot: ClassVar[str] = "drag"
    title: ClassVar[str] = "drag between phases"
    requires: ClassVar[tuple[str, ...]] = ("phases", "density")
    rate: float = param(None, "1/s", "rate of exchange; 0.35 sqrt(|g|/spacing) if not given", low=0.0)

    RATE: ClassVar[float] = 0.35  # of 1/t*; tuned

    def resolved(self, scene):
        return self.rate if self.rate is not None else self.RATE / scene.fall_time

    def warnings(self, scene, dt):
        if self.resolved(scene) * dt > 0.5:
            yield f"drag.rate * dt = {self.resolved(scene) * dt:.2g} is above 0.5: velocities will overshoot"

    def terms(self, scene, fluid):
        yield Term("forces.sum", buoyancy.BubbleDrag(
            fluid, list(scene.fluids), rate=self.resolved(scene), rho0=scene.rho0))


@dataclass(frozen=True, kw_only=True)
class Venting(Effect):
    """Bubbles that reach the surface leave: removed, or returned as liquid by a lid. Booked either way."""

    slot: ClassVar[str] = "venting"
    title: ClassVar[str] = "venting"
    requires: ClassVar[tuple[str, ...]] = ("bubbles", "density")
    mode: str = param("lid", "-", "'remove' takes the bubble out, 'lid' returns it as liquid",
                      choices=("lid", "remove"))
    share: float = param(0.05, "-", "a bubble leaves once this share of it is free", above=0.0, high=1.0)
    steps: int = param(2, "-", "steps in a row for which a particle must be free", low=1)
    T_feed: float = param(None, "K", "temperature of returned liquid; saturation if not given", above=0.0)
    cosine: float = param(0.5, "-", "opening of the upward cone", above=0.0, high=0.99)
    lowest: float = param(0.3, "-", "what lies lower above a particle does not cover it, in spacings", low=0.0)

    @property
    def removes_particles(self):
        return self.mode == "remove"

    def check(self, scene, arrays):
        if self.T_feed is not None and self.T_feed > scene.material.T_sat:
            raise ValueError(f"venting.T_feed must be <= T_sat = {scene.material.T_sat} K, got {self.T_feed} K")

    def properties(self, scene):
        return (
            Property("film", "-", "1 where liquid has nothing above it", "int"),
            Property("covered", "-", "1 where vapour has something other than film above it", "int"),
            Property("free", "-", "steps in a row that a vapour particle has been free", "int", True),
        )

    def constants(self, scene):
        return {"energy_vented": 0.0, "mass_vented": 0.0, "n_vented": 0.0, "n_bubbles_vented": 0.0}

    def flows(self, scene):
        return (Flow("energy_lid" if self.mode == "lid" else "energy_vented", -1, constant="energy_vented"),)

    def columns(self, scene):
        def constant(name):
            return lambda arrays, scene: sum(float(pa.constants[name].get_npy_array()[0]) for pa in arrays)

        return (
            Column("n_vented", "-", "particles vented since the start", constant("n_vented")),
            Column("n_bubbles_vented", "-", "bubbles vented since the start", constant("n_bubbles_vented")),
        )

    def terms(self, scene, fluid):
        ux, uy, uz = scene.up
        cone = dict(ux=ux, uy=uy, uz=uz, cosine=self.cosine, lowest=self.lowest * scene.spacing)
        yield Term("bubbles.film", venting.VentingFilm(fluid, list(scene.fluids), **cone))
        yield Term("bubbles.free", venting.VentingFree(fluid, list(scene.fluids), **cone))
        gravity = dict(zip(("gx", "gy", "gz"), scene.gravity))
        yield Term("forces.release", venting.VentingRelease(fluid, None, **gravity))

    def tools(self, scheme):
        from pysph_boiling.schemes.venting import VentingTool

        yield VentingTool(self, scheme)

"""Heat: conduction, heaters, volumetric sources, and loss to the ambient."""
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pysph.solver.tools import Tool

from pysph_boiling.equations import heat
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import Property, check_heaters, vector
from pysph_boiling.phases import heat_capacity
from pysph_boiling.schemes.effects.base import (
    Column,
    Effect,
    Flow,
    Rule,
    largest_over,
    param,
    sum_over,
    totals,
)
from pysph_boiling.schemes.stages import Term

__all__ = ["AmbientLoss", "HeatConduction", "HeatSource", "Heater", "HeaterSwitch", "heat_step_limit"]

BOILING_POINT_OF_AIR = 79.0  # K; below it the ambient is no gas, and the figure is one in degrees Celsius


def heat_step_limit(rho0: float, c: float, k: float, h: float) -> float:
    """Largest stable heat step [s] of the explicit scheme, 0.1 rho c h^2 / k (Cleary & Monaghan 1999)."""
    return 0.1 * rho0 * c * h * h / k


def reason_for_heat(facts, chosen):
    """The reason why a scene needs heat, or an empty string."""
    if facts.heated or {"loss", "source"} & set(facts.candidates):
        return "something heats or cools"
    if not facts.uniform:
        return "temperatures differ"
    return "it starts above saturation" if facts.hottest > facts.T_sat else ""


@dataclass(frozen=True, kw_only=True)
class HeatConduction(Effect):
    """Conduction between particles; the thermal state is the specific enthalpy.

    The form "paper" is eq. 17 with the single conductivity of eq. 16, that of the liquid, also in vapour. It creates
    energy where densities differ, which is recorded in the column ``energy_model_leak``.

    ``positions``: a step searches neighbours at the predicted positions. There heat, changes of phase and labels of
    bubbles follow at once, before the density sweeps. With "corrected" they follow after the sweeps, as in Algorithm 1
    of the paper: at the final positions, but with the neighbours of the predicted ones.
    """

    slot: ClassVar[str] = "heat"
    title: ClassVar[str] = "heat conduction"
    auto_rule: ClassVar[Rule] = Rule(reason_for_heat, "{}", "no heater, and uniform, not above saturation")
    laplacian: str = param("cleary_monaghan", "-", "form of the Laplacian", choices=("cleary_monaghan", "paper"))
    positions: str = param("predicted", "-", "positions at which heat, phases and bubbles are computed: predicted, "
                           "before the density sweeps, or corrected, after them (paper)",
                           choices=("predicted", "corrected"))
    time_scaling: float = param(1.0, "-", "A: factor by which heat is faster relative to motion", above=0.0)
    enhancement: float = param(1.0, "-", "E: factor on the conductivity, for convection that is not resolved",
                               above=0.0)
    max_enthalpy_change: float = param(0.1, "-", "largest change of the enthalpy in one heat step, in units of L",
                                       above=0.0)

    def conductivity(self, k):
        """Effective conductivity [W/(m K)]."""
        return k * self.time_scaling * self.enhancement

    def k_liquid_min(self, material):
        """Geometric mean of the effective conductivity of vapour and the least of liquid [W/(m K)].

        The least is that of liquid that holds all of its latent heat, see ``PhaseTemperature``.
        """
        least = material.k_l * min(1.0, heat_capacity(material.L, material) / material.c_l)
        return math.sqrt(self.conductivity(least) * self.conductivity(material.k_v))

    def properties(self, scene):
        rows = [
            Property("e", "J/kg", "specific enthalpy, 0 for saturated liquid", state=True),
            Property("T", "K", "temperature", state=True),
            Property("k", "W/(m K)", "effective thermal conductivity"),
            Property("ae", "J/(kg s)", "rate of enthalpy", state=True),
        ]
        if self.laplacian == "paper":
            rows.append(Property("q_leak", "J", "energy created by the paper's Laplacian since the start", state=True,
                                 cumulative=True))
        return tuple(rows)

    def constants(self, scene):
        return {"heat_dt": 0.0}

    def flows(self, scene):
        if self.laplacian == "paper":
            return (Flow("energy_model_leak", +1, "energy created by the paper's Laplacian since the start",
                         prop="q_leak", leak=True),)
        return ()

    def columns(self, scene):
        def mean(arrays, scene):
            return sum_over(arrays, "T") / max(totals(arrays).count, 1.0)

        def highest(arrays, scene):
            return ranks.largest(largest_over(arrays, "T"))

        return (Column("T_mean", "K", "mean temperature; 0 in a dry vessel", mean),
                Column("T_max", "K", "highest temperature", highest))

    def step_limit(self, scene):
        """Largest stable heat step [s] for all phases."""
        material = scene.material
        pairs = [(material.c_l, material.k_l)]
        if "phases" in scene.effects:
            pairs.append((material.c_v, material.k_l if self.laplacian == "paper" else material.k_v))
        return min(heat_step_limit(scene.rho0, c, self.conductivity(k), scene.h) for c, k in pairs)

    def terms(self, scene, fluid):
        material = scene.material
        if "phases" not in scene.effects:
            yield Term("heat.temperature", heat.HeatTemperature(
                fluid, None, T0=material.T_sat, c=material.c_l, k=self.conductivity(material.k_l)))
        if self.laplacian == "paper":
            yield Term("heat.exchange", heat.HeatConductionPaper(
                fluid, list(scene.fluids), k=self.conductivity(material.k_l)))
        else:
            yield Term("heat.exchange", heat.HeatConductionClearyMonaghan(fluid, list(scene.fluids), rho0=scene.rho0))
        yield Term("heat.update", heat.HeatUpdate(fluid, None))
        if "phases" not in scene.effects:
            yield Term("heat.update", heat.HeatTemperatureAfter(fluid, None, T0=material.T_sat, c=material.c_l))


@dataclass(frozen=True, kw_only=True)
class Heater(Effect):
    """Heated wall particles with a fixed temperature, or with a given heat flux that is delivered exactly.

    The property ``T_heater`` [K] of the wall particles sets the temperature of individual heaters
    (``wall_array(heated=..., T_heater=...)``); all others have ``temperature``. ``energy_heater`` and ``until`` apply
    to all heaters together.

    Limits: with a flux, each heated particle has an area of spacing^(dim-1), so only one layer of the wall may be
    heated. There must be only one fluid array, because each array would get the whole power.
    """

    slot: ClassVar[str] = "heater"
    title: ClassVar[str] = "heater"
    requires: ClassVar[tuple[str, ...]] = ("heat",)
    auto_rule: ClassVar[Rule] = Rule(lambda facts, chosen: facts.heated, "walls are heated", "no wall is heated")
    parameter_constants: ClassVar[tuple[str, ...]] = ("heater_T", "heater_power")
    temperature: float = param(None, "K", "temperature of heaters without a temperature of their own (T_heater); "
                               "give this or flux", above=0.0, may_change=True, temperature=True)
    flux: float = param(None, "W/m^2", "heat flux of the heater before the factor A; give this or temperature", low=0.0,
                        may_change=True)
    until: float = param(None, "s", "time at which it is switched off and stops exchanging heat; never if not given",
                         low=0.0, may_change=True)

    def __post_init__(self):
        super().__post_init__()
        if (self.temperature is None) == (self.flux is None):
            raise ValueError("heater: give exactly one of temperature [K] and flux [W/m^2]")

    def replaced(self, **changes):
        if len(changes.keys() & {"temperature", "flux"}) == 1:  # the given one replaces the other
            changes = {"temperature": None, "flux": None, **changes}
        return super().replaced(**changes)

    def temperatures(self, scene, arrays):
        """Sorted temperatures of the heaters [K] with the number of wall particles of each; empty for a flux."""
        T = np.concatenate([arrays[name].T_heater[arrays[name].heated == 1] for name in scene.solids])
        return [] if self.flux is not None else list(zip(*np.unique(np.where(T == 0.0, self.temperature, T),
                                                                    return_counts=True)))

    def check(self, scene, arrays):
        for name in scene.solids:
            if "heated" in arrays[name].properties:
                check_heaters(name, arrays[name].heated, arrays[name].T_heater, scene.material.T_crit)
                if self.flux is not None and np.any(arrays[name].T_heater):
                    raise ValueError(f"heater: with a flux wall particles must not have a T_heater, but some of "
                                     f"'{name}' have one")
        if not any(np.any(arrays[name].heated == 1) for name in scene.solids if "heated" in arrays[name].properties):
            raise ValueError("heater: no wall particle is heated (property 'heated' of the solids is 0 everywhere)")
        if self.temperature is not None and self.temperature >= scene.material.T_crit:
            raise ValueError(f"heater.temperature must be below the critical point of {scene.material.name}, "
                             f"{scene.material.T_crit} K, got {self.temperature} K")
        if self.flux is not None and len(scene.fluids) > 1:
            raise ValueError(f"heater: with a flux there must be one fluid array, got {scene.fluids}, each of which "
                             "would get the whole flux")

    def properties(self, scene):
        rows = [Property("q_heater", "J", "heat received from the heater since the start", state=True, cumulative=True)]
        if self.flux is not None:
            rows += [Property("heater_wet", "1/m^dim", "weight of a liquid particle for the heater's power"),
                     Property("heater_dry", "1/m^dim", "weight of a vapour particle for the heater's power")]
        return tuple(rows)

    def constants(self, scene):
        if self.flux is None:
            return {"heater_on": 1.0, "heater_T": self.temperature}
        return {"heater_on": 1.0, "heater_power": 0.0, "heater_weight": [0.0, 0.0], "energy_undelivered": 0.0}

    def area(self, scene, arrays):
        """Area of the heated walls [m^2, or m in 2-D], of one layer of particles."""
        heated = ranks.total(sum(np.count_nonzero(arrays[name].heated) for name in scene.solids))
        return float(heated * scene.spacing ** (scene.dim - 1))

    def prepare(self, scene, arrays):
        """Set the heater's power [W, or W/m in 2-D] from the area of the heated walls."""
        if self.flux is not None:
            power = self.flux * self.area(scene, arrays) * scene.effects["heat"].time_scaling
            for name in scene.fluids:
                arrays[name].heater_power[0] = power

    def flows(self, scene):
        return (Flow("energy_heater", +1, "heat from the heater since the start", prop="q_heater"),)

    def columns(self, scene):
        if self.flux is None:
            return ()
        return (Column("energy_undelivered", "J", "heater energy that found no particle in reach, since the start",
                       lambda arrays, scene: sum(float(pa.energy_undelivered[0]) for pa in arrays)),)

    def terms(self, scene, fluid):
        walls = list(scene.solids)
        if self.flux is None:
            yield Term("heat.heater", heat.HeatFixedTemperature(
                fluid, walls, rho0=scene.rho0, spacing=scene.spacing, dim=scene.dim))
        else:
            k_liquid_min = scene.effects["heat"].k_liquid_min(scene.material)
            yield Term("heat.weights", heat.HeatFluxWeight(fluid, walls, k_liquid_min=k_liquid_min))
            yield Term("heat.heater", heat.HeatFlux(fluid, None))

    def tools(self, scheme):
        if self.until is not None:
            yield HeaterSwitch(self, scheme)


class HeaterSwitch(Tool):
    """Switches the heater off in every step that starts at ``until`` or later."""

    def __init__(self, effect, scheme):
        self.until, self.scheme = effect.until, scheme

    def pre_step(self, solver):
        from pysph_boiling.schemes.integrator import set_constant

        on = float(solver.t < self.until - 1e-6 * solver.dt)  # the time has the round-off of a sum of steps
        for pa in self.scheme.arrays:
            if pa.heater_on[0] != on:
                set_constant(pa, "heater_on", on)


@dataclass(frozen=True, kw_only=True)
class HeatSource(Effect):
    """Uniform volumetric heating."""

    slot: ClassVar[str] = "source"
    title: ClassVar[str] = "volumetric source"
    requires: ClassVar[tuple[str, ...]] = ("heat",)
    density: float = param(None, "W/m^3", "power density before the factor A", may_change=True)

    def __post_init__(self):
        super().__post_init__()
        if self.density is None:
            raise ValueError("source: the power density source.density [W/m^3] must be given")

    def properties(self, scene):
        return (Property("q_source", "J", "heat received from the volumetric source since the start", state=True,
                         cumulative=True),)

    def flows(self, scene):
        return (Flow("energy_source", +1, "heat from the volumetric source since the start", prop="q_source"),)

    def terms(self, scene, fluid):
        yield Term("heat.exchange", heat.HeatUniformSource(
            fluid, None, density=self.density * scene.effects["heat"].time_scaling, rho0=scene.rho0))


@dataclass(frozen=True, kw_only=True)
class AmbientLoss(Effect):
    """Newton cooling at the free surface, exact in time, so that liquid never cools below the ambient temperature.

    It is the last of the slots that add to the rate of enthalpy, because it uses the temperature after all others.
    """

    slot: ClassVar[str] = "loss"
    title: ClassVar[str] = "ambient loss"
    requires: ClassVar[tuple[str, ...]] = ("heat",)
    coefficient: float = param(10.0, "W/(m^2 K)", "heat transfer coefficient before the factor A", low=0.0,
                               may_change=True)
    T_ambient: float = param(293.15, "K", "ambient temperature in kelvin, above the boiling point of air",
                             low=BOILING_POINT_OF_AIR, may_change=True)

    THRESHOLD: ClassVar[float] = 0.2  # in units of 1/spacing: half the value in the second layer of a flat surface

    def properties(self, scene):
        return (
            *vector("gsx gsy gsz", "1/m", "gradient of the indicator function, normal to the free surface"),
            Property("q_loss", "J", "heat lost to the ambient since the start", state=True, cumulative=True),
        )

    def flows(self, scene):
        return (Flow("energy_loss", -1, "heat lost to the ambient since the start", prop="q_loss"),)

    def factor(self, scene):
        """Calibration factor that makes the area of the flat surface of a lattice exact [-]."""
        hdx, reach = scene.h / scene.spacing, int(math.ceil(scene.support / scene.spacing)) + 1
        density = 0.0
        for layer in range(reach):
            gradient, grad = 0.0, [0.0, 0.0, 0.0]
            for index in np.ndindex(*(2 * reach + 1,) * scene.dim):
                offset = np.zeros(3)
                offset[:scene.dim] = np.array(index, float) - reach
                if offset[scene.dim - 1] < -layer - 0.5:  # there is no fluid above the surface
                    continue
                scene.kernel.gradient(xij=offset, rij=float(np.linalg.norm(offset)), h=hdx, grad=grad)
                gradient += grad[scene.dim - 1]
            if abs(gradient) > self.THRESHOLD:
                density += abs(gradient)
        return 1.0 / density

    def terms(self, scene, fluid):
        conduction, material = scene.effects["heat"], scene.material
        above = self.T_ambient - material.T_sat  # K
        boils = "phases" in scene.effects and above > 0.0
        yield Term("heat.exchange", heat.HeatAmbientLoss(
            fluid, list(scene.fluids),
            coefficient=self.coefficient * conduction.time_scaling, T_ambient=self.T_ambient, rho0=scene.rho0,
            threshold=self.THRESHOLD / scene.spacing, factor=self.factor(scene), c=material.c_l,
            k=conduction.conductivity(material.k_l), c_vapour=material.c_v,
            k_liquid_min=conduction.k_liquid_min(material) if "phases" in scene.effects else 0.0,
            **(dict(e_hot=material.L + material.c_v * above) if boils else {})))
        if scene.solids:
            yield Term("heat.exchange", heat.HeatAmbientWall(
                fluid, list(scene.solids), spacing=scene.spacing, dim=scene.dim))

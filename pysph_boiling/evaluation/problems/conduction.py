"""Conduction without motion: a hot plate, a Fourier mode, two bodies in contact, and the Laplacian on a lattice."""
import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from pysph.base.nnps import DomainManager
from scipy.special import erf

from pysph_boiling.evaluation.problems.from_scene import from_scene
from pysph_boiling.evaluation.problems.problem import Outcome, Problem
from pysph_boiling.examples.heated_slab import HeatedSlab
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.particles import fluid_array, fluid_block
from pysph_boiling.phases import Phase
from pysph_boiling.runs.stepper import Stepper
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import HeatConduction, Heater, PhaseChange

__all__ = ["FourierMode", "HotPlate", "TwoBodies", "lattice_constant"]

WIDTH = 8  # spacings across the periodic direction


def still_water(points, *, dim, spacing, hdx, **block):
    """Scheme and arrays of still water with a heater that is off, so that it shares the modules of the heated slab.

    ``points`` are the corners of the water [m]; ``block`` are further keywords of ``fluid_block``.
    """
    scheme = BoilingScheme(["fluid"], ["wall"], dim=dim, spacing=spacing, hdx=hdx, density=None, heat=HeatConduction(),
                           heater=Heater(temperature=353.15))
    common = dict(spacing=spacing, dim=dim, rho0=scheme.rho0, hdx=hdx)
    fluid = fluid_block(*points, **common, **block)
    wall = fluid_array([[0.5 * spacing] * dim + [0.0] * (3 - dim)], name="wall", **common)
    wall.add_property("heated", type="int", data=[1])
    scheme.setup_properties([fluid, wall])
    fluid.heater_on[0] = 0.0
    return scheme, fluid, wall


@cache
def lattice_constant(dim, hdx, spacing=1e-3):
    """The discrete Laplacian of the field T = a |x|^2 in the middle of a lattice over the exact value 2 dim a [-]."""
    reach, a = 5.5 * spacing, 10.0 / spacing**2  # beyond any support; 10 K over a spacing
    low = [-reach] * dim + [0.0] * (3 - dim)
    scheme, fluid, wall = still_water((low, [-x for x in low]), dim=dim, spacing=spacing, hdx=hdx)
    r2 = fluid.x**2 + fluid.y**2 + fluid.z**2
    scheme.set_temperature(fluid, 300.0 + 0.1 * a * r2)
    Stepper(scheme, [fluid, wall], dt=1e-9).step()
    water = scheme.material
    return float(fluid.ae[np.argmin(r2)] * water.rho_l / (water.k_l * 0.1 * a * 2 * dim))


@dataclass(frozen=True, kw_only=True)
class HotPlate(Problem):
    """Still water on a plate that is hot from t = 0, as in the scene ``heated_slab``."""

    title = "hot plate on still water"
    reference = "T = T_0 + (T_1 - T_0) erfc(x / (2 sqrt(alpha t))), Carslaw & Jaeger 1959, section 2.5"

    spacing: float = 1e-3  # m
    duration: float = 60.0  # s
    step: float = 1.0  # s; conduction takes substeps if needed

    def run(self):
        scene, stepper = from_scene(HeatedSlab, periodic=True, spacing=self.spacing, duration=self.duration,
                                    frame=self.step, substeps=1)
        steps = round(self.duration / self.step)
        stepper.step(steps)
        scene.solver.t = stepper.t
        depth, T, exact = scene.profile()
        return Outcome(errors={"L2": scene.error()}, seconds=stepper.seconds, simulated=self.duration, steps=steps,
                       particles=len(T), curves={"depth [m]": depth, "T [K]": T, "exact [K]": exact},
                       facts={"subcycles": stepper.solver.integrator.heat_subcycles})


@dataclass(frozen=True, kw_only=True)
class FourierMode(Problem):
    """First mode of a periodic slab over one e-folding time, on a lattice or on disordered particles.

    ``disorder`` is the largest random displacement of each coordinate, in spacings. Errors: ``rate``, of the decay
    rate; ``order``, the same without the constant of the lattice, which does not vanish with refinement; ``shape``, the
    largest deviation of the field from the mode, relative to its amplitude; ``local``, root mean square error of the
    Laplacian at the start, relative to that of the exact Laplacian.
    """

    title = "decay of a Fourier mode"
    reference = "T = T_0 + a cos(k y) exp(-alpha k^2 t)"

    dim: int = 2
    layers: int = 32
    width: int = WIDTH  # spacings
    hdx: float = 1.3
    length: float = 0.02  # m
    steps: int = 10  # conduction takes substeps if needed
    disorder: float = 0.0
    seed: int = 1

    def run(self):
        spacing = self.length / self.layers
        size = dict(zip("xyz", (self.width * spacing, self.length, self.width * spacing)[:self.dim]))
        scheme, fluid, wall = still_water(((0.0, 0.0, 0.0), (*size.values(), 0.0)[:3]), dim=self.dim, spacing=spacing,
                                          hdx=self.hdx, jitter=self.disorder, seed=self.seed)
        water, k = scheme.material, 2.0 * math.pi / self.length
        rate = water.k_l / (water.rho_l * water.c_l) * k**2
        mode = np.cos(k * fluid.y)
        scheme.set_temperature(fluid, 300.0 + 10.0 * mode)
        stepper = Stepper(scheme, [fluid, wall], dt=1.0 / (self.steps * rate), domain=DomainManager(
            **{f"{axis}min": 0.0 for axis in size}, **{f"{axis}max": top for axis, top in size.items()},
            **{f"periodic_in_{axis}": True for axis in size}))
        stepper.run_stage("heat")  # computes the rates at the start
        local = fluid.ae / (10.0 * water.c_l * rate) + mode
        stepper.step(self.steps)
        T = water.T_sat + fluid.e / water.c_l - 300.0
        amplitude = np.sum(T * mode) / np.sum(mode**2)
        found = -math.log(amplitude / 10.0)
        return Outcome(
            errors={"rate": found - 1.0, "order": found - lattice_constant(self.dim, self.hdx),
                    "shape": float(np.max(np.abs(T - amplitude * mode)) / amplitude),
                    "local": math.sqrt(np.mean(local**2) / np.mean(mode**2))},
            seconds=stepper.seconds, simulated=1.0 / rate, steps=self.steps, particles=len(T))


@dataclass(frozen=True, kw_only=True)
class TwoBodies(Problem):
    """Hot vapour in contact with cold liquid, both at rest: a slab of two materials.

    Errors: ``L2``, of the temperature, relative to the initial difference; ``heat``, of the heat that has passed the
    interface; ``flux``, the flux at the interface in the liquid over that in the vapour, minus 1; ``jump``, of the
    temperature at the interface, relative to the initial difference. ``flux`` and ``jump`` are computed from fits of
    the exact solution to each side.
    """

    title = "two bodies in contact"
    reference = ("T_i = (b_1 T_1 + b_2 T_2)/(b_1 + b_2), b = sqrt(k rho c), error functions on either side, "
                 "Carslaw & Jaeger 1959, section 2.15")

    layers: int = 40  # of either body
    ratio: float = 27.0  # conductivity of the liquid over that of the vapour
    hdx: float = 1.3
    thickness: float = 0.02  # m, of either body
    reach: float = 0.35  # 2 sqrt(alpha t) in the liquid at the end, relative to its thickness
    difference: float = 40.0  # K

    def run(self):
        spacing, water = self.thickness / self.layers, WATER_1ATM
        material = water.with_(name="test fluid", k_v=water.k_l / self.ratio)
        scheme = BoilingScheme(["fluid"], [], dim=2, spacing=spacing, hdx=self.hdx, material=material, density=None,
                               heat=HeatConduction(), phases=PhaseChange())
        fluid = fluid_block((0.0, -self.thickness, 0.0), (WIDTH * spacing, self.thickness, 0.0), spacing=spacing, dim=2,
                            rho0=scheme.rho0, hdx=self.hdx)
        scheme.setup_properties([fluid])
        liquid, T_sat = fluid.y > 0.0, material.T_sat
        fluid.phase[:] = np.where(liquid, Phase.LIQUID, Phase.VAPOUR)
        fluid.e[:] = np.where(liquid, -material.c_l * self.difference, material.L)
        start, T_start = fluid.e.copy(), T_sat - self.difference * liquid
        c, k = (np.where(liquid, *pair) for pair in ((material.c_l, material.c_v), (material.k_l, material.k_v)))
        alpha = k / (material.rho_l * c)
        t = (0.5 * self.reach * self.thickness) ** 2 / alpha.max()
        stepper = Stepper(scheme, [fluid], dt=t / 10, domain=DomainManager(
            xmin=0.0, xmax=WIDTH * spacing, periodic_in_x=True))
        stepper.step(10)

        b_l, b_v = (math.sqrt(k * material.rho_l * c) for k, c in ((material.k_l, material.c_l),
                                                                   (material.k_v, material.c_v)))
        T_i = T_sat - self.difference * b_l / (b_l + b_v)
        T, shape = T_start + (fluid.e - start) / c, erf(np.abs(fluid.y) / (2.0 * np.sqrt(alpha * t)))
        exact = T_i + (T_start - T_i) * shape
        gained = fluid.m * (fluid.e - start)
        passed = gained[liquid].sum()
        due = WIDTH * spacing * 2.0 * self.difference * b_l * b_v / (b_l + b_v) * math.sqrt(t / math.pi)
        (rise_l, at_l), (rise_v, at_v) = (np.polyfit(shape[side], T[side], 1) for side in (liquid, ~liquid))
        order = np.argsort(fluid.y)
        return Outcome(
            errors={"L2": float(np.linalg.norm(T - exact) / np.linalg.norm(exact - T_start)),
                    "heat": float(passed / due - 1.0), "flux": float(-b_l * rise_l / (b_v * rise_v) - 1.0),
                    "jump": float((at_v - at_l) / self.difference)},
            seconds=stepper.seconds, simulated=float(t), steps=10, particles=len(T),
            curves={"y [m]": fluid.y[order], "T [K]": T[order], "exact [K]": exact[order]},
            facts={"energy": float(abs(gained.sum() / passed))})

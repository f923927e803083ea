"""Heated slab: a plate of still water, one face suddenly hot. Heat conduction alone, against its exact solution.

Equations   conduction between particles (Cleary & Monaghan 1999), T = T_0 + (T_1 - T_0) erfc(x / (2 sqrt(alpha t))).
Source      Carslaw & Jaeger 1959, section 2.5.
Run time    about 2 s on one core (320 particles).
Command     pysph-boiling run heated_slab
"""
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pysph_boiling.examples.application import SceneApplication, SceneParameters
from pysph_boiling.particles import fluid_block, wall_array
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import HeatConduction, Heater, param

WIDTH = 8  # spacings across the periodic direction


@dataclass(frozen=True, kw_only=True)
class HeatedSlabParameters(SceneParameters):
    """A slab of water on a plate that is hot from t = 0 on."""

    duration: float = param(60.0, "s", "simulated time", above=0.0)
    frame: float = param(5.0, "s", "time between two outputs", above=0.0)
    substeps: int = param(5, "-", "steps in a frame; the heat is subcycled below that", low=1)
    thickness: float = param(0.02, "m", "thickness of the slab", above=0.0)
    spacing: float = param(0.5e-3, "m", "particle spacing", above=0.0)
    T_0: float = param(293.15, "K", "temperature at the start", above=0.0)
    T_1: float = param(353.15, "K", "temperature of the plate", above=0.0)
    tolerance: float = param(0.02, "-", "largest relative L2 error of T - T_0 at the end", above=0.0)


class HeatedSlab(SceneApplication):
    """See the module. The slab is periodic along x, so the problem has one dimension."""

    Parameters = HeatedSlabParameters
    title = "heated slab"

    def make_scheme(self, p):
        return BoilingScheme(["fluid"], ["wall"], dim=2, spacing=p.spacing, hdx=1.3, density=None,
                             heat=HeatConduction(), heater=Heater(temperature=p.T_1))

    def create_domain(self):
        from pysph.base.nnps import DomainManager

        return DomainManager(xmin=0.0, xmax=WIDTH * self.parameters.spacing, periodic_in_x=True)

    def make_particles(self, p, scheme):
        common = dict(spacing=p.spacing, dim=2, rho0=scheme.rho0, hdx=scheme.hdx)
        upper = (WIDTH * p.spacing, p.thickness, 0.0)
        fluid = fluid_block((0.0, 0.0, 0.0), upper, **common)
        plate = fluid_block((0.0, -3.0 * p.spacing, 0.0), (upper[0], 0.0, 0.0), **common)
        points = np.stack([plate.x, plate.y, plate.z], -1)
        wall = wall_array(points, kernel=scheme.kernel, heated=np.ones(len(points)), **common)
        return [fluid, wall]

    def start_temperature(self, p):
        return p.T_0

    def start(self, arrays, p, scheme):
        scheme.set_temperature(arrays["fluid"], self.start_temperature(p))

    def profile(self):
        """Depth [m], temperature and exact temperature [K] of the particles, sorted by depth."""
        p, material, fluid = self.parameters, self.scheme.material, self.scheme.arrays[0]
        alpha = self.scheme.effects["heat"].conductivity(material.k_l) / (material.rho_l * material.c_l)
        order = np.argsort(fluid.get("y", only_real_particles=True))
        depth = fluid.get("y", only_real_particles=True)[order]
        T = material.T_sat + fluid.get("e", only_real_particles=True)[order] / material.c_l
        reach = 2.0 * math.sqrt(alpha * self.solver.t)
        return depth, T, p.T_0 + (p.T_1 - p.T_0) * np.array([math.erfc(x / reach) for x in depth])

    def error(self):
        """Relative L2 error of T - T_0 [-]."""
        _, T, exact = self.profile()
        return float(np.linalg.norm(T - exact) / np.linalg.norm(exact - self.parameters.T_0))

    def check_final(self):
        p = self.parameters
        assert self.error() <= p.tolerance, f"L2 error of the temperature is {self.error():.3%}"
        last = self.ledger.rows[-1]
        assert abs(last["energy_residual"]) <= 1e-10, f"energy residual {last['energy_residual']:.1e}"
        assert last["energy_in"] > 0.0, "no heat came in"

    def draw(self):
        from matplotlib.figure import Figure

        depth, T, exact = self.profile()
        figure = Figure(figsize=(5, 4), layout="constrained")
        axes = figure.subplots()
        axes.plot(depth * 1e3, exact, "k-", label="exact")
        axes.plot(depth * 1e3, T, ".", label=f"particles, error {self.error():.2%}")
        axes.set(xlabel="distance from the plate [mm]", ylabel="temperature [K]")
        axes.legend()
        path = Path(self.output_dir) / "profile.png"
        figure.savefig(path, dpi=150)
        return [path, *super().draw()]


if __name__ == "__main__":
    HeatedSlab().run()

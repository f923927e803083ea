"""Dam break: a column of water collapses and runs along a floor; Position Based Fluids without heat.

Equations   density constraint (Macklin & Müller 2013, eqs. 1-12), boundary particles (Akinci et al. 2012).
Source      Martin & Moyce 1952 and Koshizuka & Oka 1996, whose fronts PySPH ships in ``pysph.examples.db_exp_data``.
Run time    about 5 s on two cores (2-D, 3,200 particles, 360 steps for 0.8 s); less with ``--quick``. The first run
            also compiles.
Command     pysph-boiling run dam_break
"""
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pysph_boiling.checks import NotChecked, require
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import box_vessel, fluid_block
from pysph_boiling.runs.application import SceneApplication, SceneParameters
from pysph_boiling.schemes.effects import BoxContainer, XSPHViscosity, param
from pysph_boiling.schemes.pbf import PBFScheme

WINDOW = (0.5, 2.5)  # t sqrt(g/H) between which fronts are compared: the gate has opened, and there are data
FRONT_TOLERANCE = 0.1  # relative distance from the range of the experiments, up to 9 % wide


@dataclass(frozen=True, kw_only=True)
class DamBreakParameters(SceneParameters):
    """A column of width a and height 2 a in a long tank."""

    duration: float = param(0.8, "s", "simulated time", above=0.0, may_change=True)
    frame: float = param(0.02, "s", "time between two outputs", above=0.0, may_change=True)
    width: float = param(0.5, "m", "width a of the column", above=0.0)
    tank: float = param(7.5, "-", "length of the tank, in widths of the column", above=1.0)
    spacing: float = param(0.0125, "m", "particle spacing", above=0.0)
    dim: int = param(2, "-", "dimension", choices=(2, 3))
    depth: float = param(0.2, "m", "depth of the tank, 3-D only", above=0.0)


class DamBreak(SceneApplication):
    """The scene of this module."""

    Parameters = DamBreakParameters
    title = "dam break"
    pictures = ("front.png",)
    variants = {"quick": dict(spacing=0.025)}

    def box(self, p):
        """Corners of the tank [m]."""
        if p.dim == 2:
            return (0.0, 0.0, 0.0), (p.tank * p.width, 3.0 * p.width, 0.0)
        return (0.0, 0.0, 0.0), (p.tank * p.width, p.depth, 3.0 * p.width)

    def make_scheme(self, p):
        lower, upper = self.box(p)
        return PBFScheme(["fluid"], ["wall"], dim=p.dim, spacing=p.spacing, rho0=1000.0,
                         container=BoxContainer(lower=lower, upper=upper), viscosity=XSPHViscosity(wall=1.0))

    def make_particles(self, p, scheme):
        lower, upper = self.box(p)
        corner = list(upper)
        corner[0], corner[p.dim - 1] = p.width, 2.0 * p.width
        common = dict(spacing=p.spacing, dim=p.dim, rho0=scheme.rho0, hdx=scheme.hdx)
        return [fluid_block(lower, corner, part=self.ranks_part, **common),
                box_vessel(lower, upper, kernel=scheme.kernel, **common)]

    def measure(self, arrays, t):
        return t, float(np.max(arrays["fluid"].x))

    def front(self):
        """Time t sqrt(g/H) [-] and front X/a [-] of each output, and the range (low, high) of the experiments."""
        from pysph.examples.db_exp_data import get_koshizuka_oka_data, get_martin_moyce_1, get_martin_moyce_2

        p = self.parameters
        rows = np.array(self.measured())
        t = rows[:, 0] * math.sqrt(9.81 / (2.0 * p.width))
        measured = np.array([  # each against t sqrt(2 g/a) = 2 t sqrt(g/H), known only as far as it was measured
            np.interp(2.0 * t, *data(), left=np.nan, right=np.nan)
            for data in (get_martin_moyce_1, get_martin_moyce_2, get_koshizuka_oka_data)])
        known = np.isfinite(measured).any(axis=0)
        low, high = np.full(len(t), np.nan), np.full(len(t), np.nan)
        low[known], high[known] = np.nanmin(measured[:, known], axis=0), np.nanmax(measured[:, known], axis=0)
        return t, rows[:, 1] / p.width, low, high

    def front_error(self):
        """Largest relative distance of the front from the range of the experiments in the window [-]."""
        t, x, low, high = self.front()
        window = (t >= WINDOW[0]) & (t <= WINDOW[1]) & (x < self.parameters.tank - 0.1)
        if window.sum() < 3:
            raise NotChecked("there are too few outputs between the opening of the gate and the far wall")
        return float(np.max(np.maximum(x / high - 1.0, 1.0 - x / low)[window]))

    def check_from(self, p):
        return WINDOW[1] * math.sqrt(2.0 * p.width / 9.81)

    def at_end(self):
        """Also the corners of the box around the water [m], and the largest speed [m/s]."""
        fluid = self.scheme.arrays[0]
        places = np.stack([fluid.get(axis, only_real_particles=True) for axis in "xyz"])
        squares = sum(fluid.get(axis, only_real_particles=True)**2 for axis in "uvw")
        ends = ranks.largest(np.array([*places.max(axis=1, initial=-np.inf), *(-places).max(axis=1, initial=-np.inf),
                                       squares.max(initial=0.0)]))
        return super().at_end() | {"lower": -ends[3:6], "upper": ends[:3], "speed": math.sqrt(ends[6])}

    def check_final(self):
        lower, upper = self.box(self.parameters)
        for k, axis in enumerate("xyz"[:self.parameters.dim]):
            require(self.final["lower"][k] > lower[k] and self.final["upper"][k] < upper[k],
                    f"particles left the tank along {axis}")
        fastest = self.final["speed"]
        fall = np.sqrt(2.0 * self.scheme.scene().g * (upper[self.parameters.dim - 1] - lower[self.parameters.dim - 1]))
        require(fastest <= 2.0 * fall, f"a particle has {fastest:.3g} m/s; a fall through the tank gives {fall:.3g}, "
                "and a jet may be at most twice as fast")
        error = self.front_error()
        require(error <= FRONT_TOLERANCE, f"the front is {error:.1%} outside the range of the experiments")

    def draw(self):
        from matplotlib.figure import Figure

        made = super().draw()
        t, x, low, high = self.front()
        figure = Figure(figsize=(5, 4), layout="constrained")
        axes = figure.subplots()
        axes.plot(t, x, label="pysph_boiling")
        axes.fill_between(t, low, high, color="0.7", label="Martin & Moyce 1952, Koshizuka & Oka 1996")
        axes.set(xlabel="t sqrt(g/H)", ylabel="front X/a")
        axes.axvspan(*WINDOW, alpha=0.1)
        axes.legend()
        path = Path(self.output_dir) / "front.png"
        figure.savefig(path, dpi=150)
        return [path, *made]


if __name__ == "__main__":
    DamBreak().run()

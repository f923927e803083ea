"""The rules of phase change on a few particles: the kernels of a scheme, run as plain Python.

Nothing is compiled, so a table about the model can be computed from the model itself whenever it is made.
"""
from inspect import signature
from types import FunctionType

import numpy as np

from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.particles import fluid_array, site_array
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    BubbleLabels,
    Condensation,
    DynamicNucleation,
    HeatConduction,
    PhaseChange,
    PresetNucleation,
)
from pysph_boiling.schemes.modes import effects_in_mode, widen_sites
from pysph_boiling.schemes.stages import STAGES

__all__ = ["Toy", "call", "evaluate"]


class Toy:
    """A small 2-D block of liquid with one site, under its middle or out of reach, in one of the modes.

    ``phases`` is the effect of that slot, the default one if not given.

    The particles do not move; ``step`` evaluates phases and dynamic nucleation.
    """

    DX = 0.002  # spacing [m]
    SIDE = 7  # particles along each side
    DT = 0.01  # [s]

    def __init__(self, mode="dynamic", *, site=True, phases=None):
        effects = dict(heat=HeatConduction(), phases=phases or PhaseChange(), preset_nucleation=PresetNucleation(),
                       bubbles=BubbleLabels(), condensation=Condensation(),
                       dynamic_nucleation=DynamicNucleation(superheat_limit=100.0))
        self.scheme = BoilingScheme(["fluid"], [], dim=2, spacing=self.DX, sites=["sites"], material=WATER_1ATM,
                                    **effects_in_mode(mode, effects))
        points = np.zeros((self.SIDE**2, 3))
        points[:, :2] = self.DX * (np.indices((self.SIDE, self.SIDE)).reshape(2, -1).T + [-(self.SIDE // 2), 0.5])
        place = [0.0, 0.0 if site else -1.0, 0.0]
        self.fluid = fluid_array(points, spacing=self.DX, dim=2, rho0=WATER_1ATM.rho_l)
        self.sites = site_array([place], reach=2.4 * self.DX, spacing=self.DX)
        self.arrays = [self.fluid, self.sites]
        widen_sites(self.scheme, self.arrays)
        self.scheme.setup_properties(self.arrays)
        self.near = np.hypot(self.fluid.x, self.fluid.y - place[1]) < \
            self.scheme.effects["preset_nucleation"].radius * self.DX

    def heat(self, e, phase=Phase.LIQUID):
        """Set the specific enthalpy, in units of L, and the phase of all particles."""
        self.fluid.e[:], self.fluid.phase[:] = WATER_1ATM.L * np.asarray(e, float), phase
        return self

    def step(self, n=1, stages=("phases", "dynamic_nucleation")):
        """Evaluate phases and dynamic nucleation, or other ``stages``, ``n`` times; returns the phases."""
        for _ in range(n):
            for stage in stages:
                evaluate(self.scheme, stage, self.arrays, dt=self.DT)
        return self.fluid.phase.copy()


def evaluate(scheme, stage, arrays, dt):
    """Evaluate one stage of a scheme on its arrays group by group and kernel by kernel, as PySPH does, but in Python.

    Limits: only stages that do not iterate; no periodic domain; slow.
    """
    terms = scheme.terms()
    for block in next(one for one in STAGES if one.name == stage).blocks:
        for spec in block.groups:
            equations = [term.equation for term in terms if term.place == f"{stage}.{spec.name}"]
            for pa in arrays:
                own = [equation for equation in equations if equation.dest == pa.name]
                call(own, "initialize", pa, dt=dt)
                for source in arrays:
                    reading = [equation for equation in own if source.name in (equation.sources or ())]
                    call(reading, "loop_all", pa, source, dt=dt, scale=scheme.kernel.radius_scale)
                    call(reading, "loop", pa, source, dt=dt, scale=scheme.kernel.radius_scale, pairs=True)
                call(own, "post_loop", pa, dt=dt)


def call(equations, method, pa, source=None, *, dt, scale=None, pairs=False):
    """Call a kernel of each equation for every particle of ``pa``, or for every pair of neighbours."""
    for equation in equations:
        if not hasattr(equation, method):
            continue
        bound = getattr(equation, method)
        kernel = FunctionType(bound.__code__, {**bound.__globals__, "cast": _cast}, method, bound.__defaults__)
        names = list(signature(bound).parameters)
        values = {"dt": dt}
        for name in names:
            if name[:2] in ("d_", "s_") and name not in ("d_idx", "s_idx"):
                values[name] = _values(pa if name[0] == "d" else source, name[2:])
        with np.errstate(over="ignore"):  # the random numbers wrap
            for i in range(pa.get_number_of_particles()):
                values["d_idx"] = i
                if scale is None:
                    kernel(equation, *(values[name] for name in names))
                    continue
                r = np.sqrt(sum((pa.get(axis)[i] - source.get(axis)) ** 2 for axis in "xyz"))
                near = np.flatnonzero(r < scale * np.maximum(pa.h[i], source.h))
                values["NBRS"], values["N_NBRS"] = near, len(near)
                for j in near if pairs else (-1,):
                    values["s_idx"], values["RIJ"] = j, r[j]
                    kernel(equation, *(values[name] for name in names))


def _values(pa, name):
    """A property of an array, or a constant, as a view."""
    return pa.constants[name].get_npy_array() if name in pa.constants else pa.get(name, only_real_particles=False)


def _cast(value, kind):
    """A C cast to an integer or a floating-point number."""
    return float(value) if kind in ("float", "double") else int(value)

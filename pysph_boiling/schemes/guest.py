"""The model as a guest in other PySPH schemes, which move the particles: :class:`BoilingGuest`."""
from collections.abc import Sequence
from typing import Any

import numpy as np
from pysph.base.particle_array import ParticleArray
from pysph.solver.tools import Tool
from pysph.sph.acceleration_eval import make_acceleration_evals
from pysph.sph.equation import Equation, Group, MultiStageEquations
from pysph.sph.sph_compiler import SPHCompiler

from pysph_boiling.equations import bubble_groups
from pysph_boiling.materials import WATER_1ATM, Material
from pysph_boiling.names import unknown
from pysph_boiling.parallel import ranks
from pysph_boiling.parallel.ghosts import GhostRefresh, Ghosts
from pysph_boiling.particles import add_properties, number
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects.bubbles import BubbleLabels
from pysph_boiling.schemes.effects.motion import MAX_VELOCITY_EXCHANGE
from pysph_boiling.schemes.integrator import ThermalStages
from pysph_boiling.schemes.modes import effects_in_mode, widen_sites
from pysph_boiling.schemes.solver import build_side_by_side, vectorised

__all__ = ["BoilingGuest", "label_groups"]


class GuestScheme(BoilingScheme):
    """A :class:`BoilingScheme` whose particles are moved by another scheme."""

    hosted = True


class GuestCall(Equation):
    """Does nothing: its group calls the guest, after the other groups of the scheme.

    Source: ours.   Reads   nothing.   Writes   nothing.
    """

    def initialize(self, d_idx, d_x):
        d_x[d_idx] += 0.0


class BoilingGuest(ThermalStages):
    """Boiling in a PySPH scheme that moves the particles: WCSPH, TVF, EDAC or one of your own.

    In each step heat is conducted, phases change and bubbles are labelled, at the positions and with the neighbours of
    the first evaluation of the scheme's equations; then, in every evaluation, the forces on bubbles are added to
    ``au``, ``av``, ``aw``. Each stage has a compiled module of its own, as in :class:`BoilingScheme`.

    Parameters
    ----------
    fluids, solids, sites : list of str   Names of the arrays of the fluid, of heated or cooled walls, and of nucleation
                                          sites (at most one). Sites are not part of the other scheme.
    dim : int                             2 or 3. The vertical is y in 2-D and z in 3-D, unless gravity says otherwise.
    spacing : float                       Particle spacing [m], > 0.
    hdx : float                           Smoothing length over spacing [-], 1 to 2, as in the other scheme.
    material : Material                   Constants of the fluid; the rest density must be that of the other scheme.
    gravity : three floats                [m/s^2]; 9.81 downwards if not given. Buoyancy and others are relative to it;
                                          the other scheme itself applies gravity.
    kernel : PySPH kernel                 CubicSpline if not given, even if the other scheme has another. Its support
                                          must not exceed that of the other.
    mode : str                            "dynamic", "gu" or "li_xiao" (:mod:`pysph_boiling.schemes.modes`).
    **effects                             One effect per slot, as for :class:`BoilingScheme`, without those that need
                                          its density constraint.

    Use: call :meth:`setup` at the end of ``create_particles``, add :meth:`groups` to the equations, and return
    :meth:`tools` from ``create_tools``, and after them a :class:`pysph_boiling.runs.ledger.GuestLedger` if mass and
    energy are to be balanced. ``examples/reuse_wcsph.py`` is a complete application.

    Errors: ``ValueError`` for an effect that needs the density constraint, for arrays that do not fit, for several
    ranks and devices, and for a time step that is too long for the drag.
    Limits: one rank, and no device. Vapour has the mass and rest density of liquid. ``venting.free_steps`` counts
    evaluations, of which an integrator may make several in a step.

    Example: what a guest brings into a scheme.

    >>> from pysph_boiling.schemes.effects import BubbleLabels, Buoyancy, Drag, HeatConduction, PhaseChange
    >>> from pysph_boiling.schemes.guest import BoilingGuest
    >>> guest = BoilingGuest(["fluid"], dim=2, spacing=0.005, heat=HeatConduction(), phases=PhaseChange(),
    ...                      bubbles=BubbleLabels(), buoyancy=Buoyancy(), drag=Drag())
    >>> sorted({term.place.split(".")[0] for term in guest.scheme.terms()})
    ['bubbles', 'forces', 'heat', 'phases']
    """

    def __init__(self, fluids: Sequence[str], solids: Sequence[str] = (), sites: Sequence[str] = (), *, dim: int,
                 spacing: float, hdx: float = 1.2, material: Material = WATER_1ATM,
                 gravity: Sequence[float] | None = None, kernel: Any = None, mode: str = "dynamic", **effects: Any):
        asked = {slot: effect for slot, effect in effects.items() if effect is not None}
        present: dict[str, Any] = effects_in_mode(mode, asked)
        for slot, effect in present.items():
            if not getattr(effect, "in_guest", True):
                raise ValueError(f"effect '{slot}' ({type(effect).__name__}) needs the density constraint of "
                                 "BoilingScheme: it cannot be a guest in another scheme")
        self.scheme = GuestScheme(list(fluids), list(solids), sites=list(sites), dim=dim, spacing=spacing, hdx=hdx,
                                  material=material, gravity=gravity, kernel=kernel, lean=False, density=None,
                                  **present)
        self.scheme.scene()  # checks what effects require
        self.scheme.integrator = self  # its reductions and heat_subcycles
        self.evaluators = self.solver = None
        self.due = False

    def setup(self, particles: Sequence[ParticleArray], heated: dict[str, np.ndarray] | None = None) -> None:
        """Add the properties and constants of the effects to ``particles``, all arrays of the scene.

        ``heated`` maps the name of a wall to (n,) values that are true where it is a heater. Properties of the other
        scheme stay, and both are written to the files. Liquid is at saturation until :meth:`set_temperature` is called.
        """
        scheme, arrays = self.scheme, {pa.name: pa for pa in particles}
        if ranks.size() > 1:
            raise ValueError(f"BoilingGuest needs a single rank, got {ranks.size()}")
        for name in [*scheme.fluids, *scheme.solids, *scheme.sites]:
            if name in arrays and arrays[name].gpu is not None:
                raise ValueError(f"BoilingGuest does not work on a device: array '{name}' is on one")
        for name in scheme.fluids:
            for h in np.unique(arrays[name].h) if name in arrays else ():
                if abs(h / scheme.spacing - scheme.hdx) > 1e-6 * scheme.hdx:
                    raise ValueError(f"smoothing lengths of '{name}' are {h / scheme.spacing:.6g} spacings: pass "
                                     f"hdx={h / scheme.spacing:.6g}")
        for name, where in (heated or {}).items():
            if name not in scheme.solids:
                raise unknown("wall of the guest", name, scheme.solids)
            if np.shape(where) != arrays[name].x.shape:
                raise ValueError(f"heated of '{name}' must have shape {arrays[name].x.shape}, got {np.shape(where)}")
            arrays[name].add_property("heated", type="int", data=np.asarray(where, bool).astype(np.int32))
        widen_sites(scheme, particles)
        scheme.setup_properties(particles, clean=False)

    def set_temperature(self, pa: ParticleArray, T: float | np.ndarray) -> None:
        """Set the temperature ``T`` [K], a number or (n,), of a fluid array (:meth:`BoilingScheme.set_temperature`)."""
        self.scheme.set_temperature(pa, T)

    def groups(self) -> list[Group]:
        """The groups to add after those of the other scheme."""
        return [Group([GuestCall(name, None) for name in self.scheme.fluids], pre=self.evaluate, name="guest")]

    def tools(self) -> list[Tool]:
        """The PySPH tools: the guest itself, the guard against NaN, and those of the effects."""
        return [GuestTool(self), *self.scheme.tools()]

    def describe(self) -> str:
        """Text with stages, groups, and the effect to which each equation belongs."""
        return self.scheme.describe()

    # --- in a step ----------------------------------------------------------------------------------------------------

    def begin(self, solver: Any) -> None:
        """Compile the stages before the first step, with the neighbour search of the ``solver``."""
        scheme, nnps = self.scheme, solver.nnps
        found = {pa.name: pa for pa in nnps.particles}
        mine = scheme.kernel.radius_scale * scheme.hdx
        theirs = nnps.radius_scale * scheme.hdx
        if mine > theirs * (1.0 + 1e-9):
            raise ValueError(f"the kernel of the guest reaches {mine:.3g} spacings, but that of the scheme only "
                             f"{theirs:.3g}: pass kernel=... to BoilingGuest")
        scheme.arrays[:] = [found[name] for name in scheme.fluids]
        scheme.site_arrays[:] = [found[name] for name in scheme.sites]
        scheme.wall_arrays[:] = [found[name] for name in scheme.solids]
        if nnps.domain.manager.is_periodic:
            scheme.enter_domain(nnps.domain, solver.particles)
        scheme.ghosts.arrays = scheme.arrays
        self.check_time_step(solver.dt)
        built, conditions = scheme.build_stages(scheme.built_terms()[0])
        heat_limit, step_limit = scheme.heat_limits()
        self.plan_thermal(stages=built, arrays=scheme.arrays, conditions=conditions, heat_limit=heat_limit,
                          step_limit=step_limit)
        equations = MultiStageEquations(list(built.values()))
        with vectorised():
            build_side_by_side(nnps.particles, equations, scheme.kernel, None, built)
            evaluators = make_acceleration_evals(nnps.particles, equations, scheme.kernel)
            SPHCompiler(evaluators, None).compile()
        for evaluator in evaluators:
            evaluator.set_nnps(nnps)
        self.evaluators, self.solver = evaluators, solver

    def check_time_step(self, dt: float) -> None:
        """Raise ``ValueError`` if a step of ``dt`` [s] would let drag overshoot."""
        rate = sum(effect.rate_of_velocity(self.scheme.scene()) for effect in self.scheme.effects.values())
        if rate * dt > MAX_VELOCITY_EXCHANGE:
            raise ValueError(f"the time step must be at most {MAX_VELOCITY_EXCHANGE / rate:.3g} s for the drag of the "
                             f"guest, got {dt:.3g} s")

    def evaluate(self) -> None:
        """Called in each evaluation of the scheme, after its own groups: the stages of the guest."""
        if self.evaluators is None:  # PySPH's evaluation before the first step
            return
        t, dt = self.solver.t, self.solver.dt
        if self.due:
            self.due, self.heat_subcycles = False, 0
            self.count_step()
            self.scheme.ghosts.search_done()
            for stage in self.thermal(dt):
                self.evaluators[stage].compute(t, dt)
        if "forces" in self.stages:
            self.evaluators[self.stages["forces"]].compute(t, dt)


class GuestTool(Tool):
    """Tells the guest when a step begins; before the first one the guest compiles its stages."""

    def __init__(self, guest):
        self.guest = guest

    def pre_step(self, solver):
        if self.guest.evaluators is None:
            self.guest.begin(solver)
        self.guest.due = True


def label_groups(pa: ParticleArray, *, radius: float) -> list[Group]:
    """Groups that label the bubbles of the array ``pa``, to be added to the equations of any scheme.

    Vapour particles (``phase`` 3) closer than ``radius`` [m], which is at most the kernel support, belong together.
    Afterwards the property ``bubble`` is the smallest uid in a particle's bubble, or ``NO_BUBBLE``. The domain may be
    periodic. All properties that are needed, including ``uid``, are added to the array.

    Errors: ``ValueError`` if radius <= 0, or if the array has no ``phase``.   Limits: not on several ranks.
    """
    if "phase" not in pa.properties:
        raise ValueError(f"to label bubbles, array '{pa.name}' needs the property 'phase' (int); see "
                         "pysph_boiling.phases")
    number(pa)
    add_properties(pa, BubbleLabels().properties(None))
    for name, value in BubbleLabels().constants(None).items():
        if name not in pa.constants:
            pa.add_constant(name, value)
    ghosts = Ghosts()
    ghosts.arrays = [pa]
    refresh = GhostRefresh(ghosts, ("grandparent",))
    rounds = [Group([bubble_groups.BubbleSnap(pa.name, None)], post=refresh, name="snap"),
              Group([bubble_groups.BubbleHook(pa.name, [pa.name], radius=radius)], name="hook"),
              Group([bubble_groups.BubbleShortcut(pa.name, None)], name="shortcut"),
              Group([bubble_groups.BubbleCheck(pa.name, None)], name="check")]
    return [Group([bubble_groups.BubbleStart(pa.name, None)], pre=ghosts.search_done, name="start"),
            Group(rounds, iterate=True, max_iterations=BubbleLabels.MAX_ROUNDS, name="rounds"),
            Group([bubble_groups.BubbleLabel(pa.name, None)], name="label")]

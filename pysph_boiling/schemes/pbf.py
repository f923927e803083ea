"""PBFScheme: Position Based Fluids for PySPH, and the machinery that turns effects into a scheme."""
import math
import warnings
from collections.abc import Sequence
from numbers import Real
from typing import Any

import numpy as np
from pysph.base.kernels import CubicSpline
from pysph.base.particle_array import ParticleArray
from pysph.solver.tools import Tool
from pysph.sph.equation import MultiStageEquations
from pysph.sph.scheme import Scheme

from pysph_boiling.equations.lean import PBFSweepsLean
from pysph_boiling.names import SchemeError, current_name, option, unknown, whole_number
from pysph_boiling.parallel import ranks
from pysph_boiling.parallel.ghosts import GhostRefresh, Ghosts
from pysph_boiling.particles import (
    BASE_PROPERTIES,
    PYSPH_PROPERTIES,
    ROUGHNESS,
    WALL_PROPERTIES,
    add_properties,
    number,
    weigh_walls,
)
from pysph_boiling.schemes import options as option_module
from pysph_boiling.schemes.auto import choose, report
from pysph_boiling.schemes.effects import EFFECTS, Effect, SchemeContext, check_temperatures
from pysph_boiling.schemes.effects.mechanics import WorkMeter
from pysph_boiling.schemes.forms import effects_in_forms, forms_in
from pysph_boiling.schemes.guard import Guard
from pysph_boiling.schemes.integrator import PBFFrozenStep, PBFIntegrator, PBFStep
from pysph_boiling.schemes.lean import lean_terms, why_general
from pysph_boiling.schemes.quality import QUALITIES
from pysph_boiling.schemes.reductions import GENERAL, Reductions
from pysph_boiling.schemes.solver import StagedSolver, vector_tag
from pysph_boiling.schemes.stages import STAGES, Term, build_stage, check_places

__all__ = ["PBFScheme"]

_DEFAULT = object()
SORT_INTERVAL = 10  # steps between two sorts in memory; a sort takes 3 % of a step, and steps get 0.05 % slower each
SWEEP_LIMIT_FACTOR = 10  # factor on density.max_sweeps while the error stays above density.max_mean_error
SPACING_RANGE = 1e-9, 1e6  # m; with others, volumes and their inverses leave the range of numbers


class Slots:
    """The slots of all effects that are registered when it is read, except ``without`` and those that require it."""

    def __init__(self, without=None):
        self.without = without

    def __get__(self, scheme, owner):
        return tuple(slot for slot in EFFECTS if self.without not in requirements(slot))


def requirements(slot):
    """``slot`` itself and all slots that its first effect requires, directly or through others."""
    found, pending = set(), [slot]
    while pending:
        slot = pending.pop()
        if slot not in found:
            found.add(slot)
            pending += EFFECTS[slot][0].requires if slot in EFFECTS else ()
    return found


class PBFScheme(Scheme):
    """Incompressible free-surface flow by Position Based Fluids (Macklin & Müller 2013).

    Parameters
    ----------
    fluids, solids : list of str   Names of the fluid arrays and of the boundary arrays (Akinci volumes).
    dim : int                      2 or 3. The vertical is y in 2-D and z in 3-D.
    spacing : float                Particle spacing [m], > 0.
    rho0 : float                   Rest density [kg/m^3], > 0.
    gravity : three floats         [m/s^2]; 9.81 downwards if not given.
    hdx : float                    Smoothing length over spacing [-], 1 to 2.
    kernel : PySPH kernel          CubicSpline (if not given) or WendlandQuintic.
    quality : str                  "draft", "standard" or "reference": time step and sweeps (schemes/quality.py). A
                                   given effect ``density`` keeps its own sweeps.
    lean : bool                    Whether lean sums may replace general equations (schemes/lean.py).
    **effects                      One effect per slot (``container=BoxContainer(...)``), or ``None`` to leave it out.
                                   With ``density=None`` particles do not move.

    Errors: ``ValueError`` that names the parameter, its value, range and unit, before any array is touched.
    Limits: a fixed time step; mirror domains are not supported; no periodic domain on several MPI ranks.
    """

    slots = Slots(without="heat")
    material: Any = None
    hosted = False  # whether another scheme moves the particles, so that no effect ``density`` is required
    shared = False  # whether arrays hold one rank's share of the particles, and were checked as a whole before

    def __init__(self, fluids: Sequence[str], solids: Sequence[str], *, dim: int, spacing: float, rho0: float = 1000.0,
                 gravity: Sequence[float] | None = None, hdx: float = 1.2, kernel: Any = None,
                 sites: Sequence[str] = (), quality: str = "standard", lean: bool = True, density: Any = _DEFAULT,
                 **effects: Any):
        if isinstance(dim, float) or dim not in (2, 3):
            raise ValueError(f"dim must be 2 or 3, got {dim!r}")
        for name, value, unit in (("spacing", spacing, "m"), ("rho0", rho0, "kg/m^3")):
            if not (isinstance(value, Real) and math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} must be > 0 {unit}, got {value} {unit}")
        if not SPACING_RANGE[0] <= spacing <= SPACING_RANGE[1]:
            raise ValueError(f"spacing must lie in [{SPACING_RANGE[0]:g}, {SPACING_RANGE[1]:g}] m, got {spacing} m")
        if not 1.0 <= hdx <= 2.0:
            raise ValueError(f"hdx (smoothing length over spacing) must lie in [1, 2], got {hdx}")
        if not len(fluids):
            raise ValueError("a scheme needs the name of at least one fluid array")
        for kind, names in (("fluids", fluids), ("solids", solids), ("sites", sites)):
            if isinstance(names, str) or not all(isinstance(name, str) for name in names):
                raise ValueError(f"{kind} must be a list of names of particle arrays, got {names!r}")
        names = [*fluids, *solids, *sites]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise ValueError(f"the particle array '{twice}' must not be named twice")
        if gravity is None:
            gravity = (0.0, -9.81, 0.0) if dim == 2 else (0.0, 0.0, -9.81)
        gravity = tuple(float(component) for component in gravity)
        if len(gravity) != 3 or not all(map(math.isfinite, gravity)):
            raise ValueError(f"gravity must be three finite accelerations [m/s^2], got {gravity}")
        self.spacing, self.rho0, self.hdx, self.gravity = float(spacing), float(rho0), float(hdx), gravity
        self.kernel = kernel if kernel is not None else CubicSpline(dim=dim)
        if self.kernel.dim != dim:
            raise ValueError(f"the kernel must have {dim} dimensions like the scheme, got {self.kernel.dim}")
        self.sites, self.lean = list(sites), lean
        self.effects = {}
        self.set_quality(quality)
        if density is not _DEFAULT:
            effects["density"] = density
        self.set_effects(**effects)
        self.ghosts, self.arrays, self.site_arrays, self.wall_arrays = Ghosts(), [], [], []
        self.given = {}  # name -> particle array that was set up
        self.period = np.zeros(3)
        self.dt = None
        self.integrator: Any = None
        self.choices = []
        super().__init__(list(fluids), list(solids), dim)

    # --- effects ------------------------------------------------------------------------------------------------------

    def set_effects(self, **effects: Effect | None) -> None:
        """Set the effects of slots, or leave one out with ``None``. Raises ``ValueError`` for an unknown slot."""
        for slot, effect in effects.items():
            if slot not in self.slots and current_name(slot) != slot:
                raise ValueError(f"{slot} is called {current_name(slot)} now")
            if slot not in self.slots:
                raise unknown(f"effect in {type(self).__name__}:", slot, self.slots)
            if effect is None:
                self.effects.pop(slot, None)
            elif not isinstance(effect, tuple(EFFECTS[slot])):
                known = " or ".join(cls.__name__ for cls in EFFECTS[slot])
                raise ValueError(f"effect '{slot}' must be {known} or None, got {effect!r}")
            else:
                self.effects[slot] = effect
        self.effects = {slot: self.effects[slot] for slot in self.slots if slot in self.effects}

    def set_quality(self, name: str) -> None:
        """Use the time step and density sweeps of a preset. Raises ``ValueError`` for an unknown name."""
        if name not in QUALITIES:
            raise unknown("quality", name, QUALITIES)
        quality = QUALITIES[name]
        self.dt_factor = quality.dt_factor
        self.set_effects(density=quality.density)

    def set_forms(self, forms: str) -> None:
        """Give the effects forms of the paper: "paper", "ours" or names (:mod:`pysph_boiling.schemes.forms`).

        What "paper" leaves out is told as a warning. Raises ``ValueError`` for an unknown name, and for a named form
        that this scene cannot have.
        """
        effects, sentences = effects_in_forms(forms, self.effects, self.scene)
        for sentence in sentences:
            warnings.warn(sentence, stacklevel=2)
        self.effects = effects

    def derive(self, particles: Sequence[ParticleArray], T: Any = None, candidates: dict | None = None,
               asked: dict | None = None) -> None:
        """Choose the effects from the arrays of the scene (:func:`pysph_boiling.schemes.auto.choose`)."""
        self.choices = choose(self, particles, T, candidates, asked)
        self.set_effects(**{choice.slot: choice.effect for choice in self.choices})
        print(report(self.choices))

    def scene(self) -> SchemeContext:
        """The :class:`SchemeContext` of the effects. Raises ``ValueError`` if one lacks another that it requires."""
        for slot, effect in self.effects.items():
            for needed in effect.requires:
                if needed not in EFFECTS:
                    raise unknown(f"effect, which '{slot}' requires, of the name", needed, EFFECTS)
                if needed not in self.effects and not (self.hosted and needed == "density"):
                    cls = EFFECTS[needed][0].__name__
                    raise SchemeError(f"effect '{slot}' ({type(effect).__name__}) needs the effect '{needed}'",
                                      f"pass {needed}={cls}(...) to the scheme, or leave '{slot}' out",
                                      f"add {option(needed)}, or leave '{slot}' out with {option(f'no_{slot}')}")
        return SchemeContext(
            fluids=tuple(self.fluids), solids=tuple(self.solids), sites=tuple(self.sites), dim=self.dim,
            spacing=self.spacing, h=self.hdx * self.spacing, kernel=self.kernel, rho0=self.rho0,
            material=self.material, gravity=self.gravity, effects=self.effects, period=self.period, hosted=self.hosted)

    def skin(self) -> float:
        """Distance by which neighbour lists reach farther than the support [m]."""
        return self.effects["density"].skin * self.spacing if "density" in self.effects else 0.0

    def terms(self) -> list[Term]:
        """Every :class:`Term` of the scheme, with its owner, in the order in which terms stand in their groups."""
        scene = self.scene()
        return [term._replace(owner=slot) for fluid in self.fluids for slot, effect in self.effects.items()
                for term in effect.terms(scene, fluid)]

    def built_terms(self) -> tuple[list[Term], dict]:
        """(terms, why): the terms for the arrays that were set up, with lean sums, or the reason why without them."""
        terms, why = self.terms(), why_general(self, self.given)
        return (terms if why else lean_terms(terms, self)), why

    @property
    def wall_jitter(self) -> float:
        """Displacement of the wall particles that goes with the effects [spacings]: rough walls with multipliers."""
        return ROUGHNESS if "wall_multipliers" in self.effects else 0.0

    @property
    def reductions(self) -> Reductions:
        """The :class:`~pysph_boiling.schemes.reductions.Reductions` of the particles: in C if the solver has lean sums.
        """
        return getattr(self.integrator, "reductions", GENERAL)

    def sweep_limits(self) -> tuple[int, int]:
        """The smallest and the largest number of density sweeps in one run of their stage."""
        return self.effects["density"].min_sweeps, SWEEP_LIMIT_FACTOR * self.effects["density"].max_sweeps

    def pairs(self) -> list[tuple[str, str]]:
        """Names (destination, source) of the arrays of every sum over neighbours, sorted."""
        return sorted({(term.equation.dest, source) for term in self.terms() for source in term.equation.sources or ()})

    def effect_rows(self, what: str) -> Any:
        """All ``effect.<what>(scene)`` of the effects in one list: properties of an array, flows or columns."""
        scene = self.scene()
        return [row for effect in self.effects.values() for row in getattr(effect, what)(scene)]

    # --- PySPH's Scheme protocol --------------------------------------------------------------------------------------

    def add_user_options(self, group):
        option_module.add_options(group, self.slots)
        group.add_argument("--no-lean", dest="lean", action="store_false", default=None,
                           help="use general equations instead of lean sums")

    def consume_user_options(self, options):
        self.effects = option_module.apply_options(options, self.effects, self.slots)
        self.lean = self.lean if options.lean is None else options.lean
        self.set_effects()

    def time_step(self, dt_factor: float | None = None) -> float:
        """Suggested time step [s]: ``dt_factor`` of ``t* = sqrt(spacing/|g|)``, that of the quality if not given."""
        fall_time = self.scene().fall_time
        if math.isinf(fall_time):
            raise ValueError("without gravity there is no default time step: give dt [s]")
        return (self.dt_factor if dt_factor is None else dt_factor) * fall_time

    def configure_solver(self, kernel=None, integrator_cls=None, extra_steppers=None, *, frame=None, substeps=None,
                         dt=None, **kw):
        """Make the solver.

        ``frame`` is the time between two outputs [s], which has ``substeps`` steps (from the suggested time step if not
        given). Alternatively give only ``dt`` [s]. Further keywords are passed to PySPH's ``Solver``.
        """
        if kernel is not None:
            self.kernel = kernel
        if dt is None and frame is None:
            dt = self.time_step()
        if dt is None:
            if substeps is None:
                substeps = max(1, math.ceil(frame / self.time_step()))
            if not frame > 0.0:
                raise ValueError(f"frame must be > 0 s, got {frame} s")
            substeps = whole_number("substeps", substeps, low=1)
            dt = frame / substeps
            kw.setdefault("pfreq", substeps)
        if not (math.isfinite(dt) and dt > 0.0):
            raise ValueError(f"time step must be > 0 s, got {dt} s")
        self.dt = dt
        if "density" in self.effects:
            self.effects["density"].limits(self.scene(), dt)
        step = PBFStep if "density" in self.effects else PBFFrozenStep
        steppers = {name: step() for name in self.fluids}
        steppers.update(extra_steppers or {})
        self.integrator = (integrator_cls or PBFIntegrator)(**steppers)
        self.solver = StagedSolver(
            kernel=self.kernel, dim=self.dim, integrator=self.integrator, dt=dt, fixed_h=True, **kw)
        self.solver.set_reorder_freq(SORT_INTERVAL)
        self.solver.scratch = dict.fromkeys(self.fluids, frozenset(
            row.name for row in self.effect_rows("properties") if not row.state))
        self.solver.on_domain = self.enter_domain
        self.solver.reach = 1.0 + self.skin() / (self.kernel.radius_scale * self.hdx * self.spacing)

    def build_stages(self, terms: Sequence[Term], meter: Any = None) -> Any:
        """(built, conditions): the PySPH groups of each stage that has terms, and what each stage needs to run.

        ``built`` maps the name of a stage to its groups, in the order of the stages, and ``conditions`` to functions of
        the fluid arrays. ``meter`` is the work meter of the mechanical ledger.
        """
        scene = self.scene()
        limits = {"label_rounds": (1, EFFECTS["bubbles"][0].MAX_ROUNDS)}
        if "density" in self.effects:
            iterates = any(isinstance(term.equation, PBFSweepsLean) for term in terms)  # itself
            limits["sweeps"] = (1, 1) if iterates else self.sweep_limits()
        effect_hooks = {slot: effect.hooks(scene) for slot, effect in self.effects.items()}
        needs = {slot: effect.conditions(scene) for slot, effect in self.effects.items()}
        check_places(terms, effect_hooks, needs)

        def hooks(place, spec):
            if spec.refresh:
                yield GhostRefresh(self.ghosts, spec.refresh)
            for table in effect_hooks.values():
                if place in table:
                    yield lambda hook=table[place]: hook(self.arrays)

        options = dict(limits=limits, conditions={"short_step": lambda t, dt: self.arrays[0].prior[0] < 1.0},
                       hooks=hooks, tag=vector_tag(), apart=meter.apart if meter else {})
        built = {stage.name: build_stage(stage, terms, **options) for stage in STAGES}
        conditions = {}
        for table in needs.values():
            for name, needed in table.items():
                conditions.setdefault(name, []).append(needed)
        return {name: groups for name, groups in built.items() if groups}, conditions

    def heat_limits(self) -> Any:
        """(longest, largest): the longest stable heat step [s], and the largest change of enthalpy in it [J/kg]."""
        if "heat" not in self.effects:
            return math.inf, math.inf
        heat = self.effects["heat"]
        return heat.step_limit(self.scene()), heat.max_enthalpy_change * self.material.L

    def get_equations(self):
        scene, (terms, _) = self.scene(), self.built_terms()
        meter = WorkMeter(self.effects["mechanics"], scene, self.arrays) if "mechanics" in self.effects else None
        built, conditions = self.build_stages(terms, meter)
        heat_limit, step_limit = self.heat_limits()
        if self.integrator is None:
            raise RuntimeError("call configure_solver before get_equations")
        if hasattr(self.integrator, "plan"):
            self.integrator.plan(
                stages=list(built), arrays=[
                    (list(self.fluids), self.arrays), (self.sites, self.site_arrays),
                    (list(self.solids) if self.effect_rows("wall_properties") else [], self.wall_arrays)],
                ghosts=self.ghosts, pairs=self.pairs(), meter=meter, conditions=conditions,
                heat_limit=heat_limit, step_limit=step_limit, frozen="density" not in self.effects, skin=self.skin(),
                motion=self.effects["density"].limits(scene, self.dt) if "density" in self.effects else None,
                thermal_last="heat" in self.effects and self.effects["heat"].positions == "corrected",
                closing="oscillation" not in self.effects or self.effects["oscillation"].closing)
        for effect in self.effects.values():
            for sentence in effect.warnings(scene, self.dt):
                warnings.warn(sentence, stacklevel=2)
        return MultiStageEquations(list(built.values()))

    def setup_properties(self, particles, clean=True):
        """Give every array exactly the properties and constants that the effects need, and check the scene."""
        arrays, scene = self.give_names(particles), self.scene()
        fluid_rows = [*BASE_PROPERTIES, *self.effect_rows("properties")]
        for name in self.fluids:
            pa = arrays[name]
            self._give(pa, fluid_rows, clean)
            number(pa)
            constants = {}
            for effect in self.effects.values():
                constants.update(effect.constants(scene))
            if any(effect.removes_particles for effect in self.effects.values()):
                constants.update((f"carried_{row.name}", 0.0) for row in fluid_rows if row.cumulative)
            for constant, value in constants.items():
                if constant not in pa.constants:
                    pa.add_constant(constant, value)
        for name in self.solids:
            rows = self.effect_rows("wall_properties")
            self._give(arrays[name], [*WALL_PROPERTIES, *rows], clean)
            if rows:
                number(arrays[name])  # so that ghosts find what they are images of
        self.weigh(particles)
        for name in self.sites:
            rows = [row for row in BASE_PROPERTIES if row.name in ("x", "y", "z", "h", "m")]
            self._give(arrays[name], [*rows, *self.effect_rows("site_properties")], clean)
        self.check(particles)
        for effect in self.effects.values():
            effect.prepare(scene, arrays)

    def give_names(self, particles: Sequence[ParticleArray]) -> dict[str, ParticleArray]:
        """Name -> particle array, which is also stored; raises ``ValueError`` if one is missing, or empty everywhere.
        """
        self.given = arrays = {pa.name: pa for pa in particles}
        for name in [*self.fluids, *self.solids, *self.sites]:
            if name not in arrays:
                raise ValueError(f"the scheme names the particle array '{name}', but the scene has {sorted(arrays)}")
            if ranks.total(arrays[name].get_number_of_particles()) == 0:
                raise ValueError(f"particle array '{name}' is empty: it needs at least one particle")
        return arrays

    def weigh(self, particles: Sequence[ParticleArray]) -> None:
        """Correct the masses of several walls for each other, once: another scheme and other ranks keep theirs."""
        if len(self.solids) > 1 and not (self.hosted or self.shared):
            weigh_walls([pa for pa in particles if pa.name in self.solids], kernel=self.kernel, dim=self.dim)

    def enter_domain(self, domain: Any, particles: Sequence[ParticleArray]) -> None:
        """Adapt to the periodic ``domain`` of the solver, before the first step.

        Raises ``ValueError`` for a domain that is too short, or whose borders are closed by the container.
        """
        manager, scene = domain.manager, self.scene()
        container = self.effects.get("container")
        bounds = container.bounds(scene) if container else ((-math.inf,) * 3, (math.inf,) * 3)
        for k, axis in enumerate("xyz"):
            if not getattr(manager, f"periodic_in_{axis}"):
                continue
            ends = tuple(getattr(manager, f"{axis}{end}") for end in ("min", "max"))
            self.period[k] = ends[1] - ends[0]
            shortest = 2.0 * manager.cell_size
            if self.period[k] < shortest * (1.0 - 1e-9):
                raise ValueError(
                    f"the periodic domain must be at least {shortest:.4g} m long along {axis}, which is two supports "
                    f"of the largest particle, got {self.period[k]:.4g} m: particles would interact with two images of "
                    "another")
            if bounds[0][k] > ends[0] or bounds[1][k] < ends[1]:
                raise ValueError(f"container: the domain is periodic along {axis}, from {ends[0]:g} to {ends[1]:g} m, "
                                 f"but the container holds particles between {bounds[0][k]:g} and {bounds[1][k]:g} m: "
                                 "extend it beyond both ends")
        arrays = {pa.name: pa for pa in particles}
        if self.solids and not self.hosted:
            weigh_walls([arrays[name] for name in self.solids], kernel=self.kernel, dim=self.dim, domain=domain)
        for effect in self.effects.values() if not self.shared else ():
            effect.check(scene, arrays)

    def check(self, particles: Sequence[ParticleArray]) -> None:
        """Check arrays against the scheme; raises ``ValueError`` before anything is written."""
        arrays = {pa.name: pa for pa in particles}
        scene = self.scene()
        for name in self.fluids:
            pa = arrays[name]
            for prop in ("x", "y", "z", "u", "v", "w", "m", "h"):
                if not np.all(np.isfinite(pa.get(prop))):
                    raise ValueError(f"property '{prop}' of '{name}' holds NaN or Inf")
            if np.any(pa.m <= 0.0) or np.any(pa.h <= 0.0):
                raise ValueError(f"masses [kg] and smoothing lengths [m] of '{name}' must be > 0")
        for slot, effect in self.effects.items():
            if not self.shared:
                effect.check(scene, arrays)
            if self.material is not None:
                check_temperatures(effect, f"{slot}.{{}}".format, self.material)

    @staticmethod
    def _give(pa, rows, clean):
        names = {row.name for row in rows}
        if clean:
            for name in set(pa.properties) - names - set(PYSPH_PROPERTIES):
                pa.remove_property(name)
        add_properties(pa, rows)
        if clean:
            pa.set_output_arrays([row.name for row in rows if row.state] + ["gid", "pid", "tag"])

    # --- what was built -----------------------------------------------------------------------------------------------

    def tools(self) -> list[Tool]:
        """The PySPH tools of the effects, in the order in which they act after a step."""
        return [Guard(self), *(tool for effect in self.effects.values() for tool in effect.tools(self))]

    def describe(self) -> str:
        """Text with stages, groups, and the effect to which each equation belongs."""
        lines = [f"{type(self).__name__}: {', '.join(f'{slot}={effect!r}' for slot, effect in self.effects.items())}"]
        paper, ours = forms_in(self.effects)
        if paper or ours:
            lines.append(f"forms of the paper: {', '.join(paper) or 'none'}; our forms: {', '.join(ours) or 'none'}")
        terms, why = self.built_terms()
        for stage in STAGES:
            if not any(term.place.startswith(f"{stage.name}.") for term in terms):
                continue
            lines.append(f"stage {stage.name} ({stage.when})")
            for block in stage.blocks:
                for spec in block.groups:
                    here = [term for term in terms if term.place == f"{stage.name}.{spec.name}"]
                    if here:
                        lines.append(f"  {'*' if block.iterate else '-'} {spec.name}: {spec.meaning}")
                    for term in here:
                        sources = ", ".join(term.equation.sources or ()) or "itself"
                        lines.append(f"      {type(term.equation).__name__:<26} {term.equation.dest} <- {sources:<14} "
                                     f"for {term.owner}")
        lines.append("groups marked * repeat until they have converged")
        lines.append(f"lean sums are not used: {why}" if why else
                     "lean sums are used: the equations named ...Lean (--no-lean for general ones)")
        return "\n".join(lines)

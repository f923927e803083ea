"""The integrator: prediction, one neighbour search, the stages that the present state needs, velocity, and forces.

PySPH compiles ``PBFIntegrator.one_timestep`` as it is. The two generators in its loops decide which stages run and how
often, and they read the state between two stages.
"""
import math
from collections.abc import Iterable
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from compyle.profile import profile_ctx
from pysph.base.particle_array import ParticleArray
from pysph.solver.tools import Tool
from pysph.sph.integrator import Integrator
from pysph.sph.integrator_step import IntegratorStep

from pysph_boiling.names import whole_number
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import fill
from pysph_boiling.schemes.reductions import GENERAL

__all__ = ["HeatClock", "PBFFrozenStep", "PBFIntegrator", "PBFStep", "ThermalStages", "set_constant"]

SETTLED = 0.003  # largest density error [-] of the initial state at which settling ends
LISTED = tuple((axis, f"listed_{axis}") for axis in "xyz")  # positions, and those at the last search
MAX_SUBSTEPS = 1000  # largest number of parts of a step; more means that particles fly apart
MAX_SUBCYCLES = 100_000  # largest number of heat steps in a step; more means that the enthalpy diverges


def set_constant(pa, name, value):
    """Set a constant of a particle array on the host, and on the device if there is one."""
    pa.constants[name].get_npy_array()[:] = value
    if pa.gpu is not None:
        pa.gpu.push(name)


class PBFStep(IntegratorStep):
    """Prediction and velocity of Position Based Fluids.

    Source: Macklin & Müller 2013, Algorithm 1; the paper, Algorithm 1 lines 17, 18 and 38. The step keeps its
    displacement rather than the old position, so that a periodic wrap or a single-precision position does not enter
    the velocity.

    The multipliers of the step give those with which the next one begins, ``lmbda_start``. They are per dt^2, so that
    the length of the next step does not matter. With Lambda the sum of the multipliers of a step, and ' for the step
    before it, they are min(0, w (L + t (L - L'))), L = Lambda/dt^2, for ``warm_start`` = (w, t, 1). With a third number
    of 0, in a short step, they stay as they were: these multipliers can be those of a blow, not of a lasting pressure.

    Reads    d_au .. d_aw [m/s^2], d_impulse (Lambda) [kg m^2], constant ``warm_start`` [-].
    Writes   d_u .. d_w [m/s], d_x .. d_z, d_sx .. d_sz [m], d_impulse [kg m^2] (of the multipliers that are in the
    prediction), d_lmbda_start, d_lmbda_last (L) [J], own index only.
    """

    def stage1(self, d_idx, d_x, d_y, d_z, d_u, d_v, d_w, d_au, d_av, d_aw, d_sx, d_sy, d_sz, d_impulse, d_lmbda_start,
               dt):
        d_impulse[d_idx] = dt * dt * d_lmbda_start[d_idx]
        d_u[d_idx] += dt * d_au[d_idx]
        d_v[d_idx] += dt * d_av[d_idx]
        d_w[d_idx] += dt * d_aw[d_idx]
        d_sx[d_idx] = dt * d_u[d_idx]
        d_sy[d_idx] = dt * d_v[d_idx]
        d_sz[d_idx] = dt * d_w[d_idx]
        d_x[d_idx] += d_sx[d_idx]
        d_y[d_idx] += d_sy[d_idx]
        d_z[d_idx] += d_sz[d_idx]

    def stage2(self, d_idx, d_u, d_v, d_w, d_sx, d_sy, d_sz, d_impulse, d_lmbda_start, d_lmbda_last, d_warm_start, dt):
        d_u[d_idx] = d_sx[d_idx] / dt
        d_v[d_idx] = d_sy[d_idx] / dt
        d_w[d_idx] = d_sz[d_idx] / dt
        if d_warm_start[2] > 0.0:
            now = d_impulse[d_idx] / (dt * dt)
            d_lmbda_start[d_idx] = min(d_warm_start[0] * (now + d_warm_start[1] * (now - d_lmbda_last[d_idx])), 0.0)
            d_lmbda_last[d_idx] = now


class PBFFrozenStep(IntegratorStep):
    """Particles that do not move: heat and phases alone.

    Source: ours.   Reads nothing.   Writes nothing.
    """

    def stage1(self, d_idx, d_x):
        d_x[d_idx] += 0.0

    def stage2(self, d_idx, d_x):
        d_x[d_idx] += 0.0


@dataclass(frozen=True, kw_only=True)
class MotionLimits:
    """How far particles may move in a step, and how existing density errors are corrected.

    ``longest_step`` [s] is the longest step; ``distance`` [m] and ``push`` [m] are the largest displacements of a
    particle in one step by its velocity and by its acceleration; steps shorter than ``short_step`` [s] count as short;
    mean errors up to ``tolerance`` [-] are not corrected; ``settle`` is the largest number of passes of the density
    stage before the first step; ``warm_start`` are the share and the trend [-] that :class:`PBFStep` reads. Speeds are
    relative to the walls.
    """

    longest_step: float
    short_step: float
    tolerance: float
    distance: float
    push: float
    settle: int
    warm_start: tuple

    def substeps(self, arrays, dt, reductions=GENERAL):
        """Number of parts into which a step of ``dt`` [s] is split."""
        squares = [max(reductions.largest_square(pa, names) for pa in arrays)
                   for names in (("u", "v", "w"), ("au", "av", "aw"))]
        speed, acceleration = map(math.sqrt, ranks.largest(np.array(squares)))
        wanted = max(1.0, dt / self.longest_step - 1e-9, speed * dt / self.distance,
                     dt * math.sqrt(acceleration / self.push))
        if wanted > MAX_SUBSTEPS:
            raise ValueError(f"a step of {dt:.3g} s would be split into {wanted:.3g} parts, more than {MAX_SUBSTEPS}: "
                             f"the fastest particle has {speed:.3g} m/s, the largest acceleration is "
                             f"{acceleration:.3g} m/s^2")
        return math.ceil(wanted) if math.isfinite(wanted) else 1  # the guard reports NaN


class ThermalStages:
    """Decides which stages of heat, phases and bubbles a step needs, and how often, from the present state.

    ``heat_subcycles`` is the number of heat steps in the last step. ``reductions`` are general ones unless the solver
    sets others.
    """

    reductions = GENERAL
    heat_subcycles = 0

    def plan_thermal(self, *, stages, arrays, conditions, heat_limit, step_limit):
        """Set what the scheme has built.

        ``stages`` are the names in the order of the evaluators, and ``arrays`` the list of the fluid arrays.
        ``conditions`` maps a stage to functions of the fluid arrays, one of which must be true for the stage to run;
        without functions it always runs. ``heat_limit`` is the explicit limit of the heat step [s] and ``step_limit``
        the largest change of enthalpy in one heat step [J/kg].
        """
        self.stages = {name: index for index, name in enumerate(stages)}
        self.arrays, self.conditions = arrays, conditions
        self.heat_limit, self.step_limit = heat_limit, step_limit

    def thermal(self, dt):
        """Yields the stages of heat, phases and bubbles for a step of ``dt`` [s]."""
        if "heat" in self.stages:
            cycles = self.count_subcycles(dt)
            self.heat_subcycles += cycles
            for pa in self.arrays:
                set_constant(pa, "heat_dt", dt / cycles)
            for _ in range(cycles):
                yield self.stages["heat"]
        for name in ("phases", "dynamic_nucleation"):
            if self.needed(name):
                yield self.stages[name]
        if self.needed("bubbles"):
            yield self.stages["bubbles"]
            if any("relabel" in pa.constants and pa.relabel[0] > 0.0 for pa in self.arrays):
                yield self.stages["bubbles"]
                for pa in self.arrays:
                    set_constant(pa, "relabel", 0.0)

    def needed(self, name):
        """Whether the stage was built and the present state needs it."""
        if name not in self.stages:
            return False
        conditions = self.conditions.get(name, ())
        return not conditions or any(needed(self.arrays) for needed in conditions)

    def count_step(self):
        """Count a step in the constant ``steps`` of each array that has it."""
        for pa in self.arrays:
            if "steps" in pa.constants:
                set_constant(pa, "steps", pa.steps[0] + 1.0)

    def count_subcycles(self, dt):
        """Set the number of heat steps from the explicit limit and the largest change of enthalpy, ``step_limit``."""
        rate = ranks.largest(max(self.reductions.largest_size(pa, "ae") for pa in self.arrays))
        wanted = max(1.0, dt / self.heat_limit - 1e-9, rate * dt / self.step_limit - 1e-9)
        if not (math.isfinite(rate) and wanted <= MAX_SUBCYCLES):
            raise ValueError(f"a step of {dt:.3g} s would need {wanted:.3g} heat steps, more than {MAX_SUBCYCLES}: the "
                             f"explicit limit is {self.heat_limit:.3g} s and enthalpy changes by up to {rate:.3g} "
                             "J/(kg s)")
        return math.ceil(wanted)


class PBFIntegrator(ThermalStages, Integrator):
    """Runs the stages of a scheme in the order of :data:`pysph_boiling.schemes.stages.STAGES`.

    The scheme calls :meth:`plan` once. ``wall_time`` has the seconds per stage, ``runs`` the number of evaluations of
    each stage, and ``searches`` the number of neighbour searches. A step in which particles would move too far is
    split. Before the first step, passes of the density stage alone move apart particles that start too close to each
    other or to a wall, without giving them a velocity.
    """

    def plan(self, *, stages, arrays, ghosts, pairs, conditions=None, heat_limit=math.inf, step_limit=math.inf,
             frozen=False, skin=0.0, motion=None, meter=None, thermal_last=False, closing=True):
        """Set what the scheme has built.

        ``stages``, ``conditions``, ``heat_limit`` and ``step_limit`` are those of :meth:`plan_thermal`. ``arrays`` are
        pairs of names and a list that is filled with these arrays when the solver has them (also on a restart), first
        of the fluids. ``pairs`` are the (dest, source) names of the neighbour lists in use. ``skin`` is the distance by
        which neighbour lists reach farther than the support [m]. ``motion`` is a :class:`MotionLimits`, and ``meter``
        an optional :class:`~pysph_boiling.schemes.effects.mechanics.WorkMeter`.
        With ``thermal_last`` heat, phases and bubbles follow after the density sweeps, and ``closing`` says whether
        density sweeps follow after the oscillation.
        """
        self.plan_thermal(stages=stages, arrays=arrays[0][1], conditions=conditions or {}, heat_limit=heat_limit,
                          step_limit=step_limit)
        self.named, self.ghosts, self.pairs = arrays, ghosts, pairs
        self.frozen, self.skin, self.motion, self.meter = frozen, skin, motion, meter
        self.thermal_last, self.closing = thermal_last, closing
        self.searched, self.searches = False, 0
        self.wall_time = dict.fromkeys(("search", *stages), 0.0)
        self.runs = dict.fromkeys(stages, 0)

    def set_nnps(self, nnps):
        super().set_nnps(nnps)
        found = {pa.name: pa for pa in nnps.particles}
        for names, arrays in self.named:
            arrays[:] = [found[name] for name in names]
        self.ghosts.arrays = [pa for _, arrays in self.named for pa in arrays if "uid" in pa.properties]

    def update_domain(self):
        """Make the ghosts of a periodic domain, and find the size of cells, which our search finds itself."""
        if self.nnps.domain.manager.is_periodic or not hasattr(self.nnps, "lists"):
            super().update_domain()

    def initial_acceleration(self, t, dt):
        """Does nothing: a step starts with its prediction, and a resumed run must not evaluate a stage twice."""

    def step(self, time, dt):
        n, self.heat_subcycles = 1, 0
        if self.motion:
            if self.arrays[0].settled[0] == 0.0:
                self.settle()
            n = self.motion.substeps(self.arrays, dt, self.reductions)
            for pa in self.arrays:
                set_constant(pa, "substeps", (n, pa.substeps[1] + float(n > 1)))
                set_constant(pa, "sweeps", 0.0)
                set_constant(pa, "warm_start", (*self.motion.warm_start, float(dt / n >= self.motion.short_step)))
        for k in range(n):
            if self.meter:
                self.meter.begin(dt / n, short=dt / n < self.motion.short_step)
            super().step(time + k * dt / n, dt / n)

    def settle(self):
        """Run the density stage until the largest error is small, without counting safeguards that act."""
        for _ in range(self.motion.settle):
            self.update_domain()
            self.search()
            self.acceleration_evals[self.density()].compute(0.0, 0.0)  # the density terms do not depend on time
            if max(float(pa.density_error[1]) for pa in self.arrays) <= SETTLED:
                break
        for pa in self.arrays:
            set_constant(pa, "settled", 1.0)
            set_constant(pa, "first_sweeps", 0.0)  # the first step may need fewer
            for name in ("limited", "contacts", "projected"):
                if name in pa.properties:
                    fill(pa, name, 0)

    def one_timestep(self, t, dt):
        self.stage1()
        self.update_domain()
        for k in self.integrator.stages_at_prediction(dt):
            self.compute_accelerations(k, update_nnps=False)
        self.stage2()
        for k in self.integrator.stages_at_correction():
            self.compute_accelerations(k, update_nnps=False)
        self.do_post_stage(dt, 1)

    def compute_accelerations(self, index=0, update_nnps=True):
        start = perf_counter()
        if self.meter:
            self.meter.predicted()
        super().compute_accelerations(index, update_nnps)
        name = list(self.stages)[index]
        if self.meter:
            self.meter.mark(name)
        self.wall_time[name] += perf_counter() - start
        self.runs[name] += 1

    def stages_at_prediction(self, dt):
        """Yields the indices of the stages to run on the predicted positions, decided during the step."""
        self.search()
        self.count_step()
        self.part = dt
        if not self.thermal_last:
            yield from self.thermal(dt)
        if "density" in self.stages:
            yield self.density(dt)
            if "oscillation" in self.stages:
                yield from self.oscillation(dt)
            if dt < self.motion.short_step and self.motion.tolerance < max(float(pa.density_error[0])
                                                                         for pa in self.arrays):
                yield self.density()

    def density(self, dt=math.inf):
        """Index of the density stage for a step of ``dt`` [s]; its sweeps begin without acceleration.

        In a short step the sweeps do not correct an existing density error, since that would cause a velocity. Without
        ``dt`` they correct it without a velocity.
        """
        share = min(1.0, dt / self.motion.short_step)
        for pa in self.arrays:
            set_constant(pa, "prior", (float(share == 1.0), float(dt < math.inf), share))
            set_constant(pa, "sweeps", (0.0, pa.sweeps[1]))
            if "sweep_weight" in pa.constants:
                set_constant(pa, "sweep_weight", (1.0, math.inf, 0.0))
        return self.stages["density"]

    def oscillation(self, dt):
        """Yields the oscillation stage as often as it is needed, and then, if ``closing``, the density stage again."""
        for pa in self.arrays:
            set_constant(pa, "oscillation_dt", dt)
            set_constant(pa, "pushes", 0.0)
        while self.needed("oscillation"):
            yield self.stages["oscillation"]
        if self.closing and self.arrays[0].pushes[0] > 0.0:
            yield self.density(dt)

    def stages_at_correction(self):
        """Yields the indices of the stages to run on the corrected positions and the new velocities."""
        if self.thermal_last:
            self.ghosts.refresh(("rho",))
            yield from self.thermal(self.part)
        if "forces" in self.stages:
            started = ("lmbda_start",) if self.motion.warm_start[0] else ()
            self.ghosts.refresh(("u", "v", "w", *started, *(("impulse",) if self.meter else ())))
            yield self.stages["forces"]

    def search(self):
        """Search neighbours at x*; all lists that the stages read are built at once, from these positions.

        Lists with a skin are kept as long as they are valid.
        """
        start = perf_counter()
        kept = self.skin > 0.0 and self.lists_hold()
        if self.searched and (self.frozen or kept):
            self.wall_time["search"] += perf_counter() - start
            return
        if kept:  # a resumed run restores its lists
            self.exchange_positions()
        if self.parallel_manager:
            self.parallel_manager.update()  # particles move to their ranks, and ghosts are replaced
        with profile_ctx("nnps.update"):
            try:
                wrong = self.nnps.update()
            except FloatingPointError as error:
                wrong = str(error)
            wrong = ranks.first_given(wrong)  # all ranks stop, or none
            if wrong:
                raise FloatingPointError(wrong)
            names = [pa.name for pa in self.nnps.particles]
            for dest, source in self.pairs if getattr(self.nnps, "cache", None) else ():
                if self.arrays[0].gpu is not None:
                    self.nnps.get_nearest_particles_gpu(names.index(source), names.index(dest))
                else:
                    self.nnps.set_context(names.index(source), names.index(dest))
                    self.nnps.current_cache.find_all_neighbors()
        self.ghosts.search_done(self.parallel_manager)
        self.searched, self.searches = True, self.searches + 1
        if kept:
            self.exchange_positions()
        elif self.skin > 0.0:
            for pa in self.arrays:
                pa.place[:], pa.listed[0] = np.arange(len(pa.place)), len(pa.place)
                for here, there in LISTED:
                    pa.get(there)[:] = pa.get(here)
        self.wall_time["search"] += perf_counter() - start

    def lists_hold(self):
        """Whether all particles are within half the skin of their positions at the last search."""
        return all(len(pa.place) == pa.listed[0] and np.array_equal(pa.place, np.arange(len(pa.place))) and
                   np.max((pa.x - pa.listed_x)**2 + (pa.y - pa.listed_y)**2 + (pa.z - pa.listed_z)**2,
                          initial=0.0) <= 0.25 * self.skin**2 for pa in self.arrays)

    def exchange_positions(self):
        """Exchange the positions of the particles with those at the last search."""
        for pa in self.arrays:
            for here, there in LISTED:
                now = pa.get(here).copy()
                pa.get(here)[:] = pa.get(there)
                pa.get(there)[:] = now

    def forget_lists(self):
        """Make the next step search neighbours in any case."""
        self.searched = False
        for pa in self.arrays if self.skin > 0.0 else ():
            pa.listed[0] = -1.0


class HeatClock(Tool):
    """Sets ``heat_dt`` before each step, so that :class:`HeatUpdate` can be used in a scheme of PySPH.

    Return it from ``create_tools``. The arrays need the constant ``heat_dt`` when PySPH compiles, so add it in
    ``create_particles`` (see ``examples/heat_wave.py``). PySPH's initial evaluation before the first step then moves
    no heat. ``evaluations`` is the number of evaluations per step of the scheme's integrator (1 for PEC, 2 for EPEC).
    The time step must obey the explicit limit, :func:`pysph_boiling.schemes.effects.heat_step_limit`.
    """

    def __init__(self, arrays: Iterable[ParticleArray], evaluations: int = 1):
        self.arrays, self.evaluations = list(arrays), whole_number("evaluations", evaluations, low=1)
        for pa in self.arrays:
            if "heat_dt" not in pa.constants:
                raise ValueError(f"array '{pa.name}' has no constant heat_dt [s]: add it when the array is made")

    def pre_step(self, solver):
        for pa in self.arrays:
            set_constant(pa, "heat_dt", solver.dt / self.evaluations)

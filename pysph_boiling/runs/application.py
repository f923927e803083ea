"""SceneApplication: a PySPH ``Application`` that is a case, a test and a page.

A scene is a subclass with a frozen dataclass of parameters, ``make_scheme``, ``make_particles`` and ``check_final``.
Every parameter of the scene and of every effect is a command-line option. A run leaves PySPH's own particle files,
``results.npz``, ``run.json`` and pictures in its output folder.
"""
import dataclasses
import functools
import os
import platform
import re
import signal
import sys
import tempfile
import threading
import warnings
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime, timezone
from importlib import metadata
from pathlib import Path
from time import perf_counter

import numpy as np
from compyle.config import get_config
from pysph.base import kernels
from pysph.base.nnps import get_number_of_threads
from pysph.solver import application as pysph_application
from pysph.solver.application import Application
from pysph.solver.tools import Tool

from pysph_boiling.checks import CheckFailed, NotChecked, require
from pysph_boiling.device import on_host, real
from pysph_boiling.files import Manifest, last_output, output_files, run_record, step_of
from pysph_boiling.names import check_renamed, option
from pysph_boiling.parallel import ranks
from pysph_boiling.runs import pysph_options
from pysph_boiling.runs.ledger import Ledger, write_json
from pysph_boiling.runs.resume import Resumed, settings, with_units
from pysph_boiling.schemes.effects import check_parameters, check_temperatures, param
from pysph_boiling.schemes.effects.venting import VentingTool
from pysph_boiling.schemes.modes import MODES, effects_in_mode, widen_sites
from pysph_boiling.schemes.options import add_former_options
from pysph_boiling.schemes.quality import QUALITIES
from pysph_boiling.search import search_for

__all__ = ["SceneApplication", "SceneParameters", "processor", "upright_box"]

# Largest residuals [-] of a run that conserves. A sum of n numbers is rounded by up to n 1e-16 of it: 1e4 masses come
# back to 1e-12. Energy adds what moved in each step, 3e-14 measured over 3,000 steps; 5e-6 in single precision.
MASS_BOUND, ENERGY_BOUND, SINGLE_BOUND = 1e-12, 1e-10, 1e-4
MAX_STEPS = 1 << 31  # after which PySPH ends a run


@dataclass(frozen=True, kw_only=True)
class SceneParameters:
    """Parameters every scene has. Subclasses add their own with :func:`param`."""

    duration: float = param(1.0, "s", "simulated time", above=0.0, may_change=True)
    frame: float = param(1.0 / 30.0, "s", "time between two outputs", above=0.0, may_change=True)
    substeps: int = param(None, "-", "steps in a frame; as many as the suggested time step needs, if not given", low=1,
                          may_change=True)
    seed: int = param(0, "-", "seed of everything random", low=0)

    def __new__(cls, **given):
        check_renamed("scene", given, [spec.name for spec in dataclasses.fields(cls)])
        return super().__new__(cls)

    def __post_init__(self):
        check_parameters(self, "scene")


def upright_box(p, width, height):
    """Inner corners [m] of a box on the origin; ``width`` and ``height`` in spacings of the parameters ``p``."""
    size = [width * p.spacing] * 3
    size[p.dim - 1] = height * p.spacing
    return (0.0, 0.0, 0.0), tuple(size[:p.dim] + [0.0] * (3 - p.dim))


@contextmanager
def plain_warnings(console):
    """What is warned of inside the block is told at its end: each sentence once, without a path of Python's."""
    with warnings.catch_warnings(record=True) as told:
        try:
            yield
        finally:
            for sentence in dict.fromkeys(str(found.message) for found in told if found.category is UserWarning):
                console.print(f"note: {sentence}", markup=False)


class Stopped(KeyboardInterrupt):
    """Ctrl-C, between two steps; the message says where, and that the state is written."""


class Interrupt(Tool):
    """Turns Ctrl-C, while the block of ``with`` lasts, into :class:`Stopped` before the next step.

    Python raises ``KeyboardInterrupt`` wherever it is: within a step, whose state is no state to go on from, or in a
    callback of another library, which swallows it. A second Ctrl-C is Python's own. On several ranks all stop.
    """

    def __init__(self):
        self.asked = False

    def __enter__(self):
        ours = threading.current_thread() is threading.main_thread()
        self.before = signal.getsignal(signal.SIGINT) if ours else None
        if self.before is signal.default_int_handler:  # whoever ignores it, or has a handler, keeps that
            signal.signal(signal.SIGINT, self.ask)

    def __exit__(self, *error):
        if self.before is signal.default_int_handler:
            signal.signal(signal.SIGINT, self.before)

    def ask(self, number, frame):
        if self.asked:
            raise KeyboardInterrupt
        self.asked = True

    def pre_step(self, solver):
        if ranks.anywhere(self.asked):
            raise Stopped


class Dry(Tool):
    """Ends a run after the step, or at the start, in which there is no particle left in the fluid arrays."""

    def __init__(self, arrays, solver):
        self.arrays = arrays
        self.found = False
        self.look(solver, solver.count)

    def look(self, solver, steps):
        self.found = ranks.total(sum(real(pa) for pa in self.arrays)) == 0
        if self.found:
            solver.max_steps = steps

    def post_step(self, solver):
        self.look(solver, solver.count + 1)


class Progress(Tool):
    """A progress bar with the time left."""

    def __init__(self, solver, title, quiet):
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

        self.bar = Progress(TextColumn("{task.description}"), BarColumn(), TextColumn("t = {task.fields[now]:.3f} s"),
                            TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn(), refresh_per_second=2,
                            disable=quiet)
        self.task = self.bar.add_task(title, total=solver.tf - solver.t, now=solver.t)
        self.start = solver.t

    def post_step(self, solver):
        now = solver.t + solver.dt
        self.bar.update(self.task, completed=now - self.start, now=now)


def check_writable(folder):
    """Make a folder and see whether files can be made in it; ``OSError`` that names it if not."""
    try:
        os.makedirs(folder, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OSError(f"the output folder '{folder}' cannot be written to: {error.strerror}") from error


class SceneApplication(Application):
    """Base of all scenes.

    Subclasses set ``Parameters`` (a :class:`SceneParameters`), ``title``, optionally ``variants`` (name -> parameters
    that the switch ``--<name>`` sets), and override ``make_scheme(parameters)``, ``make_particles(parameters,
    scheme)``, ``check_final()`` and, for more than the common pictures, ``draw()``.
    """

    Parameters = SceneParameters
    title = "scene"
    variants: dict = {}
    pictures = ()  # that draw() makes besides the common ones

    # --- what a scene overrides ---------------------------------------------------------------------------------------

    def make_scheme(self, parameters):
        """The scheme of this scene."""
        raise TypeError(f"{type(self).__name__} must override make_scheme")

    def make_particles(self, parameters, scheme):
        """The particle arrays of this scene, before the scheme's properties are set up."""
        raise TypeError(f"{type(self).__name__} must override make_particles")

    def start(self, arrays, parameters, scheme):
        """Set the initial state on arrays that have all their properties."""

    def start_temperature(self, parameters):
        """Temperature [K] at the start, or (n,) of them, for ``--effects auto``; ``None`` in a scene without one."""
        return None

    def facts(self):
        """Scale factors and dimensionless numbers for the header and ``run.json``: name -> (value, unit)."""
        return {}

    def check_from(self, p):
        """Simulated time [s] from which :meth:`check_final` is made: that of the scene in this form, if not said."""
        return dataclasses.replace(self.Parameters(), **self.variants.get(self.options.variant, {})).duration

    def check_final(self):
        """Check what the scene must show: :class:`CheckFailed` with the figure that fails, or :class:`NotChecked`."""

    def check_needs(self, *slots):
        """Raise :class:`NotChecked` for an effect that the check is about, and that this run leaves out."""
        for slot in slots:
            if slot not in self.scheme.effects:
                raise NotChecked(f"it is about '{slot}', which this run leaves out")

    def measure(self, arrays, t):
        """What :meth:`check_final` needs of an output at the time ``t`` [s]; ``arrays``: name -> particle array."""
        return None

    def measured(self):
        """What :meth:`measure` gave at each output, in order of time; from memory where no files are written."""
        from pysph_boiling.analysis.rendering import load_output

        if not self.options.disable_output:
            return [self.measure(*moment) for moment in map(load_output, self.output_files)]
        if self.num_procs > 1:
            raise NotChecked("it needs the particles of all ranks, and no file was written")
        earlier = map(load_output, self.output_files) if self.resumed else ()
        return [*(self.measure(arrays, t) for arrays, t in earlier if t < min(self.measurements)),
                *self.measurements.values()]

    def check_ledger(self):
        """Check that every number of the results is finite, that no particle is lost, and that energy and mass close.

        Particles are counted, which is exact. Masses and energies are sums of many numbers, which are rounded.
        """
        results = self.ledger.table()
        require(all(np.all(np.isfinite(column)) for column in results.values()), "the results hold NaN or Inf")
        lost = self.ledger.lost(self.scheme.arrays)
        require(lost == 0, f"{lost} particles are lost")
        for name, bound in (("mass", MASS_BOUND),
                            ("energy", ENERGY_BOUND if double_precision(self.options) else SINGLE_BOUND)):
            worst = np.max(np.abs(results.get(f"{name}_residual", 0.0)), initial=0.0)
            require(worst <= bound, f"{name} does not close: residual {worst:.1e}, at most {bound:g}")

    def draw(self):
        """Pictures of the finished run; returns the paths."""
        from pysph_boiling.analysis.plots import plot_history
        from pysph_boiling.analysis.rendering import contact_sheet, render_run

        folder = Path(self.output_dir)
        made = []
        if len(self.ledger.rows):
            plot_history(self.ledger.table(), folder / "history.png", self.scheme.dim)
            made.append(folder / "history.png")
        frames = [] if self.options.disable_output else render_run(folder)
        if frames:
            contact_sheet(frames, folder / "frames.png")
            made += [folder / "frames.png", *frames]
        return made

    @property
    def departures(self):
        """Bubbles that left the base: list of (time [s], particles); empty in a scene without sites."""
        from pysph_boiling.schemes.bubbles import Departures

        return [event for tool in self.tools if isinstance(tool, Departures) for event in tool.events]

    @property
    def vents(self):
        """Bubbles that left through the surface: list of (time [s], particles); empty in a scene without venting."""
        return [event for tool in self.tools if isinstance(tool, VentingTool) for event in tool.events]

    def resolve(self, arguments):
        """Text of every parameter that command-line arguments lead to, those of the effects too; runs nothing."""
        self.set_args(list(arguments))
        self._parse_command_line(force=True)
        self.consume_user_options()
        self.configure_scheme()
        return "\n".join(map(repr, (self.parameters, *self.scheme.effects.values())))

    # --- PySPH's Application protocol ---------------------------------------------------------------------------------

    def __init__(self, fname=None, output_dir=None, domain=None):
        super().__init__(fname=fname or type(self).__module__.rsplit(".", 1)[-1], output_dir=output_dir, domain=domain)

    def initialize(self):
        if self.num_procs < ranks.launched():
            raise ValueError(f"started on {ranks.launched()} ranks, but MPI is not set up here: run 'make setup-mpi', "
                             "and start what it made (docs/ranks.md)")
        ranks.use(self.comm)
        self.parameters = self.Parameters()
        self.cache_nnps = True
        self.ledger = None
        self.measurements = {}  # t [s] -> what is measured there, where no files are written
        self.prepared = None
        self.resumed = None
        self.dry = None
        self.changes = []  # of parameters, where a run went on with others: dicts with t, parameter, before, after
        self.began = perf_counter(), 0

    def create_scheme(self):
        return self.make_scheme(self.parameters)

    def add_user_options(self, group):
        group.set_defaults(variant=None, zoltan_lb_method="RCB")  # ranks own boxes: the fewest ghosts
        variants = group.add_mutually_exclusive_group()
        for name in self.variants:
            variants.add_argument(f"--{name}", dest="variant", action="store_const", const=name, default=None,
                                  help=f"the scene's '{name}' form")
        for spec in dataclasses.fields(self.Parameters):
            meta = spec.metadata
            unit = "" if meta["unit"] == "-" else f" [{meta['unit']}]"
            name = f"scene.{spec.name}"
            group.add_argument(option(name), dest=name, type=spec.type, default=None, choices=meta["choices"],
                               metavar=None if meta["choices"] else spec.name.upper(),
                               help=f"{meta['meaning']}{unit}; default {spec.default}".replace("%", "%%"))
            add_former_options(group, name)
        group.add_argument("--mode", choices=tuple(MODES), default="dynamic",
                           help="model of boiling: " + "; ".join(
                               f"{name} ({row.source}), latent heat is stored {row.storage}" for name, row in
                               MODES.items()) + ". Default dynamic: the scene as it is")
        group.add_argument("--effects", choices=("scene", "auto"), default="scene",
                           help="the scene's own set of effects, or the set that its arrays call for; switches such as "
                                "--no-drag hold either way")
        group.add_argument("--quality", choices=tuple(QUALITIES), default=None,
                           help="time step and density sweeps of a preset, in place of the scene's own")
        group.add_argument("--results-every", dest="results_every", type=int, default=None,
                           help="steps between two rows of results.npz; each step, on a device each output")
        group.add_argument("--resume", action="store_true", default=False,
                           help="go on from the last particle file in the output folder, from the start if there is "
                                "none")
        group.add_argument("--no-pictures", dest="pictures", action="store_false", default=True,
                           help="no plots and pictures at the end")
        group.add_argument("--describe", action="store_true", default=False,
                           help="print stages, groups and who asked for them, and stop")

    def consume_user_options(self):
        given = dict(self.variants.get(self.options.variant, {}))
        for spec in dataclasses.fields(self.Parameters):
            value = getattr(self.options, f"scene.{spec.name}")
            if value is not None:
                given[spec.name] = value
        if self.options.final_time is not None:
            given["duration"] = self.options.final_time
        self.parameters = dataclasses.replace(self.Parameters(), **given)

    def configure_scheme(self):
        if self.prepared is not None:  # PySPH asks again once the output folder exists
            return
        options, p = self.options, self.parameters
        if options.results_every is not None and options.results_every < 1:
            raise ValueError(f"--results-every must be >= 1 step, got {options.results_every}")
        step = dict(frame=p.frame, substeps=p.substeps)
        if options.time_step is not None:
            if getattr(options, "scene.substeps") is not None:
                raise ValueError("--timestep and --substeps contradict each other")
            if not 0.0 < options.time_step < np.inf:
                raise ValueError(f"--timestep must be > 0 s, got {options.time_step} s")
            step = dict(dt=options.time_step, pfreq=max(1, round(p.frame / options.time_step)))
        self.scheme = self.make_scheme(p)
        self.scene_effects = dict(self.scheme.effects)  # as the parameters of the scene have them
        if self.scheme.material is not None:
            check_temperatures(p, option, self.scheme.material)
        if options.quality is not None:
            self.scheme.set_quality(options.quality)
        self.scheme.effects = effects_in_mode(options.mode, self.scheme.effects)
        self.scheme.consume_user_options(options)
        if options.effects == "auto":
            self.derive_effects(p)
        if options.kernel is not None:  # rest densities and walls must be those of the kernel that runs
            self.scheme.kernel = getattr(kernels, options.kernel)(dim=self.scheme.dim)
        self.scheme.configure_solver(tf=p.duration, **step)
        steps = p.duration / self.scheme.dt
        if steps > MAX_STEPS <= options.max_steps:
            raise ValueError(f"{p.duration:.3g} s in steps of {self.scheme.dt:.3g} s are {steps:.3g} steps, more than "
                             f"{MAX_STEPS}: take longer steps or frames, a shorter --duration, or --max-steps")
        if self.num_procs > 1:
            self.check_ranks()

    def _setup_parallel_manager_and_initial_load_balance(self):
        """PySPH's, with our manager in place of its own; it is asked for by a name of PySPH's module alone."""
        if self.num_procs > 1:
            from pysph_boiling.parallel.partition import Partition

            pysph_application.ZoltanParallelManagerGeometric = functools.partial(Partition, pairs=self.scheme.pairs())
        super()._setup_parallel_manager_and_initial_load_balance()

    def check_ranks(self):
        """Refuse what does not run on several ranks."""
        options, effects = self.options, self.scheme.effects
        alone = [slot for slot, effect in effects.items() if not effect.on_ranks]
        for bad, what in (
            (options.with_opencl or options.with_cuda, "--opencl and --cuda"),
            (options.reorder_freq, "--reorder-freq"),
            (self.scheme.skin() > 0.0, "density.skin > 0 (--quality reference has one; --density.skin 0 takes it off)"),
            (alone, f"the effect {', '.join(alone)}"),
        ):
            if bad:
                raise ValueError(f"on {self.num_procs} ranks this version cannot run {what}: run it on one")

    def derive_effects(self, p):
        """Replace the scene's set of effects by what its arrays call for; parameters and switches are kept."""
        effects, switches = self.scheme.effects, vars(self.options)
        without = MODES[self.options.mode].without
        asked = {slot: effects.get(slot) for slot in self.scheme.slots
                 if switches[f"{slot}.on"] is not None or slot in without}
        self.scheme.derive(self.make_particles(p, self.scheme), self.start_temperature(p), effects, asked)

    def create_particles(self):
        particles, self.prepared = self.prepared, None
        return particles

    def create_nnps(self):
        """Our neighbour search, if ``--nnps`` asks for it; the first rank compiles it. ``None``: PySPH makes one."""
        if on_device(self.options):
            return None
        if not pysph_options.asks_for_ours(self.options):
            if self.options.reorder_freq is None:
                self.solver.set_reorder_freq(0)  # PySPH's were not all made for it
            return None
        if ranks.rank() > 0:
            ranks.wait()
        found = search_for(self, say=self.solver.say)
        if ranks.rank() == 0:
            ranks.wait()
        return found

    def _prepare(self):
        """Make and check everything that can be wrong before a file or folder is made."""
        self.consume_user_options()
        self.configure_scheme()
        particles = self.make_particles(self.parameters, self.scheme)
        widen_sites(self.scheme, particles)
        self.scheme.setup_properties(particles)
        self.start({pa.name: pa for pa in particles}, self.parameters, self.scheme)
        self.scheme.check(particles)
        Ledger(self.scheme).check([pa for pa in particles if pa.name in self.scheme.fluids])
        self.prepared = particles

    def setup(self, argv=None):
        if argv is not None:
            self.set_args(argv)
        self._parse_command_line(force=argv is not None)
        restart = self.restart_file()
        if self.options.post_process is None:
            self._configure_global_config()
            self._prepare()
            if restart is not None:
                self.resumed = Resumed(restart, self, self.prepared)
                self.changes = self.resumed.changes
        if not self.options.disable_output:
            names = self.check_folder()
            ranks.wait()  # all have looked before the first one writes, and it has before the others begin their logs
            if ranks.rank() == 0:
                self.manifest.claim(*names)
            ranks.wait()
        # Ghosts are refreshed within a step: one layer of cells, as wide as the support, is all that they need.
        self.options.parallel_scale_factor = 1.0
        super().setup(argv=None)
        self.solver.set_output_fname(self.fname)  # one file for all ranks, named as for one

    def restart_file(self):
        """The particle file that the run goes on from, or ``None``; it is ours to read, and not PySPH's."""
        restart, self.options.restart_file = self.options.restart_file, None
        if restart is not None and not os.path.isfile(restart):
            raise FileNotFoundError(f"--restart-file: no file {restart}")
        if self.options.resume:
            if restart is not None:
                raise ValueError("--resume and --restart-file contradict each other")
            restart = last_output(self.options.output_dir)
        return restart

    def check_folder(self):
        """Refuse a folder with files of the user or of another scene in the way; the names of what will be written."""
        folder, fname = Path(self.options.output_dir), self.fname
        other = run_record(folder).get("scene", self.scene_name())
        if other != self.scene_name():
            raise ValueError(f"{folder} holds a run of {other}: give this one a folder of its own, with --directory")
        check_writable(folder)
        self.manifest = Manifest(folder)
        names = ["run.json", "results.npz", "profile_info.csv", *self.begun()]
        if self.options.pictures:
            names += ["history.png", "frames.png", *self.pictures]
        drawn = [r"frames/frame_\d{5}\.png"] if self.options.pictures else []
        self.manifest.refuse(*map(re.escape, ["MANIFEST", *names]), rf"{re.escape(fname)}_\d{{5,}}\.hdf5", *drawn)
        return names

    def begun(self):
        """Names of the files that PySPH has begun when the first step is taken: its summary, and its log."""
        log = self.options.logfile or f"{self.fname}.log"
        return [f"{self.fname}.info", *([log] if os.path.basename(log) == log else [])]

    def clear_folder(self, console):
        """Remove what an earlier run of this scene left in the folder, or what lies after the restart; say so."""
        on = self.resumed is not None and self.resumed.folder.resolve() == Path(self.output_dir).resolve()
        later = on and any(step_of(name) > self.resumed.count for name in self.manifest.known & set(
            self.manifest.found()))
        gone = self.manifest.remove(lambda name: name not in self.begun() and (
            self.resumed.later(name) and later if on else True))
        files = sum(step_of(name) >= 0 for name in gone)
        if gone:
            what = f"what came after t = {self.resumed.t:.4g} s" if on else "an earlier run of this scene"
            console.print(f"replaced {what} in {self.output_dir}: {files} particle files, {len(gone) - files} others",
                          markup=False)
        if not on:
            self.manifest.claim(*self.check_folder())

    @property
    def output_files(self):
        """Particle files of this run, in order of time."""
        return output_files(self.output_dir, self.fname)

    def _setup_argparse(self):
        super()._setup_argparse()
        pysph_options.settle(self.arg_parse)

    def _parse_command_line(self, force=False):
        if not hasattr(self, "options") or force:
            super()._parse_command_line(force)
            pysph_options.check(self.options)
            self.fname = self.options.fname
            self.quiet, self.options.quiet = self.options.quiet or ranks.rank() > 0, True  # what is said is ours

    def create_solver(self):
        solver = super().create_solver()
        if self.quiet:
            solver.say = lambda sentence: None
        return solver

    def create_tools(self):
        self.ledger = Ledger(self.scheme, every=self.results_every(),
                             path=None if self.options.disable_output else Path(self.output_dir) / "results.npz")
        tools = self.scheme.tools()
        if self.resumed is not None:
            self.resumed.apply(self.solver, self.ledger, tools)
        self.ledger.begin(self.scheme.arrays)
        self.solver.before_output = self.save
        self.progress, self.interrupt = Progress(self.solver, self.title, self.quiet), Interrupt()
        effects = self.scheme.effects.values()
        if any(effect.removes_particles for effect in effects) and "refill" not in self.scheme.effects:
            self.dry = Dry(self.scheme.arrays, self.solver)
        return [self.interrupt, *tools, self.ledger, self.progress, *([self.dry] if self.dry else [])]

    def results_every(self):
        """Steps between two rows of the results: a row reads whole properties, which a device fetches at outputs."""
        if self.options.results_every is not None:
            return self.options.results_every
        return self.solver.pfreq if on_device(self.options) else 1

    def save(self, completed=False):
        """Write the results so far: before each particle file, so that a run can go on from any of these."""
        if self.options.disable_output and self.num_procs == 1:
            with on_host(self.particles):
                self.measurements[self.solver.t] = self.measure({pa.name: pa for pa in self.particles}, self.solver.t)
        record = self.run_record(completed)
        if ranks.rank() == 0 and not self.options.disable_output:
            self.manifest.claim(f"{self.fname}_{self.solver.count:05d}.hdf5")
            self.ledger.save()
            write_json(Path(self.output_dir) / "run.json", record)

    def keep(self, error):
        """Write the rows of the steps that were done when ``error`` ended the run; it alone is what is told.

        On several ranks ``run.json`` asks all of them, so it is written only where all stop alike.
        """
        if self.options.disable_output:
            return
        with suppress(OSError):
            if ranks.size() == 1 or isinstance(error, FloatingPointError):
                self.save()
            elif ranks.rank() == 0:
                self.ledger.save()

    def run(self, argv=None):
        """Run, write results and pictures, and check the final state."""
        from rich.console import Console

        if argv is not None:
            self.set_args(argv)
        self._parse_command_line(force=argv is not None)
        console = Console(highlight=False, soft_wrap=True, quiet=self.quiet)  # what one rank says is enough
        if self.options.describe:
            self._prepare()
            console.print(self.scheme.describe(), markup=False)
            return
        with plain_warnings(console):
            self.simulate(console)
        first = ranks.rank() == 0
        if ranks.size() > 1:
            collect(self.particles)
            ranks.leave()
        if first:
            self.finish(console)

    def simulate(self, console):
        """Run to the end and write results."""
        self.setup()
        self.print_header(console)
        if not self.options.disable_output and ranks.rank() == 0:
            self.clear_folder(console)
        ranks.wait()
        self.began = perf_counter(), self.solver.count
        try:
            with self.progress.bar, self.interrupt:
                self.solve()
        except Stopped:
            self.ledger.finish()
            self.solver.dump_output()
            written = "" if self.options.disable_output else "; what is there is written: --resume goes on from it"
            raise Stopped(f"stopped at t = {self.solver.t:.4g} s{written}") from None
        except BaseException as error:
            self.keep(error)
            raise
        self.ledger.finish()
        self.save(completed=True)

    def finish(self, console):
        """The final check, a word on what was made and where, and pictures; raises :class:`CheckFailed` after them."""
        failed = None
        try:
            self.check(console)
        except CheckFailed as error:
            failed = error
        last = self.ledger.rows[-1] if self.ledger.rows else {}
        for name, sentence in (("n_split", "steps were split, since particles would have moved too far in them"),
                               ("n_unconverged", "steps ended with a mean density error above density.max_mean_error"),
                               ("n_limited", "position corrections were cut by the displacement limiter"),
                               ("n_projected", "times a particle was projected back into the container"),
                               ("n_clamped", "times the volume of a bubble was held")):
            if last.get(name):
                console.print(f"note: {last[name]:.0f} {sentence} ({self.solver.count} steps)")
        heat = np.max(self.ledger.table().get("heat_subcycles", 1.0), initial=1.0)
        if heat > 1.0:
            console.print(f"note: steps took up to {heat:.0f} heat steps")
        if "energy_residual" in last:
            console.print(f"ledger: energy residual {last['energy_residual']:.2e}, mass residual "
                          f"{last['mass_residual']:.2e}")
        if not self.options.disable_output:
            console.print(f"in {self.output_dir}: results.npz ({len(self.ledger.rows)} rows), run.json, "
                          f"{len(self.output_files)} particle files")
            for path in self.draw()[:2] if self.options.pictures else ():
                console.print(f"  look at {path}")
        if failed is not None:
            raise failed

    def check(self, console):
        """Check the ledger, and what the scene must show where the run can tell; say so where it cannot."""
        self.check_ledger()
        t, needed = self.solver.t, self.check_from(self.parameters)
        try:
            if self.dry is not None and self.dry.found:
                raise NotChecked(f"the vessel is dry, and the run ended at t = {t:.4g} s")
            if t < needed * (1.0 - 1e-9):
                raise NotChecked(f"the run ended at t = {t:.4g} s, and what it must show takes {needed:.4g} s")
            self.check_final()
        except NotChecked as why:
            console.print(f"final check not made: {why}", markup=False)

    def print_header(self, console):
        """What is about to run, with all scale factors."""
        scheme, solver = self.scheme, self.solver
        counts = ", ".join(f"{number} {name}" for name, number in self.counts().items())
        shared = f" on {ranks.size()} ranks" if ranks.size() > 1 else ""
        console.print(f"[bold]{self.title}[/bold]: {counts} particles{shared}, dt = {solver.dt * 1e3:.4g} ms, "
                      f"{int(np.ceil(max(self.parameters.duration - solver.t, 0.0) / solver.dt - 1e-9))} steps "
                      + (f"from t = {solver.t:.4g} s " if self.resumed is not None else "")
                      + f"to t = {self.parameters.duration} s")
        console.print("effects: " + ", ".join(scheme.effects))
        for change in self.resumed.new if self.resumed is not None else ():
            console.print(f"  from t = {change['t']:.4g} s on: {change['parameter']} = {change['after']} "
                          f"{change['unit']}, was {change['before']}", markup=False)
        heaters = scheme.effects["heater"].temperatures(
            scheme.scene(), {pa.name: pa for pa in self.particles}) if "heater" in scheme.effects else ()
        if len(heaters) > 1:
            console.print("heaters: " + ", ".join(f"{n} wall particles at {T:g} K" for T, n in heaters))
        for name, (value, unit) in self.facts().items():
            console.print(f"  {name} = {value:.4g}{'' if unit == '-' else ' ' + unit}")

    def scene_name(self):
        """The name of the scene: that of its module."""
        return type(self).__module__.rsplit(".", 1)[-1]

    @staticmethod
    def backend():
        """What computes: "cython", "openmp", "opencl" or "cuda"."""
        config = get_config()
        return "opencl" if config.use_opencl else "cuda" if config.use_cuda else \
            "openmp" if config.use_openmp else "cython"

    def recorded_parameters(self):
        """Parameters as ``run.json`` holds them; what an option of an effect has replaced says so (``replaced_by``)."""
        rows = with_units(self.parameters)
        for spec in dataclasses.fields(self.parameters):
            slot, _, name = (spec.metadata.get("sets") or "").partition(".")
            if slot in self.scene_effects:
                built = self.scheme.effects.get(slot)
                if built is None or getattr(built, name, None) != getattr(self.scene_effects[slot], name):
                    rows[spec.name]["replaced_by"] = option(f"no_{slot}" if built is None else slot)
        return rows

    def counts(self):
        """Particles of each array, on all ranks."""
        return {pa.name: int(ranks.total(pa.get_number_of_particles(True))) for pa in self.particles}

    def run_record(self, completed):
        """Everything needed to know how a run was made (design: results contract), as it goes into ``run.json``.

        ``completed``: it did all that it was asked to, which may be fewer steps than its duration (``--max-steps``) or
        end with the last drop; not where an error or Ctrl-C ended it.
        """
        scheme, options, backend = self.scheme, self.options, self.backend()
        return {
            "scene": self.scene_name(),
            "command": " ".join([os.path.basename(sys.argv[0]), *sys.argv[1:]]),
            "arguments": list(self.args),
            "completed": completed,
            **origin(),
            **{name: setting.value for name, setting in settings(self)[1].items()},
            "precision": "double" if double_precision(options) else "single",
            "threads": get_number_of_threads() if backend == "openmp" else 1,
            "ranks": self.num_procs,
            "communication": {"unit": "particles, B, B", **{name: int(ranks.total(getattr(scheme.ghosts, name)))
                                                            for name in ("exported", "copied", "refreshed")}},
            "seed": self.parameters.seed,
            "mode": options.mode,
            "quality": options.quality or "scene",
            "steps": self.solver.count,
            "particles": self.counts(),
            "parameters": self.recorded_parameters(),
            "effects": {slot: {"class": type(effect).__name__, **with_units(effect)}
                        for slot, effect in scheme.effects.items()},
            "facts": {name: {"value": value, "unit": unit} for name, (value, unit) in self.facts().items()},
            "wall_time": {"unit": "s", **scheme.integrator.wall_time},
            "timed": {"steps": self.solver.count - self.began[1], "seconds": perf_counter() - self.began[0]},
            "departures": self.departures,
            "vents": self.vents,
            "changes": self.changes,
        }


def collect(arrays):
    """Bring the particles of all ranks to the first one, as if it had run alone. The others keep theirs."""
    for pa in arrays:
        n = pa.get_number_of_particles(True)
        pa.remove_particles(np.arange(n, pa.get_number_of_particles()))
        parts = {name: ranks.gather(pa.get(name))[0] for name in sorted(pa.properties)}
        if ranks.rank() == 0:
            pa.extend(len(parts["x"]) - n)
            for name, values in parts.items():
                pa.get(name, only_real_particles=False)[:] = values
            pa.align_particles()


def on_device(options):
    """Whether a run of these options is one on a device."""
    return options.with_opencl or options.with_cuda


def double_precision(options):
    """Whether a run of these options computes in double precision."""
    return options.use_double or not on_device(options)


def origin():
    """Where, when and with what a run was made: ``versions``, ``machine``, ``processor``, ``finished``."""
    return {"versions": versions(), "machine": f"{platform.machine()} {platform.system()}, {os.cpu_count()} cores",
            "processor": processor(), "finished": datetime.now(timezone.utc).isoformat(timespec="seconds")}


@functools.cache
def versions():
    """Name -> version of Python and of the packages that a run is made with; asked once, since it takes 20 ms."""
    found = {"python": platform.python_version()}
    for name in ("pysph_boiling", "pysph", "compyle", "numpy", "cython"):
        with suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found


@functools.cache
def processor():
    """Model of the processor, as far as the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")),
                platform.processor())

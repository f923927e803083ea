"""SceneApplication: the PySPH ``Application`` that all scenes derive from.

A scene is a subclass with a frozen dataclass of parameters, ``make_scheme``, ``make_particles`` and ``check_final``.
Every parameter of the scene and of every effect is a command-line option. A run writes PySPH's particle files,
``results.npz``, ``run.json`` and pictures to its output folder.
"""
import dataclasses
import functools
import os
import re
import sys
import tempfile
import textwrap
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import numpy as np
from compyle.config import get_config
from pysph.base import kernels
from pysph.base.nnps import get_number_of_threads
from pysph.solver import application as pysph_application
from pysph.solver.application import Application

from pysph_boiling.checks import CheckFailed, NotChecked, require
from pysph_boiling.device import on_host
from pysph_boiling.files import (
    Manifest,
    folder_of_run,
    last_output,
    load_output,
    output_files,
    output_time,
    part_of,
    run_record,
    step_of,
)
from pysph_boiling.materials import WATER_1ATM, in_proportion
from pysph_boiling.names import check_renamed, option, scene_name
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import number, portion, rows
from pysph_boiling.runs import pysph_options, safeguards
from pysph_boiling.runs.ledger import Ledger, write_json
from pysph_boiling.runs.progress import Dry, Interrupt, Progress, Stopped, plain_warnings
from pysph_boiling.runs.provenance import origin
from pysph_boiling.runs.resume import Resumed, scheme_settings, with_units
from pysph_boiling.runs.scene_file import effect_changes, effects_from, parameters_from, scene_text
from pysph_boiling.schemes.effects import Heater, check_parameters, check_temperatures, param
from pysph_boiling.schemes.effects.venting import VentingTool
from pysph_boiling.schemes.forms import FORMS, chosen, forms_in
from pysph_boiling.schemes.looks import LOOKS, effects_in_look, parameters_in_look
from pysph_boiling.schemes.modes import MODES, effects_in_mode, widen_sites
from pysph_boiling.schemes.options import add_former_options, add_material_options, chosen_material, described
from pysph_boiling.schemes.quality import QUALITIES
from pysph_boiling.search import search_for

__all__ = ["SceneApplication", "SceneParameters", "upright_box"]

# Largest residuals [-] of a run that conserves mass and energy. The rounding error of a sum of n numbers is up to
# n 1e-16, so 1e4 masses add up to within 1e-12. The energy residual also has the rounding of each step's flows: 3e-14
# measured over 3,000 steps, and 5e-6 in single precision.
MASS_BOUND, ENERGY_BOUND, SINGLE_BOUND = 1e-12, 1e-10, 1e-4
COLUMNS = 98  # of printed lines
MAX_STEPS = 1 << 31  # after which PySPH ends a run


@dataclass(frozen=True, kw_only=True)
class SceneParameters:
    """The parameters that every scene has. Subclasses add their own with :func:`param`."""

    duration: float = param(1.0, "s", "simulated time", above=0.0, may_change=True)
    frame: float = param(1.0 / 30.0, "s", "time between two outputs", above=0.0, may_change=True)
    substeps: int = param(None, "-", "time steps between two outputs; from the suggested time step if not given", low=1,
                          may_change=True)
    seed: int = param(0, "-", "seed of all random numbers", low=0)

    def __new__(cls, **given):
        check_renamed("scene", given, [spec.name for spec in dataclasses.fields(cls)])
        return super().__new__(cls)

    def __post_init__(self):
        check_parameters(self, "scene")


def upright_box(p, width, height):
    """Inner corners [m] of a box with its lower corner at the origin; ``width`` and ``height`` are in spacings."""
    size = [width * p.spacing] * 3
    size[p.dim - 1] = height * p.spacing
    return (0.0, 0.0, 0.0), tuple(size[:p.dim] + [0.0] * (3 - p.dim))


def base_heater(p, material):
    """The slot and effect of a heated base, ``p.base_superheat`` [K] above saturation; empty if it is 0 or missing."""
    superheat = getattr(p, "base_superheat", 0.0)
    return dict(heater=Heater(temperature=material.T_sat + superheat)) if superheat else {}


def check_writable(folder):
    """Make a folder and check that files can be made in it; raises ``OSError`` that names it if not."""
    try:
        os.makedirs(folder, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OSError(f"the output folder '{folder}' cannot be written to: {error.strerror}") from error


class SceneApplication(Application):
    """Base class of all scenes.

    Subclasses set ``Parameters`` (a :class:`SceneParameters`), ``title`` and optionally ``variants`` (name ->
    parameters that the switch ``--<name>`` sets) and ``material``, the fluid for which both are tuned. In their methods
    ``self.material`` is the fluid of the run, which ``--material`` may have changed. They override
    ``make_scheme(parameters)``, ``make_particles(parameters, scheme)``, ``check_final()`` and, to draw more than the
    common pictures, ``draw()``.
    """

    Parameters = SceneParameters
    title = ""  # the scene's name if it is empty
    variants: dict = {}
    material = WATER_1ATM
    pictures = ()  # names of the files that draw() makes besides the common ones

    # --- what a scene overrides ---------------------------------------------------------------------------------------

    def make_scheme(self, parameters):
        """Return the scheme of this scene."""
        raise TypeError(f"{type(self).__name__} must override make_scheme")

    def make_particles(self, parameters, scheme):
        """Return the list of particle arrays of this scene; the scheme adds its properties afterwards."""
        raise TypeError(f"{type(self).__name__} must override make_particles")

    def start(self, arrays, parameters, scheme):
        """Set the initial state of the arrays, which now have all their properties."""

    def start_temperature(self, parameters):
        """Initial temperature [K], a number or (n,), for ``--effects auto``; ``None`` in a scene without heat."""
        return None

    def in_proportion(self, value, law):
        """A ``value`` that was tuned for the scene's own fluid, for that of this run: in proportion to a law."""
        return in_proportion(value, law, type(self).material, self.material)

    def facts(self):
        """Scale factors and dimensionless numbers for the header and ``run.json``: name -> (value, unit)."""
        return {}

    def check_from(self, p):
        """Simulated time [s] that :meth:`check_final` needs; by default the scene's duration in the chosen variant."""
        return dataclasses.replace(self.Parameters(), **self.variants.get(self.options.variant, {})).duration

    def check_final(self):
        """Check the result of the scene; raises :class:`CheckFailed` with the value that fails, or :class:`NotChecked`.
        """

    def at_end(self):
        """What the final check needs of the particles, as a dict; all ranks call it together.

        ``lost`` is the number of particles that are missing, and ``fluid`` that of fluid particles.
        """
        return {"lost": self.ledger.lost(self.scheme.arrays),
                "fluid": sum(n for name, n in self.counts().items() if name in self.scheme.fluids)}

    @property
    def final(self):
        """The result of :meth:`at_end`: that of all ranks, which part before the final check."""
        return self.at_end() if self.found_at_end is None else self.found_at_end

    def check_needs(self, *slots):
        """Raise :class:`NotChecked` if this run leaves out one of the effects that the check is about."""
        for slot in slots:
            if slot not in self.scheme.effects:
                raise NotChecked(f"it needs the effect '{slot}', which this run leaves out")

    def measure(self, arrays, t):
        """Return what :meth:`check_final` needs of the output at time ``t`` [s]; ``arrays`` is name -> particle array.
        """
        return None

    def measured(self):
        """The results of :meth:`measure` at each output, in order of time; from memory if no files are written."""
        if not self.options.disable_output:
            return [self.measure(*moment) for moment in map(load_output, self.output_files)]
        if self.num_procs > 1:
            raise NotChecked("it needs the particles of all ranks, but no particle files were written")
        earlier = map(load_output, self.output_files) if self.resumed else ()
        return [*(self.measure(arrays, t) for arrays, t in earlier if t < min(self.measurements)),
                *self.measurements.values()]

    def check_ledger(self):
        """Check that all results are finite, that no particle is lost, and that energy and mass are conserved.

        The number of particles must be exact. Masses and energies are sums, so they may differ by rounding.
        """
        results = self.ledger.table()
        require(all(np.all(np.isfinite(column)) for column in results.values()), "the results hold NaN or Inf")
        lost = self.final["lost"]
        require(lost == 0, f"{lost} particles are lost")
        for name, bound in (("mass", MASS_BOUND),
                            ("energy", ENERGY_BOUND if double_precision(self.options) else SINGLE_BOUND)):
            worst = np.max(np.abs(results.get(f"{name}_residual", 0.0)), initial=0.0)
            require(worst <= bound, f"{name} is not conserved: its residual is {worst:.1e}, above {bound:g}")

    def draw(self):
        """Draw the pictures of the finished run; returns their paths."""
        from rich.progress import track

        from pysph_boiling.analysis.plots import plot_history
        from pysph_boiling.analysis.rendering import contact_sheet, render_run

        folder = Path(self.output_dir)
        made = []
        if len(self.ledger.rows):
            plot_history(self.ledger.table(), folder / "history.png", self.scheme.dim)
            made.append(folder / "history.png")
        bar = functools.partial(track, description="drawing", transient=True,
                                disable=self.quiet or not sys.stdout.isatty())
        frames = [] if self.options.disable_output else render_run(folder, track=bar)
        if frames:
            contact_sheet(frames, folder / "frames.png")
            made += [folder / "frames.png", *self.draw_water(), *frames]
        return made

    def draw_water(self):
        """Draw ``surface.png``, the moment with most vapour as clear water; returns its path in a list.

        The list is empty in 2-D, and without the packages of the extra "view".
        """
        from pysph_boiling.analysis.surface import draw_surface, surface_missing

        if self.scheme.dim != 3 or surface_missing():
            return []
        files, table = self.output_files, self.ledger.table()
        moment = len(files) // 2
        if np.any(table.get("n_vapour", 0.0)):
            most = table["t"][np.argmax(table["n_vapour"])]
            moment = np.argmin([abs(output_time(file) - most) for file in files])
        arrays, t = load_output(files[moment])
        path = Path(self.output_dir) / "surface.png"
        return [draw_surface(arrays, path, dim=3, spacing=self.scheme.spacing, t=t, title=self.title, size=(800, 600))]

    @property
    def departures(self):
        """Bubbles that departed from the base: list of (time [s], particles, site); empty in a scene without sites."""
        from pysph_boiling.schemes.bubbles import Departures

        return [event for tool in self.tools if isinstance(tool, Departures) for event in tool.events]

    @property
    def vents(self):
        """Bubbles that left through the surface: list of (time [s], particles); empty in a scene without venting."""
        return [event for tool in self.tools if isinstance(tool, VentingTool) for event in tool.events]

    def scene_content(self):
        """The content of a scene file that makes this run: this scene, its parameters, and the effects that differ."""
        given = {spec.name: getattr(self.parameters, spec.name) for spec in dataclasses.fields(self.parameters)}
        changed = effect_changes(self.scene_effects, self.scheme.effects)
        return {"scene": self.scene_name(), "parameters": {name: v for name, v in given.items() if v is not None},
                **({"effects": changed} if changed else {})}

    def write_scene(self, path):
        """Write :meth:`scene_content` to a new file; raises ``FileExistsError`` if there is one."""
        meant = {}
        for prefix, one in (("", self.parameters), ("parameters.", self.parameters),
                            *((f"effects.{slot}.", effect) for slot, effect in self.scheme.effects.items())):
            for spec in dataclasses.fields(one):
                if "unit" in spec.metadata:
                    unit = "" if spec.metadata["unit"] == "-" else f" [{spec.metadata['unit']}]"
                    meant[prefix + spec.name] = spec.metadata["meaning"] + unit
        fluid = {name: value for name in ("material", "pressure") if (value := getattr(self.options, name)) is not None}
        with open(path, "x", encoding="utf-8") as file:
            file.write(scene_text(fluid | self.scene_content(), meant))

    def settings_of_scene(self):
        """Parts of the scene's description that must not change when a run is resumed: name -> value."""
        return {}

    def resolve(self, arguments):
        """Text with all parameters of scene and effects that follow from command-line arguments; runs nothing."""
        self.set_args(list(arguments))
        self._parse_command_line(force=True)
        self.consume_user_options()
        self.configure_scheme()
        return "\n".join(map(repr, (self.parameters, *self.scheme.effects.values())))

    # --- PySPH's Application protocol ---------------------------------------------------------------------------------

    def __init__(self, fname=None, output_dir=None, domain=None, file=None):
        self.file = file  # the SceneFile that this scene was read from, or None
        if file is not None:
            fname, self.title = fname or file.name, file.name
        super().__init__(fname=fname or scene_name(type(self)), output_dir=output_dir, domain=domain)

    def initialize(self):
        self.title = self.title or self.scene_name().replace("_", " ")
        if self.num_procs < ranks.launched():
            raise ValueError(f"started on {ranks.launched()} ranks, but MPI is not set up here: run 'make setup-mpi' "
                             "and use the environment that it makes (docs/ranks.md)")
        ranks.use(self.comm)
        self.parameters, self.laws = self.Parameters(), {}
        self.cache_nnps = True
        self.ledger = None
        self.measurements = {}  # t [s] -> what is measured there, where no files are written
        self.prepared = self.found_at_end = None
        self.resumed = None
        self.dry = None
        self.changes = []  # of parameters when the run was resumed: dicts with t, parameter, before, after
        self.began, self.ended = (0, perf_counter()), None

    def create_scheme(self):
        return self.make_scheme(self.parameters)

    def add_user_options(self, group):
        group.set_defaults(variant=None, zoltan_lb_method="RCB")  # ranks own boxes, which gives the fewest ghosts
        variants = group.add_mutually_exclusive_group()
        for name, given in self.variants.items():
            sets = ", ".join(f"{option(f'scene.{parameter}')} {value}" for parameter, value in given.items())
            variants.add_argument(f"--{name}", dest="variant", action="store_const", const=name, default=None,
                                  help=f"sets {sets}")
        for spec in dataclasses.fields(self.Parameters):
            meta, name = spec.metadata, f"scene.{spec.name}"
            group.add_argument(option(name), dest=name, type=spec.type, default=None, choices=meta["choices"],
                               metavar=None if meta["choices"] else spec.name.upper(),
                               help=described(meta, spec.default))
            add_former_options(group, name)
        add_material_options(group)
        group.add_argument("--mode", choices=tuple(MODES), default="dynamic",
                           help="model of boiling: " + "; ".join(
                               f"{name} ({row.source}), which stores latent heat {row.storage}" for name, row in
                               MODES.items()) + ". The default, dynamic, leaves the scene as it is")
        group.add_argument("--look", choices=tuple(LOOKS), default=None,
                           help="how a boil over sites looks (docs/looks.md); other options override it")
        group.add_argument("--forms", default="ours", metavar="ours|paper|NAME,...",
                           help="forms of the effects: ours (default), the paper's own, or the paper's for some: "
                                f"{', '.join(FORMS)} (schemes/forms.py). Other options override them")
        group.add_argument("--effects", choices=("scene", "auto"), default="scene",
                           help="scene: the scene's own set of effects (default); auto: choose the effects from the "
                                "scene's arrays. Switches such as --no-drag work with both")
        group.add_argument("--quality", choices=tuple(QUALITIES), default=None,
                           help="use the time step and density sweeps of this preset instead of the scene's own")
        group.add_argument("--results-every", dest="results_every", type=int, default=None,
                           help="steps between two rows of results.npz; default 1, on a device one row per output")
        group.add_argument("--resume", action="store_true", default=False,
                           help="resume from the last particle file in the output folder; start from the beginning if "
                                "there is none")
        group.add_argument("--no-pictures", dest="pictures", action="store_false", default=True,
                           help="draw no plots and pictures at the end")
        group.add_argument("--describe", action="store_true", default=False,
                           help="print the stages and groups of a time step and the effects behind them, then stop")
        group.add_argument("--write-scene", dest="write_scene", default=None, metavar="FILE",
                           help="write this scene as a TOML file, which 'pysph-boiling run FILE' runs, then stop")

    def consume_user_options(self):
        self.laws = {}  # parameter -> law, of those that follow from the fluid
        given = parameters_from(self.file, self.Parameters) if self.file else {}
        own = set(given)  # as they are, whatever the fluid
        if self.file and self.options.material is None and self.options.pressure is None:
            self.options.material, self.options.pressure = self.file.material, self.file.pressure
        self.material = chosen_material(self.options, type(self).material)
        given |= self.variants.get(self.options.variant, {})
        if self.options.look is not None:
            given |= parameters_in_look(self.options.look, [spec.name for spec in dataclasses.fields(self.Parameters)])
        for spec in dataclasses.fields(self.Parameters):
            value, law = getattr(self.options, f"scene.{spec.name}"), spec.metadata.get("law")
            if value is not None:
                given[spec.name] = value
            elif law and spec.name not in own and self.material != type(self).material:
                given[spec.name] = self.in_proportion(given.get(spec.name, spec.default), law)
                if given[spec.name]:
                    self.laws[spec.name] = law
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
        self.check_material()
        if self.file is not None:
            self.scheme.effects = effects_from(self.file, self.scheme.effects, self.scheme.slots)
        self.scene_effects = dict(self.scheme.effects)  # as the parameters of the scene have them
        if self.scheme.material is not None:
            check_temperatures(p, option, self.scheme.material)
        if options.quality is not None:
            self.scheme.set_quality(options.quality)
        if options.look is not None:
            self.scheme.effects = effects_in_look(options.look, self.scheme.effects)
        self.scheme.effects = effects_in_mode(options.mode, self.scheme.effects)
        self.scheme.consume_user_options(options)
        if options.effects == "auto":
            self.derive_effects(p)
        self.use_forms(p)
        if options.kernel is not None:  # rest densities and wall masses depend on the kernel
            self.scheme.kernel = getattr(kernels, options.kernel)(dim=self.scheme.dim)
        self.scheme.configure_solver(tf=p.duration, **step)
        steps = p.duration / self.scheme.dt
        if steps > MAX_STEPS <= options.max_steps:
            raise ValueError(f"{p.duration:.3g} s in steps of {self.scheme.dt:.3g} s are {steps:.3g} steps, more than "
                             f"{MAX_STEPS}: use longer steps or frames, a shorter --duration, or --max-steps")
        if self.num_procs > 1:
            self.check_ranks()

    def check_material(self):
        """Raise ``ValueError`` if a fluid is asked for that the scheme of this scene does not have."""
        if self.material not in (type(self).material, self.scheme.material):
            raise ValueError(f"{self.scene_name()} cannot have another --material or --pressure: " + (
                "it computes motion alone" if self.scheme.material is None else
                f"its make_scheme gives the scheme {self.scheme.material.name}, not self.material"))

    def _setup_parallel_manager_and_initial_load_balance(self):
        """PySPH's method with our parallel manager; PySPH looks its manager up by a name in its own module."""
        if self.num_procs > 1:
            from pysph_boiling.parallel.partition import Partition

            pysph_application.ZoltanParallelManagerGeometric = functools.partial(
                Partition, pairs=self.scheme.pairs(), moving=self.scheme.fluids)
        super()._setup_parallel_manager_and_initial_load_balance()

    def check_ranks(self):
        """Raise ``ValueError`` for options and effects that do not work on several ranks."""
        options, effects = self.options, self.scheme.effects
        alone = [slot for slot, effect in effects.items() if not effect.on_ranks]
        for bad, what in (
            (options.with_opencl or options.with_cuda, "--opencl and --cuda"),
            (options.reorder_freq, "--reorder-freq"),
            (self.scheme.skin() > 0.0, "density.skin > 0 (--quality reference sets it; --density.skin 0 unsets it)"),
            (alone, f"the effect {', '.join(alone)}"),
        ):
            if bad:
                raise ValueError(f"this version cannot run {what} on {self.num_procs} ranks: use one rank")

    def use_forms(self, p):
        """Give the effects the forms of the paper that are asked for, but keep what other options say."""
        if not chosen(self.options.forms):
            return
        self.scheme.set_forms(self.options.forms)
        for spec in dataclasses.fields(p):
            slot, _, name = (spec.metadata.get("sets") or "").partition(".")
            if slot in self.scheme.effects and getattr(self.options, f"scene.{spec.name}") is not None:
                given = {name: getattr(self.scene_effects[slot], name)}
                self.scheme.effects[slot] = self.scheme.effects[slot].replaced(**given)
        self.scheme.consume_user_options(self.options)

    def derive_effects(self, p):
        """Choose the effects from the scene's arrays instead of its own set; parameters and switches are kept."""
        effects, switches = self.scheme.effects, vars(self.options)
        without = [*MODES[self.options.mode].without,
                   *(slot for name in chosen(self.options.forms) for slot in FORMS[name].without)]
        asked = {slot: effects.get(slot) for slot in self.scheme.slots
                 if switches[f"{slot}.on"] is not None or slot in without}
        self.scheme.derive(self.make_particles(p, self.scheme), self.start_temperature(p), effects, asked)

    def create_particles(self):
        particles, self.prepared = self.prepared, None
        return particles

    def _create_particles(self, particle_factory, *args, **kw):
        """PySPH's method, which makes all particles on the first rank; here each rank has made its own share."""
        if self.num_procs == 1:
            super()._create_particles(particle_factory, *args, **kw)
        else:
            self.particles = particle_factory(*args, **kw)

    def create_nnps(self):
        """Our neighbour search if ``--nnps`` names it, compiled by the first rank; ``None`` lets PySPH make its own."""
        if not pysph_options.asks_for_ours(self.options):
            if self.options.reorder_freq is None:
                self.solver.set_reorder_freq(0)  # not all of PySPH's searches support it
            return None
        if ranks.rank() > 0:
            ranks.wait()
        found = search_for(self, say=self.solver.say)
        if ranks.rank() == 0:
            ranks.wait()
        return found

    def _prepare(self):
        """Make and check everything that may be wrong before any file or folder is made."""
        self.consume_user_options()
        self.configure_scheme()
        particles = self.make_particles(self.parameters, self.scheme)
        widen_sites(self.scheme, particles)
        if self.num_procs > 1:
            particles = self.share(particles)
        self.scheme.setup_properties(particles)
        self.start({pa.name: pa for pa in particles}, self.parameters, self.scheme)
        self.scheme.check(particles)
        Ledger(self.scheme).check([pa for pa in particles if pa.name in self.scheme.fluids])
        self.prepared = particles

    def share(self, particles):
        """This rank's share of the arrays of the scene, before they get the properties that a run needs.

        Scenes may make only a part of the fluid (:attr:`ranks_part`). What can only be checked on whole walls and sites
        is checked here, and walls are weighed. Particles keep the numbers that they have on one rank. The first rank
        has all sites, which are few.
        """
        scheme = self.scheme
        scheme.give_names(particles)
        scheme.check(particles)
        scheme.weigh(particles)
        scheme.shared = True
        shares = []
        for pa in particles:
            if pa.name in scheme.fluids:
                number(pa)
                last = ranks.largest(int(pa.uid.max(initial=0)))
                if ranks.total(pa.get_number_of_particles()) == last + 1:  # it is this rank's share already
                    shares.append(pa)
                    continue
            shares.append(rows(pa, self.share_of(pa.name, pa.get_number_of_particles())))
        return shares

    @property
    def ranks_part(self):
        """(number, of): which part of the fluid this rank makes at the start, for :func:`fluid_block`."""
        return ranks.rank(), ranks.size()

    def share_of(self, name, n):
        """The slice of the ``n`` particles of an array, in the order of one rank, with which this rank begins."""
        if name in self.scheme.sites:
            return slice(0, n if ranks.rank() == 0 else 0)
        return portion(n, self.ranks_part)

    def setup(self, argv=None):
        if argv is not None:
            self.set_args(argv)
        self._parse_command_line(force=argv is not None)
        restart = self.restart_file()
        self._configure_global_config()
        self._prepare()
        if restart is not None:
            self.resumed = Resumed(restart, self, self.prepared)
            self.changes = self.resumed.changes
        if not self.options.disable_output:
            names = self.check_folder()
            ranks.wait()  # all ranks check before the first one writes, and it writes before the others open their logs
            if ranks.rank() == 0:
                self.manifest.claim(*names)
            ranks.wait()
        # Ghosts are refreshed within a step, so one layer of cells, as wide as the support, is enough.
        self.options.parallel_scale_factor = 1.0
        super().setup(argv=None)
        self.solver.set_output_fname(self.fname)  # one file for all ranks, named as for one

    def restart_file(self):
        """The particle file from which the run resumes, or ``None``; it is read here and not by PySPH."""
        restart, self.options.restart_file = self.options.restart_file, None
        if restart is not None and not os.path.isfile(restart):
            raise FileNotFoundError(f"--restart-file: there is no file {restart}")
        if self.options.resume:
            if restart is not None:
                raise ValueError("--resume and --restart-file contradict each other")
            restart = last_output(self.options.output_dir)
        return restart

    def check_folder(self):
        """Names of the files to be written; raises an error if a file of the user or of another scene is in the way."""
        folder, fname = Path(self.options.output_dir), self.fname
        other = run_record(folder).get("scene", self.scene_name())
        if other != self.scene_name():
            raise ValueError(f"{folder} holds a run of {other}: choose another folder with --directory")
        check_writable(folder)
        self.manifest = Manifest(folder)
        names = ["run.json", "results.npz", "profile_info.csv", *self.begun()]
        if self.options.pictures:
            names += ["history.png", "frames.png", "surface.png", *self.pictures]
        drawn = [r"frames/frame_\d{5}\.png"] if self.options.pictures else []
        self.manifest.refuse(*map(re.escape, ["MANIFEST", *names]), rf"{re.escape(fname)}_\d{{5,}}\.hdf5", *drawn)
        return names

    def begun(self):
        """Names of the files that PySPH writes before the first step: its summary and its log."""
        log = self.options.logfile or f"{self.fname}.log"
        return [f"{self.fname}.info", *([log] if os.path.basename(log) == log else [])]

    def clear_folder(self, console):
        """Remove the files of an earlier run of this scene, or those later than the restart, and print that."""
        on = self.resumed is not None and self.resumed.folder.resolve() == Path(self.output_dir).resolve()
        later = on and any(step_of(name) > self.resumed.count for name in self.manifest.known & set(
            self.manifest.found()))
        gone = self.manifest.remove(lambda name: name not in self.begun() and (
            self.resumed.later(name) and later if on else True))
        files = sum(step_of(name) >= 0 for name in gone)
        if gone:
            what = f"the output after t = {self.resumed.t:.4g} s" if on else "an earlier run of this scene"
            console.print(f"removed {what} from {self.output_dir}: {files} particle files, {len(gone) - files} others",
                          markup=False)
        if not on:
            self.manifest.claim(*self.check_folder())

    @property
    def output_files(self):
        """Particle files of this run, in order of time."""
        return output_files(self.output_dir, self.fname)

    def _setup_argparse(self):
        super()._setup_argparse()
        pysph_options.settle(self.arg_parse, self.scheme)

    def _parse_command_line(self, force=False):
        if not hasattr(self, "options") or force:
            pysph_options.check_switches(self.arg_parse, self.args)
            super()._parse_command_line(force)
            pysph_options.check(self.options)
            self.fname = self.options.fname
            self.quiet, self.options.quiet = self.options.quiet or ranks.rank() > 0, True  # we print, not PySPH

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
        """Steps between two rows of the results. A row reads whole properties, so a device writes one per output."""
        if self.options.results_every is not None:
            return self.options.results_every
        return self.solver.pfreq if on_device(self.options) else 1

    def save(self, completed=False):
        """Write the results so far; called before each particle file, so that a run can resume from any of them."""
        if self.options.disable_output and self.num_procs == 1:
            with on_host(self.particles):
                self.measurements[self.solver.t] = self.measure({pa.name: pa for pa in self.particles}, self.solver.t)
        writes = ranks.rank() == 0 and not self.options.disable_output
        if writes:  # before the record, which waits for all ranks: the others write their files after it
            file = Path(f"{self.fname}_{self.solver.count:05d}.hdf5")
            self.manifest.claim(file, *(part_of(file, rank) for rank in range(ranks.size()) if ranks.size() > 1))
        record = self.run_record(completed)
        if writes:
            self.ledger.save()
            write_json(Path(self.output_dir) / "run.json", record)

    def keep(self, error):
        """Write the rows of the completed steps when ``error`` ended the run; only that error is reported.

        On several ranks ``run.json`` needs all of them, so it is written only if all stop together.
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
        console = Console(highlight=False, soft_wrap=True, quiet=self.quiet)  # only the first rank prints
        if self.options.describe:
            self._prepare()
            console.print(self.scheme.describe(), markup=False)
            return
        if self.options.post_process is not None:
            self.post_process(self.options.post_process)
            sys.exit(0)  # as in PySPH: a program may call post_process itself after the run
        if self.options.write_scene is not None:
            self._prepare()
            self.write_scene(Path(self.options.write_scene))
            console.print(f"wrote {self.options.write_scene}: pysph-boiling run {self.options.write_scene}",
                          markup=False)
            return
        with plain_warnings(console):
            self.simulate(console)
        first = ranks.rank() == 0
        if ranks.size() > 1:
            self.found_at_end = self.at_end()
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
        self.began = self.clock()
        try:
            with self.progress.bar, self.interrupt:
                self.solve()
        except Stopped:
            self.ledger.finish()
            self.solver.dump_output()
            written = "" if self.options.disable_output else "; the results so far are written, --resume continues"
            raise Stopped(f"stopped at t = {self.solver.t:.4g} s{written}") from None
        except BaseException as error:
            self.keep(error)
            raise
        self.ended = self.clock()
        self.ledger.finish()
        self.save(completed=True)

    def post_process(self, info_fname_or_directory):
        """Make the final check and the pictures of an earlier run again, from its files, and print the closing lines.

        ``info_fname_or_directory`` is the folder of the run, or the ``.info`` file in it. Nothing is computed: the
        state is that of the last particle file, and ``results.npz`` is read up to it.

        Errors: ``FileNotFoundError`` if there is no run or no particle file; ``ValueError`` for a run of another scene;
        :class:`CheckFailed` as in a run.
        """
        from rich.console import Console

        if self.num_procs > 1:
            raise ValueError("--post-process works on one rank")
        quiet, folder = self.quiet, folder_of_run(info_fname_or_directory, self.scene_name())
        self.set_args(run_record(folder).get("arguments", []))
        self._parse_command_line(force=True)
        self.quiet, self.options.pictures = quiet, True
        self.output_dir = self.options.output_dir = str(folder)
        last = last_output(folder, self.fname)
        if last is None:
            raise FileNotFoundError(f"there are no particle files (HDF5) of {self.fname} in {folder}")
        self.prepared = self.solver = None
        self._prepare()
        self.particles, self.resumed = self.prepared, Resumed(last, self, self.prepared)
        self.scheme.arrays[:], self.scheme.site_arrays[:] = (
            [pa for pa in self.particles if pa.name in names] for names in (self.scheme.fluids, self.scheme.sites))
        self.solver = self.create_solver()
        self.solver.particles = self.particles
        self.tools = self.create_tools()
        timed = self.resumed.record["timed"]
        self.began, self.ended = (0, 0.0), (timed["steps"], timed["seconds"])
        self.found_at_end = None
        self.finish(Console(highlight=False, soft_wrap=True, quiet=self.quiet), verb="read from")

    def finish(self, console, verb="written to"):
        """Make the final check, print a summary and draw pictures; raises :class:`CheckFailed` at the very end."""
        failed = None
        try:
            self.check(console)
        except CheckFailed as error:
            failed = error
        last = self.ledger.rows[-1] if self.ledger.rows else {}
        for sentence in safeguards.sentences(self.ledger.table(), self.solver.count):
            console.print(f"note: {sentence}")
        timed = self.timed()
        if timed["steps"]:
            step, frame = timed["seconds"] / timed["steps"], self.solver.pfreq
            console.print(f"time: {1e3 * step:.3g} ms a step, {frame} steps and {frame * step:.2g} s a frame")
        if "energy_residual" in last:
            console.print(f"conservation: relative error {last['energy_residual']:.2e} of energy, "
                          f"{last['mass_residual']:.2e} of mass")
        if not self.options.disable_output:
            console.print(f"{verb} {near(self.output_dir)}: results.npz ({len(self.ledger.rows)} rows), run.json, "
                          f"{len(self.output_files)} particle files", markup=False)
            if self.options.pictures:
                self.show(console)
        if failed is not None:
            raise failed

    def show(self, console):
        """Draw the pictures, and print where they are; the last is that of the water, or says how to get it."""
        from pysph_boiling.analysis.surface import surface_missing

        drawn = [path for path in self.draw() if path.parent == Path(self.output_dir)]
        flat = [path.name for path in drawn if path.name != "surface.png"]
        if flat:
            console.print(f"pictures there: {', '.join(flat)}", markup=False)
        for path in drawn:
            if path.name == "surface.png":
                console.print(f"as water: {near(path)}", markup=False)
        if self.scheme.dim == 3 and drawn and surface_missing():
            console.print(f"for a picture as water: {surface_missing()}, then "
                          f"pysph-boiling render {near(self.output_dir)} --view surface", markup=False)

    def check(self, console):
        """Check the ledger and the result of the scene; print the reason if the result cannot be checked."""
        self.check_ledger()
        t, needed = self.solver.t, self.check_from(self.parameters)
        try:
            if self.dry is not None and self.dry.found:
                raise NotChecked(f"the run ended at t = {t:.4g} s, when the vessel was dry")
            if t < needed * (1.0 - 1e-9):
                raise NotChecked(f"it needs a run of {needed:.4g} s, and this one ended at t = {t:.4g} s")
            self.check_final()
        except NotChecked as why:
            console.print(f"the final check was skipped: {why}", markup=False)

    def print_header(self, console):
        """Print what is about to run, with all scale factors."""
        p, scheme, solver = self.parameters, self.scheme, self.solver
        numbers = self.counts()
        counts = f"{sum(numbers.values())} particles ({', '.join(f'{n} {name}' for name, n in numbers.items())})"
        shared = f" on {ranks.size()} ranks" if ranks.size() > 1 else ""
        steps = int(np.ceil(max(p.duration - solver.t, 0.0) / solver.dt - 1e-9))
        console.print(f"[bold]{self.title}[/bold]: {counts}{shared}; {steps} steps of {solver.dt * 1e3:.4g} ms, "
                      + (f"from t = {solver.t:.4g} s " if self.resumed is not None else "")
                      + f"to {p.duration} s")
        console.print(textwrap.fill("effects: " + ", ".join(scheme.effects), COLUMNS, subsequent_indent="  "))
        if self.material != type(self).material:
            console.print(f"fluid: {self.material.name}, which boils at {self.material.T_sat:.4g} K")
            for name, law in self.laws.items():
                unit = type(p).__dataclass_fields__[name].metadata["unit"]
                console.print(f"  {name} = {getattr(p, name):.4g}{'' if unit == '-' else ' ' + unit}, in proportion to "
                              f"{law}", markup=False)
        for change in self.resumed.new if self.resumed is not None else ():
            console.print(f"  from t = {change['t']:.4g} s on: {change['parameter']} = {change['after']} "
                          f"{change['unit']}, was {change['before']}", markup=False)
        heaters = scheme.effects["heater"].temperatures(
            scheme.scene(), {pa.name: pa for pa in self.particles}) if "heater" in scheme.effects else ()
        if len(heaters) > 1:
            console.print("heaters: " + ", ".join(f"{n} wall particles at {T:g} K" for T, n in heaters))
        facts = "; ".join(f"{name} = {value:.4g}{'' if unit == '-' else ' ' + unit}".replace(" ", "\xa0")
                          for name, (value, unit) in self.facts().items())  # a fact stays on one line
        text = textwrap.fill(facts, COLUMNS, initial_indent="  ", subsequent_indent="  ", break_on_hyphens=False)
        console.print(text.replace("\xa0", " "), markup=False)

    def scene_name(self):
        """The name of the scene (:func:`~pysph_boiling.names.scene_name`)."""
        return scene_name(type(self))

    @staticmethod
    def backend():
        """The backend of the run: "cython", "openmp", "opencl" or "cuda"."""
        config = get_config()
        return "opencl" if config.use_opencl else "cuda" if config.use_cuda else \
            "openmp" if config.use_openmp else "cython"

    @functools.cached_property
    def recorded(self):
        """The columns of ``results.npz``, the heated area, the parameters and the effects, for ``run.json``."""
        scheme = self.scheme
        heated = {"heated_area": {"unit": "m^2" if scheme.dim == 3 else "m", "value": scheme.effects["heater"].area(
            scheme.scene(), {pa.name: pa for pa in self.particles})}} if "heater" in scheme.effects else {}
        return {"columns": self.ledger.described(), **heated,
                "parameters": self.recorded_parameters(),
                "effects": {slot: {"class": type(effect).__name__, **with_units(effect)}
                            for slot, effect in scheme.effects.items()}}

    def communication(self):
        """What each rank has sent so far, for ``run.json``: ghosts by array, and bytes to make and to refresh them."""
        ghosts = self.scheme.ghosts
        exported = [ghosts.exported[pa.name] for pa in self.particles]
        sent = ranks.gather(np.array([[*exported, ghosts.copied, ghosts.refreshed]]))[0].T.tolist()
        return {"unit": "particles, B, B, -", "exported": {pa.name: n for pa, n in zip(self.particles, sent)},
                "copied": sent[-2], "refreshed": sent[-1], "collectives": ranks.collectives()}

    def recorded_parameters(self):
        """Parameters for ``run.json``.

        ``replaced_by`` names the option of an effect that overrides one, and ``in_proportion_to`` the law by which it
        follows from the fluid.
        """
        rows = with_units(self.parameters)
        for name, law in self.laws.items():
            rows[name]["in_proportion_to"] = law
        for spec in dataclasses.fields(self.parameters):
            slot, _, name = (spec.metadata.get("sets") or "").partition(".")
            if slot in self.scene_effects:
                built = self.scheme.effects.get(slot)
                if built is None or getattr(built, name, None) != getattr(self.scene_effects[slot], name):
                    rows[spec.name]["replaced_by"] = option(f"no_{slot}" if built is None else slot)
        return rows

    @property
    def recorded_forms(self):
        """Names of the forms of the paper, and of our forms, that this run has, for ``run.json``."""
        return dict(zip(("paper", "ours"), forms_in(self.scheme.effects)))

    def timed(self):
        """Number of ``steps`` and ``seconds`` of wall time since this run began, files included; after its end, all."""
        steps, seconds = (end - begin for end, begin in zip(self.ended or self.clock(), self.began))
        return {"steps": steps, "seconds": seconds}

    def clock(self):
        """The number of steps and the wall time [s]."""
        return self.solver.count, perf_counter()

    def counts(self):
        """Number of particles of each array, summed over all ranks."""
        return {pa.name: int(ranks.total(pa.get_number_of_particles(True))) for pa in self.particles}

    def run_record(self, completed):
        """The content of ``run.json``: everything needed to know how the run was made.

        ``completed`` is true if the run reached its end, which may be ``--max-steps`` or an empty vessel before the
        duration; false if an error or Ctrl-C ended it.
        """
        scheme, options, backend = self.scheme, self.options, self.backend()
        return {
            "scene": self.scene_name(),
            "command": " ".join([os.path.basename(sys.argv[0]), *sys.argv[1:]]),
            "arguments": list(self.args),
            "completed": completed,
            **origin(),
            **{name: setting.value for name, setting in scheme_settings(self).items()},
            **({} if scheme.material is None else {"constants": scheme.material.constants()}),
            "precision": "double" if double_precision(options) else "single",
            "threads": get_number_of_threads() if backend == "openmp" else 1,
            "ranks": self.num_procs,
            "communication": self.communication(),
            "peak_memory": {"unit": "B", "value": ranks.gather(np.array([peak_memory()]))[0].tolist()},
            "seed": self.parameters.seed,
            "mode": options.mode,
            "forms": self.recorded_forms,
            "quality": options.quality or "scene",
            "steps": self.solver.count,
            "particles": self.counts(),
            **self.recorded,
            "facts": {name: {"value": value, "unit": unit} for name, (value, unit) in self.facts().items()},
            "wall_time": {"unit": "s", **scheme.integrator.wall_time},
            "timed": self.timed(),
            "departures": self.departures,
            "vents": self.vents,
            "changes": self.changes,
        }


def peak_memory():
    """Largest memory that this process has had so far [B]; 0 where the system does not tell."""
    try:
        import resource
    except ModuleNotFoundError:  # Windows
        return 0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


def near(path):
    """A path as it is printed: relative to the working directory if it lies in it."""
    path = Path(path).absolute()
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path


def on_device(options):
    """Whether a run with these options uses a device."""
    return options.with_opencl or options.with_cuda


def double_precision(options):
    """Whether a run with these options computes in double precision."""
    return options.use_double or not on_device(options)

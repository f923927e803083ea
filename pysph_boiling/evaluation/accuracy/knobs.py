"""The settings that are varied for each problem, alone, and together where one can compensate for another.

A setting is a dictionary field -> value; ``density.omega`` is the field of an effect. Problems are imported only when
they are needed, since each imports its scene.
"""
import itertools
from dataclasses import dataclass, field, fields, replace

from pysph_boiling.names import unknown
from pysph_boiling.schemes.quality import QUALITIES

__all__ = ["STUDIES", "Study", "Trend", "along", "changed", "fixed_sweeps", "studies", "together", "describe_settings"]


def along(field, *values):
    """One setting for each value of a field."""
    return [{field: value} for value in values]


def together(*axes):
    """Every combination of the settings of several axes."""
    return [{name: value for setting in combination for name, value in setting.items()}
            for combination in itertools.product(*axes)]


def fixed_sweeps(*counts):
    """Settings with a fixed number of density sweeps, independent of the residual."""
    return [{"density.min_sweeps": n, "density.max_sweeps": n, "density.tolerance": 0.0} for n in counts]


def unguarded(*settings):
    """The settings without the safeguards of long steps: steps are not split, and no extra sweeps are made."""
    return tuple({**one, "density.longest_step": 1.0, "density.max_mean_error": 1.0} for one in settings)


def until(*tolerances, most=60):
    """Settings with density sweeps until the residual reaches each tolerance, at most ``most`` sweeps."""
    return [{"density.max_sweeps": most, "density.tolerance": tolerance} for tolerance in tolerances]


def changed(problem, settings):
    """The problem with the settings applied. Raises ``TypeError`` for a field that it does not have."""
    own, inner = {}, {}
    for name, value in settings.items():
        head, _, tail = name.partition(".")
        if tail:
            inner.setdefault(head, {})[tail] = value
        else:
            own[name] = value
    for head, values in inner.items():
        own[head] = replace(getattr(problem, head), **values)
    return replace(problem, **own)


NAMES = {"dt_factor": "step/t*", "density.omega": "omega", "density.chebyshev_radius": "acceleration",
         "density.skin": "skin", "density.eps": "eps", "kernel": "", "hdx": "h/dx", "interrupt": "",
         "radius": "radius/dx"}


def describe_settings(settings):
    """The settings in words; all others have the default of the problem."""
    if not settings:
        return "default settings"
    left, words = dict(settings), []
    low, high = left.pop("density.min_sweeps", None), left.pop("density.max_sweeps", None)
    tolerance = left.pop("density.tolerance", None)
    for name, value in left.items():
        name = NAMES.get(name, name.rpartition(".")[2].replace("_", " "))
        if isinstance(value, bool):
            words.append(name if value else f"not {name}")
        else:
            words.append(f"{name} {f'{value:.4g}' if isinstance(value, float) else value}".strip())
    if low is not None and low == high:
        words.append(f"{low} sweeps")
    elif low is not None and high is not None:
        words.append(f"{low} to {high} sweeps")
    elif high is not None:
        words.append(f"at most {high} sweeps")
    if tolerance:
        words.append(f"until {tolerance:.2g}")
    return ", ".join(words)


@dataclass(frozen=True)
class Trend:
    """A sequence of points to which an order of convergence is fitted.

    ``parameter`` is the field that is refined, by ``finer`` "smaller" or "larger" values. ``points`` are settings.
    ``error`` is the error of the study if not given.
    """

    name: str
    parameter: str
    points: tuple
    error: str = ""
    finer: str = "smaller"


@dataclass(frozen=True)
class Study:
    """A problem and the settings that are varied.

    ``error`` is the name of the error of the front and ``what`` describes it. If ``finest`` is given, these are the
    settings of the reference run, and ``error`` is the name of a fact that is compared with it. ``knobs`` maps a name
    to settings. A problem with a density constraint also runs with every preset, unless ``presets`` is false.
    What the presets promise is checked at the settings ``promised``, which need not compete with the others.
    ``others`` are further errors for the tables, all if not given. Points that differ from ``problem`` in a field of
    ``apart`` are left out of the front, because the error does not show the effect of that field, and so are points
    with another error above its bound in ``keeps`` (name of the error -> bound). ``note`` is added to the title of the
    problem.
    """

    key: str
    problem: object
    error: str
    what: str
    knobs: dict
    trends: tuple = ()
    finest: dict | None = None
    presets: bool = True
    promised: dict = field(default_factory=dict)
    others: tuple | None = None
    apart: tuple = ()
    keeps: dict = field(default_factory=dict)
    note: str = ""

    def competes(self, problem, errors):
        """Whether a point with these ``errors`` (name -> error, or ``None``) may be on the front."""
        return all(getattr(problem, name) == getattr(self.problem, name) for name in self.apart) and not any(
            abs(errors.get(name) or 0.0) > bound for name, bound in self.keeps.items())

    @property
    def title(self):
        """Title of the problem with the note that distinguishes several studies of it."""
        return f"{self.problem.title}{f', {self.note}' if self.note else ''}"

    def settings(self):
        """All settings without repetition, each with the names of its knobs: list of (settings, names)."""
        found = {}
        rows = [("default settings", {}), *([("finest", self.finest)] if self.finest is not None else []),
                *((name, one) for name, many in self.knobs.items() for one in many),
                *((trend.name, one) for trend in self.trends for one in trend.points)]
        for name, one in rows:
            problem = changed(self.problem, one)
            settings, names = found.setdefault(repr(problem), (one, []))
            if name not in names:
                names.append(name)
        return list(found.values())

    def preset_points(self):
        """Name -> problem for each preset that applies to the problem."""
        if not self.presets or "density" not in {spec.name for spec in fields(self.problem)}:
            return {}
        return {name: replace(self.problem, **preset.settings()) for name, preset in QUALITIES.items()}

    def promised_points(self):
        """Name -> problem at which the promises of each preset are checked."""
        return {name: changed(problem, self.promised) for name, problem in self.preset_points().items()}

    def problems(self):
        """All problems to run, without repetition."""
        every = [changed(self.problem, settings) for settings, _ in self.settings()]
        return list(dict.fromkeys([*every, *self.preset_points().values(), *self.promised_points().values()]))


CUBIC, QUINTIC = {"kernel": "CubicSpline"}, {"kernel": "WendlandQuintic"}
DT_FACTORS = (0.28, 0.14, 0.07, 0.035)


def hydrostatic(dim, quick):
    from pysph_boiling.evaluation.problems.hydrostatic import HydrostaticColumn

    problem, key = HydrostaticColumn(dim=dim), f"hydrostatic_{dim}d"
    if dim == 3:
        problem = replace(problem, width=0.4, settle=6.0, watch=1.5)
    what = "mean positive density error of the settled column"
    if quick:
        small = replace(problem, layers=10, width=0.5, settle=6.0, watch=1.5)
        if dim == 3:
            return Study(key, small, "density_mean", what, {"steps and sweeps": together(
                along("dt_factor", 0.14), fixed_sweeps(4))}, note="3-D")
        steps = unguarded(*together(along("dt_factor", *DT_FACTORS[:3]), fixed_sweeps(4)))
        return Study(key, small, "density_mean", what, {
            "steps and sweeps": together(along("dt_factor", 0.14, 0.07), fixed_sweeps(2, 4)),
            "acceleration": together(along("density.chebyshev_radius", 0.9), along("density.omega", 0.5),
                                     fixed_sweeps(4)),
            "kernel": [{**QUINTIC, "hdx": 1.5}], "tolerance": until(1e-3),
        }, trends=(Trend("time step, 4 sweeps", "dt_factor", steps),), note="2-D")
    factors = (*DT_FACTORS, 0.0175) if dim == 2 else DT_FACTORS[:3]
    counts = (2, 4, 8, 16) if dim == 2 else (2, 4, 8)
    four, level = (unguarded(*together(along("dt_factor", *factors[1:]), fixed_sweeps(4))),
                   tuple(together(along("layers", 10, 20, *((40,) if dim == 2 else ())), along("dt_factor", 0.035),
                                  fixed_sweeps(8))))
    knobs = {
        "steps and sweeps": together(along("dt_factor", *factors), fixed_sweeps(*counts)),
        "tolerance": together(along("dt_factor", *factors[1:-1]),
                              until(1e-2, 4e-3, 1e-3, *((3e-4,) if dim == 2 else ()))),
        "under-relaxation": together(along("density.omega", *((0.3, 0.5, 0.9, 1.0) if dim == 2 else (0.5, 0.9))),
                                     fixed_sweeps(4)),
        "kernel": [{**kernel, "hdx": hdx} for kernel in (CUBIC, QUINTIC)
                   for hdx in ((1.0, 1.2, 1.5, 1.8) if dim == 2 else (1.0, 1.2, 1.5))],
        "relaxation": together(along("density.eps", 0.01, 1.0), fixed_sweeps(4)),
        "acceleration": together(along("density.chebyshev_radius", 0.9, 0.97), along("density.omega", 0.5, 0.7),
                                 along("dt_factor", *factors[1:3]), fixed_sweeps(*counts[1:3])),
        "skin": along("density.skin", 0.1, 0.2, 0.4),
        "all together": [
            *together(along("density.skin", 0.2), along("dt_factor", 0.1, 0.07, 0.035), fixed_sweeps(2, 4)),
            *together(along("density.skin", 0.2), along("density.chebyshev_radius", 0.97), along("density.omega", 0.5),
                      along("dt_factor", 0.1, 0.07, 0.035), fixed_sweeps(8, *((12,) if dim == 2 else ())))],
        "spacing": along("layers", 10, 40) if dim == 2 else along("layers", 10),
    }
    return Study(key, problem, "density_mean", what, knobs, trends=(
        Trend("time step, 4 sweeps", "dt_factor", four),
        Trend("spacing, level of the water", "layers", level, error="level", finer="larger")),
        apart=("layers",), keeps={"speed": 0.05}, promised={"layers": 40}, note=f"{dim}-D")  # a column that heaves


def dam_break(quick):
    """Comparison with the experiments."""
    from pysph_boiling.evaluation.problems.dam_break import DamBreak

    what = "largest distance of the front from the range of the experiments"
    if quick:
        return Study("dam_break", DamBreak(layers=10), "front", what, {
            "steps and sweeps": together(along("dt_factor", 0.14, 0.035), fixed_sweeps(2))}, note="experiments")
    return Study("dam_break", DamBreak(), "front", what, {
        "steps and sweeps": together(along("dt_factor", 0.14, 0.07, 0.035), fixed_sweeps(2, 4, 8)),
        "tolerance": until(1e-2, 1e-3), "under-relaxation": along("density.omega", 0.5, 0.9),
        "kernel": [{**CUBIC, "hdx": 1.5}, {**QUINTIC, "hdx": 1.2}, {**QUINTIC, "hdx": 1.5}],
        "acceleration": along("density.chebyshev_radius", 0.9, 0.97), "skin": along("density.skin", 0.1, 0.2, 0.4),
        "splitting of steps": together(along("dt_factor", 0.14, 0.07), along("density.courant", 0.2, 0.8, 1.6)),
        "spacing": together(along("layers", 10, 40), along("dt_factor", 0.14, 0.07)),
    }, note="experiments")


def dam_break_itself(quick):
    """Comparison of the same runs with the finest of them, which shows the numerical error alone."""
    study = dam_break(quick)
    knobs = {name: settings for name, settings in study.knobs.items() if name != "spacing"}
    return replace(study, key="dam_break_itself", error="front_at_2", note="numerical settings", knobs=knobs,
                   what="difference of the front at t sqrt(g/H) = 2 from the run with the finest settings",
                   finest=dict(fixed_sweeps(8 if quick else 16)[0], dt_factor=0.035 if quick else 0.0175))


def bubble_rise(quick):
    from pysph_boiling.evaluation.problems.bubble_rise import BubbleRise

    what = "difference of the speed from that of the run with the finest settings"
    if quick:
        small = BubbleRise(cells=5.0, starts=1, settle=2.0)
        return Study("bubble_rise", small, "speed", what, {}, finest={"dt_factor": 0.035}, presets=False)
    return Study("bubble_rise", BubbleRise(), "speed", what, {
        "steps and sweeps": together(along("dt_factor", 0.14, 0.07, 0.035), fixed_sweeps(2, 4, 8)),
        "acceleration": along("density.chebyshev_radius", 0.9), "kernel": [{**QUINTIC, "hdx": 1.5}],
        "spacing": along("cells", 9.0),
    }, finest=dict(fixed_sweeps(16)[0], dt_factor=0.0175))


def bubble_at_rest(quick):
    from pysph_boiling.evaluation.problems.bubble_at_rest import BubbleAtRest

    what, tank = "speed of the pool around a bubble at rest, over sqrt(g dx)", dict(dim=3, cells=14)
    if quick:
        return Study("bubble_at_rest", BubbleAtRest(cells=16, duration=15.0), "speed", what, {}, presets=False)
    return Study("bubble_at_rest", BubbleAtRest(), "speed", what, {
        "time step and cohesion": together(along("dt_factor", 0.2, 0.14, 0.07, 0.035),
                                           along("strength", 1.0, 2.5, 5.0, 8.0, 10.0)),
        "sweeps and cohesion": together(along("strength", 8.0), fixed_sweeps(4, 16)),
        "3-D": together([tank], along("strength", 2.0, 5.0, 10.0), along("dt_factor", 0.14, 0.07)),
    })


WALLS = [{"wall_multipliers": True}, {"wall_multipliers": True, "wall_jitter": 0.3}]


def sloshing(quick):
    from pysph_boiling.evaluation.problems.drift import SloshingTank

    what = "energy lost in one period, relative to the energy at the start"
    if quick:
        small = SloshingTank(cells=20, settle=6.0)
        return Study("sloshing", small, "loss", what, {"time step": along("dt_factor", 0.14)})
    return Study("sloshing", SloshingTank(), "loss", what, {
        "steps and sweeps": together(along("dt_factor", 0.14, 0.07, 0.035), fixed_sweeps(2, 4, 8)),
        "tolerance": until(1e-2, 1e-3), "under-relaxation": along("density.omega", 0.5, 0.9),
        "kernel": [{**CUBIC, "hdx": 1.5}, {**QUINTIC, "hdx": 1.2}, {**QUINTIC, "hdx": 1.5}],
        "acceleration": along("density.chebyshev_radius", 0.9, 0.97), "skin": along("density.skin", 0.2),
        "spacing": along("cells", 20, 80), "artificial pressure": along("artificial_pressure", 20.0),
        "walls": WALLS,
    }, trends=(Trend("spacing", "cells", tuple(along("cells", 20, 40, 80)), finer="larger"),))


def still_water(quick):
    from pysph_boiling.evaluation.problems.drift import StillWater

    what, flat = "speed of water at rest, over sqrt(g dx)", dict(dim=2, cells=24)
    if quick:
        return Study("still_water", StillWater(dim=2, cells=12, duration=20.0), "speed", what, {}, presets=False)
    return Study("still_water", StillWater(duration=60.0), "speed", what, {
        "steps and sweeps": together(along("dt_factor", 0.14, 0.07, 0.035), fixed_sweeps(2, 4, 8)),
        "under-relaxation": along("density.omega", 0.3, 0.7), "kernel": [{"hdx": 1.0}, {**QUINTIC, "hdx": 1.2}],
        "2-D": [flat, *together([flat], fixed_sweeps(2, 4))],
        "artificial pressure": together([{}, flat], along("artificial_pressure", 20.0)),
        "walls": together([{}, flat], along("artificial_pressure", 20.0), WALLS),
    })


def momentum(quick):
    from pysph_boiling.evaluation.problems.drift import PeriodicBox

    return Study("momentum", PeriodicBox(), "momentum", "relative change of the mean velocity", {} if quick else {
        "sweeps": fixed_sweeps(2, 8), "acceleration": along("density.chebyshev_radius", 0.9)}, presets=False)


def conduction(quick):
    from pysph_boiling.evaluation.problems.conduction import HotPlate

    spacings = (2e-3, 1e-3) if quick else (2e-3, 1e-3, 5e-4, 2.5e-4)
    steps = (4.0,) if quick else (10.0, 4.0, 0.25, 0.1)
    return Study("conduction", HotPlate(), "L2", "L2 error of the temperature", {
        "spacing": along("spacing", *spacings), "heat step": along("step", *steps),
    }, trends=(Trend("spacing", "spacing", tuple(along("spacing", *spacings))),))


def fourier(quick):
    from pysph_boiling.evaluation.problems.conduction import FourierMode

    layers, hdx = ((8, 16), ()) if quick else ((8, 16, 32, 64), (1.0, 1.2, 1.5, 2.0))
    return Study("fourier", FourierMode(layers=layers[1]), "rate", "error of the decay rate of a mode", {
        "spacing": along("layers", *layers), "support": along("hdx", *hdx),
        "heat step": along("steps", 5) if quick else along("steps", 5, 20, 40),
    }, trends=(Trend("spacing, without the lattice's constant", "layers", tuple(along("layers", *layers)),
                     error="order", finer="larger"),))


def stefan(quick):
    from pysph_boiling.evaluation.problems.stefan import Stefan

    layers = (8, 16) if quick else (10, 20, 40)
    return Study("stefan", Stefan(layers=layers[1]), "growth", "error of the displacement of the front", {
        "spacing": along("layers", *layers), "support": [] if quick else along("hdx", 1.0, 1.5),
    }, trends=(Trend("spacing", "layers", tuple(along("layers", *layers)), finer="larger"),))


def growth(quick):
    from pysph_boiling.evaluation.problems.growth import Growth

    what, others = "error of the volume of a growing disc of vapour", ("ahead", "latent_error", "roundness", "stored")
    if quick:
        return Study("growth", Growth(radius=2.5, growth=2.0), "error", what, {"latent heat": along("pooled", False)},
                     others=others)
    return Study("growth", Growth(), "error", what, {
        "spacing": along("radius", 3.0, 6.0), "latent heat": along("pooled", False),
        "interruption": along("interrupt", "convert"),
        "reach of vapour as a site": [*along("kinetic_radius", 1.2, 1.6), {"vapour_as_site": False}],
        "all together": together(along("pooled", False), along("interrupt", "hold", "convert"),
                                 along("kinetic_radius", 1.2, 1.5)),
        "disorder": along("jitter", 0.2),
    }, trends=(Trend("spacing", "radius", tuple(along("radius", 3.0, 4.0, 6.0)), finer="larger"),), others=others)


def boiling_rate(quick):
    from pysph_boiling.evaluation.problems.boiling_rate import BoilingRate

    problem = BoilingRate(duration=0.6, begin=0.3, width=24, fill=14, sites=2) if quick else BoilingRate(
        duration=6.0, begin=3.0)
    return Study("boiling_rate", problem, "rate", "difference of the vapour made from what the heater's power can make",
                 {} if quick else {"start": along("seed", 2, 3)})


#: key -> function of ``quick`` that gives the :class:`Study`
STUDIES = {
    "hydrostatic_2d": lambda quick: hydrostatic(2, quick), "hydrostatic_3d": lambda quick: hydrostatic(3, quick),
    "dam_break": dam_break, "dam_break_itself": dam_break_itself, "sloshing": sloshing, "still_water": still_water,
    "momentum": momentum, "bubble_rise": bubble_rise, "bubble_at_rest": bubble_at_rest,
    "conduction": conduction, "fourier": fourier, "stefan": stefan, "growth": growth,
    "boiling_rate": boiling_rate,
}


def studies(quick, keys=None):
    """The studies, all or those named in ``keys``. Raises ``ValueError`` with the known names for an unknown one."""
    for key in keys or ():
        if key not in STUDIES:
            raise unknown("study", key, STUDIES)
    return [make(quick) for key, make in STUDIES.items() if not keys or key in keys]

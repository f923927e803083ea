"""The command ``pysph-boiling sweep``: a scene over ranges of its parameters and over seeds."""
import csv
import itertools
import json
import math
import os
import re
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from pysph_boiling.analysis.boiling import FIGURES, figure_of
from pysph_boiling.evaluation.reproduce.runs import Run, attempt
from pysph_boiling.examples import scene_class, scenes
from pysph_boiling.files import whole
from pysph_boiling.names import Parser, nearest, option, unknown
from pysph_boiling.report.pictures import plot
from pysph_boiling.runs.application import SceneApplication
from pysph_boiling.runs.jobs import check_count
from pysph_boiling.runs.ledger import Ledger, write_json

__all__ = ["Axis", "Point", "points", "split", "sweep", "values"]

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
RANGE = re.compile(rf"({NUMBER}):({NUMBER}):(\d+)")
LIST = re.compile(rf"{NUMBER}(?:,{NUMBER})+")
MOST = 1000  # runs of a sweep: more is a slip of the keyboard


@dataclass(frozen=True)
class Axis:
    """A parameter that is swept: its ``flag`` on the command line and ``values``, as text."""

    flag: str
    values: tuple[str, ...]

    @property
    def name(self):
        """Name among the settings of a run: "superheat", "heater.temperature"."""
        return self.flag.removeprefix("--").replace("-", "_")


@dataclass(frozen=True)
class Point:
    """One run of a sweep: the ``values`` of its axes, as text, its ``seed`` and its ``run``."""

    values: tuple[str, ...]
    seed: int
    run: Run


def values(text):
    """The numbers of ``start:stop:count`` or ``a,b,c``, as text; ``None`` if it is neither.

    Errors: ``ValueError`` for fewer than two values, and for a value given twice.
    """
    found = RANGE.fullmatch(text)
    if found:
        count = int(found[3])
        if not 2 <= count <= MOST:
            raise ValueError(f"a range needs 2 to {MOST} values, start:stop:count, got {text}")
        numbers = np.linspace(float(found[1]), float(found[2]), count)
    elif LIST.fullmatch(text):
        numbers = [float(one) for one in text.split(",")]
    else:
        return None
    shown = tuple(f"{number:.6g}" for number in numbers)
    if len(set(shown)) < len(shown):
        raise ValueError(f"a value is swept twice in {text}: {', '.join(shown)}")
    return shown


def split(arguments):
    """(axes, other arguments): the options with a range or a list of numbers, and all that goes to the scene as it is.
    """
    axes, fixed, left = [], [], list(arguments)
    while left:
        token = left.pop(0)
        flag, equals, value = token.partition("=")
        if not equals and flag.startswith("--") and left:
            value = left[0]
        swept = values(value) if flag.startswith("--") else None
        if swept is None:
            fixed.append(token)
            continue
        if not equals:
            left.pop(0)
        if any(axis.flag == flag for axis in axes):
            raise ValueError(f"{flag} is swept twice")
        axes.append(Axis(flag, swept))
    return tuple(axes), tuple(fixed)


def resolved(scene, arguments):
    """The application of a scene with these options, of which nothing is built; errors are those of the scene."""
    application = scene_class(scene)()
    if not isinstance(application, SceneApplication):
        raise ValueError(f"{scene} has a scheme of PySPH and no parameters of ours, so it cannot be swept")
    application.arg_parse.prog = f"pysph-boiling sweep {scene}"
    application.resolve(arguments)
    return application


def parameters(application):
    """The numbers that can be swept, all but the seed: name -> (unit, meaning)."""
    groups = {"": application.parameters, **{f"{slot}.": effect for slot, effect in application.scheme.effects.items()}}
    return {f"{prefix}{spec.name}": (spec.metadata["unit"], spec.metadata["meaning"])
            for prefix, group in groups.items() for spec in fields(group)
            if "unit" in spec.metadata and spec.type in (int, float) and spec.name != "seed"}


def points(scene, axes, fixed, seeds, first):
    """Every combination of the values of the axes, with each of the ``seeds`` seeds from ``first`` on."""
    made = []
    for chosen in itertools.product(*(axis.values for axis in axes)):
        swept = [token for axis, value in zip(axes, chosen) for token in (axis.flag, value)]
        for seed in range(first, first + seeds):
            name = "_".join([*(f"{axis.name}={value}" for axis, value in zip(axes, chosen)), f"seed={seed}"])
            made.append(Point(chosen, seed, Run(name, scene, (*fixed, *swept, "--seed", str(seed)))))
    return made


def known_figures(application):
    """The figures that the runs of a scene have: those of boiling, and one for each column of its results."""
    scheme = application.scheme
    found = {name: figure for name, figure in FIGURES.items() if figure.slot in scheme.effects}
    return found, {column.name: figure_of(column.name, column.unit_in(scheme.dim), column.meaning)
                   for column in Ledger(scheme).columns if column.name != "t"}


def keep_apart(root, scene, fixed):
    """Write down what the runs in ``root`` have in common. Raises ``ValueError`` if others are there already."""
    mark, common = root / "sweep.json", {"scene": scene, "options": list(fixed)}
    if mark.exists() and json.loads(mark.read_text()) != common:
        other = json.loads(mark.read_text())
        raise ValueError(f"{root} holds a sweep of {' '.join([other['scene'], *other['options']])}: choose another "
                         "folder with --directory")
    root.mkdir(parents=True, exist_ok=True)
    write_json(mark, common)


def titled(name, unit):
    """The heading of a column."""
    return f"{name} [{unit}]"


def write_table(path, axes, about, figures, made, done, failed):
    """Write one row a run to a CSV file: values of the axes, seed, state, and figures; cells without a value are empty.
    """
    with whole(path) as part, open(part, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*(titled(axis.name, about[axis.name][0]) for axis in axes), "seed [-]",
                         *(titled(name, figure.unit) for name, figure in figures.items()), "state"])
        for point in made:
            row = done.get(point.run.name, {})
            cells = [f"{row[name]:.9g}" if math.isfinite(row.get(name, math.nan)) else "" for name in figures]
            writer.writerow([*point.values, point.seed, *cells, failed.get(point.run.name, "done")])


def gathered(name, made, done):
    """Numbers of a figure by the values of the axes: values -> (seeds,), without NaN and failed runs."""
    found = {}
    for point in made:
        number = done.get(point.run.name, {}).get(name, math.nan)
        found.setdefault(point.values, []).extend([number] if math.isfinite(number) else [])
    return {at: np.array(numbers) for at, numbers in found.items()}


def draw(path, axes, about, figure, numbers, title):
    """Draw the mean of a figure over the first axis, with bars from the least to the greatest of the seeds.

    Further axes make one line for each combination of their values.
    """
    lines = {}
    for at, found in numbers.items():
        if len(found):
            lines.setdefault(at[1:], []).append((float(at[0]), found.mean(), found.min(), found.max()))
    with plot(path, width=6.4, height=4.0) as ax:
        for others, rows in lines.items():
            x, mean, low, high = np.array(sorted(rows)).T
            label = ", ".join(f"{axis.name} = {value}{unit_of(about[axis.name][0])}"
                              for axis, value in zip(axes[1:], others))
            ax.errorbar(x, mean, yerr=[mean - low, high - mean], fmt="o-", markersize=4, capsize=3, clip_on=False,
                        label=label or None)
        if len(axes) > 1 and lines:
            ax.legend()
        if all((found >= 0.0).all() for found in numbers.values()):
            ax.set_ylim(bottom=0.0)
        unit, meaning = about[axes[0].name]
        ax.set(xlabel=titled(meaning, unit), ylabel=titled(figure.meaning, figure.unit), title=title)


def unit_of(unit):
    """A unit after a number; nothing for a number without one."""
    return "" if unit == "-" else f" {unit}"


def sweep(arguments):
    """Run a scene for all combinations of the values of its parameters and for several seeds.

    Writes ``sweep.csv`` with one row a run, and a picture for each figure that is plotted; returns the path of the
    table. A run that is complete is not repeated. Errors: ``ValueError`` for what cannot be swept, before anything
    runs; ``ChildProcessError`` if runs failed, once the others are done and written.
    """
    from rich.console import Console
    from rich.table import Table

    parser = Parser(prog="pysph-boiling sweep SCENE", allow_abbrev=False, description=(
        "Run a scene for several values of its parameters. Give any number of a scene or an effect a range, as in "
        "--superheat 5:60:8 (8 values from 5 to 60), or a list: --superheat 5,20,60. Several such options make a grid. "
        "All other options go to the scene. The same command continues an interrupted sweep, and draws other figures."))
    parser.add_argument("--seeds", type=int, default=1, metavar="N",
                        help="runs for each point, with seeds that follow each other from --seed on; default 1")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1,
                        help="number of runs at the same time; default one per core")
    parser.add_argument("--plot", action="append", metavar="FIGURE", default=[],
                        help=f"what to draw, may be given several times: {', '.join(FIGURES)}, or any column of the "
                             "results; default heat_flux, or the first of these that the scene has")
    parser.add_argument("-d", "--directory", default=None, help="output folder; default sweep_SCENE")
    if {"-h", "--help"} & set(arguments[:1]):
        parser.parse_args(arguments)
    if not arguments or arguments[0].startswith("-"):
        raise ValueError(f"name a scene first, one of: {', '.join(scenes())}")
    scene = arguments[0]
    options, rest = parser.parse_known_args(arguments[1:])
    if options.seeds < 1:
        raise ValueError(f"--seeds must be 1 or more, got {options.seeds}")
    check_count(options.jobs)
    axes, fixed = split(rest)
    application = resolved(scene, fixed)
    known = parameters(application)
    for axis in axes:
        if axis.name not in known:
            raise ValueError(f"{scene} has no number {axis.flag} to sweep{nearest(axis.flag, map(option, known))}; "
                             f"'pysph-boiling run {scene} --help all' lists what it has")
    if not axes:
        raise ValueError("give an option a range or a list of values, such as --superheat 5:60:8 or --sites 2,4,8")
    made = points(scene, axes, fixed, options.seeds, application.parameters.seed)
    if len(made) > MOST:
        raise ValueError(f"this sweep has {len(made)} runs, more than {MOST}")
    figures, columns = known_figures(application)
    asked = dict.fromkeys(options.plot or list(figures)[:1])
    for name in asked:
        if name not in {**figures, **columns}:
            raise unknown("figure", name, [*figures, *columns])
    if not asked:
        raise ValueError(f"--plot is missing; {scene} has the figures {', '.join(columns)}")
    figures |= {name: columns[name] for name in asked if name not in figures}
    for point in made:
        resolved(scene, point.run.options)  # so that a bad value ends the command before anything runs

    console = Console(highlight=False, soft_wrap=True)
    root = Path(options.directory or f"sweep_{scene}")
    keep_apart(root, scene, fixed)
    runs, failed = attempt([point.run for point in made], root / "runs", jobs=options.jobs, report=console.print)
    done = {name: {key: figure.value(run) for key, figure in figures.items()} for name, run in runs.items()}
    write_table(root / "sweep.csv", axes, known, figures, made, done, failed)
    console.print(f"table: {root / 'sweep.csv'}")
    title = " ".join([scene, *fixed]) + (f", {options.seeds} seeds" if options.seeds > 1 else "")
    for name in asked:
        numbers = gathered(name, made, done)
        draw(root / f"{name}.png", axes, known, figures[name], numbers, title)
        table = Table(*(titled(axis.name, known[axis.name][0]) for axis in axes), titled(name, figures[name].unit))
        for at, found in numbers.items():
            table.add_row(*at, f"{found.mean():.4g}" + (
                f" ({found.min():.4g} to {found.max():.4g})" if len(found) > 1 else "") if len(found) else "none")
        console.print(table)
        console.print(f"picture: {root / name}.png")
    if failed:
        raise ChildProcessError(f"{len(failed)} of {len(made)} runs failed, and the others are in the table:\n"
                                + "\n".join(f"  {name}: {why}" for name, why in failed.items()))
    return root / "sweep.csv"

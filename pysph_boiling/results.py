"""Reading a run: its results, particles, events and settings, each with its unit.

An example::

    run = load_run("steady_boiling_output")
    run                                  # what it is, in a few lines
    run.results["n_vapour"]              # a column, (rows,)
    run.results.unit("energy_heater"), run.results.meaning("energy_heater")
    run.particles(1.5)["fluid"].T        # particles of the last output up to 1.5 s
    run.settings["superheat"], run.settings.unit("superheat")
    run.events[0].time                   # the first bubble that departed or left, or region that burst
    run.to_xarray()["T_mean"].plot()
"""
import math
import os
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pysph.base.particle_array import ParticleArray

from pysph_boiling.extras import needed
from pysph_boiling.files import load_output, output_files, output_time, run_record
from pysph_boiling.names import current_name, current_quantity, unknown

__all__ = ["EVENT_UNITS", "Event", "Particles", "Quantities", "SavedRun", "diameter", "load_results", "load_run"]

SOON = 1e-6  # part of the time between two outputs by which an output may be later than the time asked for: round-off


class Event(NamedTuple):
    """Something that happened in a run, with the units of :data:`EVENT_UNITS`.

    ``kind`` is "departure" (a bubble leaves the site with the number ``site``), "vent" (a bubble leaves through the
    surface) or "burst" (superheated liquid becomes vapour at once). ``particles`` is its number of particles, and
    ``diameter`` that of a disc or ball of the liquid that they were made of. ``x, y, z`` is its place: the site of a
    departure; NaN for the others, of which no place is recorded. ``site`` is -1 for the others.
    """

    time: float
    kind: str
    particles: int
    diameter: float
    site: int
    x: float
    y: float
    z: float


#: Units of the fields of an :class:`Event`.
EVENT_UNITS = dict(time="s", kind="-", particles="-", diameter="m", site="-", x="m", y="m", z="m")


class Missing(ValueError, KeyError):
    """The error for a name that is not there: a ``KeyError``, whose message is a sentence."""

    __str__ = Exception.__str__


class Quantities(Mapping):
    """Values by name, each with a unit and a meaning. An unknown name is an error that says which would be right.

    ``values`` is name -> value, and ``described`` is name -> dict with ``unit`` and ``meaning``. ``what`` says what one
    of them is called in messages.
    """

    def __init__(self, what: str, values: Mapping, described: Mapping):
        self._what, self._values, self._described = what, values, described

    def __getitem__(self, name):
        if name not in self._values:
            raise Missing(unknown(self._what, name, self._values))
        return self._values[name]

    def __iter__(self):
        return iter(self._values)

    def __len__(self):
        return len(self._values)

    def unit(self, name: str) -> str:
        """Unit of a value, such as "J" or "J/m"; "-" if it has none."""
        return self._about(name, "unit")

    def meaning(self, name: str) -> str:
        """What a value is, in words."""
        return self._about(name, "meaning")

    def about(self, name: str) -> dict[str, str]:
        """What is known of a value: a dict with ``unit`` and ``meaning``, which may lack either in an older run."""
        self[name]
        return self._described.get(name, {})

    def _about(self, name, what):
        found = self.about(name)
        if what not in found:
            raise ValueError(f"the run.json of this run does not tell the {what} of the {self._what} '{name}'")
        return found[what]

    def __repr__(self):
        width = max(map(len, self), default=0)
        return "\n".join(f"{name:{width}}  [{self.about(name).get('unit', '?')}]  "
                         f"{self.about(name).get('meaning', '') if isinstance(value, np.ndarray) else value}"
                         for name, value in self.items())


class Particles(dict):
    """Particle arrays of one output: name -> PySPH's ``ParticleArray``; ``time`` [s] is that of the output."""

    def __init__(self, arrays: dict[str, ParticleArray], time: float):
        super().__init__(arrays)
        self.time = time


class SavedRun:
    """A run of a scene, read from the files in its ``folder``; made by :func:`load_run`. Files are read when needed."""

    def __init__(self, folder: str | os.PathLike):
        self.folder = Path(folder)

    @cached_property
    def record(self) -> dict[str, Any]:
        """The content of ``run.json`` as a dict: everything that is known of how the run was made."""
        return run_record(self.folder)

    @property
    def scene(self) -> str:
        """Name of the scene."""
        return self.record.get("scene", "")

    @property
    def dim(self) -> int:
        """Dimension of the scene, 2 or 3."""
        return int(self.record["dim"])

    @property
    def spacing(self) -> float:
        """Spacing of the particles [m]."""
        return float(self.record["spacing"])

    @property
    def completed(self) -> bool:
        """Whether the run reached its end; false if an error or Ctrl-C ended it, or if it still runs."""
        return bool(self.record.get("completed"))

    @cached_property
    def results(self) -> Quantities:
        """The table of results: column name -> array (rows,), with units and meanings (:class:`Quantities`)."""
        described = {current_quantity(name): about for name, about in self.record.get("columns", {}).items()}
        table = load_results(self.folder)
        return Quantities("column", {current_quantity(name): values for name, values in table.items()}, described)

    @cached_property
    def settings(self) -> Quantities:
        """Parameters of the scene ("superheat"), of effects ("heater.temperature") and constants of the material
        ("material.T_sat"): name -> value, with units (:class:`Quantities`)."""
        groups = {"scene": self.record.get("parameters", {}), **self.record.get("effects", {}),
                  "material": self.record.get("constants", {})}
        found = {current_name(f"{group}.{name}").removeprefix("scene."): row
                 for group, rows in groups.items() if isinstance(rows, dict)
                 for name, row in rows.items() if isinstance(row, dict)}
        return Quantities("setting", {name: row["value"] for name, row in found.items()}, found)

    @property
    def material(self) -> str | None:
        """Name of the fluid; ``None`` in a scene without heat."""
        return self.record.get("material")

    @cached_property
    def files(self) -> list[str]:
        """Paths of the particle files, in order of time."""
        return output_files(self.folder)

    @cached_property
    def times(self) -> np.ndarray:
        """Time [s] of each particle file, (files,)."""
        return np.array([output_time(file) for file in self.files])

    def particles(self, time: float) -> Particles:
        """The :class:`Particles` of the last output at or before ``time`` [s].

        A run on several ranks gives the particles of all ranks. Errors: ``FileNotFoundError`` for a run without
        particle files; ``ValueError`` for a time before the first output or after the last one.
        """
        times = self.times
        if not len(times):
            raise FileNotFoundError(f"there are no particle files (HDF5) in {self.folder}")
        late = SOON * (times[-1] - times[0]) / max(len(times) - 1, 1)
        if not times[0] - late <= time <= times[-1] + late:
            raise ValueError(f"there is no output at t = {time:g} s: {told(times)}")
        return Particles(*load_output(self.files[int(np.searchsorted(times, time + late, side="right")) - 1]))

    @cached_property
    def events(self) -> list[Event]:
        """Departures, vents and bursts as a list of :class:`Event`, in order of time."""
        found = [self._event(t, "departure", n, site[0] if site else -1)
                 for t, n, *site in self.record.get("departures", ())]
        found += [self._event(t, "vent", n) for t, n in self.record.get("vents", ())]
        if "n_burst" in self.results:
            burst = np.diff(self.results["n_burst"], prepend=0.0)
            found += [self._event(t, "burst", n) for t, n in zip(self.results["t"][burst > 0], burst[burst > 0])]
        return sorted(found)

    def _event(self, time, kind, particles, site=-1):
        place = self._sites[site] if 0 <= site < len(self._sites) else (math.nan,) * 3
        return Event(float(time), kind, int(particles), float(diameter(particles, self.dim)) * self.spacing, int(site),
                     *map(float, place))

    @cached_property
    def _sites(self):
        """Places of the nucleation sites [m], (sites, 3), in the order of their numbers."""
        from pysph_boiling.particles import in_order, positions

        arrays = load_output(self.files[0])[0] if self.files else {}
        return in_order(np.concatenate([np.zeros((0, 3)), *(
            positions(pa) for name, pa in arrays.items() if "site" in name)]))

    def to_xarray(self) -> Any:
        """The results as an ``xarray.Dataset`` over the coordinate ``t``, with ``units`` and ``long_name`` of each.

        Errors: ``ModuleNotFoundError`` without xarray, which is in ``pip install 'pysph_boiling[analysis]'``.
        """
        xarray = needed("xarray", "analysis")
        table = self.results

        def labelled(name):
            labels = {"unit": "units", "meaning": "long_name"}
            return "t", table[name], {labels[what]: text for what, text in table.about(name).items()}

        return xarray.Dataset({name: labelled(name) for name in table if name != "t"}, coords={"t": labelled("t")},
                              attrs={"scene": self.scene, "command": self.record.get("command", ""), "dim": self.dim,
                                     "spacing": self.spacing})

    def __repr__(self):
        t, number = self.results["t"], self.record.get("particles", {})
        kinds = [event.kind for event in self.events]
        end = f"{t[-1]:.4g} s" if len(t) else "its start"
        counted = ", ".join(f"{kinds.count(kind)} {kind}s" for kind in dict.fromkeys(kinds)) or "none"
        return "\n".join([
            f"run of {self.scene} in {self.folder}, " + (f"to {end}" if self.completed else f"unfinished, until {end}"),
            f"  particles   {', '.join(f'{n} {name}' for name, n in number.items())}",
            f"  spacing     {1e3 * self.spacing:g} mm, {self.dim}-D",
            f"  results     {len(self.results)} columns, {len(t)} rows: run.results prints them",
            f"  outputs     {told(self.times)}",
            f"  events      {counted}",
            f"  settings    {len(self.settings)}: run.settings prints them"])


def load_run(directory: str | os.PathLike, *, unfinished: bool = False) -> SavedRun:
    """Read the run in an output folder; returns a :class:`SavedRun`.

    A run that an error or Ctrl-C ended, or that still runs, is only read with ``unfinished=True``.

    Errors: ``FileNotFoundError`` for a folder without a run; ``ValueError`` for an unfinished run and damaged files.
    """
    folder = Path(directory)
    if not (folder / "run.json").is_file():
        raise FileNotFoundError(f"there is no run.json in {folder}, so it is not the output folder of a run")
    run = SavedRun(folder)
    if not {"dim", "spacing"} <= set(run.record):
        raise ValueError(f"{folder / 'run.json'} is damaged, or is not of pysph_boiling")
    if not (folder / "results.npz").is_file():
        raise FileNotFoundError(f"there is no results.npz in {folder}: the run ended before its first results, or was "
                                "made with --disable-output")
    if not run.completed and not unfinished:
        t = run.results["t"]
        raise ValueError(f"the run in {folder} is unfinished: its results end at t = {t[-1] if len(t) else 0.0:.4g} s. "
                         "Continue it with --resume, or read what is there with load_run(..., unfinished=True)")
    return run


def told(times):
    """Times of outputs in words."""
    if len(times) < 5:
        return f"{len(times)} outputs" + (", at " + ", ".join(f"{t:.4g}" for t in times) + " s" if len(times) else "")
    every = np.median(np.diff(times))
    return f"{len(times)} outputs from {times[0]:.4g} to {times[-1]:.4g} s, about every {every:.3g} s"


def diameter(n: ArrayLike, dim: int) -> np.ndarray:
    """Diameter [spacings] of a disc or ball of ``n`` particles."""
    n = np.asarray(n)
    return np.sqrt(4.0 * n / np.pi) if dim == 2 else np.cbrt(6.0 * n / np.pi)


def load_results(path: str | os.PathLike) -> dict[str, np.ndarray]:
    """Read ``results.npz`` (the file, or the folder that holds it) as a dict of columns: name -> array (rows,).

    >>> from tempfile import TemporaryDirectory
    >>> import numpy as np
    >>> from pysph_boiling.results import load_results
    >>> with TemporaryDirectory() as folder:  # the folder of a finished run has such a file
    ...     np.savez(f"{folder}/results.npz", t=np.array([0.0, 0.1]), n_vapour=np.array([0.0, 7.0]))
    ...     results = load_results(folder)
    >>> results["n_vapour"].max()
    np.float64(7.0)

    Errors: ``FileNotFoundError``; ``ValueError`` for a file that is truncated or is not a table of results. No code in
    the file is executed.
    """
    path = Path(path)
    path = path / "results.npz" if path.is_dir() else path
    try:
        with np.load(path, allow_pickle=False) as data:
            table = {name: data[name] for name in data.files}
    except FileNotFoundError:
        raise
    except Exception as error:  # zipfile, zlib and NumPy raise many kinds of errors for a broken file
        raise ValueError(f"{path} is not a complete results table: {error}") from None
    if "t" not in table or len({values.shape for values in table.values()}) != 1 or any(
            values.ndim != 1 or values.dtype.kind not in "iufb" for values in table.values()):
        raise ValueError(f"{path} is not a results table: it has no column t, or its columns are not one-dimensional "
                         "arrays of numbers of equal length")
    return table

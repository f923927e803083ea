"""How strongly a vessel boils: figures of a whole run, each with a unit and a meaning."""
import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from pysph_boiling.results import Event, SavedRun

__all__ = ["FIGURES", "RunFigure", "figure_of", "heat_flux"]


class RunFigure(NamedTuple):
    """A number that describes a run; ``value(run)`` takes the run.

    Only runs with the effect ``slot`` have it. It is NaN where there is nothing to average.
    """

    unit: str
    meaning: str
    value: Callable[[SavedRun], float]
    slot: str = ""


def second_half(run: SavedRun) -> tuple[float, float]:
    """(begin, end) of the second half of a run [s], over which figures are taken, so that the start does not count."""
    end = float(run.results["t"][-1])
    return 0.5 * end, end


def heat_flux(table: Mapping[str, np.ndarray], *, area: float, time_scaling: float, begin: float) -> float:
    """Mean heat flux of the heater [W/m^2] from the time ``begin`` [s] on, over the factor A of the heat.

    ``table`` is the table of results, with ``t`` [s] and ``energy_heater`` [J, or J/m in 2-D]; ``area`` is that of the
    heated walls [m^2, or m in 2-D], and ``time_scaling`` is A, by which heat is faster relative to motion.
    """
    return rate(table, "energy_heater", begin) / (area * time_scaling)


def rate(table: Mapping[str, np.ndarray], name: str, begin: float) -> float:
    """Growth of a column per second from the time ``begin`` [s] on; NaN for fewer than two rows."""
    late = table["t"] > begin
    t, values = table["t"][late], table[name][late]
    return float((values[-1] - values[0]) / (t[-1] - t[0])) if len(t) > 1 else math.nan


def mean(table: Mapping[str, np.ndarray], name: str, begin: float) -> float:
    """Mean of a column from the time ``begin`` [s] on; NaN without a row."""
    values = table[name][table["t"] > begin]
    return float(values.mean()) if len(values) else math.nan


def flux_of(run: SavedRun) -> float:
    """:func:`heat_flux` of the second half of a run."""
    return heat_flux(run.results, area=run.record["heated_area"]["value"],
                     time_scaling=run.settings["heat.time_scaling"], begin=second_half(run)[0])


def departed_late(run: SavedRun) -> list[Event]:
    """The departures in the second half of a run."""
    return [event for event in run.events if event.kind == "departure" and event.time > second_half(run)[0]]


def departures(run: SavedRun) -> float:
    begin, end = second_half(run)
    return len(departed_late(run)) / (end - begin)


def frequency(run: SavedRun) -> float:
    sites = {event.site for event in departed_late(run)}
    return departures(run) / len(sites) if sites else math.nan


def size(run: SavedRun) -> float:
    found = departed_late(run)
    return float(np.mean([event.diameter for event in found])) if found else math.nan


def vaporised(run: SavedRun) -> float:
    return sum(float(run.results[name][-1]) for name in ("n_nucleated", "n_burst", "n_emitted") if name in run.results)


#: Figures of the second half of a run, by name.
FIGURES = {
    "heat_flux": RunFigure("W/m^2", "heat flux of the heater over A", flux_of, "heater"),
    "departures": RunFigure("1/s", "bubbles that depart per second", departures, "preset_nucleation"),
    "frequency": RunFigure("1/s", "bubbles that depart per second from a site that is active", frequency,
                           "preset_nucleation"),
    "bubble_diameter": RunFigure("m", "mean diameter of bubbles at departure", size, "preset_nucleation"),
    "vaporised": RunFigure("-", "particles that became vapour in the whole run", vaporised, "phases"),
}


def figure_of(column: str, unit: str, meaning: str) -> RunFigure:
    """The :class:`RunFigure` of a column of results: its mean over the second half of a run.

    A column that adds up "since the start", as its meaning says, gives its growth per second instead.
    """
    if "since the start" in meaning:
        per_second = "1/s" if unit == "-" else f"{unit}/s"
        return RunFigure(per_second, f"{meaning}, per second",
                         lambda run: rate(run.results, column, second_half(run)[0]))
    return RunFigure(unit, meaning, lambda run: mean(run.results, column, second_half(run)[0]))

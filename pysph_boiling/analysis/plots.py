"""The history of a run in one figure; matplotlib is imported where it draws."""
import os
from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from pysph_boiling.analysis.drawing import INK, PHASE_COLOURS, STATE_COLOURS
from pysph_boiling.phases import Phase

__all__ = ["PANELS", "plot_history"]

LEDGER_LIMIT = 1e-10  # residual of the energy ledger that a run in double precision must stay below
RESIDUAL_FLOOR = 1e-18  # drawn in place of an exact zero, which a logarithmic axis cannot show
DPI = 150
BLUE, ORANGE, GREEN, PURPLE, YELLOW = "#3B7EBF", "#D9722A", "#2A8C6E", "#8E4585", "#E8C547"
STYLE: dict[Any, Any] = {
    "axes.labelcolor": INK, "axes.titlecolor": INK, "axes.edgecolor": "#B0B5BC", "axes.linewidth": 0.6,
    "axes.titlelocation": "left", "axes.titlesize": 9.5, "axes.titleweight": "bold", "axes.labelsize": 9,
    "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "axes.axisbelow": True,
    "grid.color": "#E6E9ED", "grid.linewidth": 0.6, "xtick.color": INK, "ytick.color": INK, "xtick.labelsize": 8,
    "ytick.labelsize": 8, "legend.fontsize": 7.5, "legend.frameon": False, "legend.labelcolor": INK,
    "legend.handlelength": 1.6, "legend.labelspacing": 0.3, "savefig.facecolor": "white", "lines.linewidth": 1.4,
}


def plot_history(results: Mapping[str, np.ndarray], path: str | os.PathLike, dim: int = 3) -> list[str]:
    """Draw the panels of :data:`PANELS` for which ``results`` has columns; returns their names, in order.

    Parameters
    ----------
    results : mapping   Column name -> array (n,), n >= 1, in SI units, as returned by
        :func:`pysph_boiling.results.load_results`; ``t`` [s] is required. Counts of events, ``energy_in`` and
        ``energy_out`` [J] are totals since the start, density errors are fractions [-].
    path                Path of the PNG file to write.
    dim : int           In 2-D, energies are in J and masses in kg per metre of depth.

    Errors: ``ValueError`` where ``t`` is missing or empty, a column has another length, or no panel has a column.
    """
    from matplotlib import rc_context

    columns = {name: np.asarray(results[name], dtype=float) for name in results}
    t = columns.get("t")
    if t is None or t.ndim != 1 or len(t) == 0:
        raise ValueError("a history needs a column 't' [s] with at least one row")
    for name, values in columns.items():
        if values.shape != t.shape:
            raise ValueError(f"column {name!r} has shape {values.shape}, but 't' has {t.shape}")
    drawn = [name for name, (_, _, needs) in PANELS.items() if any(column in columns for column in needs)]
    if not drawn:
        raise ValueError(f"there is no column to plot among {sorted(columns)}")

    with rc_context(STYLE):
        _draw_panels(drawn, t, columns, dim).savefig(path, dpi=DPI)
    return drawn


def _draw_panels(names, t, columns, dim=3):
    from matplotlib.figure import Figure

    across = min(3, len(names))
    down = -(-len(names) // across)
    figure = Figure(figsize=(max(4.1 * across, 5.0), 2.5 * down), layout="constrained")
    grid = figure.subplots(down, across, squeeze=False).ravel()
    for ax, name in zip(grid, names):
        title, draw, needs = PANELS[name]
        ax.set_title(title)
        draw(ax, t, {column: columns[column] for need in needs for column in columns if fnmatchcase(column, need)})
        if dim == 2:
            ax.set_ylabel(ax.get_ylabel().replace("[J]", "[J/m]"))
        _finish(ax, t)
    for ax in grid[len(names):]:
        ax.set_axis_off()
    for ax in grid[max(0, len(names) - across):len(names)]:
        ax.set_xlabel("time [s]")
    return figure


# One function per panel, called with the axes, t, and those of its columns that exist.

def _line(ax, t, values, label, colour, **style):
    style.setdefault("marker", "." if len(t) < 20 else None)
    return ax.plot(t, values, label=label, color=colour, **style)


def _counts(ax, t, columns):
    peaks = [values.max() for values in columns.values() if values.max() > 0.0]
    if peaks and max(peaks) > 10.0 * min(peaks):  # too far apart for one linear axis
        ax.set_yscale("symlog", linthresh=10.0, linscale=0.5)
    for state, colour in STATE_COLOURS.items():
        if f"n_{state}" in columns:
            _line(ax, t, columns[f"n_{state}"], state, colour)
    ax.set_ylabel("particles [-]")
    ax.set_ylim(bottom=None if "n_liquid" in columns else 0.0)


def _bubbles(ax, t, columns):
    if "n_bubbles" in columns:
        _line(ax, t, columns["n_bubbles"], "bubbles", BLUE, drawstyle="steps-post", linewidth=1.1)
        ax.set_ylabel("bubbles [-]", color=BLUE)
        ax.set_ylim(bottom=0.0)
    if "bubble_radius_mean" in columns:
        radius = 1e3 * columns["bubble_radius_mean"]
        beside = ax.twinx() if "n_bubbles" in columns else ax
        _line(beside, t, np.where(radius > 0.0, radius, np.nan), "mean radius", ORANGE)
        beside.set_ylabel("mean radius [mm]", color=ORANGE)
        beside.spines[:].set_visible(False)
        beside.grid(False)
        beside.set_ylim(bottom=0.0)


def _events(ax, t, columns):
    events = {"n_nucleated": ("nucleated", ORANGE), "n_burst": ("burst", PURPLE),
              "n_condensed": ("condensed", BLUE), "n_vented": ("vented", GREEN)}
    for name, (label, colour) in events.items():
        if name in columns:
            _line(ax, t, columns[name], label, colour)
    ax.set_ylabel("particles since the start [-]")
    ax.set_ylim(bottom=0.0)


def _energy(ax, t, columns):
    if "energy" in columns:
        _line(ax, t, columns["energy"] - columns["energy"][0], "change of energy", INK)
    if "energy_in" in columns:
        _line(ax, t, columns["energy_in"], "in", ORANGE)
    if "energy_out" in columns:
        _line(ax, t, columns["energy_out"], "out", BLUE)
    if "energy_in" in columns and "energy_out" in columns:
        _line(ax, t, columns["energy_in"] - columns["energy_out"], "in − out", YELLOW, linestyle=(0, (3, 3)))
    if np.any(columns.get("energy_model_leak", 0.0)):
        _line(ax, t, columns["energy_model_leak"], "error of the paper's formulas", PURPLE)
    ax.set_ylabel("energy [J]")


def _mechanics(ax, t, columns):
    works = {name: values for name, values in columns.items() if name.startswith("work_") and name != "work_residual"}
    _line(ax, t, columns["kinetic_energy"], "kinetic energy", INK)
    most = max(np.abs(values).max() for values in works.values()) if works else 0.0
    shown = sorted((name for name, values in works.items() if np.abs(values).max() > 0.01 * most),
                   key=lambda name: -np.abs(works[name]).max())
    for number, name in enumerate(shown):
        colour = (BLUE, ORANGE, GREEN, PURPLE, YELLOW)[number % 5]
        _line(ax, t, works[name], name.removeprefix("work_"), colour, linestyle="-" if number < 5 else "--")
    ax.set_ylabel("work since the start [J]")


def _residual(ax, t, columns):
    _line(ax, t, np.maximum(np.abs(columns["energy_residual"]), RESIDUAL_FLOOR), None, INK)
    ax.axhline(LEDGER_LIMIT, color=PHASE_COLOURS[Phase.VAPOUR], linewidth=1.0, linestyle="--",
               label="limit in double precision")
    ax.set_yscale("log")
    ax.set_ylabel("relative error [-]")


def _temperature(ax, t, columns):
    for name, label, colour in (("T_max", "maximum", ORANGE), ("T_mean", "mean", INK)):
        if name in columns:
            _line(ax, t, columns[name] - 273.15, label, colour)
    ax.set_ylabel("temperature [°C]")


def _density(ax, t, columns):
    for name, label, colour in (("density_error_max", "maximum", ORANGE), ("density_error_mean", "mean", INK)):
        if name in columns:
            _line(ax, t, 100.0 * columns[name], label, colour)
    ax.set_ylabel("density error [%]")
    ax.set_ylim(bottom=0.0)


def _sweeps(ax, t, columns):
    for name, label, colour in (("sweeps", "density sweeps", INK), ("heat_subcycles", "heat substeps", ORANGE)):
        if name in columns:
            _line(ax, t, columns[name], label, colour, drawstyle="steps-post")
    ax.set_ylabel("number per step [-]")
    ax.set_ylim(bottom=0.0)


def _finish(ax, t):
    ax.ticklabel_format(axis="x", useOffset=False)
    if ax.get_yscale() == "linear":
        ax.ticklabel_format(axis="y", scilimits=(-3, 5), useOffset=False)
    if t[-1] > t[0]:
        ax.set_xlim(t[0], t[-1])
    handles, labels = ax.get_legend_handles_labels()
    if len(handles) > 1 or "limit" in " ".join(labels):
        ax.legend(handles, labels)


#: Name of a panel -> its title, its function, and the columns (or patterns) that it draws; it needs at least one.
PANELS = {
    "liquid": ("Liquid", _counts, ("n_liquid",)),
    "phases": ("Hot liquid and vapour", _counts, ("n_superheated", "n_held", "n_transition", "n_vapour")),
    "bubbles": ("Bubbles", _bubbles, ("n_bubbles", "bubble_radius_mean")),
    "events": ("Events", _events, ("n_nucleated", "n_burst", "n_condensed", "n_vented")),
    "temperature": ("Temperature", _temperature, ("T_mean", "T_max")),
    "energy": ("Energy balance", _energy, ("energy", "energy_in", "energy_out", "energy_model_leak")),
    "mechanics": ("Kinetic energy and work", _mechanics, ("work_*", "kinetic_energy")),
    "residual": ("Error of the energy balance", _residual, ("energy_residual",)),
    "density": ("Density error", _density, ("density_error_mean", "density_error_max")),
    "sweeps": ("Sweeps and heat substeps", _sweeps, ("sweeps", "heat_subcycles")),
}

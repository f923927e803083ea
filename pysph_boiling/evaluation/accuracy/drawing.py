"""Plots of a study: error over cost with the Pareto front, and the trends to which orders are fitted."""
import numpy as np

from pysph_boiling.analysis.plots import BLUE, GREEN, ORANGE, PURPLE
from pysph_boiling.analysis.rendering import INK
from pysph_boiling.evaluation.accuracy.results import trend_points
from pysph_boiling.report.pictures import plot
from pysph_boiling.report.sections import Picture

__all__ = ["draw_front", "draw_orders"]

FLOOR = 1e-17  # drawn in place of an exact zero, which a logarithmic axis cannot show
COLOURS = (ORANGE, GREEN, PURPLE, BLUE)


def draw_front(findings, path):
    """Draw error over cost: all points, the numbered front and the presets; returns the :class:`Picture`."""
    rows = findings.rows
    cost, error, noise = (np.array([getattr(row, name) for row in rows]) for name in ("cost", "error", "spread"))
    error = np.maximum(error, FLOOR)
    with plot(path, height=4.2) as ax:
        ax.errorbar(cost, error, xerr=noise * cost, fmt="o", color="#A9AFB8", markersize=4.0, elinewidth=0.8,
                    label="all points")
        front = np.array(findings.front, dtype=int)
        ax.plot(cost[front], error[front], "o-", color=BLUE, markersize=5.0, label="front")
        for number, k in enumerate(front, 1):
            ax.annotate(str(number), (cost[k], error[k]), xytext=(-4, -10), textcoords="offset points", fontsize=7,
                        color=BLUE)
        for colour, (name, row) in zip(COLOURS, findings.presets().items()):
            ax.plot(row.cost, max(row.error, FLOOR), "*", color=colour, markersize=13, markeredgecolor=INK,
                    markeredgewidth=0.5, label=name, zorder=5)
        ax.set(xscale="log", yscale="log", xlabel="wall seconds per simulated second", ylabel="error [-]",
               title=findings.study.title)
        ax.legend()
    return Picture(path.name, f"{findings.study.what[:1].upper()}{findings.study.what[1:]}, over wall time. The line "
                   "is the Pareto front, numbered as in the table: no other point is better in both error and cost. "
                   "Bars show the range of the repeats.")


def draw_orders(findings, points, path):
    """Draw the errors along each trend with the fitted order; returns the :class:`Picture`."""
    with plot(path, height=3.6) as ax:
        for colour, trend in zip(COLOURS, findings.study.trends):
            h, values = map(np.array, trend_points(findings.study, trend, points))
            found = findings.orders[trend.name]
            h, values = h / h.max(), np.abs(values)
            ax.plot(h, np.maximum(values, FLOOR), "o", color=colour, label=f"{trend.name}: order {found.order:.2f}")
            if np.isfinite(found.order):
                level = np.exp(np.nanmean(np.log(np.maximum(values, FLOOR)) - found.order * np.log(h)))
                line = np.geomspace(h.min(), h.max(), 20)
                ax.plot(line, level * line**found.order, "-", color=colour, linewidth=1.0)
        ax.set(xscale="log", yscale="log", xlabel="step or spacing, relative to the largest", ylabel="error [-]")
        ax.legend()
    return Picture(path.name, "Observed orders of convergence, by a least-squares fit of the logarithms.")

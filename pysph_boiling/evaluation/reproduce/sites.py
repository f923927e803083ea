"""Figure 1: superheated liquid over time for several numbers of preset sites."""
from types import SimpleNamespace

import numpy as np

from pysph_boiling.analysis.plots import BLUE, GREEN, ORANGE, PURPLE
from pysph_boiling.evaluation.reproduce.figure import Figure
from pysph_boiling.evaluation.reproduce.runs import Run
from pysph_boiling.report.pictures import band, plot, sheet
from pysph_boiling.report.sections import Picture, Table, bound, judged, spread, write_csv

__all__ = ["Sites", "common_end", "counts", "curves", "members", "mean_between", "production", "rank_correlation",
           "rate_between", "rises", "seeds", "vessel_run"]

COLOURS = (PURPLE, BLUE, GREEN, ORANGE)
SOME, MOST = 0.01, 0.5  # range of the superheated fraction of all particles: more means that the pool just heats up
SIMILAR = 0.25  # largest difference between levels, in units of their mean
STATIONARY = 0.1  # largest change of a level from the third to the last quarter, in units of it
RISES = 0.6  # smallest rank correlation; 12 random members exceed it one time in twenty


def counts(quick):
    """Numbers of preset sites."""
    return (1, 2, 3, 4) if quick else (1, 4, 9, 16)


def seeds(quick):
    """Seeds of an ensemble."""
    return (1, 2) if quick else (1, 2, 3)


def vessel_run(sites, seed, quick, mode="dynamic", name="vessel", more=()):
    """A run of the vessel with ``sites`` preset sites in a mode; the first seed writes more files, for pictures.

    ``more`` are further options, for runs with another ``name``.
    """
    options = ["--sites", str(sites), "--seed", str(seed), "--mode", mode, *more]
    if quick:
        options += ["--flat", "--width", "30", "--fill", "14", "--duration", "0.6", "--frame", "0.1",
                    "--results-every", "4"]
    else:
        options += ["--frame", "0.05" if seed == 1 else "0.25"]
    return Run(f"{name}_{mode}_{sites}_seed{seed}", "superheat_sites", tuple(options))


def long_run(sites, seed, quick):
    """A run of the vessel with the paper's threshold, until it is stationary; in 2-D no region can hold that heat."""
    more = () if quick else ("--dynamic-nucleation.q-crit", "10", "--duration", "12")
    return vessel_run(sites, seed, quick, name="long", more=more)


def members(results, name):
    """The runs ``<name>_seed<number>`` as objects with ``result`` and ``results`` (see :func:`production`)."""
    return [SimpleNamespace(result=result, results=production(result.results))
            for key, result in sorted(results.items()) if key.startswith(f"{name}_seed")]


def production(table):
    """``table`` with a column ``produced``: particles that became vapour in any way, minus those that condensed."""
    made = sum(table[name] for name in ("n_nucleated", "n_burst", "n_emitted") if name in table)
    return {**table, "produced": made - table.get("n_condensed", 0.0)}


def common_end(*groups):
    """When the first of the runs in groups of :func:`members` ends [s]."""
    return min(float(one.results["t"][-1]) for group in groups for one in group)


def mean_between(table, column, begin, end):
    """Mean of a column of a results table over its rows from ``begin`` to ``end`` [s]."""
    inside = (table["t"] >= begin) & (table["t"] <= end)
    return float(np.mean(table[column][inside]))


def rate_between(table, column, begin, end):
    """Growth of a cumulative column per second from ``begin`` to ``end`` [s]."""
    first, last = np.interp([begin, end], table["t"], table[column])
    return float(last - first) / (end - begin)


def rank_correlation(x, y):
    """Spearman's rank correlation [-]; equal values get their mean rank; 0 if all of x or all of y are equal."""
    def ranks(values):
        values = np.asarray(values, float)
        return (values[:, None] > values).sum(axis=1) + 0.5 * (values[:, None] == values).sum(axis=1)

    a, b = (one - one.mean() for one in (ranks(x), ranks(y)))
    size = np.sqrt(np.sum(a * a) * np.sum(b * b))
    return float(np.sum(a * b) / size) if size > 0.0 else 0.0


def curves(groups, columns, points=200):
    """Columns of equal length for a CSV file: mean and range of ``columns`` over time for labelled ensembles."""
    end = common_end(*groups.values())
    t = np.linspace(0.0, end, points)
    made = {"t [s]": t}
    for label, group in groups.items():
        for column in columns:
            values = np.array([np.interp(t, one.results["t"], one.results[column]) for one in group])
            for what, reduce in (("mean", np.mean), ("lowest", np.min), ("highest", np.max)):
                made[f"{column}, {label}, {what}"] = reduce(values, axis=0)
    return made


def difference(values):
    """Largest difference between the means of ``values`` (number of sites -> one for each seed), over their mean."""
    means = [float(np.mean(one)) for one in values.values()]
    return (max(means) - min(means)) / np.mean(means) if max(means) > 0.0 else 0.0


def departures(result, begin, end):
    """Bubbles that depart a second, from ``begin`` to ``end`` [s]."""
    return sum(begin <= event[0] <= end for event in result.record["departures"]) / (end - begin)


def rises(values):
    """(bool, rank correlation): whether values (number of sites -> one for each seed) rise with the number of sites.

    The correlation is over all members; the mean for the most sites must also exceed that for the fewest.
    """
    sites = sorted(values)
    rank = rank_correlation([one for one in sites for _ in values[one]], [v for one in sites for v in values[one]])
    return bool(rank >= RISES and np.mean(values[sites[-1]]) > np.mean(values[sites[0]])), rank


def rising(rank, values):
    """Bounds for a quantity that rises with the number of sites, at most in proportion to it."""
    fewest, most = min(values), max(values)
    ratio = np.mean(values[most]) / np.mean(values[fewest]) if np.mean(values[fewest]) > 0.0 else float("nan")
    return [bound("rank correlation", [rank], RISES, 1.0), bound("most over fewest sites", [ratio], 1.0, most / fewest)]


class Sites(Figure):
    """The effect of the number of preset sites on the amount of superheated liquid and of vapour."""

    key = "fig1"
    title = "Figure 1: superheated liquid and the number of preset sites"

    def runs(self, quick):
        return [long_run(sites, seed, quick) for sites in counts(quick) for seed in seeds(quick)]

    def make(self, results, folder, quick):
        groups = {sites: members(results, f"long_dynamic_{sites}") for sites in counts(quick)}
        end = common_end(*groups.values())
        before, late, half = (0.5 * end, 0.75 * end), (0.75 * end, end), (0.5 * end, end)

        def over(measure, column, window):
            return {sites: [measure(one.results, column, *window) for one in group] for sites, group in groups.items()}

        level = over(mean_between, "n_superheated", late)
        changes = [last / max(first, 1.0) for sites, values in over(mean_between, "n_superheated", before).items()
                   for first, last in zip(values, level[sites])]
        rate = {sites: [departures(one.result, *half) for one in group] for sites, group in groups.items()}
        made, burst = over(rate_between, "produced", half), over(rate_between, "n_burst", half)
        power = {sites: [1e-3 * value for value in values]
                 for sites, values in over(rate_between, "energy_heater", half).items()}
        unit = "kW/m" if quick else "kW"  # 2-D or 3-D

        with plot(folder / "superheated.png", width=9.6, columns=2) as (left, right):
            for (sites, group), colour in zip(groups.items(), COLOURS):
                band(left, group, "n_superheated", named(sites), colour)
                band(right, group, "produced", named(sites), colour)
            left.axvspan(*late, color="#E6E9ED", zorder=0)
            for ax, what in ((left, "superheated particles [-]"), (right, "net particles vaporised [-]")):
                ax.set(xlabel="time [s]", ylabel=what, xlim=(0.0, end), ylim=(0.0, None))
            right.legend()
        write_csv(folder / "superheated.csv", curves(
            {named(sites): group for sites, group in groups.items()}, ("n_superheated", "produced")))
        write_csv(folder / "levels.csv", {
            "sites": [sites for sites, group in groups.items() for _ in group],
            **{name: [value for values in measured.values() for value in values] for name, measured in (
                ("superheated", level), ("departures [1/s]", rate), ("vaporised [1/s]", made), ("burst [1/s]", burst),
                (f"heater [{unit}]", power))}})
        vessels = sheet([(group[0].result, 0.8 * end, named(sites)) for sites, group in groups.items()],
                        folder / "vessels.png", "The vessels at the same time, seed 1.", columns=2)

        (_, rank), (_, heat_rank) = rises(rate), rises(power)
        total = groups[counts(quick)[0]][0].result.record["particles"]["fluid"]
        statements = [
            judged("Whatever the number of preset sites, the superheated count converges to a similar stable level.",
                   f"Means of the last quarter: {listed(level)} particles; they differ by {difference(level):.0%} of "
                   f"their mean, and are {spread(changes)} of those of the third quarter.",
                   [bound("difference", [difference(level)], 0.0, SIMILAR),
                    bound("last over third quarter", changes, 1.0 - STATIONARY, 1.0 + STATIONARY), bound(
                       "share of all particles", [value / total for values in level.values() for value in values],
                       SOME, MOST)],
                   "Fewer sites cool less of the liquid"
                   + ("" if any(max(values) for values in burst.values()) else
                      ". No region reaches the paper's threshold, 10 m_p L, which is a mean superheat of 94 K in a "
                      "region of 57 particles, so no burst bounds the rest"), not quick,
                   fair="Superheated is what is above saturation; levels are alike if they differ by a quarter, and "
                        "stable if they change by a tenth"),
            judged("The number of sites sets the rate at which bubbles are generated.",
                   f"Bubbles that depart in the second half: {listed(rate)} a second; rank correlation with the number "
                   f"of sites {rank:.2f}.", rising(rank, rate), "Bubbles of neighbouring sites merge before they "
                   "depart.", not quick,
                   fair="A rate of bubbles is a rate of departures: the heater alone sets how much becomes vapour. One "
                        "site more makes at most as many as each of the others"),
            judged("The number of sites sets the heat transfer.",
                   f"Heater power in the second half: {listed(power)} {unit}; rank correlation "
                   f"{heat_rank:.2f}.", rising(heat_rank, power),
                   "The temperature of the plate is given, which limits the flux for any number of sites.", not quick,
                   fair="The power is what the heater gave, by the ledger; 12 random values have such a rank "
                        "correlation one time in twenty"),
        ]
        rows = [[str(sites), *(spread(measured[sites]) for measured in (level, rate, made, burst, power))]
                for sites in groups]
        return self.section(
            pictures=[Picture("superheated.png", "Superheated particles (levels are means over the shaded time), and "
                              "particles vaporised since the start minus those condensed; mean and range over the "
                              "seeds."), vessels],
            tables=[Table(("sites", "superheated particles, last quarter", "departures [1/s]", "net vapour [1/s]",
                           "vapour by dynamic nucleation [1/s]", f"heater power [{unit}]"), rows,
                          "Second half, where nothing else is said; mean (range) over the seeds.")],
            statements=statements, data=["superheated.csv", "levels.csv"])


def named(sites):
    """Label of an ensemble."""
    return f"{sites} site{'s' if sites > 1 else ''}"


def listed(values):
    """Text of the means of ensembles, such as ``20, 22 (1, 4 sites)``."""
    return (", ".join(f"{np.mean(one):.3g}" for one in values.values()) +
            f" ({', '.join(str(sites) for sites in values)} sites)")

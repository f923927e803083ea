"""Figures 13 and 14: three models of boiling in one vessel, side by side."""
import numpy as np

from pysph_boiling.analysis.plots import BLUE, ORANGE, PURPLE
from pysph_boiling.evaluation.reproduce.figure import Figure
from pysph_boiling.evaluation.reproduce.sites import (
    common_end,
    counts,
    curves,
    mean_between,
    members,
    rate_between,
    seeds,
    vessel_run,
)
from pysph_boiling.report.pictures import band, movie, plot, rendered, sheet
from pysph_boiling.report.sections import Picture, Table, bound, judged, spread, write_csv

__all__ = ["NAMES", "ModesCounts", "ModesPictures", "bounded", "onset"]

NAMES = {"dynamic": "ours", "gu": "Gu et al.", "li_xiao": "Li & Xiao"}
COLOURS = {"dynamic": ORANGE, "gu": BLUE, "li_xiao": PURPLE}
CRITICAL = 647.1  # K, critical temperature of water
BOUNDED = 1.15  # largest ratio of the mean of the last third to that of the middle third


def bounded(table, column):
    """(bool, ratio): whether a column stops growing, from the ratio of its means over the last and the middle third."""
    t = float(table["t"][-1])
    middle = mean_between(table, column, t / 3.0, 2.0 * t / 3.0)
    last = mean_between(table, column, 2.0 * t / 3.0, t)
    ratio = last / middle if middle > 0.0 else float("inf") if last > 0.0 else 1.0
    return ratio <= BOUNDED, ratio


def onset(table):
    """Time of the first vapour [s]; the end of the run if there is none."""
    boiling = np.flatnonzero(table["n_vapour"] > 0)
    return float(table["t"][boiling[0] if len(boiling) else -1])


class ModesPictures(Figure):
    """The three models at equal times."""

    key = "fig13"
    title = "Figure 13: three models of boiling in one vessel"

    def runs(self, quick):
        sites = counts(quick)[2]
        return [vessel_run(sites, seed, quick, mode) for mode in NAMES for seed in seeds(quick)]

    def ensembles(self, results, quick):
        """Mode -> its runs."""
        return {mode: members(results, f"vessel_{mode}_{counts(quick)[2]}") for mode in NAMES}

    def make(self, results, folder, quick):
        groups = self.ensembles(results, quick)
        end = common_end(*groups.values())
        cells = [(groups[mode][0].result, share * end, f"{name}") for mode, name in NAMES.items()
                 for share in (0.4, 0.6, 0.8)]
        pictures = [sheet(cells, folder / "modes.png", "One vessel at three times (columns) in three models (rows). "
                          "In the model of Li & Xiao all sites emit within a few tenths of a second, and then wait.",
                          columns=3)]
        if not quick:
            pictures += [rendered(groups[mode][0].result, 0.8 * end, folder / f"{mode}.png",
                                  f"{name} at {0.8 * end:.1f} s.") for mode, name in NAMES.items()]
            pictures.append(movie(groups["dynamic"][0].result, folder / "ours.mp4", "Our model.", fps=10))

        half = (0.5 * end, end)
        bubbles = {mode: [mean_between(one.results, "n_bubbles", *half) for one in group]
                   for mode, group in groups.items()}
        vented = {mode: [rate_between(one.results, "n_vented", *half) for one in group]
                  for mode, group in groups.items()}
        made = {mode: [rate_between(one.results, "produced", *half) for one in group] for mode, group in groups.items()}
        write_csv(folder / "bubbles.csv", {
            "mode": [mode for mode, group in groups.items() for _ in group],
            **{name: sum(measured.values(), []) for name, measured in (
                ("bubbles", bubbles), ("made vapour [1/s]", made), ("vented [1/s]", vented))}})
        rows = [[NAMES[mode], *(spread(measured[mode]) for measured in (bubbles, made, vented))] for mode in NAMES]
        sites = counts(quick)[2]
        statements = [judged(
            "In the model of Li & Xiao the number of bubbles is limited by the number of sites; it is not in ours.",
            f"Number of bubbles in the second half with {sites} sites: {spread(bubbles['li_xiao'])} in theirs, "
            f"{spread(bubbles['dynamic'])} in ours, {spread(bubbles['gu'])} in that of Gu et al.",
            [bound("theirs a site", [n / sites for n in bubbles["li_xiao"]], 0.01, 1.0),
             bound("ours a site", [n / sites for n in bubbles["dynamic"]], 1.0, 20.0)],  # more would be a foam
            "In the small form their model has hardly begun to boil." if quick else
            "Their model emits whole bubbles, and several bubbles from one site may be rising at a time.", not quick,
                             fair="Nine sites in each; a bubble counts as long as it is in the vessel, and every run "
                                  "of ours must have more than each of theirs")]
        return self.section(
            pictures=pictures, statements=statements, data=["bubbles.csv"],
            tables=[Table(("model", "bubbles at a time", "net vapour [1/s]", "vented [1/s]"), rows,
                          "Means over the second half of the runs; mean (range) over the seeds.")])


class ModesCounts(ModesPictures):
    """Superheated liquid over time in the three models."""

    key = "fig14"
    title = "Figure 14: superheated liquid in three models of boiling"

    def make(self, results, folder, quick):
        groups = self.ensembles(results, quick)
        end = common_end(*groups.values())
        half = (0.5 * end, end)
        with plot(folder / "superheated.png", width=9.6, columns=2) as (left, right):
            for mode, group in groups.items():
                band(left, group, "n_superheated", NAMES[mode], COLOURS[mode])
                band(right, group, "T_max", NAMES[mode], COLOURS[mode])
            left.set(xlabel="time [s]", ylabel="superheated particles [-]", xlim=(0.0, end))
            right.set(xlabel="time [s]", ylabel="highest temperature [K]", xlim=(0.0, end))
            left.legend()
        write_csv(folder / "superheated.csv", curves(
            {NAMES[mode]: group for mode, group in groups.items()}, ("n_superheated", "T_max", "T_mean")))

        count, hottest, warm = ({mode: [mean_between(one.results, column, *half) for one in group]
                                 for mode, group in groups.items()} for column in ("n_superheated", "T_max", "T_mean"))
        none = max(float(one.results["n_superheated"].max()) for one in groups["gu"])
        ours = [bounded(one.results, "n_superheated") for one in groups["dynamic"]]
        theirs = [bounded(one.results, "n_superheated")[1] for one in groups["li_xiao"]]
        starts = {mode: [onset(one.results) for one in group] for mode, group in groups.items()}
        bursts = [100.0 * rate_between(one.results, "n_burst", 0.0, end)
                  / rate_between(one.results, "produced", 0.0, end) for one in groups["dynamic"]]
        total = groups["gu"][0].result.record["particles"]["fluid"]
        statements = [
            judged("The model of Gu et al. cannot superheat liquid.",
                      f"At most {none:.0f} superheated particles at any time, in every run.",
                   [bound("superheated particles", [none], 0, 0), bound("share that is vapour, second half", [
                       mean_between(one.results, "n_vapour", *half) / total for one in groups["gu"]], 1e-4, 0.5)],
                   fair="No particle may be superheated in any row of any run, while the vessel boils"),
            judged("Ours superheats, and dynamic nucleation keeps that bounded.",
                      f"{spread(count['dynamic'])} superheated particles in the second half; the ratio of the last to "
                      f"the middle third is {spread([ratio for _, ratio in ours])}; the first vapour forms at "
                      f"{spread(starts['dynamic'])} s, and dynamic nucleation makes {spread(bursts)} % of it.",
                   [bound("last over middle third", [ratio for _, ratio in ours], 1.0 / BOUNDED, BOUNDED),
                    bound("share of all particles", [n / total for n in count["dynamic"]], 0.001, 0.5)],
                   "The pool still warms, so more of it is counted as superheated." if max(bursts) > 0.0 else
                   "No region burst: what bounds it is the sites.", conclusive=max(bursts) > 0.0,
                   fair="Bounded is a last third within 15 % of the middle one; something must burst, or nothing is "
                        "told of dynamic nucleation"),
            judged("Li & Xiao's superheats more liquid than ours once it boils.",
                      f"{spread(count['li_xiao'])} superheated particles in the second half, in ours "
                      f"{spread(count['dynamic'])}; in theirs the number grows by a factor of {spread(theirs)} from "
                      f"the middle to the last third, and the first vapour forms at {spread(starts['li_xiao'])} s.",
                   [bound("particles in theirs", count["li_xiao"], max(count["dynamic"]), total)],
                   fair="Every run of theirs must have more than each of ours, up to all particles"),
            judged("Nothing releases the excess energy there: it gets hotter than ours.",
                      "Highest temperature of liquid or vapour, mean over the second half: "
                      f"{spread(hottest['li_xiao'], digits=4)} K, in ours {spread(hottest['dynamic'], digits=4)} K; "
                      f"mean temperature {spread(warm['li_xiao'], digits=4)} and "
                      f"{spread(warm['dynamic'], digits=4)} K.",
                   [bound("temperature in theirs in K", hottest["li_xiao"], max(hottest["dynamic"]), CRITICAL)],
                   fair="Every run of theirs must be hotter than each of ours, and below the critical point of water"),
        ]
        rows = [[NAMES[mode], *(spread(measured[mode], digits=4) for measured in (count, hottest, warm))]
                for mode in NAMES]
        return self.section(
            pictures=[Picture("superheated.png", "Superheated particles and highest temperature (in the model of Gu et "
                              "al., that of vapour); mean and range over the seeds.")],
            tables=[Table(("model", "superheated particles", "highest temperature [K]", "mean temperature [K]"), rows,
                          "Means over the second half; mean (range) over the seeds.")],
            statements=statements, data=["superheated.csv"])

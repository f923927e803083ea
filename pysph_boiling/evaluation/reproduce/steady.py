"""Figures 3, 4 and 15: steady boiling, cooling after the heater is switched off, and the mean radius of bubbles.

The paper credits the oscillation constraint for what it sees in them, so each is run with and without it.
"""
import numpy as np

from pysph_boiling.analysis.departures import departed
from pysph_boiling.analysis.plots import BLUE, GREEN, ORANGE, PURPLE
from pysph_boiling.evaluation.reproduce.figure import Figure
from pysph_boiling.evaluation.reproduce.runs import Run
from pysph_boiling.evaluation.reproduce.sites import common_end, curves, members, rate_between, seeds
from pysph_boiling.particles import positions
from pysph_boiling.phases import Phase
from pysph_boiling.report.pictures import band, movie, plot, rendered, sheet
from pysph_boiling.report.sections import Picture, Table, bound, judged, spread, write_csv

__all__ = ["BubbleRadius", "Cooling", "SteadyBoiling", "phases_of_growth", "surface", "surface_history", "variation"]

STEADY = 0.25  # largest standard deviation of the vapour production over equal windows, in units of its mean
MADE = 1e-4, 0.2  # range of the fraction of all particles vaporised in a window; at 0.2 the pool lasts five windows
GAP = 1.0  # longest time without a departure [s]
SCATTER = 1.0  # largest scatter of a site's period; departures at random times have 1
SMALL = "--flat", "--width", "30", "--fill", "14", "--sites", "3", "--results-every", "4"  # of the quick form
OSCILLATING = "--oscillation.form", "hysteresis"
NOT_ACTING = "--oscillation.min-particles", "1000000"
BURSTING = "--dynamic-nucleation.superheat-limit", "28", "--dynamic-nucleation.radius", "2.4"  # of superheat_sites
CALM = 0.2  # largest surface speed at the end, in units of its peak
STILL = 1e-4  # smallest surface speed at the end: waves decay slowly, so a surface at rest would be an artefact
PEAK = 1.10  # smallest ratio of the early peak of the mean radius to its level at the end
PLATEAU = 0.10  # largest change of the mean radius within the last third, in units of its mean there


def steady_run(seed, quick, oscillating=True):
    """A run of steady boiling with dynamic nucleation, with or without the oscillation constraint."""
    size = (*SMALL, "--duration", "1.0", "--frame", "0.1") if quick else (
        "--duration", "10", "--frame", "0.05" if seed == 1 and oscillating else "0.25")
    return Run(f"steady{'' if oscillating else '_plain'}_seed{seed}", "steady_boiling",
               ("--seed", str(seed), *BURSTING, *(OSCILLATING if oscillating else ()), *size))


def cooling_run(seed, quick, oscillating=True):
    """A run of cooling, with or without the oscillation constraint."""
    size = (*SMALL, "--duration", "1.7", "--heater-until", "0.4") if quick else ()
    return Run(f"cooling{'' if oscillating else '_plain'}_seed{seed}", "cooling",
               ("--seed", str(seed), *(OSCILLATING if oscillating else ()), *size, "--frame", "0.05"))


def radius_run(seed, quick, oscillating=True):
    """A run of the vessel whose lowest quarter starts above the limit at which regions burst.

    Without oscillation the constraint is there, because it measures the radius, but no bubble is large enough for it.
    """
    size = (*SMALL, "--duration", "1.0") if quick else ()
    return Run(f"radius{'' if oscillating else '_plain'}_seed{seed}", "superheat_sites", (
        "--seed", str(seed), "--start-superheat", "45", *OSCILLATING, *(() if oscillating else NOT_ACTING), *size,
        "--frame", "0.1"))


def variation(table, column, begin, end, windows):
    """Growth of a cumulative column in equal windows from ``begin`` to ``end`` [s]: (values, deviation over mean)."""
    grown = np.diff(np.interp(np.linspace(begin, end, windows + 1), table["t"], table[column]))
    mean = float(np.mean(grown))
    return grown, float(np.std(grown)) / mean if mean > 0.0 else float("inf")


def surface(fluid, *, dim, spacing):
    """(level [m], roughness [m], speed [m/s]) of the liquid's surface in a vessel.

    The fluid is divided into vertical columns two spacings wide. The highest liquid of each column is its surface; the
    level is the mean of their heights, the roughness their standard deviation, and the speed the root mean square over
    particles up to two spacings below the surface of their column.
    """
    points = positions(fluid)[:, :dim]
    velocity = np.stack([fluid.u, fluid.v, fluid.w], -1)
    liquid = np.asarray(fluid.phase) != Phase.VAPOUR
    across, height = np.floor(points[liquid, :dim - 1] / (2.0 * spacing)).astype(int), points[liquid, dim - 1]
    _, column = np.unique(across, axis=0, return_inverse=True)
    column = column.ravel()
    top = np.full(column.max() + 1, -np.inf)
    np.maximum.at(top, column, height)
    upper = height > top[column] - 2.0 * spacing
    speed = np.sqrt(np.mean(np.sum(velocity[liquid][upper] ** 2, axis=1)))
    return float(top.mean()), float(top.std()), float(speed)


def surface_history(result):
    """Columns ``t``, ``level``, ``roughness`` and ``speed`` from the outputs of a run."""
    rows = []
    for time in result.times:
        rows.append((time, *surface(result.particles(time)["fluid"], dim=result.dim, spacing=result.spacing)))
    return dict(zip(("t", "level", "roughness", "speed"), np.array(rows).T))


def phases_of_growth(t, radius, width=0.1):
    """(peak, when, level, change) of the mean radius of the bubbles, from times [s] and radii [m].

    The radius is averaged over the fraction ``width`` of the time since the first bubble. ``peak`` [m] is the largest
    value in the first half of this time, ``when`` its position as a fraction of the time, ``level`` [m] the mean over
    the last third, and ``change`` the rise of a straight line through the last third in units of the level. Raises
    ``ValueError`` if there is no bubble.
    """
    there = np.flatnonzero(radius > 0.0)
    if len(there) == 0:
        raise ValueError("there are no bubbles, so there is no mean radius")
    share = np.linspace(0.0, 1.0, 501)
    since = t[there[0]] + share * (t[-1] - t[there[0]])
    values = np.interp(since, t[there], radius[there])
    half = max(1, int(0.5 * width * len(share)))
    smooth = np.array([values[max(0, i - half):i + half + 1].mean() for i in range(len(share))])
    early, late = share <= 0.5, share >= 2.0 / 3.0
    best = int(np.argmax(np.where(early, smooth, -np.inf)))
    level = float(smooth[late].mean())
    change = float(np.polyfit(share[late], smooth[late], 1)[0]) / 3.0 / level
    return float(smooth[best]), float(share[best]), level, change


class SteadyBoiling(Figure):
    """Steady boiling: bubbles continuously grow at sites, depart, rise and break through the surface."""

    key = "fig3"
    title = "Figure 3: steady boiling"

    def runs(self, quick):
        return [steady_run(seed, quick, on) for on in (True, False) for seed in seeds(quick)]

    def make(self, results, folder, quick):
        group, plain = members(results, "steady"), members(results, "steady_plain")
        end = common_end(group)
        begin, windows = (0.4 * end, 4) if quick else (0.25 * end, 6)
        first = group[0].result
        moments = [begin + share * (end - begin) for share in (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)]
        pictures = [sheet([(first, t, "") for t in moments], folder / "steady.png", "Steady boiling, seed 1.")]
        if not quick:
            pictures += [rendered(first, t, folder / f"steady_{number}.png", f"The same run at {t:.1f} s.")
                         for number, t in enumerate(moments[2:5:2])]
            pictures.append(movie(first, folder / "steady.mp4", "The same run as a movie.", fps=10))
        with plot(folder / "history.png", width=9.6, columns=2) as (left, right):
            band(left, group, "produced", "net vaporised", ORANGE)
            band(left, group, "n_vented", "vented", GREEN)
            band(right, group, "n_bubbles", "bubbles", BLUE)
            left.set(xlabel="time [s]", ylabel="particles since the start [-]", xlim=(0.0, end), ylim=(0.0, None))
            right.set(xlabel="time [s]", ylabel="bubbles [-]", xlim=(0.0, end), ylim=(0.0, None))
            left.legend()
        pictures.append(Picture("history.png", "Net particles vaporised and particles vented since the start, and "
                                "bubbles in the vessel; mean and range over the seeds."))
        write_csv(folder / "history.csv", curves({"steady boiling": group}, (
            "n_vapour", "n_bubbles", "produced", "n_vented", "n_bubbles_vented", "n_condensed")))

        seconds = (end - begin) / windows
        made, deviations = zip(*(variation(one.results, "produced", begin, end, windows) for one in group))
        on, off = ([departed(one.result.record["departures"], end) for one in ensemble] for ensemble in (group, plain))
        burst = [float(one.results["n_burst"][-1]) for one in group]
        reached = [float(rate_between(one.results, "n_bubbles_vented", begin, end)) for one in group]
        periods, scatters = (np.concatenate([[getattr(site, name) for site in one.sites] for one in on])
                             for name in ("period", "scatter"))
        told = np.isfinite(scatters)
        rhythm = (f"; the period of a site is {spread(periods[told], 's')}, its scatter {spread(scatters[told])}"
                  if told.any() else "")
        statements = [
            judged("Bubble generation is consistent.",
                   f"Net vapour production in {windows} windows of {seconds:.2g} s deviates by {spread(deviations)} "
                   "of its mean.", [bound("deviation", deviations, 0.0, STEADY), bound(
                       "particles made in a window, of all", [grown.mean() / one.result.record["particles"]["fluid"]
                                                              for one, grown in zip(group, made)], *MADE)],
                   "The small form makes too few bubbles." if quick else "", not quick,
                   fair="A quarter is what a dozen bubbles in a window scatter by; less than one particle in ten "
                        "thousand would be no boil, and a fifth in each window would dry the vessel"),
            judged("Nucleation cycles are stable: bubbles keep growing, departing and breaking the surface.",
                   f"{spread(one.rate for one in on)} bubbles depart a second, and at most "
                   f"{spread([one.gap for one in on], 's')} pass without one; {spread(reached)} a second reach the "
                   f"surface{rhythm}.",
                   [bound("longest time without a departure in s", [one.gap for one in on], 0.0, GAP),
                    bound("scatter of periods", scatters[told], 0.0, SCATTER) if told.any() else
                    bound("sites with a period", [0], 1, 100),
                    bound("bubbles at the surface over departures",
                          [at / one.rate for at, one in zip(reached, on)], 0.2, 2.0)],
                   "The small form makes too few bubbles." if quick else
                   "Sites that draw a high superheat wait for longer than their mean period.", not quick,
                   fair="Sites are at random places and have cavities of their own. A cycle is stable if it goes on: "
                        "no second passes without a bubble, and a site's periods scatter by less than random times; "
                        "bubbles merge on their way, so fewer arrive"),
        ]
        rows = [[name, str(number), f"{one.rate:.3g}", f"{one.gap:.2g}", f"{np.median(one.sizes):.3g}"]
                for name, ensemble in (("with", on), ("without", off)) for number, one in enumerate(ensemble, 1)
                if len(one.sizes)]
        return self.section(
            pictures=pictures, statements=statements, data=["history.csv"],
            text=f"Dynamic nucleation made {spread(burst)} particles of vapour. The oscillation constraint changes the "
                 f"departures from {spread(one.rate for one in off)} to {spread(one.rate for one in on)} a second, and "
                 f"moves bubbles {spread(one.results['n_pushed'][-1] for one in group)} times.",
            tables=[Table(("oscillation", "seed", "departures [1/s]", "longest time without [s]",
                           "median size [particles]"), rows)])


class Cooling(Figure):
    """Cooling: after the heater is switched off, the vapour disappears and the surface comes to rest."""

    key = "fig4"
    title = "Figure 4: after heating was stopped"

    def runs(self, quick):
        return [cooling_run(seed, quick, on) for on in (True, False) for seed in seeds(quick)]

    def make(self, results, folder, quick):
        group, plain = members(results, "cooling"), members(results, "cooling_plain")
        end = common_end(group)
        first = group[0].result
        off = float(first.record["parameters"]["heater_until"]["value"])
        moments = [0.8 * off, off, *(off + share * (end - off) for share in (0.1, 0.3, 0.6, 1.0))]
        pictures = [sheet([(first, t, "heating" if t < off else "heater off") for t in moments],
                          folder / "cooling.png", f"The heater is switched off at {off:.2g} s, seed 1.")]
        if not quick:
            pictures += [rendered(first, moments[number], folder / f"cooling_{number}.png",
                                  f"The same run at {moments[number]:.1f} s.") for number in (1, 3, 5)]
            pictures.append(movie(first, folder / "cooling.mp4", "The same run as a movie.", fps=10))
        surfaces = [surface_history(one.result) for one in group]
        with plot(folder / "history.png", width=12.8, columns=3) as (vapour, level, speed):
            band(vapour, group, "n_vapour", "vapour", ORANGE)
            band(vapour, group, "n_condensed", "condensed since the start", BLUE)
            band(vapour, group, "n_bubbles", "bubbles", PURPLE)
            vapour.legend()
            for ax, name, what, scale in ((level, "roughness", "roughness of the surface [mm]", 1e3),
                                          (speed, "speed", "speed of the surface [m/s]", 1.0)):
                for number, history in enumerate(surfaces, 1):
                    ax.plot(history["t"], scale * history[name], label=f"seed {number}",
                            color=(BLUE, ORANGE, GREEN)[number - 1])
                ax.set(ylabel=what)
                ax.legend()
            for ax in (vapour, level, speed):
                ax.axvline(off, color="#B0B5BC", linestyle="--", linewidth=1.0)
                ax.set(xlabel="time [s]", xlim=(0.0, end), ylim=(0.0, None))
        pictures.append(Picture("history.png", "Vapour, condensed particles and bubbles (mean and range over the "
                                "seeds), roughness and speed of the surface; the dashed line marks the time at which "
                                "the heater is switched off."))
        write_csv(folder / "history.csv", curves({"cooling": group}, (
            "n_vapour", "n_bubbles", "n_condensed", "produced", "n_vented", "n_superheated", "T_mean")))
        write_csv(folder / "surface.csv", {
            "seed": sum(([number] * len(history["t"]) for number, history in enumerate(surfaces, 1)), []),
            **{f"{name} [{unit}]": np.concatenate([history[name] for history in surfaces])
               for name, unit in (("t", "s"), ("level", "m"), ("roughness", "m"), ("speed", "m/s"))}})

        before = [float(np.interp(off, one.results["t"], one.results["n_vapour"])) for one in group]
        after = [float(one.results["n_vapour"][-1]) for one in group]
        condensed = [rate_between(one.results, "n_condensed", off, end) * (end - off) for one in group]
        vented = [rate_between(one.results, "n_vented", off, end) * (end - off) for one in group]
        gone = [gone_after(one.results, off) for one in group]
        peak, rest = ({name: [float(measure(one[name][one["t"] >= begin])) for one in surfaces]
                       for name in ("speed", "roughness")}
                      for measure, begin in ((np.max, 0.0), (np.mean, end - 0.15 * (end - off))))
        slower = [b / a for a, b in zip(peak["speed"], rest["speed"])]
        statements = [
            judged("Bubbles condense once the heat source is removed.",
                      f"Of {spread(before)} vapour particles at that time, {spread(condensed)} condense and "
                      f"{spread(vented)} leave at the surface.", [bound("share that condenses", [
                          a / max(a + b, 1.0) for a, b in zip(condensed, vented)], 0.01, 1.0)],
                   fair="Some of the vapour condenses; all of it would be 1"),
            judged("The vapour disappears gradually.",
                      f"{spread(after)} vapour particles are left after {end - off:.2g} s" +
                      (f"; the last is gone after {spread(gone)} s." if None not in gone else "."),
                      [bound("vapour particles left", after, 0, 0), bound("share of the time it takes", [
                          (end - off if one is None else one) / (end - off) for one in gone], 0.05, 1.0)],
                      "Vapour conducts badly, so bubbles that cling to the base condense slowly.",
                   fair="None may be left at the end, and it must take a twentieth of the time: what is gone at once "
                        "does not disappear gradually"),
            judged("The surface settles.",
                      f"Its speed falls from {spread(peak['speed'])} m/s at most to {spread(rest['speed'])} m/s at the "
                      f"end, its roughness from {spread([1e3 * value for value in peak['roughness']])} to "
                      f"{spread([1e3 * value for value in rest['roughness']])} mm.",
                      [bound("speed over its peak", slower, STILL, CALM)],
                   fair="A fifth of its peak; a surface exactly at rest would be an artefact, since waves decay "
                        "slowly"),
        ]
        bare = [rate_between(one.results, "n_condensed", off, end) * (end - off) for one in plain]
        bare_gone = [one for one in (gone_after(member.results, off) for member in plain) if one is not None]
        return self.section(
            pictures=pictures, statements=statements, data=["history.csv", "surface.csv"],
            text=f"Without the oscillation constraint {spread(bare)} particles condense, and the vapour is gone "
                 + (f"after {spread(bare_gone)} s in {len(bare_gone)} of {len(plain)} runs." if bare_gone else
                    "in none of the runs."))


def gone_after(table, off):
    """Time [s] after ``off`` from which there is no more vapour; ``None`` if some is left at the end."""
    there = np.flatnonzero(table["n_vapour"] > 0.0)
    if len(there) == 0:
        return 0.0
    if there[-1] == len(table["t"]) - 1:
        return None
    return max(0.0, float(table["t"][there[-1] + 1]) - off)


class BubbleRadius(Figure):
    """The mean radius of the bubbles over time (eq. 24), from a superheated start on."""

    key = "fig15"
    title = "Figure 15: mean radius of the bubbles"

    def runs(self, quick):
        return [radius_run(seed, quick, on) for on in (True, False) for seed in seeds(quick)]

    def make(self, results, folder, quick):
        group, plain = members(results, "radius"), members(results, "radius_plain")
        end = common_end(group, plain)
        with plot(folder / "radius.png") as ax:
            band(ax, group, "bubble_distance_mean", "with the oscillation constraint", ORANGE, scale=1e3)
            band(ax, plain, "bubble_distance_mean", "without it", BLUE, scale=1e3)
            ax.legend()
            ax.set(xlabel="time [s]", ylabel="mean radius of the bubbles [mm]", xlim=(0.0, end), ylim=(0.0, None))
        write_csv(folder / "radius.csv", curves({"with oscillation": group, "without": plain}, (
            "bubble_distance_mean", "bubble_radius_mean", "n_bubbles")))
        growth, bare = ([phases_of_growth(one.results["t"], one.results["bubble_distance_mean"]) for one in ensemble]
                        for ensemble in (group, plain))
        peaks, bare_peaks = ([peak / level for peak, _, level, _ in ensemble] for ensemble in (growth, bare))
        changes = [change for *_, change in growth]
        small = "The small form is too short and has too few bubbles." if quick else ""
        levels = [1e3 * one[2] for one in growth]
        statements = [
            judged("The mean radius peaks early and then relaxes.",
                      f"Largest value in the first half: {spread(peaks)} times the level at the end, after "
                      f"{spread([when for _, when, *_ in growth])} of the boiling time.",
                      [bound("peak over level", peaks, PEAK, 3.0)], small or
                      "The first bubbles burst at many places and are as small as later ones.", not quick,
                   fair="A tenth above the level is seen in a curve; the lowest quarter of the water starts 45 K "
                        "above saturation, above the limit of 28 K at which it bursts, as boiling that is 'initially "
                        "accelerated by local superheating' means"),
            judged("Then it stays at a stable level.",
                      f"{spread(levels)} mm in the last third, where it changes by "
                      f"{spread([100.0 * change for change in changes])} %.",
                      [bound("change", changes, -PLATEAU, PLATEAU), bound("level in spacings", [
                          1e-3 * one / group[0].result.record["spacing"] for one in levels], 0.3, 8.0)], small,
                   not quick,
                   fair="Within a tenth over the last third of the time"),
        ]
        return self.section(
            pictures=[Picture("radius.png", "Mean radius of the bubbles by eq. 24 of the paper; mean and range over "
                              "the seeds.")],
            statements=statements, data=["radius.csv"],
            text=f"Without the oscillation constraint the peak is {spread(bare_peaks)} times the level, which is "
                 f"{spread([1e3 * level for _, _, level, _ in bare])} mm and changes by "
                 f"{spread([100.0 * change for *_, change in bare])} %.")

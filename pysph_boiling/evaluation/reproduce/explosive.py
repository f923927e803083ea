"""Figures 5 and 6: explosive boiling, and the same without the oscillation constraint."""
import math

import numpy as np

from pysph_boiling.analysis.level import level_history
from pysph_boiling.evaluation.reproduce.figure import Figure
from pysph_boiling.evaluation.reproduce.runs import Run
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.phases import Phase
from pysph_boiling.report.sections import Picture, Table, bound, judged, spread, write_csv

__all__ = ["Figure5", "Figure6", "energy_parts", "settled"]

WINDOWS, STEADY = 4, 0.25  # windows of a heated run after its first quarter; fewest bursts in one, of the mean
FIRED = 0.01  # smallest fraction of all particles in a large burst
FAST = 0.5  # s; an explosion makes half of all vapour in this time
USED = 0.75  # fraction of the excess sensible heat that must be used when the vapour peaks
SWOLLEN, SETTLED = 0.05, 0.5  # smallest rise of the level; largest fraction of that rise left at the end
CALMED = 0.5  # largest fraction of the highest superheat left when the vapour peaks
PAID = 1.75  # rise over that from the excess heat: bubbles oscillate in phase, drops fly, voids open
SUNK = -0.2  # lowest final level as a fraction of the rise: a pool that ends lower has lost volume
CLOSED = 1e-10  # largest energy that is unaccounted for, relative to the excess at the start

SEEDS = {True: (1, 2), False: (1, 2, 3)}
QUICK = ("--flat", "--width", "24", "--fill", "16", "--duration", "0.7", "--frame", "0.0333")


def explosions(quick, *options, name="explosive"):
    """One run per seed; ``options`` are added to the scene's defaults."""
    size = QUICK if quick else ()
    return [Run(f"{name}{'_quick' if quick else ''}_{seed}", "explosive_boiling",
                (*size, "--seed", str(seed), *options)) for seed in SEEDS[quick]]


def without_oscillation(quick):
    return explosions(quick, "--no-oscillation", name="explosive_no_oscillation")


def heated(quick):
    """Runs without oscillation whose base is heated, so that liquid goes on superheating."""
    base = ("120", "--superheat-limit", "60", "--duration", "1.0") if quick else ("120", "--duration", "3")
    return explosions(quick, "--no-oscillation", "--base-superheat", *base, name="explosive_heated")


# --- what is measured -------------------------------------------------------------------------------------------------

def energy_parts(m, e, phase, e_lat, material=WATER_1ATM):
    """Enthalpy [J] of the particles by kind: a dict whose values add up to sum(m e).

    Parameters
    ----------
    m, e : array (n,)      Mass [kg] and specific enthalpy [J/kg].
    phase : array (n,)     See :class:`~pysph_boiling.phases.Phase`.
    e_lat : array (n,)     Latent heat held by interrupted particles [J/kg].
    """
    hot, vapour = phase == Phase.SUPERHEATED, phase == Phase.VAPOUR
    held = np.where(hot, np.minimum(e, e_lat), 0.0)
    stored = (phase == Phase.TRANSITION) | ((phase == Phase.LIQUID) & (e >= 0.0))
    return {
        "excess sensible heat of superheated liquid": float(np.sum((m * (e - held))[hot])),
        "latent heat of vapour": float(np.sum((m * np.minimum(e, material.L))[vapour])),
        "latent heat stored in liquid": float(np.sum((m * e)[stored]) + np.sum(m * held)),
        "sensible heat of vapour": float(np.sum((m * np.maximum(e - material.L, 0.0))[vapour])),
        "sensible heat of liquid below saturation": float(np.sum((m * e)[(phase == Phase.LIQUID) & (e < 0.0)])),
    }


def parts_of(result, t):
    """:func:`energy_parts` of the last output up to ``t`` [s], and its time [s]."""
    particles = result.particles(t)
    fluid = particles["fluid"]
    return energy_parts(fluid.m, fluid.e, fluid.phase, fluid.e_lat), particles.time


def settled(t, level):
    """(swelling relative to the start, its time [s], the fraction of it left at the end) of a level over time."""
    rise = np.asarray(level) / level[0] - 1.0
    peak = int(np.argmax(rise))
    return float(rise[peak]), float(t[peak]), float(rise[-1] / rise[peak]) if rise[peak] > 0.0 else 0.0


def output_at_peak(outputs, t, number):
    """Time [s] of the first of the ``outputs`` at or after the largest ``number`` at the times ``t``, or of the last.

    The nearest could be before what makes the peak, as the start is before a burst.
    """
    after = np.searchsorted(outputs, t[np.argmax(number)] - 1e-9)
    return float(outputs[min(after, len(outputs) - 1)])


def measure(result):
    """The measured quantities of one explosion, by name."""
    table = result.results
    total = result.record["particles"]["fluid"]
    made = table["n_burst"] + table["n_nucleated"]
    t, level = level_history(result.files, dim=result.record["dim"])
    swelling, t_swelling, left = settled(t, level)
    peak = output_at_peak(t, table["t"], table["n_vapour"])
    before, _ = parts_of(result, 0.0)
    after, t_after = parts_of(result, peak)
    excess = "excess sensible heat of superheated liquid"
    material, mass = WATER_1ATM, float(table["mass"][0])
    v_exp = result.record["effects"].get("expansion", {}).get("v_exp", {}).get("value", 1.0)
    lid = float(np.interp(t_after, table["t"], table["energy_lid"]))
    return {
        "burst": float(table["n_burst"][-1]), "share": float(table["n_burst"][-1]) / total,
        # vapour that the excess heat can make, as a fraction of all particles and as a rise of the level; and the time
        # that a bubble needs to grow to the size of a particle against inertia (Rayleigh)
        "paid": before[excess] / (material.L * mass), "swell": before[excess] / (material.L * mass) * (v_exp - 1.0),
        "inertia": result.record["spacing"] / math.sqrt(
            2.0 / 3.0 * material.L * material.rho_v * (float(table["T_max"][0]) - material.T_sat)
            / (material.rho_l * material.T_sat)),
        "fired": float(table["n_fired"][-1]), "nucleated": float(table["n_nucleated"][-1]),
        "half": float(table["t"][np.argmax(made >= 0.5 * made[-1])]), "t_peak": t_after, "before": before,
        "after": after, "lid": lid, "T_start": float(table["T_max"][0]),
        "T_end": float(np.interp(peak, table["t"], table["T_max"])),
        "latent": (after["latent heat of vapour"] + lid) / before[excess], "used": 1.0 - after[excess] / before[excess],
        "gap": abs(sum(after.values()) + lid - sum(before.values())) / before[excess],
        "t": t, "level": level, "swelling": swelling, "t_swelling": t_swelling, "left": left,
    }


# --- what is drawn ----------------------------------------------------------------------------------------------------

def moments(row):
    """Times [s] of the pictures: the start, the onset, growth, the level's peak, the surface breaking, and the end.

    ``row`` is the result of :func:`measure` for the run.
    """
    peak, end = row["t_swelling"], row["t"][-1]
    return [0.0, 0.25 * peak, 0.6 * peak, peak, min(1.6 * peak, end), end]


def percent(rows, name):
    """Text for a fraction over an ensemble, in per cent."""
    return spread((100.0 * row[name] for row in rows), "%")


def draw_history(figures, path, csv):
    """Draw level and counts over time for the ensembles in ``figures``: label -> (results, measures, colour)."""
    from pysph_boiling.report.pictures import band, plot

    columns = {"t [s]": next(iter(figures.values()))[1][0]["t"]}
    with plot(path, width=10.5, height=3.4, columns=3) as axes:
        for label, (results, measures, colour) in figures.items():
            t = measures[0]["t"]
            levels = np.array([np.interp(t, row["t"], row["level"]) for row in measures])
            axes[0].plot(t, 1e3 * levels.mean(axis=0), color=colour, label=label)
            axes[0].fill_between(t, 1e3 * levels.min(axis=0), 1e3 * levels.max(axis=0), color=colour, alpha=0.2,
                                 linewidth=0.0)
            band(axes[1], results, "n_vapour", label, colour)
            band(axes[2], results, "n_burst", label, colour)
            for result, row in zip(results, measures):
                name = f"{label}, seed {result.record['seed']}"
                columns[f"level, {name} [m]"] = np.interp(columns["t [s]"], row["t"], row["level"])
                for column in ("n_vapour", "n_burst", "n_superheated", "n_bubbles"):
                    columns[f"{column}, {name} [-]"] = np.interp(columns["t [s]"], result.results["t"],
                                                                 result.results[column])
        for ax, title, unit in zip(axes, ("level", "vapour", "vapour by dynamic nucleation"),
                                   ("height [mm]", "particles [-]", "particles since the start [-]")):
            ax.set(title=title, xlabel="time [s]", ylabel=unit)
        axes[0].legend()
    return write_csv(csv, columns)


def balance_table(row):
    """A table of the energy of one explosion, before the burst and at the peak of vapour."""
    before, after = row["before"], row["after"]
    rows = [[name, f"{value:.4g}", f"{after[name]:.4g}", f"{after[name] - value:+.4g}"]
            for name, value in before.items()]
    rows.append(["left through the lid (ledger)", "0", f"{row['lid']:.4g}", f"{row['lid']:+.4g}"])
    start, end = sum(before.values()), sum(after.values()) + row["lid"]
    rows.append(["sum", f"{start:.6g}", f"{end:.6g}", f"{end - start:+.1e}"])
    return Table(("energy [J]", "before the burst", f"at t = {row['t_peak']:.2f} s", "change"), rows,
                 "Energy balance of the burst, from the particle files of the first seed and the ledger; in 2-D, per "
                 "metre of depth.")


class Figure5(Figure):
    """Explosive boiling."""

    key = "fig5"
    title = "Figure 5: explosive boiling"

    def runs(self, quick):
        return explosions(quick)

    def make(self, results, folder, quick):
        from pysph_boiling.analysis.plots import BLUE
        from pysph_boiling.report.pictures import movie, rendered, sheet

        results = list(results.values())
        rows = [measure(result) for result in results]
        times = moments(rows[0])
        pictures = [sheet([(results[0], t, "") for t in times], folder / "moments.png",
                          "A superheated layer without sites bursts: the pool foams and swells, vapour breaks through "
                          "the surface, and the pool settles. Vapour is red, superheated liquid orange, and liquid "
                          "that stores latent heat yellow.")]
        if not quick:
            for number, t in enumerate(times[1:5]):
                pictures.append(rendered(results[0], t, folder / f"surface_{number}.png",
                                         f"The surface and the bubbles at t = {t:.2f} s."))
            pictures.append(movie(results[0], folder / "explosion.mp4", "The explosion."))
        data = [draw_history({"with oscillation": (results, rows, BLUE)}, folder / "history.png",
                             folder / "history.csv")]
        pictures.append(Picture("history.png", "Level, vapour, and vapour made by dynamic nucleation: mean and range "
                                               "over the seeds."))
        return self.section(pictures=pictures, tables=[balance_table(rows[0])], data=data, statements=[
            judged("Superheated liquid bursts by itself into bubbles",
                      f"{spread(row['burst'] for row in rows)} particles, {percent(rows, 'share')} "
                      f"of all, became vapour by dynamic nucleation in {spread(row['fired'] for row in rows)} places "
                      f"without a site; {spread(row['nucleated'] for row in rows)} more grew on them",
                      [bound("share of all particles", [row["share"]], FIRED, row["paid"]) for row in rows],
                   fair="There are no sites; a burst worth the name takes a hundredth of the water, and it cannot "
                        "make more vapour than the excess heat pays for"),
            judged("It is explosive: bubbles form quickly",
                      f"half of all vapour has formed after {spread((row['half'] for row in rows), 's')}",
                      [bound("time of half the vapour in s", [row["half"]], row["inertia"], FAST) for row in rows],
                   fair="Half a second is short for the eye; nothing can be faster than a bubble that grows to the "
                        "size of a particle against the inertia of the water"),
            judged("The burst turns excess sensible heat into latent heat and restores thermal stability",
                      f"at the peak of vapour {percent(rows, 'used')} of the excess sensible "
                      f"heat is used, {percent(rows, 'latent')} of it is latent heat of vapour (the rest is stored as "
                      "latent heat in the liquid around it, or has warmed cold liquid); the highest superheat "
                      f"fell from {spread(row['T_start'] - WATER_1ATM.T_sat for row in rows)} to "
                      f"{spread((row['T_end'] - WATER_1ATM.T_sat for row in rows), 'K')}",
                      [bound("share that is gone", [row["used"] for row in rows], USED, 1.0),
                       bound("share in vapour", [row["latent"] for row in rows], 0.5, 1.0)],
                   fair="Heat that is still sensible at the peak of vapour was not turned; all of it is 1, and "
                        "vapour must hold most of it"),
            judged("The level swells and settles (with vapour of twice the volume)",
                      f"it rises by {percent(rows, 'swelling')} after "
                      f"{spread((row['t_swelling'] for row in rows), 's')}; at the end "
                      f"{percent(rows, 'left')} of that is left",
                      [*(bound("rise, up to 1.75 times what the heat pays for,", [row["swelling"]], SWOLLEN,
                               PAID * row["swell"]) for row in rows),
                       bound("share left", [row["left"] for row in rows], SUNK, SETTLED)],
                   fair="The excess heat pays for the vapour, so it bounds the rise; 5 % can be seen; the pool "
                        "settles if most of the rise is gone, and has lost volume if it ends much lower"),
            judged("Energy is conserved in the burst: excess sensible heat before = latent heat after + rest",
                      f"energy unaccounted for, relative to the excess: at most {max(row['gap'] for row in rows):.1e}",
                      [bound("unaccounted share", [row["gap"] for row in rows], 0.0, CLOSED)],
                   fair="Sums of some 20,000 numbers in double precision close to 1e-12; 1e-10 leaves room for the "
                        "order of the sums"),
        ])


class Figure6(Figure):
    """Explosive boiling without the oscillation constraint."""

    key = "fig6"
    title = "Figure 6: explosive boiling without the oscillation constraint"

    def runs(self, quick):
        return [*without_oscillation(quick), *explosions(quick), *heated(quick)]

    def make(self, results, folder, quick):
        from pysph_boiling.analysis.plots import BLUE, ORANGE
        from pysph_boiling.report.pictures import movie, rendered, sheet

        off, on = ([results[run.name] for run in runs] for runs in (without_oscillation(quick), explosions(quick)))
        off_rows, on_rows = ([measure(result) for result in ensemble] for ensemble in (off, on))
        times = moments(on_rows[0])
        cells = [(result, times[k], title) for k in (1, 2, 3, 4)
                 for result, title in ((on[0], "with oscillation"), (off[0], "without"))]
        pictures = [sheet(cells, folder / "moments.png", "The same explosion with the oscillation constraint (first "
                          "and third column) and without it (second and fourth column) at equal times.", columns=4)]
        if not quick:
            pictures.append(rendered(off[0], times[3], folder / "surface.png",
                                     f"Without oscillation, the surface and the bubbles at t = {times[3]:.2f} s."))
            pictures.append(movie(off[0], folder / "explosion.mp4", "The explosion without oscillation."))
        data = [draw_history({"with oscillation": (on, on_rows, BLUE), "without": (off, off_rows, ORANGE)},
                             folder / "history.png", folder / "history.csv")]
        pictures.append(Picture("history.png", "Level, vapour, and vapour made by dynamic nucleation, with and without "
                                               "oscillation: mean and range over the seeds."))
        tables = [results[run.name].results for run in heated(quick)]
        particles = on[0].record["particles"]["fluid"]
        bursts = [np.diff(np.interp(np.linspace(0.25, 1.0, WINDOWS + 1) * table["t"][-1], table["t"], table["n_fired"]))
                  for table in tables]
        poorest = [float(counts.min() / max(counts.mean(), 1e-9)) for counts in bursts]
        ratios = [without["burst"] / row["burst"] for without, row in zip(off_rows, on_rows)]
        text = (f"The level rises by {percent(on_rows, 'swelling')} with oscillation and by "
                f"{percent(off_rows, 'swelling')} without it; the paper does not compare the levels.")
        return self.section(pictures=pictures, tables=[balance_table(off_rows[0])], data=data, text=text, statements=[
            judged("Without oscillation superheated regions still burst by themselves",
                      f"{spread(row['burst'] for row in off_rows)} particles became vapour by dynamic nucleation, "
                      f"{spread(row['burst'] for row in on_rows)} with oscillation; the ratio per seed is "
                      f"{spread(ratios)}",
                      [bound("ratio", ratios, 0.5, 2.0),
                       *(bound("share of all particles", [row["share"]], FIRED, row["paid"]) for row in off_rows)],
                   fair="The oscillation moves bubbles and makes no heat, so about as much must burst without it: "
                        "between half and twice, seed by seed"),
            judged("Nucleation is continuous",
                      f"on a heated base {spread(counts.mean() for counts in bursts)} regions burst in each of "
                      f"{WINDOWS} equal windows of the last three quarters, in the poorest {spread(poorest)} of that",
                      [bound("bursts in a window", [counts.mean() for counts in bursts], 2, particles),
                       bound("poorest window over mean", poorest, STEADY, 1.0)],
                      "the heat of the base goes into growing bubbles before a region bursts",
                      fair=f"The runs with a base of 120 K ({tables[0]['t'][-1]:.2g} s); what is continuous must go on "
                           "to the end, and without a heater the heat of the start is used up by the first bursts"),
            judged("A large amount of excess sensible heat becomes latent heat",
                      f"at the peak of vapour {percent(off_rows, 'used')} of the excess "
                      f"sensible heat is used, {percent(off_rows, 'latent')} of it is latent heat of "
                      "vapour",
                      [bound("share that is gone", [row["used"] for row in off_rows], USED, 1.0)],
                   fair="Three quarters are a large amount, and more than all is impossible"),
            judged("Dynamic nucleation alone has the potential to restore thermal stability",
                      f"by the peak of vapour the highest superheat falls from "
                      f"{spread(row['T_start'] - WATER_1ATM.T_sat for row in off_rows)} to "
                      f"{spread((row['T_end'] - WATER_1ATM.T_sat for row in off_rows), 'K')}",
                      [bound("share of the superheat left", [(row["T_end"] - WATER_1ATM.T_sat)
                                                               / (row["T_start"] - WATER_1ATM.T_sat)
                                                               for row in off_rows], 0.0, CALMED)],
                   fair="Stability is restored if at most half of the highest superheat is left when the vapour "
                        "peaks"),
        ])

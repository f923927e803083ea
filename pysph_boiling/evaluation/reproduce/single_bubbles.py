"""Figures 7 to 12: one bubble rising, two bubbles merging, one bubble splitting, and the ablations of each."""
import math

import numpy as np

from pysph_boiling.analysis.shapes import fall, mendelson, merger, pulsation, rise_speed, split, track
from pysph_boiling.evaluation.reproduce.figure import Figure
from pysph_boiling.evaluation.reproduce.runs import Run
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.report.sections import Table, bound, judged, spread, write_csv

__all__ = ["Figure7", "Figure8", "Figure9", "Figure10", "Figure11", "Figure12", "rise"]

HEATED = "--base-superheat", "200", "--superheat-limit", "28"  # regions burst at the base, behind the bubbles
VARIANTS = {"full": (), "no_oscillation": ("--no-oscillation",), "heated": HEATED,
            "no_burst": (*HEATED, "--no-dynamic-nucleation")}
TITLES = {"full": "full model", "no_oscillation": "no oscillation", "heated": "heated base",
          "no_burst": "heated base, no dynamic nucleation"}
COLOURS = {"full": "#3B7EBF", "no_oscillation": "#8E4585", "heated": "#C0392B", "no_burst": "#E8A33D"}
SEEDS = {variant: {True: (1,), False: (1, 2, 3)} for variant in VARIANTS}
CAP = 2.0, 4.0  # width over height of bubbles of that Eotvos and Reynolds number
ALIKE = 0.8, 1.25  # range of a ratio that counts as alike
MATTERS = 1.2, 5.0  # range of the ratio of two times, the longer over the shorter, that counts as an effect
SLOW, FAST = 0.7, 1.3  # speed over Mendelson's; measured bubbles scatter by 10 %, and walls slow ours down
STEADY = 0.25  # largest difference of the speeds in the two halves of the rise at terminal speed
VOLUME = 0.1  # largest change of the volume between two outputs by growth, condensation and splashes
PULSE = 0.03  # smallest relative amplitude of the mean radius that counts as pulsation
MOST = 0.15  # largest amplitude; the bounds of the constraint are 10 % from their middle
SWING = 2.0  # the constraint must at least double the amplitude at its own period
MISSED = "the bubbles pass each other, or stay in one piece: the forces that join or part them are too weak here"
WEAK = "the density constraint allows a bubble little more change of volume than the oscillation pushes"
EVENT = ("All vapour counts; between two outputs growth and condensation change it by up to a tenth. Satellites are "
         "pieces of fewer than eight particles (four in 2-D)")
BROKEN = "the bubble leaves vapour behind in its wake, or does not reach the surface"
OWN = np.linspace(0.8, 1.25, 10)  # periods that count as that of the constraint, relative to it
COLUMNS = {"t": "t [s]", "bubbles": "bubbles [-]", "n": "vapour [particles]", "volume": "volume of vapour [m^dim]",
           "n1": "largest bubble [particles]", "volume1": "its volume [m^dim]", "x1": "its x [m]",
           "height1": "its height [m]", "mean_radius1": "its mean radius [m]", "width1": "its width [m]",
           "tall1": "its vertical extent [m]", "occupied1": "space it occupies [m^dim]",
           "aspect1": "its width over height [-]", "n2": "second bubble [particles]", "x2": "second's x [m]",
           "height2": "second's height [m]", "whole": "in bubbles, not splashes [particles]"}


# --- what is measured -------------------------------------------------------------------------------------------------

def rise(history, *, dim, spacing, fill, period):
    """The rise of a bubble, from its history (:func:`~pysph_boiling.analysis.shapes.track`).

    ``fill`` is the height of the water [m], ``period`` that of the oscillation constraint [s]. Returns a dict:
    ``speed`` [m/s] between 30 and 75 % of the height, and ``lower`` and ``upper`` in the two halves of this range;
    ``law``, Mendelson's speed [m/s]; ``fall``, the largest step downwards [m] before it bursts; ``risen``, the distance
    risen [m]; ``aspect``, the mean aspect ratio; ``amplitude``, ``period`` [s] and ``share`` of the pulsation of the
    mean radius near the period of the constraint; ``swing``, the relative amplitude of the volume that it occupies;
    ``whole``, the smallest fraction of the vapour in the largest bubble.
    """
    t, height = history["t"], history["height1"]
    low, middle, high = 0.3 * fill, 0.525 * fill, 0.75 * fill
    aloft = height <= fill - 2.0 * spacing
    size = float(np.mean(history["volume1"][aloft]))
    radius = math.sqrt(size / math.pi) if dim == 2 else (3.0 * size / (4.0 * math.pi)) ** (1.0 / 3.0)
    amplitude, seen, share = pulsation(t[aloft], history["mean_radius1"][aloft], period * OWN)
    return {
        "speed": rise_speed(t, height, low, high), "lower": rise_speed(t, height, low, middle),
        "upper": rise_speed(t, height, middle, high),
        "law": mendelson(radius, sigma=WATER_1ATM.sigma, rho=WATER_1ATM.rho_l),
        "fall": fall(history), "risen": float(height[-1] - height[0]),
        "aspect": float(np.mean(history["aspect1"][aloft])), "amplitude": amplitude, "period": seen, "share": share,
        "swing": pulsation(t[aloft], history["occupied1"][aloft], period * OWN)[0],
        "whole": float(np.min(history["n1"] / history["n"]))}


def own_period(record):
    """Period of the oscillation constraint [s]; in a run without it, the period it would have."""
    from pysph_boiling.schemes.effects import Oscillation

    given = record["effects"].get("oscillation", {}).get("period", {}).get("value")
    return given or Oscillation.PERIOD * math.sqrt(record["spacing"] / 9.81)


def measured_rise(result, history):
    """:func:`rise` of a run."""
    record = result.record
    return rise(history, dim=record["dim"], spacing=record["spacing"], period=own_period(record),
                fill=record["parameters"]["fill"]["value"] * record["spacing"])


def budget(result, history):
    """Difference between the vapour at the end and the sum of all events that make or remove it [particles]."""
    last = {name: float(column[-1]) for name, column in result.results.items()}
    made = last["n_nucleated"] + last.get("n_burst", 0.0) - last["n_condensed"] - last["n_vented"]
    return last["n_vapour"] - history["n"][0] - made


# --- the figures ------------------------------------------------------------------------------------------------------

class SingleBubble(Figure):
    """The common part of the six figures: runs, histories, pictures of a few moments, and curves."""

    scene = ""
    variants = ("full",)
    small = ()  # options of the quick form

    def names(self, quick, variant):
        """Names of the runs of a variant, one per seed."""
        return [f"{self.scene}_{variant}{'_quick' if quick else ''}_{seed}" for seed in SEEDS[variant][quick]]

    def runs(self, quick):
        size = self.small if quick else ()
        return [Run(name, self.scene, (*size, "--seed", str(seed), *VARIANTS[variant])) for variant in self.variants
                for name, seed in zip(self.names(quick, variant), SEEDS[variant][quick])]

    def make(self, results, folder, quick):
        groups = {variant: [results[name] for name in self.names(quick, variant)] for variant in self.variants}
        # where regions burst, other bubbles form
        tracks = {variant: [track(result.files, result.record["dim"], WATER_1ATM.rho_l, first=variant == "heated")
                            for result in group] for variant, group in groups.items()}
        section = self.section(text=self.about)
        for variant, group in groups.items():
            for result, history in zip(group, tracks[variant]):
                section.data.append(write_csv(folder / f"{result.folder.name}.csv",
                                              {COLUMNS[name]: values for name, values in history.items()}))
        self.draw(section, groups, tracks, folder, quick)
        self.tell(section, groups, tracks, quick)
        return section

    def moments(self, history, count):
        """Times [s] of the pictures, evenly distributed over the time in which there is vapour."""
        return np.linspace(history["t"][0], history["t"][-1], count)

    def draw(self, section, groups, tracks, folder, quick):
        from pysph_boiling.report.pictures import movie, rendered, sheet

        firsts = {variant: group[0] for variant, group in groups.items()}
        alone = len(firsts) == 1
        times = self.moments(tracks["full"][0], 6 if alone else 4)
        cells = [(result, t, "" if alone else TITLES[variant]) for t in times for variant, result in firsts.items()]
        kinds = "" if alone else "; columns: " + ", ".join(TITLES[variant] for variant in firsts)
        section.pictures.append(sheet(
            cells, folder / "moments.png", f"Each bubble has its own colour, liquid is pale{kinds}.",
            columns=3 if alone else len(firsts), colour="bubble"))
        if alone and not quick:
            for number, t in enumerate(times[1::2]):
                section.pictures.append(rendered(firsts["full"], t, folder / f"rendered_{number}.png",
                                                 f"The surfaces of liquid and vapour at t = {t:.2f} s."))
            section.pictures.append(movie(firsts["full"], folder / "movie.mp4", "The whole run.", colour="bubble"))
        section.pictures.append(self.curves(tracks, folder))

    def curves(self, tracks, folder):
        """Draw height, mean radius, aspect ratio and volume of the largest bubble over time, one curve per run."""
        from pysph_boiling.report.pictures import plot
        from pysph_boiling.report.sections import Picture

        panels = {"height1": ("height of the centroid [mm]", 1e3), "mean_radius1": ("mean radius [mm]", 1e3),
                  "aspect1": ("width/height [-]", 1.0), "n1": ("particles", 1.0)}
        with plot(folder / "curves.png", width=12.5, height=3.0, columns=4) as axes:
            for ax, (column, (label, scale)) in zip(axes, panels.items()):
                for variant, histories in tracks.items():
                    for number, history in enumerate(histories):
                        ax.plot(history["t"], scale * history[column], color=COLOURS[variant],
                                linestyle="--" if variant == "no_burst" else "-", alpha=1.0 if number == 0 else 0.4,
                                label=TITLES[variant] if number == 0 else None)
                ax.set(xlabel="t [s]", ylabel=label)
            axes[1].legend()
        return Picture("curves.png", "The largest bubble over time; pale curves are other seeds.")

    def tell(self, section, groups, tracks, quick):
        """Fill in statements and tables."""
        raise TypeError(f"{type(self).__name__} must override tell")

    def unchanged(self, groups, what, values, bounds):
        """The statement that dynamic nucleation leaves the bubbles as they are, from the runs with a heated base.

        ``values`` maps a variant to texts of what was measured, ``bounds`` compare the variants.
        """
        burst = [float(result.results["n_burst"][-1]) for result in groups["heated"]]
        return judged(
            "the lack of dynamic nucleation leaves rise, merging and splitting as they are",
            f"dynamic nucleation made {spread(burst)} particles of vapour at the base; {what} {values['heated']} with "
            f"it and {values['no_burst']} without it", [
                bound("particles that burst", burst, 5, groups["heated"][0].record["particles"]["fluid"]), *bounds],
            "the bubbles that burst at the base change the flow around the others",
            fair="The runs with a heated base, where dynamic nucleation acts; in a pool below its limit leaving it out "
                 "would prove nothing. Only the vapour of the start is followed there. Alike is within a quarter")


class RiseMixin(SingleBubble):
    """One bubble."""

    scene = "bubble_rise"
    small = ("--flat", "--width", "20", "--fill", "30", "--duration", "0.42")


class Figure7(RiseMixin):
    """One bubble rising."""

    key, title = "fig7", "Figure 7: a bubble rises"
    about = ("A bubble starts near the base of a pool 10 K above saturation. The paper compares pictures; here its "
             "speed, path, shape and pulsation are measured.")

    def tell(self, section, groups, tracks, quick):
        rises = [measured_rise(*pair) for pair in zip(groups["full"], tracks["full"])]
        vented = [float(result.results["n_bubbles_vented"][-1]) for result in groups["full"]]
        spacing, dim = groups["full"][0].record["spacing"], groups["full"][0].record["dim"]
        column = {name: [row[name] for row in rises] for name in rises[0]}
        fill = groups["full"][0].record["parameters"]["fill"]["value"] * spacing
        section.statements.append(judged(
            "bubbles rise realistically, as in the experiment (pictures)",
            f"it rises in one piece (at least {min(column['whole']):.0%} of the vapour), without sinking by more than "
            f"{1e3 * max(column['fall']):.2g} mm between outputs, over a distance of "
            f"{spread([1e3 * v for v in column['risen']], 'mm')} to the surface, where it bursts", [
                bound("pieces that burst", vented, 1, 5), bound("share in one piece", column["whole"], 0.8, 1.0),
                bound("fall in spacings", [fall / spacing for fall in column["fall"]], 0.0, 0.5),
                bound("rise in depths", [risen / fill for risen in column["risen"]], 0.5, 1.2)], BROKEN,
                                         fair="It must reach the surface and burst there, in one piece and without "
                                              "sinking; how a picture looks cannot be measured"))
        ratio = [u / law for u, law in zip(column["speed"], column["law"])]
        terminal = max(abs(u - v) / w for u, v, w in zip(column["lower"], column["upper"], column["speed"]))
        section.statements.append(judged(
            "trajectories closely match experiments (Table 4)",
            f"terminal speed {spread(column['speed'], 'm/s')}, {spread(ratio)} of Mendelson's "
            f"sqrt(g R + sigma/(rho R)), which fits measured bubbles; the speeds in the two halves of the rise differ "
            f"by at most {terminal:.0%}",
            [bound("ratio", ratio, SLOW, FAST), bound("difference", [terminal], 0.0, STEADY)],
            "" if dim == 3 else "Mendelson's law is for bubbles in three dimensions", dim == 3,
                                         fair="Measured bubbles scatter by 10 % about Mendelson's law, and the walls "
                                              "slow ours down; at terminal speed both halves are alike"))
        section.statements.append(judged(
            "shapes closely match experiments (Table 4)",
            f"width over height is {spread(column['aspect'])} on average", [bound("width over height", column["aspect"],
                                                                                  *CAP)],
            "the cohesion that holds a bubble of a hundred particles together makes it rounder than a bubble of 24 mm "
            "in water", dim == 3,
            fair="The bubble has an Eotvos number of 92 and a Reynolds number of 25,000; such bubbles are spherical "
                 "caps, two to four times as wide as high (Clift, Grace & Weber 1978)"))
        section.statements.append(judged(
            "bubbles expand and contract periodically during ascent",
            f"the mean radius oscillates by +-{spread([100 * v for v in column['amplitude']], '%')} with a period of "
            f"{spread([1e3 * v for v in column['period']], 'ms')}, the volume that the bubble occupies by "
            f"+-{spread([100 * v for v in column['swing']], '%')}",
            [bound("amplitude", column["amplitude"], PULSE, MOST)], WEAK,
                                         fair="From 3 % on it can be seen; more than the bounds of the constraint "
                                              "allow would be something else"))


class Figure10(RiseMixin):
    """One bubble rising: the ablations."""

    key, title = "fig10", "Figure 10: a bubble rises, by the oscillation alone"
    variants = tuple(VARIANTS)
    about = ("The runs of Figure 7, and of the same vessel with a heated base, each without one of the two: without "
             "dynamic nucleation, as the paper's Figure 10, and without the oscillation constraint.")

    def tell(self, section, groups, tracks, quick):
        rises = {variant: [measured_rise(*pair) for pair in zip(group, tracks[variant])]
                 for variant, group in groups.items()}
        spacing = groups["full"][0].record["spacing"]

        def of(variant, name, scale=1.0):
            return [scale * row[name] for row in rises[variant]]

        speeds = {variant: of(variant, "speed") for variant in ("heated", "no_burst")}
        section.statements.append(self.unchanged(
            groups, "the bubble rises at", {variant: spread(values, "m/s") for variant, values in speeds.items()},
            [bound("ratio of the speeds", [np.mean(speeds["no_burst"]) / np.mean(speeds["heated"])], *ALIKE)]))
        alone = rises["no_burst"]
        section.statements.append(judged(
            "with the oscillation alone a bubble still rises realistically",
            f"it rises by {spread(of('no_burst', 'risen', 1e3), 'mm')} at {spread(speeds['no_burst'], 'm/s')} "
            f"({spread(of('full', 'speed'))} m/s in the full model), at least {min(of('no_burst', 'whole')):.0%} of it "
            "in one piece",
            [bound("pieces that burst", [one.results["n_bubbles_vented"][-1] for one in groups["no_burst"]], 1, 5),
             bound("share in one piece", of("no_burst", "whole"), 0.8, 1.0),
             bound("fall in spacings", [row["fall"] / spacing for row in alone], 0.0, 0.5)], BROKEN,
                                         fair="As in Figure 7, without dynamic nucleation, in the vessel with a "
                                              "heated base"))
        kept = np.mean(of("no_oscillation", "amplitude")) / np.mean(of("full", "amplitude"))
        section.statements.append(judged(
            "the oscillation constraint gives the periodic expansion and contraction",
            f"at the period of the constraint the mean radius oscillates by +-"
            f"{spread(of('full', 'amplitude', 100), '%')} with it and by +-"
            f"{spread(of('no_oscillation', 'amplitude', 100), '%')} without it, the volume occupied by "
            f"+-{spread(of('full', 'swing', 100), '%')} and +-{spread(of('no_oscillation', 'swing', 100), '%')}",
            [bound("amplitude with it", of("full", "amplitude"), PULSE, MOST),
             bound("share of that without it", [kept], 0.0, 1.0 / SWING)], WEAK,
                                         fair="What the constraint gives must at least double what is there without "
                                              "it at its own period"))
        rows = [[TITLES[variant], spread(of(variant, "speed")), spread(of(variant, "aspect")),
                 spread(of(variant, "amplitude", 100)), spread(of(variant, "swing", 100)),
                 f"{min(of(variant, 'whole')):.0%}"]
                for variant in rises]
        section.tables.append(Table(
            ("variant", "speed [m/s]", "width/height", "amplitude of the mean radius [%]",
             "amplitude of the volume occupied [%]", "fraction in one piece"), rows, "The rise in the three variants."))


class EventFigure(SingleBubble):
    """Two bubbles become one, or one becomes two."""

    event = staticmethod(merger)
    words = ()

    def moments(self, history, count):
        event = self.event(history)
        if event is None:
            return super().moments(history, count)
        later = event.t + np.array({6: (0.0, 0.03, 0.06, 0.1), 4: (0.0, 0.06)}[count])  # [s]
        return np.minimum(np.concatenate([[0.0, 0.6 * event.t], later]), history["t"][-1])

    def events(self, tracks):
        return {variant: [self.event(history) for history in histories] for variant, histories in tracks.items()}

    def describe(self, events):
        """A sentence on the events, and the bounds that they took place and kept the volume."""
        found = [event for event in events if event]
        took_place = bound("share of the runs in which it happens", [len(found) / len(events)], 1.0, 1.0)
        if not found:
            return f"it happens in none of {len(events)} runs", [took_place]
        ratio = [event.ratio for event in found]
        return (f"it happens in {len(found)} of {len(events)} runs, at t = {spread([event.t for event in found])} s; "
                f"all vapour after it over that before is {spread(ratio)}, of which "
                f"{spread([event.satellites for event in found])} particles are satellites; the smaller of the two "
                f"bubbles has {spread([event.smaller for event in found])} of "
                f"{spread([event.before for event in found])} particles",
                [took_place, bound("volume", ratio, 1.0 - VOLUME, 1.0 + VOLUME)])

    def tell(self, section, groups, tracks, quick):
        events = self.events(tracks)
        if len(self.variants) == 1:
            section.statements.append(judged(self.words[0], *self.describe(events["full"]), MISSED, fair=EVENT))
            left = [abs(budget(*pair)) for pair in zip(groups["full"], tracks["full"])]
            section.statements.append(judged(
                self.words[1], "the vapour at the end equals the vapour at the start and that made, condensed and "
                f"vented since, to {max(left):.0f} particles; mass is exact", [bound("particles that differ", left, 0,
                                                                                     0)],
                "vapour changed between the last row of the results and the last output",
                fair="Particles are counted, so the sum must be exact"))
            return
        times = {variant: [event.t for event in found if event] for variant, found in events.items()}
        mean = {variant: np.mean(values) if values else np.nan for variant, values in times.items()}
        said = {variant: f"at {spread(values)} s" if values else "in no run" for variant, values in times.items()}
        section.statements.append(self.unchanged(
            groups, "it happens", said, [bound("ratio of the times", [mean["no_burst"] / mean["heated"]], *ALIKE)]))
        section.statements.append(judged(self.words[0], *self.describe(events["no_burst"]), MISSED, fair=EVENT))
        if bool(times["full"]) != bool(times["no_oscillation"]):
            share = max(len(times[variant]) / len(events[variant]) for variant in ("full", "no_oscillation"))
            effect = [bound("share of the runs in which it happens, in those of which any shows it", [share], 1.0, 1.0)]
        else:
            ratio = max(mean["full"] / mean["no_oscillation"], mean["no_oscillation"] / mean["full"])
            effect = [bound("longer over shorter time", [ratio], *MATTERS)]
        section.statements.append(judged(
            "the oscillation constraint matters for plausible dynamics",
            f"it happens {said['full']} with it and {said['no_oscillation']} without it", effect,
            "" if quick else "it changes these runs too little", not quick,
            fair="The paper shows no run without it; what matters changes when it happens, by more than seeds do, or "
                 "whether it does"))
        rows = [[TITLES[variant], spread([event.t for event in found]), spread([event.before for event in found]),
                 spread([event.after for event in found]), spread([event.satellites for event in found]),
                 spread([event.smaller for event in found])] for variant, found in events.items() if all(found)]
        if rows:
            section.tables.append(Table(
                ("variant", "t [s]", "vapour particles before", "after", "in satellites", "smaller of the two"), rows,
                "The event in the variants in which it took place in every run."))


class MergeMixin(EventFigure):
    """Two bubbles."""

    scene = "bubble_merge"
    small = ("--flat", "--width", "20", "--fill", "30", "--duration", "0.2")
    event = staticmethod(merger)


class Figure8(MergeMixin):
    """Two bubbles merging."""

    key, title = "fig8", "Figure 8: two bubbles merge"
    words = ("correct surface tension and coalescence dynamics (Table 4): two bubbles become one",
             "coalescence keeps what the bubbles hold")
    about = "A larger bubble below a smaller one rises faster, also because it is in the wake, and merges with it."


class Figure11(MergeMixin):
    """Two bubbles merging: the ablations."""

    key, title = "fig11", "Figure 11: two bubbles merge, by the oscillation alone"
    variants = tuple(VARIANTS)
    words = ("with the oscillation alone bubbles still merge realistically",)
    about = ("The runs of Figure 8, and of the same vessel with a heated base, each without one of the two: without "
             "dynamic nucleation, as the paper's Figure 11, and without oscillation.")


class SplitMixin(EventFigure):
    """A bubble that splits."""

    scene = "bubble_split"
    small = ("--flat", "--width", "26", "--fill", "28", "--duration", "0.15")
    event = staticmethod(split)


class Figure9(SplitMixin):
    """A bubble splitting."""

    key, title = "fig9", "Figure 9: a bubble splits"
    words = ("physically plausible breakup and volume conservation (Table 4): one bubble becomes several",
             "breakup keeps what the bubble holds")
    about = ("A bubble is torn by eddies such as other bubbles leave behind in boiling water; the paper does not say "
             "what splits its bubble.")


class Figure12(SplitMixin):
    """A bubble splitting: the ablations."""

    key, title = "fig12", "Figure 12: a bubble splits, by the oscillation alone"
    variants = tuple(VARIANTS)
    words = ("with the oscillation alone bubbles still split realistically",)
    about = ("The runs of Figure 9, and of the same vessel with a heated base, each without one of the two: without "
             "dynamic nucleation, as the paper's Figure 12, and without oscillation.")

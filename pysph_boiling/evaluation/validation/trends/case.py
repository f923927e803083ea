"""Trends of nucleate boiling: see README.md beside this file."""
import numpy as np

from pysph_boiling.analysis.plots import BLUE, ORANGE
from pysph_boiling.evaluation.problems.boiling_rate import BoilingRate
from pysph_boiling.evaluation.problems.departure import Departure
from pysph_boiling.report.pictures import plot

SMALL = dict(width=30, fill=16, sites=3, begin=1.0)
ADHESION = {5.0: (0.0, 2.5, 5.0, 10.0, 20.0), 10.0: (5.0, 10.0, 20.0)}  # for each strength of cohesion [g]


def run(quick):
    duration, seeds = (2.0, (1,)) if quick else (3.0, (1, 2))
    flux = {dT: [BoilingRate(superheat=dT, duration=duration, seed=seed, **SMALL).run() for seed in seeds]
            for dT in ((20.0, 80.0) if quick else (20.0, 40.0, 80.0, 200.0))}
    size = {} if quick else {cohesion: {adhesion: Departure(adhesion=adhesion, cohesion=cohesion).run().facts
                                        for adhesion in strengths} for cohesion, strengths in ADHESION.items()}
    return dict(flux=flux, size=size)


def rows(outcomes):
    flux = {dT: np.mean([one.facts["flux"] for one in runs]) for dT, runs in outcomes["flux"].items()}
    ratio = flux[80.0] / flux[20.0]
    yield "rises", ratio, f"{ratio:.1f}; " + ", ".join(f"{q / 1e3:.0f}" for q in flux.values()) + (
        f" kW/m² at {', '.join(f'{dT:.0f}' for dT in flux)} K")
    below = [dT for dT in flux if dT <= 80.0]
    exponent = np.polyfit(np.log(below), np.log([flux[dT] for dT in below]), 1)[0]
    yield "rohsenow", exponent, f"{exponent:.2f}"
    if 200.0 in flux:
        yield "zuber", flux[200.0] / flux[80.0], f"{flux[200.0] / flux[80.0]:.2f}"
    if outcomes["size"]:
        size = {cohesion: [one["size"] for one in found.values()] for cohesion, found in outcomes["size"].items()}
        text = {cohesion: "N = " + ", ".join(f"{one['size']:.1f} ± {one['size_error']:.1f}" for one in found.values())
                for cohesion, found in outcomes["size"].items()}
        yield "fritz", min(np.diff(size[5.0][:3])), text[5.0]
        yield "fritz_strong", min(np.diff(size[5.0][2:])), text[5.0]
        yield "fritz_cohesion", min(np.diff(size[10.0])), text[10.0]


def draw(outcomes, path):
    size = outcomes["size"]
    with plot(path, width=9.6 if size else 5.2, columns=2 if size else 1) as axes:
        left, *right = axes if size else [axes]
        flux = {dT: [one.facts["flux"] / 1e3 for one in runs] for dT, runs in outcomes["flux"].items()}
        for dT, values in flux.items():
            left.plot([dT] * len(values), values, ".", color=ORANGE)
        left.plot(list(flux), [np.mean(values) for values in flux.values()], color=ORANGE, label="particles")
        scale = np.array([20.0, 80.0])
        left.plot(scale, np.mean(flux[20.0]) * (scale / 20.0) ** 3, "--", color=BLUE, label="third power")
        left.set(xlabel="superheat of the base [K]", ylabel="heat flux over A [kW/m²]", xscale="log", yscale="log",
                 title="boiling curve")
        left.set_xticks(list(flux), [f"{dT:.0f}" for dT in flux])
        left.minorticks_off()
        left.legend()
        for ax in right:
            for (cohesion, found), colour in zip(size.items(), (ORANGE, BLUE)):
                means, errors = zip(*((one["size"], one["size_error"]) for one in found.values()))
                ax.errorbar(list(found), means, yerr=errors, fmt="o-", color=colour, label=f"cohesion {cohesion:g} g")
            ax.legend()
            ax.set(xlabel="adhesion [g]", ylabel="particles", title="size of a bubble at departure")

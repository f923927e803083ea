"""Table 3: the sensitivity to the empirical constants."""
import math
from dataclasses import dataclass

import numpy as np

from pysph_boiling.analysis.shapes import pulsation, track
from pysph_boiling.evaluation.reproduce.figure import Figure
from pysph_boiling.evaluation.reproduce.runs import Run
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.report.sections import Picture, Table, bound, judged, spread, write_csv

__all__ = ["Table3", "amplitude_and_period", "bounds", "grade", "sensitivity"]

LOW, MODERATE = 0.3, 1.0  # a sensitivity is low below LOW, moderate up to MODERATE, and high above
SKIPPED = 0.25  # fraction of the time that is left out, in which the bubble finds its shape
PERIODS, TOLD = np.geomspace(0.05, 0.5, 120), 0.3  # periods to try [s], smallest fraction of the variance explained
LENGTH, NATURAL = 2.0, {2: 0.3761, 3: 0.4653}  # spacings; unit of the paper's radii, and radius at rest / N^(1/dim)

PAPER = {"r_min": 0.45, "r_max": 0.85, "k_model": 0.05}
DEFAULTS = {**PAPER, "omega": 1.0, "Q_crit": 10.0}
VALUES = {
    "r_min": (0.3, 0.375, 0.45, 0.525, 0.6),
    "r_max": (0.75, 0.8, 0.85, 0.9, 0.95),
    "k_model": (0.025, 0.0375, 0.05, 0.0625, 0.075),
    "omega": (0.25, 0.5, 0.75, 0.9, 1.0),
    "Q_crit": (5.0, 7.5, 10.0, 12.5, 15.0, 20.0),
}
BAND = {8: 2.0, 32: 4.0, 56: 5.0, 160: 6.8}  # bubbles with the band itself: particles -> diameter [spacings]
QUICK = {"r_max": (0.75, 0.8, 0.85), "Q_crit": (5.0, 10.0, 20.0)}
SAYS = {"r_min": "low", "r_max": "low", "k_model": "moderate", "omega": "low", "Q_crit": "moderate"}


@dataclass(frozen=True)
class Bubble:
    """The scene ``bubble_held`` with the given options."""

    dim: int
    diameter: float  # in spacings
    options: tuple[str, ...]

    @property
    def n(self):
        """Number of its particles; the centre of the bubble is a corner of the lattice."""
        axis = np.arange(-math.ceil(self.diameter), math.ceil(self.diameter)) + 0.5
        grid = np.meshgrid(*[axis] * self.dim)
        return int(np.count_nonzero(sum(x * x for x in grid) < 0.25 * self.diameter**2))


def bubble(quick, diameter=5.0):
    return Bubble(2, diameter, ("--flat",)) if quick else Bubble(3, diameter, ("--diameter", f"{diameter:g}"))


def explosion(quick):
    """A superheated pool (3-D) whose regions hold 17 m_p L; in 2-D no region can hold 10 below the critical point.

    The run ends after all bursts, before the end of the scene, and so without its final check: a high threshold
    suppresses the explosion, which is a valid result here.
    """
    size = ("--width", "10", "--fill", "10", "--max-steps", "40") if quick else (
        "--width", "14", "--fill", "16", "--max-steps", "200")
    return (*size, "--superheat", "160", "--hot", "1", "--region-radius", "2.4")


def bounds(n, dim, r_min=PAPER["r_min"], r_max=PAPER["r_max"], k_model=PAPER["k_model"]):
    """The paper's bounds for the mean radius of a bubble of n particles, in units of its radius at rest."""
    at_rest = NATURAL[dim] * n ** (1.0 / dim)
    return tuple((start + k_model * n ** (1.0 / 3.0)) * LENGTH / at_rest for start in (r_min, r_max))


# --- what is measured -------------------------------------------------------------------------------------------------

def amplitude_and_period(result):
    """Relative amplitude and period [s] of the mean radius of the bubble (the paper, eq. 24), once it has settled.

    The period is NaN if no single period explains the fraction ``TOLD`` of the variance of the radius.
    """
    history = track(result.files, result.record["dim"], WATER_1ATM.rho_l)
    keep = history["t"] >= SKIPPED * history["t"][-1]
    amplitude, period, share = pulsation(history["t"][keep], history["mean_radius1"][keep], PERIODS)
    return amplitude, period if share >= TOLD else math.nan


def clamped(result):
    """Mean radius of the bubble in a run with the band, in spacings, and how often it was pushed."""
    history = track(result.files, result.record["dim"], WATER_1ATM.rho_l)
    keep = history["t"] >= SKIPPED * history["t"][-1]
    return (float(np.mean(history["mean_radius1"][keep])) / result.record["spacing"],
            float(result.results["n_pushed"][-1]))


def sensitivity(values, outputs):
    """Relative change of an output per relative change of a parameter: the slope of log output over log parameter.

    Outputs <= 0 have no logarithm and are left out; NaN if fewer than two are left.
    """
    values, outputs = np.asarray(values, float), np.asarray(outputs, float)
    told = outputs > 0.0
    if np.count_nonzero(told) < 2:
        return math.nan
    return float(np.polyfit(np.log(values[told]), np.log(outputs[told]), 1)[0])


def grade(slope):
    """The paper's word for a sensitivity: low, moderate or high."""
    size = abs(slope)
    if math.isnan(size):
        return "unknown"
    return "low" if size < LOW else "moderate" if size <= MODERATE else "high"


class Table3(Figure):
    """Sensitivity to the empirical constants."""

    key = "table3"
    title = "Table 3: sensitivity to the empirical constants"

    @staticmethod
    def plan(quick):
        """(parameter, value, seed) -> run; runs with the default values are shared."""
        plan, held = {}, bubble(quick)
        end = "_quick" if quick else ""
        for parameter, values in (QUICK if quick else VALUES).items():
            for value in values:
                for seed in (1,) if quick else (1, 2, 3):
                    if parameter == "Q_crit":
                        options = (*explosion(quick), "--dynamic-nucleation.q-crit", f"{value:g}")
                        name, scene = f"q_crit_{value:g}", "explosive_boiling"
                    else:
                        lower, upper = bounds(held.n, held.dim, **({parameter: value} if parameter in PAPER else {}))
                        omega = value if parameter == "omega" else DEFAULTS["omega"]
                        options = (*held.options, "--oscillation.lower", f"{lower:.4f}", "--oscillation.upper",
                                   f"{upper:.4f}", "--oscillation.omega", f"{omega:g}")
                        name = "default" if value == DEFAULTS[parameter] else f"{parameter}_{value:g}"
                        scene = "bubble_held"
                    plan[parameter, value, seed] = Run(f"sensitivity_{name}{end}_{seed}", scene,
                                                       (*options, "--seed", str(seed)))
        return plan

    @staticmethod
    def band_plan(quick):
        """(number of particles, parameter, value) -> run with the paper's band, which only clamps the radius.

        For a given number of particles the band is the form 'relative' with the same bounds.
        """
        plan = {}
        for n, diameter in {} if quick else BAND.items():
            held = bubble(quick, diameter)
            for parameter in (*PAPER, "omega"):
                for value in VALUES[parameter][::2]:
                    lower, upper = bounds(held.n, held.dim, **({parameter: value} if parameter in PAPER else {}))
                    omega = value if parameter == "omega" else DEFAULTS["omega"]
                    name = "default" if value == DEFAULTS[parameter] else f"{parameter}_{value:g}"
                    plan[n, parameter, value] = Run(f"band_{n}_{name}", "bubble_held", (
                        *held.options, "--oscillation.form", "relative", "--oscillation.lower", f"{lower:.4f}",
                        "--oscillation.upper", f"{upper:.4f}", "--oscillation.omega", f"{omega:g}"))
        return plan

    def runs(self, quick):
        return list(dict.fromkeys((*self.plan(quick).values(), *self.band_plan(quick).values())))

    def make(self, results, folder, quick):
        outputs = {}  # (parameter, value, seed) -> name -> number
        for key, run in self.plan(quick).items():
            result = results[run.name]
            if key[0] == "Q_crit":
                outputs[key] = {"bursts": float(result.results["n_fired"][-1]),
                                "burst particles": float(result.results["n_burst"][-1])}
            else:
                amplitude, period = amplitude_and_period(result)
                outputs[key] = {"amplitude": amplitude, "period": period}
        used = QUICK if quick else VALUES
        slopes = {parameter: self.slopes(parameter, values, outputs) for parameter, values in used.items()}
        data = [write_csv(folder / "sensitivity.csv", {
            "parameter": [key[0] for key in outputs for _ in outputs[key]],
            "value": [key[1] for key in outputs for _ in outputs[key]],
            "seed": [key[2] for key in outputs for _ in outputs[key]],
            "output": [name for row in outputs.values() for name in row],
            "number": [number for row in outputs.values() for number in row.values()]})]
        self.draw(used, outputs, folder / "sensitivity.png")
        held = bubble(quick)
        rows = []
        for parameter, values in used.items():
            for name, of_seeds in slopes[parameter].items():
                rows.append([parameter, f"{DEFAULTS[parameter]:g}", ", ".join(f"{value:g}" for value in values), name,
                             self.ensemble(outputs, parameter, values, name), spread(of_seeds, digits=2),
                             SAYS[parameter], grade(np.mean(of_seeds))])
        table = Table(("constant", "paper's value", "tried", "output", "output, mean over the seeds", "sensitivity",
                       "the paper says", "ours"), rows,
                      "The sensitivity is the slope of log output over log constant, with mean and range over the "
                      f"seeds; it is low below {LOW} and moderate up to {MODERATE}.")
        band = {key: clamped(results[run.name]) for key, run in self.band_plan(quick).items()}
        tables = [table]
        if band:
            tables.append(self.band_table(band))
            data.append(write_csv(folder / "band.csv", {
                "particles": [key[0] for key in band], "parameter": [key[1] for key in band],
                "value": [key[2] for key in band], "mean radius [spacings]": [one[0] for one in band.values()],
                "pushes": [one[1] for one in band.values()]}))
        return self.section(
            pictures=[Picture("sensitivity.png", "Each output over each constant, relative to the paper's value: mean "
                                                 "and range over the seeds.")],
            tables=tables, data=data,
            statements=[self.explosive(slopes[parameter], outputs, quick) if parameter == "Q_crit" else
                        self.statement(parameter, slopes[parameter], band, quick) for parameter in used],
            text=f"Amplitude (relative to the mean) and period are measured on the mean radius of a bubble of {held.n} "
                 "particles, neutrally buoyant in a pool at saturation. The oscillation of the form 'hysteresis' "
                 "reverses at the paper's bounds for this number of particles; the unit of length, which the paper "
                 "does not give, is 2 spacings here, and the period is a separate parameter. The density constraint "
                 "keeps a bubble above about 0.92 of its radius at rest (0.965 in 2-D), so lower bounds are not "
                 "reached. Bursts are counted in a pool without sites that is superheated by 160 K.")

    @staticmethod
    def slopes(parameter, values, outputs):
        """Name of an output -> its sensitivity for each seed."""
        seeds = sorted({key[2] for key in outputs if key[0] == parameter})
        names = outputs[parameter, values[0], seeds[0]]
        return {name: [sensitivity(values, [outputs[parameter, value, seed][name] for value in values])
                       for seed in seeds] for name in names}

    @staticmethod
    def ensemble(outputs, parameter, values, name):
        """Text of the means over the seeds for each value."""
        means = [np.mean([row[name] for key, row in outputs.items() if key[:2] == (parameter, value)])
                 for value in values]
        return ", ".join(f"{mean:.3g}" for mean in means)

    @staticmethod
    def band_slopes(band, parameter):
        """Number of particles -> sensitivity of the mean radius to a parameter, and the pushes at its values."""
        found = {}
        for n in dict.fromkeys(key[0] for key in band):
            values = [key[2] for key in band if key[:2] == (n, parameter)]
            rows = [band[n, parameter, value] for value in values]
            found[n] = sensitivity(values, [radius for radius, _ in rows]), [pushes for _, pushes in rows]
        return found

    @classmethod
    def band_table(cls, band):
        """The table of the runs with the band."""
        rows = []
        for parameter in dict.fromkeys(key[1] for key in band):
            for n, (slope, pushes) in cls.band_slopes(band, parameter).items():
                values = [key[2] for key in band if key[:2] == (n, parameter)]
                rows.append([f"{n}", parameter, ", ".join(f"{value:g}" for value in values),
                             ", ".join(f"{band[n, parameter, value][0]:.3f}" for value in values),
                             ", ".join(f"{one:.0f}" for one in pushes), f"{slope:.2f}"])
        return Table(("particles", "constant", "tried", "mean radius [spacings]", "pushes", "sensitivity"), rows,
                     "The paper's band itself, one seed. Inside the band it does nothing, which 0 pushes say; a bubble "
                     "of 8 particles is below it and one of 160 above it.")

    @staticmethod
    def explosive(slopes, outputs, quick):
        """The statement on Q_crit."""
        values = sorted({key[1] for key in outputs if key[0] == "Q_crit"})
        means = [np.mean([row["bursts"] for key, row in outputs.items() if key[:2] == ("Q_crit", value)])
                 for value in values]
        steps = [after / before for before, after in zip(means, means[1:]) if before > 0.0]
        return judged(
            "Q_crit: moderate sensitivity; higher values suppress explosive boiling, lower values trigger it more "
            "often",
            f"bursts at {', '.join(f'{value:g}' for value in values)} m_p L: "
            f"{', '.join(f'{mean:.3g}' for mean in means)}; sensitivity {spread(slopes['bursts'])}, "
            f"{grade(np.mean(slopes['bursts']))}",
            [bound("bursts over those at the next lower value", steps, 0.0, 1.0),
             bound("most over fewest value", [means[-1] / max(means[0], 1.0)], 1e-3, 0.5),
             *([] if quick else [bound("size of the sensitivity", [abs(np.mean(slopes["bursts"]))], LOW, MODERATE)])],
            "the number of regions that can hold so much heat falls faster than that",
            fair="A pool without sites, superheated by 160 K. The count must never rise with Q_crit, fall to a half or "
                 "less over the range, and not to zero; moderate is a slope of .3 to 1")

    @classmethod
    def statement(cls, parameter, slopes, band, quick):
        """The statement on a constant of the band, judged by the band itself."""
        found = cls.band_slopes(band, parameter)
        worst = max((slope for slope, pushes in found.values() if max(pushes) > 0.0), key=abs, default=math.nan)
        says = {"low": (0.0, LOW), "moderate": (LOW, MODERATE)}[SAYS[parameter]]
        told = "; ".join(f"{name} {spread(of_seeds)}" for name, of_seeds in slopes.items())
        by_size = ", ".join(f"{slope:.2f} at {n} particles ({max(pushes):.0f} pushes)"
                            for n, (slope, pushes) in found.items())
        return judged(
            f"{parameter}: {SAYS[parameter]} sensitivity",
            (f"mean radius with the band: {by_size}; with an oscillation between the same bounds: {told}" if found else
             f"with an oscillation between the bounds: {told}"),
            [bound("size of the largest sensitivity where the band acts", [abs(worst)], *says)],
            "a bubble that is pushed to a bound follows it" if abs(worst) > says[1] else
            "the density constraint keeps a bubble from following its bound", not quick,
            fair="The band itself, for bubbles below, inside and above it; where it never pushes, nothing is judged. "
                 f"Low is a slope below {LOW:g}, moderate one up to {MODERATE:g}")

    @staticmethod
    def draw(used, outputs, path):
        from pysph_boiling.analysis.plots import BLUE, GREEN, ORANGE, PURPLE
        from pysph_boiling.report.pictures import plot

        with plot(path, width=3.0 * len(used) + 0.6, height=3.2, columns=len(used)) as axes:
            for ax, (parameter, values) in zip(np.atleast_1d(axes), used.items()):
                names = outputs[parameter, values[0], 1]
                for name, colour in zip(names, (PURPLE, GREEN) if parameter == "Q_crit" else (BLUE, ORANGE)):
                    at = np.array([[row[name] for key, row in outputs.items() if key[:2] == (parameter, value)]
                                   for value in values])
                    unit = at[values.index(DEFAULTS[parameter])].mean()
                    x = np.array(values) / DEFAULTS[parameter]
                    ax.plot(x, at.mean(axis=1) / unit, color=colour, marker="o", markersize=3.5, label=name)
                    ax.fill_between(x, at.min(axis=1) / unit, at.max(axis=1) / unit, color=colour, alpha=0.2,
                                    linewidth=0.0)
                ax.set(title=parameter, xlabel="constant / paper's value", ylim=(0.0, None))
                ax.legend()

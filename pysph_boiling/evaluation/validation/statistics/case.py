"""Statistics of a small boil: see README.md beside this file. As a script it writes ``statistics.json`` anew."""
import json
import math
import os
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from pysph_boiling.analysis.plots import BLUE, ORANGE
from pysph_boiling.evaluation.problems.boiling_rate import BoilingRate
from pysph_boiling.report.pictures import plot
from pysph_boiling.runs.jobs import Job, run_jobs

STORED = Path(__file__).with_name("statistics.json")
SMALL = BoilingRate(width=30, fill=16, sites=3, duration=3.0, begin=1.0)
UNITS = dict(flux="W/m²", made="", vapour="", superheated="", T_mean="K", vented="1/s", bubble="")


def measure(seed):
    """The quantities of one run, by name."""
    facts = replace(SMALL, seed=seed).run().facts
    return {name: facts[name] for name in UNITS}


def of_quantities(runs):
    """Quantity -> its values in the runs."""
    return {name: [one[name] for one in runs] for name in UNITS}


def run(quick):
    stored = json.loads(STORED.read_text())
    if stored["parameters"] != {name: value for name, value in asdict(SMALL).items() if name != "seed"}:
        raise ValueError(f"{STORED} was made with other parameters: make it anew")
    return stored, of_quantities([measure(seed) for seed in ([11] if quick else [11, 12, 13])])


def rows(outcomes):
    stored, found = outcomes
    for name, values in found.items():
        mean, deviation = stored["mean"][name], stored["deviation"][name]
        scale = deviation * math.sqrt(1.0 / len(values) + 1.0 / len(stored["seeds"]))
        unit = f" {UNITS[name]}" if UNITS[name] else ""
        text = f"{np.mean(values):.4g}{unit}, stored {mean:.4g} ± {deviation:.2g}"
        yield name, abs(np.mean(values) - mean) / scale, text


def draw(outcomes, path):
    stored, found = outcomes
    with plot(path) as ax:
        for place, name in enumerate(UNITS):
            mean, deviation = stored["mean"][name], stored["deviation"][name]
            before = (np.array(stored["values"][name]) - mean) / deviation
            ax.plot([place] * len(before), before, "o", color=BLUE, markerfacecolor="none",
                    label="stored" if place == 0 else None)
            ax.plot([place + 0.2] * len(found[name]), (np.array(found[name]) - mean) / deviation, "o", color=ORANGE,
                    label="now" if place == 0 else None)
        ax.set(ylabel="deviation from the stored mean [s]", title="a small boil, seed by seed")
        ax.set_xticks(range(len(UNITS)), list(UNITS))
        ax.legend()


def store():
    """Run eight seeds and write their statistics."""
    from pysph_boiling import __version__

    seeds = list(range(1, 9))
    runs = run_jobs([Job(name=f"seed {seed}", call=(measure, seed)) for seed in seeds], os.cpu_count() or 1)
    values = of_quantities([run.result() for run in runs])
    STORED.write_text(json.dumps(dict(
        made_by="python pysph_boiling/evaluation/validation/statistics/case.py", version=__version__,
        problem="BoilingRate",
        parameters={name: value for name, value in asdict(SMALL).items() if name != "seed"}, seeds=seeds,
        mean={name: float(np.mean(one)) for name, one in values.items()},
        deviation={name: float(np.std(one, ddof=1)) for name, one in values.items()}, values=values), indent=1) + "\n")


if __name__ == "__main__":
    store()

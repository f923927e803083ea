"""Size of the bubbles that depart from a single heated site (2-D)."""
from dataclasses import dataclass

import numpy as np

from pysph_boiling.evaluation.problems.from_scene import from_scene
from pysph_boiling.evaluation.problems.problem import Outcome, Problem
from pysph_boiling.examples.steady_boiling import SteadyBoiling
from pysph_boiling.schemes.effects import SiteAdhesion

__all__ = ["Departure"]


@dataclass(frozen=True, kw_only=True)
class Departure(Problem):
    """A small 2-D ``steady_boiling`` with one site, always active, that runs until ``departures`` bubbles have left it.

    Fact ``size``: the mean number of particles in these bubbles, NaN if they have not all left after ``longest`` steps.
    """

    title = "size of a bubble at departure"
    reference = "the size grows with adhesion, as with the contact angle in Fritz 1935"

    adhesion: float = 5.0  # strength, in units of gravity
    departures: int = 10
    longest: int = 10_000  # steps

    def run(self):
        scene, stepper = from_scene(
            SteadyBoiling, dim=2, spacing=0.002, width=24, fill=20, sites=1, heated=0.6, time_scaling=1000.0,
            pattern="regular", smallest_cavity=0.0,
            effects=dict(adhesion=SiteAdhesion(strength=self.adhesion)))
        while len(scene.departures) < self.departures and stepper.solver.count < self.longest:
            stepper.step(50)
        sizes = [n for _, n, _ in scene.departures[:self.departures]]
        return Outcome(errors={}, seconds=stepper.seconds, simulated=stepper.t, steps=stepper.solver.count,
                       particles=len(scene.scheme.arrays[0].m),
                       facts={"sizes": sizes,
                              "size": float(np.mean(sizes)) if len(sizes) == self.departures else np.nan})

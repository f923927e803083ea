"""Size of the bubbles that depart from a single heated site (2-D)."""
from dataclasses import dataclass

import numpy as np

from pysph_boiling.evaluation.problems.from_scene import from_scene
from pysph_boiling.evaluation.problems.problem import Outcome, Problem, standard_error
from pysph_boiling.examples.steady_boiling import SteadyBoiling
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.schemes.effects import Cohesion, SiteAdhesion

__all__ = ["Departure"]


@dataclass(frozen=True, kw_only=True)
class Departure(Problem):
    """A small 2-D ``steady_boiling`` with one site, always active, that runs until ``departures`` bubbles have left it.

    ``adhesion`` to the site and ``cohesion`` of the vapour are strengths of the pair forces, in units of gravity. The
    run gives up after ``longest`` steps.

    Facts: ``size``, the mean number of particles in these bubbles, with its standard error ``size_error``, both NaN if
    they have not all left; ``sizes``, of each bubble that left.
    """

    title = "size of a bubble at departure"
    reference = "the size grows with adhesion, as with the contact angle in Fritz 1935"

    adhesion: float = 5.0
    cohesion: float = 5.0
    departures: int = 40
    longest: int = 40_000

    def run(self):
        spacing = 0.002
        sigma = Cohesion.tension(9.81 * self.cohesion, dim=2, spacing=spacing, rho0=WATER_1ATM.rho_l)
        scene, stepper = from_scene(
            SteadyBoiling, dim=2, spacing=spacing, width=24, fill=20, sites=1, heated=0.6, time_scaling=1000.0,
            pattern="regular", smallest_cavity=0.0,
            effects=dict(adhesion=SiteAdhesion(strength=self.adhesion), cohesion=Cohesion(sigma=sigma)))
        while len(scene.departures) < self.departures and stepper.solver.count < self.longest:
            stepper.step(50)
        sizes = np.array([n for _, n, _ in scene.departures[:self.departures]])
        enough = len(sizes) == self.departures
        return Outcome(errors={}, seconds=stepper.seconds, simulated=stepper.t, steps=stepper.solver.count,
                       particles=len(scene.scheme.arrays[0].m),
                       facts={"sizes": sizes, "size": float(np.mean(sizes)) if enough else np.nan,
                              "size_error": standard_error(sizes) if enough else np.nan})

"""Steady boiling (2-D): the rate of vaporisation compared with the heater's power over the latent heat."""
from dataclasses import dataclass

import numpy as np

from pysph_boiling.analysis.boiling import heat_flux
from pysph_boiling.evaluation.problems.from_scene import from_scene
from pysph_boiling.evaluation.problems.problem import Outcome, Problem
from pysph_boiling.examples.steady_boiling import SteadyBoiling

__all__ = ["BoilingRate"]


@dataclass(frozen=True, kw_only=True)
class BoilingRate(Problem):
    """The scene ``steady_boiling`` in 2-D with equal sites in a row; everything is counted from the time ``begin``.

    Errors: ``rate``, the number of particles vaporised minus those condensed, relative to the number that the heater's
    energy can vaporise, minus 1 (the energy also warms the liquid that the lid returns); ``energy`` and ``mass``, the
    largest residuals of the ledger. Facts are means over the same time: ``flux`` [W/m^2] before the factor A,
    ``vapour`` and ``superheated`` particles, ``T_mean`` [K], bubbles ``vented`` per second [1/s], particles in a
    ``bubble`` that vents; and counts.
    """

    title = "steady boiling"
    reference = "net vapour = heater power / (m_p (L + c_l dT_feed))"

    width: int = 60  # spacings
    fill: int = 35  # spacings
    sites: int = 5
    heated: float = 0.7  # of the base
    superheat: float = 60.0  # K, of the base
    subcooling: float = 2.0  # K, of the feed
    spacing: float = 0.002  # m
    time_scaling: float = 1000.0
    duration: float = 8.0  # s
    begin: float = 5.0  # s
    seed: int = 1

    def run(self):
        scene, stepper = from_scene(
            SteadyBoiling, ledger=True, dim=2, duration=self.duration, seed=self.seed, spacing=self.spacing,
            width=self.width, fill=self.fill, sites=self.sites, heated=self.heated, subcooling=self.subcooling,
            time_scaling=self.time_scaling, superheat=self.superheat, pattern="regular", smallest_cavity=0.0)
        steps = round(self.duration / stepper.dt)
        stepper.step(steps)
        table, scheme = scene.ledger.table(), scene.scheme
        late = table["t"] > self.begin
        span = np.ptp(table["t"][late])

        def change(name):
            return table[name][-1] - table[name][late][0]

        material, mass = scheme.material, scheme.scene().particle_mass
        price = mass * (material.L + material.c_l * self.subcooling)
        made, paid = change("n_nucleated") - change("n_condensed"), change("energy_heater") / price
        vents = [n for t, n in scene.vents if t > self.begin]
        return Outcome(
            errors={"rate": made / paid - 1.0, "energy": float(np.max(np.abs(table["energy_residual"]))),
                    "mass": float(np.max(np.abs(table["mass_residual"])))},
            seconds=stepper.seconds, simulated=stepper.t, steps=steps, particles=len(scheme.arrays[0].m),
            curves={"t [s]": table["t"], "made [-]": table["n_nucleated"] - table["n_condensed"],
                    "paid for [-]": table["energy_heater"] / price, "vapour [-]": table["n_vapour"]},
            facts={"made": float(made), "paid": float(paid), "condensed": float(change("n_condensed")),
                   "flux": heat_flux(table, area=self.heated * self.width * self.spacing,
                                     time_scaling=self.time_scaling, begin=self.begin),
                   "vapour": float(table["n_vapour"][late].mean()), "T_mean": float(table["T_mean"][late].mean()),
                   "superheated": float(table["n_superheated"][late].mean()),
                   "vented": float(change("n_bubbles_vented") / span),
                   "bubble": float(np.mean(vents)) if vents else float("nan")})

"""Minnaert 1933: the oscillation of a bubble in a pool after a change of its volume, measured from its particles."""
import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import curve_fit

from pysph_boiling.evaluation.problems.problem import Outcome, Problem
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.particles import add_properties, box_vessel, fluid_block, positions
from pysph_boiling.phases import Phase
from pysph_boiling.runs.stepper import Stepper
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    BoxContainer,
    BubbleLabels,
    Cohesion,
    Expansion,
    HeatConduction,
    Oscillation,
    PhaseChange,
    XSPHViscosity,
)

__all__ = ["RingingBubble"]

PRESSURE, KAPPA = 101325.0, 1.33  # of the steam


def swing(t, mean, size, omega, phase, rate):
    """A damped oscillation about a mean."""
    return mean + size * np.exp(-rate * t) * np.cos(omega * t + phase)


@dataclass(frozen=True, kw_only=True)
class RingingBubble(Problem):
    """A ball of vapour in a pool (3-D) starts with ``disturbed`` times its rest volume and runs for three periods.

    This tests the equation of the volume, the rest volume of the particles, the density sweeps and the radius
    constraint together. Vapour is as heavy as liquid here and does not expand, so the bubble does not rise. A damped
    oscillation is fitted to the mean radius after half a period, when the pool has settled.

    Errors: ``period``, relative to theory, minus 1; ``decay``, the difference from theory of the fraction of the
    amplitude lost per period; ``unexplained``, the standard deviation of the residual of the fit, relative to that of
    the radius; ``apart``, the fraction of the vapour that is no longer in the bubble. Fact: ``fR`` [m/s], frequency
    times radius in the bubble's own time.
    """

    title = "ringing bubble"
    reference = "omega^2 = (3 kappa p_gas - 2 sigma/R)/(rho R^2), decay 2 mu/(rho R^2): Minnaert 1933"

    radius: float = 1.9  # spacings
    disturbed: float = 0.85  # of the rest volume
    viscosity: float = 0.0  # Pa s
    spacing: float = 0.004  # m
    width: int = 12  # of the pool, in spacings
    slowdown: float = 30.0  # the oscillation runs this many times slower than in nature

    def run(self):
        water, dx = WATER_1ATM, self.spacing
        upper = np.full(3, self.width * dx)
        scheme = BoilingScheme(
            ["fluid"], ["wall"], dim=3, spacing=dx, container=BoxContainer(upper=tuple(upper + dx)),
            viscosity=XSPHViscosity(), heat=HeatConduction(), phases=PhaseChange(), bubbles=BubbleLabels(),
            cohesion=Cohesion(), expansion=Expansion(v_exp=1.0), oscillation=Oscillation(
                form="rayleigh_plesset", slowdown=self.slowdown, pressure=PRESSURE, kappa=KAPPA,
                viscosity=self.viscosity))
        common = dict(spacing=dx, dim=3, rho0=water.rho_l)
        fluid = fluid_block((0.0,) * 3, upper, jitter=0.01, seed=1, **common)
        wall = box_vessel((0.0,) * 3, upper + (0.0, 0.0, 3.0 * dx), kernel=scheme.kernel, **common)
        scheme.setup_properties([fluid, wall])
        add_properties(fluid, Oscillation(form="hysteresis").properties(scheme.scene()))  # to share modules with it
        scheme.set_temperature(fluid, water.T_sat - 2.0)
        x = positions(fluid)
        bubble = np.linalg.norm(x - 0.5 * upper, axis=1) < self.radius * dx
        fluid.phase[bubble], fluid.e[bubble], fluid.swell[bubble] = Phase.VAPOUR, water.L, self.disturbed
        stepper = Stepper(scheme, [fluid, wall])

        R, period, decay = self.theory(int(bubble.sum()))
        t, r = [], []
        while stepper.t < 3.0 * period:
            stepper.step()
            x = positions(fluid)[bubble]
            t.append(stepper.t)
            r.append(np.mean(np.linalg.norm(x - x.mean(axis=0), axis=1)) / dx)
        t, r = np.array(t), np.array(r)
        late = t > 0.5 * period
        guess = (r[late].mean(), 0.5 * np.ptp(r[late]), 2.0 * math.pi / period,
                 0.0 if self.disturbed > 1.0 else math.pi, decay)
        fit = curve_fit(swing, t[late], r[late], p0=guess)[0]
        found, rate = 2.0 * math.pi / fit[2], fit[4]
        return Outcome(
            errors={"period": float(found / period - 1.0), "decay": float((rate - decay) * period),
                    "unexplained": float(np.std(r[late] - swing(t[late], *fit)) / np.std(r[late])),
                    "apart": float(np.mean(fluid.bubble[bubble] != fluid.uid[bubble].min()))},
            seconds=stepper.seconds, simulated=stepper.t, steps=stepper.solver.count, particles=len(fluid.m),
            curves={"t [s]": t, "r [dx]": r, "fit [dx]": swing(t, *fit)},
            facts={"N": int(bubble.sum()), "rate": float(rate), "rate of theory": decay, "steps a period": period
                   / stepper.dt, "fR": float(R * self.slowdown / found)})

    def theory(self, n):
        """Radius at rest [m], period [s] and rate of decay [1/s] of a bubble of n particles, in the scene's time."""
        water = WATER_1ATM
        R = (3.0 * n * self.spacing**3 / (4.0 * math.pi)) ** (1.0 / 3.0)
        gas = PRESSURE + 2.0 * water.sigma / R
        omega2 = (3.0 * KAPPA * gas - 2.0 * water.sigma / R) / (water.rho_l * R**2)
        decay = 2.0 * self.viscosity / (water.rho_l * R**2)
        return R, self.slowdown * 2.0 * math.pi / math.sqrt(omega2 - decay**2), decay / self.slowdown

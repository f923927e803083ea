"""A bubble rises through a pool of slightly superheated water to the surface, and pulsates.

Equations   density constraint (the paper, eqs. 1-2), conduction (eqs. 8-16), phases (section 3.3.2), dynamic nucleation
            (eqs. 3-7), bubbles (4.1), condensation (eqs. 20-22), buoyancy (eqs. 18-19), surface tension and resistance
            (4.2.1), oscillation (4.3, in the form with a period); a lid returns vented vapour as liquid.
Source      "Physically Based Boiling Simulation with Thermally Driven Dynamic Nucleation", Fig. 7; Fig. 10 with
            ``--no-dynamic-nucleation``, and ``--no-oscillation`` for the other half of the ablation.
Run time    about 40 s on two cores (3-D, 20,328 particles, 648 steps for 0.9 s); less with ``--demo`` or ``--flat``.
            The first run also compiles.
Command     pysph-boiling run bubble_rise
"""
from dataclasses import dataclass

import numpy as np

from pysph_boiling.analysis.shapes import fall, history, largest
from pysph_boiling.checks import require
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import NO_BUBBLE, box_vessel, fluid_block, positions
from pysph_boiling.phases import Phase
from pysph_boiling.runs.application import SceneApplication, SceneParameters, base_heater, upright_box
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    BoxContainer,
    BubbleLabels,
    Buoyancy,
    Cohesion,
    Condensation,
    DensityConstraint,
    Drag,
    DynamicNucleation,
    Expansion,
    HeatConduction,
    LatentPooling,
    Oscillation,
    PhaseChange,
    Venting,
    XSPHViscosity,
    param,
)


@dataclass(frozen=True, kw_only=True)
class BubbleRiseParameters(SceneParameters):
    """An open box of water slightly above saturation, with a bubble near its base."""

    duration: float = param(0.9, "s", "simulated time", above=0.0, may_change=True)
    frame: float = param(1.0 / 60.0, "s", "time between two outputs", above=0.0, may_change=True)
    seed: int = param(1, "-", "seed of the start positions", low=0)
    dim: int = param(3, "-", "dimension", choices=(2, 3))
    spacing: float = param(0.004, "m", "particle spacing", above=0.0)
    width: int = param(22, "-", "width and depth of the vessel, in spacings", low=8)
    fill: int = param(42, "-", "height of the water, in spacings", low=12)
    diameter: float = param(6.0, "-", "diameter of the bubble, in spacings", above=1.0)
    height: float = param(5.0, "-", "height of its centre above the base, in spacings", above=0.0)
    superheat: float = param(10.0, "K", "temperature of the water above saturation", low=0.0, high=30.0, law="L/c_l")
    superheat_limit: float = param(60.0, "K", "superheat at which water bursts", above=0.0,
                                   sets="dynamic_nucleation.superheat_limit", law="L/c_l")
    time_scaling: float = param(800.0, "-", "A: heat runs this many times faster against motion", above=0.0,
                                sets="heat.time_scaling", law="rho_l c_l/k_l")
    base_superheat: float = param(0.0, "K", "temperature of the base above saturation; 0 for a base without a heater",
                                  low=0.0, high=250.0, law="L/c_l")


class BubbleRise(SceneApplication):
    """The scene of this module, and the base of scenes with a few bubbles.

    Those override :meth:`bubbles` and :meth:`check_bubbles`.
    """

    Parameters = BubbleRiseParameters
    title = "bubble rise"
    variants = {
        "demo": dict(width=14, fill=30, duration=1.0),
        "flat": dict(dim=2, spacing=0.002, width=30, fill=40, time_scaling=1000.0, duration=0.5),
    }

    def box(self, p):
        """Inner corners of the vessel [m]; its top is the lid."""
        return upright_box(p, p.width, 1.3 * p.fill)

    def bubbles(self, p):
        """Centres and diameters of the bubbles at the start, in spacings: (x from the middle, height, diameter)."""
        return [(0.0, p.height, p.diameter)]

    def flow(self, place, p):
        """Velocity (n, dim) [m/s] at the start at ``place`` (n, dim), in spacings from the middle of the base."""
        return np.zeros_like(place)

    def make_scheme(self, p):
        lower, upper = self.box(p)
        return BoilingScheme(
            ["fluid"], ["wall"], dim=p.dim, spacing=p.spacing, material=self.material,
            density=DensityConstraint(max_sweeps=4, tolerance=5e-3),
            container=BoxContainer(lower=lower, upper=upper),
            viscosity=XSPHViscosity(),
            heat=HeatConduction(time_scaling=p.time_scaling),
            **base_heater(p, self.material),
            phases=PhaseChange(),
            dynamic_nucleation=DynamicNucleation(superheat_limit=p.superheat_limit),
            bubbles=BubbleLabels(),
            condensation=Condensation(),
            pooling=LatentPooling(),
            buoyancy=Buoyancy(k_bubble=1.0),  # what displaced liquid weighs
            cohesion=Cohesion(),
            drag=Drag(),
            expansion=Expansion(v_exp=1.0),
            oscillation=Oscillation(form="hysteresis"),
            venting=Venting(mode="lid"))

    def make_particles(self, p, scheme):
        lower, upper = self.box(p)
        corner = list(upper)
        corner[p.dim - 1] = p.fill * p.spacing
        common = dict(spacing=p.spacing, dim=p.dim, rho0=scheme.rho0, hdx=scheme.hdx)
        fluid = fluid_block(lower, corner, jitter=0.01, seed=p.seed, part=self.ranks_part, **common)
        wall = box_vessel(lower, upper, kernel=scheme.kernel, heated_fraction=float(p.base_superheat > 0.0), **common)
        return [fluid, wall]

    def start_temperature(self, p):
        return self.material.T_sat + p.superheat

    def start(self, arrays, p, scheme):
        fluid, material = arrays["fluid"], self.material
        scheme.set_temperature(fluid, self.start_temperature(p))
        fluid.bubble[:] = NO_BUBBLE
        place = positions(fluid)[:, :p.dim] / p.spacing
        place[:, :-1] -= 0.5 * p.width
        for name, velocity in zip("uvw", self.flow(place, p).T):
            fluid.get(name)[:] = velocity
        for x, height, diameter in self.bubbles(p):
            centre = [x, height] if p.dim == 2 else [x, 0.0, height]
            inside = np.linalg.norm(place - centre, axis=1) < 0.5 * diameter
            fluid.phase[inside], fluid.e[inside], fluid.T[inside] = Phase.VAPOUR, material.L, material.T_sat
            fluid.bubble[inside] = -ranks.largest(-int(fluid.uid[inside].min(initial=NO_BUBBLE)))

    def measure(self, arrays, t):
        if "bubbles" not in self.scheme.effects:
            return {}
        return largest(arrays["fluid"], t, self.parameters.dim, self.material.rho_l)

    def history(self):
        """History of the bubbles: column -> array (outputs,), as from :func:`~pysph_boiling.analysis.shapes.track`."""
        return history(self.measured())

    def check_final(self):
        self.check_needs("bubbles")
        self.check_bubbles(self.history())

    def check_bubbles(self, history):
        """Check what the scene must show of its bubbles."""
        self.check_needs("venting")
        p = self.parameters
        height, diameter = history["height1"], p.diameter * p.spacing
        whole = float(np.min(history["n1"] / history["n"]))
        require(whole >= 0.8, f"the bubble fell apart: its largest piece holds {whole:.0%} of the vapour")
        risen = height[-1] - height[0]  # the surface ends it
        require(risen >= 3.0 * diameter, f"the bubble rose by {risen / diameter:.2g} of its diameters, less than 3")
        sunk = fall(history)
        require(sunk <= 0.5 * p.spacing, f"the bubble sank by {sunk / p.spacing:.2g} spacings in a frame")
        # one, or one more for each piece of the fifth that may come off
        require(self.ledger.rows[-1]["n_bubbles_vented"] >= 1, "the bubble did not reach the surface")


if __name__ == "__main__":
    BubbleRise().run()

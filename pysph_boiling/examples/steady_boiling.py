"""Steady boiling: in a vessel on a hot base, vapour bubbles grow at preset sites, depart, rise and burst.

The sites lie at random places. Each has a cavity of its own, and wakes when the liquid over it is hot enough.
``--pattern regular --smallest-cavity 0`` gives sites in rows that are alike and always active. ``--fine`` has 163,072
particles of 2 mm.

Equations   density constraint (the paper, eqs. 1-2), conduction (eqs. 8-16), phases (section 3.3.2), preset sites
            (3.2.1) that wake at a superheat (Hsu 1962), bubbles (4.1), condensation (eqs. 20-22), buoyancy (eqs.
            18-19), detachment (4.2.1); a lid returns vented vapour as liquid.
Source      "Physically Based Boiling Simulation with Thermally Driven Dynamic Nucleation", Fig. 3.
Run time    about 3 minutes on two cores (3-D, 20,384 particles, 2,880 steps for 4 s); less with ``--demo`` or
            ``--flat``. The first run also compiles.
Command     pysph-boiling run steady_boiling
"""
from dataclasses import dataclass

import numpy as np

from pysph_boiling.cavities import activation_superheat, cavity_radii
from pysph_boiling.checks import require
from pysph_boiling.particles import box_vessel, fluid_block, site_array, sites_on_base
from pysph_boiling.runs.application import SceneApplication, SceneParameters, upright_box
from pysph_boiling.runs.described import described_content
from pysph_boiling.runs.scene_file import Description, Fluid, HeatedPart, Sites, Vessel
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import BoxContainer, Heater, param
from pysph_boiling.schemes.recipes import ADHESION, K_BUBBLE, boiling_effects


@dataclass(frozen=True, kw_only=True)
class SteadyBoilingParameters(SceneParameters):
    """An open box of water near saturation, with a base that is heated in the middle."""

    duration: float = param(4.0, "s", "simulated time", above=0.0, may_change=True)
    frame: float = param(1.0 / 30.0, "s", "time between two outputs", above=0.0, may_change=True)
    seed: int = param(1, "-", "seed of the start positions and of random sites", low=0)
    dim: int = param(3, "-", "dimension", choices=(2, 3))
    spacing: float = param(0.004, "m", "particle spacing", above=0.0)
    width: int = param(28, "-", "width and depth of the vessel, in spacings", low=8)
    fill: int = param(26, "-", "height of the water, in spacings", low=6)
    sites: int = param(24, "-", "preset nucleation sites on the heated base", low=1)
    pattern: str = param("random", "-", "layout of the sites", choices=("regular", "random"))
    smallest_cavity: float = param(4e-6, "m", "smallest radius of the sites' cavities; 0 makes all sites alike, active "
                                   "at saturation", low=0.0, law="sigma T_sat c_l/(rho_v L^2)")
    largest_cavity: float = param(6e-6, "m", "largest radius of the sites' cavities; 0 for none", low=0.0,
                                  law="sigma T_sat c_l/(rho_v L^2)")
    embryo: float = param(0.25, "-", "smallest radius of the embryo that a bubble leaves, in radii of its cavity",
                          above=0.0, high=1.0, sets="preset_nucleation.embryo")
    heated: float = param(0.75, "-", "heated fraction of the base's width", above=0.0, high=1.0)
    subcooling: float = param(2.0, "K", "start and feed temperature below saturation", low=0.0, high=80.0, law="L/c_l")
    time_scaling: float = param(800.0, "-", "A: factor by which heat is faster relative to motion", above=0.0,
                                sets="heat.time_scaling", law="rho_l c_l/k_l")
    superheat: float = param(60.0, "K", "temperature of the base above saturation", above=0.0, high=250.0,
                             may_change=True, sets="heater.temperature", law="L/c_l")


class SteadyBoiling(SceneApplication):
    """The scene of this module."""

    Parameters = SteadyBoilingParameters
    title = "steady boiling"
    variants = {
        "demo": dict(width=20, fill=18, sites=9, heated=0.7, duration=2.5, frame=0.05),
        "flat": dict(dim=2, spacing=0.002, width=60, fill=35, sites=6, heated=0.7, time_scaling=1000.0, duration=3.0),
        "fine": dict(spacing=0.002, width=56, fill=52, sites=30, time_scaling=400.0),
    }

    ADHESION, K_BUBBLE = ADHESION, K_BUBBLE

    def box(self, p):
        """Inner corners of the vessel [m]; its top, half a filling above the water, is the lid."""
        return upright_box(p, p.width, 1.5 * p.fill)

    def make_scheme(self, p):
        lower, upper = self.box(p)
        material = self.material
        return BoilingScheme(
            ["fluid"], ["wall"], dim=p.dim, spacing=p.spacing, sites=["sites"], material=material,
            container=BoxContainer(lower=lower, upper=upper),
            heater=Heater(temperature=material.T_sat + p.superheat),
            **boiling_effects(
                time_scaling=p.time_scaling, own_cavities=p.smallest_cavity > 0.0, embryo=p.embryo, seed=p.seed,
                adhesion=self.ADHESION[p.dim], k_bubble=self.K_BUBBLE[p.dim],
                T_feed=material.T_sat - p.subcooling))

    def make_particles(self, p, scheme):
        lower, upper = self.box(p)
        corner = list(upper)
        corner[p.dim - 1] = p.fill * p.spacing
        common = dict(spacing=p.spacing, dim=p.dim, rho0=scheme.rho0, hdx=scheme.hdx)
        fluid = fluid_block(lower, corner, jitter=0.01, seed=p.seed, part=self.ranks_part, **common)
        wall = box_vessel(lower, upper, kernel=scheme.kernel, heated_fraction=p.heated, jitter=scheme.wall_jitter,
                          **common)
        middle, half = 0.5 * p.width * p.spacing, 0.5 * p.heated * p.width * p.spacing
        base_lower, base_upper = [middle - half] * 3, [middle + half] * 3
        base_lower[p.dim - 1] = base_upper[p.dim - 1] = 0.0
        points = sites_on_base(p.sites, lower=base_lower, upper=base_upper, dim=p.dim, pattern=p.pattern, seed=p.seed)
        return [fluid, wall, site_array(points, reach=2.4 * p.spacing, spacing=p.spacing,
                                        activation=self.activation(p))]

    def activation(self, p):
        """Activation superheats of the sites [K], a number or (sites,)."""
        if p.smallest_cavity == 0.0:
            return 0.0
        radii = cavity_radii(p.sites, smallest=p.smallest_cavity, largest=p.largest_cavity or np.inf,
                             seed=[p.seed, 1])  # a stream of its own
        return activation_superheat(radii, self.material)

    def described(self, p):
        """The scene as a :class:`~pysph_boiling.runs.scene_file.Description`, for ``--write-scene``."""
        _, upper = self.box(p)
        middle, half, thick = 0.5 * p.width * p.spacing, 0.5 * p.heated * p.width * p.spacing, 0.5 * p.spacing
        across = p.dim - 1
        return Description(
            vessel=Vessel(box=list(upper[:p.dim]), lid=True),
            fluids=(Fluid(fill=p.fill * p.spacing / upper[across], temperature=self.material.T_sat - p.subcooling),),
            heaters=(HeatedPart(box=[[middle - half] * across + [-thick], [middle + half] * across + [thick]],
                                temperature=self.material.T_sat + p.superheat),),
            sites=self.described_sites(p))

    def described_sites(self, p):
        """The sites for :meth:`described`."""
        return Sites(number=p.sites, pattern=p.pattern, smallest_cavity=p.smallest_cavity,
                     largest_cavity=p.largest_cavity, embryo=p.embryo)

    def scene_content(self):
        p = self.parameters
        names = ("duration", "frame", "substeps", "seed", "dim", "spacing", "time_scaling")
        return described_content(self, self.described(p), {name: getattr(p, name) for name in names})

    def start_temperature(self, p):
        return self.material.T_sat - p.subcooling

    def start(self, arrays, p, scheme):
        scheme.set_temperature(arrays["fluid"], self.start_temperature(p))

    def facts(self):
        p, scheme, effects = self.parameters, self.scheme, self.scheme.effects
        scene, material = scheme.scene(), scheme.material
        facts = {"t* = sqrt(dx/g)": (scene.fall_time, "s")}
        if "heat" not in effects:
            return facts
        heat = effects["heat"]
        k = heat.conductivity(material.k_l)
        facts |= {
            "A (heat relative to motion)": (heat.time_scaling, "-"),
            "E (enhanced conductivity)": (heat.enhancement, "-"),
            "Fo = alpha_eff t*/dx^2": (k / (material.rho_l * material.c_l) * scene.fall_time / p.spacing**2, "-")}
        if "heater" in effects:
            heater = effects["heater"]
            superheat = (heater.temperature - material.T_sat if heater.flux is None
                         else heater.flux * heat.time_scaling * p.spacing / k)
            facts |= {
                "q dx/k_eff (superheat across a spacing)": (superheat, "K"),
                "St = c_l superheat/L": (material.c_l * superheat / material.L, "-")}
            power = k * superheat / p.spacing * (p.heated * p.width * p.spacing) ** (p.dim - 1)
            if power > 0.0:
                facts["time to boil dry at that flux"] = (self.ledger.mass(scheme.arrays) * material.L / power, "s")
        return facts

    def check_final(self):
        self.check_needs("preset_nucleation", "bubbles", "venting")
        results, last = self.ledger.table(), self.ledger.rows[-1]
        departed = [n for _, n, _ in self.departures]
        require(departed, "no bubble left the base")
        median = float(np.median(departed))
        dim, across = self.parameters.dim, 0.5 * self.parameters.width
        film = np.pi / {2: 4.0, 3: 6.0}[dim] * across**dim  # wider than half the base, it is a film and not a bubble
        require(8 <= median <= film, f"at departure the median bubble has {median:g} particles; it must have 8 to "
                f"{film:.0f}, as many as a bubble half as wide as the vessel")
        vented = last["n_bubbles_vented"]  # grows with the duration, so it has no upper bound
        require(vented >= 5, f"{vented:g} bubbles reached the surface; it must be at least 5")
        single = np.sum(results["n_single_bubbles"]) / np.sum(results["n_bubbles"])
        require(single < 0.3, f"{single:.0%} of the bubbles are single particles")


if __name__ == "__main__":
    SteadyBoiling().run()

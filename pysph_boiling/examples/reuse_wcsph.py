"""PySPH's WCSPH scheme, unmodified, boils: our model is a guest in a vessel with walls, a hot base and sites.

Equations   WCSPHScheme of PySPH moves the particles; heat, phases, sites, bubbles, condensation, venting, buoyancy,
            cohesion, adhesion and drag are added by ``BoilingGuest``. ``--mode gu`` is the model of Gu et al., which
            is an SPH model, and ``--mode li_xiao`` that of Li & Xiao.
Source      ours, after "Physically Based Boiling Simulation with Thermally Driven Dynamic Nucleation", Fig. 3.
Run time    about 2 minutes on two cores (2-D, 480 particles, 17,509 steps for 1.5 s). The first run also compiles.
Command     pysph-boiling run reuse_wcsph
"""
import math
import os

import numpy as np
from pysph.base.kernels import CubicSpline
from pysph.base.utils import get_particle_array
from pysph.sph.integrator import PECIntegrator
from pysph.sph.scheme import WCSPHScheme

from pysph_boiling.checks import require
from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.materials import in_proportion
from pysph_boiling.particles import box_vessel, fluid_block, site_array, sites_on_base
from pysph_boiling.runs import pysph_options
from pysph_boiling.runs.hosted import HostedApplication
from pysph_boiling.runs.ledger import GuestLedger, write_json
from pysph_boiling.runs.provenance import origin
from pysph_boiling.schemes import effects
from pysph_boiling.schemes.bubbles import Departures
from pysph_boiling.schemes.guest import BoilingGuest
from pysph_boiling.schemes.modes import MODES
from pysph_boiling.schemes.options import add_material_options, chosen_material

SPACING, WIDTH, FILL = 0.004, 30, 16  # particle spacing [m]; width of the vessel and height of the water, in spacings
HDX = 1.2  # smoothing length over spacing
SITES, HEATED = 4, 0.7  # nucleation sites, on the heated fraction of the base
SUBCOOLING, SUPERHEAT = 2.0, 60.0  # start below, and base above saturation, for water [K]
TIME_SCALING = 2800.0  # factor by which heat is faster relative to motion, for water
DURATION, FRAME = 1.5, 0.05  # simulated time, and time between two outputs [s]
G = 9.81  # m/s^2
C_0 = 10.0 * math.sqrt(2.0 * G * FILL * SPACING)  # speed of sound [m/s]
RESIDUAL = 1e-12  # largest energy that is not accounted for, relative to what moved
LEAK = 0.5  # spacings that a particle may be outside the vessel: walls are particles, and press only when it is near


class ReuseWCSPH(HostedApplication):
    """The scene of this module. Subclasses have other schemes of PySPH."""

    time_step = 0.2 * HDX * SPACING / C_0  # s
    solver_options = dict(integrator_cls=PECIntegrator)

    def add_user_options(self, group):
        add_material_options(group)
        group.add_argument("--mode", default="dynamic", choices=tuple(MODES), help="model of boiling")
        group.add_argument("--no-pictures", action="store_true", help="draw no pictures at the end")

    def resolve(self, arguments):
        """Text with all parameters of the guest that follow from command-line arguments; runs nothing."""
        self.set_args(list(arguments))
        self._parse_command_line(force=True)
        self.consume_user_options()
        return "\n".join(map(repr, self.guest.scheme.effects.values()))

    def consume_user_options(self):
        pysph_options.check(self.options)
        self.material = fluid = chosen_material(self.options, WATER)
        subcooling, superheat = (in_proportion(T, "L/c_l", WATER, fluid) for T in (SUBCOOLING, SUPERHEAT))
        self.start = fluid.T_sat - subcooling  # K
        heat = effects.HeatConduction(time_scaling=in_proportion(TIME_SCALING, "rho_l c_l/k_l", WATER, fluid))
        self.guest = BoilingGuest(
            ["fluid"], ["wall"], ["sites"], dim=2, spacing=SPACING, hdx=HDX, material=fluid, mode=self.options.mode,
            heat=heat, heater=effects.Heater(temperature=fluid.T_sat + superheat),
            phases=effects.PhaseChange(), preset_nucleation=effects.PresetNucleation(),
            bubbles=effects.BubbleLabels(), condensation=effects.Condensation(), pooling=effects.LatentPooling(),
            buoyancy=effects.Buoyancy(), cohesion=effects.Cohesion(), adhesion=effects.SiteAdhesion(strength=4.0),
            drag=effects.Drag(), venting=effects.Venting(T_feed=self.start))

    # --- PySPH's scheme, as its user would set it up ------------------------------------------------------------------

    def create_scheme(self):
        return WCSPHScheme(["fluid"], ["wall"], dim=2, rho0=WATER.rho_l, c0=C_0, h0=HDX * SPACING, hdx=HDX, gy=-G,
                           alpha=0.1, hg_correction=True)

    def configure_scheme(self):
        self.scheme.configure(rho0=self.material.rho_l)
        self.scheme.configure_solver(kernel=CubicSpline(dim=2), dt=self.time_step, tf=DURATION,
                                     pfreq=round(FRAME / self.time_step), **self.solver_options)

    def create_particles(self):
        common = dict(spacing=SPACING, dim=2, rho0=self.material.rho_l, hdx=HDX)
        width, height = WIDTH * SPACING, FILL * SPACING
        water = fluid_block((0.0, 0.0, 0.0), (width, height, 0.0), jitter=0.01, seed=1, **common)
        box = box_vessel((0.0, 0.0, 0.0), (width, 1.5 * height, 0.0), kernel=CubicSpline(dim=2), layers=4,
                         heated_fraction=HEATED, **common)
        fluid, wall = (get_particle_array(name=name, x=points.x, y=points.y, m=self.material.rho_l * SPACING**2,
                                          rho=self.material.rho_l, h=HDX * SPACING)
                       for name, points in (("fluid", water), ("wall", box)))
        self.scheme.setup_properties([fluid, wall])

        margin = 0.5 * (1.0 - HEATED) * width
        sites = site_array(sites_on_base(SITES, lower=(margin, 0.0, 0.0), upper=(width - margin, 0.0, 0.0), dim=2),
                           reach=2.4 * SPACING, spacing=SPACING)
        particles = [fluid, wall, sites]
        self.guest.setup(particles, heated={"wall": box.heated})
        self.guest.set_temperature(fluid, self.start)
        return particles

    # --- the guest ----------------------------------------------------------------------------------------------------

    def create_equations(self):
        own = self.scheme.get_equations()
        for number, group in enumerate(own):  # PySPH counts unnamed groups over the whole process, and names are part
            group.name = f"scheme_{number}"  # of the key of its cache: without these two lines it may compile again
        return [*own, *self.guest.groups()]

    def create_tools(self):
        path = None if self.options.disable_output else os.path.join(self.output_dir, "results.npz")
        self.ledger = GuestLedger(self.guest, every=10, path=path)
        self.guest_tools = self.guest.tools()
        return [*self.guest_tools, self.ledger]

    # --- the result ---------------------------------------------------------------------------------------------------

    @property
    def departures(self):
        """Bubbles that departed from the base: list of (time [s], particles, site)."""
        return [event for tool in self.guest_tools if isinstance(tool, Departures) for event in tool.events]

    def run(self, argv=None):
        """Run, draw, and check the final state."""
        super().run(argv)
        if not self.options.disable_output:
            write_json(os.path.join(self.output_dir, "run.json"), self.record())
            if not self.options.no_pictures:
                print(f"picture: {self.post_process(self.info_filename)}")
        last = self.ledger.rows[-1]
        print(f"{len(self.departures)} bubbles departed, {last['n_nucleated']:.0f} particles became vapour, "
              f"{last['n_bubbles_vented']:.0f} bubbles left at the surface; energy not accounted for: "
              f"{last['energy_residual']:.1e}")
        if self.solver.t >= DURATION * (1.0 - 1e-6):  # neither --max-steps nor --tf
            self.check_final()

    def record(self):
        """What ``run.json`` says of the run."""
        return {"scene": self.fname, "scheme": type(self.scheme).__name__, "mode": self.options.mode, "dim": 2,
                "spacing": SPACING, "steps": self.solver.count, "completed": True, "departures": self.departures,
                "columns": self.ledger.described(),
                "material": self.material.name, "constants": self.material.constants(),
                "effects": {slot: repr(effect) for slot, effect in self.guest.scheme.effects.items()}, **origin()}

    def check_final(self):
        """Check that bubbles departed and left, that energy and mass are balanced, and that the vessel holds."""
        table = self.ledger.table()
        require(np.max(np.abs(table["energy_residual"])) <= RESIDUAL, "the energy is not balanced")
        require(np.max(np.abs(table["mass_residual"])) <= RESIDUAL, "the mass is not balanced")
        require(self.departures, "no bubble left the base")
        require(table["n_bubbles_vented"][-1] >= 1, "no bubble reached the surface")
        fluid = self.particles[0]
        outside = -min(fluid.x.min(), WIDTH * SPACING - fluid.x.max(), fluid.y.min()) / SPACING
        require(outside <= LEAK, f"a particle is {outside:.2g} spacings outside the vessel")

    def post_process(self, info_fname_or_directory):
        """Draw all outputs, and nine of them on a sheet; returns its path."""
        from pysph_boiling.analysis.rendering import contact_sheet, render_run

        self.read_info(info_fname_or_directory)
        return str(contact_sheet(render_run(self.output_dir), os.path.join(self.output_dir, "frames.png")))


if __name__ == "__main__":
    ReuseWCSPH().run()

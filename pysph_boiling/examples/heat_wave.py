"""PySPH's WCSPH scheme, unmodified, with our heat equations: a temperature wave drifts with a fluid and decays.

Equations   WCSPHScheme of PySPH; conduction between particles (Cleary & Monaghan 1999), T = T_m + A cos(k (x - U t))
            with A = A_0 exp(-alpha k^2 t).
Source      a Fourier mode of the heat equation in a periodic box that is carried along at a uniform velocity.
Run time    about 1 s on two cores (2-D, 480 particles, 263 steps for 60.4 s). The first run also compiles.
Command     pysph-boiling run heat_wave
"""
import math
import os

import numpy as np
from pysph.base.nnps import DomainManager
from pysph.base.utils import get_particle_array
from pysph.sph.equation import Group
from pysph.sph.scheme import WCSPHScheme

from pysph_boiling.checks import require
from pysph_boiling.device import send
from pysph_boiling.equations.heat import HeatConductionClearyMonaghan, HeatTemperature, HeatTemperatureAfter, HeatUpdate
from pysph_boiling.files import last_output, read_output
from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.particles import add_properties, host
from pysph_boiling.runs.application import double_precision
from pysph_boiling.runs.hosted import HostedApplication
from pysph_boiling.schemes import effects
from pysph_boiling.schemes.integrator import HeatClock

LENGTH, N = 0.02, 40  # the box along x [m], and particles along it
SPACING = LENGTH / N
HEIGHT = 12 * SPACING  # the box along y [m]; the wave does not vary along it
K = 2.0 * math.pi / LENGTH  # wave number [1/m]
RATE = WATER.k_l / (WATER.rho_l * WATER.c_l) * K**2  # of the decay, alpha k^2 [1/s]
DURATION = 1.0 / RATE  # the amplitude falls to 1/e [s]
U, V = 0.4 * LENGTH / DURATION, 0.5 * HEIGHT / DURATION  # velocity [m/s]: much of the flow crosses the borders
C_0 = 10.0 * math.hypot(U, V)  # speed of sound [m/s]
T_MEAN, A_0 = 293.15, 10.0  # mean temperature and amplitude at the start [K]
DECAY_TOLERANCE = 0.02  # relative to the amplitude; on this lattice the Laplacian is 0.4 % (WCSPH) or 0.9 % (TVF) small
SHAPE_TOLERANCE = 0.02  # relative to the amplitude: deviation from a cosine that has drifted with the flow
# Relative to sum m |e| at the start: pairs are antisymmetric, so only round-off is left.
ENERGY_TOLERANCE = {"double": 1e-12, "single": 1e-4}


def heat_groups(fluid):
    """Groups with our equations, to be added after a scheme's own groups.

    Ghosts compute their own temperature (``real=False``). PySPH copies ``e`` to them after the last update, at the
    latest when the particles move, so both sides of the border see the same pair, and energy is conserved exactly.
    """
    return [
        Group([HeatTemperature(fluid, None, T0=T_MEAN, c=WATER.c_l, k=WATER.k_l)], real=False, name="heat_temperature"),
        Group([HeatConductionClearyMonaghan(fluid, [fluid], rho0=WATER.rho_l), HeatUpdate(fluid, None),
               HeatTemperatureAfter(fluid, None, T0=T_MEAN, c=WATER.c_l)], name="heat_exchange"),
    ]


class HeatWave(HostedApplication):
    """The scene of this module."""

    hdx = 1.3  # smoothing length over spacing; with the cubic spline the Laplacian is best near 1.0 and 1.3

    def create_scheme(self):
        return WCSPHScheme(["fluid"], [], dim=2, rho0=WATER.rho_l, c0=C_0, h0=self.hdx * SPACING, hdx=self.hdx)

    def configure_scheme(self):
        limit = effects.heat_step_limit(WATER.rho_l, WATER.c_l, WATER.k_l, self.hdx * SPACING)
        dt = min(self.scheme.get_timestep(), limit)
        self.scheme.configure_solver(dt=dt, tf=DURATION, pfreq=10**6)  # outputs: the first and the last step

    def create_domain(self):
        return DomainManager(xmin=0.0, xmax=LENGTH, ymin=0.0, ymax=HEIGHT, periodic_in_x=True, periodic_in_y=True)

    def create_equations(self):
        own = self.scheme.get_equations()
        for number, group in enumerate(own):  # PySPH counts unnamed groups over the whole process, and names are part
            group.name = f"scheme_{number}"  # of the key of its cache: without these two lines it may compile again
        return [*own, *heat_groups("fluid")]

    def create_particles(self):
        x, y = (grid.ravel() for grid in np.mgrid[0.5 * SPACING:LENGTH:SPACING, 0.5 * SPACING:HEIGHT:SPACING])
        fluid = get_particle_array(name="fluid", x=x, y=y, m=WATER.rho_l * SPACING**2, h=self.hdx * SPACING,
                                   rho=WATER.rho_l)
        self.scheme.setup_properties([fluid])
        self.add_heat(fluid)
        fluid.u[:], fluid.v[:] = U, V
        fluid.e[:] = WATER.c_l * A_0 * np.cos(K * fluid.x)
        fluid.T[:] = T_MEAN + fluid.e / WATER.c_l
        send([fluid])  # to the device, if there is one
        self.energy = float(np.sum(fluid.m * fluid.e)), float(np.sum(fluid.m * np.abs(fluid.e)))
        return [fluid]

    @staticmethod
    def add_heat(fluid):
        """Add the properties and constants of the heat equations, from the table of the effect."""
        heat = effects.HeatConduction()
        add_properties(fluid, heat.properties(None))
        for name, value in heat.constants(None).items():
            fluid.add_constant(name, value)

    def create_tools(self):
        return [HeatClock(self.particles)]  # PySPH's predictor-corrector evaluates once a step

    def run(self, argv=None):
        """Run, draw, and check the final state."""
        super().run(argv)
        if not self.options.disable_output:
            print(f"picture: {self.post_process(self.info_filename)}")
        print(f"error of the amplitude: {self.decay_error():+.2%}; relative change of energy: "
              f"{self.energy_drift():.1e}")
        self.check_final()

    # --- the final state ----------------------------------------------------------------------------------------------

    def excess(self):
        """Temperature above the mean [K] of the real particles, computed from ``e``."""
        return host(self.particles[0], "e") / WATER.c_l

    def phase(self):
        """Phase k (x - U t) of each particle in the drifting wave [rad]."""
        return K * (host(self.particles[0], "x") - U * self.solver.t)

    def decay_error(self):
        """Relative error of the amplitude [-]."""
        amplitude = 2.0 * float(np.mean(self.excess() * np.cos(self.phase())))
        return amplitude / (A_0 * math.exp(-RATE * self.solver.t)) - 1.0

    def shape_error(self):
        """Root mean square distance from the exact wave, relative to its amplitude [-]."""
        amplitude = A_0 * math.exp(-RATE * self.solver.t)
        return float(np.sqrt(np.mean((self.excess() / amplitude - np.cos(self.phase()))**2)))

    def energy_drift(self):
        """Change of sum m e, relative to sum m |e| at the start [-]."""
        fluid = self.particles[0]
        now = float(np.sum(host(fluid, "m") * host(fluid, "e")))
        return (now - self.energy[0]) / self.energy[1]

    def check_final(self):
        """Check the decay, the drift with the flow and the conservation of energy."""
        error, shape, drift = self.decay_error(), self.shape_error(), self.energy_drift()
        require(abs(error) <= DECAY_TOLERANCE, f"the amplitude differs by {error:+.2%} from the exact one")
        require(shape <= SHAPE_TOLERANCE, f"the wave differs by {shape:.2%} of its amplitude from the exact one")
        tolerance = ENERGY_TOLERANCE["double" if double_precision(self.options) else "single"]
        require(abs(drift) <= tolerance, f"the energy changed by {drift:.1e}")

    def post_process(self, info_fname_or_directory):
        """Draw the wave at the start and at the end, from the output files; returns the path of the picture."""
        from matplotlib.figure import Figure

        self.read_info(info_fname_or_directory)
        figure = Figure(figsize=(5, 4), layout="constrained")
        axes = figure.subplots()
        arrays, data = read_output(last_output(self.output_dir, self.fname))
        t, fluid = data["t"], arrays["fluid"]
        x = np.linspace(0.0, LENGTH, 200)
        for now, line in ((0.0, "k:"), (t, "k-")):
            wave = A_0 * math.exp(-RATE * now) * np.cos(K * (x - U * now))
            axes.plot(x * 1e3, T_MEAN + wave, line, label=f"exact, t = {now:.3g} s")
        axes.plot(fluid.x * 1e3, T_MEAN + fluid.e / WATER.c_l, ".", label=f"particles, t = {t:.3g} s")
        axes.set(xlabel="x [mm]", ylabel="temperature [K]", title=type(self.scheme).__name__)
        axes.legend()
        path = os.path.join(self.output_dir, "profile.png")
        figure.savefig(path, dpi=150)
        return path


if __name__ == "__main__":
    HeatWave().run()

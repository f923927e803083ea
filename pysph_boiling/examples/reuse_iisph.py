"""PySPH's IISPH scheme, unmodified, boils: the vessel of reuse_wcsph in an incompressible scheme.

Equations   IISPHScheme of PySPH (Ihmsen et al. 2014) moves the particles, with steps ten times as long; the guest is
            that of ``reuse_wcsph``. Its forces come after the pressure is solved, which corrects them a step later.
Source      ours, after "Physically Based Boiling Simulation with Thermally Driven Dynamic Nucleation", Fig. 3.
Run time    about 16 s on two cores (2-D, 480 particles, 3,000 steps for 1.5 s). The first run also compiles.
Command     pysph-boiling run reuse_iisph
"""
from pysph.sph.iisph import IISPHScheme

from pysph_boiling.examples.reuse_wcsph import WATER, G, ReuseWCSPH


class ReuseIISPH(ReuseWCSPH):
    """The scene of this module. Only the scheme, its time step and its integrator differ."""

    time_step = 5e-4  # s
    solver_options = {}

    def create_scheme(self):
        return IISPHScheme(["fluid"], ["wall"], dim=2, rho0=WATER.rho_l, nu=1e-4, gy=-G)


if __name__ == "__main__":
    ReuseIISPH().run()

"""PySPH's TVF scheme, unmodified, boils: the vessel of reuse_wcsph with another scheme.

Equations   TVFScheme of PySPH (transport velocity, Adami et al. 2013), without background pressure, which would push
            the particles of a free surface outwards; the guest is that of ``reuse_wcsph``.
Source      ours, after "Physically Based Boiling Simulation with Thermally Driven Dynamic Nucleation", Fig. 3.
Run time    about 2 minutes on two cores (2-D, 480 particles, 17,509 steps for 1.5 s). The first run also compiles.
Command     pysph-boiling run reuse_tvf
"""
from pysph.sph.scheme import TVFScheme

from pysph_boiling.examples.reuse_wcsph import C_0, HDX, SPACING, WATER, G, ReuseWCSPH


class ReuseTVF(ReuseWCSPH):
    """The scene of this module. Only the scheme, its integrator and the volume of wall particles differ."""

    solver_options = {}

    def create_scheme(self):
        return TVFScheme(["fluid"], ["wall"], dim=2, rho0=WATER.rho_l, c0=C_0, nu=0.0, p0=WATER.rho_l * C_0**2, pb=0.0,
                         h0=HDX * SPACING, gy=-G, alpha=0.1)

    def create_particles(self):
        particles = super().create_particles()
        particles[1].V[:] = 1.0 / SPACING**2  # TVF sums it for fluids only
        return particles


if __name__ == "__main__":
    ReuseTVF().run()

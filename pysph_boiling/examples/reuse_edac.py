"""PySPH's EDAC scheme, unmodified, boils: the vessel of reuse_wcsph with another scheme.

Equations   EDACScheme of PySPH (entropically damped artificial compressibility) moves the particles; the guest is that
            of ``reuse_wcsph``.
Source      ours, after "Physically Based Boiling Simulation with Thermally Driven Dynamic Nucleation", Fig. 3.
Run time    about 2 minutes on two cores (2-D, 480 particles, 17,509 steps for 1.5 s). The first run also compiles.
Command     pysph-boiling run reuse_edac
"""
from pysph.sph.wc.edac import EDACScheme

from pysph_boiling.examples.reuse_wcsph import C_0, HDX, SPACING, WATER, G, ReuseWCSPH


class ReuseEDAC(ReuseWCSPH):
    """The scene of this module. Only the scheme and its integrator differ.

    With the quintic spline, which is usual for EDAC, bubbles stop growing at five particles in still water: the gap
    round them is wider than the reach of vapour (``phases.kinetic_radius``), so that no liquid boils at them.
    """

    solver_options = {}

    def create_scheme(self):
        return EDACScheme(["fluid"], ["wall"], dim=2, c0=C_0, nu=0.0, rho0=WATER.rho_l, h=HDX * SPACING, pb=0.0, gy=-G,
                          eps=0.0, alpha=0.1, clamp_p=True)


if __name__ == "__main__":
    ReuseEDAC().run()

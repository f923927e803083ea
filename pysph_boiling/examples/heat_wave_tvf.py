"""PySPH's TVF scheme, unmodified, with our heat equations: the same wave as in heat_wave.

Equations   TVFScheme of PySPH (transport velocity, quintic spline); conduction as in ``heat_wave``.
Source      a Fourier mode of the heat equation in a periodic box that is carried along at a uniform velocity.
Run time    about 4 s on two cores (2-D, 480 particles, 684 steps for 60.4 s). The first run also compiles.
Command     pysph-boiling run heat_wave_tvf
"""
from pysph.sph.scheme import TVFScheme

from pysph_boiling.examples.heat_wave import C_0, SPACING, WATER, HeatWave


class HeatWaveTVF(HeatWave):
    """The scene of this module. Only the scheme differs; the heat equations and their properties are the same."""

    hdx = 1.0  # the usual value for TVF; with the quintic spline the Laplacian hardly depends on it

    def create_scheme(self):
        pressure = WATER.rho_l * C_0**2
        return TVFScheme(["fluid"], [], dim=2, rho0=WATER.rho_l, c0=C_0, nu=WATER.mu_l / WATER.rho_l, p0=pressure,
                         pb=pressure, h0=self.hdx * SPACING)


if __name__ == "__main__":
    HeatWaveTVF().run()

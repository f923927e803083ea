"""The kernel of the swirl: PySPH translates it to Cython, OpenCL or CUDA."""
from pysph.sph.equation import Equation

__all__ = ["SwirlForce"]


class SwirlForce(Equation):
    r"""Acceleration towards a rigid rotation about a vertical axis, and the angular momentum that it gives.

    .. math::  a = \gamma\, (\Omega\, \hat z \times r - v_{xy}), \qquad \Delta L = m\, (r \times a)_z\, \Delta t

    Source: a linear drag towards the velocity of a stirrer.

    Parameters
    ----------
    omega : float   Angular velocity of the stirrer, :math:`\Omega` [rad/s].
    grip : float    Rate at which the fluid takes its velocity, :math:`\gamma` [1/s], >= 0.
    x, y : float    Where the axis stands [m].

    Reads    d_x, d_y [m], d_u, d_v [m/s], d_m [kg].
    Writes   d_au, d_av [m/s^2], d_swirl [kg m^2/s], own index only.
    Errors   ``ValueError`` if grip is negative.
    """

    def __init__(self, dest, sources, omega, grip, x, y):
        if not grip >= 0.0:
            raise ValueError(f"grip must be >= 0 1/s, got {grip}")
        self.omega = float(omega)
        self.grip = float(grip)
        self.x = float(x)
        self.y = float(y)
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_x, d_y, d_u, d_v, d_m, d_au, d_av, d_swirl, dt):
        rx = d_x[d_idx] - self.x
        ry = d_y[d_idx] - self.y
        ax = self.grip * (-self.omega * ry - d_u[d_idx])
        ay = self.grip * (self.omega * rx - d_v[d_idx])
        d_au[d_idx] += ax
        d_av[d_idx] += ay
        d_swirl[d_idx] += d_m[d_idx] * (rx * ay - ry * ax) * dt

"""The Rayleigh-Plesset equation for the radii of many gas bubbles in a liquid, with NumPy and without a scheme."""
from dataclasses import dataclass

import numpy as np

__all__ = ["RayleighPlesset"]


@dataclass(frozen=True, kw_only=True)
class RayleighPlesset:
    r"""Spherical bubbles of a polytropic gas in an incompressible viscous liquid.

    .. math::  \rho (R \ddot R + \tfrac32 \dot R^2) = p_g - p_\infty - \frac{2\sigma}{R} - \frac{4\mu \dot R}{R},
               \qquad p_g = \left(p_a + \frac{2\sigma}{R_0}\right) \left(\frac{R_0}{R}\right)^{3\kappa}

    Source: Plesset & Prosperetti 1977, eq. 1.2, with the gas law of Minnaert 1933 extended by surface tension.

    Parameters
    ----------
    rho : float        Density of the liquid [kg/m^3].
    pressure : float   Ambient pressure p_a [Pa], at which a bubble of radius R0 is at rest.
    sigma : float      Surface tension [N/m].
    mu : float         Viscosity of the liquid [Pa s].
    kappa : float      Polytropic exponent [-].

    Radii R, R0 [m], wall velocities U [m/s] and pressures far away p_inf [Pa] have shape (bubbles,).
    Limits: no heat or mass crosses the wall, no sound is radiated, and bubbles do not interact. Heat and sound damp
    real bubbles 10 to 1000 times more than viscosity; a larger ``mu`` can represent that.
    """

    rho: float
    pressure: float
    sigma: float
    mu: float
    kappa: float

    STEP = 0.1  # time step over the shortest time scale, with which RK4 loses 1e-6 of the energy per period

    def gas_pressure(self, R, R0):
        """Pressure of the gas [Pa]."""
        return (self.pressure + 2.0 * self.sigma / R0) * (R0 / R) ** (3.0 * self.kappa)

    def acceleration(self, R, U, R0, p_inf):
        """Acceleration of the wall [m/s^2]."""
        p = self.gas_pressure(R, R0) - p_inf - (2.0 * self.sigma + 4.0 * self.mu * U) / R
        return (p / self.rho - 1.5 * U * U) / R

    def frequency(self, R0):
        """Angular frequency of small undamped oscillations [1/s]: Minnaert's, with surface tension."""
        stiffness = 3.0 * self.kappa * (self.pressure + 2.0 * self.sigma / R0) - 2.0 * self.sigma / R0
        return np.sqrt(stiffness / self.rho) / R0

    def damping(self, R0):
        """Rate at which the amplitude of small oscillations decays [1/s]."""
        return 2.0 * self.mu / (self.rho * R0 * R0)

    def advance(self, R, U, R0, p_inf, dt, lower=0.0, upper=np.inf):
        """The state after ``dt`` [s]: (R, U, clamped).

        Each bubble takes its own steps (RK4), whose length follows from its frequency, velocity and damping. R is
        limited to ``lower`` to ``upper`` times R0, where the wall stops; ``clamped`` (bubbles,) marks limited bubbles.
        """
        R, U = np.array(R, float), np.array(U, float)
        R0, p_inf = np.broadcast_to(R0, R.shape), np.broadcast_to(p_inf, R.shape)
        left, clamped = np.full(R.shape, float(dt)), np.zeros(R.shape, bool)
        while (busy := np.flatnonzero(left > 0.0)).size:
            r, u, r0, p = R[busy], U[busy], R0[busy], p_inf[busy]
            fastest = np.sqrt(3.0 * self.kappa * self.gas_pressure(r, r0) / self.rho) + np.abs(u)
            h = np.minimum(left[busy], self.STEP * r / (fastest + 4.0 * self.mu / (self.rho * r)))
            k1 = self.acceleration(r, u, r0, p)
            u2 = u + 0.5 * h * k1
            k2 = self.acceleration(r + 0.5 * h * u, u2, r0, p)
            u3 = u + 0.5 * h * k2
            k3 = self.acceleration(r + 0.5 * h * u2, u3, r0, p)
            u4 = u + h * k3
            k4 = self.acceleration(r + h * u3, u4, r0, p)
            r = r + h * (u + 2.0 * u2 + 2.0 * u3 + u4) / 6.0
            u = u + h * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
            held = np.clip(r, lower * r0, upper * r0)
            R[busy], U[busy] = held, np.where(held == r, u, 0.0)
            clamped[busy] |= held != r
            left[busy] -= h
        return R, U, clamped

"""A strained, rotating drop in free flight (2-D): it stays an ellipse, with constant momentum and energy."""
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from pysph_boiling.evaluation.problems.problem import Outcome, Problem
from pysph_boiling.particles import fluid_block
from pysph_boiling.runs.stepper import Stepper
from pysph_boiling.schemes.effects import BoxContainer, DensityConstraint, XSPHViscosity
from pysph_boiling.schemes.pbf import PBFScheme

__all__ = ["RotatingDrop", "deformation"]

FAR = 1e3  # m, distance to the walls of the container, which no particle reaches


def deformation(velocity_gradient, t):
    """Deformation F (2, 2) of a free drop, x = F X, at time ``t`` [s]; at the start x' = ``velocity_gradient`` X.

    The pressure is quadratic in X and vanishes at the surface, so F'' = lambda F^-T with lambda such that det F = 1.
    """
    def rate(_, state):
        F, V = state.reshape(2, 2, 2)
        inverse = np.linalg.inv(F)
        G = inverse @ V
        return np.concatenate([V, np.trace(G @ G) / np.sum(inverse**2) * inverse.T]).ravel()

    start = np.concatenate([np.eye(2), velocity_gradient]).ravel()
    return solve_ivp(rate, (0.0, t), start, rtol=1e-10, atol=1e-12).y[:, -1].reshape(2, 2, 2)[0]


@dataclass(frozen=True, kw_only=True)
class RotatingDrop(Problem):
    """A disc of radius 1 m without external forces; the pressure is positive if the strain exceeds the rotation.

    Errors: ``axes``, the largest error of a semi-axis, from the second moments; ``tilt``, the error of their direction
    [rad]; ``momentum``, its change over mass times strain times radius; ``angular`` and ``energy``, relative changes of
    angular momentum and kinetic energy in the frame of the drop. Curves are positions relative to the drift, by uid.
    """

    title = "rotating drop"
    reference = "F'' = lambda F^-T, det F = 1 (Dirichlet's ellipse without gravitation); momenta are constant"

    cells: int = 25  # spacings in the radius
    strain: float = 1.0  # 1/s
    spin: float = 0.5  # 1/s
    duration: float = 0.8  # s
    courant: float = 0.1  # time step times strain times radius, over the spacing
    drift: tuple = (0.0, 0.0)  # m/s, velocity of the drop as a whole
    density: DensityConstraint = DensityConstraint(courant=100.0)  # far from walls, fast particles need no split steps

    def run(self):
        dx = 1.0 / self.cells
        scheme = PBFScheme(["fluid"], ["wall"], dim=2, spacing=dx, gravity=(0.0, 0.0, 0.0), density=self.density,
                           container=BoxContainer(lower=(-FAR, -FAR, 0.0), upper=(FAR, FAR, 0.0)),
                           viscosity=XSPHViscosity(rate=0.0, wall=1.0))  # no effect, but shares modules with the scenes
        common = dict(spacing=dx, dim=2, rho0=scheme.rho0)
        fluid = fluid_block((-1.0, -1.0, 0.0), (1.0, 1.0, 0.0), inside=lambda p: np.hypot(*p.T[:2]) < 1.0, **common)
        wall = fluid_block((0.0, 0.0, 0.0), (2 * dx, 2 * dx, 0.0), name="wall", **common)
        wall.m[:] = 0.0  # there is no wall, but an array is needed
        scheme.setup_properties([fluid, wall])
        gradient = np.array([[self.strain, -self.spin], [self.spin, -self.strain]])
        drift = np.array(self.drift)
        start = np.stack([fluid.x, fluid.y], -1)
        fluid.u[:], fluid.v[:] = (start @ gradient.T + drift).T
        before = self.totals(fluid, drift, 0.0)
        steps = round(self.duration * self.strain / (self.courant * dx))
        stepper = Stepper(scheme, [fluid, wall], dt=self.duration / steps)
        stepper.step(steps)

        (p0, L0, E0, S0, _), (p, L, E, S, place) = before, self.totals(fluid, drift, stepper.t)
        F = deformation(gradient, stepper.t)
        (axes, ways), (exact, exact_ways) = np.linalg.eigh(S), np.linalg.eigh(F @ S0 @ F.T)
        order = np.argsort(fluid.uid)
        return Outcome(
            errors={"axes": float(np.max(np.abs(np.sqrt(axes / exact) - 1.0))),
                    "tilt": float(np.arccos(min(1.0, abs(ways[:, 1] @ exact_ways[:, 1])))),
                    "momentum": float(np.linalg.norm(p - p0) / (fluid.m.sum() * self.strain)),
                    "angular": float(L / L0 - 1.0) if L0 else float("nan"), "energy": float(E / E0 - 1.0)},
            seconds=stepper.seconds, simulated=stepper.t, steps=steps, particles=len(fluid.m),
            curves={"x [m]": place[order, 0], "y [m]": place[order, 1], "x0 [m]": start[order, 0],
                    "y0 [m]": start[order, 1]},
            facts={"F": F, "aspect": float(np.sqrt(axes[1] / axes[0])), "compression": float(fluid.compression.mean()),
                   "turned": float(np.degrees(np.arctan2(exact_ways[1, 1], exact_ways[0, 1])) % 180.0)})

    @staticmethod
    def totals(fluid, drift, t):
        """Momentum [kg m/s], and in the frame of the drop angular momentum, energy, second moments, positions."""
        m, v = fluid.m, np.stack([fluid.u, fluid.v], -1)
        place = np.stack([fluid.x, fluid.y], -1) - drift * t
        x = place - np.average(place, axis=0, weights=m)
        w = v - np.average(v, axis=0, weights=m)
        return (m @ v, float(np.sum(m * (x[:, 0] * w[:, 1] - x[:, 1] * w[:, 0]))), 0.5 * float(np.sum(m * (w * w).T)),
                (x.T * m) @ x / m.sum(), place)

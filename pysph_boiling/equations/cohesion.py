"""Surface tension of bubbles: cohesion between vapour particles, and adhesion of vapour to preset sites."""
from math import sqrt

from compyle.api import declare
from pysph.sph.equation import Equation

from pysph_boiling.equations.helpers import boiling_cohesion

__all__ = ["BubbleCohesion", "BubbleCohesionForce", "BubbleCohesionMove", "BubbleCohesionStart", "BubbleSiteAdhesion"]


def check_cohesion(strength, radius, stiffness):
    """Raise ``ValueError`` for parameters of the cohesion that are out of range."""
    if not strength >= 0.0:
        raise ValueError(f"strength of the cohesion must be >= 0 m/s^2, got {strength}")
    if not radius > 0.0:
        raise ValueError(f"radius of the cohesion must be > 0 m, got {radius} m")
    if not stiffness >= 0.0:
        raise ValueError(f"stiffness of the cohesion must be >= 0 1/m, got {stiffness}")


class BubbleCohesion(Equation):
    r"""Cohesion between vapour particles, solved in the density sweeps together with the density constraint.

    A pair attracts, and repels when it is close. The displacement c_i that the force causes in a step belongs to the
    positions at its end, c_i = dt^2 a_i(x) (backward Euler). Each density sweep makes one damped Jacobi iteration of
    that, from the positions x^k at which it also sums the density, and moves by both corrections:

    .. math::  a_i = -a_c \sum_j \frac{2 m_j}{m_i + m_j} C(r_{ij}/R)\, \hat{x}_{ij}, \qquad
               C(q) = \begin{cases} 2\cdot 64 (1-q)^3 q^3 - 1 & q \le 1/2 \\ 64 (1-q)^3 q^3 & 1/2 < q < 1 \end{cases}

    .. math::  p_i = \theta\,(\Delta t^2 a_i(x^k) - c_i), \quad c_i \leftarrow c_i + p_i, \quad
               x_i^{k+1} = x_i^k + p_i + \omega\,\Delta x_i, \qquad \theta = \frac{1}{1 + \kappa\, a_c\, \Delta t^2}

    A step begins with part of the c of the last one (:class:`BubbleCohesionStart`). As theta is the same for all, every
    p is a sum over pairs, which conserves momentum after any number of sweeps. kappa a_c is about half the stiffest
    eigenvalue of the forces in a dense bubble, so the iteration converges for any time step.

    Source: Akinci, Akinci & Teschner 2013, eq. 2, normalised to a peak of 1; the paper, section 4.2.1, mentions surface
    tension without a formula. Differs: implicit; the iteration is ours.

    Parameters
    ----------
    strength : float           a_c [m/s^2], >= 0.
    radius : float             Range R [m], > 0, at most the support of the kernel.
    stiffness : float          kappa [1/m], >= 0.
    max_displacement : float   Largest p of one sweep [m], > 0.

    Reads    d_phase, s_phase, d_m, s_m [kg], positions, d_pull_start_x .. d_pull_start_z (the c with which the step
    began over dt^2) [m/s^2], constant ``prior`` [-], the time step.
    Writes   d_pull_x .. d_pull_z (p) [m], d_pulled_x .. d_pulled_z (c without that part) [m], d_limited, own index
    only.   Needs   :class:`BubbleCohesionStart` between two steps.
    Errors   ValueError if a parameter is out of range.   Limits   A limited p does not conserve momentum. In passes of
    the sweeps that the velocity does not feel (``prior``), there is no cohesion.
    """

    def __init__(self, dest, sources, strength, radius, stiffness, max_displacement):
        check_cohesion(strength, radius, stiffness)
        if not max_displacement > 0.0:
            raise ValueError(f"max_displacement must be > 0 m, got {max_displacement} m")
        self.strength = float(strength)
        self.radius = float(radius)
        self.stiffness = float(stiffness)
        self.max_displacement = float(max_displacement)
        super().__init__(dest, sources)

    def _get_helpers_(self):
        return [boiling_cohesion]

    def initialize(self, d_idx, d_pull_x, d_pull_y, d_pull_z):
        d_pull_x[d_idx] = 0.0
        d_pull_y[d_idx] = 0.0
        d_pull_z[d_idx] = 0.0

    def loop_all(self, d_idx, d_phase, s_phase, d_m, s_m, d_pull_x, d_pull_y, d_pull_z, d_x, d_y, d_z, s_x, s_y, s_z,
                 NBRS, N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        if d_phase[d_idx] == 3:
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                if s_phase[s_idx] == 3:
                    rx = d_x[d_idx] - s_x[s_idx]
                    ry = d_y[d_idx] - s_y[s_idx]
                    rz = d_z[d_idx] - s_z[s_idx]
                    r = sqrt(rx*rx + ry*ry + rz*rz)
                    if r < self.radius:
                        f = boiling_cohesion(r / self.radius)
                        f = self.strength * f * 2.0*s_m[s_idx] / (d_m[d_idx] + s_m[s_idx])
                        f = f / max(r, 1e-6*self.radius)
                        d_pull_x[d_idx] -= f * rx
                        d_pull_y[d_idx] -= f * ry
                        d_pull_z[d_idx] -= f * rz

    def post_loop(self, d_idx, d_phase, d_pull_x, d_pull_y, d_pull_z, d_pulled_x, d_pulled_y, d_pulled_z,
                  d_pull_start_x, d_pull_start_y, d_pull_start_z, d_limited, d_prior, dt):
        if d_phase[d_idx] == 3:
            f = d_prior[1] / (1.0 + self.stiffness*self.strength*dt*dt)
            px = f * (dt*dt*(d_pull_x[d_idx] - d_pull_start_x[d_idx]) - d_pulled_x[d_idx])
            py = f * (dt*dt*(d_pull_y[d_idx] - d_pull_start_y[d_idx]) - d_pulled_y[d_idx])
            pz = f * (dt*dt*(d_pull_z[d_idx] - d_pull_start_z[d_idx]) - d_pulled_z[d_idx])
            size = sqrt(px*px + py*py + pz*pz)
            f = 1.0
            if size > self.max_displacement:
                f = self.max_displacement / size
                d_limited[d_idx] += 1
            d_pull_x[d_idx] = f * px
            d_pull_y[d_idx] = f * py
            d_pull_z[d_idx] = f * pz
            d_pulled_x[d_idx] += f * px
            d_pulled_y[d_idx] += f * py
            d_pulled_z[d_idx] += f * pz


class BubbleCohesionForce(Equation):
    r"""Cohesion between vapour particles as an acceleration, for schemes that integrate forces.

    .. math::  a_i = -\theta\, a_c \sum_j \frac{2 m_j}{m_i + m_j} C(r_{ij}/R)\, \hat{x}_{ij}, \qquad
               \theta = \frac{1}{1 + \kappa\, a_c\, \Delta t^2}

    C is that of :class:`BubbleCohesion`. theta limits the force in steps that are too long for it. As it is the same
    for all, the sum over pairs conserves momentum.

    Source: Akinci, Akinci & Teschner 2013, eq. 2, normalised to a peak of 1. Differs: theta is ours.

    Parameters
    ----------
    strength : float    a_c [m/s^2], >= 0.
    radius : float      Range R [m], > 0, at most the support of the kernel.
    stiffness : float   kappa [1/m], >= 0.

    Reads    d_phase, s_phase, d_m, s_m [kg], positions, the time step.   Writes   d_au, d_av, d_aw [m/s^2], own index
    only.   Errors   ValueError if a parameter is out of range.
    """

    def __init__(self, dest, sources, strength, radius, stiffness):
        check_cohesion(strength, radius, stiffness)
        self.strength = float(strength)
        self.radius = float(radius)
        self.stiffness = float(stiffness)
        super().__init__(dest, sources)

    def _get_helpers_(self):
        return [boiling_cohesion]

    def loop_all(self, d_idx, d_phase, s_phase, d_m, s_m, d_au, d_av, d_aw, d_x, d_y, d_z, s_x, s_y, s_z, dt, NBRS,
                 N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        if d_phase[d_idx] == 3:
            most = self.strength / (1.0 + self.stiffness*self.strength*dt*dt)
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                if s_phase[s_idx] == 3:
                    rx = d_x[d_idx] - s_x[s_idx]
                    ry = d_y[d_idx] - s_y[s_idx]
                    rz = d_z[d_idx] - s_z[s_idx]
                    r = sqrt(rx*rx + ry*ry + rz*rz)
                    if r < self.radius:
                        f = most * boiling_cohesion(r / self.radius) * 2.0*s_m[s_idx] / (d_m[d_idx] + s_m[s_idx])
                        f = f / max(r, 1e-6*self.radius)
                        d_au[d_idx] -= f * rx
                        d_av[d_idx] -= f * ry
                        d_aw[d_idx] -= f * rz


class BubbleCohesionMove(Equation):
    r"""Applies the displacement p of :class:`BubbleCohesion` in one sweep, :math:`x^* \leftarrow x^* + p`.

    Source: ours.   Reads   d_pull_x, d_pull_y, d_pull_z [m].   Writes   d_x .. d_z, d_sx .. d_sz [m], own index only.
    Needs   BubbleCohesion and the density correction, which read positions, in earlier groups.
    """

    def post_loop(self, d_idx, d_x, d_y, d_z, d_sx, d_sy, d_sz, d_pull_x, d_pull_y, d_pull_z):
        d_x[d_idx] += d_pull_x[d_idx]
        d_y[d_idx] += d_pull_y[d_idx]
        d_z[d_idx] += d_pull_z[d_idx]
        d_sx[d_idx] += d_pull_x[d_idx]
        d_sy[d_idx] += d_pull_y[d_idx]
        d_sz[d_idx] += d_pull_z[d_idx]


class BubbleCohesionStart(Equation):
    r"""A step begins with part of the displacement c by cohesion of the last one, as an acceleration.

    .. math::  a^s_i \leftarrow s\,(a^s_i + c_i/\Delta t^2), \qquad c_i \leftarrow 0

    Here c is the displacement in the sweeps, and :math:`\Delta t^2 a^s` the part with which that step began. Without
    this start only the second of two sweeps knows how cohesion compresses a bubble, whose pressure is then too low:
    short steps, which have two sweeps, stir.

    Source: ours.

    Parameters
    ----------
    share : float   s [-], from 0 to 1.

    Reads    d_phase, d_pulled_x .. d_pulled_z (c) [m], the time step.
    Writes   d_pull_start_x .. d_pull_start_z (a^s, 0 without vapour) and d_au .. d_aw [m/s^2], d_pulled_x ..
    d_pulled_z [m], own index only.   Errors   ValueError if share is not from 0 to 1.
    """

    def __init__(self, dest, sources, share):
        if not 0.0 <= share <= 1.0:
            raise ValueError(f"share of the last cohesion must lie in [0, 1], got {share}")
        self.share = float(share)
        super().__init__(dest, sources)

    def post_loop(self, d_idx, d_phase, d_pulled_x, d_pulled_y, d_pulled_z, d_pull_start_x, d_pull_start_y,
                  d_pull_start_z, d_au, d_av, d_aw, dt):
        f = 0.0
        each = 0.0
        if d_phase[d_idx] == 3:
            f = self.share
        if dt > 0.0:
            each = f / (dt*dt)
        d_pull_start_x[d_idx] = f*d_pull_start_x[d_idx] + each*d_pulled_x[d_idx]
        d_pull_start_y[d_idx] = f*d_pull_start_y[d_idx] + each*d_pulled_y[d_idx]
        d_pull_start_z[d_idx] = f*d_pull_start_z[d_idx] + each*d_pulled_z[d_idx]
        d_pulled_x[d_idx] = 0.0
        d_pulled_y[d_idx] = 0.0
        d_pulled_z[d_idx] = 0.0
        d_au[d_idx] += d_pull_start_x[d_idx]
        d_av[d_idx] += d_pull_start_y[d_idx]
        d_aw[d_idx] += d_pull_start_z[d_idx]


class BubbleSiteAdhesion(Equation):
    r"""Adhesion of vapour to preset sites.

    .. math::  a_i = a_a \sqrt{1 - r/r_a}\, \min(1, r/\Delta x)\, \hat{n}_{i \to s}, \qquad r < r_a

    Source: ours, calibrated: the number of particles at departure grows with a_a over the buoyancy (the paper, section
    4.2.1: a bubble departs when buoyancy overcomes surface tension and resistance).

    Parameters
    ----------
    strength : float   a_a [m/s^2], >= 0.
    radius : float     r_a [m], > 0.
    spacing : float    Particle spacing [m], > 0; closer to the site than this, the force decreases to zero.

    Reads    d_phase, positions.   Writes   d_au, d_av, d_aw [m/s^2], own index only.
    Errors   ValueError if strength < 0, radius <= 0 or spacing <= 0.   Limits   Sites do not recoil.
    """

    def __init__(self, dest, sources, strength, radius, spacing):
        if not strength >= 0.0:
            raise ValueError(f"strength of the adhesion must be >= 0 m/s^2, got {strength}")
        if not radius > 0.0:
            raise ValueError(f"radius of the adhesion must be > 0 m, got {radius} m")
        if not spacing > 0.0:
            raise ValueError(f"spacing must be > 0 m, got {spacing} m")
        self.strength = float(strength)
        self.radius = float(radius)
        self.spacing = float(spacing)
        super().__init__(dest, sources)

    def loop_all(self, d_idx, d_phase, d_au, d_av, d_aw, d_x, d_y, d_z, s_x, s_y, s_z, NBRS, N_NBRS):
        i = declare('int')
        s_idx = declare('long')
        if d_phase[d_idx] == 3:
            for i in range(N_NBRS):
                s_idx = NBRS[i]
                rx = d_x[d_idx] - s_x[s_idx]
                ry = d_y[d_idx] - s_y[s_idx]
                rz = d_z[d_idx] - s_z[s_idx]
                r = sqrt(rx*rx + ry*ry + rz*rz)
                if r < self.radius:
                    f = self.strength * sqrt(1.0 - r/self.radius) * min(1.0, r/self.spacing)
                    f = f / max(r, 1e-6*self.radius)
                    d_au[d_idx] -= f * rx
                    d_av[d_idx] -= f * ry
                    d_aw[d_idx] -= f * rz

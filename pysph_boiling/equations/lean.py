"""Lean equations: what other equations compute, where all masses and all smoothing lengths are equal.

A class here takes the place of one equation or of several, and adds what they add to the last few bits: what is said
there about formula, source and limits holds here too. :mod:`pysph_boiling.schemes.lean` says where they serve.

Most of the time of a step goes into sums over neighbours in the fluid. These run on the host, in C
(:mod:`pysph_boiling.native`): a :class:`HostSum` is an equation without a kernel, whose sum is made before the loops of
its group. Sums over the few particles near a wall are kernels (:class:`LeanSum`); what is equal for all pairs stands
before their sums.
"""
from math import sqrt

from compyle.api import declare
from pysph.sph.equation import Equation

from pysph_boiling.equations.heat import HeatFixedTemperature
from pysph_boiling.equations.helpers import boiling_kernel, boiling_kernel_slope, kernel_coefficients
from pysph_boiling.equations.viscosity import PBFWallFriction

__all__ = [
    "LEAN", "BubbleLabelsLean", "HeatConductionClearyMonaghanLean", "HeatFixedTemperatureLean", "HostSum", "LeanSum",
    "PBFDensityLean", "PBFForcesLean", "PBFSweepsLean", "PBFWallFrictionLean",
]


class HostSum(Equation):
    """Base of the sums that are made on the host before the loops of their group: ``run(array, dt)`` makes them.

    Source: ours. It has no kernel, so that PySPH compiles nothing for it. Reads and Writes are said at each sum.
    """

    __slots__ = ("run",)  # not in __dict__, whose entries PySPH compiles

    def __init__(self, dest, sources, run):
        self.run = run
        super().__init__(dest, sources)

    def py_initialize(self, dst, t, dt):
        self.run(dst, dt)


class PBFSweepsLean(HostSum):
    """The density sweeps of one fluid until its density error is small: multipliers, corrections, moves, container.

    Source, Reads, Writes and Limits are those of :class:`PBFDensity` and :class:`PBFPositionCorrection`, or of
    :class:`PBFDensitySwollen` and :class:`PBFPositionCorrectionSwollen`, of :class:`PBFBoundaryDensity`,
    :class:`PBFLambda`, :class:`PBFBoundaryCorrection`, :class:`PBFMove` or :class:`PBFMoveAccelerated`,
    :class:`PBFWallMultiplier`, :class:`PBFWallCorrection`, :class:`BubbleCohesion`, and of the container. While nothing
    is swollen, the sums leave the swell out. What those keep between two groups (d_gcx to d_gc2, d_dpx to d_dpz,
    d_pull_x to d_pull_z, d_wall_weight) is not written.
    """


class BubbleLabelsLean(HostSum):
    """The labels of :class:`BubbleSnap`, :class:`BubbleHook`, :class:`BubbleShortcut`, :class:`BubbleCheck` and
    :class:`BubbleLabel`, by union-find over the vapour alone; it counts one round.   Source, Reads, Writes and Limits
    are said there.
    """


class PBFDensityLean(HostSum):
    """:class:`PBFDensity` or :class:`PBFDensitySwollen`, and :class:`PBFBoundaryDensity`, before a short step.

    It is the same sum as in the sweeps.

    So the error that was there before is, to the last bit, what the sweeps find where nothing has changed. It writes
    d_rho [kg/m^3], and d_lmbda and d_compression, which the sweeps write again.   Source, Reads and Limits are said
    there.
    """


class HeatConductionClearyMonaghanLean(HostSum):
    """:class:`HeatConductionClearyMonaghan` for uniform m and h.   Source, Reads, Writes and Limits are said there."""


class PBFForcesLean(HostSum):
    """:class:`PBFBodyForce`, :class:`PBFXSPHViscosity`, :class:`BubbleDrag`, :class:`PBFArtificialPressure`,
    :class:`PBFWarmStart` or :class:`PBFWarmStartSwollen`, and :class:`PBFBoundaryWarmStart` in one.

    It is for uniform m and h. Source, Reads, Writes and Limits are said there. It sets the acceleration, so it comes
    first in the force stage.
    """


class LeanSum(Equation):
    """Base of the lean sums: an equation with the parameters of the ``general`` one and the scheme's ``kernel``.

    Source: ours. It has no kernel of its own: what a sum reads and writes is said at its general equation.

    Errors: ``ValueError`` for a kernel that :func:`~pysph_boiling.equations.helpers.kernel_coefficients` does not know.
    """

    def __init__(self, general, kernel):
        vars(self).update(vars(general))
        c3, c4, c5, c1 = kernel_coefficients(kernel)
        self.c3 = float(c3)
        self.c4 = float(c4)
        self.c5 = float(c5)
        self.c1 = float(c1)
        self.depth = float(kernel.dim == 3)
        super().__init__(general.dest, general.sources)


class HeatFixedTemperatureLean(LeanSum):
    """:class:`HeatFixedTemperature` for uniform h.   Source, Reads and Writes: there."""

    def _get_helpers_(self):
        return [boiling_kernel_slope]

    def loop_all(self, d_idx, d_x, d_y, d_z, d_h, s_x, s_y, s_z, d_ae, d_q_heater, d_heat_dt, d_heater_T, d_heater_on,
                 d_T, d_k, d_m, s_heated, s_T_heater, NBRS, N_NBRS):
        i = declare('long')
        j = declare('unsigned int')
        h1 = 1.0 / d_h[d_idx]
        flow = 0.0
        for i in range(N_NBRS):
            j = NBRS[i]
            if s_heated[j] == 1:
                dx = d_x[d_idx] - s_x[j]
                dy = d_y[d_idx] - s_y[j]
                dz = d_z[d_idx] - s_z[j]
                r2 = dx*dx + dy*dy + dz*dz
                T = s_T_heater[j]
                if T == 0.0:
                    T = d_heater_T[0]
                f = r2 / (r2 + 0.01*d_h[d_idx]*d_h[d_idx])
                f = f * boiling_kernel_slope(sqrt(r2) * h1, self.c3, self.c4, self.c5, self.c1)
                flow += (d_T[d_idx] - T) * f
        f = h1*h1*h1*h1 * (1.0 + self.depth*(h1 - 1.0))
        flow = self.volume / self.rho0 * 4.0*d_k[d_idx] * f * flow * d_heater_on[0]
        d_ae[d_idx] += flow
        d_q_heater[d_idx] += flow * d_m[d_idx] * d_heat_dt[0]


class PBFWallFrictionLean(LeanSum):
    """:class:`PBFWallFriction` for uniform h; m of the walls may differ.   Source, Reads and Writes: there."""

    def _get_helpers_(self):
        return [boiling_kernel]

    def loop_all(self, d_idx, d_x, d_y, d_z, d_h, d_u, d_v, d_w, s_x, s_y, s_z, s_m, d_au, d_av, d_aw, NBRS, N_NBRS):
        i = declare('long')
        j = declare('unsigned int')
        x = d_x[d_idx]
        y = d_y[d_idx]
        z = d_z[d_idx]
        h1 = 1.0 / d_h[d_idx]
        f = 0.0
        for i in range(N_NBRS):
            j = NBRS[i]
            dx = x - s_x[j]
            dy = y - s_y[j]
            dz = z - s_z[j]
            q = sqrt(dx*dx + dy*dy + dz*dz) * h1
            f += s_m[j] * boiling_kernel(q, self.c3, self.c4, self.c5, self.c1)
        f = self.rate / self.rho0 * h1*h1 * (1.0 + self.depth*(h1 - 1.0)) * f
        d_au[d_idx] -= f * d_u[d_idx]
        d_av[d_idx] -= f * d_v[d_idx]
        d_aw[d_idx] -= f * d_w[d_idx]


LEAN = {  # general equation -> the kernel that takes its place
    HeatFixedTemperature: HeatFixedTemperatureLean,
    PBFWallFriction: PBFWallFrictionLean,
}

"""Lean sums over neighbours: what other equations compute, where all masses and all smoothing lengths are equal.

A class here takes the place of one equation, has its parameters, and adds what that adds to the last few bits: what is
said there about formula, source and limits holds here too. :mod:`pysph_boiling.schemes.lean` says where they serve.

They take 40 to 75 % of the time. The smoothing length of a pair needs no division, and what is equal for all pairs
stands before the sum. Neighbours are fetched first, up to 128 of them, into arrays on the stack; the sum itself then
reads memory in order, so that compilers vectorise it whole: its length is brought to a multiple of 4 by neighbours out
of reach. Indices are ``long``, since an ``int`` may overflow by the rules that PySPH's modules are compiled with
(-fwrapv), so that compilers see no order in what it reads. Vectors written out in C, of packed records (x, y, z, w),
were no faster.
"""
from math import sqrt

from compyle.api import declare
from pysph.sph.equation import Equation

from pysph_boiling.equations.buoyancy import BubbleDrag
from pysph_boiling.equations.density_constraint import (
    PBFBoundaryCorrection,
    PBFBoundaryDensity,
    PBFDensity,
    PBFPositionCorrection,
)
from pysph_boiling.equations.heat import HeatConductionClearyMonaghan, HeatFixedTemperature
from pysph_boiling.equations.helpers import boiling_kernel, boiling_kernel_slope, boiling_uniform, kernel_coefficients
from pysph_boiling.equations.viscosity import PBFWallFriction, PBFXSPHViscosity

__all__ = [
    "LEAN", "BubbleDragLean", "HeatConductionClearyMonaghanLean", "HeatFixedTemperatureLean", "LeanSum",
    "PBFBoundaryCorrectionLean", "PBFBoundaryDensityLean", "PBFDensityLean", "PBFPositionCorrectionLean",
    "PBFWallFrictionLean", "PBFXSPHViscosityLean",
]


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


class PBFDensityLean(LeanSum):
    """:class:`PBFDensity` for uniform m and h.   Source, Reads and Writes: there; of d_h and d_m for all particles."""

    def _get_helpers_(self):
        return [boiling_kernel, boiling_kernel_slope]

    def initialize(self, d_idx, d_rho, d_gcx, d_gcy, d_gcz, d_gc2):
        d_rho[d_idx] = 0.0
        d_gcx[d_idx] = 0.0
        d_gcy[d_idx] = 0.0
        d_gcz[d_idx] = 0.0
        d_gc2[d_idx] = 0.0

    def loop_all(self, d_idx, d_x, d_y, d_z, d_h, d_m, s_x, s_y, s_z, d_rho, d_gcx, d_gcy, d_gcz, d_gc2, NBRS, N_NBRS):
        i = declare('long')
        j = declare('unsigned int')
        k = declare('long')
        n = declare('long')
        X = declare('matrix(128)')
        Y = declare('matrix(128)')
        Z = declare('matrix(128)')
        x = d_x[d_idx]
        y = d_y[d_idx]
        z = d_z[d_idx]
        h1 = 1.0 / d_h[d_idx]
        rho = 0.0
        gx = 0.0
        gy = 0.0
        gz = 0.0
        gg = 0.0
        for k in range(0, N_NBRS, 128):
            n = N_NBRS - k
            if n > 128:
                n = 128
            for i in range(n):
                j = NBRS[k + i]
                X[i] = x - s_x[j]
                Y[i] = y - s_y[j]
                Z[i] = z - s_z[j]
            while n % 4 > 0:
                X[n] = 3.0 * d_h[d_idx]
                Y[n] = 0.0
                Z[n] = 0.0
                n = n + 1
            for i in range(n):
                r2 = X[i]*X[i] + Y[i]*Y[i] + Z[i]*Z[i]
                q = sqrt(r2) * h1
                rho += boiling_kernel(q, self.c3, self.c4, self.c5, self.c1)
                f = boiling_kernel_slope(q, self.c3, self.c4, self.c5, self.c1)
                gx += f * X[i]
                gy += f * Y[i]
                gz += f * Z[i]
                gg += f*f*r2
        f = d_m[d_idx] * h1*h1 * (1.0 + self.depth*(h1 - 1.0))
        d_rho[d_idx] += f * rho
        f = f * h1*h1 / self.rho_rest
        d_gcx[d_idx] += f * gx
        d_gcy[d_idx] += f * gy
        d_gcz[d_idx] += f * gz
        d_gc2[d_idx] += f * f * gg / d_m[d_idx]


class PBFBoundaryDensityLean(LeanSum):
    """:class:`PBFBoundaryDensity` for uniform h; m may differ.   Source, Reads and Writes: there."""

    def _get_helpers_(self):
        return [boiling_kernel, boiling_kernel_slope]

    def loop_all(self, d_idx, d_x, d_y, d_z, d_h, s_x, s_y, s_z, s_m, d_rho, d_gcx, d_gcy, d_gcz, NBRS, N_NBRS):
        i = declare('long')
        j = declare('unsigned int')
        k = declare('long')
        n = declare('long')
        X = declare('matrix(128)')
        Y = declare('matrix(128)')
        Z = declare('matrix(128)')
        M = declare('matrix(128)')
        x = d_x[d_idx]
        y = d_y[d_idx]
        z = d_z[d_idx]
        h1 = 1.0 / d_h[d_idx]
        rho = 0.0
        gx = 0.0
        gy = 0.0
        gz = 0.0
        for k in range(0, N_NBRS, 128):
            n = N_NBRS - k
            if n > 128:
                n = 128
            for i in range(n):
                j = NBRS[k + i]
                X[i] = x - s_x[j]
                Y[i] = y - s_y[j]
                Z[i] = z - s_z[j]
                M[i] = s_m[j]
            while n % 4 > 0:
                X[n] = 3.0 * d_h[d_idx]
                Y[n] = 0.0
                Z[n] = 0.0
                M[n] = 0.0
                n = n + 1
            for i in range(n):
                q = sqrt(X[i]*X[i] + Y[i]*Y[i] + Z[i]*Z[i]) * h1
                rho += M[i] * boiling_kernel(q, self.c3, self.c4, self.c5, self.c1)
                f = M[i] * boiling_kernel_slope(q, self.c3, self.c4, self.c5, self.c1)
                gx += f * X[i]
                gy += f * Y[i]
                gz += f * Z[i]
        f = h1*h1 * (1.0 + self.depth*(h1 - 1.0))
        d_rho[d_idx] += f * rho
        f = f * h1*h1 / self.rho_rest
        d_gcx[d_idx] += f * gx
        d_gcy[d_idx] += f * gy
        d_gcz[d_idx] += f * gz


class PBFPositionCorrectionLean(LeanSum):
    """:class:`PBFPositionCorrection` for uniform m and h.   Source, Reads and Writes: there."""

    def _get_helpers_(self):
        return [boiling_kernel_slope, boiling_uniform]

    def initialize(self, d_idx, d_dpx, d_dpy, d_dpz):
        d_dpx[d_idx] = 0.0
        d_dpy[d_idx] = 0.0
        d_dpz[d_idx] = 0.0

    def loop_all(self, d_idx, d_x, d_y, d_z, d_h, s_x, s_y, s_z, d_dpx, d_dpy, d_dpz, d_lmbda, s_lmbda, d_uid, s_uid,
                 d_prior, NBRS, N_NBRS):
        i = declare('long')
        j = declare('unsigned int')
        k = declare('long')
        n = declare('long')
        low = declare('unsigned int')
        high = declare('unsigned int')
        X = declare('matrix(128)')
        Y = declare('matrix(128)')
        Z = declare('matrix(128)')
        L = declare('matrix(128)')
        x = d_x[d_idx]
        y = d_y[d_idx]
        z = d_z[d_idx]
        h1 = 1.0 / d_h[d_idx]
        lmbda = d_lmbda[d_idx]
        px = 0.0
        py = 0.0
        pz = 0.0
        here = 0.0
        for k in range(0, N_NBRS, 128):
            n = N_NBRS - k
            if n > 128:
                n = 128
            for i in range(n):
                j = NBRS[k + i]
                X[i] = x - s_x[j]
                Y[i] = y - s_y[j]
                Z[i] = z - s_z[j]
                L[i] = lmbda + s_lmbda[j]
            while n % 4 > 0:
                X[n] = 3.0 * d_h[d_idx]
                Y[n] = 0.0
                Z[n] = 0.0
                L[n] = 0.0
                n = n + 1
            for i in range(n):
                q = sqrt(X[i]*X[i] + Y[i]*Y[i] + Z[i]*Z[i]) * h1
                f = L[i] * boiling_kernel_slope(q, self.c3, self.c4, self.c5, self.c1)
                px += f * X[i]
                py += f * Y[i]
                pz += f * Z[i]
                here += max(1.0 - 1e6*q, 0.0)
        f = h1*h1*h1*h1 * (1.0 + self.depth*(h1 - 1.0)) / self.rho_rest
        d_dpx[d_idx] += f * px
        d_dpy[d_idx] += f * py
        d_dpz[d_idx] += f * pz
        if here > 1.0:
            for i in range(N_NBRS):
                j = NBRS[i]
                dx = x - s_x[j]
                dy = y - s_y[j]
                dz = z - s_z[j]
                if sqrt(dx*dx + dy*dy + dz*dz) * h1 < 1e-6:
                    if d_uid[d_idx] != s_uid[j]:
                        low = d_uid[d_idx]
                        high = s_uid[j]
                        f = self.nudge * d_prior[0]
                        if low > high:
                            low = s_uid[j]
                            high = d_uid[d_idx]
                            f = -f
                        d_dpx[d_idx] += f * boiling_uniform(low, high)
                        d_dpy[d_idx] += f * boiling_uniform(high, low)
                        d_dpz[d_idx] += f * self.depth * boiling_uniform(low, high + 1013)


class PBFBoundaryCorrectionLean(LeanSum):
    """:class:`PBFBoundaryCorrection` for uniform h; m of the walls may differ.   Source, Reads and Writes: there."""

    def _get_helpers_(self):
        return [boiling_kernel_slope]

    def loop_all(self, d_idx, d_x, d_y, d_z, d_h, s_x, s_y, s_z, d_dpx, d_dpy, d_dpz, d_lmbda, d_m, s_m, NBRS, N_NBRS):
        i = declare('long')
        j = declare('unsigned int')
        k = declare('long')
        n = declare('long')
        X = declare('matrix(128)')
        Y = declare('matrix(128)')
        Z = declare('matrix(128)')
        M = declare('matrix(128)')
        if d_lmbda[d_idx] != 0.0:
            x = d_x[d_idx]
            y = d_y[d_idx]
            z = d_z[d_idx]
            h1 = 1.0 / d_h[d_idx]
            px = 0.0
            py = 0.0
            pz = 0.0
            for k in range(0, N_NBRS, 128):
                n = N_NBRS - k
                if n > 128:
                    n = 128
                for i in range(n):
                    j = NBRS[k + i]
                    X[i] = x - s_x[j]
                    Y[i] = y - s_y[j]
                    Z[i] = z - s_z[j]
                    M[i] = s_m[j]
                while n % 4 > 0:
                    X[n] = 3.0 * d_h[d_idx]
                    Y[n] = 0.0
                    Z[n] = 0.0
                    M[n] = 0.0
                    n = n + 1
                for i in range(n):
                    q = sqrt(X[i]*X[i] + Y[i]*Y[i] + Z[i]*Z[i]) * h1
                    f = M[i] * boiling_kernel_slope(q, self.c3, self.c4, self.c5, self.c1)
                    px += f * X[i]
                    py += f * Y[i]
                    pz += f * Z[i]
            f = d_lmbda[d_idx] * h1*h1*h1*h1 * (1.0 + self.depth*(h1 - 1.0)) / (d_m[d_idx]*self.rho_rest)
            d_dpx[d_idx] += f * px
            d_dpy[d_idx] += f * py
            d_dpz[d_idx] += f * pz


class HeatConductionClearyMonaghanLean(LeanSum):
    """:class:`HeatConductionClearyMonaghan` for uniform m and h.   Source, Reads and Writes: there."""

    def _get_helpers_(self):
        return [boiling_kernel_slope]

    def loop_all(self, d_idx, d_x, d_y, d_z, d_h, d_m, s_x, s_y, s_z, d_ae, d_T, s_T, d_k, s_k, NBRS, N_NBRS):
        i = declare('long')
        j = declare('unsigned int')
        b = declare('long')
        n = declare('long')
        X = declare('matrix(128)')
        Y = declare('matrix(128)')
        Z = declare('matrix(128)')
        D = declare('matrix(128)')
        K = declare('matrix(128)')
        x = d_x[d_idx]
        y = d_y[d_idx]
        z = d_z[d_idx]
        T = d_T[d_idx]
        k = d_k[d_idx]
        h1 = 1.0 / d_h[d_idx]
        near = 0.01 * d_h[d_idx]*d_h[d_idx]
        flow = 0.0
        for b in range(0, N_NBRS, 128):
            n = N_NBRS - b
            if n > 128:
                n = 128
            for i in range(n):
                j = NBRS[b + i]
                X[i] = x - s_x[j]
                Y[i] = y - s_y[j]
                Z[i] = z - s_z[j]
                D[i] = T - s_T[j]
                K[i] = s_k[j]
            while n % 4 > 0:
                X[n] = 3.0 * d_h[d_idx]
                Y[n] = 0.0
                Z[n] = 0.0
                D[n] = 0.0
                K[n] = k
                n = n + 1
            for i in range(n):
                r2 = X[i]*X[i] + Y[i]*Y[i] + Z[i]*Z[i]
                q = sqrt(r2) * h1
                f = r2 * boiling_kernel_slope(q, self.c3, self.c4, self.c5, self.c1)
                flow += K[i] * D[i] * f / ((k + K[i]) * (r2 + near))
        f = h1*h1*h1*h1 * (1.0 + self.depth*(h1 - 1.0))
        d_ae[d_idx] += d_m[d_idx] / (self.rho0*self.rho0) * 4.0*k * f * flow


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


class PBFXSPHViscosityLean(LeanSum):
    """:class:`PBFXSPHViscosity` for uniform m and h.   Source, Reads and Writes: there."""

    def _get_helpers_(self):
        return [boiling_kernel]

    def loop_all(self, d_idx, d_x, d_y, d_z, d_h, d_m, d_u, d_v, d_w, s_x, s_y, s_z, s_u, s_v, s_w, d_au, d_av, d_aw,
                 NBRS, N_NBRS):
        i = declare('long')
        j = declare('unsigned int')
        k = declare('long')
        n = declare('long')
        X = declare('matrix(128)')
        Y = declare('matrix(128)')
        Z = declare('matrix(128)')
        U = declare('matrix(128)')
        V = declare('matrix(128)')
        W = declare('matrix(128)')
        x = d_x[d_idx]
        y = d_y[d_idx]
        z = d_z[d_idx]
        u = d_u[d_idx]
        v = d_v[d_idx]
        w = d_w[d_idx]
        h1 = 1.0 / d_h[d_idx]
        ax = 0.0
        ay = 0.0
        az = 0.0
        for k in range(0, N_NBRS, 128):
            n = N_NBRS - k
            if n > 128:
                n = 128
            for i in range(n):
                j = NBRS[k + i]
                X[i] = x - s_x[j]
                Y[i] = y - s_y[j]
                Z[i] = z - s_z[j]
                U[i] = u - s_u[j]
                V[i] = v - s_v[j]
                W[i] = w - s_w[j]
            while n % 4 > 0:
                X[n] = 3.0 * d_h[d_idx]
                Y[n] = 0.0
                Z[n] = 0.0
                U[n] = 0.0
                V[n] = 0.0
                W[n] = 0.0
                n = n + 1
            for i in range(n):
                q = sqrt(X[i]*X[i] + Y[i]*Y[i] + Z[i]*Z[i]) * h1
                f = boiling_kernel(q, self.c3, self.c4, self.c5, self.c1)
                ax += f * U[i]
                ay += f * V[i]
                az += f * W[i]
        f = self.rate * d_m[d_idx] / self.rho0 * h1*h1 * (1.0 + self.depth*(h1 - 1.0))
        d_au[d_idx] -= f * ax
        d_av[d_idx] -= f * ay
        d_aw[d_idx] -= f * az


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


class BubbleDragLean(LeanSum):
    """:class:`BubbleDrag` for uniform m and h: only pairs of two phases cost.   Source, Reads and Writes: there."""

    def _get_helpers_(self):
        return [boiling_kernel]

    def loop_all(self, d_idx, d_x, d_y, d_z, d_h, d_m, d_u, d_v, d_w, d_phase, s_x, s_y, s_z, s_u, s_v, s_w, s_phase,
                 d_au, d_av, d_aw, NBRS, N_NBRS):
        i = declare('long')
        j = declare('unsigned int')
        vapour = declare('int')
        other = declare('int')
        vapour = 0
        if d_phase[d_idx] == 3:
            vapour = 1
        h1 = 1.0 / d_h[d_idx]
        ax = 0.0
        ay = 0.0
        az = 0.0
        for i in range(N_NBRS):
            j = NBRS[i]
            other = 1 - vapour
            if s_phase[j] != 3:
                other = vapour
            if other == 1:
                dx = d_x[d_idx] - s_x[j]
                dy = d_y[d_idx] - s_y[j]
                dz = d_z[d_idx] - s_z[j]
                q = sqrt(dx*dx + dy*dy + dz*dz) * h1
                f = boiling_kernel(q, self.c3, self.c4, self.c5, self.c1)
                ax += f * (d_u[d_idx] - s_u[j])
                ay += f * (d_v[d_idx] - s_v[j])
                az += f * (d_w[d_idx] - s_w[j])
        f = self.rate * d_m[d_idx] / self.rho0 * h1*h1 * (1.0 + self.depth*(h1 - 1.0))
        d_au[d_idx] -= f * ax
        d_av[d_idx] -= f * ay
        d_aw[d_idx] -= f * az


LEAN = {  # general equation -> the lean sum that takes its place
    BubbleDrag: BubbleDragLean,
    HeatConductionClearyMonaghan: HeatConductionClearyMonaghanLean,
    HeatFixedTemperature: HeatFixedTemperatureLean,
    PBFBoundaryCorrection: PBFBoundaryCorrectionLean,
    PBFBoundaryDensity: PBFBoundaryDensityLean,
    PBFDensity: PBFDensityLean,
    PBFPositionCorrection: PBFPositionCorrectionLean,
    PBFWallFriction: PBFWallFrictionLean,
    PBFXSPHViscosity: PBFXSPHViscosityLean,
}

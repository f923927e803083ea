"""Lean sums over neighbours: what other equations compute, where all masses and all smoothing lengths are equal.

A class here takes the place of one equation, has its parameters, and adds what that adds to the last few bits: what is
said there about formula, source and limits holds here too. :mod:`pysph_boiling.schemes.lean` says where they serve.

They cost half as much. The smoothing length of a pair needs no division, and what is equal for all pairs stands before
the sum. Neighbours are fetched first, up to 128 of them, into arrays on the stack; the sum itself then reads memory in
order, so that compilers vectorise it whole: its length is brought to a multiple of 4 by neighbours out of reach.
"""
from math import sqrt

from compyle.api import declare
from pysph.sph.equation import Equation

from pysph_boiling.equations.density_constraint import (
    PBFBoundaryCorrection,
    PBFBoundaryDensity,
    PBFDensity,
    PBFPositionCorrection,
)
from pysph_boiling.equations.helpers import boiling_kernel, boiling_kernel_slope, boiling_uniform, kernel_coefficients

__all__ = [
    "LEAN", "LeanSum", "PBFBoundaryCorrectionLean", "PBFBoundaryDensityLean", "PBFDensityLean",
    "PBFPositionCorrectionLean",
]


class LeanSum(Equation):
    """Base of the lean sums: an equation with the parameters of the ``general`` one and the scheme's ``kernel``.

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
        i = declare('int')
        j = declare('int')
        k = declare('int')
        n = declare('int')
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
        i = declare('int')
        j = declare('int')
        k = declare('int')
        n = declare('int')
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
        i = declare('int')
        j = declare('int')
        k = declare('int')
        n = declare('int')
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
        i = declare('int')
        j = declare('int')
        k = declare('int')
        n = declare('int')
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


LEAN = {  # general equation -> the lean sum that takes its place
    PBFBoundaryCorrection: PBFBoundaryCorrectionLean,
    PBFBoundaryDensity: PBFBoundaryDensityLean,
    PBFDensity: PBFDensityLean,
    PBFPositionCorrection: PBFPositionCorrectionLean,
}

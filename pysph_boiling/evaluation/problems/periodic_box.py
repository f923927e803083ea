"""A periodic square or cube full of particles, without walls."""
import numpy as np
from pysph.base.nnps import DomainManager

from pysph_boiling.particles import fluid_block

__all__ = ["periodic_box"]


def periodic_box(size, *, dim, spacing, rho0, jitter, seed=0, **options):
    """Particles in a box of the length ``size`` [m] that begins at the origin: (fluid, wall, domain).

    The fluid stands on a lattice of ``spacing`` [m], displaced by up to ``jitter`` spacings from ``seed``; ``rho0`` is
    its density [kg/m^3]. The wall has no mass: the box needs none, but the compiled equations need an array. ``domain``
    is PySPH's. Other options are those of :func:`pysph_boiling.particles.fluid_block`.
    """
    options |= dict(spacing=spacing, dim=dim, rho0=rho0)
    corner = np.array([size] * dim + [0.0] * (3 - dim))
    fluid = fluid_block((0.0,) * 3, corner, jitter=jitter, seed=seed, **options)
    wall = fluid_block((0.0,) * 3, 2.0 * spacing * (corner > 0.0), name="wall", **options)
    wall.m[:] = 0.0
    axes = "xyz"[:dim]
    return fluid, wall, DomainManager(
        **{f"{axis}{end}": value for axis in axes for end, value in (("min", 0.0), ("max", size))},
        **{f"periodic_in_{axis}": True for axis in axes})

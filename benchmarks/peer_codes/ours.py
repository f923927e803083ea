"""pysph_boiling: the density constraint alone, on the particles of the job."""
import warnings

import numpy as np
from compyle.config import get_config
from cyarray.carray import UIntArray
from job import arguments

from pysph_boiling.particles import fluid_array, positions, wall_array
from pysph_boiling.runs.stepper import Stepper
from pysph_boiling.schemes.effects import DensityConstraint
from pysph_boiling.schemes.pbf import PBFScheme


def mean_neighbours(stepper, reach=None):
    """Fluid and wall particles in the list of a fluid particle, itself left out: all or those within ``reach`` [m].

    Lists with a skin hold more than the sums need.
    """
    nnps, found, total = stepper.solver.integrator.nnps, UIntArray(), 0
    fluid = positions(stepper.arrays["fluid"])
    for source, name in enumerate(("fluid", "wall")):
        points = positions(stepper.arrays[name])
        for i, x in enumerate(fluid):
            nnps.get_nearest_particles(source, 0, i, found)
            near = found.get_npy_array()
            total += len(near) if reach is None else np.sum(np.sum((points[near] - x) ** 2, axis=1) < reach**2)
    return total / len(fluid) - 1.0


def main():
    job, out = arguments()
    warnings.simplefilter("ignore")  # sweeps that end at their maximum: the record tells
    get_config().use_openmp = True
    hdx = job.h / job.spacing
    scheme = PBFScheme(["fluid"], ["wall"], dim=3, spacing=job.spacing, rho0=1000.0, hdx=hdx,
                       gravity=(0.0, 0.0, -job.gravity), density=DensityConstraint(**job.settings))
    common = dict(spacing=job.spacing, dim=3, rho0=scheme.rho0, hdx=hdx)
    fluid = fluid_array(job.fluid, **common)
    wall = wall_array(job.wall, kernel=scheme.kernel, **common)
    scheme.setup_properties([fluid, wall])
    stepper = Stepper(scheme, [fluid, wall], dt=job.dt, ordered=True)
    job.begin_now()
    for _ in range(job.steps):
        stepper.step()
        job.step_done(fluid.sweeps[1], lambda: positions(fluid),
                      lambda: mean_neighbours(stepper, 2.0 * job.h if job.done == 1 else None))
    job.write(out, fluid=len(fluid.x), wall=len(wall.x), volume=float(fluid.m[0] / scheme.rho0),
              support=float(scheme.kernel.radius_scale * fluid.h[0]), wall_volume=float(wall.m.mean() / scheme.rho0),
              split=float(fluid.substeps[1] / job.steps), stages=dict(scheme.integrator.wall_time))


if __name__ == "__main__":
    main()

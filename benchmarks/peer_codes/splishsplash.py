"""SPlisHSPlasH, without a window: PBF (simulation method 2) or DFSPH (4)."""
import json
import os
import struct
import tempfile
from pathlib import Path

import numpy as np
import pysplishsplash as sph
from job import arguments

METHODS = {"PBF": 2, "DFSPH": 4}
CUBIC = dict(KERNEL_METHOD=4, GRAD_KERNEL_METHOD=4)  # tabulated cubic spline; its PBF comes with Poly6 and Spiky


def write_bgeo(path, points):
    """Positions as a particle file of Houdini's bgeo format, version 5: the one that SPlisHSPlasH reads best."""
    n = len(points)
    with open(path, "wb") as file:
        file.write(b"BgeoV" + struct.pack(">9i", 5, n, 1, 0, 0, 0, 0, 1, 0))
        file.write(np.column_stack([points, np.ones(n)]).astype(">f4").tobytes())
        file.write(struct.pack(">h9shiih4s", 9, b"generator", 1, 4, 1, 4, b"papi"))
        file.write(struct.pack(">ii", 0x8000, n))
        file.write(np.arange(n, dtype=">i4" if n > 2**16 else ">u2").tobytes())
        file.write(struct.pack(">ibb", 0, 0, -1))


def write_scene(folder, job, method):
    """The scene file, with its particles and a triangle out of the way: a boundary must have a mesh."""
    write_bgeo(folder / "fluid.bgeo", job.fluid)
    write_bgeo(folder / "wall.bgeo", job.wall)
    (folder / "triangle.obj").write_text("v 0 0 -9\nv 1 0 -9\nv 0 1 -9\nf 1 2 3\n")
    scene = {
        "Configuration": {
            "simulationMethod": METHODS[method], "particleRadius": 0.5 * job.spacing, "timeStepSize": job.dt,
            "cflMethod": 0, "gravitation": [0.0, 0.0, -job.gravity], "boundaryHandlingMethod": 0,
            "particleAttributes": "", "enableStateExport": False, "stopAt": job.duration},
        "Materials": [{"id": "Fluid", "density0": 1000, "viscosityMethod": 0, "xsph": 0.0}],
        "RigidBodies": [{"geometryFile": "triangle.obj", "particleFile": "wall.bgeo", "isWall": True}],
        "FluidModels": [{"id": "Fluid", "particleFile": "fluid.bgeo"}],
    }
    path = folder / "scene.json"
    path.write_text(json.dumps(scene))
    return str(path)


def configure(target, values):
    """Set parameters of SPlisHSPlasH by the names of their identifiers, such as MAX_ITERATIONS."""
    for name, value in values.items():
        identifier = getattr(type(target), name)
        if isinstance(value, bool):
            target.setValueBool(identifier, value)
        elif isinstance(value, float):
            target.setValueFloat(identifier, value)
        elif name.endswith("METHOD"):
            target.setValueInt(identifier, value)
        else:
            target.setValueUInt(identifier, value)


def main():
    job, out = arguments()
    settings = dict(job.settings)
    method, own_kernels = settings.pop("method"), settings.pop("own_kernels", False)
    with tempfile.TemporaryDirectory() as folder:
        base = sph.Exec.SimulatorBase()
        # A float rounds: ask for half a step more than is wanted, so that the last step is not lost.
        base.init(sceneFile=write_scene(Path(folder), job, method), useGui=False, outputDir=folder,
                  useCache=False, initialPause=False, stopAt=job.duration + 0.5 * job.dt)
        base.initSimulation()
        simulation = sph.Simulation.getCurrent()
        step, fluid = simulation.getTimeStep(), simulation.getFluidModel(0)
        configure(simulation, {} if own_kernels else CUBIC)
        configure(step, settings)  # the scene file's values for the solver are not read without a window

        def positions():
            return np.array(fluid.getFieldBuffer("position"))[:fluid.numActiveParticles()]

        def neighbours():
            n = fluid.numActiveParticles()
            return sum(simulation.numberOfNeighbors(0, k, i) for k in (0, 1) for i in range(n)) / n

        def after_step():
            sweeps = step.getNumIterations()
            if method == "DFSPH":
                sweeps += step.getValueUInt(sph.TimeStepDFSPH.SOLVER_ITERATIONS_V)
            if job.done < job.steps:
                job.step_done(sweeps, positions, neighbours)

        base.setTimeStepCB(after_step)
        job.begin_now()
        base.runSimulation()
        wall = simulation.getBoundaryModel(0)
        n = wall.numberOfParticles()
        job.write(out, fluid=fluid.numActiveParticles(), wall=n, volume=fluid.getVolume(0),
                  support=simulation.getSupportRadius(),
                  wall_volume=float(np.mean([wall.getVolume(i) for i in range(n)])))
    os._exit(0)  # its destructors crash at the end of a process without a window


if __name__ == "__main__":
    main()

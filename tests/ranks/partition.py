"""Particles wander over the ranks; after each update brute force looks for what a rank owns and reads.

    mpirun -n 4 python tests/ranks/partition.py METHOD
    mpirun -n 2 python tests/ranks/partition.py compare

Prints, as JSON, what happened on all ranks: particles that came from another rank, ghosts, and ghosts that nothing
reads; ``compare``: seconds and ghosts of an update by our manager and by PySPH's own. Ends with an error where a
particle is lost, lies with the wrong rank, or is not seen by one that reads it.
"""
import json
import sys
from time import perf_counter

import numpy as np
from mpi4py import MPI
from pysph.base.utils import get_particle_array
from pysph.parallel.parallel_manager import ZoltanParallelManagerGeometric
from scipy.spatial import cKDTree

from pysph_boiling.parallel.partition import Partition

SUPPORT, SIZE, ROUNDS, BALANCED = 2.4, (40.0, 12.0, 9.0), 24, 6  # lengths in spacings; rounds, and between balancings
PAIRS = [("fluid", "fluid"), ("fluid", "wall"), ("fluid", "sites")]
HEIGHT = {"fluid": 1.0, "wall": 1.0, "sites": 1.5}  # smoothing lengths, in those of the fluid
comm = MPI.COMM_WORLD
rng = np.random.default_rng(7)


def start(scale=1):
    """All particles on the first rank: a box of fluid on a plate, three sites on it."""
    n, size = (4000 * scale**3, 1600 * scale**3, 3) if comm.rank == 0 else (0, 0, 0), scale * np.array(SIZE)
    points = {"fluid": rng.random((n[0], 3)) * size, "wall": rng.random((n[1], 3)) * size * (1.5, -0.2, 1.5),
              "sites": size * (0.1, 0.0, 0.5) + np.array([[0, 0, 0], [16, 0, 0], [32, 0, 0]], float)[:n[2]]}
    arrays = []
    for name, at in points.items():
        pa = get_particle_array(name=name, x=at[:, 0], y=at[:, 1], z=at[:, 2],
                                h=np.full(len(at), 0.5 * SUPPORT * HEIGHT[name]))
        pa.add_property("uid", type="unsigned int", data=np.arange(len(at), dtype=np.uint32))
        arrays.append(pa)
    return arrays


def place(pa):
    return np.stack([pa.get(axis, only_real_particles=False) for axis in "xyz"], -1)


def check(arrays, partition, first):
    """What is owned and seen, against all particles of all ranks; returns (ghosts, ghosts that nothing reads)."""
    own = {pa.name: place(pa)[:pa.get_number_of_particles(True)] for pa in arrays}
    everything = {}
    for pa in arrays:
        uid = pa.get("uid")
        gathered, points = np.concatenate(comm.allgather(uid)), np.concatenate(comm.allgather(own[pa.name]))
        assert np.array_equal(np.sort(gathered), np.arange(len(gathered))), f"{pa.name}: lost or doubled"
        everything[pa.name] = gathered, points
        if not first:  # cells, of which some lie across a cut, are what the first balancing distributes
            here = [partition.pz.Zoltan_Point_PP_Assign(*point) for point in own[pa.name].tolist()]
            assert all(rank == comm.rank for rank in here), f"{pa.name}: on the wrong rank"
    ghosts = unread = 0
    for pa in arrays:
        uid, points = everything[pa.name]
        seen = dict(zip(pa.get("uid", only_real_particles=False).tolist(), place(pa)))
        assert len(seen) == pa.get_number_of_particles(), f"{pa.name}: a ghost came twice"
        read = set()
        for dest, source in PAIRS:
            if source == pa.name and len(own[dest]):
                reach = SUPPORT * max(HEIGHT[dest], HEIGHT[source])
                near = cKDTree(points).query_ball_point(own[dest], reach)
                read |= set(np.concatenate([np.array(one, int) for one in near]).tolist())
        for index in read:
            assert np.array_equal(seen.get(int(uid[index])), points[index]), f"{pa.name}: not seen where it is"
        images = pa.get("uid", only_real_particles=False)[pa.get_number_of_particles(True):]
        ghosts += len(images)
        unread += len(set(images.tolist()) - set(uid[list(read)].tolist()))
    return ghosts, unread


def manage(manager, arrays, method="RCB", **options):
    """A manager of these arrays, which has distributed them."""
    made = manager(dim=3, particles=arrays, comm=comm, lb_method=method, ghost_layers=1, radius_scale=2.0,
                   update_cell_sizes=False, **options)
    made.update()
    made.initial_update = False
    made.set_lb_freq(BALANCED)
    return made


def wander(fluid, number, size=1.0):
    """Move the fluid on by a drift and at random."""
    n = fluid.get_number_of_particles(True)
    for axis, drift in zip("xyz", (0.4, 0.0, 0.0)):
        fluid.get(axis, only_real_particles=False)[:n] += size * (drift + np.random.default_rng(
            number + 100 * comm.rank).normal(0.0, 0.3, n))


def compare():
    found = {}
    for name, manager, options in (("ours", Partition, dict(pairs=PAIRS, moving=["fluid"])),
                                   ("pysph", ZoltanParallelManagerGeometric, {})):
        arrays = start(2)
        made = manage(manager, arrays, **options)
        seconds, ghosts = [], 0
        for number in range(2 * BALANCED):
            wander(arrays[0], number, 0.1)  # as in a step
            comm.Barrier()
            begin = perf_counter()
            made.update()
            seconds.append(perf_counter() - begin)
            ghosts += sum(pa.get_number_of_particles() - pa.get_number_of_particles(True) for pa in arrays)
        found[name] = [comm.allreduce(min(seconds)), comm.allreduce(ghosts) / len(seconds)]  # others may use the cores
    if comm.rank == 0:
        print(json.dumps(found))


def main(method):
    arrays = start()
    partition = manage(Partition, arrays, method, pairs=PAIRS, moving=["fluid"])
    moved = ghosts = unread = 0
    for number in range(ROUNDS):
        if number:
            before = set(arrays[0].get("uid").tolist())
            wander(arrays[0], number)
            partition.update()
            moved += len(set(arrays[0].get("uid").tolist()) - before)
        found = check(arrays, partition, partition.lb_count == 0)
        ghosts, unread = ghosts + found[0], unread + found[1]
    totals = [comm.allreduce(value) for value in (moved, ghosts, unread)]
    if comm.rank == 0:
        print(json.dumps(dict(zip(("moved", "ghosts", "unread"), totals))))


if __name__ == "__main__":
    sys.excepthook = lambda *error: (sys.__excepthook__(*error), sys.stderr.flush(), comm.Abort(1))
    compare() if sys.argv[1] == "compare" else main(sys.argv[1])

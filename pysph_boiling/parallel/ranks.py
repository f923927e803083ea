"""The MPI ranks of a run: the few collective operations that the code needs. On one rank they return their argument.

All ranks must call each function equally often and in the same order, and all get the same result. Decisions in a step
may depend on such results only. A particle belongs to one rank. Constants of particle arrays are equal on all ranks,
because only values that were summed over the ranks are added to them.
"""
import os
import time

import numpy as np

__all__ = [
    "abort", "anywhere", "collectives", "first_given", "gather", "launched", "largest", "leave", "rank", "size",
    "total", "totals_and_largest", "union", "use", "wait",
]

_comm = None  # the communicator of a run on several ranks
_calls = 0  # of collective operations, since the start of the process
# Open MPI; MPICH and Intel MPI; MPICH; SLURM's srun. SLURM_NTASKS is also set where no process was started by srun.
LAUNCHERS = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS", "SLURM_STEP_NUM_TASKS")
POLL = 0.02  # s between two tests of a waiting rank, which must leave the processor to the working ones


def use(comm):
    """Run on the ranks of ``comm`` (an mpi4py communicator); a single rank needs none."""
    global _comm
    _comm = comm if comm is not None and comm.Get_size() > 1 else None


def collective():
    """The communicator for one collective operation, which is counted."""
    global _calls
    _calls += 1
    return _comm


def collectives():
    """Number of collective operations of this module so far, each of which waits for all ranks."""
    return _calls


def leave():
    """Leave the communicator: from now on this rank decides for itself."""
    use(None)


def launched():
    """Number of ranks that the MPI launcher has started; 1 without a launcher."""
    names = [*LAUNCHERS, *(["SLURM_NTASKS"] if os.environ.get("SLURM_STEP_ID", "").isdigit() else [])]
    return max([1, *(int(os.environ[name]) for name in names if os.environ.get(name, "").isdigit())])


def size():
    """Number of ranks."""
    return 1 if _comm is None else _comm.Get_size()


def rank():
    """Number of this rank; rank 0 writes files and prints."""
    return 0 if _comm is None else _comm.Get_rank()


def total(value):
    """Sum of a number or array over the ranks, added in the same order on all of them."""
    return value if _comm is None else collective().allreduce(value)


def largest(value):
    """Maximum of a number, or of each entry of an array, over the ranks."""
    if _comm is None:
        return value
    from mpi4py import MPI

    own = np.array(value)
    found = np.empty_like(own)
    collective().Allreduce(own, found, op=MPI.MAX)
    return found if found.shape else found.item()


def totals_and_largest(sums, most):
    """The sums over the ranks of each of ``sums`` (n,), and the maximum of the number ``most``, in one operation."""
    if _comm is None:
        return sums, most
    found = np.empty((size(), len(sums) + 1))
    collective().Allgather(np.array([*sums, most], float), found)
    return found[:, :-1].sum(axis=0).tolist(), float(found[:, -1].max())


def anywhere(flag):
    """Whether ``flag`` is true on any rank."""
    return bool(largest(int(flag)))


def gather(values):
    """(all, own): the rows of all ranks in the order of the ranks, and the slice of this rank's rows."""
    if _comm is None:
        return values, slice(0, len(values))
    parts = collective().allgather(values)
    first = sum(len(part) for part in parts[:rank()])
    return np.concatenate(parts), slice(first, first + len(values))


def union(values):
    """(all, place): the sorted distinct values of all ranks, and the indices in them of this rank's sorted ``values``.
    """
    if _comm is None:
        return values, np.arange(len(values))
    everything = np.unique(gather(values)[0])
    return everything, np.searchsorted(everything, values)


def first_given(value):
    """The ``value`` of the lowest rank on which it is not ``None``; ``None`` if there is no such rank."""
    if _comm is None:
        return value
    return next((given for given in collective().allgather(value) if given is not None), None)


def wait():
    """Wait until all ranks have arrived here, without using the processor."""
    if _comm is not None:
        request = _comm.Ibarrier()
        while not request.Test():
            time.sleep(POLL)


def abort(status):
    """End all ranks at once with an exit status; used for errors that the other ranks may not know of."""
    _comm.Abort(status)

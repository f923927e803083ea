"""The MPI ranks of a run: the few collectives that the rest of the code needs. On one rank they return what they get.

Every rank must call each of these equally often and in the same order, and gets the same answer: what a step does next
may depend on nothing else. Particles belong to one rank; constants of particle arrays are equal on all ranks, since
only what was summed over the ranks is added to them.
"""
import os
import time

import numpy as np

__all__ = [
    "abort", "anywhere", "first_given", "gather", "launched", "largest", "leave", "rank", "size", "total", "union",
    "use", "wait",
]

_comm = None  # the communicator of a run on several ranks
LAUNCHERS = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS")  # Open MPI; MPICH and Intel MPI; MPICH
POLL = 0.02  # s between two looks of a rank that waits: waiting must not take the processor from those that work


def use(comm):
    """Run on the ranks of ``comm`` (an mpi4py communicator); one rank alone needs none."""
    global _comm
    _comm = comm if comm is not None and comm.Get_size() > 1 else None


def leave():
    """Go on alone: what follows is decided by this rank, for itself."""
    use(None)


def launched():
    """Number of ranks that a launcher says it has started; 1 without one."""
    return max([1, *(int(os.environ[name]) for name in LAUNCHERS if os.environ.get(name, "").isdigit())])


def size():
    """Number of ranks."""
    return 1 if _comm is None else _comm.Get_size()


def rank():
    """Number of this rank, from 0: the one that writes and speaks."""
    return 0 if _comm is None else _comm.Get_rank()


def total(value):
    """Sum of a number or array over the ranks, in one order for all of them."""
    return value if _comm is None else _comm.allreduce(value)


def largest(value):
    """Largest of a number, or entry by entry of an array, over the ranks."""
    if _comm is None:
        return value
    from mpi4py import MPI

    own = np.array(value)
    found = np.empty_like(own)
    _comm.Allreduce(own, found, op=MPI.MAX)
    return found if found.shape else found.item()


def anywhere(flag):
    """Whether something holds on any rank."""
    return bool(largest(int(flag)))


def gather(values):
    """(all, own): the rows of all ranks in the order of the ranks, and the slice of them that is this rank's."""
    if _comm is None:
        return values, slice(0, len(values))
    parts = _comm.allgather(values)
    first = sum(len(part) for part in parts[:rank()])
    return np.concatenate(parts), slice(first, first + len(values))


def union(values):
    """(all, place): the distinct values (n,) of all ranks, sorted, and where this rank's sorted ``values`` stand."""
    if _comm is None:
        return values, np.arange(len(values))
    everything = np.unique(gather(values)[0])
    return everything, np.searchsorted(everything, values)


def first_given(value):
    """What the lowest rank gives that does not give ``None``; ``None`` if none does."""
    if _comm is None:
        return value
    return next((given for given in _comm.allgather(value) if given is not None), None)


def wait():
    """Wait for all ranks, asleep."""
    if _comm is not None:
        request = _comm.Ibarrier()
        while not request.Test():
            time.sleep(POLL)


def abort(status):
    """End all ranks at once with an exit status: the way out for an error that the others may not know of."""
    _comm.Abort(status)

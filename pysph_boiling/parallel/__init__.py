"""MPI ranks: reductions over ranks, the partition of particles, and ghosts."""

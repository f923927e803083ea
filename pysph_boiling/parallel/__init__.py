"""MPI ranks: sums over ranks, the partition of particles, ghosts."""

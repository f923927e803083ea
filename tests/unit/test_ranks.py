"""Ranks without MPI: who shares what, and which launchers are noticed."""
import numpy as np
import pytest
from pysph.base.nnps import DomainManager, LinkedListNNPS
from pysph.base.utils import get_particle_array

from pysph_boiling.parallel import ranks
from pysph_boiling.particles import portion


@pytest.mark.parametrize("size", [1, 2, 3, 7])
@pytest.mark.parametrize("n", [0, 1, 5, 7, 1000])
def test_ranks_share_all_rows_once_and_about_equally(size, n):
    rows = np.arange(n)
    shares = [rows[portion(n, (rank, size))] for rank in range(size)]
    np.testing.assert_array_equal(np.concatenate(shares), rows)
    assert np.ptp([len(share) for share in shares]) <= 1


@pytest.mark.parametrize(("environment", "number"), [
    ({}, 1),
    ({"OMPI_COMM_WORLD_SIZE": "4"}, 4),
    ({"PMI_SIZE": "3"}, 3),
    ({"SLURM_STEP_NUM_TASKS": "8", "SLURM_NTASKS": "16"}, 8),
    ({"SLURM_NTASKS": "16"}, 1),  # of a batch script, which runs once
    ({"SLURM_NTASKS": "16", "SLURM_STEP_ID": "0"}, 16),
    ({"OMPI_COMM_WORLD_SIZE": "many"}, 1),
])
def test_launchers(monkeypatch, environment, number):
    for name in (*ranks.LAUNCHERS, "SLURM_NTASKS", "SLURM_STEP_ID"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert ranks.launched() == number


def test_pysph_makes_no_periodic_ghosts_on_ranks():
    """Once it does, periodic domains can run on several ranks, and docs/ranks.md need not refuse them."""
    made = {}
    for in_parallel in (False, True):
        pa = get_particle_array(name="fluid", x=np.arange(0.05, 1.0, 0.1), h=0.1, m=1.0)
        domain = DomainManager(xmin=0.0, xmax=1.0, periodic_in_x=True)
        search = LinkedListNNPS(dim=1, particles=[pa], radius_scale=2.0, domain=domain)
        pa.remove_particles(np.arange(10, pa.get_number_of_particles()))
        search.set_in_parallel(in_parallel)
        search.update_domain()
        made[in_parallel] = pa.get_number_of_particles() - 10
    assert made[False] >= 4 and made[True] == 0

"""Memory stays flat over ten thousand steps in which vapour leaves, comes back as water, and condenses."""
import os
from pathlib import Path

import numpy as np
import pytest
from pysph.solver.tools import Tool

from pysph_boiling.examples.steady_boiling import SteadyBoiling

STEPS = 10_000
SCENE = ["--flat", "--width", "24", "--fill", "14", "--sites", "2", "--pattern", "regular",
         "--smallest-cavity", "0", "--seed", "1", "--loss", "--condensation", "--refill",
         "--subcooling", "2", "--loss.coefficient", "120", "--results-every", "100", "--frame", "0.5",
         "--no-pictures", "--openmp"]
PAGE = os.sysconf("SC_PAGE_SIZE")


class Memory(Tool):
    """Resident memory of this process [bytes], every 500 steps."""

    def __init__(self):
        self.seen = []

    def post_step(self, solver):
        if (solver.count + 1) % 500 == 0:
            self.seen.append(int(Path("/proc/self/statm").read_text().split()[1]) * PAGE)


class Watched(SteadyBoiling):
    def create_tools(self):
        self.memory = Memory()
        return [*super().create_tools(), self.memory]

    def check_final(self):
        pass


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="memory is read from /proc")
def test_memory_is_flat(tmp_path):
    app = Watched(output_dir=str(tmp_path))
    app.run([*SCENE, "--duration", str(STEPS * 0.5 / np.ceil(0.5 / 0.00141325))])
    assert app.solver.count >= STEPS - 200
    last = app.ledger.rows[-1]
    assert last["n_vented"] >= 20 and last["n_condensed"] >= 20, last
    early, late = np.mean(app.memory.seen[3:6]), np.mean(app.memory.seen[-3:])
    assert late - early <= 4e6, app.memory.seen  # caches of the allocator; measured .2 MB over 12,000

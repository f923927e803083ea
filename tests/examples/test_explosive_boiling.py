"""Explosive boiling, flat and small: it bursts without sites, swells, and mass and energy close."""
import numpy as np
import pytest

from pysph_boiling.analysis.level import level_history
from pysph_boiling.examples.explosive_boiling import ExplosiveBoiling

SMALL = ["--flat", "--width", "24", "--fill", "16", "--duration", "0.6", "--seed", "1"]


@pytest.fixture(scope="module")
def explosion(tmp_path_factory):
    app = ExplosiveBoiling(output_dir=str(tmp_path_factory.mktemp("explosion")))
    app.run([*SMALL, "--no-pictures", "--openmp"])  # its own final check has passed
    return app


def test_it_bursts_and_swells(explosion):
    results = explosion.ledger.table()
    assert results["n_burst"][-1] >= 10 and results["n_fired"][-1] >= 3 and results["n_nucleated"][-1] >= 10
    assert results["n_burst"][-1] == results["n_burst"][len(results["t"]) // 2], "what bursts, bursts early"
    _, level = level_history(explosion.output_files, dim=2)
    assert level.max() > 1.05 * level[0] and level[-1] < level.max()


def test_energy_and_mass_close(explosion):
    results = explosion.ledger.table()
    assert results["energy_in"][-1] == 0.0 and results["energy_lid"][-1] > 0.0  # nothing heats it; the lid takes
    assert np.max(np.abs(results["energy_residual"])) <= 1e-10
    assert np.all(results["mass_residual"] == 0.0)


def test_bubbles_pulsate(explosion):
    results = explosion.ledger.table()
    assert results["n_pushed"][-1] >= 50

"""The scene superheat_sites, small and flat, in the three models of boiling; ``run`` checks the final state."""
import numpy as np
import pytest

from pysph_boiling.examples.superheat_sites import SuperheatSites

SMALL = ["--flat", "--width", "30", "--fill", "14", "--duration", "0.6", "--frame", "0.2", "--results-every", "4",
         "--no-pictures", "--openmp"]


def finished(folder, *options):
    app = SuperheatSites(output_dir=str(folder))
    app.run([*SMALL, *options])
    return app, app.ledger.table()


def test_liquid_superheats_and_bursts_where_sites_are_few(tmp_path):
    app, table = finished(tmp_path, "--sites", "1")
    assert table["n_burst"][-1] >= 1 and table["n_nucleated"][-1] >= 5
    assert app.scheme.arrays[0].burst.sum() == table["n_burst"][-1]
    assert table["T_max"].max() > app.scheme.material.T_sat + app.parameters.superheat_limit
    assert 0.0 < table["energy_loss"][-1] < 0.2 * table["energy_heater"][-1]  # small


@pytest.mark.slow  # each compiles modules of its own
@pytest.mark.parametrize("mode", ["gu", "li_xiao"])
def test_other_modes_run_in_the_same_vessel(tmp_path, mode):
    _, table = finished(tmp_path, "--sites", "3", "--mode", mode)
    assert np.any(table["n_superheated"] > 0) == (mode == "li_xiao")
    assert table["n_vapour"].max() >= 10

"""The scene cooling, small and flat; ``run`` checks that the vapour is gone in the end."""
import numpy as np
import pytest

from pysph_boiling.examples.cooling import Cooling


def test_vapour_condenses_once_the_heater_is_off(tmp_path):
    app = Cooling(output_dir=str(tmp_path))
    app.run(["--flat", "--width", "30", "--fill", "14", "--sites", "3", "--heater-until", "0.3", "--duration", "1.5",
             "--frame", "0.2", "--results-every", "4", "--no-pictures", "--openmp"])
    table = app.ledger.table()
    off = table["t"] > 0.3 + app.solver.dt
    assert 50 < np.count_nonzero(off) < len(off) - 20
    given = table["energy_heater"]
    assert np.ptp(given[off]) <= 1e-14 * given[-1] and given[-1] > 0.0  # sums over particles that change their order
    assert np.all(np.diff(table["energy_loss"]) > 0.0)
    assert table["n_vapour"][~off].max() >= 10 and table["n_vapour"][-1] == 0
    assert table["n_condensed"][-1] > table["n_condensed"][~off][-1]
    fluid = app.scheme.arrays[0]
    assert np.sqrt(np.mean(fluid.u**2 + fluid.v**2)) < 0.05  # m/s; about 0.2 while it boils


def test_heater_that_is_never_on_boils_nothing(tmp_path):
    app = Cooling(output_dir=str(tmp_path))
    app.check_final = app.check_ledger
    app.run(["--flat", "--width", "20", "--fill", "8", "--sites", "1", "--heater-until", "0", "--duration", "0.1",
             "--no-pictures", "--openmp"])
    assert app.ledger.rows[-1]["energy_heater"] == 0.0 and app.ledger.rows[-1]["n_vapour"] == 0.0
    assert app.ledger.rows[-1]["energy_loss"] == pytest.approx(app.ledger.rows[-1]["energy_out"])

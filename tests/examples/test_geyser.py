"""The geyser, flat: dynamic nucleation alone makes its vapour, it erupts, stays in its rock, and energy closes."""
import numpy as np
import pytest

from pysph_boiling.examples.geyser import Geyser
from pysph_boiling.particles import positions

pytestmark = pytest.mark.slow  # its set of effects is no other scene's


class FirstEruption(Geyser):
    """Ends after the first eruption; the final check asks for three."""

    def check_final(self):
        pass


@pytest.fixture(scope="module")
def geyser(tmp_path_factory):
    app = FirstEruption(output_dir=str(tmp_path_factory.mktemp("geyser")))
    app.run(["--flat", "--duration", "1.4", "--no-pictures", "--openmp"])
    return app


def test_it_erupts(geyser):
    results = geyser.ledger.table()
    assert results["n_burst"][0] == 0 and results["n_burst"][-1] >= 3 and results["n_nucleated"][-1] >= 30
    (t, n), *_ = geyser.eruptions
    assert 0.3 < t < 1.4 and n >= 28  # first at .42 s
    assert results["rest_volume"].max() > 1.1 * results["rest_volume"][0]  # pushed water out; measured 1.19 to 1.2


def test_energy_and_mass_close(geyser):
    results = geyser.ledger.table()
    assert results["energy_heater"][-1] > 0.0 and results["energy_lid"][-1] > 0.0
    assert np.max(np.abs(results["energy_residual"])) <= 1e-10
    assert np.all(results["mass_residual"] == 0.0)


def test_nothing_enters_the_rock(geyser):
    p, fluid = geyser.parameters, geyser.scheme.arrays[0]
    points = positions(fluid)
    reach = p.spacing * np.array([[0.5, 0.0, 0.0], [-0.5, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, -0.5, 0.0]])
    assert np.all(np.any([geyser.inside(points + shift, p) for shift in reach], axis=0))

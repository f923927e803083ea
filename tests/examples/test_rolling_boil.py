"""A rolling boil, flat and small: sites wake at their own superheats, drops fly, nothing leaves the round pot."""
import numpy as np
import pytest

from pysph_boiling.examples.rolling_boil import RollingBoil
from pysph_boiling.particles import positions

SMALL = ["--flat", "--width", "36", "--fill", "20", "--sites", "4", "--duration", "1.5", "--seed", "1"]


class Watched(RollingBoil):
    """The final check of the full scene is for the full scene."""

    def check_final(self):
        pass


@pytest.fixture(scope="module")
def boil(tmp_path_factory):
    app = Watched(output_dir=str(tmp_path_factory.mktemp("rolling")))
    app.run([*SMALL, "--no-pictures", "--openmp"])
    return app


def test_it_boils_at_sites_of_their_own(boil):
    sites = next(pa for pa in boil.particles if pa.name == "sites")
    assert len(np.unique(sites.activation)) == 4 and sites.activation.min() > 0.0
    assert len(boil.departures) >= 8 and len(boil.vents) >= 8
    assert np.all(np.diff([t for t, *_ in boil.departures]) < 0.5)
    vapour, spray = np.array(boil.measured()).T
    assert vapour.max() >= 40 and np.count_nonzero(spray) >= 3 and spray.max() <= 0.1 * len(boil.particles[0].x)


def test_energy_and_mass_close(boil):
    results = boil.ledger.table()
    assert results["energy_in"][-1] > 0.0 and results["energy_lid"][-1] > 0.0
    assert np.max(np.abs(results["energy_residual"])) <= 1e-10
    assert np.all(results["mass_residual"] == 0.0)


def test_nothing_leaves_the_pot(boil):
    (x0, y0, _), (x1, y1, _) = boil.box(boil.parameters)
    points = positions(boil.scheme.arrays[0])
    assert np.all((points[:, 0] > x0) & (points[:, 0] < x1) & (points[:, 1] > y0) & (points[:, 1] < y1))


@pytest.mark.slow  # its 3-D form
def test_demo_passes_its_own_check(tmp_path):
    app = RollingBoil(output_dir=str(tmp_path))
    app.run(["--demo", "--no-pictures", "--openmp"])
    p, points = app.parameters, positions(app.scheme.arrays[0])
    assert np.hypot(points[:, 0], points[:, 1]).max() < app.radius(p)
    assert np.max(np.abs(app.ledger.table()["energy_residual"])) <= 1e-10

"""The ledger's arithmetic, its refusal of what it cannot account for, and the files it writes. Nothing is compiled."""
import zipfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from sets import scheme

from pysph_boiling.particles import fluid_block, wall_array
from pysph_boiling.results import load_results
from pysph_boiling.runs.ledger import Ledger, Rows, save_results

SPACING = 0.01


@pytest.fixture
def slab():
    """A scheme with heat and heater, its arrays made and set up, and the ledger begun."""
    heat = scheme("slab", dim=2, spacing=SPACING)
    common = dict(spacing=SPACING, dim=2, rho0=heat.rho0)
    fluid = fluid_block((0.0, 0.0), (0.05, 0.05), **common)
    wall = wall_array(np.array([[0.005, -0.005, 0.0], [0.015, -0.005, 0.0]]), kernel=heat.kernel, heated=[1, 1],
                      **common)
    heat.setup_properties([fluid, wall])
    heat.set_temperature(fluid, 350.0)
    heat.configure_solver(dt=1.0)
    heat.get_equations()
    heat.arrays[:] = [fluid]
    ledger = Ledger(heat)
    ledger.begin(heat.arrays)
    return heat, fluid, ledger


def test_balance_closes_when_every_joule_is_booked(slab):
    _, fluid, ledger = slab
    fluid.e[3] += 1e5
    fluid.q_heater[3] += 1e5 * fluid.m[3]
    row = ledger.row(1.0, 1.0)
    assert row["energy_in"] == pytest.approx(1e5 * fluid.m[3], rel=1e-12) and row["energy_out"] == 0.0
    assert abs(row["energy_residual"]) < 1e-12  # round-off of sums over 25 particles


def test_residual_is_what_nobody_booked(slab):
    heat, fluid, ledger = slab
    latent = heat.scene().particle_mass * heat.material.L
    fluid.e[0] += 1e-3 * latent / fluid.m[0]
    assert ledger.row(1.0, 1.0)["energy_residual"] == pytest.approx(1e-3, rel=1e-9)


def test_lost_mass_is_seen(slab):
    _, fluid, ledger = slab
    fluid.remove_particles(np.array([0]))
    assert ledger.row(1.0, 1.0)["mass_residual"] == pytest.approx(-1.0 / 25.0, rel=1e-12)


def test_start_values_survive_a_restart(slab):
    heat, fluid, ledger = slab
    before = ledger.energy(heat.arrays)
    fluid.e[:] += 1.0
    Ledger(heat).begin(heat.arrays)  # what a resumed run does: the constants are there already
    assert Ledger.start(heat.arrays, "ledger_energy") == before


def test_unknown_property_is_refused(slab):
    heat, fluid, _ = slab
    fluid.add_property("charge")
    with pytest.raises(ValueError, match="charge"):
        Ledger(heat).begin(heat.arrays)


def test_rows_every_n_steps_and_refused_zero(slab):
    heat, _, _ = slab
    with pytest.raises(ValueError, match="every must be a whole number >= 1 step, got 0"):
        Ledger(heat, every=0)


def test_last_row_is_the_last_step_and_goes_when_the_run_goes_on(slab):
    """Rows of every third step, of a run that ends after seven and goes on to nine: as one of nine, but for its end."""
    heat, _, _ = slab
    solver = SimpleNamespace(t=0.0, dt=0.5, count=0)

    def steps(ledger, n):
        for _ in range(n):
            ledger.pre_step(solver)
            ledger.post_step(solver)
            solver.t, solver.count = solver.t + solver.dt, solver.count + 1

    first = Ledger(heat, every=3)
    first.begin(heat.arrays)
    first.finish()
    assert len(first.rows) == 0, "no step, no row"
    steps(first, 7)
    first.finish()
    first.finish()
    np.testing.assert_allclose(first.table()["t"], [1.5, 3.0, 3.5])
    again = Ledger(heat, every=3)
    again.begin(heat.arrays)
    again.resume(first.table(), solver.t)
    steps(again, 2)
    again.finish()
    np.testing.assert_allclose(again.table()["t"], [1.5, 3.0, 4.5])


def test_results_are_written_whole_or_not_at_all(tmp_path, monkeypatch):
    path = tmp_path / "results.npz"
    save_results(path, {"t": np.arange(3.0)})
    monkeypatch.setattr(Path, "write_bytes", lambda *args: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OSError, match="disk full"):
        save_results(path, {"t": np.arange(9.0)})
    np.testing.assert_array_equal(load_results(tmp_path)["t"], np.arange(3.0))


def test_results_are_what_numpy_writes(tmp_path):
    """Numbers of several types, no rows, and more of them than a name is long."""
    for rows in (0, 1, 1000):
        table = {"t": np.arange(rows) * 0.1, "n": np.arange(rows), "seen": np.arange(rows) % 2 == 0,
                 "every_other": np.arange(2.0 * rows)[::2]}
        save_results(tmp_path / "results.npz", table)
        np.savez(tmp_path / "numpy.npz", **table)
        with zipfile.ZipFile(tmp_path / "results.npz") as ours, zipfile.ZipFile(tmp_path / "numpy.npz") as theirs:
            assert ours.testzip() is None and ours.namelist() == theirs.namelist()
            assert [ours.read(name) for name in ours.namelist()] == [theirs.read(name) for name in theirs.namelist()]


def test_rows_are_kept_however_many():
    rows, n = Rows(), 3 * Rows.FIRST + 5
    for number in range(n):
        rows.append({"t": float(number), "b": -2.0 * number})
        rows.append({"b": 7.0, "t": -1.0})
        rows.pop()
    assert len(rows) == n and rows[-1] == {"t": n - 1.0, "b": 2.0 - 2.0 * n} and rows[1] == {"t": 1.0, "b": -2.0}
    for name, factor in (("t", 1.0), ("b", -2.0)):
        np.testing.assert_array_equal(rows.table()[name], factor * np.arange(n))
    with pytest.raises(IndexError):
        rows[n]

"""A vessel that boils dry ends well: the run says so, and what it left can be read, drawn and resumed."""
import json

import numpy as np
import pytest
from harness import Stepper
from sets import scheme

from pysph_boiling.analysis.level import level_history
from pysph_boiling.analysis.rendering import draw_scene
from pysph_boiling.cli import main
from pysph_boiling.files import load_output, output_files, read_output
from pysph_boiling.particles import box_vessel, fluid_block, site_array
from pysph_boiling.phases import Phase
from pysph_boiling.results import load_results
from pysph_boiling.runs.ledger import Ledger
from pysph_boiling.schemes.effects import Refill

POT = ["run", "steady_boiling", "--flat", "--width", "8", "--fill", "6", "--sites", "2", "--smallest-cavity", "0",
       "--pattern", "regular", "--venting.mode", "remove", "--heated", "1.0", "--superheat", "250", "--time-scaling",
       "40000", "--duration", "1", "--frame", "0.05", "--openmp"]


def said(capsys):
    return " ".join(capsys.readouterr().out.split())


@pytest.fixture(scope="module")
def dry(tmp_path_factory):
    """Folder of a pot of 48 particles that boils dry, with its pictures."""
    folder = tmp_path_factory.mktemp("dry")
    assert main([*POT, "--directory", str(folder)]) == 0
    return folder


def test_run_ends_where_nothing_is_left(dry):
    table, record = load_results(dry), json.loads((dry / "run.json").read_text())
    assert record["completed"] is True and record["particles"]["fluid"] == 0
    assert len(table["t"]) == record["steps"] and 0.1 < table["t"][-1] < 0.9
    np.testing.assert_allclose(np.diff(table["t"]), table["dt"][1:], rtol=1e-9)
    assert np.all(table["mass"][:-1] > 0.0) and table["mass"][-1] == 0.0
    assert table["mass_out"][-1] == pytest.approx(table["mass"][0] + table["mass_out"][0], rel=1e-14)
    assert table["energy"][-1] == 0.0 and np.max(np.abs(table["energy_residual"])) <= 1e-12
    assert all(np.all(np.isfinite(values)) for values in table.values())
    for name in ("n_liquid", "n_vapour", "n_bubbles", "T_mean", "T_max"):
        assert table[name][-1] == 0.0 < table[name].max()


def test_last_file_is_of_the_dry_vessel_and_is_drawn(dry):
    last = output_files(dry)[-1]
    arrays, solver_data = read_output(last)
    assert arrays["fluid"].get_number_of_particles() == 0 and solver_data["t"] == load_results(dry)["t"][-1]
    frames = sorted((dry / "frames").glob("*.png"))
    assert len(frames) == len(output_files(dry)) >= 3
    assert (dry / "frames.png").exists() and (dry / "history.png").exists()
    arrays, t = load_output(last)
    for colour in (None, "phase", "temperature", "speed"):
        assert draw_scene(arrays, dry / "one.png", dim=2, spacing=0.002, t=t, colour=colour).stat().st_size > 1000
    assert level_history([output_files(dry)[0], last], dim=2)[1][-1] == 0.0


def test_dry_vessel_goes_on_being_dry(dry, capsys):
    before = load_results(dry)
    assert main([*POT, "--no-pictures", "--directory", str(dry), "--resume"]) == 0
    assert "when the vessel was dry" in said(capsys)
    after = load_results(dry)
    for name, values in before.items():
        np.testing.assert_array_equal(after[name], values)


def test_run_goes_on_to_the_same_end_from_a_moment_before(dry, tmp_path, capsys):
    whole, files = load_results(dry), output_files(dry)
    middle = files[len(files) // 2]
    assert read_output(middle)[0]["fluid"].get_number_of_particles() > 0
    assert main([*POT, "--no-pictures", "--directory", str(tmp_path), "--restart-file", str(middle)]) == 0
    assert "when the vessel was dry" in said(capsys)
    assert load_results(tmp_path)["energy_vented"][-1] == whole["energy_vented"][-1]


def empty(name, dim, emptied, **changes):
    """A stepper of a small vessel whose fluid is taken out (``emptied``: none, or all liquid, or all vapour)."""
    n, dx = 6, 0.004
    made = scheme(name, dim=dim, spacing=dx, changes=changes)
    size = [n * dx] * dim + [0.0] * (3 - dim)
    upper = list(size)
    upper[dim - 1] = 2 * n * dx
    common = dict(spacing=dx, dim=dim, rho0=made.rho0)
    fluid = fluid_block((0.0,) * 3, size, **common)
    arrays = [fluid, box_vessel((0.0,) * 3, upper, kernel=made.kernel, heated_fraction=0.5, **common),
              site_array([(0.5 * n * dx, 0.5 * n * dx * (dim == 3), 0.0)], reach=2.4 * dx, spacing=dx)]
    made.setup_properties(arrays)
    made.set_temperature(fluid, made.material.T_sat - 2.0)
    stepper, ledger = Stepper(made, arrays), Ledger(made)
    if emptied == "all":
        fluid.remove_particles(np.arange(fluid.get_number_of_particles()))
    elif emptied == "liquid":
        fluid.phase[:], fluid.e[:] = Phase.VAPOUR, made.material.L
    ledger.begin([fluid])
    stepper.tools.append(ledger)
    return stepper, fluid, ledger


@pytest.mark.parametrize("dim", [2, 3])
def test_empty_vessel_is_refilled(dim):
    """Every stage runs over empty arrays, and what flows in then is as any liquid."""
    stepper, fluid, ledger = empty("open", dim, "all", refill=Refill(rate=20.0 if dim == 2 else 0.4, T_feed=360.0))
    assert fluid.get_number_of_particles() == 0
    stepper.step(40)
    row = ledger.rows[-1]
    assert row["n_refilled"] == fluid.get_number_of_particles() >= 3
    assert np.all(np.isfinite(np.concatenate(list(ledger.table().values())))) and row["T_mean"] > 350.0


@pytest.mark.parametrize("dim", [2, 3])
def test_vessel_without_liquid_steps_and_closes(dim):
    stepper, fluid, ledger = empty("boil", dim, "liquid")
    stepper.step(10)
    row = ledger.rows[-1]
    assert row["n_vented"] == len(fluid.x)
    assert abs(row["energy_residual"]) <= 1e-12 and abs(row["mass_residual"]) <= 1e-13

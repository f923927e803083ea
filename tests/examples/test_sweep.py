"""A small sweep for real: a heater of known flux has that flux in the table, and no bubble is no failure."""
import csv

import pytest

from pysph_boiling.cli import main
from pysph_boiling.results import load_run


def test_flux_of_the_table_is_that_of_the_heater(tmp_path):
    folder = tmp_path / "sweep"
    command = ["sweep", "steady_boiling", "--flat", "--width", "12", "--fill", "8", "--sites", "2", "--duration", "0.1",
               "--heater.flux", "1e4,2e4", "--jobs", "1", "-d", str(folder)]
    assert main(command) == 0
    with open(folder / "sweep.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    for row, flux in zip(rows, (1e4, 2e4), strict=True):
        assert float(row["heater.flux [W/m^2]"]) == flux and row["state"] == "done"
        assert float(row["heat_flux [W/m^2]"]) == pytest.approx(flux, rel=1e-9)  # the table has nine digits
        run = load_run(folder / "runs" / f"heater.flux={flux:g}_seed=1")
        assert float(row["vaporised [-]"]) == run.results["n_nucleated"][-1]
    assert rows[0]["departures [1/s]"] == "0" and rows[0]["bubble_diameter [m]"] == ""
    written = [path.stat().st_mtime_ns for path in sorted(folder.glob("runs/*/run.json"))]
    assert main([*command, "--plot", "T_mean"]) == 0 and (folder / "T_mean.png").exists()
    assert [path.stat().st_mtime_ns for path in sorted(folder.glob("runs/*/run.json"))] == written

"""A number that is none stops the run at that step; what was written before it stays."""
import json

import numpy as np
import pytest
from pysph.solver.tools import Tool

from pysph_boiling.analysis.files import output_files, read_output
from pysph_boiling.analysis.ledger import load_results
from pysph_boiling.cli import main
from pysph_boiling.examples.steady_boiling import SteadyBoiling

SMALL = ["--flat", "--width", "24", "--fill", "16", "--sites", "2", "--subcooling", "0.1", "--duration", "0.3",
         "--frame", "0.05", "--no-pictures", "--openmp"]
STEP = 150  # in which the number goes bad


class Injection(Tool):
    """Before the guard looks: as if the step had made it."""

    def __init__(self, name, value, particle):
        self.name, self.value, self.particle = name, value, particle

    def post_step(self, solver):
        fluid = solver.particles[0]
        if solver.count + 1 == STEP:
            fluid.get(self.name)[np.flatnonzero(fluid.uid == self.particle)] = self.value


@pytest.mark.parametrize(("name", "value"), [("x", np.nan), ("v", np.inf), ("e", np.nan), ("T", -np.inf)])
def test_run_stops_at_that_step_and_names_the_particle(name, value, tmp_path, monkeypatch, capsys):
    made = SteadyBoiling.create_tools
    monkeypatch.setattr(SteadyBoiling, "create_tools", lambda self: [Injection(name, value, 17), *made(self)])
    assert main(["run", "steady_boiling", *SMALL, "--directory", str(tmp_path)]) == 1
    said = " ".join(capsys.readouterr().err.split())
    files = output_files(tmp_path)
    assert f"(step {STEP}) {name} = {value} of particle 17 of 'fluid' at (" in said
    assert "1 particles in all" in said and f"last good output: {files[-1]}" in said
    assert any(f"{phase};" in said for phase in ("liquid", "transition", "superheated", "vapour"))
    arrays, solver_data = read_output(files[-1])
    assert 0 < int(solver_data["count"]) < STEP and np.isfinite(arrays["fluid"].get(name)).all()
    table = load_results(tmp_path)
    assert len(table["t"]) == STEP - 1 and all(np.isfinite(values).all() for values in table.values())
    assert json.loads((tmp_path / "run.json").read_text())["completed"] is False

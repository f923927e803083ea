"""A number that is none stops the run at that step, and so does a temperature beyond physics; files stay."""
import json
import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from harness import native_only
from pysph.solver.tools import Tool
from sets import scheme

from pysph_boiling.cli import main
from pysph_boiling.examples.steady_boiling import SteadyBoiling
from pysph_boiling.files import output_files, read_output
from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.particles import fluid_block, site_array, wall_array
from pysph_boiling.phases import Phase
from pysph_boiling.results import load_results
from pysph_boiling.schemes.guard import Guard
from pysph_boiling.schemes.reductions import GENERAL, CompiledReductions

SMALL = ["--flat", "--width", "24", "--fill", "16", "--sites", "2", "--pattern", "regular", "--smallest-cavity", "0",
         "--subcooling", "0.1", "--duration", "0.3", "--frame", "0.05", "--no-pictures", "--openmp"]
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
    assert "1 particles in all" in said and f"last valid output: {files[-1]}" in said
    assert any(f"{phase};" in said for phase in ("liquid", "transition", "superheated", "vapour"))
    arrays, solver_data = read_output(files[-1])
    assert 0 < int(solver_data["count"]) < STEP and np.isfinite(arrays["fluid"].get(name)).all()
    table = load_results(tmp_path)
    assert len(table["t"]) == STEP - 1 and all(np.isfinite(values).all() for values in table.values())
    assert json.loads((tmp_path / "run.json").read_text())["completed"] is False


class Slip(Tool):
    """Another fault than a number that is none, in a callback of the user's."""

    def __init__(self, error):
        self.error = error

    def post_step(self, solver):
        if solver.count + 1 == STEP:
            raise self.error


@pytest.mark.parametrize("error", [RuntimeError("mine"), KeyboardInterrupt()])
def test_any_error_leaves_the_rows_of_the_steps_before_it(error, tmp_path, monkeypatch):
    """Between two outputs. Seen before: the rows since the last output were lost."""
    made = SteadyBoiling.create_tools
    monkeypatch.setattr(SteadyBoiling, "create_tools", lambda self: [Slip(error), *made(self)])
    with pytest.raises(type(error)) as told:
        SteadyBoiling(output_dir=str(tmp_path)).run(SMALL)
    assert told.value is error
    count = int(read_output(output_files(tmp_path)[-1])[1]["count"])
    assert 0 < count < STEP - 1, "no row was made since the last output"
    table, record = load_results(tmp_path), json.loads((tmp_path / "run.json").read_text())
    assert len(table["t"]) == STEP - 1 and all(np.isfinite(values).all() for values in table.values())
    assert record["completed"] is False and record["steps"] == STEP - 1


def guarded(name, reductions=GENERAL, **state):
    """Guard and fluid of a set; no equation is compiled. ``state``: values of a particle."""
    made = scheme(name, dim=2, spacing=1.0)
    common = dict(spacing=1.0, dim=2, rho0=made.rho0)
    fluid = fluid_block((0.0, 0.0, 0.0), (4.0, 4.0, 0.0), **common)
    wall = wall_array(np.array([[0.0, -0.5, 0.0]]), kernel=made.kernel, heated=[1], **common)
    sites = [site_array([(2.0, 0.0, 0.0)], reach=2.4, spacing=1.0)] if made.sites else []
    made.setup_properties([fluid, wall, *sites])
    made.set_temperature(fluid, 350.0)
    for prop, value in state.items():
        fluid.get(prop)[3] = value
    made.arrays.append(fluid)  # as the solver does
    made.integrator = SimpleNamespace(reductions=reductions)
    return Guard(made), fluid


AFTER = SimpleNamespace(t=1.0, dt=0.5, count=2, disable_output=True)
SAID = "at t = 1.5 s (step 3) T = {} K of particle 3 of 'fluid' at (0.5, 3.5, 0) m"


@pytest.mark.parametrize("reductions", [GENERAL, pytest.param(CompiledReductions(), marks=native_only)],
                         ids=["general", "in C"])
@pytest.mark.parametrize(("name", "phase", "T", "ends"), [
    ("slab", None, 0.0, True), ("slab", None, -132.0, True), ("slab", None, WATER.T_crit, True),
    ("slab", None, 0.01, False), ("slab", None, 647.0, False),
    *[("states_hold", phase, T, True) for phase in (Phase.LIQUID, Phase.SUPERHEATED) for T in (-1.0, 700.0)],
    ("states_hold", Phase.VAPOUR, -1.0, True), ("states_hold", Phase.VAPOUR, 1500.0, False),  # superheated vapour
    ("states_hold", Phase.SUPERHEATED, 640.0, False),
])
def test_temperature_beyond_physics_ends_the_run(name, phase, T, ends, reductions):
    guard, _ = guarded(name, reductions, T=T, **({} if phase is None else {"phase": int(phase)}))
    if not ends:
        guard.post_step(AFTER)
        return
    with pytest.raises(FloatingPointError) as error:
        guard.post_step(AFTER)
    said = str(error.value)
    assert said.startswith(SAID.format(f"{T:g}") + ("" if phase is None else f", {phase.name.lower()}"))
    assert "1 particles in all; liquid must stay between 0 K and 647.1 K, the critical point of water at 1 atm" in said


def test_converted_latent_heat_beyond_the_critical_point_is_told_once():
    """The paper's form reads up to 535 K out of stored latent heat, by design."""
    guard, fluid = guarded("states", phase=int(Phase.SUPERHEATED), T=800.0)
    with pytest.warns(UserWarning, match=r"T = 800 K of particle 3 .* 647.1 K.*with phases.interrupt = convert"):
        guard.post_step(AFTER)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        guard.post_step(AFTER)
    fluid.T[3] = -5.0
    with pytest.raises(FloatingPointError, match="T = -5 K of particle 3"):
        guard.post_step(AFTER)

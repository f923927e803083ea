"""The main job, short and small: the ledger closes at every step, and a run does not depend on the threads."""
import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pysph.solver.tools import Tool

from pysph_boiling.examples.steady_boiling import SteadyBoiling
from pysph_boiling.particles import NO_BUBBLE
from pysph_boiling.results import load_run

SMALL = ["--flat", "--width", "30", "--fill", "16", "--sites", "3", "--pattern", "regular", "--smallest-cavity",
         "0", "--duration", "2.5", "--seed", "3"]


class Merges(Tool):
    """Counts steps in which particles of two bubbles find themselves in one."""

    def __init__(self, scheme):
        self.scheme, self.before, self.count = scheme, {}, 0

    def post_step(self, solver):
        fluid = self.scheme.arrays[0]
        inside = fluid.bubble != NO_BUBBLE
        now = dict(zip(fluid.uid[inside].tolist(), fluid.bubble[inside].tolist()))
        came_from = {}
        for uid, label in now.items():
            if uid in self.before:
                came_from.setdefault(label, set()).add(self.before[uid])
        self.count += sum(len(labels) > 1 for labels in came_from.values())
        self.before = now


class Watched(SteadyBoiling):
    """Steady boiling that counts merges; the final check of the full scene is for the full scene."""

    def create_tools(self):
        tools = super().create_tools()
        self.merges = Merges(self.scheme)
        return [*tools, self.merges]

    def check_final(self):
        pass


def run_small(output_dir, *extra):
    app = Watched(output_dir=str(output_dir))
    app.run([*SMALL, "--no-pictures", "--openmp", *extra])
    return app


def events(app):
    """What happened in a run: a test that compares runs must see each of these."""
    last = app.ledger.rows[-1]
    return {"vaporised": int(last["n_nucleated"]), "merged": app.merges.count, "vented": int(last["n_bubbles_vented"])}


def assert_something_happened(seen):
    assert seen["vaporised"] >= 20 and seen["merged"] >= 1 and seen["vented"] >= 1, f"too little happened: {seen}"


@pytest.fixture(scope="module")
def small_run(tmp_path_factory):
    return run_small(tmp_path_factory.mktemp("steady"))


def test_a_healthy_run_says_nothing_of_its_sweeps(small_run):
    """Some of its steps end above the tolerance, none above the error that a step must not end with."""
    results = small_run.ledger.table()
    assert np.count_nonzero(results["density_error_mean"] > 0.005) >= 1  # measured 3
    assert results["n_unconverged"][-1] == 0.0 and results["density_error_mean"].max() <= 0.015


def test_ledger_closes_at_every_step(small_run):
    assert_something_happened(events(small_run))
    results = small_run.ledger.table()
    assert len(results["t"]) == small_run.solver.count
    for name, column in results.items():
        assert np.all(np.isfinite(column)), f"{name} holds NaN or Inf"
    # measured 1e-15: sums over 5e2 particles of numbers that are exact to 1e-16 each
    assert np.max(np.abs(results["energy_residual"])) <= 1e-10
    assert np.all(results["mass_residual"] == 0.0)
    assert results["energy_in"][-1] > 0.0 and results["energy_out"][-1] > 0.0


def test_states_add_up(small_run):
    results = small_run.ledger.table()
    states = ("liquid", "transition", "superheated", "vapour", "held")
    particles = small_run.scheme.arrays[0].get_number_of_particles()
    assert np.all(sum(results[f"n_{state}"] for state in states) == particles)
    np.testing.assert_allclose(sum(results[f"energy_{state}"] for state in states), results["energy"], rtol=1e-12)


def test_nothing_leaves_the_vessel(small_run):
    fluid, (lower, upper) = small_run.scheme.arrays[0], small_run.box(small_run.parameters)
    assert fluid.x.min() > lower[0] and fluid.x.max() < upper[0]
    assert fluid.y.min() > lower[1] and fluid.y.max() < upper[1]


def test_files_of_a_run(small_run):
    folder = Path(small_run.output_dir)
    with np.load(folder / "results.npz") as stored:
        for name, column in small_run.ledger.table().items():
            np.testing.assert_array_equal(stored[name], column)
    run = json.loads((folder / "run.json").read_text())
    assert run["completed"] and run["steps"] == small_run.solver.count
    assert run["effects"]["heater"]["temperature"] == {"value": 433.15, "unit": "K"}
    assert run["facts"]["A (heat relative to motion)"]["value"] == 1000.0
    assert all(seconds > 0.0 for stage, seconds in run["wall_time"].items() if stage != "unit")
    assert not list(folder.glob("*.tmp*")), "temporary files are left"


def test_run_is_read_again_with_units_particles_and_events(small_run):
    saved, fluid = load_run(small_run.output_dir), small_run.scheme.arrays[0]
    assert all(saved.results.unit(name) and saved.results.meaning(name) for name in saved.results)
    assert saved.results.unit("energy_heater") == "J/m" and saved.settings["heater.temperature"] == 433.15
    last = saved.particles(small_run.solver.t)
    assert last.time == pytest.approx(2.5) and np.array_equal(last["fluid"].x, fluid.x)
    kinds = [event.kind for event in saved.events]
    assert kinds.count("departure") == len(small_run.departures) >= 1
    assert kinds.count("vent") == saved.results["n_bubbles_vented"][-1] >= 1
    sites = saved.particles(0.0)["sites"]
    assert {event.x for event in saved.events if event.kind == "departure"} <= set(sites.x)
    assert saved.record["heated_area"] == {"unit": "m", "value": pytest.approx(20 * 0.002)}  # 0.7 of 30, symmetric


def digest(app):
    """Hash of the whole state, bit by bit."""
    fluid, state = app.scheme.arrays[0], hashlib.sha256()
    for name in sorted(fluid.properties):
        if name != "gid":
            state.update(np.ascontiguousarray(fluid.get(name)).tobytes())
    return state.hexdigest()


def test_one_and_two_threads_are_bitwise_equal(tmp_path):
    outcomes = []
    for threads in ("1", "2"):
        done = subprocess.run([sys.executable, __file__, str(tmp_path / threads)], check=True, capture_output=True,
                              text=True, env={**os.environ, "OMP_NUM_THREADS": threads})
        outcomes.append(json.loads(done.stdout.splitlines()[-1]))
    one, two = outcomes
    assert (one["threads"], two["threads"]) == (1, 2)
    assert_something_happened(one["events"])
    assert one["events"] == two["events"] and one["digest"] == two["digest"]


if __name__ == "__main__":
    from pysph.base.nnps import get_number_of_threads

    finished = run_small(sys.argv[1])
    print(json.dumps({"events": events(finished), "digest": digest(finished), "threads": get_number_of_threads()}))

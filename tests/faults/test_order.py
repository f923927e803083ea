"""Nothing depends on the place of a particle in memory: neither of fluid, nor of walls, nor of sites."""
import numpy as np
import pytest
from same import assert_same_results

from pysph_boiling.evaluation.problems import drift
from pysph_boiling.examples.heated_slab import HeatedSlab
from pysph_boiling.examples.steady_boiling import SteadyBoiling
from pysph_boiling.files import output_files, read_output
from pysph_boiling.schemes.solver import StagedSolver

POOL = ["--flat", "--width", "24", "--fill", "16", "--sites", "5", "--pattern", "regular",
        "--smallest-cavity", "0", "--subcooling", "0.1", "--duration", "0.3", "--frame", "0.1",
        "--openmp", "--no-pictures", "--detailed-output"]


def shuffle(solver):
    """Every array in a random order, at the start and every seventh step."""
    rng = np.random.default_rng(solver.count)
    for pa in solver.particles if solver.count % 7 == 0 else ():
        n = pa.get_number_of_particles()
        order = rng.permutation(n)
        for array in pa.properties.values():
            values = array.get_npy_array().reshape(n, -1)
            values[:] = values[order]
    solver.nnps.update()
    solver.integrator.forget_lists()


def run(folder, monkeypatch, how, *options):
    """A run whose particles stay where they were made, are sorted, or shuffled, or only their scratch is mixed."""
    with monkeypatch.context() as patch:
        if how != "sorted":
            ways = {"shuffled": shuffle, "mixed": mix_scratch, "as made": lambda solver: None}
            patch.setattr(StagedSolver, "reorder_particles", ways[how])
        application = SteadyBoiling()
        application.check_final = lambda: None
        application.run([*POOL, "--reorder-freq", "1", "-d", str(folder), *options])
    return application, read_output(output_files(folder)[-1])[0]


def mix_scratch(solver):
    """What a step writes before it reads it, in a random order, at the start and every seventh step."""
    rng = np.random.default_rng(solver.count)
    for pa in solver.particles if solver.count % 7 == 0 else ():
        order = rng.permutation(pa.get_number_of_particles())
        for name in solver.scratch.get(pa.name, ()):
            values = pa.get(name, only_real_particles=False)
            values[:] = values[order]


def test_what_is_not_sorted_is_written_before_it_is_read(tmp_path, monkeypatch):
    plain, expected = run(tmp_path / "plain", monkeypatch, "as made")
    other, found = run(tmp_path / "mixed", monkeypatch, "mixed")
    scratch = other.solver.scratch["fluid"]
    assert {"lmbda", "kinetic", "film", "k"} <= scratch < set(found["fluid"].properties)
    assert_same_results(plain.ledger.table(), other.ledger.table())
    for name in set(found["fluid"].properties) - scratch:
        np.testing.assert_array_equal(found["fluid"].get(name), expected["fluid"].get(name), err_msg=name)
    assert plain.ledger.table()["n_nucleated"][-1] > 0


@pytest.mark.parametrize("detailed", [True, False])
def test_a_last_file_with_everything_is_sorted_throughout(detailed, tmp_path, monkeypatch):
    """What is scratch goes along with the rest only where it is written."""
    application = SteadyBoiling()
    application.check_final = lambda: None
    made = [] if detailed else ["--detailed-output"]
    application.run([*(part for part in POOL if part not in made), "--reorder-freq", "60", "--max-steps", "60", "-d",
                     str(tmp_path)])
    fluid = application.scheme.arrays[0]
    moved = np.hypot(fluid.sx, fluid.sy) - np.hypot(fluid.u, fluid.v) * application.solver.dt
    assert (np.max(np.abs(moved)) < 1e-12) == detailed


MODES = {"dynamic": [], "li_xiao": ["--mode", "li_xiao", "--storage.n-emit", "1", "--duration", "0.2"]}


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("how", ["sorted", "shuffled"])
def test_events_labels_and_ledger_are_the_same(how, mode, tmp_path, monkeypatch):
    plain, expected = run(tmp_path / "plain", monkeypatch, "as made", *MODES[mode])
    other, found = run(tmp_path / how, monkeypatch, how, *MODES[mode])
    moved = set()
    for name, pa in expected.items():
        keys = ["uid"] if "uid" in pa.properties else ["x", "y"]  # walls and sites stand still, and have no numbers
        rows = [np.lexsort([one.get(key) for key in keys]) for one in (pa, found[name])]
        if not np.array_equal(*rows):
            moved.add(name)
        for prop in ("x", "y", "phase", "bubble", "T", "number", "Q_s", "heated", "m"):
            if prop in pa.properties:
                ours, theirs = (one.get(prop)[row] for one, row in zip((found[name], pa), reversed(rows)))
                np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9, err_msg=f"{name}.{prop}")
    assert moved >= ({"fluid", "wall", "sites"} if how == "shuffled" else {"fluid", "wall"})
    assert (other.departures, other.vents) == (plain.departures, plain.vents)
    table, ledger = plain.ledger.table(), other.ledger.table()
    assert table["n_emitted" if mode == "li_xiao" else "n_nucleated"][-1] > 0 and table.keys() == ledger.keys()
    for name, values in table.items():
        size = 1.0 if name.endswith("residual") else np.max(np.abs(values))
        np.testing.assert_allclose(ledger[name], values, rtol=1e-9, atol=1e-9 * size, err_msg=name)


def test_a_periodic_box_is_sorted_with_its_ghosts(monkeypatch):
    """Particles cross the borders meanwhile; ghosts stay behind the others, and follow their originals."""
    made = []

    def stepper(*arguments, **options):
        made.append(drift_stepper(*arguments, ordered=bool(made), **options))
        return made[-1]

    drift_stepper = drift.Stepper
    monkeypatch.setattr(drift, "Stepper", stepper)
    for _ in range(2):
        drift.PeriodicBox(steps=45).run()
    plain, other = (one.arrays["fluid"] for one in made)
    rows = np.argsort(plain.uid), np.argsort(other.uid)
    assert not np.array_equal(*rows) and np.all(other.get("tag", only_real_particles=True) == 0)
    assert other.get_number_of_particles() > other.get_number_of_particles(True)
    for name in ("x", "y", "u", "v", "rho"):
        ours, theirs = other.get(name)[rows[1]], plain.get(name)[rows[0]]
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9, err_msg=name)


def test_a_periodic_slab_at_rest_is_sorted_too(tmp_path, monkeypatch):
    found = []
    for how in (True, False):
        with monkeypatch.context() as patch:
            if not how:
                patch.setattr(StagedSolver, "reorder_particles", lambda solver: None)
            application = HeatedSlab()
            application.check_final = lambda: None
            application.run(["--max-steps", "120", "--reorder-freq", "3", "--openmp", "--no-pictures", "-d",
                             str(tmp_path)])
            found.append(application.scheme.arrays[0])
    rows = [np.argsort(pa.uid) for pa in found]
    assert not np.array_equal(*rows) and np.ptp(found[0].T) > 1.0
    np.testing.assert_allclose(found[0].T[rows[0]], found[1].T[rows[1]], rtol=1e-12)

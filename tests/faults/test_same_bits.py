"""A run in three parts has the bits of a run in one piece, with every option that changes how a step is computed."""
import json

import numpy as np
import pytest
from same import assert_same_end, assert_same_results

from pysph_boiling.examples.dam_break import DamBreak
from pysph_boiling.examples.steady_boiling import SteadyBoiling
from pysph_boiling.runs.pysph_options import SEARCHES

DAM = (DamBreak, ["--quick", "--tf", "0.1"], (7, 12, 20))  # 30 steps, an output every 6
POOL = (SteadyBoiling, ["--flat", "--width", "24", "--fill", "16", "--sites", "2", "--pattern", "regular",
                        "--smallest-cavity", "0", "--subcooling", "0.1", "--duration", "0.3", "--frame", "0.1"],
        (30, 41))
OPTIONS = {
    "plain": [], "lists kept": ["--density.skin", "0.2"], "reference": ["--quality", "reference"],
    "draft": ["--quality", "draft"], "sorted": ["--reorder-freq", "4"], "sorted seldom": ["--reorder-freq", "5"],
    "sorted, lists kept": ["--reorder-freq", "4", "--density.skin", "0.3"], "rows": ["--results-every", "3"],
    "outputs": ["--pfreq", "5"], "short steps": ["--timestep", "0.002", "--density.skin", "0.3"],
    "everything written": ["--detailed-output", "--density.skin", "0.2"], "packed": ["--compress-output"],
    "another search": ["--nnps", "sh", "--density.skin", "0.2"], "substeps": ["--substeps", "8"],
    "more sweeps": ["--density.max-sweeps", "12", "--density.tolerance", "1e-4"],
    "by number": ["--sort-gids", "--density.skin", "0.2"], **{name: ["--nnps", name] for name in SEARCHES[1:]},
}
COMPILED = {  # these compile kernels of their own
    "Wendland": ["--kernel", "WendlandQuintic"], "Chebyshev": ["--density.chebyshev-radius", "0.9"],
    "one thread": ["--no-openmp"], "friction": ["--viscosity.wall", "0"]}


def parts(case, folder, options, stops):
    """Run a scene in parts that end at the steps ``stops``; the application of the last one."""
    scene, arguments, _ = case
    for number, stop in enumerate((*stops, None)):
        application = scene()
        application.check_final = lambda: None
        backend = [] if "--no-openmp" in options else ["--openmp"]
        part = [*(["--resume"] if number else []), *([] if stop is None else ["--max-steps", str(stop)])]
        application.run([*arguments, *backend, *options, "--no-pictures", "-d", str(folder), *part])
    return application


def compare(case, options, tmp_path):
    """The application of the run in one piece; both runs have the same rows and end in the same state."""
    whole = parts(case, tmp_path / "whole", options, ())
    last = parts(case, tmp_path / "parts", options, case[2])
    assert last.solver.count == whole.solver.count > case[2][-1] + 5
    assert_same_results(tmp_path / "parts", tmp_path / "whole")
    assert_same_end(tmp_path / "parts", tmp_path / "whole")
    return whole


@pytest.mark.parametrize("name", [*OPTIONS, *(pytest.param(name, marks=pytest.mark.slow) for name in COMPILED)])
def test_dam_break_in_parts(name, tmp_path):
    options = (OPTIONS | COMPILED)[name]
    whole = compare(DAM, options, tmp_path)
    fluid = whole.scheme.arrays[0]
    assert np.max(np.hypot(fluid.u, fluid.v)) > 0.3, "it hardly moved"
    searches = whole.scheme.integrator.searches
    kept = "--density.skin" in options or "reference" in options
    assert (searches < whole.solver.count) == kept, f"{searches} searches"
    moved = not np.array_equal(fluid.uid, np.arange(len(fluid.uid)))
    assert moved == ("--nnps" not in options) == (type(whole.nnps).__name__ == "SortedCellNNPS")


def test_boiling_in_parts_with_lists_kept_and_particles_sorted(tmp_path):
    whole = compare(POOL, ["--density.skin", "0.2", "--reorder-freq", "7"], tmp_path)
    results, t = whole.ledger.table(), 41 * whole.solver.dt
    made = results["n_nucleated"]
    assert made[-1] > np.interp(t, results["t"], made), "nothing vaporised after the last part began"


def test_lists_that_do_not_hold_are_made_anew(tmp_path):
    """A particle that was moved by hand between two parts is found where it is."""
    application = parts(DAM, tmp_path, ["--density.skin", "0.2", "--reorder-freq", "1000"], (7,))
    integrator, fluid = application.scheme.integrator, application.scheme.arrays[0]
    assert integrator.lists_hold() in (True, False) and fluid.listed[0] == len(fluid.place)
    fluid.listed_x[:], fluid.listed_y[:] = fluid.x, fluid.y
    assert integrator.lists_hold()
    fluid.x[3] += 0.11 * application.scheme.spacing
    assert not integrator.lists_hold()
    fluid.x[3] -= 0.11 * application.scheme.spacing
    fluid.place[:2] = fluid.place[1::-1]
    assert not integrator.lists_hold()
    fluid.place[:] = np.arange(len(fluid.place))
    integrator.forget_lists()
    assert not integrator.lists_hold()


def test_only_what_keeps_lists_carries_them(tmp_path):
    plain = parts(DAM, tmp_path, [], ())
    assert not {"place", "listed_x", "listed_y", "listed_z"} & set(plain.scheme.arrays[0].properties)
    assert "listed" not in plain.scheme.arrays[0].constants
    assert json.loads((tmp_path / "run.json").read_text())["changes"] == []

"""What PySPH's own options do in our scenes: the same results, or what their name says."""
import json

import h5py
import numpy as np
import pytest

from pysph_boiling.examples.dam_break import DamBreak
from pysph_boiling.examples.heated_slab import HeatedSlab
from pysph_boiling.files import output_files, read_output
from pysph_boiling.results import load_results
from pysph_boiling.runs.pysph_options import SEARCHES

SCENES = {"dam_break": (DamBreak, ["--quick", "--max-steps", "20"]), "heated_slab": (HeatedSlab, ["--tf", "20"])}
ROUND_OFF = 1e-12  # of the largest value; measured 1.4e-14
QUIET = ("--no-pictures", "--loglevel", "none")


def run(scene, folder, *arguments):
    """A finished run, and its last file's fluid in the order of uid: name -> (n,)."""
    cls, own = SCENES[scene]
    application = cls(output_dir=str(folder))
    application.run(["--openmp", "-d", str(folder), *QUIET, *own, *arguments])
    files = output_files(folder)
    if not files:
        return application, {}
    fluid = read_output(files[-1])[0]["fluid"]
    order = np.argsort(fluid.uid)
    return application, {name: fluid.get(name)[order] for name in fluid.properties if name in "x y u v rho e".split()}


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    return {scene: run(scene, tmp_path_factory.mktemp(scene))[1] for scene in SCENES}


@pytest.mark.parametrize("arguments", [
    *(["--nnps", name] for name in SEARCHES[1:]), ["--reorder-freq", "3"], ["--sort-gids"], ["--fixed-h"],
    ["--cache-nnps"], ["--no-adaptive-timestep"], ["--with-zoltan"], ["--compress-output"], ["--detailed-output"],
], ids=" ".join)
@pytest.mark.parametrize("scene", SCENES)
def test_results_are_those_of_the_plain_run(scene, arguments, reference, tmp_path):
    found = run(scene, tmp_path, *arguments)[1]
    assert found.keys() == reference[scene].keys() and len(found["x"]) > 300
    moved = "u" if scene == "dam_break" else "e"
    assert np.ptp(reference[scene][moved]) > 0.1, "nothing happened"
    for name, values in reference[scene].items():
        np.testing.assert_allclose(found[name], values, rtol=0.0, atol=ROUND_OFF * max(np.abs(values).max(), 1e-9),
                                   err_msg=name)


def test_other_kernel_gives_other_results(reference, tmp_path):
    found = run("dam_break", tmp_path, "--kernel", "WendlandQuintic")[1]
    assert 1e-4 < np.abs(found["x"] - reference["dam_break"]["x"]).max() / np.ptp(found["x"]) < 0.05


def test_files_are_what_the_options_ask_for(tmp_path, capsys):
    folder = tmp_path / "output [of a run]"  # PySPH's own reader finds no file in a folder of this name
    application, _ = run("heated_slab", folder, "--fname", "slab", "--pfreq", "7", "--max-steps", "17",
                         "--compress-output", "--logfile", "story.log", "--loglevel", "info", "--quiet")
    assert capsys.readouterr().out == ""
    names = {path.name for path in folder.iterdir()}
    assert {f"slab_{count:05d}.hdf5" for count in (0, 7, 14, 17)} == {name for name in names if name.endswith("hdf5")}
    assert {"slab.info", "story.log"} <= names and not {"heated_slab.info", "heated_slab.log"} & names
    assert len(application.output_files) == 4 and "Started as" in (folder / "story.log").read_text()
    with h5py.File(folder / "slab_00017.hdf5") as file:
        assert file["particles/fluid/arrays/x"].compression == "gzip"
    assert json.loads((folder / "run.json").read_text())["steps"] == 17


def test_timestep_and_final_time(tmp_path):
    application, _ = run("heated_slab", tmp_path, "--tf", "3", "--timestep", "0.5")
    np.testing.assert_allclose(load_results(tmp_path)["t"], 0.5 * np.arange(1, 7))
    assert application.parameters.duration == 3.0


def test_log_and_profile_are_printed(tmp_path, capsys):
    from compyle.config import get_config

    try:
        run("heated_slab", tmp_path, "--loglevel", "info", "--print-log", "--profile")
    finally:
        get_config().profile = False
    out, err = capsys.readouterr()
    assert "Started as" in err and "Profiling info" in out and "Integrator" in out
    assert (tmp_path / "profile_info.csv").exists()


def test_checks_work_from_memory_where_nothing_is_written(tmp_path):
    """The front of a dam break at each output, as it reads from the files of a run that writes them."""
    own = ["--tf", "0.3", "--frame", "0.05"]
    written, _ = run("dam_break", tmp_path / "written", "--max-steps", "1000000", *own)
    silent, _ = run("dam_break", tmp_path / "silent", "--max-steps", "1000000", "--disable-output", *own)
    assert not output_files(tmp_path / "silent") and not (tmp_path / "silent" / "results.npz").exists()
    front = np.array(silent.measured())
    assert front.shape == (7, 2) and front[-1, 1] > 1.5 * front[0, 1]
    np.testing.assert_array_equal(front, np.array(written.measured()))


@pytest.mark.parametrize("every", ["3", "1000"])
def test_last_row_of_the_results_is_the_last_step(every, tmp_path):
    application, _ = run("heated_slab", tmp_path, "--results-every", every)
    t = load_results(tmp_path)["t"]
    assert t[-1] == application.solver.t == 20.0 and len(t) == 20 // int(every) + 1
    assert application.solver.count == 20, "a row of every third step would not be the last one"

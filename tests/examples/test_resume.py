"""An interrupted run goes on: from any of its particle files, to the very state that it would have had."""
import json
import shutil

import numpy as np
import pytest
from pysph.solver.utils import get_files, load
from same import assert_same_end, assert_same_results

from pysph_boiling.examples.steady_boiling import SteadyBoiling
from pysph_boiling.results import load_results

SMALL = ["--flat", "--width", "24", "--fill", "16", "--sites", "2", "--pattern", "regular",
         "--smallest-cavity", "0", "--subcooling", "0.1", "--duration", "1.2", "--frame", "0.1", "--no-pictures",
         "--openmp"]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SteadyBoiling, "check_final", lambda self: None)  # the pool is too small for its figures
        SteadyBoiling().run([*SMALL, "--directory", str(folder)])
    return folder


def test_resumed_run_equals_uninterrupted(whole, tmp_path, monkeypatch):
    files = get_files(str(whole))
    cut = len(files) // 2
    for file in files[:cut + 1]:
        shutil.copy(file, tmp_path)
    # the table and the events reach beyond the file that the run goes on from
    for name in ("results.npz", "run.json", "steady_boiling.info"):
        shutil.copy(whole / name, tmp_path)
    monkeypatch.setattr(SteadyBoiling, "check_final", lambda self: None)
    SteadyBoiling().run([*SMALL, "--directory", str(tmp_path), "--restart-file", get_files(str(tmp_path))[-1]])

    ours, theirs = load_results(tmp_path), load_results(whole)
    middle = np.searchsorted(theirs["t"], float(load(files[cut])["solver_data"]["t"]))
    assert theirs["n_nucleated"][-1] > theirs["n_nucleated"][middle] > 0  # something happened on both sides of the cut
    assert theirs["n_vented"][-1] > theirs["n_vented"][middle]
    assert_same_results(ours, theirs)
    assert_same_end(tmp_path, whole)
    records = [json.loads((folder / "run.json").read_text()) for folder in (tmp_path, whole)]
    assert records[0]["departures"] == records[1]["departures"] and records[0]["completed"]
    assert len(get_files(str(tmp_path))) == len(files)


def test_file_of_other_effects_is_refused(whole, tmp_path):
    with pytest.raises(ValueError, match=r"resumed with another --phases.kinetic \(it was site and would become"):
        SteadyBoiling().run([*SMALL, "--mode", "li_xiao", "--directory", str(tmp_path / "none"), "--restart-file",
                             get_files(str(whole))[3]])
    assert not (tmp_path / "none").exists()

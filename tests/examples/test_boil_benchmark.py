"""The worker of benchmarks/boil.py: what it hands over is the boiling water itself, and it times whole steps."""
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from pysph_boiling.phases import Phase

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import boil  # noqa: E402

SMALL = ["--dim", "2", "--spacing", "0.002", "--width", "12", "--fill", "10", "--sites", "1"]
BEFORE, AFTER = 150, 20  # steps


def boil_on(folder, name, *steps, state=None):
    """Answers and states of a process that takes these steps, from a state or from the start."""
    process = boil.Process(name, boil.ROOT, hdx=1.0, state=state, threads=1, scene=SMALL)
    try:
        return [(process.ask(steps=n), *process.state(folder, k)) for k, n in enumerate(steps)]
    finally:
        process.close()


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """One run in a piece, and one that takes over its state."""
    folder = tmp_path_factory.mktemp("boil")
    first, last = boil_on(folder, "whole", BEFORE, AFTER)
    (other,) = boil_on(folder, "taken over", AFTER, state=first[1])
    return first[2], last, other


def test_a_run_from_the_state_is_the_run(runs):
    start, (_, _, whole), (_, _, taken_over) = runs
    assert (start["property phase"] == Phase.VAPOUR).any()  # it boils, or the test tells nothing
    assert whole["count"] == taken_over["count"] == BEFORE + AFTER and whole["t"] == taken_over["t"]
    assert not np.array_equal(boil.by_uid(start, "x"), boil.by_uid(whole, "x"))
    for name in ("x", "y", "u", "e", "T", "phase", "bubble"):
        np.testing.assert_array_equal(boil.by_uid(whole, name), boil.by_uid(taken_over, name), err_msg=name)
    assert boil.same_events(whole, taken_over, AFTER)["holds"]


def test_stages_are_parts_of_the_step(runs):
    steps = runs[2][0]
    assert len(steps) == AFTER and {"search", "heat", "density", "forces"} <= set(steps[0])
    for step in steps:
        parts = [step[name] for name in step if name not in ("whole", "sweeps")]
        assert min(parts) >= 0.0 and 0.0 < sum(parts) < step["whole"] and step["sweeps"] >= 1.0


def test_versions_in_turn(tmp_path, monkeypatch):
    """The tree against itself: the same bits, and a table with both."""
    def copied(revision, folder):
        shutil.copytree(boil.ROOT / "pysph_boiling", Path(folder) / "pysph_boiling")
        return revision

    monkeypatch.setattr(boil, "unpack", copied)
    page = tmp_path / "table.md"
    assert boil.main(["--against", "copy", "--hdx", "1.0", "--before", "5", "--steps", "14", "--threads", "1",
                      "--report", str(page), *SMALL]) == 0
    text = page.read_text()
    assert "| whole step |" in text and "positions agree to 1e-09 spacings after 12 steps, or 10 times " in text
    assert "the largest distance is 0.0e+00 spacings, the median 0.0e+00; in the twin " in text


def test_a_version_that_breaks_says_so():
    process = boil.Process("broken", boil.ROOT, hdx=1.0, state=None, threads=1, scene=["--no-such-option"])
    with pytest.raises(RuntimeError, match="(?s)broken ended: .*no-such-option"):
        process.ask(steps=1)
    process.close()

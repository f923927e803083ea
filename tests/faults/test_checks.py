"""Checks of a run: of our own, never switched off, made where the run can tell; the closing lines come all the same."""
import ast
import json
import os
import re
import subprocess
import sys
from io import StringIO
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

import pysph_boiling
from pysph_boiling.checks import CheckFailed
from pysph_boiling.examples import scene_class, scenes
from pysph_boiling.examples.dam_break import DamBreak
from pysph_boiling.examples.heated_slab import HeatedSlab
from pysph_boiling.runs.application import SceneApplication

PACKAGE = Path(pysph_boiling.__file__).parent
STRICT = ("--tolerance", "1e-9", "--no-pictures")  # of heated_slab: no run keeps it
FORMS = [(name, variant) for name in scenes() if issubclass(scene_class(name), SceneApplication)
         for variant in (None, *scene_class(name).variants)]


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*.py")), ids=lambda path: str(path.relative_to(PACKAGE)))
def test_no_check_is_an_assert_statement(path):
    found = [node.lineno for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Assert)]
    assert not found, f"python -O leaves out what stands in {path} at lines {found}"


def test_optimised_python_makes_the_final_check(tmp_path):
    done = subprocess.run(
        [sys.executable, "-O", "-m", "pysph_boiling", "run", "heated_slab", *STRICT, "-d", str(tmp_path)],
        capture_output=True, text=True, check=False, env={**os.environ, "OMP_NUM_THREADS": "1"})
    assert done.returncode == 1 and "the final check failed: L2 error" in done.stderr
    assert "conservation: relative error" in done.stdout and "60 rows" in done.stdout, "the closing lines are lost"


def test_a_failed_check_is_ours_and_a_sweep_goes_on(tmp_path, capsys):
    outcomes = []
    for number, options in enumerate((STRICT, STRICT[2:])):
        try:
            HeatedSlab().run([*options, "-d", str(tmp_path / str(number))])
        except CheckFailed as error:
            outcomes.append(str(error))
        else:
            outcomes.append(None)
        printed = capsys.readouterr().out
        assert "conservation: relative error" in printed
        timed = json.loads((tmp_path / str(number) / "run.json").read_text())["timed"]
        step = float(re.search(r"time: (\S+) ms a step", printed)[1])
        assert timed["steps"] == 60 and step == pytest.approx(1e3 * timed["seconds"] / 60, rel=1e-2)
        assert (tmp_path / str(number) / "results.npz").exists()
    assert outcomes[0].startswith("L2 error of the temperature") and outcomes[1] is None


def test_short_run_is_told_and_not_failed(tmp_path, capsys):
    DamBreak().run(["--quick", "--tf", "0.1", "--no-pictures", "-d", str(tmp_path)])
    said = " ".join(capsys.readouterr().out.split())
    assert "the final check was skipped: it needs a run of 0.7982 s, and this one ended at t = 0.1 s" in said
    assert "results.npz (" in said and "6 particle files" in said


def checked(application, t, table, lost=0):
    """What a run of this application says of itself at ``t`` [s], with these results."""
    said = StringIO()
    application.solver = SimpleNamespace(t=t, count=1)
    application.ledger = SimpleNamespace(table=lambda: table, rows=[])
    application.found_at_end = {"lost": lost}
    application.check(Console(file=said, width=1000))
    return said.getvalue()


@pytest.mark.parametrize(("name", "variant"), FORMS)
def test_no_scene_fails_for_being_short(name, variant):
    application = scene_class(name)()
    application.resolve([] if variant is None else [f"--{variant}"])
    standard = application.parameters.duration
    for share in (1e-3, 0.02):
        assert "the final check was skipped: " in checked(application, share * standard, {})
    if name != "heated_slab":  # which says itself how far the heat must have come
        assert 0.5 * standard < application.check_from(application.parameters) <= standard


def steady(median):
    """What steady_boiling makes of 7 bubbles that departed with so many particles."""
    from pysph_boiling.examples.steady_boiling import SteadyBoiling

    class Ran(SteadyBoiling):
        departures = [(0.1, median, 0)] * 7

    application = Ran()
    application.resolve(["--flat"])
    table = {"n_single_bubbles": np.array([0.0]), "n_bubbles": np.array([7.0])}
    application.ledger = SimpleNamespace(table=lambda: table, rows=[{"n_bubbles_vented": 7.0}])
    application.check_final()


def held(left):
    """What bubble_held makes of a bubble of 20 particles that has so many in the end; its pool pays for .042 of one."""
    from pysph_boiling.examples.bubble_held import BubbleHeld

    application = BubbleHeld()
    application.resolve(["--flat"])
    application.found_at_end = {"fluid": 224}
    n = np.array([20.0, 20.0, left])
    application.check_bubbles({"t": np.array([0.0, 0.2, 0.5]), "n": n, "n1": n})


@pytest.mark.parametrize(("check", "good", "bad"), [(steady, (8, 40, 706), (7, 707)), (held, (18, 20, 22), (17, 23))])
def test_final_checks_have_a_bound_on_both_sides(check, good, bad):
    """A film of 707 particles, wider than half the base, passed as a bubble, and vapour from nothing as one held."""
    for value in good:
        check(value)
    for value in bad:
        with pytest.raises(CheckFailed, match="particles; it must have|the vapour"):
            check(value)


def test_rounded_sums_pass_and_losses_do_not():
    application = HeatedSlab()
    application.resolve([])

    def at(mass=0.0, energy=0.0, lost=0, T=300.0):
        table = {"mass_residual": np.array([0.0, mass]), "energy_residual": np.array([energy, 0.0]), "T": np.array([T])}
        return checked(application, 0.1, table, lost)

    for rounded in (dict(mass=1.5e-16), dict(mass=-9e-13), dict(energy=9e-11)):
        assert "the final check was skipped" in at(**rounded)
    for wrong, said in ((dict(mass=-1.1e-12), "mass is not cons"), (dict(energy=1.1e-10), "energy is not cons"),
                        (dict(lost=1), "1 particles are lost"), (dict(T=np.nan), "NaN or Inf")):
        with pytest.raises(CheckFailed, match=said):
            at(**wrong)

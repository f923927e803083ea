"""Hard cases in their quick form, in 2-D; ``pysph-boiling stress`` runs all of them."""
import json
import re
from copy import deepcopy
from pathlib import Path

import pytest

from pysph_boiling.evaluation.stress.case import simulate
from pysph_boiling.evaluation.stress.cases import all_cases
from pysph_boiling.evaluation.stress.command import COLUMNS, measure, page, run_all, stress
from pysph_boiling.evaluation.stress.judge import judge, load_bounds
from pysph_boiling.report import markdown

BOUNDS, CASES = load_bounds(), all_cases()
OWN_SET = ("quiet", "flux", "burst", "omega", "band", "paper")  # modules that no other test needs
QUICK = [pytest.param(name, marks=[pytest.mark.slow] if name.startswith(OWN_SET) else [])
         for name, case in CASES.items() if case.quick]


# Limits that remain: case -> rules that it breaks today. A case that is mended, or breaks another rule, fails here.
KNOWN = json.loads(Path(__file__).with_name("known.json").read_text())


@pytest.mark.parametrize("name", QUICK)
def test_case(name):
    case = CASES[name]
    wrong = judge(case, simulate(case, case.quick), BOUNDS)
    assert {rule for rule, _ in wrong} == set(KNOWN.get(name, ())), wrong


def test_known_limits_are_of_cases_that_exist():
    assert set(KNOWN) <= set(CASES) and all(KNOWN.values())


def test_each_case_of_the_list_is_there():
    for name in ("dam-dt20", "dam-one-sweep", "column-80", "quiet-100000", "jet", "collision", "flux-1000",
                 "conductivity-1000", "contrast", "heater-1000K", "quench", "burst", "flicker", "latent-zero",
                 "same-place", "line", "plane", "on-wall", "outside", "displaced", "squeezed", "one-particle",
                 "two-particles", "no-vapour", "all-vapour", "bubble-1", "bubble-2", "shaken", "thousand",
                 "chain-10000", "omega-1", "band", "swollen", "collapse", "paper", "masses", "smoothing", "gravity-0",
                 "gravity-up", "gravity-sideways", "periodic", "threads"):
        assert any(case.startswith(name) for case in CASES), name
    assert len({case.name for case in CASES.values()}) == len(CASES)


def test_command_writes_its_table(tmp_path, capsys):
    written, rows = tmp_path / "page.md", tmp_path / "rows.json"
    stress(["latent-zero-2d", "--quick", "--json", str(rows), "--report", str(written)])
    assert "refused" in capsys.readouterr().out
    (row,) = json.loads(rows.read_text())
    assert row["verdict"] == "refused" and "must be > 0 J/kg" in row["reasons"][0]
    text = written.read_text()
    head, line, body = [line for line in text.split("\n") if line.startswith("|")][:3]
    assert head.count("|") == line.count("|") == body.count("|") == len(COLUMNS) + 1
    assert all(entry["reason"] in text for entry in BOUNDS["rules"].values())
    with pytest.raises(ValueError, match="no case 'nonsense'"):
        stress(["nonsense"])


def test_a_case_that_fails_is_told(monkeypatch, capsys):
    from pysph_boiling.evaluation.stress import command

    strict = deepcopy(BOUNDS)
    strict["rules"]["speed"]["bound"] = 0.0
    monkeypatch.setattr(command, "load_bounds", lambda: strict)
    with pytest.raises(AssertionError, match="1 of 1 cases: threads-2d"):
        stress(["threads-2d", "--quick"])
    assert re.search(r"fails threads-2d .*\n +speed 0\.\d+ > 0\n", capsys.readouterr().out)


def test_a_refusal_that_was_not_asked_for_fails():
    case = CASES["latent-zero-2d"]
    wrong = type(case)(name=case.name, hard=case.hard, build=case.build, steps=1, quick=1)
    row = measure(wrong, simulate(wrong, 1), BOUNDS)
    assert row.verdict == "fails" and row.reasons == [simulate(wrong, 1).refusal]
    assert "fails: L of water" in markdown.page(*page([row], BOUNDS))


def test_a_case_runs_after_one_with_two_threads():
    """A fork of a process that has used threads hangs in OpenMP."""
    case = CASES["threads-2d"]
    simulate(case, 2)
    (row,) = run_all([(case, 2)], BOUNDS, 1, print)
    assert row.steps == 2 and row.verdict == "passes"

"""``pysph-boiling accuracy --quick`` writes a page with its figures, and takes points that are there as they are."""
import json
import re

import pytest

from pysph_boiling.cli import main
from pysph_boiling.evaluation.accuracy import command, measure
from pysph_boiling.evaluation.accuracy.command import accuracy

KEYS = ["momentum", "conduction"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("accuracy")
    accuracy([*KEYS, "--quick", "--repeats", "2", "--directory", str(folder), "--json", str(folder / "all.json")])
    return folder


def test_page_and_summary_hold_every_study(folder):
    html, summary = (folder / "index.html").read_text(), (folder / "summary.md").read_text()
    assert re.findall('<section id="(.*?)">', html) == KEYS
    assert html.count("<figure>") == 3 and html.count("data:image/png") == 3 and "script" not in html.lower()
    assert "Boiling: the paper" not in html and "load average" in html and "Of 2 claims" in html
    assert "pysph-boiling accuracy conduction --quick" in html
    for piece in ("Orders of convergence.", "| spacing | ", "| momentum | Periodic box | 2 agree |", "## conduction: ",
                  "default settings", "load average", "This is the quick form", "(images/summary_momentum.png)"):
        assert piece in summary, piece
    assert (folder / "images" / "summary_momentum.png").exists()
    for key, pictures in zip(KEYS, (["front.png"], ["front.png", "orders.png"])):
        assert sorted(file.name for file in (folder / key).glob("*.png")) == pictures
        assert (folder / key / "points.csv").stat().st_size > 0


def test_json_holds_points_orders_and_claims(folder):
    found = json.loads((folder / "all.json").read_text())
    assert list(found) == KEYS and all(found["momentum"]["claims"].values())
    assert len(found["conduction"]["points"]) == 3 and found["conduction"]["front"]
    assert 1.0 < found["conduction"]["orders"]["spacing"]["order"] < 2.5
    records = json.loads((folder / "points.json").read_text()).values()
    assert all(len(record["seconds"]) == 2 for record in records)


def test_resumes_from_the_points_that_are_there(folder, monkeypatch):
    monkeypatch.setattr(measure, "measure", lambda *_: pytest.fail("a point was run anew"))
    accuracy([*KEYS, "--quick", "--repeats", "2", "--directory", str(folder)])


def test_a_claim_that_fails_is_told_by_the_exit_status(folder, monkeypatch, tmp_path, capsys):
    claims = tmp_path / "claims.json"
    claims.write_text(json.dumps([{"study": "conduction", "error": "L2", "at_most": 1e-9, "why": "no"}]))
    monkeypatch.setattr("pysph_boiling.evaluation.accuracy.results.CLAIMS", claims)
    asked = ["accuracy", "conduction", "--quick", "--repeats", "2", "--directory", str(folder)]
    assert main(asked) == 1 and "L2 is at most" in capsys.readouterr().err


def test_list_runs_nothing(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(measure, "measure", lambda *_: pytest.fail("a point was run"))
    assert main(["accuracy", "--list"]) == 0
    assert capsys.readouterr().out.count("HydrostaticColumn(") > 50 and not list(tmp_path.iterdir())


@pytest.mark.parametrize("arguments, message", [
    (["fig3"], "no study 'fig3'"), (["--threads", "0"], "--threads must be"), (["--repeats", "0"], "--repeats must")])
def test_bad_arguments_are_refused(arguments, message, capsys):
    assert main(["accuracy", *arguments]) == 2 and message in capsys.readouterr().err


def test_repeats_end_with_the_budget(folder, monkeypatch, tmp_path):
    monkeypatch.setitem(command.BUDGET, True, 0.0)
    accuracy(["momentum", "--quick", "--directory", str(tmp_path)])
    assert [len(record["seconds"]) for record in json.loads((tmp_path / "points.json").read_text()).values()] == [1]

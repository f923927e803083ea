"""Every case of ``pysph-boiling validate``: each row within the bounds of its README; and the page made of them."""
import json
import re
import shutil
from pathlib import Path

import pytest

from pysph_boiling.evaluation import validate

CASES = validate.cases()
ROOT = Path(__file__).parents[2]
HEADING = "| " + " | ".join(validate.COLUMNS) + " |\n" + "|---" * len(validate.COLUMNS) + "|\n"
PLACE = Path("pysph_boiling", "evaluation", "validation")  # of the cases in a checkout
LONG = {"trends"}  # half a minute even in the quick form


@pytest.mark.parametrize("name, quick", [
    *(pytest.param(name, True, marks=[pytest.mark.slow] * (name in LONG), id=f"{name}-quick") for name in CASES),
    *(pytest.param(name, False, marks=pytest.mark.slow, id=name) for name in CASES)])
def test_case(name, quick, tmp_path):
    """A row that fails must be known to, and one that is known to fail must fail in the full form."""
    rows = validate.measure(CASES[name], quick, tmp_path / "picture.png")
    assert rows and (tmp_path / "picture.png").stat().st_size > 10_000
    for row in rows:
        shown = f"{row.case}, {row.bounds.what}: {row.found}, bounds {row.bounds.text}"
        assert row.holds or row.bounds.excuse, shown
        assert quick or not (row.holds and row.bounds.excuse), f"no longer fails: {shown}"


# --- the cases as they are written ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CASES)
def test_readme_names_formula_and_bounds(name):
    text = (CASES[name] / "README.md").read_text(encoding="utf-8")
    assert text.startswith("# ") and "problems/" in text
    assert validate.read_bounds(CASES[name] / "README.md")


def test_tests_that_the_page_names_exist():
    commands = re.findall(r"`pytest ([^`]*)`", (validate.FOLDER / "covered.md").read_text(encoding="utf-8"))
    assert len(commands) > 10
    for command in commands:
        assert (ROOT / command.split()[-1].split("::")[0]).exists(), command


@pytest.mark.parametrize("row, message", [
    ("| a | truth | x | y | 0 | 1 | because | |", "kind must be one of"),
    ("| a | validation | x | y | | | because | |", "no bounds"),
    ("| a | validation | x | y | 0 | 1 | | |", "no reason"),
    ("| a | validation | x | y | 0 | 1 | because | |\n| `a` | validation | x | y | 0 | 1 | because | |", "given twice"),
])
def test_row_without_bounds_or_reason_is_refused(row, message, tmp_path):
    (tmp_path / "README.md").write_text(HEADING + row + "\n")
    with pytest.raises(ValueError, match=message):
        validate.read_bounds(tmp_path / "README.md")


def test_another_table_is_refused(tmp_path):
    (tmp_path / "README.md").write_text("| a | b |\n|---|---|\n| 1 | 2 |\n")
    with pytest.raises(ValueError, match="must have the columns"):
        validate.read_bounds(tmp_path / "README.md")


# --- the command, on a made-up case -----------------------------------------------------------------------------------


CASE = """
from pysph_boiling.report.pictures import plot

def run(quick):
    return quick

def rows(quick):
    yield "good", 0.5, "0.5"
    yield "known", 3.0, "3"
    if not quick:
        yield "other", {other}, "measured"

def draw(quick, path):
    with plot(path) as ax:
        ax.plot([1, 2], [3, 4])
"""
README = """# A made-up case

""" + HEADING + """| `good` | validation | half of 1, \\|x\\| | 1/2 | 0.4 | 0.6 | because | |
| `known` | validation | a third | 1/3 | | 1 | because | it was never good |
| `other` | regression | something | stored | -1 | | because | |
"""


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A folder of cases with one in it; its third row measures ``other``."""
    def make(other="0.0"):
        folder = tmp_path / PLACE
        (tmp_path / "docs").mkdir()
        (folder / "made_up").mkdir(parents=True)
        (folder / "made_up" / "README.md").write_text(README)
        (folder / "made_up" / "case.py").write_text(CASE.format(other=other))
        (folder / "intro.md").write_text("What this is.\n")
        (folder / "covered.md").write_text("## Covered by tests\n")
        monkeypatch.setattr(validate, "FOLDER", folder)
        monkeypatch.chdir(tmp_path)
        return tmp_path

    return make


def test_page_keeps_the_kinds_apart_and_shows_what_fails(checkout):
    root = checkout()
    validate.validate(["--json", "rows.json"])
    page = (root / "docs" / "validation.md").read_text(encoding="utf-8")
    first, second = page.split("## Regression")
    assert "half of 1" in first and "something" not in first and "something" in second
    assert "**fails**: it was never good" in first and page.count("| holds |") == 2
    assert "3 rows" in page and "1 of which fail" in page
    assert (root / "docs" / "images" / "validation_made_up.png").exists() and "images/validation_made_up.png" in page
    assert "(../pysph_boiling/evaluation/validation/made_up/README.md)" in page
    written = json.loads((root / "rows.json").read_text())
    assert [row["holds"] for row in written["rows"]] == [True, False, True]
    assert written["rows"][0]["command"] == "pysph-boiling validate made_up"


def test_real_experiments_have_a_table_of_their_own(checkout):
    root = checkout()
    readme = root / PLACE / "made_up" / "README.md"
    readme.write_text(README.replace("`other` | regression", "`other` | experiment"))
    validate.validate([])
    first, second = (root / "docs" / "validation.md").read_text(encoding="utf-8").split("## Validation:")
    assert "## Real experiments" in first and "| case | experiment | source | ours | measured range" in first
    assert "something" in first and "something" not in second


def test_case_that_is_run_alone_leaves_the_others_as_they_are(checkout):
    root = checkout()
    folder = root / PLACE
    shutil.copytree(folder / "made_up", folder / "other")
    validate.validate([])
    (folder / "other" / "case.py").write_text(CASE.format(other="1.0").replace('"measured"', '"measured anew"'))
    (folder / "made_up" / "case.py").write_text("broken")
    validate.validate(["other"])
    page = (root / "docs" / "validation.md").read_text(encoding="utf-8")
    assert "6 rows, 2 of which fail" in page
    assert page.count("| measured |") == 1 and page.count("| measured anew |") == 1
    shutil.rmtree(folder / "made_up")
    validate.validate(["other"])
    assert "3 rows, 1 of which" in (root / "docs" / "validation.md").read_text(encoding="utf-8")


def test_quick_form_leaves_the_documentation_alone(checkout):
    root = checkout()
    validate.validate(["--quick"])
    assert not list((root / "docs").iterdir())
    assert "quick form" in (root / "validate" / "validation.md").read_text()


def test_case_that_cannot_be_run_is_told_once_the_others_are_done(checkout):
    root = checkout()
    folder = root / PLACE
    shutil.copytree(folder / "made_up", folder / "a_broken_one")
    (folder / "a_broken_one" / "case.py").write_text(CASE.replace("return quick", "raise ValueError('no such thing')"))
    with pytest.raises(ChildProcessError, match="^a_broken_one: ValueError: no such thing$"):
        validate.validate([])
    assert "3 rows, 1 of which" in (root / "docs" / "validation.md").read_text(encoding="utf-8")


def test_report_of_another_name_has_its_pictures_and_records_beside_it(checkout):
    root = checkout()
    validate.validate(["--report", "out/mine.md"])
    assert "(images/mine_made_up.png)" in (root / "out" / "mine.md").read_text(encoding="utf-8")
    assert (root / "out" / "images" / "mine_made_up.png").exists() and not list((root / "docs").iterdir())
    assert list(json.loads((root / "out" / "mine.json").read_text())) == ["made_up"]


@pytest.mark.parametrize("value", ["-2.0", "float('nan')"])
def test_row_that_fails_unexpectedly_ends_the_command(checkout, value):
    root = checkout(value)
    with pytest.raises(AssertionError, match="made_up: something: measured"):
        validate.validate([])
    assert "| **fails** |" in (root / "docs" / "validation.md").read_text()


def test_rows_and_readme_must_agree(checkout, tmp_path):
    root = checkout()
    folder = root / PLACE / "made_up"
    (folder / "README.md").write_text(README.replace("`other`", "`another`"))
    with pytest.raises(ValueError, match="row 'other' is not in its README"):
        validate.measure(folder, quick=False)
    (folder / "README.md").write_text(README + "| `more` | validation | x | y | 0 | 1 | because | |\n")
    with pytest.raises(ValueError, match="nothing was measured for more"):
        validate.measure(folder, quick=False)
    assert len(validate.measure(folder, quick=True)) == 2


def test_unknown_case_is_told(checkout):
    checkout()
    with pytest.raises(ValueError, match="no case 'nonsense'; there are: made_up"):
        validate.validate(["nonsense"])


def test_installed_package_writes_a_page_of_its_own(checkout):
    root = checkout()
    (root / "docs").rmdir()
    validate.validate([])
    assert "3 rows" in (root / "validate" / "validation.md").read_text() and not (root / "docs").exists()

"""What a statement needs to agree has two sides, and a corrected fault is named until a figure is run again."""
import ast
import json
import math
from pathlib import Path

import pytest

from pysph_boiling.evaluation.reproduce import explosive
from pysph_boiling.evaluation.reproduce.faults import CORRECTED, FAULTS, caveat
from pysph_boiling.evaluation.reproduce.figure import MODULES
from pysph_boiling.evaluation.reproduce.wording import PAPER
from pysph_boiling.report.markdown_page import write_report
from pysph_boiling.report.sections import Section, bound, judged

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(("measured", "agrees"), [([0.5], True), ([0.1, 1.0], True), ([0.05, 0.5], False),
                                                  ([0.5, 1.2], False), ([math.nan], False)])
def test_a_figure_off_either_end_disagrees(measured, agrees):
    assert judged("p", "o", [bound("x", measured, 0.1, 1.0)], "why").agrees is agrees
    assert judged("p", "o", [bound("x", measured, 0.1, 1.0)], conclusive=False).agrees is None


@pytest.mark.parametrize("ends", [(0.1, math.inf), (-math.inf, 1.0), (1.0, 0.1), (math.nan, 1.0)])
def test_a_bound_on_one_side_is_refused(ends):
    with pytest.raises(ValueError, match="needs a lower and an upper bound"):
        bound("x", [0.5], *ends)


def test_no_statement_compares_with_one_end():
    """A verdict is made by ``judged``; one that is not holds no comparison of size."""
    seen = 0
    for module in MODULES:
        tree = ast.parse((Path(explosive.__file__).parent / f"{module}.py").read_text())
        for call in ast.walk(tree):
            name = getattr(getattr(call, "func", None), "id", "")
            seen += name == "judged"
            if name == "Statement":
                ordered = [node for node in ast.walk(call) if isinstance(node, ast.Compare) and any(
                    isinstance(op, (ast.Lt, ast.LtE, ast.Gt, ast.GtE)) for op in node.ops)]
                assert not ordered, f"{module}.py, line {call.lineno}"
    assert seen >= 25


def test_a_pool_thrown_at_its_lid_disagrees():
    """The level of Fig. 5 as it was with a push that knew no speed, against what the excess heat pays for."""
    paid = 0.0841
    bounds = [bound("rise", [rise], explosive.SWOLLEN, explosive.PAID * paid) for rise in (0.149, 0.76, 1.02)]
    assert judged("p", "o", bounds).agrees is False
    assert judged("p", "o", [bound("rise", [0.0883], explosive.SWOLLEN, explosive.PAID * paid)]).agrees is True


def test_a_fault_is_told_until_the_figure_is_run_again(tmp_path):
    old = dict(machine="", processor="p", finished="2026-11-23T00:00:00+00:00", versions={})
    for key in (*FAULTS, "fig3"):
        for finished, told in ((old["finished"], True), (f"{CORRECTED}T00:00:01+00:00", False)):
            section = Section(key, "t", origins=[{**old, "finished": finished}])
            assert bool(caveat(section)) is told
            text = write_report([section], tmp_path, tmp_path / f"{key}_{told}.md", [key], wording=PAPER).read_text()
            assert ("Not run again since 2026-11-23; the model" in text) is told
            assert ("These results still have a fault" in text) is (told and key in FAULTS)
    assert caveat(Section("fig2", "t")) == ""  # it has no runs


def test_stored_report_tells_its_faults():
    stored, page = (ROOT / "docs" / f"reproduction.{end}" for end in ("json", "md"))
    sections = [Section.revived(raw) for raw in json.loads(stored.read_text()).values()]
    assert page.read_text().count("Not run again since") == sum(bool(caveat(one)) for one in sections)

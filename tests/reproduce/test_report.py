"""The report in Markdown: complete, amended figure by figure, with pictures of a size to keep."""
from PIL import Image

from pysph_boiling.evaluation.reproduce.figure import figures
from pysph_boiling.evaluation.reproduce.wording import PAPER
from pysph_boiling.report.markdown_page import WIDTH, take_up, write_report
from pysph_boiling.report.sections import Picture, Section, Statement, Table

ORIGIN = dict(machine="", processor="A processor", finished="", versions=dict(pysph_boiling="0.1.0"))


def section(root, key, width, ours):
    """A section with a movie, a picture so many pixels wide, and a statement that says ``ours``."""
    (root / key).mkdir(exist_ok=True)
    Image.effect_noise((width, width // 2), 40).save(root / key / "a.png")
    return Section(key, "Figure 9: water | steam", pictures=[Picture("m.mp4", "moves"), Picture("a.png", "stands")],
                   tables=[Table(("a|b", "c"), [["1 < 2", "3"]], "numbers")], text="Two\nlines.",
                   statements=[Statement("paper", ours, True), Statement("other", "o", None, "too | small")],
                   commands=["x", "y", "x"], origins=[ORIGIN, ORIGIN])


def test_report_is_amended_figure_by_figure(tmp_path):
    path = tmp_path / "docs" / "report.md"
    write_report([section(tmp_path, "table3", 40, "first")], tmp_path, path, figures(), wording=PAPER)
    write_report([section(tmp_path, "fig14", 3 * WIDTH, "second")], tmp_path, path, figures(), wording=PAPER)
    write_report([section(tmp_path, "fig14", 2 * WIDTH, "third")], tmp_path, path, figures(), wording=PAPER)
    text = path.read_text()
    assert text.index("## Fig. 14") < text.index("## Table 3"), "not in the paper's order"
    assert "First." in text and "Third." in text and "Second." not in text
    assert "Of 4 statements of the paper, 2 agree, 2 undecided." in text and "2 runs, A processor" in text
    assert not list(path.parent.glob("**/*.mp4"))
    for key, width in (("table3", 40), ("fig14", WIDTH)):
        with Image.open(path.parent / "images" / f"report_{key}.png") as picture:
            assert picture.size == (width, width // 2)
    cells = [line.replace("\\|", "").count("|") for line in text.splitlines() if line.startswith("|")]
    assert set(cells) == {3, 4}, "a cell is torn"


def test_what_a_report_has_is_taken_up_where_it_was_not_made(tmp_path):
    path, other = tmp_path / "report.md", tmp_path / "other"
    before = [section(tmp_path, "fig3", 40, "kept"), section(tmp_path, "fig4", 40, "old")]
    write_report(before, tmp_path, path, figures(), wording=PAPER)
    (other / "fig4").mkdir(parents=True)
    section(other, "fig4", 40, "new").save(other / "fig4")
    take_up(path, other)
    kept, new = (Section.load(other / key) for key in ("fig3", "fig4"))
    assert kept.statements[0].ours == "kept" and not kept.pictures and not kept.data
    assert new.statements[0].ours == "new" and new.pictures
    take_up(tmp_path / "none.md", other)

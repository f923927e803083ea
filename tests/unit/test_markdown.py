"""Markdown tables: what a cell may hold."""
from pysph_boiling.report.markdown import table


def test_a_cell_stays_one_cell_on_one_line():
    lines = table(("a", "b"), [("|x|", r"\|y\|"), ("two\nlines", 0.5)])
    assert lines == ["| a | b |", "|---|---|", r"| \|x\| | \|y\| |", "| two lines | 0.5 |"]
    assert table(iter("ab"), ()) == lines[:2]

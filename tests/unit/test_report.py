"""What all reports share: the flags of their commands, Markdown, and tables on the terminal."""
import argparse

import pytest
from rich.console import Console

from pysph_boiling.cli import main
from pysph_boiling.report.markdown import page, table, write
from pysph_boiling.report.options import add_report_options
from pysph_boiling.report.terminal import show

COMMANDS = ("reproduce", "accuracy", "validate", "stress")


def test_a_cell_stays_one_cell_on_one_line():
    assert table(("a|b", "c"), [("1\n2", r"3\|4")]) == [r"| a\|b | c |", "|---|---|", r"| 1 2 | 3\|4 |"]


def test_a_page_is_made_of_blocks(tmp_path):
    text = page("# Title", "", table(("a",), [("1",)]), "End.")
    assert text == "# Title\n\n| a |\n|---|\n| 1 |\n\nEnd.\n"
    assert write(tmp_path / "folder" / "page.md", "# °").read_text(encoding="utf-8") == "# °\n"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_takes_the_same_flags(command, capsys):
    with pytest.raises(SystemExit):
        main([command, "--help"])
    out = capsys.readouterr().out
    assert all(flag in out for flag in ("--quick", "--report FILE.md", "--json FILE")) and "--markdown" not in out


@pytest.mark.parametrize(("arguments", "message"), [
    *(([command, "--markdown", "a.md"], "--markdown is called --report now") for command in COMMANDS),
    *(([command, "--report", "a.html"], "reports are Markdown files, --report FILE.md; got 'a.html'")
      for command in COMMANDS),
    *(([command, "--quick", "--report", "a.md"], "leave out --quick") for command in ("reproduce", "accuracy")),
    (["validate", "--directory", "docs"], "--directory is called --report FILE.md now")])
def test_a_flag_that_does_not_serve_is_refused(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as raised:
        main(arguments)
    assert raised.value.code == 2 and message in capsys.readouterr().err and not list(tmp_path.iterdir())


def test_a_flag_without_a_help_is_left_out():
    parser = argparse.ArgumentParser()
    add_report_options(parser, report=None)
    assert vars(parser.parse_args(["--json", "a.json"])) == {"json": "a.json"}


def test_a_table_is_printed_with_its_title(capsys):
    show(Console(width=40), ("a", "b"), [("1", "2")], title="numbers")
    out = capsys.readouterr().out
    assert "numbers" in out and "│ 1 │ 2 │" in out

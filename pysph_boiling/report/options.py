"""The flags of all commands that write reports: ``--quick``, ``--report FILE.md`` and ``--json FILE``."""
import argparse

from pysph_boiling.names import add_renamed

__all__ = ["add_report_options", "refuse_quick"]


def markdown_file(text):
    """The value of ``--report``. Raises ``ArgumentTypeError`` if the name of the file does not end in ``.md``."""
    if not text.endswith(".md"):
        raise argparse.ArgumentTypeError(f"reports are Markdown files, --report FILE.md; got '{text}'")
    return text


def add_report_options(parser, *, quick=None, report="write the tables to this file",
                       json="write the results to this file"):
    """Add the flags to a parser, in a group of their own.

    ``quick``, ``report`` and ``json`` are the help texts of the flags; a flag without a text is left out.
    """
    group = parser.add_argument_group("report")
    if quick:
        group.add_argument("--quick", action="store_true", help=quick)
    if report:
        group.add_argument("--report", metavar="FILE.md", type=markdown_file, help=report)
        add_renamed(parser, "--markdown", "--report")
    if json:
        group.add_argument("--json", metavar="FILE", help=json)


def refuse_quick(parser, options):
    """End the command if ``--quick`` would mix quick results into a report that keeps earlier results."""
    if options.report and options.quick:
        parser.error("--report FILE.md updates a report of the full form: leave out --quick")

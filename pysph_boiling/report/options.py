"""The flags that every command that reports takes: ``--quick``, ``--report FILE.md`` and ``--json FILE``."""
import argparse

__all__ = ["add_report_options", "add_renamed", "refuse_quick"]


class Renamed(argparse.Action):
    """An old flag: it ends the command with what took its place."""

    def __call__(self, parser, namespace, values, option_string=None):
        parser.error(f"{option_string} is called {self.const} now")


def markdown_file(text):
    """The value of ``--report``. Raises ``ArgumentTypeError`` for a file that is not called ``*.md``."""
    if not text.endswith(".md"):
        raise argparse.ArgumentTypeError(f"reports are Markdown, --report FILE.md; got '{text}'")
    return text


def add_renamed(parser, old, new):
    """Let the parser say that the flag ``old`` is called ``new`` now; it is not in the help."""
    parser.add_argument(old, action=Renamed, const=new, nargs="?", help=argparse.SUPPRESS)


def add_report_options(parser, *, quick=None, report="write the tables there", json="write the figures there"):
    """Add the flags to a parser, as a group of their own.

    ``quick``, ``report`` and ``json`` are the texts of the help. A flag without a text is left out.
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
    """End a command whose report keeps what it has of other runs, where ``--quick`` would mix into it."""
    if options.report and options.quick:
        parser.error("--report FILE.md keeps what it has of the full form: leave out --quick")

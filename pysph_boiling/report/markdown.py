"""Markdown, for the pages in ``docs/`` and the reports of all commands: tables, and pages made of blocks."""
import re
from pathlib import Path

__all__ = ["cells", "page", "table", "write"]


def cells(values):
    """One row of a table; vertical bars in cells are escaped, and line breaks become spaces."""
    lines = (" ".join(str(value).split()) for value in values)
    return "| " + " | ".join(re.sub(r"(?<!\\)\|", r"\\|", line) for line in lines) + " |"


def table(columns, rows):
    """The lines of a table, beginning with its heading."""
    columns = tuple(columns)
    return [cells(columns), "|" + "---|" * len(columns), *map(cells, rows)]


def page(*blocks):
    """The text of a page: its blocks with an empty line between them, without empty ones.

    A block is a string, or a list of lines such as :func:`table` returns.
    """
    texts = (block if isinstance(block, str) else "\n".join(block) for block in blocks)
    return "\n\n".join(text for text in texts if text) + "\n"


def write(path, *blocks):
    """Write a page, and make its folder if necessary; returns the path."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page(*blocks), encoding="utf-8")
    return path

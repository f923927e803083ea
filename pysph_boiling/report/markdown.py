"""Markdown, for the pages in ``docs/`` and the reports of all commands: tables, and pages made of blocks."""
import re
from pathlib import Path

__all__ = ["cells", "page", "table", "write"]


def cells(values):
    """One row: a bar inside a cell is escaped unless it is already, a line break is a space."""
    lines = (" ".join(str(value).split()) for value in values)
    return "| " + " | ".join(re.sub(r"(?<!\\)\|", r"\\|", line) for line in lines) + " |"


def table(columns, rows):
    """The lines of a table, heading first."""
    columns = tuple(columns)
    return [cells(columns), "|" + "---|" * len(columns), *map(cells, rows)]


def page(*blocks):
    """The text of a page: blocks with an empty line between them; empty ones are left out.

    A block is a string, or a list of lines such as :func:`table` returns.
    """
    texts = (block if isinstance(block, str) else "\n".join(block) for block in blocks)
    return "\n\n".join(text for text in texts if text) + "\n"


def write(path, *blocks):
    """Write a page; its folder is made if need be. Returns the path."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(page(*blocks), encoding="utf-8")
    return path

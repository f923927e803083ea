"""Tables in Markdown, for the pages in ``docs/`` and the printouts of the benchmarks."""
import re

__all__ = ["cells", "table"]


def cells(values):
    """One row: a bar inside a cell is escaped unless it is already, a line break is a space."""
    lines = (" ".join(str(value).split()) for value in values)
    return "| " + " | ".join(re.sub(r"(?<!\\)\|", r"\\|", line) for line in lines) + " |"


def table(columns, rows):
    """The lines of a table, heading first."""
    columns = tuple(columns)
    return [cells(columns), "|" + "---|" * len(columns), *map(cells, rows)]

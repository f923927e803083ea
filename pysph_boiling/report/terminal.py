"""Tables on the terminal, for all commands that write reports."""
__all__ = ["show"]


def show(console, columns, rows, title=None, **layout):
    """Print a table of texts, which may contain rich's markup; ``layout`` is passed to rich's ``Table``."""
    from rich.table import Table

    table = Table(*columns, title=title, **layout)
    for row in rows:
        table.add_row(*row)
    console.print(table)

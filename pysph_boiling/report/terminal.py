"""Tables on a terminal, for every command that reports."""
__all__ = ["show"]


def show(console, columns, rows, title=None, **layout):
    """Print a table: ``rows`` hold texts, which may have rich's markup. ``layout`` goes to rich's ``Table``."""
    from rich.table import Table

    table = Table(*columns, title=title, **layout)
    for row in rows:
        table.add_row(*row)
    console.print(table)

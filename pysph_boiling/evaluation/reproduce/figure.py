"""What a figure or table of the paper is here: the runs it needs, what is drawn from them, what it says of the paper.

A figure is one subclass of :class:`Figure`, registered under its key by being defined. It must not import what only
drawing needs before it draws.
"""
from importlib import import_module

from pysph_boiling.report.sections import Section

__all__ = ["FIGURES", "Figure", "figures"]

FIGURES = {}  # key -> class, filled by the modules below
MODULES = ("sites", "states", "steady", "explosive", "single_bubbles", "modes", "tables", "sensitivity", "performance")


class Figure:
    """One figure or table of the paper; ``key`` as typed on the command line, such as ``fig14``.

    Subclasses set ``key`` and ``title`` and override :meth:`runs` (nothing to run: leave it) and :meth:`make`. Figures
    that share runs give them the same name and options.
    """

    key = ""
    title = ""
    reads_others = False  # whether it reads the sections of other figures, and so comes after them

    def __init_subclass__(cls, **kwargs):
        super().__init_subclass__(**kwargs)
        if cls.key:
            FIGURES[cls.key] = cls

    def runs(self, quick):
        """The :class:`~pysph_boiling.evaluation.reproduce.runs.Run` s it needs, small ones if ``quick``."""
        return []

    def make(self, results, folder, quick):
        """Draw and measure; returns the :class:`Section`.

        ``results`` maps the name of each of :meth:`runs` to its
        :class:`~pysph_boiling.evaluation.reproduce.runs.Result`; ``folder`` exists and takes pictures and data files.
        """
        raise TypeError(f"{type(self).__name__} must override make")

    def section(self, **parts):
        """A :class:`Section` of this figure."""
        return Section(self.key, self.title, **parts)


def figures():
    """Key -> class of every figure, in the paper's order: figures, then tables."""
    for module in MODULES:
        import_module(f"pysph_boiling.evaluation.reproduce.{module}")

    def order(key):
        kind = key.rstrip("0123456789")
        return kind, int(key.removeprefix(kind))

    return {key: FIGURES[key] for key in sorted(FIGURES, key=order)}

"""The base class for figures and tables of the paper: the runs they need, the pictures and the comparison.

A figure is a subclass of :class:`Figure`, which is registered under its key when it is defined. Modules that are only
needed for drawing must be imported when it draws.
"""
from importlib import import_module

from pysph_boiling.report.sections import Section

__all__ = ["FIGURES", "Figure", "figures"]

FIGURES = {}  # key -> class, filled by the modules below
MODULES = ("sites", "states", "steady", "explosive", "single_bubbles", "modes", "tables", "sensitivity", "performance")


class Figure:
    """One figure or table of the paper; ``key`` is its name on the command line, such as ``fig14``.

    Subclasses set ``key`` and ``title`` and override :meth:`make`, and :meth:`runs` if they need any. Figures that
    share runs give them the same name and options.
    """

    key = ""
    title = ""
    reads_others = False  # whether it reads the sections of other figures and must be made after them

    def __init_subclass__(cls, **kwargs):
        super().__init_subclass__(**kwargs)
        if cls.key:
            FIGURES[cls.key] = cls

    def runs(self, quick):
        """List of the :class:`~pysph_boiling.evaluation.reproduce.runs.Run` it needs, small ones if ``quick``."""
        return []

    def make(self, results, folder, quick):
        """Draw and measure; returns the :class:`Section`.

        ``results`` maps the name of each of :meth:`runs` to its
        :class:`~pysph_boiling.results.SavedRun`; pictures and data are written to the existing
        ``folder``.
        """
        raise TypeError(f"{type(self).__name__} must override make")

    def section(self, **parts):
        """A :class:`Section` of this figure."""
        return Section(self.key, self.title, **parts)


def figures():
    """Key -> class of every figure in the order of the paper, first figures and then tables."""
    for module in MODULES:
        import_module(f"pysph_boiling.evaluation.reproduce.{module}")

    def order(key):
        kind = key.rstrip("0123456789")
        return kind, int(key.removeprefix(kind))

    return {key: FIGURES[key] for key in sorted(FIGURES, key=order)}

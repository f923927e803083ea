"""What a figure or table of the paper is here: the runs it needs, what is drawn from them, what it says of the paper.

A figure is one subclass of :class:`Figure`, registered under its key by being defined. It must not import what only
drawing needs before it draws.
"""
import csv
import json
import math
from dataclasses import asdict, dataclass, field
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

from pysph_boiling.analysis.ledger import write_json

__all__ = ["FIGURES", "Bound", "Figure", "Picture", "Section", "Statement", "Table", "bound", "figures", "judged",
           "spread", "write_csv"]

FIGURES = {}  # key -> class, filled by the modules below
MODULES = ("sites", "states", "steady", "explosive", "single_bubbles", "modes", "tables", "sensitivity", "performance")


@dataclass(frozen=True)
class Statement:
    """One statement of the paper, what was measured for it here, and whether they agree (None: cannot be told)."""

    paper: str
    ours: str
    agrees: bool | None
    why: str = ""
    bounds: list = field(default_factory=list)  # of Bound, on which the verdict rests

    def __post_init__(self):
        if self.agrees is not None:  # NumPy's truth is not JSON's
            object.__setattr__(self, "agrees", bool(self.agrees))


class Bound(NamedTuple):
    """``least`` and ``most`` of what was measured, and the ends between which it must lie for a statement to agree."""

    what: str
    least: float
    most: float
    low: float
    high: float


def bound(what, values, low, high):
    """The :class:`Bound` of measured ``values``, both ends included. ``ValueError`` where an end is missing."""
    if not (math.isfinite(low) and math.isfinite(high) and low <= high):
        raise ValueError(f"{what} needs a bound on both sides, got {low} to {high}")
    values = [float(value) for value in values]
    return Bound(what, min(values), max(values), float(low), float(high))


def judged(paper, ours, bounds, why="", told=True):
    """A :class:`Statement` that agrees where every figure is within its bounds; NaN is not. Not ``told``: no verdict.

    ``why`` is why it disagrees; what it would take to agree is said first.
    """
    agrees = all(one.low <= one.least and one.most <= one.high for one in bounds) if told else None
    terms = ", ".join(f"{one.what} {one.low:.3g} to {one.high:.3g}" for one in bounds)
    return Statement(paper, ours, agrees, f"agrees with {terms}" + (f"; {why}" if why and not agrees else ""), bounds)


@dataclass(frozen=True)
class Picture:
    """A picture or movie file (PNG, GIF, MP4), relative to the folder of the figure, and its caption."""

    file: str
    caption: str


@dataclass(frozen=True)
class Table:
    """Rows of text under headings."""

    columns: tuple[str, ...]
    rows: list
    caption: str = ""


@dataclass
class Section:
    """All that the page shows of one figure.

    ``data`` names the CSV and npz files with the numbers behind it; ``commands`` are those of its runs and ``origins``
    where they were made, see :func:`pysph_boiling.reproduce.page.origin`.
    """

    key: str
    title: str
    pictures: list = field(default_factory=list)
    tables: list = field(default_factory=list)
    statements: list = field(default_factory=list)
    data: list = field(default_factory=list)
    text: str = ""
    commands: list = field(default_factory=list)
    origins: list = field(default_factory=list)

    def save(self, folder):
        """Write the section as ``section.json``, from which the page is made."""
        write_json(Path(folder) / "section.json", asdict(self))

    @classmethod
    def load(cls, folder):
        """Read what :meth:`save` wrote."""
        return cls.revived(json.loads((Path(folder) / "section.json").read_text()))

    @classmethod
    def revived(cls, raw):
        """The section that ``asdict`` made ``raw`` of."""
        kinds = (("pictures", Picture), ("tables", Table), ("statements", Statement))
        return cls(**{**raw, **{name: [kind(**row) for row in raw[name]] for name, kind in kinds}})


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
        """The :class:`~pysph_boiling.reproduce.runs.Run` s it needs, small ones if ``quick``."""
        return []

    def make(self, results, folder, quick):
        """Draw and measure; returns the :class:`Section`.

        ``results`` maps the name of each of :meth:`runs` to its :class:`~pysph_boiling.reproduce.runs.Result`;
        ``folder`` exists and takes pictures and data files.
        """
        raise TypeError(f"{type(self).__name__} must override make")

    def section(self, **parts):
        """A :class:`Section` of this figure."""
        return Section(self.key, self.title, **parts)


def figures():
    """Key -> class of every figure, in the paper's order: figures, then tables."""
    for module in MODULES:
        import_module(f"pysph_boiling.reproduce.{module}")

    def order(key):
        kind = key.rstrip("0123456789")
        return kind, int(key.removeprefix(kind))

    return {key: FIGURES[key] for key in sorted(FIGURES, key=order)}


def spread(values, unit="", digits=3):
    """Text for an ensemble: mean and range over its members, such as ``12.1 (11.8 to 12.6) mm``."""
    values = [float(value) for value in values]
    mean = sum(values) / len(values)
    unit = f" {unit}" if unit else ""
    if len(values) == 1:
        return f"{mean:.{digits}g}{unit}"
    return f"{mean:.{digits}g} ({min(values):.{digits}g} to {max(values):.{digits}g}){unit}"


def write_csv(path, columns):
    """Write columns (name with unit -> values of equal length) as CSV; returns the file's name."""
    path = Path(path)
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))
    return path.name

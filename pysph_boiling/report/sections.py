"""What a report shows: sections of text, tables, pictures and statements, and the verdicts on them."""
import csv
import json
import math
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import NamedTuple

from pysph_boiling.runs.ledger import write_json

__all__ = ["Bound", "Picture", "Section", "Statement", "Table", "bound", "judged", "spread", "write_csv"]


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


def judged(paper, ours, bounds, why="", conclusive=True):
    """A :class:`Statement` that agrees where every figure is within its bounds; NaN is not.

    Where it is not ``conclusive`` there is no verdict. ``why`` is why it disagrees; what it would take to agree is said
    first.
    """
    agrees = all(one.low <= one.least and one.most <= one.high for one in bounds) if conclusive else None
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
    """All that a page shows of one figure or study.

    ``data`` names the CSV and npz files with the numbers behind it; ``commands`` are those of its runs and ``origins``
    where they were made, see :func:`pysph_boiling.report.page.origin`.
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

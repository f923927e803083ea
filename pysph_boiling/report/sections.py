"""The content of a report: sections with text, tables, pictures, and statements with their verdicts."""
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
    """A statement of the paper, our measurement for it, and whether they agree (``None`` if that is undecided).

    ``why`` is the reason for a disagreement, ``fair`` says why the criterion is fair, and ``bounds`` are the
    :class:`Bound` that decide the verdict.
    """

    paper: str
    ours: str
    agrees: bool | None
    why: str = ""
    bounds: list = field(default_factory=list)
    fair: str = ""

    def __post_init__(self):
        if self.agrees is not None:  # JSON cannot write NumPy's bool
            object.__setattr__(self, "agrees", bool(self.agrees))


class Bound(NamedTuple):
    """The smallest and largest measured value, ``least`` and ``most``, and the range in which a statement agrees."""

    what: str
    least: float
    most: float
    low: float
    high: float


def bound(what, values, low, high):
    """The :class:`Bound` of measured ``values``, both ends included. Raises ``ValueError`` if an end is missing."""
    if not (math.isfinite(low) and math.isfinite(high) and low <= high):
        raise ValueError(f"{what} needs a lower and an upper bound, got {low} to {high}")
    values = [float(value) for value in values]
    return Bound(what, min(values), max(values), float(low), float(high))


def judged(paper, ours, bounds, why="", conclusive=True, *, fair=""):
    """A :class:`Statement` that agrees if every measured value is within its bounds, which NaN is not.

    If it is not ``conclusive``, it is undecided. ``why`` is the reason for a disagreement; the bounds are given before
    it. ``fair`` says why the bounds are fair.
    """
    agrees = all(one.low <= one.least and one.most <= one.high for one in bounds) if conclusive else None
    terms = ", ".join(f"{one.what} {one.low:.3g} to {one.high:.3g}" for one in bounds)
    return Statement(paper, ours, agrees, f"it agrees for {terms}" + (f"; {why}" if why and not agrees else ""), bounds,
                     fair)


@dataclass(frozen=True)
class Picture:
    """A picture or movie file (PNG, GIF, MP4), relative to the folder of the figure, and its caption."""

    file: str
    caption: str


@dataclass(frozen=True)
class Table:
    """A table of text: headings, rows and a caption."""

    columns: tuple[str, ...]
    rows: list
    caption: str = ""


@dataclass
class Section:
    """Everything that a page shows of one figure or study.

    ``judged_on`` names the scene, length and forms of the runs that the statements are judged on;
    ``data`` names the CSV and npz files with its numbers, ``commands`` are the commands of its runs, and ``origins``
    says where they were made (:func:`pysph_boiling.report.page.origin`).
    """

    key: str
    title: str
    pictures: list = field(default_factory=list)
    tables: list = field(default_factory=list)
    statements: list = field(default_factory=list)
    data: list = field(default_factory=list)
    text: str = ""
    judged_on: str = ""
    commands: list = field(default_factory=list)
    origins: list = field(default_factory=list)

    def save(self, folder):
        """Write the section to ``folder/section.json``, from which the page is made."""
        write_json(Path(folder) / "section.json", asdict(self))

    @classmethod
    def load(cls, folder):
        """Read a section that :meth:`save` wrote."""
        return cls.revived(json.loads((Path(folder) / "section.json").read_text()))

    @classmethod
    def revived(cls, raw):
        """The section from its dict ``raw``, as made by ``asdict``."""
        kinds = (("pictures", Picture), ("tables", Table), ("statements", Statement))
        return cls(**{**raw, **{name: [kind(**row) for row in raw[name]] for name, kind in kinds}})


def spread(values, unit="", digits=3):
    """Text for an ensemble with the mean and range over its members, such as ``12.1 (11.8 to 12.6) mm``."""
    values = [float(value) for value in values]
    mean = sum(values) / len(values)
    unit = f" {unit}" if unit else ""
    if len(values) == 1:
        return f"{mean:.{digits}g}{unit}"
    return f"{mean:.{digits}g} ({min(values):.{digits}g} to {max(values):.{digits}g}){unit}"


def write_csv(path, columns):
    """Write columns (name with unit -> values of equal length) to a CSV file; returns the file's name."""
    path = Path(path)
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))
    return path.name

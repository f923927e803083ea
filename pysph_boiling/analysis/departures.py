"""When and from which sites bubbles depart, and how large they are then."""
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

__all__ = ["ENOUGH", "Departed", "Site", "departed"]

ENOUGH = 5  # departures of a site from which on its period has a scatter


@dataclass(frozen=True)
class Site:
    """One site: its ``number``, how many bubbles ``left`` it, and the mean ``period`` [s] between them.

    ``scatter`` [-] is the standard deviation of the periods over their mean. Both are NaN for fewer than ``ENOUGH``
    bubbles.
    """

    number: int
    left: int
    period: float
    scatter: float


@dataclass(frozen=True)
class Departed:
    """The bubbles that departed from the base, from the first of them, at ``begin`` [s], to ``end`` [s].

    ``rate`` [1/s] is their number per second. ``gap`` [s] is the longest time without one, which begins at ``gap_at``
    [s]; the time from the last one to the end counts. ``sizes`` (n,) are their numbers of particles, and ``sites`` has
    a :class:`Site` for each site from which any departed. Without any bubble times are NaN.
    """

    begin: float
    end: float
    rate: float
    gap: float
    gap_at: float
    sizes: np.ndarray
    sites: tuple

    @property
    def scatters(self) -> np.ndarray:
        """Scatter [-] of the period of each site with enough bubbles, (sites,)."""
        values = np.array([site.scatter for site in self.sites])
        return values[np.isfinite(values)]


def departed(events: Sequence[tuple], end: float) -> Departed:
    """The :class:`Departed` of ``events``, a list of (time [s], particles, site), in a run that ended at ``end`` [s].

    Errors: ``ValueError`` for events without a site, which earlier versions recorded.
    """
    if any(len(event) < 3 for event in events):
        raise ValueError("this run was made by an earlier version, which did not record from which site a bubble "
                         "departed: run it again")
    if not events:
        return Departed(np.nan, end, 0.0, np.nan, np.nan, np.zeros(0, int), ())
    t, n, site = (np.array(column) for column in zip(*sorted(events)))
    moments = np.append(t, end)
    gaps = np.diff(moments)
    most = int(np.argmax(gaps))
    rows = []
    for number in np.unique(site):
        periods = np.diff(t[site == number])
        mean = float(np.mean(periods)) if len(periods) + 1 >= ENOUGH else np.nan
        scatter = float(np.std(periods)) / mean if mean > 0.0 else np.nan
        rows.append(Site(int(number), len(periods) + 1, mean, scatter))
    lasted = end - t[0]
    return Departed(float(t[0]), float(end), (len(t) - 1) / lasted if lasted > 0.0 else 0.0, float(gaps[most]),
                    float(moments[most]), n, tuple(rows))

"""Size, position and shape of bubbles over time, from the particle files of a run, and quantities derived from them."""
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from pysph.base.particle_array import ParticleArray
from scipy.spatial import Delaunay, cKDTree

from pysph_boiling.analysis.drops import pieces
from pysph_boiling.files import load_output
from pysph_boiling.particles import positions
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.vapour import nearest_image

__all__ = ["PIECE", "Event", "Free", "Shape", "fall", "free_bubbles", "hole", "lasting", "mendelson", "merger",
           "pulsation", "rise_speed", "shapes", "split", "track"]

PIECE = {2: 4, 3: 8}  # smallest number of particles that counts as a bubble of its own; fewer are a splash
LASTS = 0.05  # [s] that bubbles must stay merged or apart
TOGETHER = 2.0  # [spacings] vapour that is closer is seen as one bubble, in one piece or in several
SECTORS = 12  # around the axis of a ring
COVER = 2.0  # [spacings] thickness of the liquid above a bubble that is not at the surface
MARGIN = 4.0  # [spacings] round a bubble within which voids are looked for
SEMI_AXIS = {2: 4.0, 3: 5.0}  # squared semi-axis of a full ellipse or ellipsoid over the variance along it


@dataclass(frozen=True)
class Shape:
    """One bubble at one moment. Lengths in m, volumes in m^dim (in 2-D areas).

    ``label`` is its smallest uid, ``n`` its number of particles, ``volume`` the rest volume of its vapour, ``centroid``
    (3,) its centroid, and ``mean_radius`` the mean distance from the centroid (the paper, eq. 24). ``width`` and
    ``height`` are the horizontal and vertical axes of the ellipse or ellipsoid with the same second moments, and
    ``occupied`` is the volume of that ellipsoid, which does not change when the bubble only flattens.
    """

    label: int
    n: int
    volume: float
    centroid: np.ndarray
    mean_radius: float
    width: float
    height: float
    occupied: float

    @property
    def aspect(self) -> float:
        """Width over height [-], above 1 for a flat bubble."""
        return self.width / self.height if self.height > 0.0 else np.nan


def shapes(fluid: ParticleArray, dim: int, rho0: float, period: Sequence[float] = (0.0, 0.0, 0.0),
           uids: np.ndarray | None = None) -> list[Shape]:
    """The :class:`Shape` of every bubble of a fluid array with labels, largest first.

    ``fluid`` has ``x, y, z`` [m], ``m`` [kg], ``phase``, ``bubble`` and, where vapour swells, ``swell``; ``rho0`` is
    the density of the liquid [kg/m^3]; ``period`` [m] the length of the domain along each axis, 0 where it is not
    periodic (a bubble must be shorter than half of it). With ``uids`` (n,) only particles with one of these count.
    """
    vapour = np.flatnonzero(fluid.phase == Phase.VAPOUR)
    if uids is not None:
        vapour = vapour[np.isin(fluid.uid[vapour], uids)]
    volume = fluid.m[vapour] / rho0
    if "swell" in fluid.properties:
        volume = volume * fluid.swell[vapour]
    place = positions(fluid)[vapour]
    found = []
    for label in np.unique(fluid.bubble[vapour]):
        own = fluid.bubble[vapour] == label
        first = place[own][0]
        arm = nearest_image(place[own] - first, period)
        centroid = first + arm.mean(axis=0)
        arm -= arm.mean(axis=0)
        moments = SEMI_AXIS[dim] * (arm.T @ arm)[:dim, :dim] / len(arm)
        width, height = np.sqrt(np.trace(moments[:-1, :-1]) / (dim - 1)), np.sqrt(moments[-1, -1])
        ball = np.pi if dim == 2 else 4.0 / 3.0 * np.pi
        found.append(Shape(
            int(label), int(own.sum()), float(volume[own].sum()), centroid, float(np.linalg.norm(arm, axis=1).mean()),
            2.0 * float(width), 2.0 * float(height), ball * float(np.sqrt(max(np.linalg.det(moments), 0.0)))))
    return sorted(found, key=lambda shape: (-shape.n, shape.label))


@dataclass(frozen=True)
class Free:
    """A bubble between the base and the surface, at one moment.

    ``shape`` is the :class:`Shape` of its largest piece, ``whole`` [-] the share of its vapour that is in this piece,
    and ``void`` [m] the thickness of the thickest gap in it and round it, in which there is no particle.
    """

    shape: Shape
    whole: float
    void: float


def free_bubbles(fluid: ParticleArray, walls: ParticleArray, *, dim: int, spacing: float, floor: float,
                 rho0: float = 1.0) -> list[Free]:
    r"""The :class:`Free` bubbles of a fluid array with labels that have at least ``PIECE`` particles, largest first.

    ``fluid`` is that of :func:`shapes`, ``walls`` a list of wall arrays, and ``spacing`` that of the particles [m]. A
    bubble is free when all of it is above ``floor`` [m], and liquid ``COVER`` spacings thick lies above it. Pieces of
    vapour closer than ``TOGETHER`` spacings are one bubble.

    An empty ball of radius R fits between two plane rows of a square or cubic lattice that are a gap apart:

    .. math::  gap = 2 \sqrt{R^2 - (dim - 1) dx^2/4} - dx

    The void is this gap for the largest empty ball that touches the bubble; it is 0 in a lattice.
    """
    vapour = np.flatnonzero(fluid.phase == Phase.VAPOUR)
    if not len(vapour):
        return []
    place, points = positions(fluid)[vapour][:, :dim], positions(fluid)[:, :dim]
    bubble, _ = pieces(place, TOGETHER * spacing)
    label = np.asarray(fluid.bubble)[vapour]
    around = np.concatenate([points, *(positions(pa)[:, :dim] for pa in walls)])
    liquid = points[fluid.phase != Phase.VAPOUR]
    found, seen = [], set()
    for shape in shapes(fluid, dim, rho0):
        number = bubble[np.argmax(label == shape.label)]
        if shape.n < PIECE[dim] or number in seen:
            continue
        seen.add(number)
        own = place[bubble == number]
        lower, upper = own.min(axis=0), own.max(axis=0)
        across = liquid[:, :-1]
        above = liquid[np.all((across >= lower[:-1] - spacing) & (across <= upper[:-1] + spacing), axis=1), -1]
        if lower[-1] > floor and above.max(initial=-np.inf) > upper[-1] + COVER * spacing:
            found.append(Free(shape, shape.n / len(own), void(own, around, spacing)))
    return found


def void(own, points, spacing):
    """The void [m] round the bubble ``own`` (n, dim) [m] among all ``points`` (m, dim) [m]; see :func:`free_bubbles`.

    The largest empty balls are the circumscribed ones of the simplices of a Delaunay triangulation.
    """
    dim = own.shape[1]
    near = points[np.all(np.abs(points - 0.5 * (own.min(axis=0) + own.max(axis=0)))
                         <= 0.5 * np.ptp(own, axis=0) + MARGIN * spacing, axis=1)] / spacing
    corners = near[Delaunay(near).simplices]
    edges = corners[:, 1:] - corners[:, :1]
    solid = np.abs(np.linalg.det(edges)) > 1e-6  # flat ones have no ball; their neighbours have
    corners, edges = corners[solid], edges[solid]
    middle = np.linalg.solve(edges, 0.5 * np.sum(edges**2, axis=2)[..., None])[..., 0]
    radius = np.linalg.norm(middle, axis=1)
    at_bubble = cKDTree(own / spacing).query(corners.reshape(-1, dim))[0].reshape(corners.shape[:2]).min(axis=1) < 1e-9
    most = np.max(radius[at_bubble & (radius < MARGIN / 2.0)], initial=0.0)
    return float(max(0.0, 2.0 * np.sqrt(max(0.0, most**2 - 0.25 * (dim - 1))) - 1.0)) * spacing


def largest(fluid, t, dim, rho0, uids=None):
    """The row of :func:`track` for one moment ``t`` [s], as a dict; empty if a fluid array has no vapour."""
    found = shapes(fluid, dim, rho0, uids=uids)
    if not found:
        return {}
    one, two = found[0], found[1] if len(found) > 1 else None
    return {
        "t": t, "bubbles": sum(shape.n >= PIECE[dim] for shape in found),
        "whole": sum(shape.n for shape in found if shape.n >= PIECE[dim]), "n": sum(shape.n for shape in found),
        "volume": sum(shape.volume for shape in found), "n1": one.n, "volume1": one.volume,
        "x1": one.centroid[0], "height1": one.centroid[dim - 1], "mean_radius1": one.mean_radius,
        "width1": one.width, "tall1": one.height, "occupied1": one.occupied, "aspect1": one.aspect,
        "n2": two.n if two else np.nan, "x2": two.centroid[0] if two else np.nan,
        "height2": two.centroid[dim - 1] if two else np.nan}


def hole(fluid: ParticleArray, dim: int) -> float:
    """Radius [m] of the hole in a ring-shaped bubble, the largest of a fluid array with labels; 0 if it is no ring.

    It is the distance of the nearest of its particles from the vertical axis through its centroid. A bubble is a ring
    (3-D) if it has vapour in each of ``SECTORS`` equal sectors around this axis; in 2-D there are none.
    """
    vapour = np.flatnonzero(fluid.phase == Phase.VAPOUR)
    if dim == 2 or not len(vapour):
        return 0.0
    labels, counts = np.unique(fluid.bubble[vapour], return_counts=True)
    own = positions(fluid)[vapour][fluid.bubble[vapour] == labels[np.argmax(counts)]][:, :2]
    arm = own - own.mean(axis=0)
    sectors = np.floor((np.arctan2(arm[:, 1], arm[:, 0]) / (2.0 * np.pi) + 0.5) * SECTORS).astype(int) % SECTORS
    return float(np.min(np.linalg.norm(arm, axis=1))) if len(np.unique(sectors)) == SECTORS else 0.0


def history(rows):
    """Column -> array (rows,) from the non-empty ``rows`` of :func:`largest`."""
    rows = [row for row in rows if row]
    return {name: np.array([row[name] for row in rows], dtype=float) for name in (rows[0] if rows else ())}


def track(files: Sequence, dim: int, rho0: float, *, first: bool = False) -> dict[str, np.ndarray]:
    """History of the bubbles of a run, with one row for each of its particle ``files`` that has vapour.

    ``dim`` and ``rho0`` are those of :func:`shapes`. With ``first`` only particles count that are vapour in the first
    file, so that bubbles that form later do not.

    Returns column -> array (rows,): ``t`` [s]; ``bubbles``, the number of bubbles of at least ``PIECE`` particles, and
    ``whole``, the number of particles in them; ``n`` and ``volume`` [m^dim] of all vapour; for the largest bubble
    ``n1``, ``volume1``, its centroid ``x1``, ``height1`` [m], ``mean_radius1``, ``width1``, ``tall1`` [m],
    ``occupied1`` [m^dim] and ``aspect1``; for the second largest ``n2``, ``x2`` and ``height2``, NaN if there is none.
    """
    uids = None
    if first:
        start = load_output(files[0])[0]["fluid"]
        uids = start.uid[start.phase == Phase.VAPOUR]
    return history(largest(arrays["fluid"], t, dim, rho0, uids) for arrays, t in map(load_output, files))


def fall(history: dict[str, np.ndarray]) -> float:
    """Largest step downwards [m] of the bubble of the start in a history from :func:`track`, until it has burst.

    It has burst when the largest bubble has less than half as many particles as at the start: what is left is a piece
    that came off, which is lower.
    """
    burst = np.flatnonzero(history["n1"] < 0.5 * history["n1"][0])
    height = history["height1"][:burst[0] if len(burst) else None]
    return float(np.max(-np.diff(height), initial=0.0))


def rise_speed(t: np.ndarray, height: np.ndarray, low: float, high: float) -> float:
    """Slope [m/s] of a straight line fitted to ``height`` [m] over time ``t`` [s] between the heights ``low`` and
    ``high`` [m]; NaN with fewer than three moments between them.
    """
    t, height = np.asarray(t), np.asarray(height)
    between = (height >= low) & (height <= high)
    return float(np.polyfit(t[between], height[between], 1)[0]) if np.count_nonzero(between) >= 3 else np.nan


def mendelson(radius: float, g: float = 9.81, sigma: float = 0.0, rho: float = 1.0) -> float:
    """Rise speed [m/s] of a bubble of equivalent ``radius`` [m] in a large still liquid, sqrt(g R + sigma/(rho R)).

    Source: H. D. Mendelson, AIChE J. 13, 1967. For large bubbles it agrees with the measurement of Davies & Taylor
    (1950), 0.71 sqrt(g d) with d = 2 R.   Limits   3-D bubbles of some millimetres and more, far from walls.
    """
    return float(np.sqrt(g * radius + sigma / (rho * radius)))


def pulsation(t: np.ndarray, values: np.ndarray, periods: ArrayLike) -> tuple[float, float, float]:
    """(relative amplitude, period [s], share) of the sine that fits ``values`` over time ``t`` [s] best.

    The period is one of ``periods`` [s]. A parabola is fitted together with the sine, so that growth does not count as
    pulsation; ``share`` [-] is the fraction of the variance about the parabola that the sine explains. NaN for fewer
    than eight values, or if they span less than one and a half of each of the periods.
    """
    t, values = np.asarray(t, dtype=float), np.asarray(values, dtype=float)
    periods = [period for period in np.atleast_1d(periods) if len(t) > 7 and np.ptp(t) >= 1.5 * period]
    if not periods:
        return np.nan, np.nan, np.nan
    s = (t - t.mean()) / np.ptp(t)
    trend = np.stack([np.ones_like(s), s, s**2], -1)
    fits = []
    around = np.sum((values - trend @ np.linalg.lstsq(trend, values, rcond=None)[0]) ** 2)
    for period in periods:
        angle = 2.0 * np.pi * t / period
        design = np.column_stack([trend, np.cos(angle), np.sin(angle)])
        solution = np.linalg.lstsq(design, values, rcond=None)[0]
        left = np.sum((values - design @ solution) ** 2)
        fits.append((left, float(np.hypot(*solution[3:])), float(period)))
    left, amplitude, period = min(fits, key=lambda fit: fit[0])
    return amplitude / float(values.mean()), period, 1.0 - float(left / around) if around > 0.0 else 0.0


def lasting(t: ArrayLike, holds: ArrayLike, least: float) -> float:
    """First time [s] from which ``holds`` (n,) stays true for at least ``least`` [s]; NaN if there is none."""
    t, holds = np.asarray(t), np.asarray(holds, dtype=bool)
    begin = None
    for moment, here in zip(t, holds):
        if not here:
            begin = None
            continue
        begin = moment if begin is None else begin
        if moment - begin >= least * (1.0 - 1e-9):
            return float(begin)
    return np.nan


@dataclass(frozen=True)
class Event:
    """A merger of two bubbles into one, or a split of one into several; ``t`` [s] is the first moment after it.

    ``before`` and ``after`` are numbers of vapour particles; ``satellites`` is how many of those after it are in pieces
    of fewer than ``PIECE`` particles. ``smaller`` is the number in the smaller of the two bubbles before a merger, or
    of the two largest ones after a split.
    """

    t: float
    before: int
    after: int
    satellites: int
    smaller: int

    @property
    def ratio(self) -> float:
        """Vapour after the event over vapour before it, by number of particles [-]."""
        return self.after / self.before


def merger(history: dict[str, np.ndarray]) -> Event | None:
    """The :class:`Event` in a history from :func:`track` by which two bubbles merged for good, or ``None``."""
    return _event(history, history["bubbles"] == 1, history["bubbles"] >= 2)


def split(history: dict[str, np.ndarray]) -> Event | None:
    """The :class:`Event` in a history from :func:`track` by which one bubble split, or ``None``."""
    return _event(history, history["bubbles"] >= 2, history["bubbles"] == 1)


def _event(history, new, old):
    """The lasting change from the state ``old`` (n,) to the state ``new`` (n,)."""
    t = history["t"]
    begin = int(np.argmax(old)) if np.any(old) else len(t)
    moment = lasting(t[begin:], new[begin:], LASTS)
    if np.isnan(moment):
        return None
    after = int(np.searchsorted(t, moment))
    before = int(np.flatnonzero(old[:after])[-1])
    apart = before if history["bubbles"][before] >= 2 else after
    n = history["n"].astype(int)
    return Event(float(moment), n[before], n[after], n[after] - int(history["whole"][after]),
                 int(history["n2"][apart]))

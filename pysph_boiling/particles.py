"""Particle arrays: the table of properties, and factories for fluids, vessels and nucleation sites.

Every array is an ordinary PySPH ``ParticleArray``. Every fluid array has the ``BASE_PROPERTIES``; each effect of
:mod:`pysph_boiling.schemes.effects` lists the properties it adds. Nothing else is allocated.

Example: a block of water in an open box in 2-D, heated in the middle of its floor.

>>> from pysph.base.kernels import CubicSpline
>>> from pysph_boiling.particles import box_vessel, fluid_block, site_array, sites_on_base
>>> corners = dict(lower=(0.0, 0.0, 0.0), upper=(0.1, 0.1, 0.0))
>>> water = fluid_block((0.0, 0.0, 0.0), (0.1, 0.05, 0.0), spacing=0.01, dim=2, rho0=958.0)
>>> wall = box_vessel(**corners, spacing=0.01, dim=2, rho0=958.0, kernel=CubicSpline(dim=2), heated_fraction=0.5)
>>> sites = site_array(sites_on_base(2, **corners, dim=2), reach=0.024, spacing=0.01)
>>> water.get_number_of_particles(), int(wall.heated.sum()), sites.get_number_of_particles()
(50, 4, 2)
>>> round(float(water.m.sum()), 6)  # kg per metre of depth: 0.1 m x 0.05 m x 958 kg/m^3
4.79
"""
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pysph.base.particle_array import ParticleArray
from pysph.base.utils import get_particle_array
from scipy.interpolate import CubicSpline as Spline
from scipy.spatial import cKDTree

from pysph_boiling.names import whole_number

__all__ = [
    "BASE_PROPERTIES", "NO_BUBBLE", "ROUGHNESS", "WALL_PROPERTIES", "TABLES", "Property", "add_properties",
    "akinci_volume",
    "box_vessel", "check_heaters", "cylinder_vessel", "fill", "fluid_array", "fluid_block", "host", "lattice_density",
    "portion", "positions", "rows", "site_array", "sites_on_base", "sites_on_disc", "surface_places", "vector",
    "wall_array", "weigh_walls",
]

ROUGHNESS = 0.3  # spacings: displacement of the particles of rough walls, at which a pool has no layers along them
MAX_JITTER = 0.45  # spacings; wall particles stay half a spacing from the face, less this
ROUGH_SHARE = 0.85  # of the Akinci mass; with it the level over rough walls is 0.2 % off in still water (2-D and 3-D)
SITES_APART = 0.7  # random sequential addition jams at 0.75 of a line (Renyi), and in a plane at 0.83 by this measure
CHUNK = 1 << 20  # places of a lattice that are looked at together
NEIGHBOUR_CHUNK = 1 << 15  # particles whose neighbours are looked at together
KERNEL_NODES = 3001  # of the spline through a kernel; those with knots at multiples of h are met to round-off
NO_BUBBLE = 4294967295  # largest uint32: label of a particle that belongs to no bubble; no uid reaches it


def host(pa: ParticleArray, name: str) -> np.ndarray:
    """A property of the real particles of one array, (n,), on the host."""
    if pa.gpu is not None:
        pa.gpu.pull(name)
    return pa.get(name, only_real_particles=True)


def positions(pa: ParticleArray) -> np.ndarray:
    """Positions (n, 3) [m] of the particles of an array."""
    return np.stack([pa.x, pa.y, pa.z], -1)


def fill(pa: ParticleArray, name: str, value: ArrayLike) -> None:
    """Set a property of all particles of one array to a number, on the host and on the device if there is one."""
    pa.get(name, only_real_particles=False)[:] = value  # on a device the host may not know yet which particles are real
    if pa.gpu is not None:
        pa.gpu.get_device_array(name).fill(value)


@dataclass(frozen=True)
class Property:
    """One row of the table of properties.

    ``kind`` is a PySPH type. ``state`` means that a restart needs the property; each step writes any other before it
    reads it, so that it does not even follow its particles when they are sorted in memory. ``cumulative`` means that it
    adds up since the start, so that the value of a removed particle is kept in the constant ``carried_<name>``.
    """

    name: str
    unit: str
    meaning: str
    kind: str = "double"
    state: bool = False
    cumulative: bool = False


def vector(names: str, unit: str, meaning: str, state: bool = False) -> tuple[Property, ...]:
    """The :class:`Property` of each component of a vector; ``names`` are separated by spaces."""
    return tuple(Property(name, unit, meaning, state=state) for name in names.split())


BASE_PROPERTIES = (
    Property("uid", "-", "identity of the particle, which never changes", "unsigned int", True),
    *vector("x y z", "m", "position; during a step the prediction x*", state=True),
    *vector("u v w", "m/s", "velocity", state=True),
    Property("m", "kg", "mass (kg per metre of depth in 2-D)", state=True),
    Property("h", "m", "smoothing length", state=True),
    Property("rho", "kg/m^3", "summed density", state=True),
)

WALL_PROPERTIES = (
    *vector("x y z", "m", "position", state=True),
    Property("m", "kg", "rest density times the Akinci volume of the boundary particle", state=True),
    Property("h", "m", "smoothing length", state=True),
    Property("rho", "kg/m^3", "rest density", state=True),
    Property("heated", "-", "1 where the wall is a heater", "int", True),
    Property("T_heater", "K", "temperature of this particle's heater; 0: that of the effect Heater"),
)

PYSPH_PROPERTIES = ("gid", "pid", "tag")  # PySPH's own bookkeeping, in every array
TABLES = ("room",)  # large constants that every start makes anew, so that particle files leave them out


def add_properties(pa: ParticleArray, properties: Iterable[Property]) -> None:
    """Add each :class:`Property` that ``pa`` lacks; those with ``state`` also become output properties.

    The array gets its own list of output properties, because PySPH's schemes share one list among several arrays.
    """
    for prop in properties:
        if prop.name not in pa.properties:
            pa.add_property(prop.name, type=prop.kind)
    states = [prop.name for prop in properties if prop.state]
    pa.set_output_arrays(list(dict.fromkeys([*pa.output_property_arrays, *states])))


def number(pa):
    """Give each particle a unique ``uid``, 0 .. n-1, unless they have unique ones already."""
    if "uid" not in pa.properties:
        pa.add_property("uid", type="unsigned int")
    if len(np.unique(pa.uid)) != len(pa.uid):
        pa.uid[:] = np.arange(len(pa.uid), dtype=np.uint32)


def portion(n: int, part: tuple[int, int]) -> slice:
    """The slice of ``n`` rows that is the k-th of ``part`` = (k, number) portions, in order and all of about one size.
    """
    k, number = part
    return slice(n * k // number, n * (k + 1) // number)


def rows(pa: ParticleArray, which: slice) -> ParticleArray:
    """A new array with the particles of ``pa`` in the slice ``which``, in the same order, and its constants."""
    made = pa.extract_particles(np.arange(pa.get_number_of_particles())[which])
    made.set_output_arrays(pa.output_property_arrays)
    return made


def _check_points(name, points, spacing):
    points = np.asarray(points, dtype=float)
    if not np.isfinite(spacing) or spacing <= 0.0:
        raise ValueError(f"spacing must be > 0 m, got {spacing} m")
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"positions of '{name}' must have shape (n, 3), got {points.shape}")
    if len(points) == 0:
        raise ValueError(f"particle array '{name}' is empty: it needs at least one particle")
    if not np.all(np.isfinite(points)):
        raise ValueError(f"positions of '{name}' hold NaN or Inf")
    return points


def _host_array(**values):
    """An array that the host owns until PySPH makes its neighbour search, so that edits before then reach a device."""
    pa = get_particle_array(**values)
    pa.set_device_helper(None)
    return pa


def fluid_array(points: ArrayLike, *, spacing: float, dim: int, rho0: float, hdx: float = 1.2,
                name: str = "fluid") -> ParticleArray:
    """A fluid array of equal particles at given positions.

    ``points`` (n, 3) [m] are the positions and ``spacing`` [m] their distance. The mass of each particle is
    rho0 spacing^dim [kg, or kg/m in 2-D], and its smoothing length is hdx spacing.

    Errors: ``ValueError`` for no points, points that are not finite, or a spacing or density that is not positive.
    """
    return _fluid(_check_points(name, points, spacing), 0, spacing=spacing, dim=dim, rho0=rho0, hdx=hdx, name=name)


def _fluid(points, first, *, spacing, dim, rho0, hdx, name):
    """A fluid array at positions (n, 3) [m], whose particles are numbered from ``first`` on."""
    if not rho0 > 0.0:
        raise ValueError(f"rho0 must be > 0 kg/m^3, got {rho0}")
    x, y, z = points.T
    pa = _host_array(name=name, x=x, y=y, z=z, **{prop: np.full(len(x), float(value)) for prop, value in (
        ("m", rho0 * spacing**dim), ("h", hdx * spacing), ("rho", rho0))})  # of an empty part, too
    pa.add_property("uid", type="unsigned int", data=np.arange(first, first + len(x), dtype=np.uint32))
    return pa


def fluid_block(lower: Sequence[float], upper: Sequence[float], *, spacing: float, dim: int, rho0: float,
                hdx: float = 1.2, name: str = "fluid", jitter: float = 0.0, seed: int = 0,
                inside: Callable[[np.ndarray], np.ndarray] | None = None,
                part: tuple[int, int] = (0, 1)) -> ParticleArray:
    """A fluid array on a cubic lattice that fills the box ``lower`` .. ``upper`` [m] (in 2-D only x and y count).

    ``jitter`` is the amplitude of a uniform random displacement, in spacings, drawn from ``seed``. If given,
    ``inside(points)`` takes the positions (n, 3) [m] and returns a mask (n,) of those to keep. ``part`` = (k, n) makes
    only the k-th of n parts of the lattice, whose particles have the places and the numbers (``uid``) that they have in
    the whole block; it may be empty.

    Errors: ``ValueError`` for a box without a particle, or a spacing or density that is not positive.
    """
    axes = [_lattice(lower[k], upper[k], spacing) for k in range(dim)]
    shape = tuple(map(len, axes))
    here = portion(int(np.prod(shape)), part)

    def lattice(first, last):
        points = np.zeros((last - first, 3))
        for k, index in enumerate(np.unravel_index(np.arange(first, last), shape)):
            points[:, k] = axes[k][index]
        return points if inside is None else points[inside(points)]

    points = lattice(here.start, here.stop)
    before = here.start if inside is None else sum(
        len(lattice(at, min(at + CHUNK, here.start))) for at in range(0, here.start, CHUNK))
    if jitter:
        random = np.random.default_rng(seed)
        random.bit_generator.advance(before * dim)  # type: ignore[attr-defined]  # one number each
        points[:, :dim] += jitter * spacing * random.uniform(-1.0, 1.0, (len(points), dim))
    if part[1] == 1:
        _check_points(name, points, spacing)
    return _fluid(points, before, spacing=spacing, dim=dim, rho0=rho0, hdx=hdx, name=name)


def _lattice(lower, upper, spacing):
    if not spacing > 0.0:
        raise ValueError(f"spacing must be > 0 m, got {spacing} m")
    n = int(round((upper - lower) / spacing))
    return lower + spacing * (np.arange(n) + 0.5)


def lattice_kernel(kernel, *, dim, hdx):
    """Places (n, 3), values (n,) and gradients (n, 3) of the kernel over the cubic lattice of unit spacing."""
    reach = int(np.ceil(kernel.radius_scale * hdx)) + 1
    places = np.zeros(((2 * reach + 1)**dim, 3))
    places[:, :dim] = np.array(list(np.ndindex(*(2 * reach + 1,) * dim))) - reach
    values, gradients = np.empty(len(places)), np.zeros_like(places)
    for r, gradient, i in zip(places, gradients, range(len(places))):
        distance = float(np.sqrt(r @ r))
        values[i] = kernel.kernel(xij=r, rij=distance, h=hdx)
        kernel.gradient(xij=r, rij=distance, h=hdx, grad=gradient)
    return places, values, gradients


def lattice_density(kernel: Any, *, dim: int, hdx: float) -> tuple[float, float]:
    """Sums over the infinite cubic lattice of unit spacing: ``sum V W`` [-] and ``sum V^2 |grad W|^2`` [1/spacing^2].

    The first is the summed density of the rest lattice in units of the rest density; the second scales the relaxation
    of the density constraint.
    """
    _, values, gradients = lattice_kernel(kernel, dim=dim, hdx=hdx)
    return float(values.sum()), float(np.sum(gradients**2))


def lattice_stiffness(kernel, *, dim, hdx, waves=21):
    """The largest ``|sum_j V grad W_j exp(i k x_j)|^2 / sum_j V^2 |grad W_j|^2`` [-] over waves k in the cubic lattice.

    It is the largest factor by which a sweep of the density constraint, without relaxation, reduces the density error
    of a wave; ``waves`` is the number of wave numbers from 0 to pi along each axis.
    """
    places, _, gradients = lattice_kernel(kernel, dim=dim, hdx=hdx)
    near = np.any(gradients != 0.0, axis=1)
    k = np.zeros((waves**dim, 3))
    k[:, :dim] = np.array(list(np.ndindex(*(waves,) * dim))) * np.pi / (waves - 1)
    sums = np.sin(k @ places[near].T) @ gradients[near]
    return float(np.max(np.sum(sums**2, axis=1)) / np.sum(gradients**2))


def akinci_volume(points: ArrayLike, kernel: Any, *, h: float, dim: int, domain: Any = None) -> np.ndarray:
    """Volumes 1 / sum_k W_bk [m^dim] of boundary particles (Akinci et al. 2012, eq. 4), shape (n,).

    The sum runs over the boundary particles only, including the particle itself. In a periodic domain, given as its
    ``DomainManager`` in ``domain``, it also includes their periodic images.
    """
    scaled = np.asarray(points, dtype=float) / h
    size = np.zeros(3)  # of the domain, 0 along an axis that is not periodic
    if domain is not None:
        manager = domain.manager
        for k, axis in enumerate("xyz"):
            if getattr(manager, f"periodic_in_{axis}"):
                first, last = (getattr(manager, f"{axis}{end}") / h for end in ("min", "max"))
                size[k] = last - first
                scaled[:, k] = np.mod(scaled[:, k] - first, size[k])
                scaled[scaled[:, k] >= size[k], k] = 0.0  # where the remainder was rounded up
    radii = np.linspace(0.0, kernel.radius_scale * (1.0 - 1e-12), KERNEL_NODES)  # a kernel may end with a step
    W = Spline(radii, [kernel.kernel(xij=[r * h, 0.0, 0.0], rij=r * h, h=h) for r in radii])
    tree, total = cKDTree(scaled, boxsize=size), np.zeros(len(scaled))
    for first in range(0, len(scaled), NEIGHBOUR_CHUNK):
        some = cKDTree(scaled[first:first + NEIGHBOUR_CHUNK], boxsize=size)
        pairs = some.sparse_distance_matrix(tree, kernel.radius_scale, output_type="ndarray")
        total[first:first + some.n] = np.bincount(pairs["i"], W(pairs["v"]), some.n)
    return 1.0 / total


def wall_array(points: ArrayLike, *, spacing: float, dim: int, rho0: float, kernel: Any, hdx: float = 1.2,
               name: str = "wall", heated: ArrayLike | None = None, T_heater: float | None = None, domain: Any = None,
               jitter: float = 0.0, seed: int = 0) -> ParticleArray:
    """An array of boundary particles with Akinci volumes; the mass of each is rho0 times its volume.

    In hydrostatic columns over two layers of wall particles, the first layer of fluid settles 0.46 (2-D) and 0.50
    (3-D) spacings from the face; the container is not needed to hold it.

    ``points`` (n, 3) [m] are the positions. ``heated`` (n,) is 1 where a particle belongs to a heater and 0 elsewhere.
    ``T_heater`` [K], a number or (n,), sets the temperature of individual heaters; where it is 0 or not given, a heater
    has the temperature of the effect ``Heater``. ``domain`` is the ``DomainManager`` of a periodic domain.

    Fluid packs in layers at a smooth wall. With ``jitter``, the amplitude of a uniform random displacement in spacings,
    drawn from ``seed``, the wall is rough, and the layers are weak. Such walls have 0.85 times their Akinci masses.
    These count one side only and so are 1.27 times that of a full packing, which holds the fluid off a wall that pushes
    too little; rough walls are for the effect ``WallMultipliers``, with which a wall does not.

    The volumes are summed over this array only. Before the first step the scheme corrects the masses
    (:func:`weigh_walls`) for other wall arrays, and for a periodic domain that was not given here.

    Errors: ``ValueError`` for values of another shape or out of range.
    """
    points = _check_points(name, points, spacing)
    if not 0.0 <= jitter <= MAX_JITTER:
        raise ValueError(f"jitter of the wall '{name}' must lie in [0, {MAX_JITTER}] spacings, got {jitter}")
    if jitter:
        points = points.copy()
        points[:, :dim] += jitter * spacing * np.random.default_rng(seed).uniform(-1.0, 1.0, (len(points), dim))
    h, share = hdx * spacing, ROUGH_SHARE if jitter else 1.0
    volume = share * akinci_volume(points, kernel, h=h, dim=dim, domain=domain)
    x, y, z = points.T
    pa = _host_array(name=name, x=x, y=y, z=z, m=rho0 * volume, h=h, rho=rho0)
    pa.add_property("heated", type="int")
    pa.add_property("T_heater")
    for prop, given in (("heated", heated), ("T_heater", T_heater)):
        if given is not None:
            given = np.asarray(given, dtype=float)
            if given.shape not in ((), x.shape):
                raise ValueError(f"{prop} of '{name}' must be a number or have shape {x.shape}, got {given.shape}")
            if prop == "heated":
                check_heaters(name, given)
            pa.get(prop)[:] = given
    check_heaters(name, pa.heated, pa.T_heater)
    return pa


def weigh_walls(walls: Sequence[ParticleArray], *, kernel: Any, dim: int, domain: Any = None) -> None:
    """Correct the masses of wall arrays for each other, and for a periodic ``domain`` (a ``DomainManager``).

    :func:`wall_array` sums volumes over one array only, so they are too large where two arrays meet, or at the border
    of a periodic domain that it did not know. Masses that it did not compute are kept, since the user has set them.
    Limits: only arrays of equal smoothing length are corrected, and no rough ones.
    """
    columns = [np.stack([pa.get(name, only_real_particles=True) for name in ("x", "y", "z", "h", "rho", "m")], -1)
               for pa in walls]
    ends, table = np.cumsum([len(rows) for rows in columns]), np.concatenate(columns)
    points, (h, rho, m) = table[:, :3], table[:, 3:].T
    if len(h) == 0 or np.ptp(h) > 0.0:
        return

    def masses(groups, domain):
        return rho * np.concatenate([akinci_volume(points[group], kernel, h=float(h[0]), dim=dim, domain=domain)
                                     for group in groups])

    whole, parts = [slice(None)], [slice(end - len(rows), end) for end, rows in zip(ends, columns) if len(rows)]
    domains = [None] if domain is None else [None, domain]
    ways = [(groups, within) for groups in ([parts, whole] if len(parts) > 1 else [whole]) for within in domains]
    right = masses(*ways.pop())
    known = np.any([np.abs(m - made) <= 1e-9 * made for made in (masses(*way) for way in ways)], axis=0)
    for pa, values in zip(walls, np.split(np.where(known, right, m), ends[:-1])):
        pa.get("m", only_real_particles=True)[:] = values


def check_heaters(name: str, heated: ArrayLike, T_heater: ArrayLike = 0.0, T_crit: float = np.inf) -> None:
    """Check ``heated`` (n,) and ``T_heater`` [K], a number or (n,), of the wall array ``name``.

    ``T_crit`` [K] is the critical temperature of the fluid. Errors: ``ValueError`` that names the first bad particle.
    """
    heated, T_heater = np.asarray(heated), np.asarray(T_heater, float)
    for prop, values, good, must in (
        ("heated", heated, np.isin(heated, (0, 1)),
         "must be 0 or 1; T_heater [K] sets the temperature of individual heaters"),
        ("T_heater", T_heater, (T_heater >= 0.0) & (T_heater < T_crit),
         f"must be below the critical point, {T_crit} K, and > 0 K, or 0 for the temperature of the effect Heater"),
    ):
        if not np.all(good):
            worst = int(np.argmin(good))
            raise ValueError(f"{prop} of wall particle {worst} of '{name}' {must}, got {np.ravel(values)[worst]:g}")


def box_vessel(lower: Sequence[float], upper: Sequence[float], *, spacing: float, dim: int, rho0: float, kernel: Any,
               hdx: float = 1.2, layers: int = 2, heated_fraction: float = 0.0, name: str = "wall", jitter: float = 0.0,
               seed: int = 0) -> ParticleArray:
    """Walls of an open box around ``lower`` .. ``upper`` [m]: a floor and sides, but no top.

    The middle of the floor's first layer, ``heated_fraction`` of its width, is a heater. With ``jitter`` the walls are
    rough, as :func:`wall_array` says.
    """
    layers = whole_number("layers", layers, low=1)
    lower, upper = np.asarray(lower, float)[:dim], np.asarray(upper, float)[:dim]
    counts = np.round((upper - lower) / spacing).astype(int)
    axes = [lower[k] + spacing * (np.arange(-layers, counts[k] + (layers if k < dim - 1 else 0)) + 0.5)
            for k in range(dim)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, dim)
    inside = np.all((grid > lower) & (grid < upper), axis=1)
    points = np.zeros((int((~inside).sum()), 3))
    points[:, :dim] = grid[~inside]
    up = dim - 1
    middle = 0.5 * (lower + upper)
    half_width = 0.5 * heated_fraction * (upper - lower)[:up] - 1e-6 * spacing  # a centre on the edge is outside
    near = np.abs(points[:, :up] - middle[:up]) < half_width
    top = (points[:, up] < lower[up]) & (points[:, up] > lower[up] - spacing)
    heated = np.all(near, axis=1) & top
    return wall_array(points, heated=heated, jitter=jitter, seed=seed, spacing=spacing, dim=dim, rho0=rho0,
                      kernel=kernel, hdx=hdx, name=name)


def cylinder_vessel(radius: float, height: float, *, spacing: float, rho0: float, kernel: Any, hdx: float = 1.2,
                    layers: int = 2, heated_fraction: float = 0.0, name: str = "wall", jitter: float = 0.0,
                    seed: int = 0) -> ParticleArray:
    """Walls of an upright open cylinder (3-D) of ``radius`` and ``height`` [m]: the axis is z, the floor at z = 0.

    The middle of the floor's first layer, ``heated_fraction`` of its diameter, is a heater. ``jitter`` and ``seed`` are
    those of :func:`wall_array`. In 2-D use :func:`box_vessel`, since the section of a cylinder is a box.
    """
    layers, points = whole_number("layers", layers, low=1), []
    for layer in range(layers):
        ring_radius = radius + (layer + 0.5) * spacing
        n = int(np.ceil(2.0 * np.pi * ring_radius / spacing))
        angle = 2.0 * np.pi * np.arange(n) / n
        for z in spacing * (np.arange(-layers, int(round(height / spacing))) + 0.5):
            points.append(np.stack([ring_radius * np.cos(angle), ring_radius * np.sin(angle), np.full(n, z)], -1))
    span = spacing * (np.arange(-int(radius / spacing) - 1, int(radius / spacing) + 1) + 0.5)
    floor = np.stack(np.meshgrid(span, span, indexing="ij"), -1).reshape(-1, 2)
    floor = floor[np.hypot(*floor.T) <= radius]
    for layer in range(layers):
        points.append(np.column_stack([floor, np.full(len(floor), -(layer + 0.5) * spacing)]))
    points = np.concatenate(points)
    heated = (points[:, 2] > -spacing) & (points[:, 2] < 0.0)
    heated &= np.hypot(points[:, 0], points[:, 1]) < heated_fraction * radius
    return wall_array(points, heated=heated, jitter=jitter, seed=seed, spacing=spacing, dim=3, rho0=rho0,
                      kernel=kernel, hdx=hdx, name=name)


def sites_on_base(count: int, *, lower: Sequence[float], upper: Sequence[float], dim: int, pattern: str = "regular",
                  seed: int = 0) -> np.ndarray:
    """Positions (count, 3) [m] of preset nucleation sites on the floor of the box ``lower`` .. ``upper`` [m].

    ``pattern="regular"`` spaces them evenly (in 3-D on the rows of a near-square grid). ``"random"`` draws them one
    after another from ``seed``, uniformly over the floor, and draws again what is nearer than ``SITES_APART`` mean
    distances to one that stands already (random sequential addition). The mean distance of n sites is sqrt(A/n) on a
    floor of area A, and in 2-D L/n on a floor of length L.
    """
    count = _check_sites(count, pattern)
    lower, upper = np.asarray(lower, float)[:dim], np.asarray(upper, float)[:dim]
    points = np.zeros((count, 3))
    points[:, dim - 1] = lower[dim - 1]
    if pattern == "random":
        points[:, :dim - 1] = _random_places(count, lower[:-1], upper[:-1], seed)
        return points
    rows = 1 if dim == 2 else int(np.floor(np.sqrt(count) + 1e-9))
    per_row = np.full(rows, count // rows)
    per_row[: count % rows] += 1
    unit = np.array([((i + 0.5) / n, (row + 0.5) / rows) for row, n in enumerate(per_row) for i in range(n)])
    points[:, 0] = lower[0] + unit[:, 0] * (upper - lower)[0]
    if dim == 3:
        points[:, 1] = lower[1] + unit[:, 1] * (upper - lower)[1]
    return points


def in_order(places):
    """Places of sites (n, 3) in the order in which sites are numbered: by their coordinates, x first."""
    return places[np.lexsort(places.T[::-1])]


def sites_on_disc(count: int, *, radius: float, pattern: str = "regular", seed: int = 0) -> np.ndarray:
    """Positions (count, 3) [m] of preset nucleation sites on a round floor of ``radius`` [m] about the origin (3-D).

    ``pattern="regular"`` puts them on a sunflower spiral, each on an equal part of the area (Vogel 1979); ``"random"``
    draws them as :func:`sites_on_base` does.
    """
    count = _check_sites(count, pattern)
    if not radius > 0.0:
        raise ValueError(f"the radius of the floor must be > 0 m, got {radius} m")
    points = np.zeros((count, 3))
    if pattern == "random":
        points[:, :2] = _random_places(count, np.full(2, -radius), np.full(2, radius), seed,
                                       lambda at: np.hypot(*at.T) < radius)
    else:
        number = np.arange(count)
        away, turn = radius * np.sqrt((number + 0.5) / count), number * np.pi * (3.0 - np.sqrt(5.0))
        points[:, :2] = np.column_stack([away * np.cos(turn), away * np.sin(turn)])
    return points


def surface_places(count: int, candidates: np.ndarray, *, dim: int, pattern: str = "regular",
                   seed: int = 0) -> np.ndarray:
    """``count`` of the ``candidates`` (n, 3) [m] on a surface, for nucleation sites.

    ``pattern="regular"`` takes the one farthest from those taken before, again and again, beginning where ``seed``
    says; ``"random"`` takes any that keep 0.7 mean distances to others. Errors: ``ValueError`` for fewer candidates.
    """
    count, random = _check_sites(count, pattern), np.random.default_rng(seed)
    if count > len(candidates):
        raise ValueError(f"{count} sites do not fit on the heaters, which have {len(candidates)} wall particles")
    order = random.permutation(len(candidates))
    if pattern == "random":
        area = len(candidates) * _spacing_of(candidates) ** (dim - 1)
        apart = SITES_APART * (area / count) ** (1.0 / (dim - 1))
        while True:  # a curved or ragged surface may have less room
            taken = []
            for place in candidates[order]:
                if all(np.linalg.norm(place - other) >= apart for other in taken):
                    taken.append(place)
                    if len(taken) == count:
                        return np.array(taken)
            apart *= 0.9
    taken = [order[0]]
    away = np.linalg.norm(candidates - candidates[order[0]], axis=1)
    while len(taken) < count:
        taken.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(candidates - candidates[taken[-1]], axis=1))
    return candidates[taken]


def _spacing_of(points):
    """Median distance of points to their nearest neighbour [m]."""
    return float(np.median(cKDTree(points).query(points, k=2)[0][:, 1])) if len(points) > 1 else 1.0


def _check_sites(count, pattern):
    if pattern not in ("regular", "random"):
        raise ValueError(f"pattern of sites must be 'regular' or 'random', got {pattern!r}")
    return whole_number("the number of nucleation sites", count, low=1)


def _random_places(count, lower, upper, seed, inside=None):
    """Random places (count, axes) [m] in the box ``lower`` .. ``upper`` (axes,), ``SITES_APART`` mean distances apart.

    If given, ``inside(places)`` is a mask of those to use, and the mean distance is that in the part of the box in it.
    """
    random, axes = np.random.default_rng(seed), len(lower)
    while True:  # a second time only if the first sites happened to leave no room for all
        drawn = random.uniform(lower, upper, (100 * count, axes))
        usable = drawn if inside is None else drawn[inside(drawn)]
        share = len(usable) / len(drawn)
        apart = SITES_APART * (share * np.prod(upper - lower) / count) ** (1.0 / axes)
        places = np.empty((0, axes))
        for place in usable:
            if np.all(np.linalg.norm(places - place, axis=1) >= apart):
                places = np.vstack([places, place])
                if len(places) == count:
                    return places


def site_array(points: ArrayLike, *, reach: float, spacing: float, activation: ArrayLike = 0.0,
               radius_scale: float = 2.0, name: str = "sites") -> ParticleArray:
    """An array of preset nucleation sites at ``points`` (n, 3) [m]; ``reach`` [m] is the largest radius of action.

    ``activation`` [K], a number or (n,), is the activation superheat: a site acts on liquid that is at least this much
    above saturation. It is 0 K for a site that is always active. :mod:`pysph_boiling.cavities` draws it for cavities.

    Errors: ``ValueError`` for a reach that is not positive, and for activation superheats of another shape, below 0 K
    or not finite.
    """
    points = _check_points(name, points, spacing)
    if not reach > 0.0:
        raise ValueError(f"reach of the sites must be > 0 m, got {reach} m")
    x, y, z = points.T
    activation = np.asarray(activation, dtype=float)
    if activation.shape not in ((), x.shape):
        raise ValueError(f"activation of '{name}' must be a number or have shape {x.shape}, got {activation.shape}")
    if not np.all((activation >= 0.0) & np.isfinite(activation)):
        raise ValueError(f"activation superheats of '{name}' must be finite and >= 0 K, got {activation}")
    pa = _host_array(name=name, x=x, y=y, z=z, h=reach / radius_scale, m=1.0)  # PySPH wants a mass; unused
    pa.add_property("activation")
    pa.activation[:] = activation
    return pa

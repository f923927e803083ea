"""Vessels from files: the inside of a closed surface mesh (STL, PLY, OBJ), checked, and its walls.

The mesh is the surface of the room that fluid may fill, not the glass or metal around it. It needs trimesh and rtree
(``pip install 'pysph_boiling[mesh]'``).
"""
import os
from functools import lru_cache

import numpy as np
from scipy.ndimage import label
from scipy.spatial import cKDTree

from pysph_boiling.extras import needed
from pysph_boiling.particles import wall_array
from pysph_boiling.rooms import CHUNK, Room, Shape, grid_around, wall_points

__all__ = ["mesh_room", "mesh_shape", "mesh_vessel", "patch_mask"]

NARROWEST = 3.0  # spacings between two walls that face each other: three particles side by side
THINNEST = 1.0  # spacings: thickness of a wall between two parts of the room that a grid of one spacing resolves
FACING = -0.8  # cosine between the normals of surfaces that face each other
CANDIDATES = 8  # triangles near a point among which the nearest one is looked for
NEAR, FAR = 4.0, 8.0  # spacings from the surface up to which distances are exact, and up to which they grow
MAX_SAMPLES = 20000  # of the surface, for widths
TOLD = 3  # places that a message names


def _trimesh():
    needed("rtree", "mesh")
    return needed("trimesh", "mesh")


def _places(points):
    told = ", ".join("({})".format(", ".join(f"{v:.4g}" for v in point)) for point in points[:TOLD])
    return told + (" and elsewhere" if len(points) > TOLD else "") + " m"


@lru_cache(maxsize=8)
def _loaded(path, scale, changed):
    trimesh = _trimesh()
    try:
        mesh = trimesh.load(path, force="mesh")
    except Exception as error:  # its readers raise anything
        raise ValueError(f"{path} is not a mesh that can be read: {error}") from error
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise ValueError(f"{path} holds no triangles")
    mesh.apply_scale(scale)
    if not np.all(np.isfinite(mesh.vertices)):
        raise ValueError(f"{path} has corners that are not finite")
    return mesh


def load_mesh(path, scale=1.0):
    """The ``trimesh.Trimesh`` in a file, in metres: its lengths times ``scale``. Raises ``ValueError`` or ``OSError``.
    """
    if not 0.0 < scale < np.inf:
        raise ValueError(f"the scale of a mesh must be > 0, got {scale}")
    path = os.fspath(path)
    return _loaded(path, float(scale), os.stat(path).st_mtime_ns)


def check_closed(mesh, path):
    """Raise ``ValueError`` that says where a mesh has a hole, or edges at which more than two faces meet."""
    if mesh.is_watertight:
        return
    edges, faces = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    for wrong, what in ((edges[faces == 1], "it has holes: {n} edges belong to one face only"),
                        (edges[faces > 2], "{n} edges belong to more than two faces")):
        if len(wrong):
            raise ValueError(f"the mesh {path} is not closed: {what.format(n=len(wrong))}, at "
                             f"{_places(mesh.vertices[wrong].mean(axis=1))}")
    raise ValueError(f"the mesh {path} is not closed")


def mesh_shape(path, *, spacing, scale=1.0):
    """The :class:`~pysph_boiling.rooms.Shape` inside a closed mesh.

    Distances are right to some hundredths of the particle ``spacing`` [m] up to four spacings from the surface, and
    roughly up to eight. Beyond they are eight spacings.

    Errors: ``ValueError`` for a mesh with holes, which names their places, and for a file that is no mesh.
    """
    mesh = load_mesh(path, scale)
    check_closed(mesh, path)
    grid_around(*mesh.bounds, spacing, 3, 1)  # is it of a reasonable size?
    trimesh = _trimesh()
    vertices, faces = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, max_edge=spacing, max_iter=30)
    triangles = vertices[faces]
    tree = cKDTree(triangles.mean(axis=1))
    near = min(CANDIDATES, len(triangles))

    def distance(points):
        found = np.minimum(tree.query(points, distance_upper_bound=FAR * spacing)[0], FAR * spacing)
        close = np.flatnonzero(found < NEAR * spacing)
        for some in np.array_split(close, 1 + len(close) * near // CHUNK):
            which = tree.query(points[some], k=near)[1].reshape(-1)
            feet = trimesh.triangles.closest_point(triangles[which], np.repeat(points[some], near, axis=0))
            found[some] = np.linalg.norm(feet.reshape(len(some), near, 3) - points[some, None], axis=2).min(axis=1)
        return np.where(mesh.contains(points), found, -found)

    return Shape(np.array(mesh.bounds[0]), np.array(mesh.bounds[1]), distance, lambda step: abs(mesh.volume))


def check_widths(mesh, spacing, path):
    """Raise ``ValueError`` where the inside is narrower, or a wall within it thinner, than particles resolve."""
    trimesh = _trimesh()
    number = int(np.clip(mesh.area / spacing**2, 200, MAX_SAMPLES))
    points, face = trimesh.sample.sample_surface(mesh, number, seed=0)
    normals, small = mesh.face_normals[face], 1e-4 * spacing
    for sign, least, what in (
        (-1.0, NARROWEST, "the inside of the mesh {path} is {w:.3g} m wide at {place}, and {least:g} spacings of {s:g} "
         "m must fit in: use a smaller spacing. The mesh must be the surface of the inside of a vessel, not of its "
         "solid walls"),
        (1.0, THINNEST, "the wall of the mesh {path} is {w:.3g} m thick at {place}, and must be {least:g} spacing of "
         "{s:g} m at least: use a smaller spacing"),
    ):
        hits, ray, hit = mesh.ray.intersects_location(points + sign * small * normals, sign * normals,
                                                      multiple_hits=False)
        width = np.linalg.norm(hits - points[ray], axis=1)
        faces_us = np.sum(normals[ray] * mesh.face_normals[hit], axis=1) < FACING
        close = np.flatnonzero(faces_us & (width < least * spacing) & (width > 2.0 * small))
        if len(close):
            worst = close[np.argsort(width[close])]
            middle = 0.5 * (hits[worst] + points[ray[worst]])
            raise ValueError(what.format(path=path, w=width[worst[0]], place=_places(middle[:1]), least=least,
                                         s=spacing))


@lru_cache(maxsize=4)
def _room(path, scale, spacing, layers, changed):
    mesh = load_mesh(path, scale)
    check_closed(mesh, path)
    if min(mesh.extents) < NARROWEST * spacing:
        raise ValueError(f"the mesh {path} is {' x '.join(f'{v:.3g}' for v in mesh.extents)} m large, less than "
                         f"{NARROWEST:g} spacings of {spacing:g} m: is it in metres?")
    check_widths(mesh, spacing, path)
    shape = mesh_shape(path, spacing=spacing, scale=scale)
    room = Room.of(shape, spacing=spacing, layers=layers)
    parts, number = label(room.values > 0.0)
    if number != 1:
        sizes = np.bincount(parts.ravel())[1:]
        place = room.origin + spacing * np.argwhere(parts == 1 + np.argmin(sizes))[0]
        raise ValueError(f"the inside of the mesh {path} has {number} parts that are not connected at a spacing of "
                         f"{spacing:g} m; the smallest one is at {_places([place])}")
    return room


def mesh_room(path, *, spacing, scale=1.0, layers=2):
    """The :class:`~pysph_boiling.rooms.Room` inside a closed mesh, for a container, fluid and walls.

    ``path`` is a file that trimesh reads (STL, PLY, OBJ, ...), whose lengths times ``scale`` are metres; ``spacing``
    [m] is that of the particles. The last rooms are kept, so that asking again costs nothing.

    Errors: ``ValueError`` that names the place of holes, of an inside that is too narrow, of walls that are too thin,
    and of parts that are not connected; ``ModuleNotFoundError`` without trimesh and rtree.
    """
    path = os.fspath(path)
    return _room(path, float(scale), float(spacing), layers, os.stat(path).st_mtime_ns)


def patch_mask(path, points, *, spacing, scale=1.0):
    """Mask (n,) of positions (n, 3) [m] that lie within a ``spacing`` [m] of the surface in a file, open or closed."""
    mesh, trimesh = load_mesh(path, scale), _trimesh()
    vertices, faces = trimesh.remesh.subdivide_to_size(mesh.vertices, mesh.faces, max_edge=0.5 * spacing, max_iter=30)
    return cKDTree(vertices).query(points, distance_upper_bound=spacing)[0] <= spacing


def mesh_vessel(path, *, spacing, rho0, kernel, hdx=1.2, layers=2, heated=None, scale=1.0, name="wall", jitter=0.0,
                seed=0):
    """Walls around the inside of a closed mesh (3-D): an array of boundary particles with Akinci volumes.

    ``path``, ``scale`` and errors are those of :func:`mesh_room`. Of the first of the ``layers``, ``heated`` says which
    particles are heaters: a function of their positions (n, 3) [m] that returns a mask (n,), or the path of a mesh of a
    patch, with the same scale, to which they are within a spacing. The others are those of
    :func:`~pysph_boiling.particles.wall_array`. All of the surface has walls, so the mesh needs a cover above the
    surface of the liquid.
    """
    room = mesh_room(path, spacing=spacing, scale=scale, layers=layers)
    points = wall_points(room, spacing=spacing, layers=layers)
    hot = np.zeros(len(points), bool)
    if heated is not None:
        first = np.flatnonzero(room(points) > -spacing)
        hot[first] = (heated(points[first]) if callable(heated) else
                      patch_mask(heated, points[first], spacing=spacing, scale=scale))
    return wall_array(points, heated=hot, jitter=jitter, seed=seed, spacing=spacing, dim=3, rho0=rho0, kernel=kernel,
                      hdx=hdx, name=name)

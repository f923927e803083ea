"""A rendered view of a 3-D state: clear water with its surface reconstructed, bubbles and drops, in a vessel of glass.

pysplashsurf reconstructs the surfaces as smoothed level sets of the particles' density. Embree follows the rays of
light through them (:mod:`pysph_boiling.analysis.tracing`). Neither a display nor OpenGL is needed.
"""
import ctypes
import os
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from pysph.base.particle_array import ParticleArray
from scipy.spatial import cKDTree

from pysph_boiling.analysis.drawing import (
    INK,
    bubble_colours,
    by_role,
    have_all,
    inner_bounds,
    is_vapour,
    joined,
    needed,
    plan_outline,
    positions,
    to_rgb,
    view_bounds,
    wall_colours,
)
from pysph_boiling.analysis.drops import LINK, pieces
from pysph_boiling.analysis.tracing import SOLID, VAPOUR, VESSEL, WATER, Surface, World, trace
from pysph_boiling.names import nearest

__all__ = ["CAMERAS", "camera_angles", "check_surface", "closed_meshes", "draw_surface", "surface_missing"]

CAMERAS = {"corner": (-62.0, 18.0), "front": (-90.0, 8.0), "above": (-62.0, 48.0), "low": (-75.0, 3.0)}  # [degrees]
LENS = 24.0  # angle of view [degrees]
ROOM = 0.88  # share of the picture that the vessel fills
LOWER = 0.02  # share of the picture's height by which the vessel is below the middle, to make room for the text

ZENITH, HORIZON = "#BFCBD6", "#F4F6F7"  # of the room, by height
TABLE = "#E3DFD9", "#D3CDC4"  # its tiles
ABSORPTION = np.array([0.32, 0.08, 0.05])  # [-] along the edge of a cube with the volume of the water
HAZE, BODY = 0.05, "#BFE6F2"  # the same for what water scatters; the colour of that
BASE, HOT, SITE, EDGE = "#8E959C", "#CB6E43", "#4A2B20", "#A9B2BB"
LIGHT = np.array([-0.45, -0.35, 0.82]) / np.linalg.norm([-0.45, -0.35, 0.82])  # towards the lamp

MODULES = ("pysplashsurf", "embreex", "PIL.Image")  # of the extra "view"
BASE_HEIGHT = 2.0  # of the slab below the vessel, in spacings
CUBE = 0.9  # edge of the cubes of the level set, in radii of a particle
NEAR = 8  # particles from which a point of a mesh takes its velocity
DROP = 12  # pieces of the water of at most so many particles are drops
LEAST = 0.02  # share of its volume that a smoothed surface keeps at least; 15 particles keep 0.08
LAMP = 1.5  # brightness of the lamp
PAINT = 0.65  # share of light that the coat of a coloured bubble keeps
CONTRAST = 0.04  # pixels that differ by more from their neighbours get SAMPLES rays instead of one
SAMPLES = np.array([[-0.375, -0.125], [0.125, -0.375], [0.375, 0.125], [-0.125, 0.375]])  # [pixel] from the middle


def camera_angles(camera: str) -> tuple[float, float, float]:
    """(azimuth, elevation, zoom) of a camera: one of :data:`CAMERAS`, or "AZIMUTH,ELEVATION[,ZOOM]" in degrees.

    An azimuth of -90 looks along y; at an elevation of 90 the eye is above the vessel. A zoom of 2 shows the middle
    twice as large. Errors: ``ValueError`` for another name, an elevation outside 0 .. 90 and a zoom <= 0.
    """
    if camera in CAMERAS:
        return (*CAMERAS[camera], 1.0)
    try:
        angles = [float(part) for part in str(camera).split(",")]
    except ValueError:
        angles = []
    if len(angles) not in (2, 3) or not np.all(np.isfinite(angles)):
        raise ValueError(f"camera must be one of {', '.join(CAMERAS)}, or AZIMUTH,ELEVATION[,ZOOM] in degrees, got "
                         f"{camera!r}{nearest(camera, CAMERAS)}")
    azimuth, elevation, zoom = (*angles, 1.0)[:3]
    if not 0.0 <= elevation <= 90.0:
        raise ValueError(f"the camera's elevation must lie in 0 .. 90 degrees, got {elevation:g}")
    if not zoom > 0.0:
        raise ValueError(f"the camera's zoom must be > 0, got {zoom:g}")
    return azimuth, elevation, zoom


def check_surface(dim, colour=None, camera="corner"):
    """Raise the errors of :func:`draw_surface` before anything is drawn."""
    if dim != 3:
        raise ValueError(f"the surface view needs three dimensions, but this scene has {dim}")
    if colour not in (None, "bubble"):
        raise ValueError(f"in the surface view colour must be 'bubble' or left out, got {colour!r}")
    camera_angles(camera)
    for name in MODULES:
        needed(name)


def surface_missing():
    """How to install what the surface view needs, if a package is missing; otherwise an empty text."""
    try:
        for name in MODULES:
            needed(name)
    except ModuleNotFoundError as error:
        return str(error)
    return ""


def draw_surface(arrays: dict[str, ParticleArray], path: str | os.PathLike, *, dim: int, spacing: float,
                 t: float | None = None, title: str | None = None, bounds: np.ndarray | None = None,
                 colour: str | None = None, size: tuple[int, int] = (1280, 960), camera: str = "corner") -> Path:
    """Render the state of one moment to a PNG file; returns its path.

    Parameters
    ----------
    arrays, dim, spacing, t, title, bounds : as :func:`~pysph_boiling.analysis.rendering.draw_scene`; ``dim`` must be 3
    colour : str      "bubble" gives every bubble the colour of its label; if not given, all bubbles are clear.
    size : (2,)       Width and height of the picture [pixel].
    camera : str      As :func:`camera_angles`.

    Errors: ``ValueError`` for 2-D, an unknown colour or camera and a scene without fluid; ``ModuleNotFoundError`` if
    embreex or pysplashsurf is not installed.
    """
    check_surface(dim, colour, camera)
    if not spacing > 0.0:
        raise ValueError(f"spacing must be > 0 m, got {spacing} m")
    scene = by_role(arrays)
    bounds = view_bounds(scene, spacing, dim) if bounds is None else np.asarray(bounds, dtype=float)
    fluid, vessel = _fluid(scene, bounds), _vessel(scene, bounds, spacing)
    eye = _camera(np.array([vessel.box[0] - [0.0, 0.0, BASE_HEIGHT * spacing], vessel.box[1]]), size, camera)
    surfaces = [*_water(fluid, spacing, vessel), *_bubbles(fluid, spacing, colour), *_walls(scene, vessel, spacing)]
    unit = np.cbrt(max(len(fluid.points), 1)) * spacing
    light = dict(absorption=ABSORPTION / unit, haze=HAZE / unit, body=to_rgb(BODY), gap=1e-4 * spacing)
    picture = _picture(World(surfaces), eye, size, _room(vessel, spacing), light)
    _save(picture, path, "   ".join(part for part in (title, "" if t is None else f"t = {t:.3f} s") if part))
    return Path(path)


def closed_meshes(arrays, *, spacing, bounds=None):
    """Closed triangle meshes of the water and of the bubbles in it at one moment, cut off at the walls of the vessel.

    Returns ``water`` and ``bubbles``, each with ``points`` (n, 3) [m], ``triangles`` (m, 3) of indices with normals
    outwards, ``velocity`` (n, 3) [m/s] of the particles near each point, and ``label`` (n,), the label of each point's
    bubble, or ``None`` in the water. The water's mesh encloses the bubbles: it has no holes for them. The mesh of a
    bubble encloses the volume of its particles, less what the walls cut off.

    Parameters are those of :func:`draw_surface`. Errors: ``ValueError`` for a scene without fluid;
    ``ModuleNotFoundError`` if pysplashsurf or manifold3d is not installed.
    """
    scene = by_role(arrays)
    bounds = view_bounds(scene, spacing, 3) if bounds is None else np.asarray(bounds, dtype=float)
    fluid, vessel = _fluid(scene, bounds), _vessel(scene, bounds, spacing)
    inside = _inside(vessel)
    pool, drops = _water_meshes(fluid, spacing, vessel)
    labels, bubbles = _bubble_meshes(fluid, spacing)
    everywhere = np.ones(len(fluid.points), bool)
    water = _indexed([(mesh, everywhere) for mesh in [*(_cut(mesh, inside) for mesh in pool), *drops]], fluid, spacing)
    vapour = _indexed([(_cut(mesh, inside), fluid.vapour & (fluid.label == label))
                       for label, mesh in zip(labels, bubbles)], fluid, spacing)
    label = np.repeat(labels, vapour.pop("counts")).astype(np.int64)
    water.pop("counts")
    return SimpleNamespace(water=SimpleNamespace(**water, label=None),
                           bubbles=SimpleNamespace(**vapour, label=label))


def _inside(vessel):
    """The space between the walls as a solid of manifold3d, endless where there is no wall; ``None`` without walls."""
    if not vessel.there:
        return None
    manifold = needed("manifold3d", "film")
    far = 10.0 * np.ptp(vessel.box, axis=0).max() * np.array([[-1.0], [1.0]])
    low, high = np.where(vessel.walled, vessel.box, vessel.box + far)
    outline = vessel.outline if vessel.radius is not None else np.array(
        [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])
    return manifold.Manifold.extrude(manifold.CrossSection([outline]), high[2] - low[2]).translate((0.0, 0.0, low[2]))


def _cut(mesh, inside):
    """The part of a closed mesh within the solid; the whole mesh if there is no solid, or if nothing would be left."""
    if inside is None:
        return mesh
    manifold = needed("manifold3d", "film")
    used, corners = np.unique(mesh.triangles, return_inverse=True)
    solid = manifold.Manifold(manifold.Mesh(mesh.points[used].astype(np.float32),
                                            corners.reshape(-1, 3).astype(np.uint32)))
    part = (solid ^ inside).to_mesh()
    if not len(part.tri_verts):
        return mesh
    return SimpleNamespace(points=np.array(part.vert_properties[:, :3], dtype=float),
                           triangles=np.array(part.tri_verts, dtype=np.int64))


def _indexed(parts, fluid, spacing):
    """One mesh of ``parts``: (mesh, mask (n,) of the particles that give it their velocity).

    Returns a dict with ``points``, ``triangles``, ``velocity``, and ``counts``, the number of points of each part.
    """
    points, triangles, velocity, begin = [np.empty((0, 3))], [np.empty((0, 3), int)], [np.empty((0, 3))], 0
    for mesh, own in parts:
        used, corners = np.unique(mesh.triangles, return_inverse=True)
        points.append(mesh.points[used])
        triangles.append(corners.reshape(-1, 3) + begin)
        velocity.append(_velocity(points[-1], fluid.points[own], fluid.velocity[own], spacing))
        begin += len(used)
    return dict(points=np.concatenate(points), triangles=np.concatenate(triangles),
                velocity=np.concatenate(velocity), counts=[len(part) for part in points[1:]])


def _velocity(points, places, velocity, spacing):
    """Velocity (n, 3) at points (n, 3): the mean over the nearest particles, of which nearer ones count more."""
    distance, near = cKDTree(places).query(points, k=range(1, min(NEAR, len(places)) + 1))
    weight = 1.0 / (distance**2 + (0.5 * spacing)**2)
    return np.einsum("nk,nki->ni", weight / weight.sum(axis=1, keepdims=True), velocity[near])


def _fluid(scene, bounds):
    """Positions (n, 3), phase, bubble, swell and velocity (n, 3) of the fluid, without particles far out of bounds."""
    points = positions(scene.fluid)
    near = np.all(np.abs(points - bounds.mean(axis=0)) <= 1.5 * np.ptp(bounds, axis=0), axis=1)
    label, swell = (joined(scene.fluid, name) if have_all(scene.fluid, name) else np.full(len(points), default)
                    for name, default in (("bubble", 0), ("swell", 1.0)))
    velocity = joined(scene.fluid, *"uvw") if have_all(scene.fluid, *"uvw") else np.zeros_like(points)
    return SimpleNamespace(points=points[near], vapour=is_vapour(scene.fluid)[near], label=label[near],
                           swell=swell[near], velocity=velocity[near])


# Surfaces: points (n, 3) [m], unit normals (n, 3) outwards, triangles (m, 3)

def _reconstruct(points, spacing):
    """Closed surface around particles (n, 3), without the inner surfaces of hollows."""
    mesh, _ = needed("pysplashsurf").reconstruction_pipeline(
        np.ascontiguousarray(points), particle_radius=0.5 * spacing, smoothing_length=3.0, cube_size=CUBE,
        iso_surface_threshold=0.6, mesh_smoothing_weights=True, mesh_smoothing_iters=10, mesh_cleanup=True,
        compute_normals=True, normals_smoothing_iters=10, multi_threading=False)
    points, triangles = np.array(mesh.mesh.vertices), np.array(mesh.mesh.triangles, dtype=np.int64)
    piece = _pieces(triangles, len(points))
    volume = np.bincount(piece[triangles[:, 0]], _volumes(points, triangles), minlength=len(points))
    outer = volume[piece[triangles[:, 0]]] > 0.0  # the surface of a hollow has a negative volume
    return SimpleNamespace(points=points, normals=np.array(mesh.point_attributes["normals"]), piece=piece,
                           triangles=triangles[outer])


def _pieces(triangles, n):
    """Connected piece (n,) of each vertex: the least index in it."""
    piece = np.arange(n)
    while True:
        new, least = piece.copy(), piece[triangles].min(axis=1)
        for k in range(3):
            np.minimum.at(new, triangles[:, k], least)
        new = new[new]
        if np.array_equal(new, piece):
            return piece
        piece = new


def _volumes(points, triangles):
    """Signed volumes (m,) [m^3] between triangles and the origin; their sum is the volume of a closed mesh."""
    a, b, c = points[triangles].transpose(1, 0, 2)
    return np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0


def _water(fluid, spacing, vessel):
    """The surfaces of the pool and of its drops."""
    return [_joined(WATER, meshes) for meshes in _water_meshes(fluid, spacing, vessel) if meshes]


def _water_meshes(fluid, spacing, vessel):
    """Lists of meshes: that of the pool, which is empty in a dry vessel, and those of its drops.

    Particles are mirrored at the walls, so that the surface meets the walls naturally; the vessel cuts off the rest.
    """
    points = fluid.points
    if not len(points):
        return [], []
    piece, sizes = pieces(points, LINK * spacing)
    pool = sizes[piece] > DROP
    drops = [_blob(points[piece == k], sizes[k] * spacing**3) for k in np.unique(piece[~pool])]
    return [_reconstruct(_mirrored(points[pool], spacing, vessel), spacing)] if pool.any() else [], drops


def _mirrored(points, spacing, vessel):
    """The points (n, 3) and the mirror images of those near a wall."""
    reach = 1.6 * spacing
    if vessel.radius is not None:
        away = points[:, :2] - vessel.axis
        r = np.linalg.norm(away, axis=1)
        near = r > vessel.radius - reach
        image = points[near].copy()
        image[:, :2] = vessel.axis + away[near] * (2.0 * vessel.radius / r[near] - 1.0)[:, None]
        points = np.concatenate([points, image])
    for k in range(3) if vessel.radius is None else (2,):
        for end, sign in ((0, 1.0), (1, -1.0)):
            if vessel.walled[end, k]:
                near = sign * (points[:, k] - vessel.box[end, k]) < reach
                image = points[near].copy()
                image[:, k] = 2.0 * vessel.box[end, k] - image[:, k]
                points = np.concatenate([points, image])
    return points


def _bubbles(fluid, spacing, colour):
    """The surface of all bubbles, with a coat of paint if they are to be coloured."""
    labels, meshes = _bubble_meshes(fluid, spacing)
    if not meshes:
        return []
    paint = None
    if colour == "bubble":
        coat = np.column_stack([bubble_colours(labels), np.full(len(labels), PAINT)])
        paint = np.repeat(coat, [len(mesh.triangles) for mesh in meshes], axis=0)
    return [_joined(VAPOUR, meshes, paint)]


def _bubble_meshes(fluid, spacing):
    """The labels (bubbles,) of all bubbles and the list of their meshes."""
    labels = np.unique(fluid.label[fluid.vapour])
    own = [fluid.vapour & (fluid.label == label) for label in labels]
    return labels, [_blob(fluid.points[one], fluid.swell[one].sum() * spacing**3) for one in own]


def _blob(points, volume):
    """Surface around particles (n, 3) that encloses a given volume [m^3]; a lone particle is a ball.

    Smoothing shrinks the surface, so each of its pieces is scaled up again about its centre.
    """
    if len(points) == 1:
        return _ball(points[0], volume)
    mesh = _reconstruct(points, np.cbrt(volume / len(points)))
    count = np.maximum(np.bincount(mesh.piece, minlength=len(mesh.points)), 1)
    centre = np.column_stack([np.bincount(mesh.piece, x, minlength=len(count)) / count for x in mesh.points.T])
    centre = centre[mesh.piece]
    grown = np.cbrt(volume / max(_volumes(mesh.points, mesh.triangles).sum(), LEAST * volume))
    mesh.points = centre + grown * (mesh.points - centre)
    return mesh


def _ball(centre, volume, rings=8):
    """A ball of a given volume [m^3] about ``centre`` (3,), as triangles between ``rings`` circles of latitude."""
    sides = 2 * rings
    polar, turn = np.meshgrid(np.pi * np.arange(1, rings) / rings, 2.0 * np.pi * np.arange(sides) / sides,
                              indexing="ij")
    normals = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], -1).reshape(-1, 3)
    normals = np.concatenate([normals, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]])
    here = np.arange((rings - 1) * sides).reshape(rings - 1, sides)
    right = np.roll(here, -1, axis=1)
    top, bottom = np.full(sides, len(normals) - 2), np.full(sides, len(normals) - 1)
    triangles = np.concatenate([
        np.stack([top, here[0], right[0]], -1), np.stack([bottom, right[-1], here[-1]], -1),
        *(np.stack(corners, -1).reshape(-1, 3) for corners in (
            (here[:-1], here[1:], right[:-1]), (right[:-1], here[1:], right[1:])))])
    radius = np.cbrt(volume / _volumes(normals, triangles).sum())
    return SimpleNamespace(points=centre + radius * normals, normals=normals, triangles=triangles)


def _joined(kind, meshes, paint=None):
    """One surface of several meshes, with their own normals."""
    return Surface(kind, np.concatenate([mesh.points[mesh.triangles] for mesh in meshes]),
                   np.concatenate([mesh.normals[mesh.triangles] for mesh in meshes]), paint=paint)


# The vessel and the room

def _vessel(scene, bounds, spacing):
    """``box`` (2, 3) [m] around the inside, which of its faces are ``walled`` (2, 3), and its ``outline`` (n, 2).

    ``axis`` (2,) and ``radius`` [m] are those of a round vessel; the radius is ``None`` for another.
    """
    box = inner_bounds(scene.walls, bounds, spacing)
    outline = plan_outline(scene, box)
    return SimpleNamespace(box=box, walled=box != bounds, outline=outline, there=bool(scene.walls),
                           axis=box[:, :2].mean(axis=0),
                           radius=0.5 * np.ptp(box[:, 0]) if len(outline) > 4 else None)


def _walls(scene, vessel, spacing):
    """The inside of the vessel, the base with heater and sites, and its edges; nothing if the scene has no walls."""
    if not vessel.there:
        return []
    low, high = vessel.box[:, 2]
    foot, gap = low - BASE_HEIGHT * spacing, 0.02 * spacing  # the base is above the bottom of the water
    inside = _prism(vessel, vessel.outline, low - gap, high)
    base = _prism(vessel, vessel.axis + (vessel.outline - vessel.axis) * 1.02, foot, low + gap)
    edge = 0.004 * np.linalg.norm(np.ptp(vessel.box, axis=0))
    rods = [_rod(np.column_stack([vessel.outline, np.full(len(vessel.outline), high)]), edge, closed=True)]
    if vessel.radius is None:
        rods += [_rod(np.array([[*corner, low], [*corner, high]]), edge) for corner in vessel.outline]
    frame = [np.concatenate(parts) for parts in zip(*rods)]
    return [Surface(VESSEL, *inside), Surface(SOLID, *base, shade=_base(scene, spacing)),
            Surface(SOLID, *frame, shade=lambda points, normals: _lit(to_rgb(EDGE), normals))]


def _prism(vessel, outline, low, high):
    """Corners and normals (m, 3, 3) of an upright prism; those of a round one are smooth."""
    n = len(outline)
    ahead = np.roll(outline, -1, axis=0)
    bottom, top = (np.full((n, 1), z) for z in (low, high))
    a, b = np.hstack([outline, bottom]), np.hstack([ahead, bottom])
    c, d = np.hstack([ahead, top]), np.hstack([outline, top])
    sides = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    if vessel.radius is None:
        along = ahead - outline
        flat = np.column_stack([along[:, 1], -along[:, 0], np.zeros(n)]) / np.linalg.norm(along, axis=1)[:, None]
        normals = np.repeat(np.concatenate([flat, flat])[:, None], 3, axis=1)
    else:
        normals = (sides - [*vessel.axis, 0.0]) * [1.0, 1.0, 0.0]
        normals /= np.linalg.norm(normals, axis=2)[:, :, None]
    middle = outline.mean(axis=0)
    lids = np.concatenate([np.stack([np.tile([*middle, high], (n, 1)), d, c], 1),
                           np.stack([np.tile([*middle, low], (n, 1)), b, a], 1)])
    upright = np.repeat([1.0, -1.0], n)[:, None, None] * np.array([0.0, 0.0, 1.0])
    return np.concatenate([sides, lids]), np.concatenate([normals, np.broadcast_to(upright, lids.shape)])


def _rod(line, radius, closed=False, sides=8):
    """Corners and normals (m, 3, 3) of a rod along a ``line`` (n, 3) of points, which may be closed."""
    turn = 2.0 * np.pi * np.arange(sides) / sides
    parts = []
    for a, b in zip(line, np.roll(line, -1, axis=0) if closed else line[1:]):
        along = (b - a) / np.linalg.norm(b - a)
        across = np.cross(along, [1.0, 0.0, 0.0] if abs(along[2]) > 0.5 else [0.0, 0.0, 1.0])
        across /= np.linalg.norm(across)
        ring = np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * np.cross(along, across)
        here, right = ring, np.roll(ring, -1, axis=0)
        for first, second, third in (((a, here), (b, right), (a, right)), ((a, here), (b, here), (b, right))):
            normals = np.stack([first[1], second[1], third[1]], 1)
            parts.append((np.stack([first[0] + radius * first[1], second[0] + radius * second[1],
                                    third[0] + radius * third[1]], 1), normals))
    return tuple(np.concatenate(part) for part in zip(*parts))


def _base(scene, spacing):
    """The colours of the base: its heater glows, and its sites are dark."""
    hot = positions(scene.walls)[wall_colours(scene.walls)[1]]
    heater = cKDTree(hot[:, :2]) if len(hot) else None
    sites = cKDTree(positions(scene.sites)[:, :2]) if scene.sites else None

    def shade(points, normals):
        colour = np.tile(to_rgb(BASE), (len(points), 1))
        on_top = normals[:, 2] > 0.5
        place = points[on_top, :2]
        if heater is not None:
            near = heater.query(place, distance_upper_bound=2.0 * spacing)[0] / spacing
            colour[on_top] = _mix(colour[on_top], to_rgb(HOT), np.clip(1.5 - near, 0.0, 1.0)[:, None])
        if sites is not None:
            near = sites.query(place, distance_upper_bound=spacing)[0] < 0.4 * spacing
            colour[np.flatnonzero(on_top)[near]] = to_rgb(SITE)
        return _lit(colour, normals)

    return shade


def _lit(colour, normals):
    """Colours (n, 3) of a dull solid, brighter the more it faces the lamp."""
    return colour * (0.62 + 0.43 * np.clip(normals @ LIGHT, 0.0, 1.0))[:, None]


def _room(vessel, spacing):
    """A function of points and directions (n, 3) that returns the colours (n, 3) of a room: a tiled table, lamps."""
    box, size = vessel.box, np.linalg.norm(np.ptp(vessel.box, axis=0))
    foot, middle = box[0, 2] - BASE_HEIGHT * spacing, box.mean(axis=0)
    half, tile = 0.5 * np.ptp(box[:, :2], axis=0), 0.16 * size
    light, dark = (to_rgb(colour) for colour in TABLE)
    zenith, horizon = to_rgb(ZENITH), to_rgb(HORIZON)

    def colours(points, directions):
        up = directions[:, 2]
        seen = _mix(horizon, zenith, np.clip(up, 0.0, 1.0)[:, None] ** 0.6)
        seen = seen + LAMP * np.clip((directions @ LIGHT - 0.93) / 0.02, 0.0, 1.0)[:, None]
        below = np.flatnonzero(up < -1e-3) if vessel.there else []
        if len(below):
            reach = (np.minimum(foot - points[below, 2], 0.0) / up[below])[:, None]
            place = (points[below] + reach * directions[below])[:, :2] - middle[:2]
            odd = np.sum(np.floor(place / tile).astype(int), axis=1) % 2
            table = np.where(odd[:, None], light, dark)
            beyond = (np.linalg.norm(np.maximum(np.abs(place) - half, 0.0), axis=1) if vessel.radius is None
                      else np.maximum(np.linalg.norm(place, axis=1) - vessel.radius, 0.0))
            table = table * (1.0 - 0.45 * np.clip(1.0 - beyond / (0.25 * size), 0.0, 1.0) ** 2)[:, None]
            far = np.clip(np.linalg.norm(place, axis=1) / (3.0 * size) - 0.3, 0.0, 1.0)[:, None]
            seen[below] = _mix(table, horizon, far)
        return seen

    return colours


def _mix(a, b, share):
    return a + (b - a) * share


# Picture

def _camera(box, size, camera):
    """Eye [m], target [m] and up direction of a view that contains the box (2, 3)."""
    azimuth, elevation, zoom = camera_angles(camera)
    a, b = np.radians([azimuth, elevation])
    toward = np.array([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    frame = np.stack([right, np.cross(toward, right), toward])
    middle = box.mean(axis=0)
    corners = np.array([[box[i, 0], box[j, 1], box[k, 2]] for i, j, k in np.ndindex(2, 2, 2)])
    place = (corners - middle) @ frame.T
    half = ROOM * np.tan(np.radians(0.5 * LENS)) * np.array([size[0] / size[1], 1.0])
    shift, distance = np.zeros(2), 3.0 * np.linalg.norm(box[1] - box[0])
    for _ in range(50):
        seen = (place[:, :2] - shift) / (distance - place[:, 2:])
        low, high = seen.min(axis=0), seen.max(axis=0)
        shift = shift + 0.5 * (low + high) * distance
        distance *= np.max(0.5 * (high - low) / half)
    target = middle + shift @ frame[:2]
    return SimpleNamespace(eye=target + distance * toward, target=target, up=frame[1], zoom=zoom)


def _rays(camera, size, pixels):
    """Unit directions (n, 3) through places (n, 2) in the picture [pixel], of which (0, 0) is the upper left corner."""
    forward = (camera.target - camera.eye) / np.linalg.norm(camera.target - camera.eye)
    scale = 2.0 * np.tan(np.radians(0.5 * LENS)) / (size[1] * camera.zoom)
    x, y = (pixels - np.array([0.5, 0.5 + LOWER]) * size).T * scale
    rays = forward + x[:, None] * np.cross(forward, camera.up) - y[:, None] * camera.up
    return rays / np.linalg.norm(rays, axis=1)[:, None]


def _picture(world, camera, size, room, light):
    """Colours (height, width, 3): one ray a pixel, and several where neighbours differ."""
    def seen(pixels):
        rays = _rays(camera, size, pixels)
        return np.clip(trace(world, np.broadcast_to(camera.eye, rays.shape), rays, room, **light), 0.0, 1.0)

    rows, columns = np.indices(size[::-1]).reshape(2, -1)
    middles = np.column_stack([columns, rows]) + 0.5
    picture = seen(middles).reshape(size[1], size[0], 3)
    sharp = np.zeros(picture.shape[:2], bool)
    for axis in (0, 1):
        jump = np.abs(np.diff(picture, axis=axis)).max(axis=2) > CONTRAST
        sharp |= np.insert(jump, 0, False, axis=axis) | np.insert(jump, jump.shape[axis], False, axis=axis)
    places = middles.reshape(*sharp.shape, 2)[sharp]
    if len(places):
        samples = seen((places[:, None] + SAMPLES).reshape(-1, 2)).reshape(-1, len(SAMPLES), 3)
        picture[sharp] = samples.mean(axis=1)
    return picture


def _save(picture, path, text):
    """Write the picture with a line of text, as large as fits."""
    from matplotlib import get_data_path

    image, draw, font = (needed(f"PIL.{name}") for name in ("Image", "ImageDraw", "ImageFont"))
    page = image.fromarray(np.round(255.0 * picture).astype(np.uint8))
    height, margin = max(10, page.height // 38), page.width // 40
    if text:
        file = str(Path(get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf")
        while height > 6 and font.truetype(file, height).getlength(text) > page.width - 2 * margin:
            height -= 1
        draw.Draw(page).text((margin, margin), text, fill=INK, font=font.truetype(file, height))
    page.save(path)
    _give_memory_back()


def _give_memory_back():
    """Return free memory to the system; otherwise glibc's heap grows by the size of a picture with each picture."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform.startswith("linux") else None
    if trim is not None:
        trim(0)

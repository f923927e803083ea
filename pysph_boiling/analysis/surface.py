"""A rendered view of a 3-D state: the water with its surface reconstructed, bubbles inside, and the vessel.

pysplashsurf reconstructs the surfaces as smoothed level sets of the particles' density. The light at the vertices is
computed here: reflection after Schlick, and absorption along the straight path through the water to the eye. pyvista
paints the result off-screen, so no display is needed.
"""
import ctypes
import sys
from ctypes.util import find_library
from pathlib import Path
from types import SimpleNamespace

import numpy as np

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

__all__ = ["check_surface", "draw_surface"]

SKY, HORIZON, GROUND = "#5E9BD3", "#FFFFFF", "#8FA9BD"  # surroundings that the water mirrors, by height
SHALLOW, DEEP = "#A4DDEE", "#0A4C8C"  # water after a short and a long path
STEAM = "#F2FAFF"
SLAB, HOT, SITE, EDGE = "#A3ABB4", "#E2622A", "#4A2B20", "#74838F"
BACKGROUND = "#FAFCFD", "#CBD7E1"  # top, bottom
LIGHT = np.array([-0.45, -0.35, 0.82]) / np.linalg.norm([-0.45, -0.35, 0.82])  # towards the lamp
AZIMUTH, ELEVATION, LENS = -62.0, 18.0, 24.0  # direction of the eye and its angle of view [degrees]
SLAB_HEIGHT = 2.0  # height of the base, in spacings
FINE = 2  # pixels rendered per pixel of the picture, along each axis
CUBE = 0.9  # edge of the cubes of the level set, in radii of a particle


def check_surface(dim, colour=None):
    """Raise the errors of :func:`draw_surface` before anything is drawn."""
    if dim != 3:
        raise ValueError(f"the surface view needs three dimensions, but this scene has {dim}")
    if colour not in (None, "bubble"):
        raise ValueError(f"in the surface view colour must be 'bubble' or left out, got {colour!r}")
    needed("pysplashsurf")
    needed("pyvista")


def draw_surface(arrays, path, *, dim, spacing, t=None, title=None, bounds=None, colour=None, size=(1280, 960)):
    """Render the state of one moment to a PNG file; returns its path.

    Parameters
    ----------
    arrays, dim, spacing, t, title, bounds : as :func:`~pysph_boiling.analysis.rendering.draw_scene`; ``dim`` must be 3
    colour : str      "bubble" gives every bubble the colour of its label; if not given, all bubbles are clear.
    size : (2,)       Width and height of the picture [pixel].

    Errors: ``ValueError`` for 2-D, an unknown colour or a scene without fluid; ``ModuleNotFoundError`` if pyvista or
    pysplashsurf is not installed; ``OSError`` if there is no OpenGL.
    """
    check_surface(dim, colour)
    if not spacing > 0.0:
        raise ValueError(f"spacing must be > 0 m, got {spacing} m")
    scene = by_role(arrays)
    bounds = view_bounds(scene, spacing, dim) if bounds is None else np.asarray(bounds, dtype=float)
    fluid = _fluid(scene, bounds)
    vessel = inner_bounds(scene.walls, bounds, spacing)
    box = np.array([vessel[0] - [0.0, 0.0, SLAB_HEIGHT * spacing], vessel[1]])
    camera = _camera(box, size)
    parts = []
    if len(fluid.points):
        depth = _path_in_water(fluid.points, spacing, camera.eye)
        parts = [*_water(fluid, spacing, vessel, walled=vessel != bounds, eye=camera.eye, depth=depth),
                 *_bubbles(fluid, spacing, vessel, colour, eye=camera.eye, depth=depth)]
    return _paint(scene, parts, path, camera, vessel, spacing, size, _text(title, t))


def _fluid(scene, bounds):
    """Positions (n, 3), phase, bubble and swell of the fluid, without particles far outside the bounds."""
    points = positions(scene.fluid)
    near = np.all(np.abs(points - bounds.mean(axis=0)) <= 1.5 * np.ptp(bounds, axis=0), axis=1)
    label, swell = (joined(scene.fluid, name) if have_all(scene.fluid, name) else np.full(len(points), default)
                    for name, default in (("bubble", 0), ("swell", 1.0)))
    return SimpleNamespace(points=points[near], vapour=is_vapour(scene.fluid)[near], label=label[near],
                           swell=swell[near])


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


def _water(fluid, spacing, vessel, *, walled, eye, depth):
    """The lit free surface and the lit faces at the walls.

    Particles are mirrored at the walls, so that the surface meets the walls naturally; the mesh beyond a wall is
    flattened onto it.
    """
    points = fluid.points
    for k in range(3):
        for end, sign in ((0, 1.0), (1, -1.0)):
            if walled[end, k]:
                away = sign * (points[:, k] - vessel[end, k])
                image = points[away < 1.6 * spacing].copy()
                image[:, k] = 2.0 * vessel[end, k] - image[:, k]
                points = np.concatenate([points, image])
    mesh = _reconstruct(points, spacing)
    low, high = np.where(walled[0], vessel[0], -np.inf), np.where(walled[1], vessel[1], np.inf)
    mesh.points = np.clip(mesh.points, low, high)
    path = _smooth(depth(mesh.points), mesh.triangles, 8)
    corners = mesh.points[mesh.triangles]
    turned = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    wet = np.all(np.any((mesh.points == low) | (mesh.points == high), axis=1)[mesh.triangles], axis=1)
    side = np.where(wet, np.abs(turned).argmax(axis=1), 3)  # axis of the wall on which a triangle lies, 3 for none
    parts = [_lit_water(mesh, mesh.normals, side == 3, eye, path, free=True)]
    for k, sign in np.ndindex(3, 2):
        normals = np.zeros_like(mesh.points)
        normals[:, k] = 2.0 * sign - 1.0
        parts.append(_lit_water(mesh, normals, (side == k) & ((turned[np.arange(len(side)), k] > 0.0) == sign), eye,
                                path, free=False))
    return parts


def _smooth(values, triangles, times):
    """Values (n,) at the vertices, averaged ``times`` times over the triangles around each vertex."""
    weight = np.maximum(np.bincount(triangles.ravel(), minlength=len(values)), 1)
    for _ in range(times):
        means = np.repeat(values[triangles].mean(axis=1), 3)
        values = np.bincount(triangles.ravel(), means, minlength=len(values)) / weight
    return values


def _lit_water(mesh, normals, chosen, eye, path, *, free):
    """The chosen triangles with colours: front faces mirror the surroundings, back faces show the body of water."""
    used, triangles = np.unique(mesh.triangles[chosen], return_inverse=True)
    points, normals, path = mesh.points[used], normals[used], path[used]
    view, facing = _toward(eye, points, normals)
    mirror = _schlick(np.abs(facing))
    sky, glint = _sky(view, normals, facing)
    shallow, deep = to_rgb(SHALLOW), to_rgb(DEEP)
    shade = 0.5 + 0.5 * np.clip(normals @ LIGHT, 0.0, 1.0)[:, None]
    front = _mix(shallow * shade, sky, np.clip(0.35 + mirror, 0.0, 1.0)[:, None])
    front = _mix(front, np.ones(3), glint[:, None])
    clear = 0.22 if free else 0.04
    alpha = clear + (0.95 - clear) * np.clip((1.0 if free else 0.35) * mirror + glint, 0.0, 1.0)
    body = _mix(shallow, deep, (1.0 - np.exp(-1.3 * path))[:, None])
    rgba = np.where(facing[:, None] > 0.0, np.column_stack([front, alpha]),
                    np.column_stack([body, 1.0 - 0.85 * np.exp(-1.5 * path)]))
    return SimpleNamespace(points=points, triangles=triangles.reshape(-1, 3), rgba=rgba)


def _bubbles(fluid, spacing, vessel, colour, *, eye, depth):
    """The lit surface of each bubble, only the side that faces the eye."""
    parts = []
    for label in np.unique(fluid.label[fluid.vapour]):
        own = fluid.vapour & (fluid.label == label)
        mesh = _bubble(fluid.points[own], fluid.swell[own].sum() * spacing**3)
        mesh.points = np.clip(mesh.points, vessel[0], [*vessel[1][:2], np.inf])
        parts.append(_lit_bubble(mesh, bubble_colours(np.array([label])) if colour == "bubble" else None, eye, depth))
    return parts


def _bubble(points, volume):
    """Surface around particles (n, 3) that encloses a given volume [m^3].

    Smoothing shrinks the surface, so each of its pieces is scaled up again about its centre.
    """
    mesh = _reconstruct(points, np.cbrt(volume / len(points)))
    count = np.maximum(np.bincount(mesh.piece, minlength=len(mesh.points)), 1)
    centre = np.column_stack([np.bincount(mesh.piece, x, minlength=len(count)) / count for x in mesh.points.T])
    centre = centre[mesh.piece]
    grown = np.cbrt(volume / max(_volumes(mesh.points, mesh.triangles).sum(), 0.1 * volume))
    mesh.points = centre + grown * (mesh.points - centre)
    return mesh


def _lit_bubble(mesh, tint, eye, depth):
    view, facing = _toward(eye, mesh.points, mesh.normals)
    rim = (1.0 - np.clip(facing, 0.0, 1.0))**2.5
    sky, glint = _sky(view, mesh.normals, facing)
    inner = _sky(view, mesh.normals * [1.0, 1.0, -1.0], facing)[1]  # the lamp again, from the far side
    shade = 0.85 + 0.15 * mesh.normals[:, 2:]
    bright = np.clip(0.9 * rim + glint + 0.5 * inner, 0.0, 1.0)
    veil = 1.0 - np.exp(-0.6 * depth(mesh.points))
    rgb = _mix(to_rgb(STEAM) if tint is None else tint, sky, 0.3) * shade
    rgb = _mix(_mix(rgb, np.ones(3), bright[:, None]), to_rgb(DEEP), 0.22 * veil[:, None])
    alpha = np.clip((0.46 if tint is None else 0.75) + bright, 0.0, 0.95)
    a, b, c = mesh.points[mesh.triangles].transpose(1, 0, 2)
    near = np.einsum("ij,ij->i", np.cross(b - a, c - a), eye - a) > 0.0
    return SimpleNamespace(points=mesh.points, triangles=mesh.triangles[near], rgba=np.column_stack([rgb, alpha]))


# Light

def _toward(eye, points, normals):
    """Unit vectors (n, 3) from points to the eye, and their scalar products with the normals (n,)."""
    view = eye - points
    view /= np.linalg.norm(view, axis=1)[:, None]
    return view, np.einsum("ij,ij->i", view, normals)


def _schlick(cosine):
    """Fraction of light that water reflects (Schlick's formula)."""
    return 0.02 + 0.98 * (1.0 - np.clip(cosine, 0.0, 1.0))**5


def _sky(view, normals, facing):
    """Colours (n, 3) of the surroundings in a mirror, and the brightness of the lamp in it (n,)."""
    ray = 2.0 * facing[:, None] * normals - view
    up, down = np.clip(ray[:, 2:], 0.0, 1.0), np.clip(-4.0 * ray[:, 2:], 0.0, 1.0)
    colour = _mix(_mix(to_rgb(HORIZON), to_rgb(SKY), up), to_rgb(GROUND), down)
    return colour, np.clip(ray @ LIGHT, 0.0, 1.0)**60


def _mix(a, b, share):
    return a + (b - a) * share


def _path_in_water(points, spacing, eye):
    """A function of positions (n, 3) that returns the length (n,) of the path through water to the eye.

    The unit of length is the edge of a cube with the volume of all the water, so that the picture of a scene does not
    depend on its size.
    """
    low = points.min(axis=0) - 2.0 * spacing
    cells = np.floor((points - low) / spacing).astype(int)
    grid = np.zeros(cells.max(axis=0) + 3)
    np.add.at(grid, tuple(cells.T), 1.0)
    for axis in range(3):
        grid = (np.roll(grid, 1, axis) + grid + np.roll(grid, -1, axis)) / 3.0
    grid = np.minimum(grid, 1.0)
    shape = np.array(grid.shape)
    step = 1.2 * spacing

    def path(where):
        away = eye - where
        away *= (step / spacing) / np.linalg.norm(away, axis=1)[:, None]
        cell, total = (where - low) / spacing + 0.5 * away, np.zeros(len(where))
        for _ in range(int(np.linalg.norm(shape) * spacing / step) + 1):
            index = np.floor(cell).astype(int)
            inside = np.all((index >= 0) & (index < shape), axis=1)
            if not inside.any():
                break
            total[inside] += grid[tuple(index[inside].T)]
            cell += away
        return total * step / (spacing * len(points)**(1.0 / 3.0))

    return path


# Picture

def _camera(box, size):
    """Eye [m], target [m] and up direction of a view that contains the box (2, 3)."""
    a, b = np.radians([AZIMUTH, ELEVATION])
    toward = np.array([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    frame = np.stack([right, np.cross(toward, right), toward])
    middle = box.mean(axis=0)
    corners = np.array([[box[i, 0], box[j, 1], box[k, 2]] for i, j, k in np.ndindex(2, 2, 2)])
    place = (corners - middle) @ frame.T
    half = 0.90 * np.tan(np.radians(0.5 * LENS)) * np.array([size[0] / size[1], 1.0])
    shift, distance = np.zeros(2), 3.0 * np.linalg.norm(box[1] - box[0])
    for _ in range(50):
        seen = (place[:, :2] - shift) / (distance - place[:, 2:])
        low, high = seen.min(axis=0), seen.max(axis=0)
        shift = shift + 0.5 * (low + high) * distance
        distance *= np.max(0.5 * (high - low) / half)
    target = middle + shift @ frame[:2]
    return SimpleNamespace(eye=target + distance * toward, target=target, up=frame[1])


def _text(title, t):
    return "   ".join(part for part in (title, "" if t is None else f"t = {t:.3f} s") if part)


def _paint(scene, parts, path, camera, vessel, spacing, size, text):
    from matplotlib.image import imsave

    pv = needed("pyvista")
    with pv.vtk_verbosity("error"):  # VTK warns if there is no display, but works without one
        plotter = pv.Plotter(off_screen=True, window_size=[FINE * length for length in size], lighting="none")
    try:
        _check_opengl(plotter.render_window)
        plotter.render_window.SetMultiSamples(0)  # it ignores transparent faces; more pixels do not
        plotter.set_background(BACKGROUND[1], top=BACKGROUND[0])
        _paint_vessel(pv, plotter, scene, vessel, spacing)
        _paint_clear(pv, plotter, parts, camera.eye)
        if text:
            plotter.add_text(text, position=(0.02, 0.95), viewport=True, font_size=FINE * max(6, size[1] // 90),
                             color=INK)
        plotter.camera_position = [camera.eye, camera.target, camera.up]
        plotter.camera.view_angle = LENS
        plotter.reset_camera_clipping_range()
        picture = plotter.screenshot(return_img=True)[..., :3]
    finally:
        plotter.close()
    picture = picture.reshape(size[1], FINE, size[0], FINE, 3).mean(axis=(1, 3))
    imsave(path, np.round(picture).astype(np.uint8))
    _give_memory_back()
    return Path(path)


def _give_memory_back():
    """Return free memory to the system; otherwise glibc's heap grows by the size of a picture with each picture."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform.startswith("linux") else None
    if trim is not None:
        trim(0)


def _check_opengl(window):
    """Raise ``OSError`` if VTK found neither a display nor EGL, in which case it would crash."""
    if window.GetClassName() == "vtkOSOpenGLRenderWindow" and find_library("OSMesa") is None:
        raise OSError("there is no OpenGL to render with (on Debian or Ubuntu: apt install libegl1 libgl1-mesa-dri)")


def _paint_clear(pv, plotter, parts, eye):
    """Paint all transparent parts as one mesh, with its triangles sorted from far to near."""
    first = np.cumsum([0, *(len(part.points) for part in parts)])
    points = np.concatenate([part.points for part in parts])
    triangles = np.concatenate([part.triangles + start for part, start in zip(parts, first)])
    far = np.linalg.norm(points[triangles].mean(axis=1) - eye, axis=1)
    triangles = triangles[np.argsort(-far, kind="stable")]
    mesh = pv.PolyData(points, np.column_stack([np.full(len(triangles), 3), triangles]))
    mesh["rgba"] = np.round(255.0 * np.clip(np.concatenate([part.rgba for part in parts]), 0.0, 1.0)).astype(np.uint8)
    plotter.add_mesh(mesh, scalars="rgba", rgb=True, lighting=False, copy_mesh=False)


def _paint_vessel(pv, plotter, scene, vessel, spacing):
    """Paint the base with its heater and sites, the edges and a soft shadow; nothing if the scene has no walls."""
    if not scene.walls:
        return
    gap = 0.1 * spacing  # keeps coincident faces apart
    low, high = vessel[0] - 2.0 * gap, vessel[1] + 2.0 * gap
    foot = low[2] - SLAB_HEIGHT * spacing
    slab = pv.Box((low[0], high[0], low[1], high[1], foot, low[2]))
    plotter.add_mesh(_shaded(slab, SLAB), scalars="rgb", rgb=True, lighting=False)
    hot = positions(scene.walls)[wall_colours(scene.walls)[1]]
    if len(hot):
        tiles = pv.PolyData(hot - [0.0, 0.0, gap]).glyph(
            geom=pv.Cube(x_length=spacing, y_length=spacing, z_length=spacing), scale=False, orient=False)
        plotter.add_mesh(_shaded(tiles, HOT), scalars="rgb", rgb=True, lighting=False)
    for place in positions(scene.sites):
        plotter.add_mesh(pv.Disc(center=place * [1.0, 1.0, 0.0] + [0.0, 0.0, vessel[0, 2] - 0.5 * gap], inner=0.0,
                                 outer=0.4 * spacing, c_res=24), color=SITE, lighting=False)
    outline = plan_outline(scene, np.array([low, high]))
    rings = [np.column_stack([outline, np.full(len(outline), z)]) for z in (low[2], high[2])]
    for ring in rings:
        plotter.add_mesh(pv.lines_from_points(ring, close=True), color=EDGE, line_width=FINE * 1.5, lighting=False)
    for k in range(0, len(outline), max(1, len(outline) // 4)):
        plotter.add_mesh(pv.Line(rings[0][k], rings[1][k]), color=EDGE, line_width=FINE * 1.5, lighting=False)
    _paint_shadow(pv, plotter, low, high, foot)


def _paint_shadow(pv, plotter, low, high, foot):
    reach = 0.2 * np.linalg.norm(high - low)
    size = high[:2] - low[:2] + 2.0 * reach
    ground = pv.Plane(center=(*0.5 * (low + high)[:2], foot), i_size=size[0], j_size=size[1], i_resolution=60,
                      j_resolution=60)
    beyond = np.maximum(np.maximum(low - ground.points, ground.points - high), 0.0)[:, :2]
    dark = 0.35 * np.clip(1.0 - np.linalg.norm(beyond, axis=1) / reach, 0.0, 1.0)**2
    ground["rgba"] = np.column_stack([np.tile(to_rgb(INK), (len(dark), 1)), dark])
    ground["rgba"] = np.round(255.0 * ground["rgba"]).astype(np.uint8)
    plotter.add_mesh(ground, scalars="rgba", rgb=True, lighting=False)


def _shaded(mesh, colour):
    """The mesh with one colour per face, brighter the more it faces the lamp."""
    mesh = mesh.compute_normals(cell_normals=True, point_normals=False, auto_orient_normals=False)
    light = 0.62 + 0.43 * np.clip(mesh.cell_data["Normals"] @ LIGHT, 0.0, 1.0)
    mesh.cell_data["rgb"] = np.round(255.0 * np.clip(light[:, None] * to_rgb(colour), 0.0, 1.0)).astype(np.uint8)
    return mesh

"""Pictures of particles: one moment, all frames of a run, or a contact sheet of frames; and files for ParaView.
"""
import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from pysph.base.particle_array import ParticleArray

from pysph_boiling.analysis.drawing import (
    BUBBLE_COLOURS,
    HEATER,
    INK,
    PHASE_COLOURS,
    STATE_COLOURS,
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
from pysph_boiling.files import Manifest, load_output, output_files, run_record
from pysph_boiling.names import nearest
from pysph_boiling.phases import Phase, at_saturation

__all__ = ["BUBBLE_COLOURS", "PHASE_COLOURS", "STATE_COLOURS", "bubble_colours", "chosen_files", "colour_limits",
           "contact_sheet", "draw_scene", "drawn_into", "geometry", "needed", "particle_colours", "render_run",
           "write_paraview"]

PALE = 0.55  # mixed with this much white, liquid does not distract from coloured bubbles

# colour -> label of the colour bar, offset added to the values, colour map, quantiles at its ends
SCALES = {
    "temperature": ("temperature [°C]", -273.15, "RdYlBu_r", (0.001, 0.999)),
    "speed": ("speed [m/s]", 0.0, "viridis", (0.0, 0.995)),
    "density": ("density [kg/m³]", 0.0, "cividis", (0.01, 0.99)),
}
COLOURS = ("phase", "bubble", *SCALES)

# The discs that make one ball, bottom to top: diameter and shift to the light, both in diameters; lightness -1 .. 1.
DISC = ((1.0, 0.0, -0.3), (0.84, 0.0, 0.0))
BALL = ((1.0, 0.0, -0.55), (0.9, 0.02, -0.22), (0.72, 0.06, 0.0), (0.42, 0.13, 0.22), (0.18, 0.19, 0.6))

DPI = 150
LONGEST = 6.0  # [inch] longer side of the picture without its margins
MARGINS = SimpleNamespace(left=0.75, right=1.65, bottom=0.55, top=0.45)  # [inch]


def draw_scene(arrays: dict[str, ParticleArray], path: str | os.PathLike, *, dim: int, spacing: float,
               t: float | None = None, colour: str | None = None, slice_axis: str = "y", view: str = "slice",
               title: str | None = None, bounds: np.ndarray | None = None,
               limits: tuple[float, float] | None = None) -> Path:
    """Draw the particles of one moment to a PNG file; returns its path.

    Particles are discs with a diameter of ``spacing``. In 2-D every particle is drawn. In 3-D ``view="slice"`` shows
    the liquid within one spacing of the middle plane and *all* vapour, paler the farther away it is. ``view="3d"``
    shows the edges of the vessel, the vapour as balls and the free surface as faint dots (all the fluid if the scene
    has no phases). The colour "superheated" is for liquid above T_sat; liquid that an interruption holds at T_sat has
    the colour "held".

    Parameters
    ----------
    arrays : dict     Name -> particle array with ``x, y, z`` [m], each of shape (n,), and ``properties``; as loaded by
        ``pysph.solver.utils.load(file)["arrays"]``. An array with "site" in its name has nucleation sites; one with
        "wall", "solid", "bound" or "vessel" in its name, or with the property ``heated``, is a wall; the rest is fluid.
    dim, spacing      Number of dimensions, 2 or 3; spacing of the particles [m].
    t : float         Time [s], printed in the title.
    colour : str      "phase", "bubble", "temperature", "speed" or "density". If not given, "bubble" in the 3-D view and
        "phase" otherwise, or "speed" if the scene lacks that property.
    slice_axis : str  The axis to look along in a slice: "x", "y" or "z" (3-D).
    bounds : (2, 3)   Lower and upper corner of the region to show [m]; all walls and fluid if not given.
    limits : (2,)     Ends of the colour scale, in the unit printed at it; from the fluid if not given.

    Errors: ``ValueError`` for an unknown view, colour or axis, a scene without fluid, and a colour whose property the
    fluid lacks.
    """
    from matplotlib.figure import Figure

    if view not in ("slice", "3d"):
        raise ValueError(f"view must be 'slice' or '3d', got {view!r}")
    if slice_axis not in ("x", "y", "z"):
        raise ValueError(f"slice_axis must be 'x', 'y' or 'z', got {slice_axis!r}")
    if dim not in (2, 3):
        raise ValueError(f"dim must be 2 or 3, got {dim}")
    if not spacing > 0.0:
        raise ValueError(f"spacing must be > 0 m, got {spacing} m")
    scene = by_role(arrays)
    view = view if dim == 3 else "2d"
    colour = _pick_colour(scene.fluid, colour, view)
    bounds = view_bounds(scene, spacing, dim) if bounds is None else np.asarray(bounds, dtype=float)
    if limits is None and colour in SCALES:
        limits = colour_limits(scene.fluid, colour)
    if view == "3d":
        bounds = inner_bounds(scene.walls, bounds, spacing)
    camera = _perspective(bounds) if view == "3d" else _parallel("z" if dim == 2 else slice_axis, bounds)

    unit, scale = ("m", 1.0) if np.ptp(bounds, axis=0).max() >= 1.0 else ("mm", 1e3)
    figure, ax = _canvas(Figure, camera.window * scale)
    painter = SimpleNamespace(ax=ax, camera=camera, spacing=spacing, scale=scale, bounds=bounds)
    if view == "3d":
        _paint_3d(painter, scene, colour, limits)
        size = " × ".join(f"{edge * scale:.3g}" for edge in np.ptp(bounds, axis=0))
        ax.text(0.5, -0.02, f"{size} {unit}", transform=ax.transAxes, ha="center", va="top", color=INK, fontsize=9)
        ax.set_axis_off()
    else:
        _paint_slice(painter, scene, colour, limits, whole=dim == 2)
        ax.set_xlabel(f"{camera.names[0]} [{unit}]", color=INK, fontsize=9)
        ax.set_ylabel(f"{camera.names[1]} [{unit}]", color=INK, fontsize=9)
    _annotate(figure, ax, scene, view, colour, limits, title=title, t=t)
    figure.savefig(path, dpi=DPI, facecolor="white")
    return Path(path)


def render_run(output_dir: str | os.PathLike, *, colour: str | None = None, view: str | None = None, every: int = 1,
               out: str | os.PathLike | None = None, slice_axis: str = "y", size: tuple[int, int] = (1280, 960),
               camera: str = "corner", track: Callable[[Any], Iterable] = iter) -> list[Path]:
    """Draw a run's output files as ``frame_00000.png``, ``frame_00001.png``, ...; returns their paths.

    ``output_dir`` holds the HDF5 files of a PySPH run. ``dim``, ``spacing`` [m] and ``scene`` are read from its
    ``run.json``; without one, they are estimated from the particles. Every ``every``-th file is drawn to ``out``
    (default ``<output_dir>/frames``), and frames from an earlier call are deleted. All frames have the same view and
    colour scale, taken from the first, middle and last file.

    ``view`` is a view of :func:`draw_scene`, or "surface" for pictures of ``size`` pixels from a ``camera`` by
    :func:`~pysph_boiling.analysis.surface.draw_surface`. ``track`` wraps the list of files, to show progress.

    Errors: ``FileNotFoundError`` if the folder holds no output; ``FileExistsError`` if a file of the user would be
    overwritten; and those of the function that draws.
    """
    files = chosen_files(output_dir, every)
    known = geometry(output_dir, files)
    dim, samples = known.dim, known.samples
    options = dict(dim=dim, spacing=known.spacing, title=known.scene.replace("_", " "), bounds=known.bounds)
    if view == "surface":
        from pysph_boiling.analysis.surface import check_surface, draw_surface

        check_surface(dim, colour, camera)
        draw, options = draw_surface, {**options, "colour": colour, "size": size, "camera": camera}
    else:
        view = view or "slice"
        colour = _pick_colour(samples[-1].fluid, colour, view if dim == 3 else "2d")
        wet = [scene for scene in samples if len(positions(scene.fluid))]
        ends = np.array([colour_limits(scene.fluid, colour) for scene in wet]) if colour in SCALES and wet else None
        draw, options = draw_scene, {**options, "colour": colour, "view": view, "slice_axis": slice_axis,
                                     "limits": None if ends is None else (ends[:, 0].min(), ends[:, 1].max())}

    folder, listed = drawn_into(output_dir, out, "frames")
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for number, file in enumerate(track(files)):
        arrays, t = load_output(file)
        path = folder / f"frame_{number:05d}.png"
        listed.claim(path.relative_to(listed.folder).as_posix())
        paths.append(draw(arrays, path, t=t, **options))
    return paths


def write_paraview(output_dir: str | os.PathLike, *, every: int = 1, out: str | os.PathLike | None = None,
                   track: Callable[[Any], Iterable] = iter) -> list[Path]:
    """Write a run for ParaView with PySPH's ``dump_vtk``; returns the paths of the collections to open, one per array.

    Every array of every ``every``-th output is written as a ``.vtu`` file to ``out`` (default
    ``<output_dir>/paraview``), with all properties in the output and the vector ``velocity``. The collection
    ``<array>.pvd`` lists these files with their times [s].

    Errors: ``FileNotFoundError`` if the folder holds no output, ``ModuleNotFoundError`` without pyvisfile.
    """
    needed("pyvisfile")  # one of the two writers of dump_vtk; the other, mayavi, needs a display
    from pysph.solver.vtk_output import dump_vtk

    files = chosen_files(output_dir, every)
    folder, listed = drawn_into(output_dir, out, "paraview")
    folder.mkdir(parents=True, exist_ok=True)

    def claimed(name):
        listed.claim((folder / name).relative_to(listed.folder).as_posix())
        return folder / name

    entries = {}
    for number, file in enumerate(track(files)):
        arrays, t = load_output(file)
        scene = Path(file).stem.rsplit("_", 1)[0]
        for name, pa in arrays.items():
            vectors = {"velocity": ["u", "v", "w"]} if have_all([pa], "u", "v", "w") else {}
            claimed(f"{scene}_{name}_{number:05d}.vtu")
            dump_vtk(str(folder / f"{scene}_{number:05d}"), [pa], **vectors)
            entries.setdefault(name, []).append(
                f'    <DataSet timestep="{t:.9g}" file="{scene}_{name}_{number:05d}.vtu"/>\n')
    for name, lines in entries.items():
        claimed(f"{name}.pvd").write_text(
            f'<VTKFile type="Collection" version="0.1">\n  <Collection>\n{"".join(lines)}  </Collection>\n</VTKFile>\n')
    return [folder / f"{name}.pvd" for name in entries]


def contact_sheet(paths: Sequence, path: str | os.PathLike, columns: int = 3, count: int = 9,
                  width: int = 2400) -> Path:
    """Write one PNG of at most ``count`` of the pictures ``paths``, evenly chosen, including the first and the last.

    Rows are filled from left to right. Pictures are scaled down so that the sheet is at most about ``width`` pixels
    wide.
    """
    from matplotlib.image import imread, imsave

    paths = list(paths)
    if not paths:
        raise ValueError("a contact sheet needs at least one picture")
    chosen = np.unique(np.linspace(0, len(paths) - 1, min(count, len(paths))).round().astype(int))
    pictures = [imread(paths[i])[..., :3] for i in chosen]
    columns = min(columns, len(pictures))
    shrink = max(1, int(np.ceil(columns * max(p.shape[1] for p in pictures) / width)))
    pictures = [_averaged(p, shrink) for p in pictures]
    height, breadth = max(p.shape[0] for p in pictures), max(p.shape[1] for p in pictures)
    rows = -(-len(pictures) // columns)
    sheet = np.ones((rows * height, columns * breadth, 3))
    for k, picture in enumerate(pictures):
        top, left = k // columns * height, k % columns * breadth
        sheet[top:top + picture.shape[0], left:left + picture.shape[1]] = picture
    imsave(path, sheet)
    return Path(path)


def _averaged(picture, shrink):
    """The picture (h, w, 3) averaged over blocks of ``shrink`` x ``shrink`` pixels; incomplete blocks are cut off."""
    h, w = picture.shape[0] // shrink, picture.shape[1] // shrink
    return picture[:h * shrink, :w * shrink].reshape(h, shrink, w, shrink, 3).mean(axis=(1, 3))


# The files of a run

def drawn_into(output_dir, out, name):
    """(folder, :class:`Manifest`) for what is made of a run: ``out``, or the folder ``name`` in the folder of the run.

    Files from an earlier call are removed from it.
    """
    listed = Manifest(output_dir if out is None else out)
    folder = listed.folder / name if out is None else listed.folder
    inside = folder.relative_to(listed.folder)
    listed.remove(lambda known: (listed.folder / known).parent == listed.folder / inside)
    return folder, listed


def chosen_files(output_dir, every):
    """Paths of every ``every``-th particle file of a run; ``FileNotFoundError`` if there are none."""
    files = output_files(output_dir)[:: int(every)]
    if not files:
        raise FileNotFoundError(f"there are no particle files (HDF5) in {output_dir}")
    return files


def geometry(output_dir, files):
    """What all frames of a run share: ``dim``, ``spacing`` [m], the name of the ``scene``, ``bounds`` (2, 3) [m].

    They are read from ``run.json`` or estimated from particles. ``samples`` are the arrays by role of the first, middle
    and last of the ``files``, from which the bounds are.
    """
    run = run_record(output_dir)
    samples = [by_role(load_output(files[i])[0]) for i in sorted({0, len(files) // 2, len(files) - 1})]
    dim = int(run.get("dim") or _guess_dim(samples[-1].fluid))
    spacing = float(run.get("spacing") or _guess_spacing(samples[0].fluid, dim))
    extents = np.array([view_bounds(scene, spacing, dim) for scene in samples])
    return SimpleNamespace(dim=dim, spacing=spacing, scene=str(run.get("scene", "")), samples=samples,
                           bounds=np.array([extents[:, 0].min(axis=0), extents[:, 1].max(axis=0)]))


NEEDS = {"phase": ("phase",), "bubble": ("phase", "bubble"), "temperature": ("T",), "speed": ("u", "v", "w"),
         "density": ("rho",)}


def _pick_colour(fluid, colour, view):
    if colour is None:
        wanted = ("bubble", "phase", "speed") if view == "3d" else ("phase", "speed")
        return next((c for c in wanted if have_all(fluid, *NEEDS[c])), "density")
    if colour not in COLOURS:
        raise ValueError(f"colour must be one of {', '.join(COLOURS)}, got {colour!r}{nearest(colour, COLOURS)}")
    if not have_all(fluid, *NEEDS[colour]):
        raise ValueError(f"colour {colour!r} needs the properties {', '.join(NEEDS[colour])}, which the fluid lacks")
    return colour


def _values(fluid, colour):
    """Values (n,) for the colour scale, in its unit."""
    raw = np.linalg.norm(joined(fluid, "u", "v", "w"), axis=1) if colour == "speed" else joined(
        fluid, NEEDS[colour][0])
    return raw + SCALES[colour][1]


def colour_limits(fluid, colour):
    """Ends (low, high) of the scale of a colour, in the unit printed at it."""
    shown = _values(fluid, colour)
    low, high = np.nanquantile(shown, SCALES[colour][-1]) if len(shown) else (0.0, 0.0)
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def _guess_dim(fluid):
    return 3 if np.ptp(joined(fluid, "z")) > 0.0 else 2


def _guess_spacing(fluid, dim):
    return float(np.median(joined(fluid, "m") / joined(fluid, "rho"))) ** (1.0 / dim)


# Where it is seen

def _parallel(axis, bounds):
    """Look along ``axis``: points (n, 3) -> picture (n, 2) [m], depth (n,) from -1 (far) to 1 (near), size (n,)."""
    right, up, sign = {"x": (1, 2, 1.0), "y": (0, 2, -1.0), "z": (0, 1, 1.0)}[axis]
    k = "xyz".index(axis)
    middle, half = bounds.mean(axis=0)[k], max(0.5 * np.ptp(bounds[:, k]), 1e-12)

    def project(points):
        return points[:, [right, up]], sign * (points[:, k] - middle) / half, np.ones(len(points))

    margin = 0.02 * np.ptp(bounds[:, [right, up]], axis=0).max() * np.array([[-1.0], [1.0]])
    return SimpleNamespace(project=project, window=bounds[:, [right, up]] + margin, names=("xyz"[right], "xyz"[up]),
                           axis=k, middle=middle)


def _perspective(bounds, azimuth=-62.0, elevation=16.0, distance=3.2):
    """Look at the box from ``distance`` diagonals away; angles in degrees, z is up. Returns the same as `_parallel`."""
    a, b = np.radians([azimuth, elevation])
    toward = np.array([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    frame = np.stack([right, np.cross(toward, right), toward])
    middle, diagonal = bounds.mean(axis=0), float(np.linalg.norm(bounds[1] - bounds[0]))

    def project(points):
        view = (points - middle) @ frame.T
        size = distance * diagonal / np.maximum(distance * diagonal - view[:, 2], 1e-3 * diagonal)
        return view[:, :2] * size[:, None], 2.0 * view[:, 2] / diagonal, size

    corners = project(np.array([[bounds[i, 0], bounds[j, 1], bounds[k, 2]] for i, j, k in np.ndindex(2, 2, 2)]))[0]
    window = np.array([corners.min(axis=0), corners.max(axis=0)])
    return SimpleNamespace(project=project, window=window + 0.02 * diagonal * np.array([[-1.0], [1.0]]))


# Paint

def _canvas(figure_class, window):
    """Figure and axes of fixed position with equal scales, and an even number of pixels, which video codecs need."""
    span = window[1] - window[0]
    width, height = LONGEST * span / span.max()
    width, height = max(width, 1.0), max(height, 1.0)
    m = MARGINS
    pixels = np.array([m.left + width + m.right, max(m.bottom + height + m.top, 3.2)]) * DPI
    size = 2.0 * np.ceil(pixels / 2.0) / DPI
    figure = figure_class(figsize=size)
    ax = figure.add_axes((m.left / size[0], m.bottom / size[1], width / size[0], height / size[1]))
    ax.set(xlim=window[:, 0], ylim=window[:, 1], aspect="equal")
    ax.tick_params(colors=INK, labelsize=8, length=3)
    ax.spines[:].set(color="#B0B5BC", linewidth=0.6)
    return figure, ax


def _lighten(rgb, amount):
    """Mix colours (n, 3) with white (amount > 0) or black (amount < 0); ``amount`` is a number or (n,)."""
    amount = np.asarray(amount, dtype=float)[..., None]
    return np.clip(rgb + np.where(amount > 0.0, amount * (1.0 - rgb), amount * rgb), 0.0, 1.0)


def _balls(painter, points, rgb, discs, *, diameter=1.0, fog=0.0, alpha=None):
    """Paint particles (n, 3) from far to near as stacks of discs.

    ``diameter`` is in spacings; ``fog`` makes distant particles paler.
    """
    from matplotlib.collections import EllipseCollection

    place, depth, size = painter.camera.project(points)
    order = np.argsort(depth, kind="stable")
    place, depth = place[order] * painter.scale, depth[order]
    size = size[order] * painter.spacing * painter.scale * diameter
    rgb = _lighten(rgb[order], fog * np.clip(0.5 * (1.0 - depth), 0.0, 1.0))
    light = np.array([-0.6, 0.8])
    offsets = np.stack([place + shift * size[:, None] * light for _, shift, _ in discs], 1).reshape(-1, 2)
    widths = np.stack([part * size for part, _, _ in discs], 1).ravel()
    colours = np.stack([_lighten(rgb, lightness) for _, _, lightness in discs], 1).reshape(-1, 3)
    painter.ax.add_collection(EllipseCollection(
        widths, widths, np.zeros_like(widths), units="xy", offsets=offsets, offset_transform=painter.ax.transData,
        facecolors=colours, edgecolors="none", alpha=alpha), autolim=False)


def particle_colours(fluid, colour, limits):
    """Colours (n, 3) of the particles of a fluid, of which ``limits`` are the ends of the scale, if it has one."""
    from matplotlib import colormaps

    if colour in SCALES:
        share = (_values(fluid, colour) - limits[0]) / (limits[1] - limits[0])
        return colormaps[SCALES[colour][2]](share)[:, :3]
    state = _states(fluid)
    rgb = to_rgb(list(STATE_COLOURS.values()))[state]
    if colour == "bubble":
        vapour = state == Phase.VAPOUR
        rgb = _lighten(rgb, PALE)
        rgb[vapour] = bubble_colours(joined(fluid, "bubble")[vapour])
    return rgb


def _states(fluid):
    """Number (n,) of each particle's state in ``STATE_COLOURS``: its phase, or that of liquid held at T_sat."""
    phase = joined(fluid, "phase").astype(int)
    if have_all(fluid, "e"):
        held = at_saturation(phase, joined(fluid, "e"), joined(fluid, "e_lat") if have_all(fluid, "e_lat") else 0.0)
        phase[held] = list(STATE_COLOURS).index("held")
    return phase


def _paint_sites(painter, scene, size):
    if scene.sites:
        place = painter.camera.project(positions(scene.sites))[0] * painter.scale
        painter.ax.scatter(*place.T, marker="^", s=size, color="white", edgecolors="black", linewidths=0.9, zorder=5)


def _paint_slice(painter, scene, colour, limits, whole):
    points, rgb, vapour = positions(scene.fluid), particle_colours(scene.fluid, colour, limits), is_vapour(scene.fluid)
    k, middle = painter.camera.axis, painter.camera.middle

    def shown(where):
        return np.ones(len(where), bool) if whole else np.abs(where[:, k] - middle) <= painter.spacing

    if scene.walls:
        where, shade = positions(scene.walls), wall_colours(scene.walls)[0]
        _balls(painter, where[shown(where)], shade[shown(where)], DISC)
    liquid = shown(points) & ~vapour
    _balls(painter, points[liquid], rgb[liquid], DISC)
    fog = 0.0 if whole or colour in SCALES else 0.45  # colours that stand for numbers must stay unchanged
    _balls(painter, points[vapour], rgb[vapour], DISC if whole else BALL, fog=fog)
    _paint_sites(painter, scene, 45)


def _paint_3d(painter, scene, colour, limits):
    points, rgb, vapour = positions(scene.fluid), particle_colours(scene.fluid, colour, limits), is_vapour(scene.fluid)
    outline = plan_outline(scene, painter.bounds)
    low, high = painter.bounds[:, 2]
    _polygon(painter, outline, low, facecolor="#EEF0F3", edgecolor="#B0B5BC", linewidth=0.8)
    if scene.walls:
        where, (shade, heated) = positions(scene.walls), wall_colours(scene.walls)
        _balls(painter, where[heated], shade[heated], DISC, alpha=0.25)
    _paint_sites(painter, scene, 60)
    for corner in outline[:: max(1, len(outline) // 4)]:
        edge = painter.camera.project(np.array([[*corner, low], [*corner, high]]))[0] * painter.scale
        painter.ax.plot(*edge.T, color="#B0B5BC", linewidth=0.8)
    _polygon(painter, outline, high, facecolor="none", edgecolor="#B0B5BC", linewidth=0.8)
    if not have_all(scene.fluid, "phase"):
        _balls(painter, points, rgb, BALL[:3])
        return
    _balls(painter, points[vapour], rgb[vapour], BALL, fog=0.0 if colour in SCALES else 0.35)
    surface = _free_surface(points[~vapour], painter.spacing)
    water = np.tile(to_rgb(PHASE_COLOURS[Phase.LIQUID]), (len(surface), 1))
    _balls(painter, surface, water, ((1.0, 0.0, 0.0),), diameter=0.6, fog=0.3, alpha=0.35)


def _polygon(painter, outline, height, **style):
    from matplotlib.patches import Polygon

    corners = np.column_stack([outline, np.full(len(outline), height)])
    painter.ax.add_patch(Polygon(painter.camera.project(corners)[0] * painter.scale, **style))


def _free_surface(points, spacing):
    """The highest of the points (n, 3) in every column of one spacing square."""
    if len(points) == 0:
        return points
    cells = np.floor(points[:, :2] / spacing).astype(int)
    order = np.lexsort((points[:, 2], cells[:, 1], cells[:, 0]))
    last = np.append(np.any(np.diff(cells[order], axis=0) != 0, axis=1), True)
    return points[order[last]]


def _annotate(figure, ax, scene, view, colour, limits, *, title, t):
    """Draw title, legend and colour scale in the right margin, so that the picture does not move between frames."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    time = "" if t is None else f"t = {t:.3f} s"
    ax.set_title("   ".join(part for part in (title, time) if part), loc="left", fontsize=10, color=INK)
    box, inch = ax.get_position(), 1.0 / figure.get_figwidth()
    entries = _legend_entries(scene, view, colour)
    if entries:
        figure.legend(handles=entries, loc="upper left", bbox_to_anchor=(box.x1 + 0.05 * inch, box.y1), frameon=False,
                      fontsize=8, labelcolor=INK, handletextpad=0.2, borderaxespad=0.0)
    if colour in SCALES:
        label, _, name, _ = SCALES[colour]
        bar = figure.add_axes((box.x1 + 0.15 * inch, box.y0, 0.16 * inch, 0.62 * box.height))
        figure.colorbar(ScalarMappable(Normalize(*limits), name), cax=bar).set_label(label, color=INK, fontsize=9)
        bar.tick_params(colors=INK, labelsize=8, length=3)


def _legend_entries(scene, view, colour):
    """One legend entry for each kind of particle in the picture, with its number in the whole scene."""
    from matplotlib.lines import Line2D

    def dot(label, face, marker="o", **style):
        return Line2D([], [], linestyle="", marker=marker, markersize=7, color=face, label=label,
                      **{"markeredgewidth": 0.9, **style})

    entries = []
    if have_all(scene.fluid, "phase") and colour in ("phase", "bubble"):
        counts = np.bincount(_states(scene.fluid), minlength=len(STATE_COLOURS))
        for (name, face), count in zip(STATE_COLOURS.items(), counts):
            vapour, style = name == Phase.VAPOUR.name.lower(), {}
            if count == 0 or (view == "3d" and not vapour):
                continue
            if colour == "bubble" and vapour:
                face = BUBBLE_COLOURS[0]
                style = {"fillstyle": "left", "markerfacecoloralt": BUBBLE_COLOURS[5], "markeredgewidth": 0.0}
            elif colour == "bubble":
                face = _lighten(to_rgb(face), PALE)
            entries.append(dot(f"{name} {count:,}", face, **style))
    if view == "3d" and have_all(scene.fluid, "phase"):
        entries.append(dot("free surface", _lighten(to_rgb(PHASE_COLOURS[Phase.LIQUID]), 0.5), "."))
    if scene.walls and wall_colours(scene.walls)[1].any():
        entries.append(dot("heater", HEATER, "s"))
    if scene.sites:
        entries.append(dot("nucleation site", "white", "^", markeredgecolor="black"))
    return entries

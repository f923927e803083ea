"""Helpers shared by all pictures of particles: colours, the role of each array, and bounds of the scene."""
from types import SimpleNamespace

import numpy as np

from pysph_boiling import extras
from pysph_boiling.particles import NO_BUBBLE
from pysph_boiling.phases import Phase

__all__ = [
    "BUBBLE_COLOURS", "HEATER", "INK", "PHASE_COLOURS", "STATE_COLOURS", "UNLABELLED", "WALL", "bubble_colours",
    "by_role", "have_all", "inner_bounds", "is_vapour", "joined", "needed", "plan_outline", "positions", "to_rgb",
    "view_bounds", "wall_colours",
]

# Hue distinguishes liquid from vapour and lightness distinguishes the three warm states, so that colour-blind readers
# see four states too. Liquid that is held at T_sat is a pale green, which they see as a pale grey.
PHASE_COLOURS = {
    Phase.LIQUID: "#3B7EBF",
    Phase.TRANSITION: "#F6BD27",
    Phase.SUPERHEATED: "#EE8B3A",
    Phase.VAPOUR: "#C1121F",
}
# The states that are counted and drawn, named as in the columns n_<state>; "superheated" is liquid above T_sat.
STATE_COLOURS = {**{phase.name.lower(): colour for phase, colour in PHASE_COLOURS.items()}, "held": "#9CC9A3"}
BUBBLE_COLOURS = (
    "#CC3311", "#EE8800", "#D4B000", "#6B7A00", "#117733", "#0099A8", "#6A4C93", "#AA3377", "#E377A2", "#884411",
)
UNLABELLED, WALL, HEATER, INK = "#9AA0A6", "#C6CAD0", "#5A4A46", "#333A44"


def bubble_colours(labels):
    """Colours (n, 3) of bubbles by label, shape (n,): a hash of the label, so a bubble keeps its colour over time."""
    labels = np.asarray(labels).astype(np.uint64)
    hashed = (labels * np.uint64(2654435761)) % np.uint64(2**32) >> np.uint64(16)
    rgb = to_rgb(BUBBLE_COLOURS)[(hashed % np.uint64(len(BUBBLE_COLOURS))).astype(int)]
    rgb[labels == NO_BUBBLE] = to_rgb(UNLABELLED)
    return rgb


def needed(name, extra="view"):
    """Import the module ``name`` of an extra of setup.py; ``ModuleNotFoundError`` says how to install it."""
    return extras.needed(name, extra)


def by_role(arrays):
    """The arrays by role: lists ``fluid``, ``walls``, ``sites``. A fluid array may be empty, as in a dry vessel."""
    scene = SimpleNamespace(fluid=[], walls=[], sites=[])
    for name, pa in arrays.items():
        if "site" in name.lower():
            scene.sites.append(pa)
        elif "heated" in pa.properties or any(word in name.lower() for word in ("wall", "solid", "bound", "vessel")):
            scene.walls.append(pa)
        else:
            scene.fluid.append(pa)
    if not scene.fluid:
        raise ValueError(f"there is no fluid array to draw among the arrays {sorted(arrays)}")
    for role in (scene.walls, scene.sites):
        role[:] = [pa for pa in role if len(pa.x)]
    return scene


def joined(group, *names):
    """Properties of several arrays joined into one array, (n,) for one name and (n, len(names)) for more."""
    columns = [np.concatenate([np.asarray(getattr(pa, name)) for pa in group]) for name in names]
    return columns[0] if len(names) == 1 else np.column_stack(columns)


def have_all(group, *names):
    """Whether every array of a group has all of the properties."""
    return all(name in pa.properties for pa in group for name in names)


def positions(group):
    """Positions (n, 3) [m] of all particles of a group."""
    return joined(group, "x", "y", "z") if group else np.empty((0, 3))


def view_bounds(scene, spacing, dim):
    """Corners (2, 3) [m] of a box around walls and fluid that leaves out a few stray particles."""
    centre, walls = positions(scene.fluid), positions(scene.walls)
    if len(centre) == 0:
        centre = walls if len(walls) else np.zeros((1, 3))
    ends = np.nanquantile(centre, (0.002, 0.998), axis=0)
    if len(walls):
        ends = np.array([np.minimum(ends[0], walls.min(axis=0)), np.maximum(ends[1], walls.max(axis=0))])
    pad = np.full(3, 0.5 * spacing)
    pad[dim:] = 0.0
    return np.array([ends[0] - pad, ends[1] + pad])


def inner_bounds(walls, bounds, spacing):
    """Corners (2, 3) [m] of the space between the walls.

    On the axes through the middle, each wall ends at the first gap between its particles, seen from outside.
    """
    ends, middle, points = np.array(bounds), np.mean(bounds, axis=0), positions(walls)
    for k in range(3):
        ray = points[np.all(np.abs(np.delete(points - middle, k, axis=1)) <= spacing, axis=1), k]
        for end, sign in ((0, 1.0), (1, -1.0)):
            layers = np.sort(sign * ray)
            if len(layers) and layers[0] - sign * bounds[end, k] < spacing:
                last = layers[np.argmax(np.append(np.diff(layers), np.inf) > 1.5 * spacing)]
                ends[end, k] = sign * (last + 0.5 * spacing)
    return ends


def to_rgb(colours):
    """RGB colours (n, 3) from names or hex codes, or (3,) from a single one."""
    from matplotlib.colors import to_rgba_array

    rgb = to_rgba_array(colours)[:, :3]
    return rgb[0] if isinstance(colours, str) else rgb


def is_vapour(fluid):
    """Mask (n,) of vapour over the particles of a group."""
    if not have_all(fluid, "phase"):
        return np.zeros(len(joined(fluid, "x")), bool)
    return joined(fluid, "phase") == Phase.VAPOUR


def wall_colours(walls):
    """Colours (n, 3) of wall particles, and the mask (n,) of those that are heated."""
    heated = np.concatenate([
        np.asarray(pa.heated) == 1 if "heated" in pa.properties else np.zeros(len(pa.x), bool) for pa in walls])
    return to_rgb([WALL, HEATER])[heated.astype(int)], heated


def plan_outline(scene, bounds):
    """Plan (n, 2) [m] of the vessel: four corners, or a circle where no wall reaches into the corners."""
    (x0, y0), (x1, y1) = bounds[:, :2]
    middle, half = 0.5 * np.array([x0 + x1, y0 + y1]), 0.5 * np.array([x1 - x0, y1 - y0])
    walls = positions(scene.walls)
    if len(walls) and np.hypot(*(walls[:, :2] - middle).T).max() < 0.85 * np.hypot(*half):
        angle = np.linspace(0.0, 2.0 * np.pi, 96, endpoint=False)
        return middle + half * np.column_stack([np.cos(angle), np.sin(angle)])
    return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])

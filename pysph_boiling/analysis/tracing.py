"""Rays of light through clear water: reflection, refraction and absorption at the surfaces of water and vapour.

Embree finds the triangle that a ray hits, and NumPy does the rest. Each ray is followed from the eye: at a surface it
goes on refracted, or reflected where reflection is total, and what it would mirror there is taken from the surroundings
alone (Whitted 1980, with one ray instead of a tree).
"""
from types import SimpleNamespace

import numpy as np

from pysph_boiling.analysis.drawing import needed

__all__ = ["SOLID", "VAPOUR", "VESSEL", "WATER", "Surface", "World", "fresnel", "refracted", "trace"]

WATER, VAPOUR, VESSEL, SOLID = "water", "vapour", "vessel", "solid"
INDEX = 1.333  # of refraction of water over air or vapour
GLASS_INDEX = 1.5
TINT = np.array([0.035, 0.025, 0.028], dtype=np.float32)  # what a pane absorbs straight across
CLEAR = (WATER, VAPOUR, VESSEL)
BOUNCES = 16  # surfaces that a ray may meet
FAINT = 0.01  # a ray that carries less light than this is given up
TINY = 1e-12  # keeps quotients finite
CHUNK = 250_000  # rays that are followed together, which bounds the memory


class Surface(SimpleNamespace):
    """Triangles ``corners`` (m, 3, 3) [m] of one ``kind``, with unit ``normals`` (m, 3, 3) at their corners.

    Surfaces of water, vapour and the inside of a vessel are closed, and their triangles are seen anticlockwise from
    outside. There is water where it is inside a surface of water and the vessel, and not inside vapour. Upright faces
    of a vessel are thin glass. ``shade(points, normals)`` gives the colours (n, 3) of a solid at ``points`` (n, 3).
    ``paint`` gives a surface of vapour a coat: red, green, blue and share of it, for each triangle (m, 4).
    """

    def __init__(self, kind, corners, normals, *, shade=None, paint=None):
        super().__init__(kind=kind, corners=np.asarray(corners, dtype=np.float32),
                         normals=np.asarray(normals, dtype=np.float32), shade=shade, paint=paint)


def fresnel(cosine, ratio):
    """Reflected share (n,) of unpolarised light that meets a surface; 1 where reflection is total.

    ``cosine`` (n,) is that of the angle of incidence, in [0, 1], and ``ratio`` the index of refraction on the side of
    the ray over that on the other side. Source: Fresnel's equations.
    """
    sine2 = ratio**2 * (1.0 - cosine**2)
    through = np.sqrt(np.maximum(1.0 - sine2, 0.0))
    across = (ratio * cosine - through) / np.maximum(ratio * cosine + through, TINY)
    along = (cosine - ratio * through) / np.maximum(cosine + ratio * through, TINY)
    return np.where(sine2 >= 1.0, 1.0, 0.5 * (across**2 + along**2))


def refracted(directions, normals, cosine, ratio):
    """Unit directions (n, 3) behind a surface, by Snell's law; ``normals`` (n, 3) point against the rays.

    ``cosine`` and ``ratio`` are those of :func:`fresnel`; where reflection is total the result has no meaning.
    """
    ratio = np.broadcast_to(ratio, cosine.shape)
    through = np.sqrt(np.maximum(1.0 - ratio**2 * (1.0 - cosine**2), 0.0))
    out = ratio[:, None] * directions + (ratio * cosine - through)[:, None] * normals
    return out / np.linalg.norm(out, axis=1)[:, None]


def trace(world, origins, directions, surroundings, *, absorption, haze, body, gap):
    """Colours (n, 3) that are seen in a :class:`World` along rays that begin in air.

    The rays start at ``origins`` (n, 3) [m] in unit ``directions`` (n, 3). ``surroundings(points, directions)`` gives
    the colours (m, 3) of what lies behind all surfaces. In water each colour fades by its ``absorption`` (3,) [1/m],
    and the colour ``body`` (3,) comes in at the rate ``haze`` [1/m]. ``gap`` [m] is the distance by which a ray leaves
    a surface before it looks for the next.
    """
    light = SimpleNamespace(surroundings=surroundings, absorption=np.asarray(absorption, np.float32),
                            haze=np.float32(haze), body=np.asarray(body, np.float32), gap=np.float32(gap))
    origins, directions = (np.asarray(a, dtype=np.float32) for a in (origins, directions))
    seen = np.zeros((len(origins), 3), np.float32)
    for first in range(0, len(origins), CHUNK):
        part = slice(first, first + CHUNK)
        seen[part] = _followed(world, light, origins[part], directions[part])
    return seen


class World:
    """A list of :class:`Surface`, as Embree sees it: each is a geometry with its number in the list."""

    def __init__(self, surfaces):
        self.surfaces = surfaces
        self.scene = needed("embreex.rtcore_scene").EmbreeScene()
        mesh = needed("embreex.mesh_construction").TriangleMesh
        self.meshes = [mesh(self.scene, np.ascontiguousarray(surface.corners)) for surface in surfaces]

    def hits(self, origins, directions):
        """Geometry (-1 for none), triangle, distance [m] and two barycentric coordinates of each ray's first hit."""
        found = self.scene.run(np.ascontiguousarray(origins), np.ascontiguousarray(directions), query="INTERSECT",
                               output=True)
        return SimpleNamespace(geometry=found["geomID"], triangle=found["primID"], distance=found["tfar"],
                               facing=found["Ng"], weights=np.column_stack([found["u"], found["v"]]))


def _followed(world, light, origins, directions):
    n, seen = len(origins), np.zeros((len(origins), 3), np.float32)
    vessel = not any(surface.kind == VESSEL for surface in world.surfaces)  # without one, water is everywhere
    rays = SimpleNamespace(pixel=np.arange(n), origin=origins, direction=directions,
                           share=np.ones((n, 3), np.float32),
                           **{kind: np.full(n, kind == VESSEL and vessel, np.int8) for kind in CLEAR})
    for _ in range(BOUNCES):
        if not len(rays.pixel):
            return seen
        _step(world, light, rays, seen)
    seen[rays.pixel] += rays.share * light.body
    return seen


def _step(world, light, rays, seen):
    """Follow the rays to their next surface, and keep those that go on."""
    hit = world.hits(rays.origin, rays.direction)
    gone = hit.geometry < 0
    out = np.flatnonzero(gone)
    seen[rays.pixel[out]] += rays.share[out] * light.surroundings(rays.origin[out], rays.direction[out])
    _keep(rays, ~gone)
    _keep(hit, ~gone)
    wet = np.flatnonzero(_in_water(rays, slice(None)))
    length = hit.distance[wet, None]
    through = np.exp(-light.haze * length)
    seen[rays.pixel[wet]] += rays.share[wet] * (1.0 - through) * light.body
    rays.share[wet] *= through * np.exp(-light.absorption * length)
    rays.origin = rays.origin + hit.distance[:, None] * rays.direction
    going = np.ones(len(rays.pixel), bool)
    for number, surface in enumerate(world.surfaces):
        here = np.flatnonzero(hit.geometry == number)
        if not len(here):
            continue
        normals, cosine, entering = _orientation(surface, rays.direction[here], hit, here)
        if surface.kind == SOLID:
            seen[rays.pixel[here]] += rays.share[here] * surface.shade(rays.origin[here], normals)
            going[here] = False
            continue
        if surface.paint is not None:
            paint = surface.paint[hit.triangle[here]] * entering[:, None]
            seen[rays.pixel[here]] += rays.share[here] * paint[:, 3:] * paint[:, :3]
            rays.share[here] *= 1.0 - paint[:, 3:]
        _cross(surface, light, rays, seen, here, normals, cosine, entering)
    _keep(rays, going & (rays.share.max(axis=1) > FAINT))


def _keep(group, mask):
    for name, values in vars(group).items():
        setattr(group, name, values[mask])


def _in_water(rays, here):
    return (rays.water[here] > 0) & (rays.vessel[here] > 0) & (rays.vapour[here] <= 0)


def _orientation(surface, direction, hit, here):
    """Normals (n, 3) against the rays, cosines (n,) of the angles of incidence, and whether the rays enter, (n,)."""
    corners, (b, c) = surface.normals[hit.triangle[here]], hit.weights[here].T[:, :, None]
    normals = (1.0 - b - c) * corners[:, 0] + b * corners[:, 1] + c * corners[:, 2]
    flat = hit.facing[here] / np.linalg.norm(hit.facing[here], axis=1)[:, None]
    entering = np.einsum("ij,ij->i", flat, direction) < 0.0
    sign = np.where(entering, 1.0, -1.0).astype(np.float32)[:, None]
    normals = sign * normals / np.maximum(np.linalg.norm(normals, axis=1), TINY)[:, None]
    away = -np.einsum("ij,ij->i", normals, direction) < 1e-3  # the smooth normal is not on the side of the eye
    normals[away] = (sign * flat)[away]
    return normals, np.clip(-np.einsum("ij,ij->i", normals, direction), 1e-3, 1.0), entering


def _cross(surface, light, rays, seen, here, normals, cosine, entering):
    """Send the rays ``here`` through a clear surface, or back where reflection is total."""
    direction, place = rays.direction[here], rays.origin[here]
    mirrored = direction + 2.0 * cosine[:, None] * normals
    inside, change = getattr(rays, surface.kind), np.where(entering, 1, -1).astype(np.int8)
    before = _in_water(rays, here)
    inside[here] += change
    after = _in_water(rays, here)
    bends, ratio = before != after, np.where(before, INDEX, 1.0 / INDEX).astype(np.float32)
    share = np.where(bends, fresnel(cosine, ratio), 0.0)
    if surface.kind == VESSEL:
        once = fresnel(cosine, 1.0 / GLASS_INDEX)
        pane = ~bends & (np.abs(normals[:, 2]) < 0.5)
        share[pane] = (2.0 * once / (1.0 + once))[pane]  # of both faces of the pane
    total = bends & (share >= 1.0)
    inside[here[total]] -= change[total]
    mirror = np.where(before[:, None], light.body, 0.0).astype(np.float32)  # in water: what is around it there
    part = np.flatnonzero(~before & (share > 0.0))
    mirror[part] = light.surroundings(place[part], mirrored[part])
    weight = np.where(total, 0.0, share).astype(np.float32)[:, None]
    seen[rays.pixel[here]] += rays.share[here] * weight * mirror
    rays.share[here] *= 1.0 - weight
    if surface.kind == VESSEL:
        rays.share[here[pane]] *= np.exp(-TINT / cosine[pane, None])
    onward = np.where(bends[:, None], refracted(direction, normals, cosine, ratio), direction)
    onward = np.where(total[:, None], mirrored, onward).astype(np.float32)
    rays.direction[here], rays.origin[here] = onward, place + light.gap * onward

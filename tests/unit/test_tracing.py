"""Rays of light: laws of reflection, refraction and absorption by hand, and what a ray meets on its way."""
import numpy as np
import pytest

from pysph_boiling.analysis import tracing
from pysph_boiling.analysis.surface import _ball, _joined, _prism
from pysph_boiling.analysis.tracing import (
    INDEX,
    SOLID,
    TINT,
    VAPOUR,
    VESSEL,
    WATER,
    Surface,
    World,
    fresnel,
    refracted,
    trace,
)

DARK = dict(absorption=(0.0, 0.0, 0.0), haze=0.0, body=(0.0, 0.0, 0.0), gap=1e-5)
NORMAL = ((INDEX - 1.0) / (INDEX + 1.0)) ** 2  # reflected at normal incidence


def box(low, high, kind=WATER, **options):
    """A closed box with flat faces."""
    from types import SimpleNamespace

    (x0, y0, z0), (x1, y1, z1) = low, high
    outline = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], dtype=float)
    return Surface(kind, *_prism(SimpleNamespace(radius=None, axis=outline.mean(axis=0)), outline, z0, z1), **options)


def ball(centre, radius, kind, rings=200, **options):
    return _joined(kind, [_ball(np.asarray(centre, dtype=float), 4.0 / 3.0 * np.pi * radius**3, rings)], **options)


def white(points, directions):
    return np.ones((len(points), 3))


def whither(points, directions):
    """Colours that tell where rays go: their directions, made positive."""
    return 0.5 + 0.5 * directions


def along(*direction):
    direction = np.asarray(direction, dtype=float)
    return (direction / np.linalg.norm(direction))[None]


def seen(origin, direction, surfaces, room=white, **light):
    return trace(World(surfaces), np.array([origin], dtype=float), along(*direction), room, **{**DARK, **light})[0]


def test_fresnel_by_hand():
    assert fresnel(np.array([1.0]), 1.0 / INDEX) == pytest.approx(NORMAL)
    assert fresnel(np.array([1.0]), INDEX) == pytest.approx(NORMAL)
    assert fresnel(np.array([1e-6]), 1.0 / INDEX) == pytest.approx(1.0, abs=1e-4)
    brewster = np.cos(np.arctan(INDEX))  # light polarised along the plane of incidence is not reflected
    assert fresnel(np.array([brewster]), 1.0 / INDEX) == pytest.approx(0.5 * ((1 - INDEX**2) / (1 + INDEX**2)) ** 2)
    critical = np.sqrt(1.0 - INDEX**-2)
    assert np.all(fresnel(np.array([0.99 * critical, 0.0]), INDEX) == 1.0)
    assert 0.3 < fresnel(np.array([1.001 * critical]), INDEX) < 1.0


@pytest.mark.parametrize("ratio", [INDEX, 1.0 / INDEX, 1.0])
def test_refraction_obeys_snell(ratio):
    angle = np.linspace(0.0, 0.7, 8)
    rays = np.column_stack([np.sin(angle), np.zeros(8), -np.cos(angle)])
    out = refracted(rays, np.tile([0.0, 0.0, 1.0], (8, 1)), np.cos(angle), ratio)
    assert out[:, 0] == pytest.approx(ratio * np.sin(angle))
    assert np.linalg.norm(out, axis=1) == pytest.approx(np.ones(8))
    assert np.all(out[:, 2] < 0.0) and not out[:, 1].any()


def test_water_absorbs_and_reflects_at_both_faces():
    water = [box((0, 0, 0), (2, 3, 4))]
    colour = seen((1, -5, 2), (0, 1, 0), water, absorption=(0.1, 0.2, 0.4))
    through = np.exp(-3.0 * np.array([0.1, 0.2, 0.4]))
    assert colour == pytest.approx(NORMAL + (1 - NORMAL)**2 * through, abs=1e-5)
    hazy = seen((1, -5, 2), (0, 1, 0), water, haze=0.5, body=(0.0, 0.5, 1.0))
    left = np.exp(-1.5)
    within = (1 - NORMAL) * (1 - left) + (1 - NORMAL) * left * NORMAL  # scattered, and mirrored by the second face
    assert hazy == pytest.approx(NORMAL + (1 - NORMAL)**2 * left + np.array([0.0, 0.5, 1.0]) * within, abs=1e-5)


def test_light_leaves_a_plate_as_it_came():
    direction = along(1.0, 2.0, 0.5)[0]
    colour = seen((-0.5, -2, 0), direction, [box((-9, 0, -9), (9, 3, 9))], whither)
    share = float(fresnel(np.array([direction[1]]), 1.0 / INDEX)[0])
    mirrored = direction * [1, -1, 1]
    assert colour == pytest.approx(share * whither(0, mirrored) + (1 - share)**2 * whither(0, direction), abs=1e-5)


@pytest.mark.parametrize("offset", [0.0, 0.3, 0.6, 0.74, 0.76, 0.9])
def test_bubble_bends_light_as_geometry_says(offset):
    """Rays that miss the middle of a ball of vapour in water by ``offset`` radii; total reflection from 1/INDEX."""
    around, bubble = box((-50, -50, -50), (50, 50, 50)), ball((0, 0, 0), 1.0, VAPOUR)
    outside = box((-60, -60, -60), (60, 60, 60), SOLID, shade=lambda points, normals: 0.5 + points / 200.0)
    world = World([around, bubble])
    rays = tracing.SimpleNamespace(
        pixel=np.arange(1), origin=np.array([[offset, -5, 0]], np.float32), direction=np.array([[0, 1, 0]], np.float32),
        share=np.ones((1, 3), np.float32), water=np.ones(1, np.int8), vapour=np.zeros(1, np.int8),
        vessel=np.ones(1, np.int8))
    light = tracing.SimpleNamespace(surroundings=white, absorption=np.zeros(3), haze=0.0, body=np.zeros(3), gap=1e-5)
    canvas, inside, outside = np.zeros((1, 3), np.float32), np.arcsin(offset), np.arcsin(min(offset * INDEX, 1.0))
    tracing._step(world, light, rays, canvas)
    if offset * INDEX > 1.0:
        turned = np.pi - 2.0 * inside
        assert rays.share[0] == pytest.approx(np.ones(3)) and rays.vapour[0] == 0
    else:
        assert rays.vapour[0] == 1
        tracing._step(world, light, rays, canvas)
        turned = 2.0 * (outside - inside)
        share = 1.0 - float(fresnel(np.array([np.cos(inside)]), INDEX)[0])
        assert rays.share[0] == pytest.approx(np.full(3, share**2), abs=0.01) and rays.vapour[0] == 0
    assert rays.direction[0] == pytest.approx([np.sin(turned), np.cos(turned), 0.0], abs=0.03)


def test_vapour_does_not_absorb():
    water = [box((-2, 0, -2), (2, 3, 2)), box((-1, 1, -1), (1, 2, 1), VAPOUR)]
    colour = seen((0, -5, 0), (0, 1, 0), water, absorption=(0.3, 0.3, 0.3))
    within = (1 - NORMAL)**2 * np.exp(-0.3) * NORMAL  # the far side of the bubble mirrors the room
    assert colour == pytest.approx(NORMAL + within + (1 - NORMAL)**4 * np.exp(-0.6), abs=1e-5)
    low = seen((0, -5, 1.5), (0, 1, 0), water, absorption=(0.3, 0.3, 0.3))  # passes below the vapour
    assert low == pytest.approx(NORMAL + (1 - NORMAL)**2 * np.exp(-0.9), abs=1e-5)


def test_vessel_cuts_the_water_and_is_glass():
    water, vessel = box((-2, -9, -2), (2, 9, 1)), box((-2, 0, -2), (2, 3, 4), VESSEL)
    colour = seen((0, -20, 0), (0, 1, 0), [water, vessel], absorption=(0.3, 0.3, 0.3))
    assert colour == pytest.approx(NORMAL + (1 - NORMAL)**2 * np.exp(-0.9), abs=1e-5)
    glass = 2 * 0.04 / 1.04  # of both faces of a pane with an index of 1.5
    dry = seen((0, -20, 3), (0, 1, 0), [water, vessel])
    left = (1 - glass) * np.exp(-TINT)  # by each pane
    assert dry == pytest.approx(glass + left * (glass + left), abs=1e-5)
    black = trace(World([water, vessel]), np.array([[0.0, -20, 3]]), along(0, 1, 0),
                  lambda points, directions: np.where(directions[:, 1:2] > 0.0, 1.0, 0.0) * np.ones(3), **DARK)[0]
    assert black == pytest.approx(left**2, abs=1e-5)  # what a pane mirrors is behind the eye
    from_above = seen((0, 1, 20), (0, 0, -1), [water, vessel])  # the open top is no pane
    assert from_above == pytest.approx(NORMAL + (1 - NORMAL)**2, abs=1e-5)


def test_surfaces_in_each_other_do_not_count_twice():
    pool, drop = box((-2, 0, -2), (2, 3, 2)), box((-1, 1, -1), (1, 2, 1))
    colour = seen((0, -5, 0), (0, 1, 0), [pool, drop], absorption=(0.3, 0.3, 0.3))
    assert colour == pytest.approx(NORMAL + (1 - NORMAL)**2 * np.exp(-0.9), abs=1e-5)
    poking = box((-1, -1, -1), (1, 1, 1), VAPOUR)  # a bubble that is halfway out of the pool
    colour = seen((0, -5, 0), (0, 1, 0), [pool, poking], absorption=(0.3, 0.3, 0.3))
    assert colour == pytest.approx(NORMAL + (1 - NORMAL)**2 * np.exp(-0.6), abs=1e-5)


def test_solid_hides_what_is_behind_it_and_paint_covers_vapour():
    red = box((-1, 1, -1), (1, 2, 1), SOLID, shade=lambda points, normals: np.tile([1.0, 0.0, 0.0], (len(points), 1)))
    assert seen((0, -5, 0), (0, 1, 0), [red]) == pytest.approx([1.0, 0.0, 0.0])
    assert seen((0, -5, 3), (0, 1, 0), [red]) == pytest.approx([1.0, 1.0, 1.0])
    painted = box((-1, 1, -1), (1, 2, 1), VAPOUR, paint=np.tile([0.0, 1.0, 0.0, 0.6], (16, 1)))
    black = trace(World([painted]), np.array([[0.0, -5, 0]]), along(0, 1, 0),
                  lambda points, directions: np.zeros((len(points), 3)), **DARK)[0]
    assert black == pytest.approx([0.0, 0.6, 0.0])
    assert seen((0, -5, 0), (0, 1, 0), [painted]) == pytest.approx([0.4, 1.0, 0.4])  # what the coat lets through


def test_result_does_not_depend_on_the_chunks(monkeypatch):
    world = World([box((-2, 0, -2), (2, 3, 2)), ball((0, 1.5, 0), 1.0, VAPOUR, rings=12)])
    x, z = np.meshgrid(np.linspace(-2.5, 2.5, 20), np.linspace(-2.5, 2.5, 20))
    origins = np.column_stack([x.ravel(), np.full(400, -5.0), z.ravel()])
    directions = np.tile([0.0, 1.0, 0.0], (400, 1))
    whole = trace(world, origins, directions, whither, **DARK)
    monkeypatch.setattr(tracing, "CHUNK", 37)
    assert np.array_equal(trace(world, origins, directions, whither, **DARK), whole)
    assert len(np.unique(whole.round(4), axis=0)) > 30

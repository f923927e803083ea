"""Rooms: signed distances of shapes, on a grid and off it, what is left beside obstacles, and the walls around."""
import numpy as np
import pytest

from pysph_boiling import rooms
from pysph_boiling.rooms import Room, ball, box, cylinder, wall_points

DX = 0.01
SHAPES = {  # shape -> its volume [m^dim], dimension
    "box": (box((0.0, 0.0, 0.0), (0.2, 0.1, 0.15)), 0.2 * 0.1 * 0.15, 3),
    "ball": (ball((0.0, 0.1, 0.2), 0.1), 4.0 / 3.0 * np.pi * 0.1**3, 3),
    "cylinder": (cylinder((0.0, 0.0, 0.0), 0.08, 0.2), np.pi * 0.08**2 * 0.2, 3),
    "lying cylinder": (cylinder((0.0, 0.0, 0.1), 0.08, 0.2, axis="x"), np.pi * 0.08**2 * 0.2, 3),
    "rectangle": (box((0.0, 0.0), (0.2, 0.1), 2), 0.2 * 0.1, 2),
    "disc": (ball((0.05, 0.05), 0.1, 2), np.pi * 0.1**2, 2),
    "box with a ball": (box((-0.1,) * 3, (0.1,) * 3).without([ball((0.0, 0.0, 0.0), 0.06)]),
                        0.2**3 - 4.0 / 3.0 * np.pi * 0.06**3, 3),
}


def cloud(shape, dim, n=2000):
    points = np.zeros((n, 3))
    points[:, :dim] = np.random.default_rng(0).uniform(shape.lower - 2 * DX, shape.upper + 2 * DX, (n, 3))[:, :dim]
    return points


def test_distances_are_those_to_the_nearest_point_of_the_surface():
    at = np.array([[0.05, 0.05, 0.02], [0.25, 0.05, 0.05], [0.23, 0.14, 0.05], [0.3, 0.2, 0.25]])
    np.testing.assert_allclose(SHAPES["box"][0].distance(at), [0.02, -0.05, -0.05, -np.sqrt(0.03)])
    at = np.array([[0.0, 0.1, 0.25], [0.0, 0.1, 0.35]])
    np.testing.assert_allclose(SHAPES["ball"][0].distance(at), [0.05, -0.05], atol=1e-15)
    at = np.array([[0.0, 0.05, 0.1], [0.0, 0.0, -0.03], [0.11, 0.0, 0.24], [0.0, 0.09, 0.1]])
    np.testing.assert_allclose(SHAPES["cylinder"][0].distance(at), [0.03, -0.03, -0.05, -0.01])
    np.testing.assert_allclose(SHAPES["lying cylinder"][0].distance(at[:, [2, 0, 1]] + [0, 0, 0.1]),
                               SHAPES["cylinder"][0].distance(at[:, [0, 1, 2]]), atol=1e-15)
    at = np.array([[0.0, 0.0, 0.02], [0.08, 0.0, 0.0], [0.0, 0.0, 0.095]])
    np.testing.assert_allclose(SHAPES["box with a ball"][0].distance(at), [-0.04, 0.02, 0.005])


@pytest.mark.parametrize("name", SHAPES)
def test_a_room_has_the_distances_of_its_shape_and_its_volume(name):
    shape, volume, dim = SHAPES[name]
    room, at = Room.of(shape, spacing=DX), cloud(shape, dim)
    error = np.abs(room(at) - shape.distance(at))
    assert error.max() <= 0.55 * DX and error.mean() <= 0.03 * DX  # an edge is rounded
    assert room.volume == pytest.approx(volume, rel=2e-3 if name == "box with a ball" else 1e-12)
    step = 1e-6
    differences = np.stack([(room(at + shift) - room(at - shift)) / (2.0 * step) for shift in step * np.eye(3)], -1)
    off = np.abs(room.gradient(at) - differences).max(axis=1)
    assert np.quantile(off, 0.99) < 1e-8  # but where a difference reaches across the border of a cell
    assert dim == 3 or not room.gradient(at)[:, 2].any()


@pytest.mark.parametrize("name", SHAPES)
def test_walls_stand_in_layers_around_a_room(name):
    shape, _, dim = SHAPES[name]
    room = Room.of(shape, spacing=DX)
    walls = wall_points(room, spacing=DX, layers=2)
    depth = -room(walls) / DX
    assert np.mean(np.abs(depth - np.round(depth - 0.5) - 0.5) < 0.02) > 0.99
    assert set(np.round(depth - 0.5)) == {0.0, 1.0}
    first = walls[depth < 1.0]
    surface = np.zeros((400, 3))
    surface[:, :dim] = cloud(shape, dim, 400)[:, :dim]
    surface = room.moved(surface, 0.0)
    nearest = np.linalg.norm(first[None] - surface[:, None], axis=2).min(axis=1) / DX
    assert nearest.max() < 1.25 and np.quantile(nearest, 0.95) < 1.0  # a hole would be larger
    assert dim == 3 or not walls[:, 2].any()


def test_walls_of_an_aligned_box_are_a_lattice():
    room = Room.of(box((0.0,) * 3, (0.1, 0.1, 0.1)), spacing=DX)
    walls = wall_points(room, spacing=DX, layers=1)
    floor = walls[(walls[:, 2] < 0.0) & (np.abs(walls[:, :2] - 0.05).max(axis=1) < 0.05)]
    assert len(floor) == 100
    np.testing.assert_allclose(floor / DX % 1.0, 0.5, atol=1e-9)
    places = room.places(DX)
    assert len(places) == 1000
    np.testing.assert_allclose(places / DX % 1.0, 0.5, atol=1e-9)


def test_large_rooms_are_made_in_parts(monkeypatch):
    shape, _, _ = SHAPES["ball"]
    room, at = Room.of(shape, spacing=DX), cloud(shape, 3)
    whole = room(at), wall_points(room, spacing=DX), room.places(DX), room.volume
    monkeypatch.setattr(rooms, "CHUNK", 97)
    again = Room.of(shape, spacing=DX)
    for one, other in zip(whole, (again(at), wall_points(again, spacing=DX), again.places(DX), again.volume)):
        np.testing.assert_allclose(one, other, rtol=1e-12)


@pytest.mark.parametrize(("make", "message"), [
    (lambda: box((0, 0, 0), (1, 0, 1)), "lower corner of a box must be below the upper one"),
    (lambda: box((0, 0), (1, 1, 1)), r"lower corner of a box must be 3 finite lengths \[m\], got \[0.0, 0.0\]"),
    (lambda: ball((0, 0, np.nan), 1.0), "centre of a sphere must be 3 finite lengths"),
    (lambda: ball((0, 0, 0), -1.0), "radius of a sphere must be > 0 m, got -1.0 m"),
    (lambda: cylinder((0, 0, 0), 1.0, 1.0, axis="w"), "axis of a cylinder must be 'x', 'y' or 'z', got 'w'"),
    (lambda: Room.of(box((0,) * 3, (0.1,) * 3).without([ball((0.05,) * 3, 0.2)]), spacing=DX), "no room for fluid"),
    (lambda: Room.of(box((0,) * 3, (100.0,) * 3), spacing=DX), "in metres, and not in millimetres"),
    (lambda: Room.of(box((0,) * 3, (1.0,) * 3), spacing=0.0), "spacing must be > 0 m"),
])
def test_shapes_that_cannot_be_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()

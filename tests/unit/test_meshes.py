"""Vessels from files: distances, walls and heaters of a flask; where a mesh that is no vessel has its fault."""
import sys

import numpy as np
import pytest
import trimesh
from flask import FLASK, VOLUME, flask, write
from pysph.base.kernels import CubicSpline
from trimesh.proximity import signed_distance

from pysph_boiling import meshes
from pysph_boiling.meshes import mesh_room, mesh_shape, mesh_vessel, patch_mask
from pysph_boiling.particles import positions

DX, RHO0 = 0.004, 958.0


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return write(FLASK, tmp_path_factory.mktemp("mesh") / "flask.stl")


def test_distances_are_those_of_the_mesh(path):
    at = np.random.default_rng(0).uniform(FLASK.bounds[0] - DX, FLASK.bounds[1] + DX, (500, 3))
    exact = signed_distance(FLASK, at)
    near = np.abs(exact) < 3.0 * DX
    assert near.sum() > 100 and (exact > 0).sum() > 100 and (exact < 0).sum() > 100
    found = mesh_shape(path, spacing=DX).distance(at)
    assert np.abs(found - exact)[near].max() <= 0.05 * DX
    np.testing.assert_array_equal(found > 0.0, exact > 0.0)
    room = mesh_room(path, spacing=DX)
    assert np.abs(room(at) - exact)[near].max() <= 0.5 * DX  # of edges, which the grid rounds
    assert np.abs(room(at) - exact)[near].mean() <= 0.05 * DX


def test_a_room_has_the_volume_of_its_flask(path):
    room = mesh_room(path, spacing=DX)
    assert room.volume == pytest.approx(VOLUME, rel=0.004)  # 48 sections have 0.3 % less
    at = np.random.default_rng(1).uniform(room.lower, room.upper, (100000, 3))
    assert np.mean(room(at) > 0.0) * np.prod(room.upper - room.lower) == pytest.approx(VOLUME, rel=0.02)


def test_lengths_are_scaled_and_a_room_is_made_once(path, tmp_path):
    millimetres = write(flask(1000.0), tmp_path / "mm.ply")
    room = mesh_room(millimetres, spacing=DX, scale=1e-3)
    assert room.volume == pytest.approx(mesh_room(path, spacing=DX).volume, rel=1e-4)  # PLY has single precision
    assert mesh_room(millimetres, spacing=DX, scale=1e-3) is room
    with pytest.raises(ValueError, match=r"size of 95 x 95 x 100 m, too large .* in metres, and not in millimetres"):
        mesh_room(millimetres, spacing=DX)
    with pytest.raises(ValueError, match="less than 3 spacings of 0.004 m: is it in metres?"):
        mesh_room(path, spacing=DX, scale=1e-3)


def test_walls_weigh_what_they_stand_for_and_are_heated_where_asked(path, tmp_path):
    common = dict(spacing=DX, rho0=RHO0, kernel=CubicSpline(dim=3))
    wall = mesh_vessel(path, heated=lambda at: at[:, 2] < 0.001, **common)
    at, room = positions(wall), mesh_room(path, spacing=DX)
    assert np.all(room(at) < -0.4 * DX) and np.all(room(at) > -2.0 * DX)
    hot = wall.heated == 1
    assert np.all(at[hot, 2] < 0.001) and np.all(room(at[hot]) > -DX)
    ring = 2.0 * np.pi * 0.045 * DX  # those at the edge
    assert hot.sum() * DX**2 == pytest.approx(np.pi * 0.045**2 + ring, rel=0.1)  # one layer of the floor
    disc = trimesh.creation.cylinder(radius=0.02, height=1e-3)
    patch = write(disc, tmp_path / "patch.stl")
    part = mesh_vessel(path, heated=patch, **common)
    hot = part.heated == 1
    assert 0 < hot.sum() * DX**2 < 1.5 * np.pi * 0.024**2 and np.hypot(*positions(part)[hot, :2].T).max() < 0.025
    assert not mesh_vessel(path, **common).heated.any()
    mask = patch_mask(patch, np.array([[0.0, 0.0, 0.002], [0.0, 0.0, 0.01], [0.0, 0.03, 0.0]]), spacing=DX)
    assert mask.tolist() == [True, False, False]


def faulty(name):
    if name == "hole":
        faces = np.delete(FLASK.faces, np.argmax(FLASK.triangles_center[:, 2]), axis=0)
        return trimesh.Trimesh(FLASK.vertices, faces)
    if name == "fin":  # a third face at an edge
        edge = FLASK.edges[0]
        top = FLASK.vertices[edge].mean(axis=0) + [0.0, 0.0, 0.02]
        return trimesh.Trimesh(np.vstack([FLASK.vertices, top]), np.vstack([FLASK.faces, [*edge, len(FLASK.vertices)]]))
    if name == "glass":  # the solid walls of a beaker, not its inside
        return trimesh.creation.annulus(r_min=0.04, r_max=0.042, height=0.08)
    if name == "two":
        return trimesh.util.concatenate([
            trimesh.creation.box((0.04,) * 3), trimesh.creation.box((0.04,) * 3).apply_translation((0.1, 0.0, 0.0))])
    return FLASK


@pytest.mark.parametrize(("fault", "message"), [
    ("hole", r"is not closed: it has holes: 3 edges belong to one face only, at \(.*, 0.1\), .* m"),
    ("fin", r"is not closed: .* at \("),
    ("glass", r"is 0.00\d+ m wide at \(.*\) m, and 3 spacings of 0.004 m must fit in: .* not of its solid walls"),
    ("two", r"has 2 parts that are not connected at a spacing of 0.004 m; the smallest one is at \("),
])
def test_meshes_that_are_no_vessel_are_refused_with_the_place(fault, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        mesh_room(write(faulty(fault), tmp_path / "mesh.stl"), spacing=DX)


def test_a_wall_that_is_too_thin_is_refused_with_the_place(tmp_path):
    outer, inner = trimesh.creation.box((0.08,) * 3), trimesh.creation.box((0.002, 0.05, 0.05))
    inner.invert()
    mesh = write(trimesh.util.concatenate([outer, inner]), tmp_path / "baffle.stl")
    with pytest.raises(ValueError, match=r"is 0.002 m thick at \(.*\) m, and must be 1 spacing of 0.004 m at least"):
        mesh_room(mesh, spacing=DX)
    room = mesh_room(mesh, spacing=0.5 * DX)  # where it is as thick as a particle
    assert room(np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]])) == pytest.approx([-0.001, 0.009], abs=0.0005)


def test_files_that_are_no_meshes_are_refused(tmp_path):
    (tmp_path / "text.stl").write_text("solid")
    (tmp_path / "notes.txt").write_text("no mesh")
    for name in ("text.stl", "notes.txt"):
        with pytest.raises(ValueError, match="is not a mesh that can be read|holds no triangles"):
            mesh_room(tmp_path / name, spacing=DX)
    with pytest.raises(FileNotFoundError):
        mesh_room(tmp_path / "missing.stl", spacing=DX)
    with pytest.raises(ValueError, match="scale of a mesh must be > 0, got 0"):
        mesh_room(tmp_path / "text.stl", spacing=DX, scale=0.0)


def test_a_missing_package_says_how_to_get_it(monkeypatch, path):
    meshes._room.cache_clear()
    meshes._loaded.cache_clear()
    monkeypatch.setitem(sys.modules, "rtree", None)
    with pytest.raises(ModuleNotFoundError, match=r"rtree is missing: pip install 'pysph_boiling\[mesh\]'"):
        mesh_room(path, spacing=DX)

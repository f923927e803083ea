"""The rendered view: its surfaces hold what the particles hold, and its pictures show what is there."""
import json
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.image import imread
from standin import cloud

from pysph_boiling.analysis import surface
from pysph_boiling.analysis.drawing import bubble_colours
from pysph_boiling.analysis.rendering import render_run
from pysph_boiling.analysis.surface import draw_surface
from pysph_boiling.cli import main
from pysph_boiling.phases import Phase

DX = 0.01
N = 10  # edge of the vessel, in spacings
FILL = 7  # height of the water, in spacings
SIZE = (200, 160)
VESSEL = DX * np.array([[0.0, 0.0, 0.0], [N, N, 1.5 * N]])
FAR = np.array([0.3, -1.0, 0.5])


def block(*shape, low=(0, 0, 0)):
    return DX * (np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1).reshape(-1, 3) + low + 0.5)


def ball(centre, radius, points):
    return np.linalg.norm(points - DX * np.asarray(centre), axis=1) < radius * DX


def glass(water, *, heated=True, **properties):
    """Water in an open vessel with one layer of wall, its base heated in the middle, one site."""
    grid = block(N + 2, N + 2, int(1.5 * N) + 1, low=(-1, -1, -1))
    wall = grid[~np.all((grid > VESSEL[0]) & (grid[:, :] < [N * DX, N * DX, 1.0]), axis=1)]
    middle = np.all(np.abs(wall[:, :2] - 0.5 * N * DX) < 0.3 * N * DX, axis=1) & (wall[:, 2] < 0.0)
    return {"fluid": cloud(water, **properties), "wall": cloud(wall, heated=(middle & heated).astype(int)),
            "sites": cloud([[0.7 * N * DX, 0.3 * N * DX, 0.0]])}


def volume(*meshes):
    return sum(surface._volumes(mesh.points, mesh.triangles).sum() for mesh in meshes)


def fluid(points, phase=0, label=0, swell=1.0):
    n = len(points)
    return SimpleNamespace(points=points, vapour=np.broadcast_to(phase, n) == Phase.VAPOUR,
                           label=np.broadcast_to(label, n), swell=np.broadcast_to(float(swell), n))


WALLED = np.array([[True, True, True], [True, True, False]])


def water(points):
    return surface._water(fluid(points), DX, VESSEL, walled=WALLED, eye=FAR, depth=lambda x: np.zeros(len(x)))


@pytest.mark.parametrize("slope", [0.0, 0.6])
def test_water_has_the_volume_of_its_particles_and_stays_in_the_vessel(slope):
    points = block(N, N, 12)
    points = points[points[:, 2] < (FILL - slope * N / 2) * DX + slope * points[:, 0]]
    parts = water(points)
    assert volume(*parts) == pytest.approx(len(points) * DX**3, rel=0.03)
    places = np.concatenate([part.points[np.unique(part.triangles)] for part in parts])
    assert np.all((places >= VESSEL[0]) & (places[:, :] <= [N * DX, N * DX, 1.0]))
    assert places.min(axis=0) == pytest.approx(VESSEL[0], abs=1e-15)  # wets base and walls, at once
    free = parts[0].points
    level = (FILL - slope * N / 2) * DX + slope * free[:, 0]
    assert np.abs(free[:, 2] - level).max() < 1.0 * DX  # meets the walls as it stands: no rounded edge


def test_hollows_inside_are_not_surface():
    points = block(N, N, FILL)
    hollow = points[~ball((5, 5, 3.5), 2.2, points)]
    full = volume(*water(points))
    assert volume(*water(hollow)) == pytest.approx(full, rel=0.01)
    mesh = surface._reconstruct(hollow, DX)
    assert len(np.unique(mesh.piece[mesh.triangles])) == 1 < len(np.unique(mesh.piece))


@pytest.mark.parametrize("n", [1, 2, 8, 57])
def test_bubble_has_the_volume_of_its_vapour(n):
    points = block(5, 5, 5)
    points = points[np.argsort(np.linalg.norm(points - 2.4 * DX, axis=1), kind="stable")[:n]]
    for swell in (1.0, 4.0):
        mesh = surface._bubble(np.cbrt(swell) * points, swell * n * DX**3)
        assert volume(mesh) == pytest.approx(swell * n * DX**3, rel=1e-9)
        middle = mesh.points[np.unique(mesh.triangles)].mean(axis=0)
        assert middle == pytest.approx(np.cbrt(swell) * points.mean(axis=0), abs=0.4 * DX)
    apart = surface._bubble(np.concatenate([points, points + 20 * DX]), 2 * n * DX**3)
    assert volume(apart) == pytest.approx(2 * n * DX**3, rel=1e-9)
    for shift in (0.0, 20 * DX):  # each piece grew where it is
        piece = apart.points[np.abs(apart.points[:, 0] - 2.4 * DX - shift) < 8 * DX]
        assert piece.mean(axis=0) == pytest.approx(points.mean(axis=0) + shift, abs=0.4 * DX)


def test_bubbles_are_told_apart_by_label():
    points = block(N, N, FILL)
    one, two = ball((3, 5, 4), 1.6, points), ball((6, 5, 4), 1.6, points)
    phase = np.where(one | two, Phase.VAPOUR, Phase.LIQUID)
    options = dict(eye=FAR, depth=lambda x: np.zeros(len(x)))
    parts = surface._bubbles(fluid(points, phase, np.where(one, 3, 4)), DX, VESSEL, None, **options)
    middles = [0.5 * (part.points.min(axis=0) + part.points.max(axis=0))[0] for part in parts]
    assert middles == pytest.approx([3 * DX, 6 * DX], abs=0.4 * DX)
    assert len(surface._bubbles(fluid(points, phase), DX, VESSEL, None, **options)) == 1
    assert surface._bubbles(fluid(points), DX, VESSEL, None, **options) == []


def test_path_in_water_is_the_length_to_the_eye():
    points = block(12, 12, 12)
    depth = surface._path_in_water(points, DX, np.array([0.06, -100.0, 0.06]))
    assert depth(np.array([[0.06, 0.12, 0.06]]))[0] == pytest.approx(1.0, abs=0.12)  # the edge of the cube
    assert depth(np.array([[0.06, 0.06, 0.06]]))[0] == pytest.approx(0.5, abs=0.12)
    assert depth(np.array([[0.06, 0.00, 0.06]]))[0] == pytest.approx(0.0, abs=0.06)
    scaled = surface._path_in_water(100.0 * points, 100.0 * DX, np.array([6.0, -1e4, 6.0]))
    assert scaled(np.array([[6.0, 12.0, 6.0]])) == pytest.approx(depth(np.array([[0.06, 0.12, 0.06]])))


@pytest.mark.parametrize("size", [(1280, 960), (400, 900)])
@pytest.mark.parametrize("edges", [(1.0, 1.0, 1.5), (7.0, 0.5, 2.0)])
def test_camera_holds_the_vessel(edges, size):
    box = np.array([[0.0, 0.0, 0.0], edges]) + 3.0
    camera = surface._camera(box, size)
    forward = (camera.target - camera.eye) / np.linalg.norm(camera.target - camera.eye)
    right = np.cross(forward, camera.up)
    corners = np.array([[box[i, 0], box[j, 1], box[k, 2]] for i, j, k in np.ndindex(2, 2, 2)]) - camera.eye
    height = np.tan(np.radians(0.5 * surface.LENS))
    seen = np.column_stack([corners @ right / (height * size[0] / size[1]), corners @ camera.up / height])
    seen /= (corners @ forward)[:, None]  # -1 .. 1 is the picture
    assert np.abs(seen).max() == pytest.approx(0.9, abs=1e-3)
    assert seen.max(axis=0) == pytest.approx(-seen.min(axis=0), abs=1e-3)


def place(point, size=SIZE):
    """Pixel (column, row) where a place [m] of the vessel is seen."""
    box = np.array([VESSEL[0] - [0.0, 0.0, surface.SLAB_HEIGHT * DX], DX * np.array([N, N, 1.5 * N])])
    camera = surface._camera(box, size)
    forward = (camera.target - camera.eye) / np.linalg.norm(camera.target - camera.eye)
    ray = np.asarray(point) - camera.eye
    ray = ray / (ray @ forward) / np.tan(np.radians(0.5 * surface.LENS))
    across, up = ray @ np.cross(forward, camera.up), ray @ camera.up
    return int(0.5 * (size[0] + size[1] * across)), int(0.5 * size[1] * (1.0 - up))


def at(picture, point):
    column, row = place(point)
    return picture[row, column, :3]


def test_picture_shows_water_bubble_heater_and_nothing_else(tmp_path, capfd, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    points = block(N, N, FILL)
    where = np.array([0.4, 0.4, 0.45]) * N * DX
    vapour = ball(where / DX, 1.9, points)
    phases = {"calm": 0, "boiling": np.where(vapour, Phase.VAPOUR, Phase.LIQUID)}
    calm, boiling = (imread(draw_surface(
        glass(points, phase=phase, bubble=7), tmp_path / f"{name}.png", dim=3, spacing=DX, size=SIZE))
        for name, phase in phases.items())
    assert capfd.readouterr() == ("", "")  # no word about the display that is not there
    assert calm.shape[:2] == (SIZE[1], SIZE[0])

    changed = np.abs(calm - boiling).max(axis=-1) > 0.02
    rows, columns = np.nonzero(changed)
    assert (np.median(columns), np.median(rows)) == pytest.approx(place(where), abs=3)
    scale = abs(place(where + [0.0, 0.0, DX])[1] - place(where)[1])  # [pixel] of a spacing
    area = np.pi * (3.0 * vapour.sum() / (4.0 * np.pi))**(2.0 / 3.0) * scale**2
    assert changed.sum() == pytest.approx(area, rel=0.25)
    assert at(boiling, where).sum() > at(calm, where).sum()  # steam is brighter than the water

    red, _, blue = at(calm, [0.5 * N * DX, 0.9 * N * DX, 0.3 * N * DX])
    assert blue > red + 0.2
    air = at(calm, [0.5 * N * DX, 0.5 * N * DX, 1.3 * N * DX])
    assert np.ptp(air) < 0.1 and air.min() > 0.8
    cold = imread(draw_surface(glass(points, heated=False), tmp_path / "cold.png", dim=3, spacing=DX, size=SIZE))
    base = [0.3 * N * DX, 0.3 * N * DX, 0.0]
    assert at(calm, base)[0] - at(calm, base)[2] > 0.1 + at(cold, base)[0] - at(cold, base)[2]
    plain = {name: pa for name, pa in glass(points).items() if name != "sites"}
    bare = imread(draw_surface(plain, tmp_path / "bare.png", dim=3, spacing=DX, size=SIZE))
    rows, columns = np.nonzero(np.abs(calm - bare).max(axis=-1) > 0.02)
    assert (np.median(columns), np.median(rows)) == pytest.approx(place([0.7 * N * DX, 0.3 * N * DX, 0.0]), abs=2)


def test_colour_by_bubble(tmp_path):
    points = block(N, N, FILL)
    where = np.array([0.4, 0.4, 0.45]) * N * DX
    phase = np.where(ball(where / DX, 1.9, points), Phase.VAPOUR, Phase.LIQUID)
    labels = np.arange(50)
    colours = bubble_colours(labels)
    red, blue = labels[np.argmax(colours[:, 0] - colours[:, 2])], labels[np.argmax(colours[:, 2] - colours[:, 0])]
    seen = [at(imread(draw_surface(glass(points, phase=phase, bubble=label), tmp_path / "b.png", dim=3, spacing=DX,
                                   size=SIZE, colour="bubble")), where) for label in (red, blue)]
    assert seen[0][0] - seen[0][2] > seen[1][0] - seen[1][2] + 0.3


def test_no_walls_and_particles_lost_far_away(tmp_path):
    drop = block(6, 6, 6)
    alone = imread(draw_surface({"fluid": cloud(drop)}, tmp_path / "drop.png", dim=3, spacing=DX, size=SIZE))
    assert np.mean(alone[..., 2] - alone[..., 0] > 0.2) > 0.05  # water
    bounds = np.array([drop.min(axis=0), drop.max(axis=0)])
    lost = np.concatenate([drop, [[1e6, 0.0, 0.0], [np.nan, 0.0, 0.0]]])
    pictures = [imread(draw_surface({"fluid": cloud(points)}, tmp_path / "lost.png", dim=3, spacing=DX, size=SIZE,
                                    bounds=bounds)) for points in (drop, lost)]
    assert np.array_equal(*pictures)


def test_windows_are_closed(tmp_path):
    from pyvista.plotting.plotter import _ALL_PLOTTERS

    before = set(_ALL_PLOTTERS)
    draw_surface({"fluid": cloud(block(3, 3, 3))}, tmp_path / "drop.png", dim=3, spacing=DX, size=(40, 30), t=1.0)
    with pytest.raises(FileNotFoundError):
        draw_surface({"fluid": cloud(block(3, 3, 3))}, tmp_path / "no" / "drop.png", dim=3, spacing=DX, size=(40, 30))
    assert set(_ALL_PLOTTERS) == before


@pytest.mark.parametrize(("options", "message"), [
    ({"dim": 2}, "three dimensions"), ({"colour": "speed"}, "'bubble' or left out"), ({"spacing": 0.0}, "spacing"),
])
def test_bad_requests_are_named(tmp_path, options, message):
    arguments = {"dim": 3, "spacing": DX, **options}
    with pytest.raises(ValueError, match=message):
        draw_surface({"fluid": cloud(block(2, 2, 2))}, tmp_path / "no.png", **arguments)
    with pytest.raises(ValueError, match="no fluid"):
        draw_surface({"wall": cloud(block(2, 2, 2))}, tmp_path / "no.png", dim=3, spacing=DX)


def test_no_opengl_is_said_and_does_not_crash(monkeypatch):
    monkeypatch.setattr(surface, "find_library", lambda name: None)
    with pytest.raises(OSError, match="libegl1"):
        surface._check_opengl(SimpleNamespace(GetClassName=lambda: "vtkOSOpenGLRenderWindow"))
    surface._check_opengl(SimpleNamespace(GetClassName=lambda: "vtkEGLRenderWindow"))


@pytest.fixture
def run_folder(tmp_path):
    """Three outputs of a 3-D run whose water boils in the last."""
    from pysph.base.utils import get_particle_array
    from pysph.solver.output import dump

    folder = tmp_path / "glass_output"
    folder.mkdir()
    (folder / "glass.info").write_text("{}")
    points = block(N, N, FILL)
    for step in range(3):
        arrays = []
        for name, pa in glass(points).items():
            x, y, z = pa.x, pa.y, pa.z
            array = get_particle_array(name=name, x=x, y=y, z=z, m=1000.0 * DX**3, rho=1000.0, h=DX)
            if name == "fluid":
                vapour = ball((4, 4, 4.5), 1.9, points) & (step == 2)
                array.add_property("phase", type="int", data=np.where(vapour, Phase.VAPOUR, Phase.LIQUID))
                array.add_output_arrays(["phase"])
            arrays.append(array)
        dump(str(folder / f"glass_{step}.hdf5"), arrays, {"t": 0.1 * step, "dt": 0.1, "count": step})
    (folder / "run.json").write_text(json.dumps({"dim": 3, "spacing": DX, "scene": "glass_of_water"}))
    return folder


def test_render_run_passes_the_surface_view_on(run_folder):
    paths = render_run(run_folder, view="surface", size=SIZE)
    assert [p.name for p in paths] == [f"frame_{i:05d}.png" for i in range(3)]
    first, second, last = (imread(p)[30:] for p in paths)  # without the time
    assert np.array_equal(first, second)
    assert 100 < np.count_nonzero(np.abs(last - first).max(axis=-1) > 0.02) < 0.2 * first[..., 0].size


def test_frames_stay_when_the_view_cannot_be_drawn(run_folder, monkeypatch, capsys):
    old = run_folder / "frames" / "frame_00000.png"
    old.parent.mkdir()
    old.write_bytes(b"old")
    (run_folder / "run.json").write_text(json.dumps({"dim": 2, "spacing": DX}))
    assert main(["render", str(run_folder), "--view", "surface"]) == 2
    (run_folder / "run.json").write_text(json.dumps({"dim": 3, "spacing": DX}))
    monkeypatch.setitem(sys.modules, "pysplashsurf", None)
    assert main(["render", str(run_folder), "--view", "surface"]) == 2
    monkeypatch.setitem(sys.modules, "pyvisfile", None)
    assert main(["render", str(run_folder), "--paraview"]) == 2
    assert old.read_bytes() == b"old"
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3 and all(line.startswith("pysph-boiling: ") for line in lines)
    assert "three dimensions" in lines[0]
    assert 'pysplashsurf is missing: pip install "pysph_boiling[view]"' in lines[1]
    assert 'pyvisfile is missing: pip install "pysph_boiling[view]"' in lines[2]


def test_paraview_files_hold_what_was_written(run_folder, capsys):
    import pyvista
    from pysph.solver.utils import load

    assert main(["render", str(run_folder), "--paraview", "--every", "2"]) == 0
    assert "fluid.pvd" in capsys.readouterr().out
    series = pyvista.get_reader(run_folder / "paraview" / "fluid.pvd")
    assert series.time_values == [0.0, 0.2]
    series.set_active_time_value(0.2)
    mesh, = series.read()
    fluid = load(str(run_folder / "glass_2.hdf5"))["arrays"]["fluid"]
    assert mesh.points == pytest.approx(np.column_stack([fluid.x, fluid.y, fluid.z]))
    assert np.array_equal(mesh["phase"], fluid.phase) and np.any(fluid.phase == Phase.VAPOUR)
    assert mesh["velocity"].shape == (fluid.x.size, 3)
    assert {path.name for path in (run_folder / "paraview").glob("*.pvd")} == {"fluid.pvd", "wall.pvd", "sites.pvd"}

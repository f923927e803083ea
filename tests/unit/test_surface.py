"""The rendered view: its surfaces hold what the particles hold, and its pictures show what is there."""
import json
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.image import imread
from standin import DX, FILL, VESSEL, N, ball, block, cloud, glass, mug, round_block

from pysph_boiling.analysis import surface
from pysph_boiling.analysis.drawing import bubble_colours, by_role, view_bounds
from pysph_boiling.analysis.rendering import render_run
from pysph_boiling.analysis.surface import draw_surface
from pysph_boiling.analysis.tracing import INDEX, SOLID, TINT, VAPOUR, Surface, World, fresnel, trace
from pysph_boiling.cli import main
from pysph_boiling.phases import Phase

SIZE = (200, 160)


def volume(*meshes):
    return sum(surface._volumes(mesh.points, mesh.triangles).sum() for mesh in meshes)


def fluid(points, phase=0, label=0, swell=1.0):
    n = len(points)
    return SimpleNamespace(points=points, vapour=np.broadcast_to(phase, n) == Phase.VAPOUR,
                           label=np.broadcast_to(label, n), swell=np.broadcast_to(float(swell), n))


def volume_of(*surfaces):
    meshes = [one.corners.reshape(-1, 3).astype(float) for one in surfaces]
    return sum(surface._volumes(points, np.arange(len(points)).reshape(-1, 3)).sum() for points in meshes)


def vessel(arrays):
    scene = by_role(arrays)
    return surface._vessel(scene, view_bounds(scene, DX, 3), DX)


def levels(surfaces, places):
    """Height [m] of the first surface below each of the places (n, 2)."""
    down = np.tile([0.0, 0.0, -1.0], (len(places), 1)).astype(np.float32)
    hit = World(surfaces).hits(np.column_stack([places, np.full(len(places), 1.0)]).astype(np.float32), down)
    assert np.all(hit.geometry == 0)
    return 1.0 - hit.distance


@pytest.mark.parametrize("slope", [0.0, 0.6])
def test_water_has_the_volume_of_its_particles_and_meets_the_walls_as_it_stands(slope):
    points = block(N, N, 12)
    points = points[points[:, 2] < (FILL - slope * N / 2) * DX + slope * points[:, 0]]
    arrays = glass(points)
    surfaces = surface._water(fluid(points), DX, vessel(arrays))
    assert len(surfaces) == 1
    places = block(5 * N, 5 * N, 1)[:, :2] / 5  # up to a tenth of a spacing from the walls
    height = levels(surfaces, places)
    assert height.mean() * (N * DX)**2 == pytest.approx(len(points) * DX**3, rel=0.03)
    assert np.abs(height - ((FILL - slope * N / 2) * DX + slope * places[:, 0])).max() < 1.0 * DX
    assert volume_of(*surfaces) > 1.2 * len(points) * DX**3  # it goes on behind the walls, where the vessel cuts it


def test_water_meets_a_round_wall():
    points = round_block(FILL)
    arrays = mug(points)
    pot = vessel(arrays)
    assert pot.radius == pytest.approx(0.5 * N * DX, rel=0.02)  # of a ring of 36 particles
    assert pot.axis == pytest.approx([0.5 * N * DX] * 2)
    angle = np.linspace(0.0, 6.0, 30)
    rim = 0.5 * N * DX + 0.49 * N * DX * np.column_stack([np.cos(angle), np.sin(angle)])
    height = levels(surface._water(fluid(points), DX, pot), rim)
    assert np.abs(height - FILL * DX).max() < 0.7 * DX


@pytest.mark.parametrize(("arrays", "across"), [(glass(block(N, N, FILL)), N), (mug(round_block(FILL)), N)],
                         ids=["box", "round"])
def test_light_passes_through_as_much_water_as_there_is(arrays, across):
    """A ray through the middle: reflected and absorbed as by a plate; above the water only the glass is in its way."""
    scene, pot = by_role(arrays), vessel(arrays)
    inside = surface._fluid(scene, pot.box)
    world = World([*surface._water(inside, DX, pot), *surface._walls(scene, pot, DX)])
    start = np.array([[0.5 * N * DX, -1.0, z * DX] for z in (0.5 * FILL, FILL + 4)])
    light = dict(absorption=(3.0, 1.0, 0.0), haze=0.0, body=(0.0, 0.0, 0.0), gap=1e-6)
    wet, dry = trace(world, start, np.tile([0.0, 1.0, 0.0], (2, 1)), lambda points, _: np.ones((len(points), 3)),
                     **light)
    mirrored = fresnel(np.ones(1), 1.0 / INDEX)
    through = np.exp(-across * DX * np.array([3.0, 1.0, 0.0]))
    assert wet == pytest.approx(mirrored + (1.0 - mirrored)**2 * through, abs=0.01)
    assert dry == pytest.approx(np.exp(-2.0 * TINT), abs=0.01)


def test_drops_are_balls_of_their_own():
    points = np.concatenate([block(N, N, FILL), DX * np.array([[5.0, 5.0, 11.0], [2.0, 2.0, 10.0], [3.2, 2.0, 10.0]])])
    pool, drops = surface._water(fluid(points), DX, vessel(glass(points)))
    assert volume_of(drops) == pytest.approx(3 * DX**3, rel=1e-5)
    assert drops.corners[..., 2].min() > 9 * DX and pool.corners[..., 2].max() < 8.5 * DX
    single = np.linalg.norm(drops.corners - DX * np.array([5.0, 5.0, 11.0]), axis=2)
    assert np.sum(single < DX) > 100 and single[single < DX] == pytest.approx(DX * np.cbrt(0.75 / np.pi), rel=0.04)


def test_hollows_inside_are_not_surface():
    points = block(N, N, FILL)
    hollow = points[~ball((5, 5, 3.5), 2.2, points)]
    full = surface._reconstruct(points, DX)
    assert volume(surface._reconstruct(hollow, DX)) == pytest.approx(volume(full), rel=0.01)
    mesh = surface._reconstruct(hollow, DX)
    assert len(np.unique(mesh.piece[mesh.triangles])) == 1 < len(np.unique(mesh.piece))


@pytest.mark.parametrize("n", [1, 2, 8, 57])
def test_bubble_has_the_volume_of_its_vapour(n):
    points = block(5, 5, 5)
    points = points[np.argsort(np.linalg.norm(points - 2.4 * DX, axis=1), kind="stable")[:n]]
    for swell in (1.0, 4.0):
        mesh = surface._blob(np.cbrt(swell) * points, swell * n * DX**3)
        assert volume(mesh) == pytest.approx(swell * n * DX**3, rel=1e-9)
        middle = mesh.points[np.unique(mesh.triangles)].mean(axis=0)
        assert middle == pytest.approx(np.cbrt(swell) * points.mean(axis=0), abs=0.4 * DX)
    apart = surface._blob(np.concatenate([points, points + 20 * DX]), 2 * n * DX**3)
    assert volume(apart) == pytest.approx(2 * n * DX**3, rel=1e-9)
    for shift in (0.0, 20 * DX):  # each piece grew where it is
        piece = apart.points[np.abs(apart.points[:, 0] - 2.4 * DX - shift) < 8 * DX]
        assert piece.mean(axis=0) == pytest.approx(points.mean(axis=0) + shift, abs=0.4 * DX)


def test_bubbles_are_told_apart_by_label():
    points = block(N, N, FILL)
    one, two = ball((3, 5, 4), 1.6, points), ball((6, 5, 4), 1.6, points)
    phase = np.where(one | two, Phase.VAPOUR, Phase.LIQUID)
    apart, = surface._bubbles(fluid(points, phase, np.where(one, 3, 4)), DX, "bubble")
    assert apart.kind == VAPOUR and volume_of(apart) == pytest.approx((one | two).sum() * DX**3, rel=1e-5)
    left = apart.corners[..., 0].max(axis=1) < 4.7 * DX
    assert np.unique(apart.paint[left, :3], axis=0) == pytest.approx(bubble_colours(np.array([3])))
    assert np.unique(apart.paint[~left, :3], axis=0) == pytest.approx(bubble_colours(np.array([4])))
    together, = surface._bubbles(fluid(points, phase), DX, None)
    assert together.paint is None and len(together.corners) != len(apart.corners)
    assert surface._bubbles(fluid(points), DX, None) == []


@pytest.mark.parametrize("size", [(1280, 960), (400, 900)])
@pytest.mark.parametrize("edges", [(1.0, 1.0, 1.5), (7.0, 0.5, 2.0)])
@pytest.mark.parametrize("name", [*surface.CAMERAS, "30,60"])
def test_camera_holds_the_vessel(edges, size, name):
    box = np.array([[0.0, 0.0, 0.0], edges]) + 3.0
    camera = surface._camera(box, size, name)
    forward = (camera.target - camera.eye) / np.linalg.norm(camera.target - camera.eye)
    right = np.cross(forward, camera.up)
    corners = np.array([[box[i, 0], box[j, 1], box[k, 2]] for i, j, k in np.ndindex(2, 2, 2)]) - camera.eye
    height = np.tan(np.radians(0.5 * surface.LENS))
    seen = np.column_stack([corners @ right / (height * size[0] / size[1]), corners @ camera.up / height])
    seen /= (corners @ forward)[:, None]  # -1 .. 1 is the picture
    assert np.abs(seen).max() == pytest.approx(surface.ROOM, abs=1e-3)
    assert seen.max(axis=0) == pytest.approx(-seen.min(axis=0), abs=1e-3)


def place(point, size=SIZE):
    """Pixel (column, row) where a place [m] of the vessel is seen."""
    box = np.array([VESSEL[0] - [0.0, 0.0, surface.BASE_HEIGHT * DX], DX * np.array([N, N, 1.5 * N])])
    camera = surface._camera(box, size, "corner")
    forward = (camera.target - camera.eye) / np.linalg.norm(camera.target - camera.eye)
    ray = np.asarray(point) - camera.eye
    ray = ray / (ray @ forward) / np.tan(np.radians(0.5 * surface.LENS))
    across, up = ray @ np.cross(forward, camera.up), ray @ camera.up
    return int(0.5 * (size[0] + size[1] * across)), int(size[1] * (0.5 + surface.LOWER - 0.5 * up))


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
    assert 1.0 * area < changed.sum() < 1.6 * area  # the walls mirror it too
    assert at(boiling, where).sum() > at(calm, where).sum()  # steam is brighter than the water

    red, _, blue = at(calm, [0.5 * N * DX, 0.9 * N * DX, 0.3 * N * DX])
    assert blue > red + 0.15
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


def test_text_fits_the_picture(tmp_path):
    """No letter is cut off: a margin on the right stays free, whatever the title, and the text is not empty."""
    margin = SIZE[0] // 40
    plain, short, long = (imread(draw_surface({"fluid": cloud(block(3, 3, 3))}, tmp_path / "t.png", dim=3, spacing=DX,
                                              size=SIZE, t=t, title=title)) for title, t in (
        (None, None), ("boil", 1.0), ("a long title " * 3, 1.0)))
    for picture in (short, long):
        rows, columns = np.nonzero(np.abs(picture - plain).max(axis=-1) > 0.1)
        assert margin <= columns.min() and columns.max() < SIZE[0] - margin
        assert rows.max() < 0.15 * SIZE[1]
    assert np.ptp(columns) > 0.8 * SIZE[0]


def test_edges_are_as_smooth_as_with_all_samples_everywhere(monkeypatch):
    box = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0]])
    camera = surface._camera(box, SIZE, "front")
    solid = Surface(SOLID, *surface._rod(np.array([[-0.7, 0.0, -0.9], [0.8, 0.0, 0.9]]), 0.1),
                    shade=lambda points, normals: np.zeros((len(points), 3)))
    light = dict(absorption=np.zeros(3), haze=0.0, body=np.zeros(3), gap=1e-5)
    pictures = {}
    for contrast in (surface.CONTRAST, -1.0, 2.0):
        monkeypatch.setattr(surface, "CONTRAST", contrast)
        pictures[contrast] = surface._picture(World([solid]), camera, SIZE,
                                              lambda points, _: np.ones((len(points), 3)), light)
    chosen, everywhere, one = pictures.values()
    assert np.array_equal(chosen, everywhere)
    assert set(np.unique(one)) == {0.0, 1.0} and len(np.unique(chosen)) == 5
    assert (1.0 - chosen).sum() == pytest.approx((1.0 - one).sum(), rel=0.05)


@pytest.mark.parametrize(("camera", "side"), [("front", 0), ("0,20", 1), ("-90,20,2", 0)])
def test_camera_looks_from_where_it_says(camera, side):
    """From the front x goes to the right in the picture, from an azimuth of 0 y does; a zoom doubles lengths."""
    box = DX * np.array([[0.0, 0.0, 0.0], [N, N, N]])
    found = surface._camera(box, SIZE, camera)
    middle = box.mean(axis=0)
    step = np.zeros(3)
    step[side] = DX

    def seen(point):
        forward = (found.target - found.eye) / np.linalg.norm(found.target - found.eye)
        ray = np.array(point) - found.eye
        return (ray @ np.cross(forward, found.up)) / (ray @ forward)

    assert seen(middle + step) > seen(middle) == pytest.approx(0.0, abs=1e-3)
    directions = surface._rays(found, SIZE, np.array([[0.5, 0.5 + surface.LOWER], [1.0, 0.5 + surface.LOWER]]) * SIZE)
    angle = np.tan(np.arccos(np.clip(directions[0] @ directions[1], -1.0, 1.0)))
    half = np.tan(np.radians(0.5 * surface.LENS)) * SIZE[0] / SIZE[1]
    assert angle == pytest.approx(half / (2.0 if camera.endswith(",2") else 1.0), rel=1e-6)


@pytest.mark.parametrize(("options", "message"), [
    ({"dim": 2}, "three dimensions"), ({"colour": "speed"}, "'bubble' or left out"), ({"spacing": 0.0}, "spacing"),
    ({"camera": "left"}, r"must be one of corner, front, above, low, or AZIMUTH,ELEVATION\[,ZOOM\] .* got 'left'"),
    ({"camera": "1"}, "camera must be one of"), ({"camera": "1,2,3,4"}, "camera must be one of"),
    ({"camera": "1,nan"}, "camera must be one of"),
    ({"camera": "0,-5"}, "elevation must lie in 0 .. 90 degrees, got -5"), ({"camera": "0,91"}, "must lie in"),
    ({"camera": "0,10,0"}, "zoom must be > 0, got 0"),
])
def test_bad_requests_are_named(tmp_path, options, message):
    arguments = {"dim": 3, "spacing": DX, **options}
    with pytest.raises(ValueError, match=message):
        draw_surface({"fluid": cloud(block(2, 2, 2))}, tmp_path / "no.png", **arguments)
    with pytest.raises(ValueError, match="no fluid"):
        draw_surface({"wall": cloud(block(2, 2, 2))}, tmp_path / "no.png", dim=3, spacing=DX)


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


def test_camera_and_size_are_passed_on(run_folder, capsys):
    def frames(*options):
        assert main(["render", str(run_folder), "--view", "surface", "--every", "3", "--size", "80x60", *options]) == 0
        return imread(run_folder / "frames" / "frame_00000.png")

    corner, above, turned = frames(), frames("--camera", "above"), frames("--camera=-62,48")
    assert corner.shape[:2] == (60, 80)
    assert np.array_equal(above, turned) and not np.array_equal(above, corner)
    capsys.readouterr()
    for options, message in ((["--size", "80"], "--size must be WIDTHxHEIGHT in pixels, at least 16x16, got '80'"),
                             (["--size", "80x-60"], "--size must be"), (["--size", "8x60"], "at least 16x16"),
                             (["--camera", "x"], "camera must be one of corner")):
        assert main(["render", str(run_folder), "--view", "surface", *options]) == 2
        assert message in capsys.readouterr().err
    for options in (["--size", "80x60"], ["--view", "3d", "--camera", "above"]):
        assert main(["render", str(run_folder), *options]) == 2
        assert "--camera and --size are for the surface view: add --view surface" in capsys.readouterr().err


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
    assert "pysplashsurf is missing: pip install 'pysph_boiling[view]'" in lines[1]
    assert "pyvisfile is missing: pip install 'pysph_boiling[view]'" in lines[2]


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

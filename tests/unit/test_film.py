"""Meshes for films: closed, as large as what they show, with the velocities and labels of their particles."""
import json
import os
import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import pytest
import trimesh
from standin import DX, FILL, N, ball, block, cloud, glass, mug, round_block

from pysph_boiling.analysis import blender_sequence
from pysph_boiling.analysis.film import blender_script
from pysph_boiling.analysis.surface import closed_meshes
from pysph_boiling.cli import main
from pysph_boiling.phases import Phase

TIMES = (0.0, 0.02, 0.04)
SWIRL = 3.0  # [1/s] the water turns about the vessel's axis
LABELS = (7, 12)  # of two bubbles


def turning(points):
    """Velocities (n, 3) [m/s] of a rigid turn about the axis of the vessel."""
    away = points - [0.5 * N * DX, 0.5 * N * DX, 0.0]
    return SWIRL * np.column_stack([-away[:, 1], away[:, 0], np.zeros(len(points))])


def state(points, bubbles=True):
    """Properties of water that turns, with two bubbles of labels 7 and 12, the second swollen."""
    one, two = ball((3, 5, 3.5), 1.6, points), ball((7, 5, 3.5), 1.6, points)
    vapour = (one | two) & bubbles
    u, v, w = turning(points).T
    return dict(phase=np.where(vapour, Phase.VAPOUR, Phase.LIQUID), bubble=np.where(one, *LABELS), u=u, v=v, w=w,
                swell=np.where(two & vapour, 1.4, 1.0))


def solid(mesh):
    return trimesh.Trimesh(mesh.points, mesh.triangles, process=False)


@pytest.mark.parametrize("vessel", ["box", "round", "none"])
def test_meshes_are_closed_and_hold_as_much_as_their_particles(vessel):
    points = round_block(FILL) if vessel == "round" else block(N, N, FILL)
    drop = np.array([[0.5 * N, 0.5 * N, FILL + 4.0]]) * DX
    points = np.concatenate([points, drop])
    properties = state(points)
    arrays = {"box": glass, "round": mug}.get(vessel, lambda water: {})(points) | {"fluid": cloud(points, **properties)}
    meshes = closed_meshes(arrays, spacing=DX)
    water, bubbles = solid(meshes.water), solid(meshes.bubbles)
    assert water.is_watertight and water.is_winding_consistent
    assert bubbles.is_watertight and bubbles.is_winding_consistent
    assert len(water.split(only_watertight=False)) == len(bubbles.split(only_watertight=False)) == 2
    # edges of a free block are rounded; between walls only those where the round wall of the vessel is a polygon are
    least, most = {"box": (0.97, 1.03), "round": (0.93, 1.03), "none": (0.85, 1.0)}[vessel]
    assert least < water.volume / (len(points) * DX**3) < most
    vapour = properties["phase"] == Phase.VAPOUR
    for label in LABELS:
        own = vapour & (properties["bubble"] == label)
        part = meshes.bubbles.label[meshes.bubbles.triangles[:, 0]] == label
        volume = trimesh.Trimesh(meshes.bubbles.points, meshes.bubbles.triangles[part]).volume
        assert volume == pytest.approx(properties["swell"][own].sum() * DX**3, rel=1e-5)  # far from the walls: uncut
    if vessel == "box":
        assert meshes.water.points[:, :2].min() == pytest.approx(0.0, abs=1e-6)
        assert meshes.water.points[:, :2].max() == pytest.approx(N * DX, abs=1e-6)


def test_points_have_the_velocity_of_the_water_and_the_bubbles_near_them():
    points = block(N, N, FILL)
    properties = state(points)
    rising = properties["phase"] == Phase.VAPOUR
    properties["w"] = np.where(rising, 0.5, 0.0)
    meshes = closed_meshes(glass(points, **properties), spacing=DX)
    wall = np.all(np.abs(meshes.water.points[:, :2] / DX - 0.5 * N) < 0.5 * N - 0.01, axis=1)
    off = np.linalg.norm(meshes.water.velocity - turning(meshes.water.points), axis=1)
    assert off[wall].max() < 1.0 * SWIRL * DX  # of the nearest particles, which are half a spacing away
    assert np.median(off) < 0.4 * SWIRL * DX
    assert np.linalg.norm(meshes.water.velocity, axis=1).max() > 0.4 * SWIRL * N * DX
    assert meshes.bubbles.velocity[:, 2] == pytest.approx(0.5)  # none of the liquid around them


def test_a_bubble_at_the_base_ends_there():
    points = block(N, N, FILL)
    low = ball((5, 5, 0.5), 1.9, points)
    arrays = glass(points, phase=np.where(low, Phase.VAPOUR, Phase.LIQUID), bubble=1)
    bubble = solid(closed_meshes(arrays, spacing=DX).bubbles)
    assert bubble.is_watertight and bubble.bounds[0, 2] == pytest.approx(0.0, abs=1e-6)
    assert 0.75 < bubble.volume / (low.sum() * DX**3) < 1.0


def test_a_dry_vessel_has_empty_meshes():
    meshes = closed_meshes(glass(np.empty((0, 3))), spacing=DX)
    assert all(len(part.points) == len(part.triangles) == len(part.velocity) == 0
               for part in (meshes.water, meshes.bubbles))


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    """Three outputs of turning water, which boils in the last two."""
    from pysph.base.utils import get_particle_array
    from pysph.solver.output import dump

    folder = tmp_path_factory.mktemp("film") / "glass_output"
    folder.mkdir()
    points = block(N, N, FILL)
    for step, t in enumerate(TIMES):
        arrays = []
        for name, pa in glass(points, **state(points, bubbles=step > 0)).items():
            array = get_particle_array(name=name, x=pa.x, y=pa.y, z=pa.z, m=1000.0 * DX**3, rho=1000.0, h=DX)
            for prop in ("u", "v", "w", "swell"):
                if prop in pa.properties:
                    array.add_property(prop, data=np.array(getattr(pa, prop)))
            if name == "fluid":
                for prop in ("phase", "bubble"):
                    array.add_property(prop, type="int", data=getattr(pa, prop))
                array.add_output_arrays(["phase", "bubble", "swell"])
            arrays.append(array)
        dump(str(folder / f"glass_{step}.hdf5"), arrays, {"t": t, "dt": 0.02, "count": step})
    (folder / "run.json").write_text(json.dumps({"dim": 3, "spacing": DX, "scene": "glass_of_water"}))
    return folder


@pytest.fixture(scope="module")
def ply(run_folder):
    assert main(["render", str(run_folder), "--mesh", "ply"]) == 0
    return run_folder / "mesh"


def test_ply_sequence_with_its_times(ply):
    record = json.loads((ply / "frames.json").read_text())
    assert record["scene"] == "glass_of_water" and record["up"] == "z" and record["units"]["length"] == "m"
    assert [frame["time"] for frame in record["frames"]] == pytest.approx(TIMES)
    assert {path.name for path in ply.iterdir()} == {"frames.json"} | {
        frame[part] for frame in record["frames"] for part in ("water", "bubbles")}
    first, last = record["frames"][0], record["frames"][-1]
    water, bubbles = (trimesh.load(ply / last[part], process=False) for part in ("water", "bubbles"))
    assert water.is_watertight and bubbles.is_watertight
    assert trimesh.load(ply / first["bubbles"]).is_empty
    data = bubbles.metadata["_ply_raw"]["vertex"]["data"]
    left = bubbles.vertices[:, 0] < 4.9 * DX
    assert set(data["bubble"][left]) == {7} and set(data["bubble"][~left]) == {12}
    velocity = np.column_stack([data[name] for name in ("vx", "vy", "vz")])
    # Points are up to 1.5 spacings from the middle of the particles next to them: measured 1.1
    assert np.linalg.norm(velocity - turning(bubbles.vertices), axis=1).max() < 1.5 * SWIRL * DX
    assert "bubble" not in water.metadata["_ply_raw"]["vertex"]["data"].dtype.names
    vertices, triangles = blender_sequence.read_ply(ply / last["bubbles"])
    assert np.array_equal(triangles, bubbles.faces) and np.array_equal(vertices["vx"], data["vx"])


def test_obj_has_a_group_for_each_bubble(run_folder, tmp_path):
    from pysph_boiling.analysis.film import write_meshes

    write_meshes(run_folder, "obj", out=tmp_path, every=2)
    assert sorted(path.name for path in tmp_path.glob("*.obj")) == [
        "bubbles_00000.obj", "bubbles_00001.obj", "water_00000.obj", "water_00001.obj"]
    text = (tmp_path / "bubbles_00001.obj").read_text()
    assert [line for line in text.splitlines() if line.startswith("g ")] == ["g bubble_7", "g bubble_12"]
    mesh = trimesh.load(tmp_path / "bubbles_00001.obj", process=False, group_material=False)
    assert mesh.is_watertight and 40 * DX**3 < mesh.volume < 56 * DX**3
    assert json.loads((tmp_path / "frames.json").read_text())["attributes"] == []


def test_usd_has_the_same_meshes_in_time(run_folder, ply, capsys):
    from pxr import Usd, UsdGeom

    assert main(["render", str(run_folder), "--usd"]) == 0
    assert "film.usdc" in capsys.readouterr().out
    stage = Usd.Stage.Open(str(run_folder / "film.usdc"))
    assert UsdGeom.GetStageUpAxis(stage) == "Z" and UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    rate = stage.GetTimeCodesPerSecond()
    assert rate == pytest.approx(50.0) and stage.GetEndTimeCode() == pytest.approx(TIMES[-1] * rate)
    for part in ("water", "bubbles"):
        mesh = UsdGeom.Mesh.Get(stage, f"/boiling/{part}")
        samples = mesh.GetPointsAttr().GetTimeSamples()
        assert np.array(samples) / rate == pytest.approx(TIMES)
        vertices, triangles = blender_sequence.read_ply(ply / f"{part}_00002.ply")
        points = np.array(mesh.GetPointsAttr().Get(samples[2]))
        assert points == pytest.approx(np.column_stack([vertices[name] for name in "xyz"]))
        assert np.array_equal(np.array(mesh.GetFaceVertexIndicesAttr().Get(samples[2])).reshape(-1, 3), triangles)
        velocities = np.array(mesh.GetVelocitiesAttr().Get(samples[2]))
        assert velocities[:, 0] == pytest.approx(vertices["vx"])
        assert mesh.ValidateTopology(*(mesh.GetFaceVertexIndicesAttr().Get(samples[2]),
                                       mesh.GetFaceVertexCountsAttr().Get(samples[2])), len(points))[0]
    label = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("bubble")
    assert label.GetInterpolation() == "vertex" and np.array_equal(label.Get(samples[2]), vertices["bubble"])


def test_bad_requests_leave_what_was_there(run_folder, ply, monkeypatch, capsys):
    before = sorted((path.name, path.stat().st_mtime_ns) for path in ply.iterdir())
    record = run_folder / "run.json"
    text = record.read_text()
    record.write_text(json.dumps({"dim": 2, "spacing": DX}))
    assert main(["render", str(run_folder), "--mesh", "ply"]) == main(["render", str(run_folder), "--usd"]) == 2
    record.write_text(text)
    monkeypatch.setitem(sys.modules, "manifold3d", None)
    assert main(["render", str(run_folder), "--mesh", "ply"]) == 2
    monkeypatch.setitem(sys.modules, "pxr", None)
    assert main(["render", str(run_folder), "--usd"]) == 2
    flat, again, cut, usd = capsys.readouterr().err.splitlines()
    assert flat == again and "three dimensions, but this scene has 2" in flat
    assert "manifold3d is missing: pip install 'pysph_boiling[film]'" in cut
    assert "pip install 'pysph_boiling[film]'" in usd
    assert before == sorted((path.name, path.stat().st_mtime_ns) for path in ply.iterdir())


def test_files_of_the_user_stay(run_folder, tmp_path):
    from pysph_boiling.analysis.film import write_meshes

    (tmp_path / "water_00000.ply").write_text("mine")
    with pytest.raises(FileExistsError, match="water_00000.ply"):
        write_meshes(run_folder, "ply", out=tmp_path)
    assert (tmp_path / "water_00000.ply").read_text() == "mine" and not (tmp_path / "frames.json").exists()


def test_the_script_for_blender_reads_only_what_it_knows(ply, tmp_path):
    with pytest.raises(ValueError, match="no frames.json"):
        blender_sequence.load_sequence(tmp_path)
    (tmp_path / "frames.json").write_text(json.dumps({"frames": [{"water": "water_00000.obj"}]}))
    with pytest.raises(ValueError, match="not PLY"):
        blender_sequence.load_sequence(tmp_path)
    (tmp_path / "a.ply").write_text("ply\nformat ascii 1.0\nend_header\n")
    with pytest.raises(ValueError, match="not a PLY file that pysph_boiling wrote"):
        blender_sequence.read_ply(tmp_path / "a.ply")
    assert blender_sequence.slow_motion(TIMES, 25.0) == pytest.approx(0.5)


CHECK = """
import json, sys
import bpy
import numpy as np
sys.path.insert(0, {package!r})
import blender_sequence as sequence
scene = sequence.build({folder!r}, 25)
seen = []
for frame in (1, 3, 2):
    scene.frame_set(frame)
    for part in sequence.PARTS:
        mesh = bpy.data.objects["boiling_" + part].data
        assert not mesh.validate(), (frame, part)
        velocity = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.attributes["velocity"].data.foreach_get("vector", velocity)
        label = [] if part == "water" else sorted({{item.value for item in mesh.attributes["bubble"].data}})
        seen.append([frame, part, len(mesh.vertices), float(np.abs(velocity).max(initial=0.0)), label])
sequence.main([{folder!r}, "--render", {picture!r}, "--samples", "1", "--size", "64x56", "--save", {blend!r}])
bpy.ops.wm.open_mainfile(filepath={blend!r}, use_scripts=True)
bpy.context.scene.frame_set(2)
seen.append(len(bpy.data.objects["boiling_bubbles"].data.vertices))
print("SEEN", json.dumps(seen))
"""


def test_blender_shows_each_frame(ply, tmp_path):
    """In Blender's own Python: BPY names another one that has bpy, since its wheels are for single versions."""
    python = os.environ.get("BPY") or (sys.executable if find_spec("bpy") else None)
    if python is None:
        pytest.skip("the script was NOT run in Blender: neither bpy nor, in the environment variable BPY, a Python "
                    "that has it; the files it reads were tested with trimesh")
    script = tmp_path / "check.py"
    script.write_text(CHECK.format(package=str(blender_script().parent), folder=str(ply),
                                   picture=str(tmp_path / "p.png"), blend=str(tmp_path / "p.blend")))
    env = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run([python, str(script)], capture_output=True, text=True, timeout=300, env=env)
    assert done.returncode == 0 and "SEEN" in done.stdout, done.stdout[-2000:] + done.stderr[-3000:]
    *seen, again = json.loads(done.stdout.split("SEEN", 1)[1].splitlines()[0])
    for frame, part, points, fastest, labels in seen:
        vertices, _ = blender_sequence.read_ply(ply / f"{part}_{frame - 1:05d}.ply")
        assert points == len(vertices), (frame, part)
        if points:
            scale = 25 * (TIMES[1] - TIMES[0])
            assert fastest == pytest.approx(scale * max(np.abs(vertices[name]).max() for name in ("vx", "vy", "vz")))
        if part == "bubbles":
            assert labels == sorted(set(vertices["bubble"]))
    assert again == len(blender_sequence.read_ply(ply / "bubbles_00001.ply")[0]) > 0
    assert (tmp_path / "p.png").stat().st_size > 1000

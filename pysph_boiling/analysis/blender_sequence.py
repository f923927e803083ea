"""Load the meshes of ``pysph-boiling render DIR --mesh ply`` into Blender, one pair of files for each frame.

    blender --python blender_sequence.py -- DIR/mesh
    blender --background --python blender_sequence.py -- DIR/mesh --render picture.png --frame 40 --samples 64

It also runs in Python with the package ``bpy``: ``python blender_sequence.py DIR/mesh``. It needs nothing else of
pysph_boiling, and is copied into the ``.blend`` file that ``--save`` writes, so that the file goes on reading the
sequence when it is opened (with "Auto Run Python Scripts", which Blender asks about).

Frame 1 is the first of the sequence. Only the meshes of the current frame are in memory. Water and bubbles are glass:
light goes from water into vapour at a bubble, so its index of refraction is 1/1.333 there. The attribute ``velocity``
of the points makes motion blur in Cycles, and ``bubble`` is the label of the bubble, for materials.
"""
import argparse
import json
import sys
from pathlib import Path

import numpy as np

FOLDER = "boiling_sequence"  # custom property of the Blender scene: the folder of frames.json
PARTS = ("water", "bubbles")
INDEX = 1.333  # of refraction of water
NUMPY_TYPES = {"float": "<f4", "int": "<i4", "uchar": "u1"}


def read_ply(path):
    """(vertices, triangles (m, 3)) of a PLY file by pysph_boiling; ``vertices`` (n,) has the names of the properties.
    """
    data = Path(path).read_bytes()
    head, mark, body = data.partition(b"end_header\n")
    lines = [line.split() for line in head.decode("ascii").splitlines()]
    if not mark or ["format", "binary_little_endian", "1.0"] not in lines:
        raise ValueError(f"{path} is not a PLY file that pysph_boiling wrote")
    counts = {words[1]: int(words[2]) for words in lines if words[0] == "element"}
    kind = [(words[2], NUMPY_TYPES[words[1]]) for words in lines if words[0] == "property" and words[1] != "list"]
    vertices = np.frombuffer(body, kind, counts["vertex"])
    faces = np.frombuffer(body, [("n", "u1"), ("corners", "<i4", 3)], counts["face"], vertices.nbytes)
    return vertices, faces["corners"]


def load_sequence(folder):
    """The content of ``frames.json`` in a folder; ``ValueError`` says what to do if there is none that fits."""
    path = Path(folder) / "frames.json"
    if not path.exists():
        raise ValueError(f"there is no frames.json in {folder}: make one by pysph-boiling render DIR --mesh ply")
    sequence = json.loads(path.read_text(encoding="utf-8"))
    if not all(frame["water"].endswith(".ply") for frame in sequence["frames"]):
        raise ValueError(f"the meshes in {folder} are not PLY files: use pysph-boiling render DIR --mesh ply")
    return sequence


def slow_motion(times, fps):
    """Seconds of the run that a second of the film shows, at frames at ``times`` (n,) [s]; 1 for a single frame."""
    return fps * float(np.median(np.diff(times))) if len(times) > 1 else 1.0


def fill(mesh, path, scale):
    """Replace the content of a Blender mesh by a PLY file; velocities are multiplied by ``scale``."""
    vertices, triangles = read_ply(path)
    mesh.clear_geometry()
    mesh.vertices.add(len(vertices))
    mesh.loops.add(triangles.size)
    mesh.polygons.add(len(triangles))
    points = np.column_stack([vertices[name] for name in "xyz"])
    mesh.vertices.foreach_set("co", points.ravel())
    mesh.loops.foreach_set("vertex_index", triangles.ravel())
    mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    mesh.polygons.foreach_set("use_smooth", np.ones(len(triangles), bool))
    velocity = scale * np.column_stack([vertices[name] for name in ("vx", "vy", "vz")])
    mesh.attributes.new("velocity", "FLOAT_VECTOR", "POINT").data.foreach_set(
        "vector", velocity.astype(np.float32).ravel())
    if "bubble" in vertices.dtype.names:
        mesh.attributes.new("bubble", "INT", "POINT").data.foreach_set("value", vertices["bubble"])
    mesh.update(calc_edges=True)


def show_frame(scene, *_):
    """Put the meshes of the scene's current frame into its objects; Blender calls it whenever the frame changes."""
    import bpy

    if FOLDER not in scene:
        return
    folder = Path(bpy.path.abspath(scene[FOLDER]))
    frames = load_sequence(folder)["frames"]
    frame = frames[min(max(scene.frame_current - 1, 0), len(frames) - 1)]
    scale = slow_motion([one["time"] for one in frames], scene.render.fps / scene.render.fps_base)
    for part in PARTS:
        fill(bpy.data.objects[f"boiling_{part}"].data, folder / frame[part], scale)


def register():
    """Have Blender call :func:`show_frame`."""
    import bpy

    handlers = bpy.app.handlers.frame_change_pre
    handlers[:] = [one for one in handlers if one.__name__ != show_frame.__name__]
    handlers.append(bpy.app.handlers.persistent(show_frame))


def glass(name, index, colour):
    """A Blender material of clear glass with an index of refraction."""
    import bpy

    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    shader, out = nodes.new("ShaderNodeBsdfGlass"), nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["IOR"].default_value = index
    shader.inputs["Roughness"].default_value = 0.0
    shader.inputs["Color"].default_value = (*colour, 1.0)
    links.new(shader.outputs["BSDF"], out.inputs["Surface"])
    return material


def build(folder, fps):
    """Make objects, materials, camera and light for the sequence in a folder in an empty Blender scene."""
    import bpy
    from mathutils import Vector

    sequence = load_sequence(folder)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene[FOLDER] = str(Path(folder).resolve())
    scene.frame_start, scene.frame_end = 1, len(sequence["frames"])
    scene.render.fps = fps
    scene.render.use_lock_interface = True  # the handler changes meshes while a film is rendered
    scene.unit_settings.system = "METRIC"
    for part, index, colour in (("water", INDEX, (0.86, 0.95, 1.0)), ("bubbles", 1.0 / INDEX, (1.0, 1.0, 1.0))):
        thing = bpy.data.objects.new(f"boiling_{part}", bpy.data.meshes.new(part))
        thing.data.materials.append(glass(part, index, colour))
        scene.collection.objects.link(thing)
    register()
    scene.frame_set(1)
    box = np.array([corner[:] for corner in bpy.data.objects["boiling_water"].bound_box])
    low, high = Vector(box.min(axis=0)), Vector(box.max(axis=0))
    middle, size = (low + high) / 2.0, (high - low).length
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = middle + size * Vector((0.75, -1.6, 0.55))
    camera.rotation_euler = (middle - camera.location).to_track_quat("-Z", "Y").to_euler()
    camera.data.clip_start, camera.data.clip_end = 0.01 * size, 100.0 * size
    lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "AREA"))
    lamp.data.energy, lamp.data.size = 40.0 * size**2, size
    lamp.location = middle + size * Vector((-0.8, -0.6, 1.6))
    lamp.rotation_euler = (middle - lamp.location).to_track_quat("-Z", "Y").to_euler()
    table = bpy.data.objects.new("table", bpy.data.meshes.new("table"))
    half = 20.0 * size
    table.data.from_pydata([(x + middle.x, y + middle.y, low.z - 0.01 * size) for x, y in
                            ((-half, -half), (half, -half), (half, half), (-half, half))], [], [(0, 1, 2, 3)])
    table.data.materials.append(checks(0.12 * size))
    for thing in (camera, lamp, table):
        scene.collection.objects.link(thing)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.8, 0.88, 1.0, 1.0)
    scene.render.engine = "CYCLES"
    return scene


def checks(tile):
    """A Blender material of a table with tiles of a given edge [m], by which one sees that water bends the light."""
    import bpy

    material = bpy.data.materials.new("table")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    place, pattern = nodes.new("ShaderNodeNewGeometry"), nodes.new("ShaderNodeTexChecker")
    pattern.inputs["Scale"].default_value = 1.0 / tile
    pattern.inputs["Color1"].default_value, pattern.inputs["Color2"].default_value = (
        (0.75, 0.72, 0.68, 1.0), (0.5, 0.48, 0.45, 1.0))
    links.new(place.outputs["Position"], pattern.inputs["Vector"])
    links.new(pattern.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    return material


def main(arguments):
    """Build the scene; render a frame or save a file if that is asked for."""
    import bpy

    parser = argparse.ArgumentParser(prog="blender_sequence.py", description="Load meshes of a boiling run in Blender.")
    parser.add_argument("folder", help="folder with frames.json")
    parser.add_argument("--fps", type=int, default=24, help="frames of the film per second; default 24")
    parser.add_argument("--frame", type=int, default=1, help="frame to show and to render; default 1")
    parser.add_argument("--render", metavar="PNG", help="render the frame to this file")
    parser.add_argument("--samples", type=int, default=64, help="rays of light per pixel; default 64")
    parser.add_argument("--size", default="640x560", help="WIDTHxHEIGHT of the picture in pixels; default 640x560")
    parser.add_argument("--blur", action="store_true", help="with motion blur")
    parser.add_argument("--save", metavar="BLEND", help="save a .blend file")
    options = parser.parse_args(arguments)
    try:
        scene = build(options.folder, options.fps)
    except ValueError as error:
        parser.error(str(error))
    scene.cycles.samples = options.samples
    scene.render.resolution_x, scene.render.resolution_y = map(int, options.size.split("x"))
    scene.render.use_motion_blur = options.blur
    scene.frame_set(options.frame)
    if options.save:
        text = bpy.data.texts.load(str(Path(__file__).resolve()), internal=True)
        text.use_module = True
        bpy.ops.wm.save_as_mainfile(filepath=str(Path(options.save).resolve()))
    if options.render:
        scene.render.filepath = str(Path(options.render).resolve())
        bpy.ops.render.render(write_still=True)


def run():
    """What Blender runs: in a file that :func:`main` saved, it only goes on with the sequence."""
    import bpy

    if any(FOLDER in scene for scene in bpy.data.scenes):
        register()
    else:
        main(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:])


if __name__ == "__main__":
    run()

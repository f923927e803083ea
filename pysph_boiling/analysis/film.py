"""A 3-D run for film makers: closed meshes of water and bubbles as PLY, OBJ or USD, for Blender, Houdini and others.

The meshes are those of :func:`~pysph_boiling.analysis.surface.closed_meshes`. Lengths are in metres, and z is up.
"""
import json
import os
from pathlib import Path

import numpy as np

from pysph_boiling.analysis.rendering import chosen_files, drawn_into, geometry
from pysph_boiling.analysis.surface import closed_meshes
from pysph_boiling.extras import needed
from pysph_boiling.files import Manifest, load_output, whole

__all__ = ["MESHES", "blender_script", "write_meshes", "write_usd"]

MESHES = ("ply", "obj")
VERTEX = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("vx", "<f4"), ("vy", "<f4"), ("vz", "<f4"), ("bubble", "<i4")]
PLY_TYPES = {"<f4": "float", "<i4": "int"}
COLOURS = {"water": ((0.55, 0.78, 0.9), 0.35), "bubbles": ((1.0, 1.0, 1.0), 0.6)}  # in USD: colour, opacity


def blender_script():
    """Path of the script that loads ``frames.json`` and its meshes into Blender."""
    return Path(__file__).with_name("blender_sequence.py")


def write_meshes(output_dir, kind, *, every=1, out=None, track=iter):
    """Write the meshes of a run, two files a frame, and ``frames.json``; returns the path of the latter.

    ``water_00000.ply`` and ``bubbles_00000.ply`` of every ``every``-th output, and so on, go to ``out`` (default
    ``<output_dir>/mesh``), from which those of an earlier call are removed. Each is one closed mesh. A moment without
    bubbles has a file without points, so that no number is missing in the series. ``frames.json`` has the time [s] and
    the names of the files of each frame, the units and the axis that is up.

    ``kind`` is "ply" or "obj". PLY files have the velocity ``vx, vy, vz`` [m/s] at each point, for motion blur, and the
    label ``bubble`` of its bubble, which stays the same while the bubble lives. OBJ files cannot have numbers at
    points: they have a group for each bubble, named after its label, and no velocity.

    Errors: ``ValueError`` for another kind and a 2-D run, ``FileNotFoundError`` if the folder holds no output,
    ``FileExistsError`` if a file of the user would be overwritten, ``ModuleNotFoundError`` if a package is missing.
    """
    if kind not in MESHES:
        raise ValueError(f"the kind of mesh must be one of {', '.join(MESHES)}, got {kind!r}")
    write = {"ply": write_ply, "obj": write_obj}[kind]
    known, frames = _frames(output_dir, every, track)
    folder, listed = drawn_into(output_dir, out, "mesh")
    folder.mkdir(parents=True, exist_ok=True)

    def claimed(name):
        listed.claim((folder / name).relative_to(listed.folder).as_posix())
        return folder / name

    rows = []
    for number, (t, meshes) in enumerate(frames):
        names = {part: f"{part}_{number:05d}.{kind}" for part in COLOURS}
        for part, name in names.items():
            write(claimed(name), getattr(meshes, part))
        rows.append({"time": t, **names})
    record = {"scene": known.scene, "up": "z", "units": {"length": "m", "time": "s", "velocity": "m/s"},
              "spacing": known.spacing,
              "attributes": ["vx", "vy", "vz", "bubble"] if kind == "ply" else [], "frames": rows}
    with whole(claimed("frames.json")) as part:
        part.write_text(json.dumps(record, indent=1) + "\n")
    return folder / "frames.json"


def write_usd(output_dir, *, every=1, out=None, track=iter):
    """Write the meshes of a run as one USD file with a sample for each frame; returns its path.

    The file is ``out`` (default ``<output_dir>/film.usdc``). ``/boiling/water`` and ``/boiling/bubbles`` are meshes
    with points, triangles and ``velocities`` [m/s] in time, and the latter has the label of its bubble at each point
    as ``primvars:bubble``. A second of the run is a second of the film: the frame rate is that of the outputs.

    Errors: those of :func:`write_meshes`, and ``ValueError`` for a name that does not end in .usd, .usda or .usdc.
    """
    path = Path(out) if out is not None else Path(output_dir) / "film.usdc"
    if path.suffix not in (".usd", ".usda", ".usdc"):
        raise ValueError(f"the name of a USD file must end in .usd, .usda or .usdc, got {path.name!r}")
    Usd, UsdGeom = (needed(f"pxr.{name}", "film") for name in ("Usd", "UsdGeom"))
    _, frames = _frames(output_dir, every, track)
    listed = Manifest(path.parent)
    listed.claim(path.name)
    part = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    part.unlink(missing_ok=True)
    try:
        stage = Usd.Stage.CreateNew(str(part))
        UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        root = UsdGeom.Xform.Define(stage, "/boiling").GetPrim()
        stage.SetDefaultPrim(root)
        prims = {name: _usd_mesh(stage, name) for name in COLOURS}
        samples = [(t, {name: _usd_arrays(getattr(meshes, name)) for name in COLOURS}) for t, meshes in frames]
        times = np.array([t for t, _ in samples])
        rate = 1.0 / np.median(np.diff(times)) if len(times) > 1 else 24.0
        for t, parts in samples:
            for name, arrays in parts.items():
                _set_sample(prims[name], arrays, rate * t)
        stage.SetTimeCodesPerSecond(rate)
        stage.SetFramesPerSecond(rate)
        stage.SetStartTimeCode(rate * times[0])
        stage.SetEndTimeCode(rate * times[-1])
        stage.Save()
        del stage, prims, root
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
    return path


def _frames(output_dir, every, track):
    """What all frames share (:func:`~.rendering.geometry`), and a generator of (t [s], meshes)."""
    files = chosen_files(output_dir, every)
    known = geometry(output_dir, files)
    if known.dim != 3:
        raise ValueError(f"meshes of surfaces need three dimensions, but this scene has {known.dim}")
    for name in ("pysplashsurf", "manifold3d"):
        needed(name, "film")

    def made():
        for file in track(files):
            arrays, t = load_output(file)
            yield t, closed_meshes(arrays, spacing=known.spacing, bounds=known.bounds)

    return known, made()


def write_ply(path, mesh):
    """Write a mesh as a binary PLY file, with ``vx, vy, vz`` [m/s] and, if it is one of bubbles, ``bubble``."""
    labelled = mesh.label is not None
    vertices = np.empty(len(mesh.points), VERTEX if labelled else VERTEX[:-1])
    for names, values in (("xyz", mesh.points), (("vx", "vy", "vz"), mesh.velocity)):
        for name, column in zip(names, values.T):
            vertices[name] = column
    if labelled:
        vertices["bubble"] = mesh.label
    faces = np.empty(len(mesh.triangles), [("n", "u1"), ("corners", "<i4", 3)])
    faces["n"], faces["corners"] = 3, mesh.triangles
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}",
            *(f"property {PLY_TYPES[kind]} {name}" for name, kind in vertices.dtype.descr),
            f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header", ""]
    with whole(path) as part:
        part.write_bytes("\n".join(head).encode() + vertices.tobytes() + faces.tobytes())


def write_obj(path, mesh):
    """Write a mesh as an OBJ file, with a group for each bubble."""
    lines = ["v {:.8g} {:.8g} {:.8g}".format(*point) for point in mesh.points]
    if mesh.label is None:
        groups = {"water": mesh.triangles}
    else:
        label = mesh.label[mesh.triangles[:, 0]]
        groups = {f"bubble_{one}": mesh.triangles[label == one] for one in np.unique(label)}
    for name, triangles in groups.items():
        lines += [f"g {name}", *("f {} {} {}".format(*corners) for corners in triangles + 1)]
    with whole(path) as part:
        part.write_text("\n".join(lines) + "\n")


def _usd_mesh(stage, name):
    """The mesh ``/boiling/<name>`` of a stage, without points yet."""
    UsdGeom, Sdf = needed("pxr.UsdGeom", "film"), needed("pxr.Sdf", "film")
    mesh = UsdGeom.Mesh.Define(stage, f"/boiling/{name}")
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    colour, opacity = COLOURS[name]
    mesh.CreateDisplayColorAttr([colour])
    mesh.CreateDisplayOpacityAttr([opacity])
    if name == "bubbles":
        UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("bubble", Sdf.ValueTypeNames.IntArray, UsdGeom.Tokens.vertex)
    return mesh


def _usd_arrays(mesh):
    """The arrays of a mesh in the types of USD, and its box."""
    Vt = needed("pxr.Vt", "film")
    points = np.ascontiguousarray(mesh.points, dtype=np.float32)
    box = np.array([points.min(axis=0), points.max(axis=0)]) if len(points) else np.zeros((2, 3), np.float32)
    return dict(
        points=Vt.Vec3fArray.FromNumpy(points),
        velocities=Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(mesh.velocity, dtype=np.float32)),
        counts=Vt.IntArray.FromNumpy(np.full(len(mesh.triangles), 3, np.int32)),
        corners=Vt.IntArray.FromNumpy(np.ascontiguousarray(mesh.triangles.ravel(), dtype=np.int32)),
        extent=Vt.Vec3fArray.FromNumpy(box),
        label=Vt.IntArray.FromNumpy(mesh.label.astype(np.int32)) if mesh.label is not None else None)


def _set_sample(mesh, arrays, code):
    for attribute, name in ((mesh.GetPointsAttr(), "points"), (mesh.GetVelocitiesAttr(), "velocities"),
                            (mesh.GetFaceVertexCountsAttr(), "counts"), (mesh.GetFaceVertexIndicesAttr(), "corners"),
                            (mesh.GetExtentAttr(), "extent")):
        attribute.Set(arrays[name], code)
    if arrays["label"] is not None:
        mesh.GetPrim().GetAttribute("primvars:bubble").Set(arrays["label"], code)

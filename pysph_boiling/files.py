"""The files of a run: which files in a folder this package wrote, and how to read a particle file safely.

PySPH writes HDF5. Its loader also unpickles ``.npz`` files, which can execute any code, so they are not read here.
"""
import io
import json
import os
import re
import struct
import zlib
from collections.abc import Callable
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np

__all__ = ["Manifest", "folder_of_run", "last_output", "load_output", "npz", "output_files", "output_time", "part_of",
           "read_output", "run_record", "whole"]

PARTICLES = re.compile(r"(.+)_(\d+)\.hdf5")  # name of a particle file of PySPH: that of the run, and the step
PART = re.compile(r"(.+_(\d+))\.rank\d{4,}\.h5")  # name of a file with the particles of one rank
# The first line of a list, by which it is recognised: lists of earlier versions begin with it too.
FIRST_LINE = "# What pysph_boiling wrote in this folder. Nothing else here is ever replaced or removed.\n"


@contextmanager
def whole(path):
    """A temporary path to write to inside ``with``, renamed to ``path`` at the end, so no reader sees half a file."""
    path = Path(path)
    part = path.with_name(f".{path.name}.part")
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def npz(table):
    """Bytes of an uncompressed NumPy archive of ``table``, name -> array (n,): what ``np.savez`` writes, in a quarter
    of its time. Limits: less than 4 GB."""
    heads, parts, central, at = {}, [], [], 0
    for name, values in table.items():
        values = np.ascontiguousarray(values)
        kind = values.dtype.str, values.shape
        if kind not in heads:
            memory = io.BytesIO()
            np.lib.format.write_array_header_1_0(memory, np.lib.format.header_data_from_array_1_0(values))
            heads[kind] = memory.getvalue(), zlib.crc32(memory.getvalue())
        head, sum_of_head = heads[kind]
        path, size = f"{name}.npy".encode(), len(head) + values.nbytes
        entry = struct.pack("<5H3I2H", 20, 0, 0, 0, 33, zlib.crc32(values, sum_of_head), size, size, len(path), 0)
        parts += [b"PK\x03\x04", entry, path, head, values.data]
        central += [b"PK\x01\x02\x14\x00", entry, struct.pack("<3H2I", 0, 0, 0, 0o600 << 16, at), path]
        at += 30 + len(path) + size
    entries = b"".join(central)
    end = struct.pack("<4s4H2IH", b"PK\x05\x06", 0, 0, len(table), len(table), len(entries), at, 0)
    return b"".join([*parts, entries, end])


class Manifest:
    """The list of files that this package wrote in a folder: the file ``MANIFEST``, one name per line.

    A file is listed before it is written. All files that are not listed belong to the user. In a folder that has the
    ``run.json`` of an earlier version but no list, the files such a version writes count as listed.
    """

    def __init__(self, folder):
        self.folder = Path(folder)
        self.file = self.folder / "MANIFEST"
        self.known = self.listed()

    def listed(self):
        """Set of the listed names, relative to the folder."""
        try:
            lines = self.file.read_text(errors="replace").splitlines(keepends=True)
        except OSError:
            return self.earlier()
        return {"MANIFEST", *map(str.strip, lines[1:])} if lines[:1] == [FIRST_LINE] else set()

    def earlier(self):
        """Names of the files that a version without the list wrote here."""
        scene = run_record(self.folder).get("scene")
        if not scene:
            return set()
        own = (rf"{re.escape(scene)}(_\d{{5,}}\.hdf5|\.info|\.log)|run\.json|results\.npz|profile_info\.csv|"
               r"frames/frame_\d{5}\.png|(frames|history|front|profile)\.png")
        return {name for name in self.found() if re.fullmatch(own, name)}

    def found(self):
        """Names of all files in the folder and in its folders of pictures."""
        return [path.relative_to(self.folder).as_posix() for pattern in ("*", "frames/*", "mesh/*", "paraview/*")
                for path in self.folder.glob(pattern) if path.is_file()]

    def refuse(self, *patterns):
        """Raise ``FileExistsError`` if a file that matches one of the regular expressions is the user's."""
        self._keep(name for name in self.found() if any(re.fullmatch(pattern, name) for pattern in patterns))

    def _keep(self, names):
        """Raise ``FileExistsError`` if one of these files, which exist, is the user's."""
        theirs = sorted(name for name in names if name not in self.known)
        if theirs:
            raise FileExistsError(
                f"{self.folder} holds {', '.join(theirs[:3])}{' and others' if len(theirs) > 3 else ''}, which "
                "pysph_boiling did not write and would overwrite: move it away, or choose another folder")

    def claim(self, *names):
        """List files that are about to be written. Errors: ``FileExistsError`` if one exists and is the user's."""
        new = [name for name in map(str, names) if name not in self.known]
        if not new and "MANIFEST" in self.known:
            return
        self._keep(name for name in new if (self.folder / name).is_file())
        self.folder.mkdir(parents=True, exist_ok=True)
        if "MANIFEST" not in self.known:
            self.refuse("MANIFEST")
            new = sorted(self.known | set(new))
        with open(self.file, "a") as opened:
            opened.write(("" if opened.tell() else FIRST_LINE) + "".join(f"{name}\n" for name in new))
        self.known |= {"MANIFEST", *new}

    def remove(self, which=lambda name: True):
        """Remove the listed files for which ``which(name)`` is true, with half-written copies; returns their names."""
        self.known = self.listed()
        gone = []
        for name in sorted(self.known - {"MANIFEST"}):
            path = self.folder / name
            path.with_name(f".{path.name}.part").unlink(missing_ok=True)
            if which(name):
                if path.is_file():
                    path.unlink()
                    gone.append(name)
                self.known.discard(name)
        if self.file.exists():
            with whole(self.file) as part:
                part.write_text(FIRST_LINE + "".join(f"{name}\n" for name in sorted(self.known - {"MANIFEST"})))
        return gone


def run_record(folder):
    """The content of ``run.json`` in a folder as a dict; empty if there is no readable one."""
    try:
        record = json.loads((Path(folder) / "run.json").read_text())
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) else {}


def folder_of_run(path, scene):
    """The folder of a finished run of ``scene``, from the folder itself or from the ``.info`` file that PySPH writes.

    Errors: ``FileNotFoundError`` if it has no such file; ``ValueError`` if it holds a run of another scene.
    """
    path = Path(path)
    folder = path if path.is_dir() else path.parent
    if not (path.is_file() or any(path.glob("*.info"))):
        raise FileNotFoundError(f"there is no run in {path}: it has no .info file, which a run writes as it begins")
    other = run_record(folder).get("scene", scene)
    if other != scene:
        raise ValueError(f"{folder} holds a run of {other}, not of {scene}")
    return folder


def part_of(path, rank):
    """Path of the file with the particles of one rank, next to the particle file ``path`` that joins them."""
    return path.with_name(f"{path.stem}.rank{rank:04d}.h5")


def step_of(name):
    """Number of the step in the name of a particle file, or of a rank's part of it; -1 for any other name."""
    found = PARTICLES.fullmatch(Path(name).name) or PART.fullmatch(Path(name).name)
    return int(found[2]) if found else -1


def output_files(folder: str | os.PathLike, name: str | None = None) -> list[str]:
    """Paths (str) of the particle files of a run, in order of time; an empty list if there are none.

    ``name`` is the name of the run, with which its files begin; it is found from the folder if not given. Errors:
    ``ValueError`` for a folder that holds files of several runs and no list of ours.
    """
    named = {path: match[1] for path in Path(folder).glob("*.hdf5") if (match := PARTICLES.fullmatch(path.name))}
    found = [path for path in named if name in (None, named[path])]
    ours = Manifest(folder).known
    found = [path for path in found if path.name in ours] or found
    runs = sorted({named[path] for path in found})
    if len(runs) > 1:
        raise ValueError(f"{folder} holds particle files of several runs, {', '.join(runs)}: move the files of each "
                         "run into a folder of its own")
    return [str(path) for path in sorted(found, key=lambda path: step_of(path.name))]


def last_output(folder, name=None):
    """The newest complete particle file, or ``None``; parameters are those of :func:`output_files`."""
    for file in reversed(output_files(folder, name)):
        try:
            check_output(file)
        except ValueError:
            continue
        return file
    return None


def read_output(file: str | os.PathLike, share: Callable[[str, int], slice] | None = None) -> tuple[dict, dict]:
    """Read a particle file; returns (arrays by name, solver data).

    ``share(name, n)`` is the slice of the ``n`` particles of an array to be read; all if not given. No others are read,
    also of a file that joins those of several ranks.

    Errors: ``FileNotFoundError``; ``ValueError`` for a file that is truncated, is not HDF5, was not written by PySPH,
    or refers to other files.
    """
    from pysph.solver.output import HDFOutput

    check_output(file)
    reader = HDFOutput()
    if share is not None:
        whole_groups = reader._get_particles
        reader._get_particles = lambda group: whole_groups(
            {name: shared(array, partial(share, name)) for name, array in group.items()})
    data = reader.load(str(file))
    return data["arrays"], data["solver_data"]


def load_output(file):
    """Arrays and time [s] of an output file, without properties that the file names but does not store."""
    arrays, solver_data = read_output(file)
    for pa in arrays.values():
        for name in set(pa.properties) - set(pa.output_property_arrays) - {"x", "y", "z", "tag", "gid", "pid"}:
            pa.remove_property(name)
    return arrays, float(solver_data["t"])


def output_time(file):
    """Time [s] of a particle file, read from its header, which is a hundred times faster than loading it."""
    import h5py

    with h5py.File(file, "r") as opened:
        return float(opened["solver_data"].attrs["t"])


class SomeRows:
    """Some particles of a property in an open particle file, for PySPH's reader."""

    def __init__(self, data, share):
        self.attrs, self.data = data.attrs, data
        self.stride = int(data.attrs.get("stride", 1))
        self.rows = share(len(data) // self.stride)

    def __array__(self, dtype=None, copy=None):
        return self.data[self.rows.start * self.stride:self.rows.stop * self.stride]


def shared(array, share):
    """The group of a particle array in an open file as PySPH reads it, with the particles ``share(n)`` only."""
    return {"constants": array["constants"],
            "arrays": {name: SomeRows(data, share) for name, data in array["arrays"].items()}}


def check_output(file):
    """Raise the errors of :func:`read_output` without making particle arrays."""
    import h5py

    if not Path(file).is_file():
        raise FileNotFoundError(f"there is no particle file {file}")
    try:
        with h5py.File(file, "r") as opened:
            problem = foreign(opened) or next(filter(None, map(foreign_part, parts_of(opened))), None)
    except (OSError, RuntimeError, KeyError) as error:
        raise ValueError(f"{file} is not a complete HDF5 file: {str(error).splitlines()[0]}") from None
    if problem:
        raise ValueError(f"{file} is not a particle file of PySPH: {problem}")


def parts_of(opened):
    """Paths of the files of single ranks that an open HDF5 file joins, sorted."""
    import h5py

    found = set()

    def look(_, member):
        if isinstance(member, h5py.Dataset) and member.is_virtual:
            found.update(source.file_name for source in member.virtual_sources())

    opened.visititems(look)
    return sorted(Path(opened.filename).parent / name for name in found)


def foreign_part(path):
    """The first difference between the file of a rank and one that PySPH writes, as text, or ``None``."""
    import h5py

    if not path.is_file():  # HDF5 itself would read zeros
        return f"the file {path.name} with the particles of one rank is missing"
    with h5py.File(path, "r") as opened:
        problem = foreign(opened, joins=False)
    return problem and f"{path.name}: {problem}"


def foreign(opened, joins=True):
    """The first difference between an open HDF5 file and one that PySPH writes, as text, or ``None``.

    If it ``joins`` the files of several ranks, its arrays may be stored in these, which lie in the same folder.
    """
    import h5py

    def is_part(member):
        stem = Path(opened.filename).stem
        return joins and not member.external and all(
            (found := PART.fullmatch(source.file_name)) and found[1] == stem and source.dset_name == member.name
            for source in member.virtual_sources())

    def walk(group):
        for name in group:
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                yield f"'{group.name}/{name}' is a link"
                continue
            member = group[name]
            if isinstance(member, h5py.Group):
                yield from walk(member)
            elif member.external or (member.is_virtual and not is_part(member)):
                yield f"'{member.name}' is stored in another file"
            elif member.dtype.kind not in "iufb" or member.ndim != 1:
                yield f"'{member.name}' is not a one-dimensional array of numbers"
            else:
                member[-1:]  # a truncated file fails here

    for problem in walk(opened):
        return problem
    if set(opened) != {"solver_data", "particles"} or not {"t", "count", "dt"} <= set(opened["solver_data"].attrs):
        return "it does not hold solver_data and particles"
    for name, array in opened["particles"].items():
        if set(array) != {"arrays", "constants"}:
            return f"array '{name}' does not hold arrays and constants"
        lengths = {len(member) // int(member.attrs.get("stride", 1)) for member in array["arrays"].values()
                   if member.attrs.get("stored")}
        if len(lengths) > 1:
            return f"properties of '{name}' have different lengths"
    return None

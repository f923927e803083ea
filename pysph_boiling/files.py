"""The files of a run: which of a folder are ours, and reading a particle file without trusting it.

PySPH writes HDF5. Its loader would also unpickle what an ``.npz`` file holds, which can run anything: such files are
not read here.
"""
import json
import os
import re
from contextlib import contextmanager
from pathlib import Path

__all__ = ["Manifest", "last_output", "output_files", "read_output", "whole"]

PARTICLES = re.compile(r"(.+)_(\d+)\.hdf5")  # name of a particle file of PySPH: that of the run, and the step
FIRST_LINE = "# What pysph_boiling wrote in this folder. Nothing else here is ever replaced or removed.\n"


@contextmanager
def whole(path):
    """A path to write to in a block of ``with``; it becomes ``path`` at its end, so that no reader sees half a file."""
    path = Path(path)
    part = path.with_name(f".{path.name}.part")
    try:
        yield part
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


class Manifest:
    """Which files of a folder are ours: the file ``MANIFEST`` in it lists them, one a line.

    A file is listed before it is written. What is not listed is the user's. A folder without the list, in which an
    earlier version of ours has left its ``run.json``, is taken for what that version wrote.
    """

    def __init__(self, folder):
        self.folder = Path(folder)
        self.file = self.folder / "MANIFEST"
        self.known = self.listed()

    def listed(self):
        """Names relative to the folder, a set."""
        try:
            lines = self.file.read_text(errors="replace").splitlines(keepends=True)
        except OSError:
            return self.earlier()
        return {"MANIFEST", *map(str.strip, lines[1:])} if lines[:1] == [FIRST_LINE] else set()

    def earlier(self):
        """What a version without the list wrote here."""
        scene = run_record(self.folder).get("scene")
        if not scene:
            return set()
        own = (rf"{re.escape(scene)}(_\d{{5,}}\.hdf5|\.info|\.log)|run\.json|results\.npz|profile_info\.csv|"
               r"frames/frame_\d{5}\.png|(frames|history|front|profile)\.png")
        return {name for name in self.found() if re.fullmatch(own, name)}

    def found(self):
        """Names of all files in the folder and in the folders of pictures."""
        return [path.relative_to(self.folder).as_posix() for pattern in ("*", "frames/*", "paraview/*")
                for path in self.folder.glob(pattern) if path.is_file()]

    def refuse(self, *patterns):
        """Raise ``FileExistsError`` for a file that a run would write (regular expressions) and that is the user's."""
        theirs = sorted(name for name in self.found() if name not in self.known and any(
            re.fullmatch(pattern, name) for pattern in patterns))
        if theirs:
            raise FileExistsError(
                f"{self.folder} holds {', '.join(theirs[:3])}{' and others' if len(theirs) > 3 else ''}, which "
                "pysph_boiling did not write and would write over: move it away, or give another folder")

    def claim(self, *names):
        """List files that are about to be written. Errors: ``FileExistsError`` where one is there and the user's."""
        new = [name for name in map(str, names) if name not in self.known]
        if not new and "MANIFEST" in self.known:
            return
        self.refuse(*map(re.escape, new))
        self.folder.mkdir(parents=True, exist_ok=True)
        if "MANIFEST" not in self.known:
            self.refuse("MANIFEST")
            new = sorted(self.known | set(new))
        with open(self.file, "a") as opened:
            opened.write(("" if opened.tell() else FIRST_LINE) + "".join(f"{name}\n" for name in new))
        self.known |= {"MANIFEST", *new}

    def remove(self, which=lambda name: True):
        """Remove those of our files whose name ``which`` holds for, and what of them was half written; the names."""
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
    """What ``run.json`` of a folder holds, a dict; empty where there is none that reads."""
    try:
        record = json.loads((Path(folder) / "run.json").read_text())
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) else {}


def step_of(name):
    """Step of a particle file by its name; -1 for the name of another file."""
    found = PARTICLES.fullmatch(Path(name).name)
    return int(found[2]) if found else -1


def output_files(folder, name=None):
    """Paths (str) of the particle files of a run, in order of time; none where there are none.

    ``name`` is that of the run, with which its files begin; the folder tells if it is not given. Errors: ``ValueError``
    for a folder that holds files of several runs, and no list that tells ours from others.
    """
    found = [path for path in Path(folder).glob("*.hdf5") if PARTICLES.fullmatch(path.name)]
    if name is not None:
        found = [path for path in found if PARTICLES.fullmatch(path.name)[1] == name]
    ours = Manifest(folder).known
    found = [path for path in found if path.name in ours] or found
    runs = sorted({PARTICLES.fullmatch(path.name)[1] for path in found})
    if len(runs) > 1:
        raise ValueError(f"{folder} holds particle files of several runs, {', '.join(runs)}: move those of one into a "
                         "folder of its own")
    return [str(path) for path in sorted(found, key=lambda path: step_of(path.name))]


def last_output(folder, name=None):
    """The newest particle file that reads whole, or ``None``; folder and name as for :func:`output_files`."""
    for file in reversed(output_files(folder, name)):
        try:
            check_output(file)
        except ValueError:
            continue
        return file
    return None


def read_output(file):
    """(arrays by name, solver data) of a particle file.

    Errors: ``FileNotFoundError``; ``ValueError`` for a file that is cut off, is not HDF5, is not one that PySPH wrote,
    or refers to other files.
    """
    from pysph.solver.utils import load

    check_output(file)
    data = load(str(file))
    return data["arrays"], data["solver_data"]


def check_output(file):
    """Raise what :func:`read_output` raises, without making particle arrays."""
    import h5py

    if not Path(file).is_file():
        raise FileNotFoundError(f"no particle file {file}")
    try:
        with h5py.File(file, "r") as opened:
            problem = foreign(opened)
    except (OSError, RuntimeError, KeyError) as error:
        raise ValueError(f"{file} is not a complete HDF5 file: {str(error).splitlines()[0]}") from None
    if problem:
        raise ValueError(f"{file} is not a particle file of PySPH: {problem}")


def foreign(opened):
    """What tells an open HDF5 file from one that PySPH wrote, or ``None``."""
    import h5py

    def walk(group):
        for name in group:
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                yield f"'{group.name}/{name}' is a link"
                continue
            member = group[name]
            if isinstance(member, h5py.Group):
                yield from walk(member)
            elif member.external or member.is_virtual:
                yield f"'{member.name}' lies in another file"
            elif member.dtype.kind not in "iufb" or member.ndim != 1:
                yield f"'{member.name}' does not hold numbers in a row"
            else:
                member[-1:]  # a file that is cut off fails here

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

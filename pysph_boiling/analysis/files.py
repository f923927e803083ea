"""Particle files of a run: which there are, and reading one without trusting it.

PySPH writes HDF5. Its loader would also unpickle what an ``.npz`` file holds, which can run anything: such files are
not read here.
"""
from pathlib import Path

__all__ = ["last_output", "output_files", "read_output"]


def output_files(folder):
    """Paths (str) of the particle files of a run, in order of time; none where there are none."""
    found = [path for path in Path(folder).glob("*_[0-9]*.hdf5") if path.stem.rpartition("_")[2].isdigit()]
    return [str(path) for path in sorted(found, key=lambda path: int(path.stem.rpartition("_")[2]))]


def last_output(folder):
    """The newest particle file that reads whole, or ``None``."""
    for file in reversed(output_files(folder)):
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

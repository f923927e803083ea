"""Result files that are cut off, foreign or made to harm: a clear error, and nothing in them is executed."""
import os
import pickle

import h5py
import numpy as np
import pytest
from pysph.base.utils import get_particle_array
from pysph.solver.utils import dump

from pysph_boiling.cli import main
from pysph_boiling.files import check_output, last_output, output_files, read_output
from pysph_boiling.results import load_results


class Harm:
    """Unpickled, it makes a file."""

    def __init__(self, path):
        self.path = str(path)

    def __reduce__(self):
        return os.mkdir, (self.path,)


@pytest.fixture
def written(tmp_path):
    """A particle file as PySPH writes it, of 50 particles."""
    pa = get_particle_array(name="fluid", x=np.linspace(0.0, 1.0, 50), m=2.0, h=0.1)
    pa.add_constant("steps", 3.0)
    dump(str(tmp_path / "scene_00010.hdf5"), [pa], dict(t=0.5, dt=0.1, count=10))
    return tmp_path / "scene_00010.hdf5"


def test_whole_file_reads(written):
    arrays, solver_data = read_output(written)
    np.testing.assert_array_equal(arrays["fluid"].x, np.linspace(0.0, 1.0, 50))
    assert float(solver_data["t"]) == 0.5 and arrays["fluid"].constants["steps"][0] == 3.0


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.99])
def test_file_that_is_cut_off_is_refused(written, share):
    whole = written.read_bytes()
    written.write_bytes(whole[:int(share * len(whole))])
    with pytest.raises(ValueError, match="is not a complete HDF5 file"):
        read_output(written)


def change(path, edit):
    with h5py.File(path, "r+") as opened:
        edit(opened)


@pytest.mark.parametrize(("edit", "problem"), [
    (lambda f: f.pop("solver_data"), "does not hold solver_data and particles"),
    (lambda f: f["solver_data"].attrs.pop("t"), "does not hold solver_data and particles"),
    (lambda f: f["particles/fluid"].pop("constants"), "does not hold arrays and constants"),
    (lambda f: f.__setitem__("particles/fluid/arrays/x2", h5py.SoftLink("/particles/fluid/arrays/x")), "is a link"),
    (lambda f: f.__setitem__("particles/other", h5py.ExternalLink("elsewhere.hdf5", "/")), "is a link"),
    (lambda f: f.create_dataset("particles/fluid/arrays/far", (4,), "f8", external=[("/etc/hostname", 0, 32)]),
     "is stored in another file"),
    (lambda f: f.create_dataset("particles/fluid/arrays/words", data=[b"a", b"b"]), "is not a one-dimensional"),
    (lambda f: f.create_dataset("particles/fluid/arrays/square", data=np.zeros((3, 3))), "is not a one-dimensional"),
], ids=["no solver data", "no time", "no constants", "soft link", "external link", "external data", "text", "matrix"])
def test_foreign_file_is_refused(written, edit, problem):
    change(written, edit)
    with pytest.raises(ValueError, match=f"is not a particle file of PySPH: .*{problem}"):
        read_output(written)


def test_properties_of_different_lengths_are_refused(written):
    def shorten(f):
        group = f["particles/fluid/arrays"]
        attributes = dict(group["x"].attrs)
        del group["x"]
        group.create_dataset("x", data=np.zeros(3)).attrs.update(attributes)

    change(written, shorten)
    with pytest.raises(ValueError, match="properties of 'fluid' have different lengths"):
        read_output(written)


def test_pickle_is_never_loaded(tmp_path):
    """PySPH would unpickle an .npz of particles; ours reads HDF5 only, and results tables without pickles."""
    made = tmp_path / "made"
    for name in ("scene_00010.npz", "results.npz"):
        np.savez(tmp_path / name, version=np.array(2), solver_data=np.array(Harm(made), dtype=object))
    (tmp_path / "scene_00020.hdf5").write_bytes(pickle.dumps(Harm(made)))
    with pytest.raises(ValueError, match="is not a complete HDF5 file"):
        read_output(tmp_path / "scene_00010.npz")
    with pytest.raises(ValueError, match="is not a complete results table"):
        load_results(tmp_path)
    assert main(["render", str(tmp_path)]) == 2
    assert not made.exists()
    with np.load(tmp_path / "results.npz", allow_pickle=True) as data:
        data["solver_data"]  # it would have harmed
    assert made.exists()


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 and then nothing", b"no archive"])
def test_broken_results_are_refused(tmp_path, content):
    (tmp_path / "results.npz").write_bytes(content)
    with pytest.raises(ValueError, match="results.npz is not a complete results table"):
        load_results(tmp_path)


def test_table_of_something_else_is_refused(tmp_path):
    for content in (dict(t=np.zeros(3), picture=np.zeros((4, 4))), dict(height=np.zeros(3)), {}):
        np.savez(tmp_path / "results.npz", **content)
        with pytest.raises(ValueError, match="is not a results table: it has no column t, or its columns"):
            load_results(tmp_path)


def test_last_output_is_the_newest_whole_one(written):
    folder = written.parent
    (folder / "scene_00030.hdf5").write_bytes(written.read_bytes())
    (folder / "scene_00100.hdf5").write_bytes(written.read_bytes()[:2000])
    (folder / "scene_final.hdf5").write_bytes(b"")
    names = [os.path.basename(file) for file in output_files(folder)]
    assert names == ["scene_00010.hdf5", "scene_00030.hdf5", "scene_00100.hdf5"]  # by number, not by letter
    assert last_output(folder) == str(folder / "scene_00030.hdf5")
    assert last_output(folder / "nowhere") is None
    with pytest.raises(FileNotFoundError, match="no particle file"):
        check_output(folder / "nowhere.hdf5")

"""Particle files that are copies of the last one: what PySPH's own writer and loader make of the same particles."""
import io
from time import process_time

import h5py
import numpy as np
import pytest
from pysph.base.utils import get_particle_array
from pysph.solver import output
from pysph.solver.utils import load

from pysph_boiling.files import last_output, output_files, part_of, read_output, step_of
from pysph_boiling.results import SavedRun
from pysph_boiling.schemes.particle_files import MARK, ParticleFiles, join_parts

N = 200


def particles(n=N):
    """A fluid with all kinds of properties and constants, not all of which are written, and an array of none."""
    generator = np.random.default_rng(n)
    fluid = get_particle_array(name="fluid", x=generator.random(n), m=2.0, h=0.1)
    fluid.add_property("phase", type="int", data=generator.integers(0, 4, n))
    fluid.add_property("bubble", type="unsigned int", data=generator.integers(0, 9, n))
    fluid.add_property("normal", stride=3, data=generator.random(3 * n))
    fluid.add_property("mine", default=7.5)  # a user's
    fluid.add_constant("steps", 3.0)
    fluid.add_constant("weights", np.arange(4.0))
    fluid.add_output_arrays(["phase", "bubble", "normal", "mine"])
    return [fluid, get_particle_array(name="sites", x=np.zeros(0))]


def written(writer, arrays, **solver_data):
    memory = io.BytesIO()
    writer.dump(memory, arrays, dict(t=0.5, dt=0.1, count=10) | solver_data)
    return b"".join(writer.pieces) if isinstance(writer, ParticleFiles) else memory.getvalue()


def content(file):
    """Everything that a file says: path -> (type, values, attributes with their types)."""
    found = {}

    def look(path, item):
        numbers = (item.dtype, item[()].tolist()) if isinstance(item, h5py.Dataset) else None
        found[path] = numbers, {name: (type(value), value) for name, value in item.attrs.items()}

    with h5py.File(io.BytesIO(file), "r") as opened:
        opened.visititems(look)
    return found


def move(arrays):
    """Give every number that is written another value, but for what tells ghosts from others."""
    for pa in arrays:
        for name in set(pa.properties) - {"tag"}:
            pa.get(name, only_real_particles=False)[:] += 1
        for values in pa.constants.values():
            values.get_npy_array()[:] += 0.25


def own(writer, monkeypatch):
    """Count the files that PySPH writes itself, from now on; returns the list they go to."""
    calls, plain = [], output.HDFOutput._dump
    monkeypatch.setattr(output.HDFOutput, "_dump", lambda self, file: (calls.append(file), plain(self, file)))
    return calls


@pytest.mark.parametrize("options", ({}, dict(detailed_output=True), dict(compress=True)), ids=str)
def test_files_say_what_those_of_pysph_say(options):
    arrays, writer = particles(), ParticleFiles(**options)
    for step in range(3):
        move(arrays)
        solver_data = dict(t=0.1 * step, dt=0.1, count=step)
        assert content(written(writer, arrays, **solver_data)) == content(
            written(output.HDFOutput(**options), arrays, **solver_data))


def test_pysph_loads_what_was_written(tmp_path):
    arrays, writer = particles(), ParticleFiles()
    written(writer, arrays)
    move(arrays)
    (tmp_path / "a_00010.hdf5").write_bytes(written(writer, arrays, t=0.75))
    data = load(str(tmp_path / "a_00010.hdf5"))
    assert data["solver_data"] == dict(t=0.75, dt=0.1, count=10)
    for pa in arrays:
        found = data["arrays"][pa.name]
        assert sorted(found.output_property_arrays) == sorted(pa.output_property_arrays)
        assert set(found.properties) == set(pa.properties) and found.stride == pa.stride
        for name in pa.output_property_arrays:
            np.testing.assert_array_equal(found.get(name), pa.get(name), err_msg=name)
        for name in pa.constants:
            np.testing.assert_array_equal(getattr(found, name), getattr(pa, name), err_msg=name)


def test_the_mark_of_an_attribute_may_occur_in_a_property():
    arrays, writer = particles(), ParticleFiles()
    arrays[0].x[3] = np.frombuffer(MARK + b"\x01")[0]
    for step in range(3):
        solver_data = dict(t=0.25 * step, dt=0.5 * step, count=7 + step)
        assert content(written(writer, arrays, **solver_data)) == content(
            written(output.HDFOutput(), arrays, **solver_data))
        arrays[0].y[:] += 1.0


def test_only_the_first_file_of_a_kind_is_made_anew(monkeypatch):
    arrays, writer = particles(), ParticleFiles()
    anew = own(writer, monkeypatch)
    for _ in range(4):
        written(writer, arrays)
    assert len(anew) == 1


@pytest.mark.parametrize("change", (
    lambda pa: pa.remove_particles(np.array([3])),
    lambda pa: (pa.extend(1), pa.align_particles()),
    lambda pa: pa.add_property("charge"),
    lambda pa: pa.add_output_arrays(["gid", "au"] if "au" in pa.properties else ["gid", "p"]),
    lambda pa: pa.set_output_arrays(["x"]),
    lambda pa: pa.add_constant("seen", [1.0, 2.0]),
    lambda pa: pa.remove_property("mine"),
), ids=("fewer", "more", "property", "written", "less", "constant", "removed"))
def test_what_users_change_between_two_files_is_written(change):
    arrays, writer = particles(), ParticleFiles()
    for _ in range(2):
        written(writer, arrays)
    change(arrays[0])
    for _ in range(2):
        move(arrays)
        assert content(written(writer, arrays)) == content(written(output.HDFOutput(), arrays))


def test_ghosts_are_not_written():
    arrays, writer = particles(), ParticleFiles()
    arrays[0].tag[-5:] = 1
    arrays[0].align_particles()
    for _ in range(2):
        move([arrays[1]])
        arrays[0].x[:] += 1.0
        file = content(written(writer, arrays))
    assert len(file["particles/fluid/arrays/x"][0][1]) == N - 5
    assert file == content(written(output.HDFOutput(), arrays))


def test_a_file_takes_less_than_half_of_what_pysph_takes():
    """Time of the processor, least of eight, PySPH's and ours by turns; measured: a twentieth."""
    arrays, ours, theirs = particles(20_000), ParticleFiles(), output.HDFOutput()
    written(ours, arrays)
    times = {ours: [], theirs: []}
    for _ in range(8):
        for writer, taken in times.items():
            start = process_time()
            written(writer, arrays)
            taken.append(process_time() - start)
    assert min(times[ours]) < 0.5 * min(times[theirs])


class TwoRanks:
    """A communicator as the first of two ranks sees it: the other one has what ``other`` are."""

    def __init__(self, other):
        self.other = other

    def gather(self, own, root):
        other = output.Output()
        other._dump = lambda file: None
        other.dump("", self.other, {})
        return [own, other.all_array_data]

    def Get_rank(self):  # noqa: N802 - as mpi4py has it
        return 0

    def Get_size(self):  # noqa: N802
        return 2


def test_particles_of_all_ranks_are_written():
    arrays, other = particles(), particles(30)
    comm = TwoRanks(other)
    ours, theirs = (kind(mpi_comm=comm) for kind in (ParticleFiles, output.HDFOutput))
    for change in (lambda: None, lambda: None, lambda: other[0].remove_particles(np.arange(4))):
        move(arrays + other)
        change()
        file = content(written(ours, arrays))
        assert file == content(written(theirs, arrays))
    assert len(file["particles/fluid/arrays/x"][0][1]) == N + 26


# --- one file for each rank -------------------------------------------------------------------------------------------

LENGTHS = (120, 0, 80)  # particles on three ranks


@pytest.fixture
def joined(tmp_path):
    """(file, parts, arrays): a file that joins those of three ranks, which hold parts of the same particles."""
    arrays, path = particles(sum(LENGTHS)), tmp_path / "run_00010.hdf5"
    parts = [part_of(path, rank) for rank in range(len(LENGTHS))]
    for part, end, n in zip(parts, np.cumsum(LENGTHS), LENGTHS):
        own = [pa.extract_particles(np.arange(end - n, end)) if pa.name == "fluid" else pa for pa in arrays]
        for made, pa in zip(own, arrays):
            made.set_output_arrays(pa.output_property_arrays)
        part.write_bytes(written(ParticleFiles(), own))
    join_parts(path, parts, np.array([[n, 0] for n in LENGTHS]))  # fluid, sites
    return path, parts, arrays


def test_pysph_reads_a_file_that_joins_those_of_the_ranks(joined, tmp_path, monkeypatch):
    path, parts, (fluid, _) = joined
    assert sum(part.stat().st_size for part in parts) > 20 * sum(LENGTHS) * 8 / 3 and path.stat().st_size > 0
    alone = tmp_path / "alone.hdf5"
    alone.write_bytes(written(ParticleFiles(), [fluid, joined[2][1]]))
    monkeypatch.chdir("/")  # parts are looked for beside the file, and not in the working directory
    data, whole = load(str(path)), load(str(alone))
    assert data["solver_data"] == whole["solver_data"]
    for name, pa in whole["arrays"].items():
        other = data["arrays"][name]
        assert set(other.properties) == set(pa.properties)
        assert sorted(other.output_property_arrays) == sorted(pa.output_property_arrays)
        for prop in pa.output_property_arrays:
            assert other.get(prop).dtype == pa.get(prop).dtype
            np.testing.assert_array_equal(other.get(prop), pa.get(prop))
        for constant, values in pa.constants.items():
            np.testing.assert_array_equal(other.constants[constant].get_npy_array(), values.get_npy_array())
    assert len(read_output(path)[0]["fluid"].x) == sum(LENGTHS)
    run = SavedRun(tmp_path)
    assert run.times == [data["solver_data"]["t"]] and len(run.particles(run.times[0])["fluid"].x) == sum(LENGTHS)
    assert output_files(tmp_path, "run") == [str(path)] and step_of(parts[2]) == 10


@pytest.mark.parametrize("rows", [slice(0, 50), slice(100, 150), slice(150, 200), slice(0, 0)])
def test_a_rank_that_resumes_reads_its_share_only(joined, rows, monkeypatch):
    path, _, (fluid, sites) = joined
    read, get = [], h5py.Dataset.__getitem__

    def counted(data, which):
        values = get(data, which)
        read.append(np.size(values))
        return values

    monkeypatch.setattr(h5py.Dataset, "__getitem__", counted)
    monkeypatch.setattr(h5py.Dataset, "__array__", lambda data, *_, **__: counted(data, slice(None)))
    arrays, _ = read_output(path, lambda name, n: rows if name == "fluid" else slice(0, n))
    assert max(read) == max(3 * (rows.stop - rows.start), 4)  # a property of three numbers; a constant of four
    for name in fluid.output_property_arrays:
        stride = fluid.stride.get(name, 1)
        of_share = fluid.get(name)[stride * rows.start:stride * rows.stop]
        np.testing.assert_array_equal(arrays["fluid"].get(name), of_share)
    assert arrays["fluid"].get_number_of_particles() == rows.stop - rows.start
    assert arrays["fluid"].constants["weights"].get_npy_array().tolist() == [0.0, 1.0, 2.0, 3.0]
    assert arrays["sites"].get_number_of_particles() == sites.get_number_of_particles()


def test_a_part_that_is_missing_or_cut_off_is_noticed(joined):
    """HDF5 itself would read zeros."""
    path, parts, _ = joined
    whole = parts[2].read_bytes()
    parts[2].write_bytes(whole[:-200])
    with pytest.raises(ValueError, match="is not a complete HDF5 file"):
        read_output(path)
    parts[2].unlink()
    assert load(str(path))["arrays"]["fluid"].m[-1] == 0.0
    with pytest.raises(ValueError, match="the file run_00010.rank0002.h5 with the particles of one rank is missing"):
        read_output(path)
    assert last_output(path.parent, "run") is None
    parts[2].write_bytes(whole)
    assert last_output(path.parent, "run") == str(path)


@pytest.mark.parametrize("source", ["../run_00010.rank0002.h5", "/etc/run_00010.rank0002.h5", "run_00011.rank0002.h5",
                                    "secret.h5", "."])
def test_a_file_that_joins_others_than_its_own_parts_is_refused(joined, source):
    path, _, _ = joined
    with h5py.File(path, "r+") as opened:
        group = opened["particles/fluid/arrays"]
        attributes = dict(group["x"].attrs)
        del group["x"]
        layout = h5py.VirtualLayout(shape=(sum(LENGTHS),), dtype=float)
        layout[:80] = h5py.VirtualSource(source, "/particles/fluid/arrays/x", shape=(80,))
        group.create_virtual_dataset("x", layout).attrs.update(attributes)
    with pytest.raises(ValueError, match="'/particles/fluid/arrays/x' is stored in another file"):
        read_output(path)

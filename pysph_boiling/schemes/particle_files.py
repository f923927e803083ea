"""Writing PySPH's particle files faster, and on several ranks one file for each.

PySPH spends nine tenths of the time for a file on its attributes, six for each property, which are the same in every
file of a run. On several ranks it gathers all particles on the first one.
"""
import io
from typing import NamedTuple

import h5py
import numpy as np
from pysph.solver.output import HDFOutput

from pysph_boiling.particles import TABLES

__all__ = ["ParticleFiles", "join_parts"]

MARK = b"\x3b\xa7\x1c\x55\xd2\x6e\x29"  # with another byte behind it, a number by which an attribute is found in a file


class Places(NamedTuple):
    """Where numbers lie in a file: of datasets (first byte, last byte + 1, array, group, name), and of solver data.

    The latter maps names to (first byte, dtype); each has 8 bytes.
    """

    datasets: list
    solver_data: dict


class ParticleFiles(HDFOutput):
    """PySPH's HDF5 writer, which keeps the last file and replaces its numbers if nothing else has changed.

    ``dump(None, particles, solver_data)`` is PySPH's method. Then ``pieces`` are the parts of the file, in order; some
    are the numbers of the particle arrays themselves, so write them before these change. PySPH writes the first file,
    and each file whose arrays, properties, attributes or lengths differ from the last one. Any other file is the last
    one, with the present numbers at the positions given by HDF5.

    Limits: compressed numbers have no fixed positions, so PySPH writes every compressed file.
    """

    file = layout = None  # the last file that PySPH wrote, and its layout
    places = None  # in that file
    pieces = ()

    def _dump(self, _):
        for info in self.particle_data.values():
            info["constants"] = {name: value for name, value in info["constants"].items() if name not in TABLES}
        layout = self._layout()
        if not self.compress and layout == self.layout:
            self.places = self.places or places(self.file, self.solver_data)
            if self.places:
                self.pieces = list(self._replaced())
                return
        memory = io.BytesIO()
        super()._dump(memory)
        self.file, self.layout, self.places = bytearray(memory.getbuffer()), layout, None
        self.pieces = [self.file]

    def _replaced(self):
        """The parts of the last file, with the present numbers."""
        for name, (first, dtype) in self.places.solver_data.items():
            self.file[first:first + 8] = np.array(self.solver_data[name], dtype).tobytes()
        numbers, done, file = {name: self._numbers(name) for name in self.particle_data}, 0, memoryview(self.file)
        for first, end, array, group, name in self.places.datasets:
            yield file[done:first]
            yield np.ascontiguousarray(numbers[array][group][name]).data.cast("B")
            done = end
        yield file[done:]

    def _numbers(self, array):
        """The arrays of numbers to write for a particle array, by group: name -> array (n,)."""
        return {"arrays": self.all_array_data[array], "constants": self.particle_data[array]["constants"]}

    def _layout(self):
        """Everything in a file except its numbers, for comparison."""
        return {name: type(value) for name, value in self.solver_data.items()}, {
            array: (info["properties"], {
                (group, name): (numbers.dtype, numbers.shape)
                for group, members in self._numbers(array).items() for name, numbers in members.items()})
            for array, info in self.particle_data.items()}


def join_parts(path, parts, lengths):
    """Write a particle file of PySPH whose arrays are those of the files ``parts``, one after the other.

    The numbers stay in the parts, which must lie in the same folder (virtual datasets of HDF5). ``lengths`` (parts,
    arrays) are the numbers of particles, for the arrays in the order of their names. Constants and solver data are
    those of the first part. PySPH's ``load`` reads the file like any other.
    """
    with h5py.File(parts[0], "r") as first, h5py.File(path, "w") as joined:
        first.copy("solver_data", joined)
        for array, group in enumerate(first["particles"].values()):
            made = joined.create_group(f"{group.name}/arrays")
            first.copy(group["constants"], made.parent)
            for name, data in group["arrays"].items():
                sizes = lengths[:, array] * int(data.attrs["stride"]) * bool(data.attrs["stored"])
                if sizes.sum():
                    layout = h5py.VirtualLayout(shape=(int(sizes.sum()),), dtype=data.dtype)
                    for part, end, size in zip(parts, np.cumsum(sizes), sizes):
                        if size:
                            layout[end - size:end] = h5py.VirtualSource(part.name, data.name, shape=(int(size),))
                    new = made.create_virtual_dataset(name, layout)
                else:
                    new = made.create_dataset(name, (0,), dtype=data.dtype)
                new.attrs.update(data.attrs)


def places(file, solver_data):
    """The :class:`Places` in a file, given as bytes; ``None`` if solver data do not have 8 bytes each.

    HDF5 tells where a dataset is, but not where an attribute is: there numbers that occur nowhere else are written into
    a copy, and looked up in it.
    """
    datasets, attributes, copy = [], {}, io.BytesIO(file)

    def look(path, item):
        if isinstance(item, h5py.Dataset) and item.size:
            first = item.id.get_offset()
            datasets.append((first, first + item.id.get_storage_size(), *path.split("/")))

    with h5py.File(copy, "r+") as opened:
        opened["particles"].visititems(look)
        attrs = opened["solver_data"].attrs
        dtypes = {name: attrs.get_id(name).dtype for name in solver_data}
        if any(dtype.kind not in "if" or dtype.itemsize != 8 for dtype in dtypes.values()):
            return None
        for k, (name, dtype) in enumerate(dtypes.items()):
            attrs.modify(name, np.frombuffer(MARK + bytes([k]), dtype)[0])
    marked = copy.getvalue()
    for k, (name, dtype) in enumerate(dtypes.items()):
        first = marked.find(MARK + bytes([k]))
        if first < 0 or marked.find(MARK + bytes([k]), first + 1) >= 0:
            return None
        attributes[name] = first, dtype
    return Places(sorted(datasets), attributes)

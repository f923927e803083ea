"""Particle files as PySPH writes them, at the cost of their numbers.

Of the time of a file PySPH spends nine tenths on its attributes, six to each property, which are the same in every
file of a run.
"""
import io

import h5py
import numpy as np
from pysph.solver.output import HDFOutput

__all__ = ["ParticleFiles"]


class ParticleFiles(HDFOutput):
    """PySPH's writer of HDF5, which makes a file out of the last one where that differs in nothing but numbers.

    ``dump(memory, particles, solver_data)`` is PySPH's, to an empty ``io.BytesIO``. The first file, and each one whose
    arrays, properties, attributes or lengths are not those of the last, is PySPH's own work. Any other is a copy of the
    last one, with the present numbers in the places that HDF5 says theirs have.

    Limits: compressed numbers have no such places, so that every file that is compressed is PySPH's own work.
    """

    last = layout = None  # the last file of PySPH's own work, and what it looks like
    places = None  # in it: (first byte, last byte + 1, array, group, name) of everything that has a length

    def _dump(self, memory):
        layout = self._layout()
        if self.compress or layout != self.layout:
            super()._dump(memory)
            self.last, self.layout, self.places = memory.getvalue(), layout, None
            return
        if self.places is None:
            self.places = places(self.last)
        memory.write(self.last)
        with memory.getbuffer() as view:
            for first, end, array, group, name in self.places:
                view[first:end] = memoryview(np.ascontiguousarray(self._numbers(array)[group][name])).cast("B")
        with h5py.File(memory, "r+") as file:
            for name, value in self.solver_data.items():
                file["solver_data"].attrs.modify(name, value)

    def _numbers(self, array):
        """What of an array is written as numbers in a row, by the group it goes to: name -> array (n,)."""
        return {"arrays": self.all_array_data[array], "constants": self.particle_data[array]["constants"]}

    def _layout(self):
        """All that a file says but its numbers, to be compared."""
        return {name: type(value) for name, value in self.solver_data.items()}, {
            array: (info["properties"], {
                (group, name): (numbers.dtype, numbers.shape)
                for group, members in self._numbers(array).items() for name, numbers in members.items()})
            for array, info in self.particle_data.items()}


def places(file):
    """Where in a file (bytes) the numbers of its datasets lie: (first byte, last byte + 1, array, group, name)."""
    found = []

    def look(path, item):
        if isinstance(item, h5py.Dataset) and item.size:
            first = item.id.get_offset()
            found.append((first, first + item.id.get_storage_size(), *path.split("/")))

    with h5py.File(io.BytesIO(file), "r") as opened:
        opened["particles"].visititems(look)
    return found

"""Writing PySPH's particle files faster.

PySPH spends nine tenths of the time for a file on its attributes, six for each property, which are the same in every
file of a run.
"""
import io

import h5py
import numpy as np
from pysph.solver.output import HDFOutput

__all__ = ["ParticleFiles"]


class ParticleFiles(HDFOutput):
    """PySPH's HDF5 writer, which copies the last file and replaces its numbers if nothing else has changed.

    ``dump(memory, particles, solver_data)`` is PySPH's method, here for an empty ``io.BytesIO``. PySPH writes the first
    file, and each file whose arrays, properties, attributes or lengths differ from the last one. Any other file is a
    copy of the last one, with the present numbers at the positions given by HDF5.

    Limits: compressed numbers have no fixed positions, so PySPH writes every compressed file.
    """

    last = layout = None  # the last file that PySPH wrote, and its layout
    places = None  # its datasets: (first byte, last byte + 1, array, group, name)

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
        """The arrays of numbers to write for a particle array, by group: name -> array (n,)."""
        return {"arrays": self.all_array_data[array], "constants": self.particle_data[array]["constants"]}

    def _layout(self):
        """Everything in a file except its numbers, for comparison."""
        return {name: type(value) for name, value in self.solver_data.items()}, {
            array: (info["properties"], {
                (group, name): (numbers.dtype, numbers.shape)
                for group, members in self._numbers(array).items() for name, numbers in members.items()})
            for array, info in self.particle_data.items()}


def places(file):
    """Positions of the datasets in a file, given as bytes: (first byte, last byte + 1, array, group, name)."""
    found = []

    def look(path, item):
        if isinstance(item, h5py.Dataset) and item.size:
            first = item.id.get_offset()
            found.append((first, first + item.id.get_storage_size(), *path.split("/")))

    with h5py.File(io.BytesIO(file), "r") as opened:
        opened["particles"].visititems(look)
    return found

"""A neighbour search for any PySPH application: particles sorted into cells (``docs/search.md``).

This subpackage depends on NumPy and PySPH only, not on the rest of pysph_boiling. In a PySPH application::

    def create_nnps(self):
        return search_for(self)

"""
from pysph_boiling.search.sorted_cells import device_cell_nnps, search_for, sorted_cell_nnps

__all__ = ["device_cell_nnps", "search_for", "sorted_cell_nnps"]

"""A neighbour search for any PySPH application: particles sorted into cells (``docs/search.md``).

This package needs numpy, PySPH and what PySPH needs, and nothing else of ours. In an application::

    def create_nnps(self):
        return search_for(self)

"""
from pysph_boiling.search.sorted_cells import search_for, sorted_cell_nnps

__all__ = ["search_for", "sorted_cell_nnps"]

"""Applications with a scheme of PySPH: options as in our scenes, and the particle files of the run."""
from pysph.solver.application import Application

from pysph_boiling.files import folder_of_run, output_files
from pysph_boiling.names import scene_name
from pysph_boiling.runs import pysph_options
from pysph_boiling.search import search_for

__all__ = ["HostedApplication"]


class HostedApplication(Application):
    """A PySPH application with a scheme of PySPH, to which equations or a guest of ours are added.

    Its particle files are named after the module of the scene. Options of PySPH that do not work here are refused.
    """

    def __init__(self, fname=None, output_dir=None, domain=None):
        super().__init__(fname=fname or scene_name(type(self)), output_dir=output_dir, domain=domain)

    def _setup_argparse(self):
        super()._setup_argparse()
        pysph_options.settle(
            self.arg_parse, self.scheme, also={"--restart-file": "PySPH's own reader would execute code in the file"})

    def consume_user_options(self):
        pysph_options.check(self.options)

    def read_info(self, fname_or_dir):
        """PySPH's method, for a folder of this scene; raises ``FileNotFoundError`` or ``ValueError`` for another."""
        folder_of_run(fname_or_dir, self.fname)
        return super().read_info(fname_or_dir)

    @property
    def output_files(self):
        """Particle files of this run; PySPH's own list has every file whose name begins in the same way."""
        return output_files(self.output_dir, self.fname)

    def create_nnps(self):
        """Our neighbour search if ``--nnps`` names it; ``None`` lets PySPH make its own."""
        return search_for(self) if pysph_options.asks_for_ours(self.options) else None

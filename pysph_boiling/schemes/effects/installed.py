"""Effects of other packages, which are installed under the entry point ``pysph_boiling.effects``."""
import warnings
from importlib.metadata import entry_points

__all__ = ["GROUP", "load_installed"]

GROUP = "pysph_boiling.effects"


def load_installed(found=None):
    """Import the modules with effects of installed packages, in the order of their names.

    A module that cannot be imported is left out with a warning that gives the reason. ``found`` (a list of
    ``importlib.metadata.EntryPoint``) replaces the entry points of the installed packages.
    """
    for entry in sorted(entry_points(group=GROUP) if found is None else found, key=lambda entry: entry.name):
        try:
            entry.load()
        except Exception as error:  # an error in another package must not stop this one
            warnings.warn(f"the effect '{entry.name}' of {entry.value} cannot be loaded and is not available: "
                          f"{type(error).__name__}: {error}", stacklevel=2)

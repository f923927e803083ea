"""Effects of other packages: what is installed under the entry point ``pysph_boiling.effects`` registers itself."""
import warnings
from importlib.metadata import entry_points

__all__ = ["GROUP", "load_installed"]

GROUP = "pysph_boiling.effects"


def load_installed(found=None):
    """Import the modules that installed packages name as their effects, in the order of their names.

    One that cannot be imported is left out, and a warning says which and why. ``found`` replaces the entry points that
    are looked up (``importlib.metadata.EntryPoint``).
    """
    for entry in sorted(entry_points(group=GROUP) if found is None else found, key=lambda entry: entry.name):
        try:
            entry.load()
        except Exception as error:  # a package of somebody else: whatever it raises must not stop ours
            warnings.warn(f"the effect '{entry.name}' of {entry.value} cannot be loaded and is left out: "
                          f"{type(error).__name__}: {error}", stacklevel=2)

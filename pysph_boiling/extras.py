"""Optional packages, which are extras of this package."""
import importlib

__all__ = ["needed"]


def needed(name, extra):
    """Import the module ``name`` of an ``extra``; ``ModuleNotFoundError`` says how to install it."""
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(f"{name.partition('.')[0]} is missing: pip install 'pysph_boiling[{extra}]'",
                                  name=name) from error

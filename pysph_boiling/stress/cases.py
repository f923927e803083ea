"""All hard cases, in the order of the table."""
import importlib

__all__ = ["MODULES", "all_cases"]

MODULES = ("time_step", "heat", "arrangement", "bubbles", "paper_forms", "bodies")


def all_cases():
    """Name -> :class:`~pysph_boiling.stress.case.Case`."""
    found = [case for name in MODULES for case in importlib.import_module(f"pysph_boiling.stress.{name}").cases()]
    return {case.name: case for case in found}

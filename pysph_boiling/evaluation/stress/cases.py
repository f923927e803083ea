"""All difficult cases, in the order of the table."""
import importlib

__all__ = ["MODULES", "all_cases"]

MODULES = ("time_step", "heat", "arrangement", "bubbles", "paper_forms", "bodies")


def all_cases():
    """Name -> :class:`~pysph_boiling.evaluation.stress.case.Case`."""
    modules = [importlib.import_module(f"pysph_boiling.evaluation.stress.{name}") for name in MODULES]
    found = [case for module in modules for case in module.cases()]
    return {case.name: case for case in found}

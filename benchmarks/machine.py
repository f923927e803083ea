"""Texts about the machine on which a benchmark runs."""
import os

__all__ = ["load", "processors"]


def processors():
    """The number of cores and the processor."""
    from pysph_boiling.runs.provenance import processor  # a benchmark of memory wants no imports

    return f"{os.cpu_count()} cores ({processor() or 'unknown'})"


def load():
    """A sentence with the load average of the last minute."""
    return (f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores before the start; timings are only reliable "
            "on an idle machine")

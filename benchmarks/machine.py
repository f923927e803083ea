"""What a benchmark says of the machine that it ran on."""
import os

__all__ = ["load", "processors"]


def processors():
    """How many cores of which processor."""
    from pysph_boiling.runs.application import processor  # a benchmark of memory wants no imports

    return f"{os.cpu_count()} cores ({processor() or 'unknown'})"


def load():
    """The load average of the last minute, as a sentence."""
    return (f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores before the start: timings mean something on an "
            "idle machine only")

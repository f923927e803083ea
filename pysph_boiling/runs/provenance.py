"""Where, when and with what a run was made."""
import functools
import os
import platform
from contextlib import suppress
from datetime import datetime, timezone
from importlib import metadata
from pathlib import Path

__all__ = ["origin", "processor", "versions"]


def origin():
    """A dict that says where, when and with what a run was made: versions, machine, processor and time it finished."""
    return {"versions": versions(), "machine": machine(), "processor": processor(),
            "finished": datetime.now(timezone.utc).isoformat(timespec="seconds")}


@functools.cache
def machine():
    """The kind of machine and system, and the number of cores."""
    return f"{platform.machine()} {platform.system()}, {os.cpu_count()} cores"


@functools.cache
def versions():
    """Name -> version of Python and of the packages in use; cached, since finding them takes 20 ms."""
    found = {"python": platform.python_version()}
    for name in ("pysph_boiling", "pysph", "compyle", "numpy", "cython"):
        with suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found


@functools.cache
def processor():
    """Model of the processor, if the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")),
                platform.processor())

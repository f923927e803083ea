"""What a benchmark says of the machine that it ran on."""
import os

__all__ = ["load"]


def load():
    """The load average of the last minute, as a sentence."""
    return (f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores before the start: timings mean something on an "
            "idle machine only")

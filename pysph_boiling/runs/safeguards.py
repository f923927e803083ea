"""What the safeguards of a step did in a run, in words: the only place that words it, for all commands.

Safeguards belong to normal operation. A run reports how often each of them acted.
"""
import numpy as np

__all__ = ["sentences", "summary"]

# Column of the results -> (short form for a table, sentence). {n} is the total number, {steps} the number of steps.
COUNTS = {
    "n_split": ("split steps", "{n} of {steps} steps were split into shorter ones, to limit the displacement of "
                               "particles"),
    "n_limited": ("limited corrections", "{n} position corrections were shortened to the largest one allowed"),
    "n_projected": ("returned to the container", "{n} times a particle was moved back into the container"),
    "n_unconverged": ("unconverged steps", "{n} of {steps} steps ended with a mean density error above its bound"),
    "n_clamped": ("clamped volumes", "{n} times the change of a bubble's volume was limited"),
}
HEAT = "heat substeps", "a step took up to {n} heat substeps"


def acted(table):
    """Yields (short form, sentence, number) of each safeguard that acted; ``table`` is column -> array (rows,)."""
    for name, (short, sentence) in COUNTS.items():
        n = int(table[name][-1]) if len(table.get(name, ())) else 0
        if n > 0:
            yield short, sentence, n
    n = int(np.max(table.get("heat_subcycles", 1.0), initial=1.0))
    if n > 1:
        yield *HEAT, n


def sentences(table, steps):
    """One sentence for each safeguard that acted in the results ``table`` of a run of ``steps`` steps."""
    return [sentence.format(n=n, steps=steps) for _, sentence, n in acted(table)]


def summary(table):
    """The safeguards that acted and their numbers on one line, for a table: ``split steps 3, heat substeps 4``."""
    return ", ".join(f"{short} {n}" for short, _, n in acted(table))

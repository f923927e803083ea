"""Checks of end states: each function yields a sentence for every fault, and none if there is no fault."""
import numpy as np

from pysph_boiling.phases import Phase

__all__ = ["accounted", "all_of", "count", "settled", "temperatures"]


def all_of(*ends):
    """A check that makes all of the given checks."""
    def end(run):
        for check in ends:
            yield from check(run)

    return end


def settled(level=0.1, motion=0.02, always=False):
    """Water must be at rest.

    Relative to the depth, its centre of mass must be within ``level`` of that of water at rest density, and its kinetic
    energy at most ``motion`` times m g H. The quick form of a case is too short for this check, unless ``always``.
    """
    def end(run):
        if not (run.whole or always):
            return
        m, axis = run.get("m"), int(np.argmax(np.abs(run.up)))
        lower, upper = (np.array(corner) for corner in (run.container.lower, run.container.upper))
        area = np.prod(np.delete((upper - lower)[:run.scene.dim], axis))
        depth = np.sum(m) / run.scene.rho0 / area
        floor = min(run.up @ lower, run.up @ upper)
        centre = np.sum(m * run.height({name: run.get(name) for name in "xyz"})) / np.sum(m) - floor
        if not abs(centre - 0.5 * depth) <= level * depth:
            yield f"the centre of mass is at {centre / depth:.3f} of the depth at rest density, not at 0.5"
        kinetic = 0.5 * np.sum(m * run.speeds() ** 2) / run.scale
        if not kinetic <= motion:
            yield f"the kinetic energy is {kinetic:.2g} m g H, more than {motion} m g H"

    return end


def temperatures(low, high, slack=1e-6):
    """Temperatures at the end, and the highest one at any step, must be between ``low`` and ``high`` [K]."""
    def end(run):
        coldest, hottest = run.get("T").min(), max(run.table["T_max"])
        if not (coldest >= low - slack and hottest <= high + slack):
            yield f"temperatures of {coldest:.6g} to {hottest:.6g} K are outside {low:.6g} to {high:.6g} K"

    return end


def count(name, low, high=np.inf):
    """The last value of a column must be within bounds."""
    def end(run):
        if not low <= run.last(name) <= high:
            yield f"{name} = {run.last(name):g}, expected {low:g} to {high:g}"

    return end


def accounted(run):
    """The change of the number of vapour particles must equal the sum of all events."""
    made = sum(sign * run.events.get(name, 0) for name, sign in (
        ("n_nucleated", 1), ("n_burst", 1), ("n_condensed", -1), ("n_vented", -1)))
    there, began = np.count_nonzero(run.get("phase") == Phase.VAPOUR), np.count_nonzero(
        run.start["phase"] == Phase.VAPOUR)
    if there - began != made:
        yield f"vapour changed by {there - began} particles, but the events add up to {made}"

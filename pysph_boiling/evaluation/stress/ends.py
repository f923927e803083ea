"""What is not sensible about an end state: each function yields sentences, none if all is well."""
import numpy as np

from pysph_boiling.phases import Phase

__all__ = ["accounted", "all_of", "count", "settled", "temperatures"]


def all_of(*ends):
    """All of these must hold."""
    def end(run):
        for check in ends:
            yield from check(run)

    return end


def settled(level=0.1, motion=0.02, always=False):
    """Water at rest: centre of mass within ``level`` of where it lies in water at rest density, relative to the depth;
    kinetic energy at most ``motion`` of m g H. The short form of a case has no time for it, unless ``always``."""
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
            yield f"centre of mass at {centre / depth:.3f} of the depth that the water has at rest density, not at 0.5"
        kinetic = 0.5 * np.sum(m * run.speeds() ** 2) / run.scale
        if not kinetic <= motion:
            yield f"kinetic energy is {kinetic:.2g} m g H, more than {motion}"

    return end


def temperatures(low, high, slack=1e-6):
    """Temperatures at the end, and the highest at any step, within what there was at the start and what heats [K]."""
    def end(run):
        coldest, hottest = run.get("T").min(), max(run.table["T_max"])
        if not (coldest >= low - slack and hottest <= high + slack):
            yield f"temperatures {coldest:.6g} to {hottest:.6g} K, outside {low:.6g} to {high:.6g} K"

    return end


def count(name, low, high=np.inf):
    """The last value of a column lies within bounds."""
    def end(run):
        if not low <= run.last(name) <= high:
            yield f"{name} = {run.last(name):g}, expected {low:g} to {high:g}"

    return end


def accounted(run):
    """Every particle of vapour is accounted for."""
    made = sum(sign * run.events.get(name, 0) for name, sign in (
        ("n_nucleated", 1), ("n_burst", 1), ("n_condensed", -1), ("n_vented", -1)))
    there, began = np.count_nonzero(run.get("phase") == Phase.VAPOUR), np.count_nonzero(
        run.start["phase"] == Phase.VAPOUR)
    if there - began != made:
        yield f"vapour changed by {there - began} particles, events add up to {made}"

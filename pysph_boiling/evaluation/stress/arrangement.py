"""Unusual positions at the start: all particles on one point, in a line, outside, alone, or all vapour."""
from functools import partial

import numpy as np

from pysph_boiling.evaluation.stress.case import Case
from pysph_boiling.evaluation.stress.ends import accounted, all_of, settled, temperatures
from pysph_boiling.evaluation.stress.scenes import BOIL, MOTION, T_SAT, block, vessel
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.effects import Heater

__all__ = ["cases"]


def size(dim):
    return (12, 14) if dim == 2 else (8, 8, 12)


def placed(dim, points, **options):
    """Fluid at given points in a vessel, with motion alone."""
    return vessel(dim, size(dim), points, MOTION, closed=True, **options)


def same_place(dim):
    return placed(dim, np.tile(np.append(np.array(size(dim)) / 2.0, [0.0] * (3 - dim)), (40, 1)))


def line(dim):
    """A pillar of 20 particles half a spacing apart."""
    points = np.tile(np.append(np.array(size(dim)) / 2.0, [0.0] * (3 - dim)), (20, 1))
    points[:, dim - 1] = 0.5 + 0.5 * np.arange(20)
    return placed(dim, points)


def plane(dim):
    """A horizontal sheet of particles 0.6 spacings apart, in the air."""
    lower, upper = [0.3] * dim, [s - 0.3 for s in size(dim)]
    lower[-1], upper[-1] = 6.0, 6.6
    points = block(dim, lower, upper, spacing=0.6, jitter=0.0)
    return placed(dim, points)


def on_wall(dim):
    """Water whose first layers lie on the faces of floor and wall, and inside the wall."""
    points = block(dim, (0.0,) * dim, (6,) * dim, jitter=0.0)
    points[:, :dim] -= 0.5
    points[points[:, dim - 1] > 4.0, dim - 1] = -0.5
    return placed(dim, points)


def outside(dim):
    """One in ten particles starts 3 spacings beyond a wall."""
    points = block(dim, (0.0,) * dim, (*size(dim)[:-1], 6.0))
    points[::10, 0] = -3.0
    return placed(dim, points)


def displaced(dim):
    """A lattice whose particles are randomly displaced by half a spacing, so that some overlap."""
    return placed(dim, block(dim, (0.5,) * dim, (*(s - 0.5 for s in size(dim)[:-1]), 6.5), jitter=0.5))


def squeezed(dim):
    """A lattice of half the spacing, with a random displacement of a tenth of it: 4 or 8 times the rest density."""
    return placed(dim, block(dim, (2.0,) * dim, (5.0,) * dim, spacing=0.5, jitter=0.05))


def few(dim, n, **options):
    """One particle, or two particles half a spacing apart, with all effects of boiling."""
    points = np.tile(np.append(np.array(size(dim)) / 2.0, [0.0] * (3 - dim)), (n, 1))
    points[:, 0] += 0.5 * np.arange(n)
    return vessel(dim, size(dim), points, BOIL, **options)


def pool(dim, effects=BOIL, **options):
    return vessel(dim, size(dim), block(dim, (0.0,) * dim, (*size(dim)[:-1], 8.0)), effects, **options)


def cold(dim):
    """Water and heater at the same temperature: nothing happens, so energy must not rise."""
    T = T_SAT - 70.0
    return pool(dim, {**BOIL, "heater": Heater(temperature=T)}, temperature=T, closed=True)


def on_floor(run):
    """A few particles end on the floor, no faster than the attraction of a site allows (g/2 within 2.4 spacings)."""
    heights = run.height({axis: run.get(axis) for axis in "xyz"}) - run.floor
    if heights.max() > 2.0 * run.scene.spacing or run.speeds().max() > np.sqrt(run.g * 2.4 * run.scene.spacing):
        yield (f"highest particle {heights.max() / run.scene.spacing:.2f} spacings above the floor, fastest "
               f"{run.speeds().max():.2g} m/s")


def no_vapour(run):
    if np.any(run.get("phase") == Phase.VAPOUR) or any(run.events.values()):
        yield f"something boiled in cold water: {run.events}"


def cases():
    """Yields the cases of this module."""
    for dim in (2, 3):
        flat = dim == 2

        def case(name, hard, build, end, steps=1200, quick=150, dim=dim, flat=flat):
            return Case(name=f"{name}-{dim}d", hard=hard, steps=steps, quick=quick if flat else 0,
                        build=partial(build, dim), end=end)

        yield case("same-place", "40 particles on one point", same_place, settled(level=3.0))
        yield case("line", "a pillar of particles half a spacing apart", line, settled(level=3.0))
        yield case("plane", "a horizontal sheet of particles .6 spacings apart", plane, settled(level=0.5))
        yield case("on-wall", "particles on the faces and inside the floor", on_wall, settled(level=0.3))
        yield case("outside", "a tenth of the particles starts 3 spacings outside", outside, settled(level=0.15))
        yield case("displaced", "random displacement by half a spacing", displaced, settled(level=0.15))
        yield case("squeezed", "half the spacing, displaced by a tenth: 4 (2-D), 8 (3-D) times the density", squeezed,
                   settled(level=0.5))
        yield case("one-particle", "one particle, all effects of boiling", partial(few, n=1, temperature=T_SAT - 30.0),
                   all_of(on_floor, temperatures(T_SAT - 30.0, T_SAT + 60.0)), steps=600)
        yield case("two-particles", "two particles half a spacing apart", partial(few, n=2, temperature=T_SAT - 30.0),
                   all_of(on_floor, temperatures(T_SAT - 30.0, T_SAT + 60.0)), steps=600)
        yield case("no-vapour", "water of 30 °C with all effects of boiling", cold, all_of(
            no_vapour, settled(level=0.1), temperatures(T_SAT - 70.0, T_SAT - 70.0)), steps=400)
        yield case("all-vapour", "no liquid at all", partial(pool, vapour=True), accounted, steps=400)

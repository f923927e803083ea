"""Unequal particles, unusual gravity, periodic borders, and threads."""
from functools import partial

import numpy as np
from pysph.base.nnps import DomainManager

from pysph_boiling.evaluation.stress.case import Case, simulate
from pysph_boiling.evaluation.stress.ends import accounted, all_of, count, settled
from pysph_boiling.evaluation.stress.scenes import BOIL, DX, MOTION, T_SAT, ball, block, vessel
from pysph_boiling.schemes.effects import BoxContainer

__all__ = ["cases"]


def size(dim):
    return (12, 14) if dim == 2 else (8, 8, 12)


def pool(dim, effects=MOTION, height=8.0, **options):
    options.setdefault("closed", effects is MOTION)
    return vessel(dim, size(dim), block(dim, (0.0,) * dim, (*size(dim)[:-1], height)), effects, **options)


def draw(points, low, high):
    """A random number for each point, log-uniform from ``low`` to ``high``."""
    return np.exp(np.random.default_rng(3).uniform(np.log(low), np.log(high), len(points)))


def mixed(dim, what, low, high):
    """Particles with different masses or smoothing lengths (``what``), relative to the usual ones."""
    return pool(dim, **{what: partial(draw, low=low, high=high)})


def tilted(dim, gravity):
    """A cube of water without gravity, or falling sideways or upwards in its vessel."""
    lower = tuple(0.5 * (component - 6.0) for component in size(dim))
    upper = tuple(low + 6.0 for low in lower)
    points = block(dim, lower, upper, jitter=0.01 if any(gravity) else 0.0)
    return vessel(dim, size(dim), points, MOTION, gravity=gravity, closed=True)


def moving(dim):
    """A block that moves towards a wall without gravity."""
    lower = tuple(0.5 * (component - 6.0) for component in size(dim))
    return vessel(dim, size(dim), block(dim, lower, tuple(low + 6.0 for low in lower)), MOTION, gravity=(0.0, 0.0, 0.0),
                  velocity=(0.5, 0.0, 0.0), closed=True)


def periodic(dim):
    """Boiling in a domain that is periodic along x, with a bubble across the border."""
    width = 12
    upper = (width, 8) if dim == 2 else (width, 8, 8)
    near = (0.0, 4.0) if dim == 2 else (0.0, 4.0, 4.0)

    def vapour(points):
        images = points.copy()
        images[:, 0] -= width * np.round(points[:, 0] / width)
        return ball(near, 2.0)(images)

    far = (width * DX, *(12 * DX,) * (dim - 1), *(0.0,) * (3 - dim))
    container = BoxContainer(lower=(-far[0], 0.0, 0.0), upper=(2.0 * far[0], *far[1:]))  # along x the domain wraps
    return vessel(dim, (width, *upper[1:-1], 12), block(dim, (0.0,) * dim, upper), {**BOIL, "container": container},
                  vapour=vapour, domain=DomainManager(xmin=0.0, xmax=far[0], periodic_in_x=True))


def boil(dim, **options):
    """Boiling with a bubble in superheated water, so that many events happen at once."""
    return pool(dim, BOIL, vapour=ball((*(component / 2.0 for component in size(dim)[:-1]), 4.0), 1.8),
                temperature=T_SAT + 60.0, **options)


def same_events(dim):
    """The end state must agree to the last bit with that of a run on one thread."""
    def end(run):
        other = simulate(Case(name="", hard="", steps=0, build=partial(boil, dim, threads=1)), run.steps)
        if run.events != other.events:
            yield f"the events on 2 threads are {run.events}, those on 1 thread {other.events}"
        elif any(not np.array_equal(run.get(name), other.get(name)) for name in ("x", "y", "z", "u", "v", "w", "e")):
            yield "the events agree, but positions, velocities or enthalpies do not agree to the last bit"
        if not run.events["n_nucleated"]:
            yield "there were no events to compare"

    return end


def still(run):
    """A lattice at rest density stays where it is, and initial motion only slows down."""
    speed = run.speeds().max()
    if speed > 1.5 * max(run.fastest, 1e-6):
        yield f"the fastest particle has {speed:.3g} m/s, but {run.fastest:.3g} m/s at the start"


def cases():
    """Yields the cases of this module."""
    for dim in (2, 3):
        def case(name, hard, build, end, steps=800, quick=150, dim=dim):
            return Case(name=f"{name}-{dim}d", hard=hard, steps=steps, quick=quick if dim == 2 else 0, build=build,
                        end=end)

        yield case("masses", "masses from 1/2 to 2, at random", partial(mixed, dim, "mass", 0.5, 2.0),
                   settled(level=0.3))
        yield case("masses-light", "masses from 1/10 to 1, at random", partial(mixed, dim, "mass", 0.1, 1.0),
                   settled(level=0.3))
        yield Case(name=f"masses-heavy-{dim}d", hard="masses up to 10: a single particle is denser than at rest",
                   steps=200, quick=50 if dim == 2 else 0, build=partial(mixed, dim, "mass", 0.1, 10.0),
                   refused="mass")
        yield case("masses-boil", "masses from 1/2 to 2 in boiling water",
                   partial(boil, dim, mass=partial(draw, low=0.5, high=2.0)),
                   all_of(accounted, count("n_nucleated", 1)))
        yield case("smoothing", "smoothing lengths from .8 to 1.25, at random",
                   partial(mixed, dim, "smoothing", 0.8, 1.25), settled(level=0.3))
        yield case("gravity-0", "no gravity, a block at rest", partial(tilted, dim, (0.0, 0.0, 0.0)), still)
        yield case("gravity-0-moving", "no gravity, a block flies into a wall", partial(moving, dim), still)
        up = tuple(9.81 * (axis == dim - 1) for axis in range(3))
        yield case("gravity-up", "gravity upwards: water falls on the lid, which has no wall particles",
                   partial(tilted, dim, up), settled(level=0.3), steps=1500)
        yield case("gravity-sideways", "gravity along x", partial(tilted, dim, (9.81, 0.0, 0.0)), settled(level=0.3),
                   steps=1500)
        yield case("periodic", "boiling in a periodic domain, with a bubble across the border", partial(periodic, dim),
                   accounted)
        yield case("threads", "1 and 2 threads give the same events", partial(boil, dim, threads=2),
                   all_of(accounted, same_events(dim)), quick=200)

"""Extreme time steps, numbers of sweeps, depths, speeds and durations."""
from functools import partial

import numpy as np

from pysph_boiling.evaluation.stress.case import Case
from pysph_boiling.evaluation.stress.ends import accounted, all_of, count, settled, temperatures
from pysph_boiling.evaluation.stress.scenes import BOIL, EVERYTHING, MOTION, T_SAT, ball, block, vessel
from pysph_boiling.schemes.effects import DensityConstraint

__all__ = ["cases"]


SHORTEST = 0.017 / 0.07  # relative to the default time step; shorter steps turn no density error into velocity


def box(dim, width, height, depth=6):
    """Size of a vessel in spacings; ``depth`` is used in 3-D only."""
    return (width, height) if dim == 2 else (width, depth, height)


def dam(dim, **changes):
    """A block of water that fills half of a vessel collapses."""
    upper = box(dim, 8, 12)
    return vessel(dim, box(dim, 20, 20), block(dim, (0.0,) * dim, upper), MOTION, closed=True, **changes)


def column(dim, layers, width=6, **changes):
    """Water at rest."""
    upper = box(dim, width, layers, width)
    return vessel(dim, box(dim, width, layers * 1.25, width), block(dim, (0.0,) * dim, upper), MOTION, closed=True,
                  **changes)


def boil(dim, factor):
    """A bubble in water 40 K above saturation, on a heater."""
    middle = (6.0, 4.0) if dim == 2 else (6.0, 3.0, 4.0)
    return vessel(dim, box(dim, 12, 16), block(dim, (0.0,) * dim, box(dim, 12, 10)), BOIL, vapour=ball(middle, 1.8),
                  temperature=T_SAT + 40.0, factor=factor)


def violent(dim, factor):
    """Water 100 K above saturation around a bubble, which bursts, swells and oscillates."""
    middle = (6.0, 4.0) if dim == 2 else (6.0, 3.0, 4.0)
    return vessel(dim, box(dim, 12, 20), block(dim, (0.0,) * dim, box(dim, 12, 10)), EVERYTHING,
                  vapour=ball(middle, 2.0), temperature=T_SAT + 100.0, factor=factor)


def of_any_length(build, dim):
    """Every other step has the usual length; the others have random lengths between .2 t* and a millionth of it."""
    setup, random = build(dim, factor=0.2 / 0.07), np.random.default_rng(0)

    def before(run):
        run.stepper.dt = run.dt * (0.35 if run.steps % 2 else 10.0 ** random.uniform(-6.0, 0.0))

    setup.before = before
    return setup


def falls(run):
    """Water that falls from rest must have about the speed of free fall."""
    share = run.table["speed"][-1] / (run.g * run.dt * run.steps)
    if not 0.2 <= share <= 2.0:
        yield f"the fastest particle has {share:.2g} times the speed of free fall"


def quiet(dim):
    """Cold water at rest with all effects of boiling, none of which should act."""
    upper = box(dim, 20, 16)
    return vessel(dim, box(dim, 20, 20), block(dim, (0.0,) * dim, upper), {**BOIL, "heater": None}, closed=True,
                  temperature=T_SAT - 20.0, every=20)


def jet(dim):
    """A jet of 2 m/s hits the far wall."""
    low, high = (2.0, 6.0), (14.0, 12.0)
    if dim == 3:
        low, high = (2.0, 3.0, 6.0), (14.0, 9.0, 12.0)
    return vessel(dim, box(dim, 20, 24, 12), block(dim, low, high), MOTION, velocity=(2.0, 0.0, 0.0), closed=True)


def collision(dim):
    """Two blocks meet at 2 m/s each."""
    depth = (0.0,) if dim == 3 else ()
    points = np.concatenate([block(dim, (x, *depth, 0.0), (x + 8.0, *(6.0 for _ in depth), 8.0)) for x in (3.0, 15.0)])
    return vessel(dim, box(dim, 26, 30), points, MOTION, closed=True,
                  velocity=lambda points: np.where(points[:, :1] < 13.0, 2.0, -2.0) * np.array([1.0, 0.0, 0.0]))


def cases():
    """Yields the cases of this module."""
    for dim in (2, 3):
        for factor in (1, 2, 5, 10, 20):
            yield Case(
                name=f"dam-dt{factor}-{dim}d", hard=f"{factor} times the default time step", steps=2400 // factor,
                quick=400 // factor if dim == 2 else 0, build=partial(dam, dim, factor=factor),
                end=settled(level=0.15))
        for parts in (10, 25, 250):
            shortest = f"1/{parts} of the shortest ordinary time step"
            yield Case(name=f"dam-short{parts}-{dim}d", hard=shortest, steps=2000, quick=200 if dim == 2 else 0,
                       build=partial(dam, dim, factor=SHORTEST / parts), end=falls)
            yield Case(name=f"boil-short{parts}-{dim}d", hard=f"a boil, {shortest}", steps=2000,
                       quick=100 if dim == 2 else 0, build=partial(boil, dim, SHORTEST / parts),
                       end=all_of(accounted, temperatures(T_SAT, T_SAT + 60.0)))
            yield Case(name=f"violent-short{parts}-{dim}d", hard=f"bursts, swells and oscillates, {shortest}",
                       steps=2000, build=partial(violent, dim, SHORTEST / parts), end=accounted)
        for name, build, end in (("dam", dam, settled(level=0.15)), ("boil", boil, accounted),
                                 ("violent", violent, all_of(accounted, count("n_burst", 5)))):
            yield Case(name=f"{name}-any-step-{dim}d", steps=4000 if build is dam else 1200,
                       hard="every other step has a random length, from .2 t* to a millionth of it",
                       quick=200 if dim == 2 and build is not violent else 0,
                       build=partial(of_any_length, build, dim), end=end)
        for factor in (2, 5, 10, 20):
            yield Case(name=f"boil-dt{factor}-{dim}d", hard=f"a boil, {factor} times the default time step",
                       steps=1200 // factor, quick=200 // factor if dim == 2 else 0, build=partial(boil, dim, factor),
                       end=all_of(accounted, temperatures(T_SAT, T_SAT + 60.0)))
        yield Case(
            name=f"dam-one-sweep-{dim}d", hard="one density sweep per step", steps=2400, quick=400 if dim == 2 else 0,
            build=partial(dam, dim, density=DensityConstraint(min_sweeps=1, max_sweeps=1)), end=settled(level=0.15))
        yield Case(name=f"column-80-{dim}d", hard="80 layers deep", steps=1500 if dim == 2 else 500,
                   quick=200 if dim == 2 else 0, build=partial(column, dim, 80), end=settled(always=True))
        yield Case(name=f"jet-{dim}d", hard="a jet of 2 m/s hits a wall", steps=1200, quick=300 if dim == 2 else 0,
                   build=partial(jet, dim), end=settled(level=0.3, motion=0.1))
        yield Case(name=f"collision-{dim}d", hard="two blocks meet at 2 m/s each", steps=2000,
                   quick=300 if dim == 2 else 0, build=partial(collision, dim), end=settled(level=0.3, motion=0.1))
    yield Case(name="quiet-100000-2d", hard="100,000 steps of a quiet tank: drift, spurious heating", steps=100_000,
               quick=2000, build=partial(quiet, 2),
               end=all_of(settled(motion=1e-3, always=True), temperatures(T_SAT - 20.0, T_SAT - 20.0)))

"""Extreme bubbles: of one particle, a thousand bubbles, a chain of ten thousand particles; merging and oscillating."""
from functools import partial

import numpy as np

from pysph_boiling.evaluation.stress.case import Case
from pysph_boiling.evaluation.stress.ends import accounted, all_of, count, temperatures
from pysph_boiling.evaluation.stress.scenes import BOIL, EVERYTHING, NO_HEAT, T_SAT, ball, block, vessel
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.effects import Expansion, Heater, Oscillation

__all__ = ["cases"]

COLD = {**BOIL, "heater": None}  # without a heater, only the given bubbles exist
RING = {**EVERYTHING, **NO_HEAT, "heater": Heater(temperature=T_SAT)}


def pool(dim, effects=COLD, *, width=12, height=12, temperature=T_SAT, **options):
    """A pool with space above it; lengths in spacings."""
    upper = (width, height) if dim == 2 else (width, width, height)
    return vessel(dim, (*upper[:-1], 1.5 * height), block(dim, (0.0,) * dim, upper), effects, temperature=temperature,
                  **options)


def middle(dim, width=12, height=12):
    return (width / 2.0, height / 2.0) if dim == 2 else (width / 2.0, width / 2.0, height / 2.0)


def of(dim, n):
    """One bubble of the ``n`` particles nearest to the middle."""
    def vapour(points):
        distance = np.sum((points[:, :dim] - middle(dim)) ** 2, axis=1)
        return np.argsort(np.argsort(distance)) < n

    return pool(dim, vapour=vapour)


def shaken(dim):
    """A bubble whose halves are moved apart and together again, 0.45 spacings per step."""
    centre, radius = middle(dim), 2.5

    def before(run):
        vapour = run.get("phase") == Phase.VAPOUR
        side = np.where(run.start["x"] < centre[0] * run.scene.spacing, -1.0, 1.0)
        sense = 1.0 if run.steps % 2 == 0 else -1.0
        run.get("u")[vapour] = (sense * side * 0.45 * run.scene.spacing / run.dt)[vapour]

    return pool(dim, vapour=ball(centre, radius), before=before)


def thousand(dim):
    """More than a thousand bubbles of one particle, as close as possible without touching."""
    width, apart = (96, 3) if dim == 2 else (22, 2)
    return pool(dim, width=width, height=width,
                vapour=lambda points: np.all(np.floor(points[:, :dim]).astype(int) % apart == 0, axis=1))


def chain(dim):
    """One bubble in the form of a serpentine: 10,000 particles in 20 rows, with shuffled identities.

    It is labelled by the general equations, whose rounds are counted.
    """
    length, rows = 500, 20
    points = block(2, (0.0, 0.0), (length, 2 * rows), jitter=0.0)

    def vapour(points):
        column, row = np.floor(points[:, 0]).astype(int), np.floor(points[:, 1]).astype(int)
        end = np.where((row // 2) % 2 == 0, length - 1, 0)
        return (row % 2 == 0) | ((column == end) & (row < 2 * rows - 2))

    return vessel(2, (length, 2 * rows + 10), points, COLD, vapour=vapour, temperature=T_SAT, lean=False,
                  uid=np.random.default_rng(1).permutation(len(points)).astype(np.uint32))


def oscillating(dim, **options):
    """A bubble with a radius of 2.6 spacings and an oscillation constraint."""
    return pool(dim, {**RING, "oscillation": Oscillation(**options)}, vapour=ball(middle(dim), 2.6))


def collapse(pressure, start, slowdown):
    """A bubble of ``start`` times its rest volume collapses under ``pressure`` [Pa] (Rayleigh-Plesset)."""
    effects = {**RING, "expansion": Expansion(v_exp=1.5), "oscillation": Oscillation(
        form="rayleigh_plesset", pressure=pressure, slowdown=slowdown, lower=0.05, upper=1.5)}
    setup = pool(3, effects, vapour=ball(middle(3), 2.6))
    fluid = setup.arrays[0]
    fluid.swell[fluid.phase == Phase.VAPOUR] = start
    return setup


def swollen(dim, v_exp):
    """A bubble with a radius of 2.6 spacings whose vapour expands."""
    return pool(dim, {**RING, "expansion": Expansion(v_exp=v_exp)}, vapour=ball(middle(dim), 2.6))


def labels_change(run):
    """Bubbles must have merged or split in most steps."""
    changes = np.count_nonzero(np.diff(run.table["n_bubbles"]))
    if changes < 0.5 * run.steps:
        yield f"the number of bubbles only changed in {changes} of {run.steps} steps"


def one_chain(run):
    rounds, n = run.fluid.bubble_rounds[0] / run.steps, 10_000
    if run.table["n_bubbles"][0] != 1 or not rounds <= 3.0 * (2.0 * np.log2(n) + 4.0):
        yield f"there are {run.table['n_bubbles'][0]:g} bubbles after the first step, with {rounds:.0f} rounds per step"


def cases():
    """Yields the cases of this module."""
    saturated = temperatures(T_SAT, T_SAT)
    for dim in (2, 3):
        def case(name, hard, build, end, steps=600, quick=60, dim=dim):
            return Case(name=f"{name}-{dim}d", hard=hard, steps=steps, quick=quick if dim == 2 else 0, build=build,
                        end=all_of(accounted, end))

        yield case("bubble-1", "a bubble of one particle", partial(of, dim, 1), saturated)
        yield case("bubble-2", "a bubble of two particles", partial(of, dim, 2), saturated)
        yield case("shaken", "bubbles merge and split every step", partial(shaken, dim), labels_change, steps=60)
        yield case("thousand", "a thousand bubbles", partial(thousand, dim), saturated, steps=100 if dim == 2 else 60,
                   quick=0)
        for form in ("band", "relative"):
            yield case(f"omega-1-{form}", f"oscillation '{form}' with omega = 1 and three solutions per step",
                       partial(oscillating, dim, form=form, omega=1.0, sweeps=3), saturated)
        for low, high in ((0.3, 0.5), (1.6, 2.0)):
            yield case(f"band-{low}-{high}", f"radius held at {low} to {high} of that at rest, against the density",
                       partial(oscillating, dim, form="relative", lower=low, upper=high, omega=1.0), saturated)
        yield case("swollen", "vapour expands to just below the limit",
                   partial(swollen, dim, {2: 3.16, 3: 4.0}[dim]), saturated)
    yield Case(name="swollen-too-far-2d", hard="vapour expands so far that a single particle is denser than at rest",
               steps=1, quick=1, build=partial(swollen, 2, 3.2), refused="expansion.v_exp must be below 3.166")
    yield Case(name="chain-10000-2d", hard="one bubble, a chain of 10,000 particles", steps=20, quick=5,
               build=partial(chain, 2), end=all_of(accounted, one_chain))
    for pressure, scale in ((1e5, 1.0), (1e5, 25.0), (1e7, 1.0), (1e7, 250.0)):
        yield Case(name=f"collapse-{pressure:.0e}-slowed-{scale:g}-3d", hard="Rayleigh-Plesset collapse under "
                   f"{pressure:.0e} Pa, slowed down {scale:g} times", steps=300, quick=0,
                   build=partial(collapse, pressure, 2.2, scale), end=all_of(accounted, count("rest_volume", 0.0)))

"""The literal formulas of the paper, for bubbles of sizes that it does not show."""
from functools import partial

from pysph_boiling.evaluation.stress.case import Case
from pysph_boiling.evaluation.stress.ends import accounted, all_of, count
from pysph_boiling.evaluation.stress.scenes import BOIL, T_SAT, ball, block, vessel
from pysph_boiling.schemes.effects import (
    AmbientLoss,
    Buoyancy,
    Condensation,
    DynamicNucleation,
    HeatConduction,
    Heater,
    Oscillation,
    PhaseChange,
    Venting,
)

__all__ = ["cases"]

PAPER = {
    **BOIL, "heat": HeatConduction(laplacian="paper", time_scaling=800.0), "condensation": Condensation(form="paper"),
    "buoyancy": Buoyancy(form="paper", k_bubble=1.5), "oscillation": Oscillation(form="band", gradient="paper"),
    "phases": PhaseChange(interrupt="convert"), "loss": AmbientLoss(),
    "dynamic_nucleation": DynamicNucleation(superheat_limit=60.0),
    "heater": Heater(temperature=T_SAT + 60.0), "venting": Venting(mode="lid")}


def large(dim, radius, **changes):
    """A pool with one large bubble."""
    width, height = (30, 30) if dim == 2 else (16, 18)
    upper = (width, height) if dim == 2 else (width, width, height)
    middle = (*(component / 2.0 for component in upper[:-1]), 0.4 * height)
    return vessel(dim, (*upper[:-1], 1.5 * height), block(dim, (0.0,) * dim, upper), {**PAPER, **changes},
                  vapour=ball(middle, radius), temperature=T_SAT - 5.0)


def cases():
    """Yields the cases of this module."""
    for dim in (2, 3):
        radius = 8.0 if dim == 2 else 5.0
        for a_max in (3.0, 100.0):
            yield Case(name=f"paper-{a_max:g}g-{dim}d", hard="literal eqs. 17 to 22 and 28, one bubble of "
                       f"{'200' if dim == 2 else '500'} particles, buoyancy limited to {a_max:g} g", steps=600,
                       quick=100 if dim == 2 else 0,
                       build=partial(large, dim, radius, buoyancy=Buoyancy(form="paper", k_bubble=1.5, a_max=a_max)),
                       end=all_of(accounted, count("n_vented", 0)))

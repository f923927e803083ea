"""Where lean equations take the place of general ones: decided here and nowhere else, when a scheme is built."""
import numpy as np
from compyle.array import get_backend

from pysph_boiling.equations.artificial_pressure import PBFArtificialPressure
from pysph_boiling.equations.bubble_groups import BubbleCheck, BubbleHook, BubbleLabel, BubbleShortcut, BubbleSnap
from pysph_boiling.equations.buoyancy import BubbleDrag
from pysph_boiling.equations.cohesion import BubbleCohesion, BubbleCohesionMove
from pysph_boiling.equations.container import PBFBoxContainer, PBFCylinderContainer, PBFDistanceContainer
from pysph_boiling.equations.density_constraint import (
    PBFBoundaryCorrection,
    PBFBoundaryDensity,
    PBFDensity,
    PBFDensitySwollen,
    PBFLambda,
    PBFMove,
    PBFMoveAccelerated,
    PBFPositionCorrection,
    PBFPositionCorrectionSwollen,
)
from pysph_boiling.equations.heat import HeatConductionClearyMonaghan
from pysph_boiling.equations.helpers import kernel_coefficients
from pysph_boiling.equations.lean import (
    LEAN,
    BubbleLabelsLean,
    HeatConductionClearyMonaghanLean,
    PBFDensityLean,
    PBFForcesLean,
    PBFSweepsLean,
)
from pysph_boiling.equations.viscosity import PBFBodyForce, PBFXSPHViscosity
from pysph_boiling.equations.wall_multipliers import PBFWallCorrection, PBFWallMultiplier
from pysph_boiling.equations.warm_start import PBFBoundaryWarmStart, PBFWarmStart, PBFWarmStartSwollen
from pysph_boiling.native import serves
from pysph_boiling.parallel import ranks
from pysph_boiling.schemes.host_sums import Forces, Heat, Labels, Sweeps

__all__ = ["lean_terms", "why_general"]

SWEEP_PLACES = ("density.multiplier", "density.walls", "density.correction", "density.pull", "density.move")
IN_SWEEPS = {BubbleCohesion, BubbleCohesionMove, PBFBoundaryCorrection, PBFBoundaryDensity, PBFBoxContainer,
             PBFCylinderContainer, PBFDensity, PBFDensitySwollen, PBFDistanceContainer, PBFLambda, PBFMove,
             PBFMoveAccelerated, PBFPositionCorrection, PBFPositionCorrectionSwollen, PBFWallCorrection,
             PBFWallMultiplier}
IN_LABELS = (BubbleSnap, BubbleHook, BubbleShortcut, BubbleCheck, BubbleLabel)
IN_FORCES = (PBFBodyForce, PBFXSPHViscosity, BubbleDrag, PBFArtificialPressure, PBFWarmStart, PBFWarmStartSwollen,
             PBFBoundaryWarmStart)


def why_general(scheme, arrays):
    """Why no sum of a scheme may be lean, as text; ``None`` where they may.

    ``arrays`` (name -> particle array) are those that it is built on. Walls may differ in mass, not in smoothing
    length. On several ranks all must ask at once.
    """
    if not scheme.lean:
        return "as asked"
    if get_backend() != "cython":
        return "on a device"
    if not serves():
        return "they need GCC or Clang, and a processor with AVX2"
    if len(scheme.fluids) > 1:
        return "there are several fluids"
    if "mechanics" in scheme.effects:
        return "the mechanical ledger looks at what each equation does"
    try:
        kernel_coefficients(scheme.kernel)
    except ValueError:
        return f"the kernel is {type(scheme.kernel).__name__}"
    if not arrays:
        return "particles are not known yet"
    everywhere = [*scheme.fluids, *scheme.solids]
    for what, prop, names in (("masses", "m", scheme.fluids), ("smoothing lengths", "h", everywhere)):
        held = np.concatenate([arrays[name].get(prop, only_real_particles=True) for name in names])
        ends = ranks.largest(np.array([held.max(initial=-np.inf), -held.min(initial=np.inf)]))
        if ends[0] != -ends[1]:
            return f"{what} differ"
    return None


def lean_terms(terms, scheme):
    """The terms, lean ones in the place of those that they can stand for.

    The density sweeps are one equation where nothing else stands in the block that iterates.
    """
    new = {}  # term -> what takes its place; None: nothing more, since the first of its block stands for all

    def one_for(block, cls, run):
        sources = sorted({name for term in block for name in term.equation.sources or ()})
        new.update(dict.fromkeys(block))
        new[block[0]] = block[0]._replace(equation=cls(block[0].equation.dest, sources, run))

    for term in terms:
        equation = term.equation
        if type(equation) in LEAN:
            new[term] = term._replace(equation=LEAN[type(equation)](equation, scheme.kernel))
        elif type(equation) is HeatConductionClearyMonaghan:
            one_for([term], HeatConductionClearyMonaghanLean, Heat(scheme, equation))
    sweeps = [term for term in terms if term.place in SWEEP_PLACES]
    if sweeps and {type(term.equation) for term in sweeps} <= IN_SWEEPS:  # no terms of other effects
        run = Sweeps(scheme, [term.equation for term in sweeps])
        one_for([term for term in terms if term.place == "density.before"], PBFDensityLean, run.density)
        one_for(sweeps, PBFSweepsLean, run)
    labels = [term for term in terms if type(term.equation) in IN_LABELS]
    if labels and ranks.size() == 1:  # a bubble may lie on several ranks
        one_for([labels[-1], *labels[:-1]], BubbleLabelsLean, Labels(scheme, next(
            term.equation for term in labels if type(term.equation) is BubbleHook)))
    forces = {type(term.equation): term for term in terms if type(term.equation) in IN_FORCES}
    if not {PBFWarmStart, PBFWarmStartSwollen} & set(forces):  # that of walls is summed with it
        forces.pop(PBFBoundaryWarmStart, None)
    if PBFBodyForce in forces:
        parts = [forces[cls].equation if cls in forces else None for cls in IN_FORCES]
        one_for(sorted(forces.values(), key=terms.index), PBFForcesLean, Forces(scheme, *parts))
    return [term for term in (new.get(term, term) for term in terms) if term]

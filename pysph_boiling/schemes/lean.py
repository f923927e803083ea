"""Where lean sums take the place of general equations: decided here and nowhere else, when a scheme is built."""
import numpy as np
from compyle.array import get_backend

from pysph_boiling.equations.helpers import kernel_coefficients
from pysph_boiling.equations.lean import LEAN
from pysph_boiling.parallel import ranks

__all__ = ["lean_terms", "why_general"]


def why_general(scheme, arrays):
    """Why no sum of a scheme may be lean, as text; ``None`` where they may.

    ``arrays`` (name -> particle array) are those that it is built on. Walls may differ in mass, not in smoothing
    length. On several ranks all must ask at once.
    """
    if not scheme.lean:
        return "as asked"
    if get_backend() != "cython":
        return "on a device"
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


def lean_terms(terms, kernel):
    """The terms with every equation that has a lean sum replaced by it."""
    return [term._replace(equation=LEAN[type(term.equation)](term.equation, kernel)) if type(term.equation) in LEAN
            else term for term in terms]

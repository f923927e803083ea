"""Stops a run at the step in which a number that is none appears."""
import math

import numpy as np
from pysph.solver.tools import Tool

from pysph_boiling.device import summed, values
from pysph_boiling.particles import host
from pysph_boiling.phases import Phase
from pysph_boiling.schemes import ranks

__all__ = ["Guard"]

WATCHED = ("x", "y", "z", "u", "v", "w", "e", "T")


class Guard(Tool):
    """Raises ``FloatingPointError`` after the step in which a position, velocity or temperature is NaN or Inf.

    The error names particle, place, phase and the last particle file, which is good.
    """

    def __init__(self, scheme):
        self.scheme = scheme

    def post_step(self, solver):
        problem = ranks.first_given(self.look(solver))
        if problem:
            raise FloatingPointError(problem)

    def look(self, solver):
        """What is wrong on this rank, or ``None``."""
        for pa in self.scheme.arrays:
            for name in WATCHED:
                if name in pa.properties and not math.isfinite(summed(values(pa, name))):
                    return self.report(pa, name, solver)
        return None

    def report(self, pa, name, solver):
        """Particle, place, phase, and the last particle file that is good."""
        from pysph_boiling.analysis.files import last_output

        for watched in pa.properties:
            host(pa, watched)
        bad = np.flatnonzero(~np.isfinite(pa.get(name)))
        if len(bad) == 0:  # finite numbers whose sum is not
            bad = [int(np.argmax(np.abs(pa.get(name))))]
        i = bad[0]
        phase = f", {Phase(int(pa.phase[i])).name.lower()}" if "phase" in pa.properties else ""
        file = None if solver.disable_output else last_output(solver.output_directory)
        return (
            f"at t = {solver.t + solver.dt:.6g} s (step {solver.count + 1}) {name} = {pa.get(name)[i]} of particle "
            f"{pa.uid[i]} of '{pa.name}' at ({pa.x[i]:.4g}, {pa.y[i]:.4g}, {pa.z[i]:.4g}) m{phase}; {len(bad)} "
            f"particles in all; last good output: {file or 'none'}")

"""Stops a run at the step in which a NaN or Inf or an impossible temperature appears."""
import warnings

import numpy as np
from pysph.solver.tools import Tool

from pysph_boiling.device import counted, real, values
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import host
from pysph_boiling.phases import Phase

__all__ = ["Guard"]

WATCHED = ("x", "y", "z", "u", "v", "w", "e", "T")


class Guard(Tool):
    """Raises ``FloatingPointError`` after the step in which a position, velocity or temperature is NaN or Inf.

    The same happens if a temperature is not above 0 K, or if liquid is not below the critical temperature; vapour may
    have any temperature. With ``interrupt="convert"`` (the paper's form) stored latent heat becomes sensible heat,
    which may heat liquid by up to L/c_l, so in this case there is only a warning, once.

    The error names the particle, its position and phase, and the last valid particle file.
    """

    def __init__(self, scheme):
        self.scheme = scheme
        phases = scheme.effects.get("phases")
        self.converts = phases is not None and phases.interrupt == "convert"
        self.warned = False

    def post_step(self, solver):
        problem = ranks.first_given(self.look(solver))
        if problem:
            raise FloatingPointError(problem)

    def look(self, solver):
        """A description of the problem on this rank, or ``None``."""
        reductions = self.scheme.reductions
        for pa in self.scheme.arrays:
            name = reductions.not_finite(pa, [name for name in WATCHED if name in pa.properties])
            if name:
                return self.report(pa, name, solver, lambda pa, name=name: ~np.isfinite(pa.get(name)))
            if "T" in pa.properties and self.scheme.material is not None and real(pa):
                coldest, hottest = reductions.ends(pa, "T")
                problem = self.too_cold(pa, coldest, solver) or self.too_hot(pa, hottest, solver)
                if problem:
                    return problem
        return None

    def limits(self):
        material = self.scheme.material
        return (f"; liquid must stay between 0 K and {material.T_crit} K, the critical point of {material.name}, "
                "vapour above 0 K")

    def too_cold(self, pa, coldest, solver):
        """A description of a temperature that is not above 0 K, or ``None``; ``coldest`` [K] is the lowest one."""
        if coldest > 0.0:
            return None
        return self.report(pa, "T", solver, lambda pa: pa.T <= 0.0, self.limits())

    def too_hot(self, pa, hottest, solver):
        """A description of liquid that is not below the critical temperature, or ``None``; ``hottest`` [K] as above."""
        T_crit, phases = self.scheme.material.T_crit, "phase" in pa.properties

        def beyond(T, phase):
            return (T >= T_crit) & (phase != Phase.VAPOUR) if phases else T >= T_crit

        if hottest < T_crit or not counted(beyond(values(pa, "T"), values(pa, "phase") if phases else None)):
            return None
        if self.converts and self.warned:
            return None
        problem = self.report(
            pa, "T", solver, lambda pa: beyond(pa.T, pa.phase if phases else None), self.limits())
        if not self.converts:
            return problem
        self.warned = True
        warnings.warn(f"{problem}: with phases.interrupt = convert, latent heat becomes sensible heat at an "
                      "interruption, which can heat liquid this much; the run continues", stacklevel=2)
        return None

    def report(self, pa, name, solver, wrong, limits=""):
        """Text with particle, position, phase, limits and the last valid file; ``wrong(pa)`` is a mask (n,)."""
        from pysph_boiling.files import last_output

        for watched in pa.properties:
            host(pa, watched)
        bad = np.flatnonzero(wrong(pa))
        if len(bad) == 0:  # all numbers are finite, but their sum is not
            bad = [int(np.argmax(np.abs(pa.get(name))))]
        i = bad[0]
        phase = f", {Phase(int(pa.phase[i])).name.lower()}" if "phase" in pa.properties else ""
        value = f"{pa.get(name)[i]:.6g} K" if limits else pa.get(name)[i]
        file = None if solver.disable_output else last_output(solver.output_directory)
        return (
            f"at t = {solver.t + solver.dt:.6g} s (step {solver.count + 1}) {name} = {value} of particle "
            f"{pa.uid[i]} of '{pa.name}' at ({pa.x[i]:.4g}, {pa.y[i]:.4g}, {pa.z[i]:.4g}) m{phase}; {len(bad)} "
            f"particles in all{limits}; last valid output: {file or 'none'}")

"""Sums and extremes over the particles of one array, of this rank: in C, or by NumPy and the device's own reductions.

A scheme has one of the two classes here, both with the same methods: it uses C where it uses lean sums.
"""
import functools
import math

import numpy as np

from pysph_boiling import native
from pysph_boiling.device import largest, largest_size, reduced, smallest, summed, values
from pysph_boiling.particles import host
from pysph_boiling.phases import Phase, at_saturation

__all__ = ["GENERAL", "HELD", "CompiledReductions", "Reductions", "has"]

HELD = len(Phase)  # number of the state of superheated liquid that is at T_sat, which is counted apart


def _each(term, names):
    """The sum of a term for each property, for :func:`~pysph_boiling.device.reduced`."""
    return " + ".join(term.format(chr(ord("a") + k)) for k in range(len(names)))


class Reductions:
    """By NumPy on the host, by the device's own reductions on a device; sums for the ledger on the host in any case."""

    def not_finite(self, pa, names):
        """The first of the properties ``names`` of which a value is NaN or Inf, or ``None``."""
        if pa.gpu is not None and reduced("sum", f"0 * ({_each('{}[i]', names)})", pa, names) == 0.0:
            return None
        return next((name for name in names if not math.isfinite(summed(values(pa, name)))), None)

    def ends(self, pa, name):
        """Smallest and largest value of a property that has some; NaN as in :mod:`pysph_boiling.device`."""
        return smallest(values(pa, name)), largest(values(pa, name), default=-math.inf)

    def largest_square(self, pa, names):
        """Largest square of the vector with the components ``names``; NaN if there is one, 0 without particles."""
        if pa.gpu is not None:
            return reduced("max", _each("{0}[i]*{0}[i]", names), pa, names)
        return largest(sum(values(pa, name)**2 for name in names))

    def largest_size(self, pa, name):
        """Largest absolute value of a property; NaN if there is one, 0 without particles."""
        return largest_size(values(pa, name)) if pa.gpu is None else reduced("max", "fabs(a[i])", pa, [name])

    def sum(self, pa, name):
        """Sum of a property."""
        return float(np.sum(host(pa, name), dtype=float))

    def sums(self, pa, names):
        """Sums of properties, as a list."""
        return [self.sum(pa, name) for name in names]

    def states(self, pa):
        """(number of particles (5,), enthalpy [J] (5,), held latent heat [J]).

        The first two are by state: the four phases, superheated liquid without that at T_sat, which is the fifth. The
        last one is what no temperature shows. Without phases all particles are liquid.
        """
        m, e = host(pa, "m"), host(pa, "e")
        phase = host(pa, "phase") if "phase" in pa.properties else np.zeros(len(m), np.intc)
        e_lat = host(pa, "e_lat") if "e_lat" in pa.properties else np.zeros(len(m))
        return self._states(m, e, e_lat, phase)

    def _states(self, m, e, e_lat, phase):
        state = np.where(at_saturation(phase, e, e_lat), HELD, phase)
        members = [state == number for number in range(HELD + 1)]
        energy = [float(np.sum((m * e)[which])) for which in members]
        hot = phase == Phase.SUPERHEATED.value
        return ([float(np.count_nonzero(which)) for which in members], energy,
                float(np.sum(np.minimum(e, e_lat)[hot] * m[hot])))


class CompiledReductions(Reductions):
    """In C, for arrays on the host."""

    @functools.cached_property
    def module(self):
        return native.fluid_sums()

    def not_finite(self, pa, names):
        if pa.get_number_of_particles(True) == 0:
            return None
        return next((name for name in names if not all(map(math.isfinite, self.ends(pa, name)))), None)

    def ends(self, pa, name):
        return self.module.ends_of(pa.get(name))

    def largest_square(self, pa, names):
        return self.module.square_of(*map(pa.get, names))

    def largest_size(self, pa, name):
        least, most = self.ends(pa, name)
        return max(most, -least, 0.0)

    def sum(self, pa, name):
        return self.module.sum_of(pa.get(name))

    def sums(self, pa, names):
        return self.module.sums_of(pa, names)

    def _states(self, m, e, e_lat, phase):
        number, energy = self.module.states_of(m, e, e_lat, phase)
        return number, energy[:-1], energy[-1]


GENERAL = Reductions()


def has(pa, name, low, high):
    """Whether a property of whole numbers lies in ``low`` .. ``high`` for one of this rank's particles."""
    if pa.gpu is None:
        return native.has(pa.get(name), low, high)
    return reduced("max", f"a[i] >= {low} && a[i] <= {high}", pa, [name]) > 0.0


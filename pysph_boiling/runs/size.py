"""How large a run is, and about how long it takes: for the lists of scenes and figures."""
from math import ceil
from typing import NamedTuple

__all__ = ["PACE", "Size", "about", "size_of"]

# Wall time of a step on two cores [s]: what a step takes without particles, and what each fluid particle adds. Measured
# were 5 ms with 480 particles (reuse_wcsph), and with some 20,000 from 23 ms (steady_boiling, a fast machine) to 159 ms
# (Table 4 in docs/reproduction.md, a bubble that splits on a slow one). The middle of these is within a factor of 3.
STEP, PARTICLE = 4e-3, 2.8e-6
TIMES = ("duration", "frame", "substeps", "seed")  # parameters of all scenes that change no number of particles
PACE = (f"Times are estimates for two idle cores: {1e3 * STEP:g} ms a step and {1e6 * PARTICLE:g} µs for each fluid "
        "particle of it.\nMachines and boils differ by up to a factor of three; what is compiled once is not included.")


class Size(NamedTuple):
    """The dimension of a run, its fluid particles, its steps and its simulated time [s]."""

    dim: int
    particles: int
    steps: int
    duration: float

    @property
    def seconds(self):
        """Estimated wall time [s], without what is compiled once."""
        return self.steps * (STEP + self.particles * PARTICLE)


def size_of(application, options=(), known=None):
    """The :class:`Size` of a run of a scene with command-line options; nothing is run.

    ``known`` is a dict in which the numbers of particles are kept from one call to the next, by what decides them.
    """
    application.set_args(list(options))
    application._parse_command_line(force=True)
    application.consume_user_options()
    application.configure_scheme()
    parameters = getattr(application, "parameters", None)  # a scene with a scheme of PySPH has none
    given = vars(parameters).items() if parameters is not None else ()
    key = type(application), *(item for item in given if item[0] not in TIMES)
    solver, known = application.scheme.solver, {} if known is None else known
    if key not in known:
        arrays = (application.create_particles() if parameters is None else
                  application.make_particles(parameters, application.scheme))
        known[key] = sum(pa.get_number_of_particles() for pa in arrays if pa.name in application.scheme.fluids)
    steps = min(ceil(solver.tf / solver.dt - 1e-9), application.options.max_steps)
    return Size(application.scheme.dim, known[key], steps, solver.tf)


def about(seconds):
    """A time in words with one or two digits: ``3 minutes``."""
    if seconds < 90.0:
        return f"{max(1, round(seconds, -1 if seconds > 20.0 else None)):.0f} s"
    if seconds < 5400.0:
        return f"{seconds / 60.0:.0f} minutes"
    return f"{seconds / 3600.0:.0f} hours"

"""Stepper: compiles a scheme and steps it by hand, without files and without an application."""
from time import perf_counter

from compyle.array import get_backend
from compyle.config import get_config

from pysph_boiling.device import Mirrored, detached, neighbour_search

__all__ = ["Stepper"]


class Stepper:
    """Steps a scheme by hand, with OpenMP, or on a device if PySPH's configuration says so.

    Between calls of :meth:`step` the state is on the host and may be edited there.

    Parameters
    ----------
    scheme : PBFScheme         The scheme; call its ``setup_properties`` with ``arrays`` first.
    arrays : list              The particle arrays of PySPH.
    dt : float                 Time step [s]; the scheme's own if not given.
    domain : DomainManager     The periodic domain, if there is one.
    ordered : bool             Sort the particles in memory as an application does, which changes their order.

    ``t`` is the time [s], ``seconds`` the wall time spent in steps so far [s], without compiling.
    """

    openmp = True  # used if the arrays are on the host

    def __init__(self, scheme, arrays, *, dt=None, domain=None, ordered=False):
        on_device = get_backend() != "cython"
        get_config().use_openmp = self.openmp and not on_device
        self.scheme, self.arrays = scheme, {pa.name: pa for pa in arrays}
        scheme.configure_solver(dt=dt, tf=1e9)
        self.equations = scheme.get_equations()
        self.solver = scheme.get_solver()
        self.solver.disable_output = True
        nnps = neighbour_search(arrays, dim=scheme.dim, radius_scale=scheme.kernel.radius_scale, fixed_h=True,
                                domain=domain)
        self.solver.set_parallel_manager(None)
        self.solver.setup(arrays, self.equations, nnps)
        self.tools = scheme.tools()
        self.t, self.dt, self.seconds, self.ordered = 0.0, scheme.dt, 0.0, ordered
        if on_device:
            self.solver.integrator.c_integrator.t = self.solver.integrator.c_integrator.dt = 0.0  # PySPH's has none yet
            mirrored = Mirrored(self, detached(arrays))
            self.step, self.run_stage, self.settle = mirrored.step, mirrored.run_stage, mirrored.settle

    def step(self, n=1):
        """Take ``n`` steps."""
        begin = perf_counter()
        for _ in range(n):
            self.solver.t = self.t
            if self.ordered:
                self.solver.reorder_particles()
            for tool in self.tools:
                tool.pre_step(self.solver)
            self.solver.integrator.step(self.t, self.dt)
            for tool in self.tools:
                tool.post_step(self.solver)
            self.t += self.dt
            self.solver.count += 1
        self.seconds += perf_counter() - begin

    def settle(self):
        """Move apart particles that start too close together; otherwise the first step does this."""
        self.solver.integrator.settle()

    def run_stage(self, name):
        """Run one stage alone, on new neighbour lists."""
        integrator = self.solver.integrator
        integrator.forget_lists()
        integrator.nnps.update_domain()
        integrator.search()
        integrator.compute_accelerations(integrator.stages[name], update_nnps=False)

"""What the lean sums on the host run: arrays and neighbour lists of a step, handed to the compiled module."""
from pysph_boiling.equations import cohesion, container, density_constraint, wall_multipliers
from pysph_boiling.equations.density_constraint import book_sweep
from pysph_boiling.equations.helpers import kernel_coefficients
from pysph_boiling.native import fluid_sums
from pysph_boiling.parallel import ranks

__all__ = ["Forces", "Heat", "Labels", "Sweeps"]


class Run:
    """Base: ``self(pa, dt)`` makes the sum of a step of ``dt`` [s] of the ``scheme`` for its fluid ``pa``."""

    def __init__(self, scheme):
        self.scheme = scheme
        self.options = dict(kernel=kernel_coefficients(scheme.kernel), deep=scheme.dim == 3)
        self.made = None

    def native(self, name):
        """An object of a class of the compiled module, made at the first call and kept."""
        if self.made is None:
            self.made = getattr(fluid_sums(), name)(**self.options)
        return self.made

    def lists(self, dest, source):
        """Neighbours of one array in another one, both by name: of our search as they are, of PySPH's a copy."""
        nnps = self.scheme.integrator.nnps
        names = [pa.name for pa in nnps.particles]
        pair = names.index(dest), names.index(source)
        return nnps.lists(*pair) if hasattr(nnps, "lists") else fluid_sums().lists_of(nnps, *pair)


    def wall_lists(self, pa):
        """Pairs (array, lists) of the neighbours of a fluid in each of its ``walls``."""
        arrays = {array.name: array for array in self.scheme.integrator.nnps.particles}
        return [(arrays[name], self.lists(pa.name, name)) for name in self.walls]


class Heat(Run):
    """Conduction in the fluid."""

    def __init__(self, scheme, conduction):
        super().__init__(scheme)
        self.rho0 = conduction.rho0

    def __call__(self, pa, dt):
        self.native("Exchange").heat(pa, self.lists(pa.name, pa.name), self.rho0)


class Labels(Run):
    """The labels of the bubbles, for the equation that links vapour particles."""

    def __init__(self, scheme, hook):
        super().__init__(scheme)
        self.radius2 = hook.radius2

    def __call__(self, pa, dt):
        images = [copies.original for copies, _ in self.scheme.ghosts.images if copies.pa is pa]
        self.native("Labels").label(pa, self.lists(pa.name, pa.name), self.radius2, images[0] if images else ())
        pa.bubble_rounds[0] += 1.0


class Forces(Run):
    """Gravity, what viscosity and drag even out, artificial pressure, and the pressure with which a step begins.

    The last one is ``start``, or ``swollen_start`` with vapour that swells, and ``boundary`` is what walls add to it.
    Each but ``body`` may be ``None``.
    """

    def __init__(self, scheme, body, viscosity, drag, pressure, start, swollen_start, boundary):
        super().__init__(scheme)
        self.gravity, self.rho0 = (body.gx, body.gy, body.gz), scheme.rho0
        self.viscosity = viscosity.rate if viscosity else 0.0
        self.drag = drag.rate if drag else 0.0
        self.repulsion = (pressure.strength / pressure.rho_rest, pressure.per_unit) if pressure else None
        start, self.swollen = start or swollen_start, swollen_start is not None
        self.start = 1.0 / start.rho_rest if start else 0.0
        self.walls = boundary.sources if boundary else []

    def __call__(self, pa, dt):
        self.native("Exchange").momentum(pa, self.lists(pa.name, pa.name), self.wall_lists(pa), self.viscosity,
                                         self.drag, self.rho0, self.gravity, self.repulsion, self.start, self.swollen)


class Sweeps(Run):
    """The density sweeps, for the ``equations`` of the block that iterates; ghosts are refreshed as its groups say."""

    def __init__(self, scheme, equations):
        super().__init__(scheme)
        found = {type(equation): equation for equation in equations}
        self.lmbda = found[density_constraint.PBFLambda]
        self.accelerated = density_constraint.PBFMoveAccelerated in found
        self.move = found[density_constraint.PBFMoveAccelerated if self.accelerated else density_constraint.PBFMove]
        swollen = density_constraint.PBFPositionCorrectionSwollen in found
        correction = found[density_constraint.PBFPositionCorrectionSwollen if swollen else
                           density_constraint.PBFPositionCorrection]
        walls = found.get(density_constraint.PBFBoundaryDensity)
        self.walls = walls.sources if walls else []
        self.extrapolates = wall_multipliers.PBFWallMultiplier in found
        self.options.update(
            rho_rest=self.lmbda.rho_rest, eps=self.lmbda.eps, omega=self.move.omega, carries=self.accelerated,
            swollen=swollen, max_displacement=self.move.max_displacement, nudge=correction.nudge)
        box, cylinder = found.get(container.PBFBoxContainer), found.get(container.PBFCylinderContainer)
        if box:
            self.options.update(depth=box.depth, box=((box.x0, box.y0, box.z0), (box.x1, box.y1, box.z1)))
        if cylinder:
            self.options.update(depth=cylinder.depth, cylinder=(cylinder.cx, cylinder.cy, cylinder.radius,
                                                                cylinder.bottom, cylinder.top))
        room = found.get(container.PBFDistanceContainer)
        if room:
            self.options.update(depth=room.depth, room=(room.ny, room.nz, (room.end_x, room.end_y, room.end_z),
                                                        (room.x0, room.y0, room.z0), room.per, room.inset))
        pull = found.get(cohesion.BubbleCohesion)
        if pull:
            self.options.update(cohesion=(pull.strength, pull.radius, pull.stiffness))
        self.least, self.most = scheme.sweep_limits()

    def start(self, pa, dt):
        """The sums, for the particles where they are now, in a step of ``dt`` [s]."""
        sweeps = self.native("DensitySweeps")
        back = [self.lists(name, pa.name) for name in self.walls] if self.extrapolates else ()
        sweeps.start(pa, self.lists(pa.name, pa.name), self.wall_lists(pa), dt, back)
        return sweeps

    def density(self, pa, dt):
        """The density alone."""
        self.start(pa, dt).multipliers(0.0)

    def __call__(self, pa, dt):
        sweeps, lmbda, ghosts = self.start(pa, dt), self.lmbda, self.scheme.ghosts
        n = max(ranks.total(float(pa.get_number_of_particles(True))), 1.0)
        done, last = 0, False
        while done < self.least or (done < self.most and not last):
            errors = sweeps.multipliers(1.0 - pa.prior[0])
            with ghosts.refreshing(("lmbda",)):
                (total, left), worst = ranks.totals_and_largest(errors[:2], errors[2])
                last = book_sweep(pa, total / n, worst, left / n, lmbda.tolerance, lmbda.enough, lmbda.max_mean_error)
            if self.extrapolates:
                sweeps.wall_multipliers(self.scheme.wall_arrays)
                ghosts.refresh(("wall_lmbda",))
            sweeps.move(pa.prior[0], pa.prior[1], pa.sweep_weight[0] if self.accelerated else 1.0)
            ghosts.refresh(("x", "y", "z"))
            if self.accelerated:
                self.move.reduce(pa, 0.0, 0.0)
            done += 1

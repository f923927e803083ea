"""The mechanical ledger: the work done on the fluid by each part of a step, so that kinetic energy is balanced."""
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from compyle.array import get_backend

from pysph_boiling.equations.density_constraint import PBFPressure
from pysph_boiling.particles import Property, fill, host, lattice_density
from pysph_boiling.schemes.effects.base import Column, Effect, constant
from pysph_boiling.schemes.stages import Term

__all__ = ["MechanicalLedger", "WorkMeter"]

FORCES = ("forces.sum", "forces.release")  # places whose terms are measured separately for each effect
MOVES = ("density.contact", "density.pull", "density.move")  # the same for places whose terms move particles
AXES = ("u", "v", "w")


@dataclass(frozen=True, kw_only=True)
class MechanicalLedger(Effect):
    """Records the work [J] of each part of a step since the start, which balances kinetic energy.

    .. math::  K - K_0 = W_{gravity} + W_{density} + W_{expansion} + W_{container} + \\sum_{terms} W
               + W_{oscillation} + W_{vented} + residual

    ``work_gravity`` is m g times all displacements, including those that cause no velocity. ``work_expansion`` is the
    sum of p dV over the particles whose rest volume changes, with the pressure p of the density constraint
    (:class:`PBFPressure`): the work of swelling vapour on the rest, negative if it shrinks. ``work_container`` is the
    work of contacts with the container and projections into it, and ``work_density`` the remaining work of the density
    constraint and the finite time step. ``work_<name>`` is the work m (v + v')/2 . a dt of the acceleration a of the
    effect ``name`` between two velocities. ``work_oscillation`` is recorded by the oscillation and ``work_vented`` by
    venting. The residual is relative to the sum of all works; it is at most 1e-12 unless something moves the fluid
    without being recorded.

    Source: ours.   Limits: one rank, no device. The terms are summed group by group, so a run with this effect equals
    one without it only to round-off, which grows in a chaotic flow. Moving particles back into the container without a
    velocity in a short step (``density.back``) is part of the work of the density constraint.
    """

    slot: ClassVar[str] = "mechanics"
    title: ClassVar[str] = "mechanical ledger"
    requires: ClassVar[tuple[str, ...]] = ("density",)
    in_guest: ClassVar[bool] = False
    on_ranks: ClassVar[bool] = False

    def owners(self, scene, places=FORCES):
        """The slots of the effects with terms in ``places``, in the order of their terms: those that accelerate."""
        return [slot for slot, effect in scene.effects.items()
                if any(term.place in places for term in effect.terms(scene, scene.fluids[0]))]

    def parts(self, scene):
        """Name -> meaning of each part that is measured here, for the columns ``work_<part>``."""
        parts = {"gravity": "work of gravity", "density": "work of the density constraint and the time step"}
        if "expansion" in scene.effects:
            parts["expansion"] = "work of vapour that swells or shrinks, p dV"
        if "container" in scene.effects:
            parts["container"] = "work of contacts with the container and projections into it"
        for places, what in ((FORCES, "accelerations"), (MOVES, "displacements")):
            parts.update({slot: f"work of the {what} of '{slot}'" for slot in self.owners(scene, places)
                          if slot not in ("density", "container")})
        if "venting" in scene.effects:
            parts["vented"] = "kinetic energy removed by venting, negative"
        return parts

    def properties(self, scene):
        rows = [Property(f"{axis}_by_{slot}", "m/s^2", f"acceleration by '{slot}'", state=True)
                for slot in self.owners(scene) for axis in ("au", "av", "aw")]
        if "expansion" in scene.effects:
            rows += [Property("swell_before", "-", "swell in the step before; 0 for a new particle", state=True),
                     Property("pressure", "Pa", "pressure of the density constraint in this step")]
        return tuple(rows)

    def terms(self, scene, fluid):
        if "expansion" in scene.effects:
            lattice, _ = lattice_density(scene.kernel, dim=scene.dim, hdx=scene.h / scene.spacing)
            yield Term("forces.pressure", PBFPressure(
                fluid, list(scene.fluids), rho0=scene.rho0, rho_rest=scene.rho0 * lattice))

    def constants(self, scene):
        return {"kinetic_start": [0.0, 0.0], "work_moved": 0.0,
                **{f"work_{part}": 0.0 for part in self.parts(scene)}}

    def columns(self, scene):
        def work(part):
            return lambda arrays, scene: constant(arrays, f"work_{part}")

        def residual(arrays, scene):
            start, begun = arrays[0].kinetic_start
            if not begun:
                return 0.0
            booked = sum(constant(arrays, f"work_{part}") for part in self.booked(scene))
            return (kinetic(arrays) - start - booked) / max(constant(arrays, "work_moved"), start, 1e-300)

        return (
            Column("kinetic_energy", "J", "kinetic energy of the fluid", lambda arrays, scene: kinetic(arrays)),
            *(Column(f"work_{part}", "J", f"{meaning}, since the start", work(part))
              for part, meaning in self.parts(scene).items()),
            Column("work_residual", "-", "kinetic energy not accounted for / sum of absolute works so far", residual),
        )

    def booked(self, scene):
        """All parts whose sum is the change of the kinetic energy."""
        return [*self.parts(scene), *(["oscillation"] if "oscillation" in scene.effects else [])]

    def check(self, scene, arrays):
        if get_backend() != "cython":
            raise ValueError("mechanics (the mechanical ledger) does not run on a device, because it reads every "
                             "particle between the stages of a step; leave out --opencl, --cuda or --mechanics")

    def prepare(self, scene, arrays):
        """Set the state for the first step, in which only gravity acts."""
        for name in scene.fluids:
            for axis, g in zip(("au", "av", "aw"), scene.gravity):
                fill(arrays[name], f"{axis}_by_density", g)


def kinetic(arrays):
    """Kinetic energy of the real particles [J]."""
    return sum(0.5 * float(np.sum(host(pa, "m") * sum(host(pa, name)**2 for name in AXES))) for pa in arrays)


class WorkMeter:
    """Measures a step at the borders of its parts, for the integrator; ``arrays`` is filled by the scheme later.

    ``begin`` is called before the prediction and ``mark`` after a stage; ``apart`` maps a place to the function that is
    called after the terms of each effect there.
    """

    def __init__(self, effect, scene, arrays):
        self.arrays, self.scene = arrays, scene
        self.owners, self.gravity = effect.owners(scene), np.array(scene.gravity)
        self.swells = "expansion" in scene.effects
        self.summed, self.swelled = [], []
        self.energy = None  # kinetic energy of the displacement so far; None between steps and while settling
        self.apart = {**dict.fromkeys(FORCES, self.share), **dict.fromkeys(MOVES, self.moved)}

    def book(self, part, work):
        first = self.arrays[0]
        first.constants[f"work_{part}"].get_npy_array()[0] += work
        first.work_moved[0] += abs(work)

    def potential(self):
        """The sum of -m g . x [J]."""
        return -sum(float(np.sum(host(pa, "m") * sum(g * host(pa, axis) for g, axis in zip(self.gravity, "xyz"))))
                    for pa in self.arrays)

    def kinetic(self):
        """Kinetic energy of the displacement in this step so far [J]."""
        return sum(0.5 * float(np.sum(host(pa, "m") * sum(host(pa, name)**2 for name in ("sx", "sy", "sz"))))
                   for pa in self.arrays) / self.dt**2

    def begin(self, dt, short):
        """Record the work of each acceleration in the following prediction, between the velocities before and after.

        In a ``short`` step only the change of the swell by its rate in that step affects the velocity.
        """
        self.dt = dt
        if self.arrays[0].kinetic_start[1] == 0.0:
            self.arrays[0].kinetic_start[:] = kinetic(self.arrays), 1.0
        self.place, free = self.potential(), 0.0
        for slot in self.owners:
            work = 0.0
            for pa in self.arrays:
                rate = sum((host(pa, axis) + 0.5 * dt * host(pa, f"a{axis}")) * host(pa, f"a{axis}_by_{slot}")
                           for axis in AXES)
                work += float(np.sum(host(pa, "m") * rate)) * dt
            if slot == "density":
                free = work  # work of gravity on the velocity
            else:
                self.book(slot, work)
        self.free = free
        if self.swells:
            self.swelled = []
            for pa in self.arrays:
                swell, before = host(pa, "swell"), host(pa, "swell_before")
                change = dt * host(pa, "swelling") if short else swell - np.where(before > 0.0, before, swell)
                self.swelled.append(change)
                before[:] = swell

    def predicted(self):
        """Measure after the prediction, before any stage."""
        if self.energy is None:
            self.energy = self.kinetic()
            fallen = self.fallen()
            self.book("density", self.free - fallen)

    def fallen(self):
        """Record the work of gravity since the last call [J]."""
        place = self.potential()
        work, self.place = self.place - place, place
        self.book("gravity", work)
        return work

    def mark(self, stage):
        """Record the work of a stage, without that of gravity and of effects that are measured separately."""
        if stage == "density":
            self.book("density", self.gained(self.kinetic()))
        elif stage == "oscillation":
            self.arrays[0].work_moved[0] += abs(self.gained(self.kinetic()))  # recorded by the oscillation itself
        elif stage == "forces":
            self.book("density", self.gained(kinetic(self.arrays)))
            self.energy = None
            if self.swells:
                work = sum(float(np.sum(host(pa, "m") * change * host(pa, "pressure")))
                           for pa, change in zip(self.arrays, self.swelled)) / self.scene.rho0
                self.book("expansion", work)
                self.book("density", -work)

    def gained(self, energy):
        """Change of the kinetic energy since the last call, without the work of gravity [J]."""
        work = energy - self.energy - self.fallen()
        self.energy = energy
        return work

    def moved(self, slot):
        """Record the work of one effect whose terms have moved particles."""
        if self.energy is None:
            return
        self.book(slot, self.gained(self.kinetic()))

    def share(self, slot):
        """Store the accelerations that the terms of one effect have added."""
        now = [{axis: host(pa, f"a{axis}").copy() for axis in AXES} for pa in self.arrays]
        before = self.summed if slot != self.owners[0] else [dict.fromkeys(AXES, 0.0)] * len(now)
        for pa, new, old in zip(self.arrays, now, before):
            for axis in AXES:
                pa.get(f"a{axis}_by_{slot}", only_real_particles=True)[:] = new[axis] - old[axis]
        self.summed = now

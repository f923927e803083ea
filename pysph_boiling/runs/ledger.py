"""The ledger: the balance of mass and energy of a run after every step, and the table of results.

Energy is the sum of m e over the domain. Each flow of energy is added up by the kernel or tool that causes it and never
found by subtraction, so the residual measures how well the scheme conserves energy:

    residual = (E - E_0 - sum of signed flows) / max(energy moved so far, m_p L)
"""
import json
import os
import warnings
from collections.abc import Sequence

import numpy as np
from pysph.solver.tools import Tool

from pysph_boiling.files import npz, whole
from pysph_boiling.names import whole_number
from pysph_boiling.particles import BASE_PROPERTIES, PYSPH_PROPERTIES
from pysph_boiling.schemes.effects import Column, Effect, Snapshot, sum_over, totals
from pysph_boiling.schemes.guest import BoilingGuest

__all__ = ["GuestLedger", "Ledger", "save_results", "write_json"]

START = {"ledger_energy": "energy", "ledger_mass": "mass", "ledger_count": "count"}  # constants with values at t = 0


def save_results(path, table):
    """Write ``table`` (name -> array (rows,)) as npz, to a temporary file first, so that no reader sees half of it."""
    data = npz(table)
    with whole(path) as part:
        part.write_bytes(data)


def write_json(path, data):
    """Write ``data`` as JSON, to a temporary file first."""
    with whole(path) as part:
        part.write_text(json.dumps(data, indent=2, default=str) + "\n")


class Rows(Sequence):
    """Rows of numbers, each read as a dict name -> number; stored by column, so that a table is made in no time."""

    FIRST = 64  # rows that there is room for at the start

    def __init__(self):
        self.names, self.number, self.columns = (), 0, np.zeros((0, self.FIRST))

    def append(self, row):
        if not self.number:
            self.names, self.columns = tuple(row), np.zeros((len(row), self.FIRST))
        if self.number == self.columns.shape[1]:
            self.columns = np.concatenate([self.columns, np.zeros_like(self.columns)], axis=1)
        self.columns[:, self.number] = [row[name] for name in self.names]
        self.number += 1

    def pop(self):
        self.number -= 1

    def __len__(self):
        return self.number

    def __getitem__(self, index):
        return dict(zip(self.names, self.columns[:, range(self.number)[index]].tolist()))

    def table(self):
        """The columns: name -> array (rows,)."""
        return dict(zip(self.names, self.columns[:, :self.number].copy()))


class Ledger(Tool):
    """PySPH tool that balances mass and energy after each step and collects the table of results.

    Parameters
    ----------
    scheme : PBFScheme      The scheme, whose effects define the flows and columns.
    every : int             Steps between two rows, >= 1. Flows are cumulative, so the balance does not depend on it.
    path : path or None     Path of ``results.npz``; rows are also kept in ``rows``.

    Errors: ``ValueError`` at the start for a property of a fluid array that no effect declares, because the ledger
    cannot account for its energy.
    """

    def __init__(self, scheme, every=1, path=None):
        self.scheme, self.every, self.path = scheme, whole_number("every", every, low=1, unit="step"), path
        self.scene = scheme.scene()
        self.flows = scheme.effect_rows("flows")
        self.thermal = "heat" in scheme.effects
        self.summed = ("m", *(["T"] if self.thermal else []),
                       *(row.name for row in scheme.effect_rows("properties") if row.cumulative))
        self.columns = [*self._own_columns(), *scheme.effect_rows("columns")]
        self.values = [(column.name, column.value) for column in self.columns]
        self.storing = [effect for effect in scheme.effects.values() if type(effect).stored is not Effect.stored]
        self.rows, self.now, self.time = Rows(), None, (0.0, 0.0)
        self.warned = False

    def check(self, arrays):
        """Raise ``ValueError`` for properties of fluid arrays that no effect declares."""
        known = {row.name for row in (*BASE_PROPERTIES, *self.scheme.effect_rows("properties"))} | set(PYSPH_PROPERTIES)
        for pa in arrays:
            unknown = sorted(set(pa.properties) - known)
            if unknown:
                raise ValueError(f"array '{pa.name}' carries {', '.join(unknown)}, which no effect of the scheme "
                                 "declares: the ledger cannot account for it")

    def begin(self, arrays):
        """Store the initial energy, mass and number of particles; a resumed run keeps those of its first start."""
        self.check(arrays)
        first, arrays = arrays[0], self.moment(arrays)
        for constant, name in START.items():
            if constant not in first.constants:
                first.add_constant(constant, float(getattr(self, name)(arrays)))

    def resume(self, table, t):
        """Take over the rows of an interrupted run up to the time ``t`` [s]."""
        kept = table["t"] <= t
        for row in zip(*(values[kept] for values in table.values())):
            self.rows.append(dict(zip(table, row)))

    def moment(self, arrays):
        """The arrays as they are now, with the sums of which a row is made."""
        return Snapshot(arrays, self.scheme.reductions, self.summed)

    def energy(self, arrays):
        """Total enthalpy of the domain [J]."""
        if not self.thermal:
            return 0.0
        return sum(totals(arrays).energy) + sum(effect.stored(self.scheme.site_arrays) for effect in self.storing)

    @staticmethod
    def mass(arrays):
        """Total mass of the domain [kg]."""
        return sum_over(arrays, "m")

    @staticmethod
    def count(arrays):
        """Number of particles in the domain."""
        return totals(arrays).count

    def lost(self, arrays):
        """Number of particles that are missing: they were there or flowed in, and were not removed."""
        def number(name):
            return sum(float(pa.constants[name].get_npy_array()[0]) for pa in arrays if name in pa.constants)

        removes = any(effect.removes_particles for effect in self.scheme.effects.values())
        come, gone = number("n_refilled"), number("n_vented")
        return round(self.start(arrays, "ledger_count") + come - (gone if removes else 0.0) - self.count(arrays))

    @staticmethod
    def start(arrays, constant):
        return arrays[0].constants[constant][0]

    def flow(self, arrays, flow):
        """One flow since the start [J], positive in the direction of its definition."""
        if flow.prop:
            return sum_over(arrays, flow.prop)
        return sum(pa.constants[flow.constant][0] for pa in arrays)

    def balance(self, arrays):
        """(in, out, leak, residual): energies [J] since the start, and the relative residual [-]."""
        inward = outward = leak = moved = 0.0
        for flow in self.flows:
            value = flow.sign * self.flow(arrays, flow)
            moved += abs(value)
            if flow.leak:
                leak += value
            elif flow.sign > 0:
                inward += value
            else:
                outward -= value
        change = self.energy(arrays) - self.start(arrays, "ledger_energy")
        scale = max(moved, self.scene.particle_mass * self.scene.material.L)
        return inward, outward, leak, (change - inward + outward - leak) / scale

    @staticmethod
    def mass_out(arrays):
        return sum(pa.constants["mass_vented"][0] for pa in arrays if "mass_vented" in pa.constants)

    @staticmethod
    def mass_in(arrays):
        return sum(pa.constants["mass_refilled"][0] for pa in arrays if "mass_refilled" in pa.constants)

    def _own_columns(self):
        def mass_residual(arrays, scene):
            start = self.start(arrays, "ledger_mass")
            return (self.mass(arrays) + self.mass_out(arrays) - self.mass_in(arrays) - start) / max(
                start, scene.particle_mass)  # a vessel may start empty

        columns = [
            Column("t", "s", "time at the end of the step", lambda arrays, scene: self.time[0]),
            Column("dt", "s", "time step", lambda arrays, scene: self.time[1]),
            Column("mass", "kg", "mass of the domain", lambda arrays, scene: self.mass(arrays)),
            Column("mass_out", "kg", "mass vented since the start", lambda arrays, scene: self.mass_out(arrays)),
            Column("mass_in", "kg", "mass that flowed in since the start", lambda arrays, scene: self.mass_in(arrays)),
            Column("mass_residual", "-", "mass not accounted for, relative to the mass at the start", mass_residual),
        ]
        if self.thermal:
            columns += [
                Column("energy", "J", "enthalpy of the domain, 0 for saturated liquid",
                       lambda arrays, scene: self.energy(arrays)),
                Column("energy_in", "J", "energy in since the start", lambda arrays, scene: self.balanced[0]),
                Column("energy_out", "J", "energy out since the start", lambda arrays, scene: self.balanced[1]),
                Column("energy_model_leak", "J", "energy created by the paper's literal formulas since the start",
                       lambda arrays, scene: self.balanced[2]),
                Column("energy_residual", "-", "energy not accounted for / max(energy moved so far, m_p L)",
                       lambda arrays, scene: self.balanced[3]),
                Column("heat_subcycles", "-", "heat substeps in the last step",
                       lambda arrays, scene: float(self.scheme.integrator.heat_subcycles)),
            ]
            columns += [Column(flow.name, "J", flow.meaning,
                               lambda arrays, scene, flow=flow: self.flow(arrays, flow))
                        for flow in self.flows if not flow.leak]
        return columns

    def row(self, t, dt):
        """One row of the results: a dict column -> value."""
        arrays = self.moment(self.scheme.arrays)
        if self.thermal:
            self.balanced = self.balance(arrays)  # once for the four columns that show a part of it
        self.time = t, dt
        return {name: value(arrays, self.scene) for name, value in self.values}

    def pre_step(self, solver):
        if solver.count % self.every and self.rows and self.rows[-1]["t"] >= solver.t * (1.0 - 1e-12):
            self.rows.pop()  # the last row of the interrupted run, which finish() added off schedule

    def post_step(self, solver):
        self.now = solver.t + solver.dt, solver.dt
        if (solver.count + 1) % self.every == 0:
            self.add(*self.now)

    def finish(self):
        """Add the row of the last step if it is missing, so that the results end where the run does."""
        if self.now and (not self.rows or self.rows[-1]["t"] < self.now[0]):
            self.add(*self.now)

    def add(self, t, dt):
        row = self.row(t, dt)
        self.rows.append(row)
        if row.get("energy_undelivered", 0.0) > 0.0 and not self.warned:
            self.warned = True
            warnings.warn(f"at t = {row['t']:.4g} s no particle was within reach of the heater, so its energy was not "
                          "delivered (column energy_undelivered of the results)", stacklevel=2)

    def described(self):
        """Unit and meaning of each column, for ``run.json``: name -> {"unit": ..., "meaning": ...}."""
        return {column.name: {"unit": column.unit_in(self.scene.dim), "meaning": column.meaning}
                for column in self.columns}

    def table(self):
        """The results so far as columns: name -> array (rows,)."""
        if not self.rows:
            return {column.name: np.zeros(0) for column in self.columns}
        return self.rows.table()

    def save(self):
        """Write the results so far to ``path``."""
        if self.path is not None:
            save_results(self.path, self.table())


class GuestLedger(Ledger):
    """The ledger of a :class:`~pysph_boiling.schemes.guest.BoilingGuest`: the balance of its mass and energy.

    It begins with the first step, and writes its table to ``path`` with each particle file. Parameters are those of
    :class:`Ledger`, with the guest instead of the scheme. Return it from ``create_tools``, after ``guest.tools()``.
    Properties that belong to the other scheme hold no enthalpy, and are not checked.
    """

    def __init__(self, guest: BoilingGuest, every: int = 1, path: str | os.PathLike | None = None):
        super().__init__(guest.scheme, every, path)

    def check(self, arrays):
        """Checks nothing: arrays have the properties of the other scheme, too."""

    def pre_step(self, solver):
        if self.now is None:
            self.begin(self.scheme.arrays)
        super().pre_step(solver)

    def post_step(self, solver):
        super().post_step(solver)
        if (solver.count + 1) % solver.pfreq == 0 or self.now[0] >= solver.tf * (1.0 - 1e-9):
            self.finish()
            self.save()

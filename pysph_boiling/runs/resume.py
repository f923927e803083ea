"""Resuming a run: reading its state from files, and checking which settings have changed since it began.

Parameters that may change are marked (``param(..., may_change=True)``); a change of any other setting is an error.
"""
import dataclasses
import json
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pysph_boiling.files import read_output, run_record, step_of
from pysph_boiling.names import current_name, current_quantity, option
from pysph_boiling.particles import TABLES
from pysph_boiling.results import load_results

__all__ = ["Resumed", "Setting", "scheme_settings", "settings", "with_units"]


class Setting(NamedTuple):
    """A setting of a run: its name in messages, its value and unit, and whether it may change on resuming."""

    flag: str
    value: object
    unit: str = "-"
    may_change: bool = False

    def text(self, value):
        if value is None:
            return "not given"
        return f"{value}{'' if self.unit == '-' else ' ' + self.unit}"


def with_units(instance):
    """The parameters of a scene or an effect in the form of ``run.json``: name -> value and unit."""
    return {spec.name: {"value": getattr(instance, spec.name), "unit": spec.metadata["unit"]}
            for spec in dataclasses.fields(instance) if "unit" in spec.metadata}


def marks(instance):
    """Name of each parameter of a scene or an effect -> whether it may change when a run is resumed."""
    return {spec.name: spec.metadata.get("may_change", False) for spec in dataclasses.fields(instance)}


def scheme_settings(application):
    """The settings of the scheme itself: name -> :class:`Setting`."""
    scheme = application.scheme
    return {"fname": Setting("--fname", application.fname), "dim": Setting("dim", scheme.dim),
            "spacing": Setting("spacing", scheme.spacing, "m"), "hdx": Setting("hdx", scheme.hdx),
            "kernel": Setting("--kernel", type(scheme.kernel).__name__),
            "gravity": Setting("gravity", scheme.gravity, "m/s^2"), "rho0": Setting("rho0", scheme.rho0, "kg/m^3"),
            "material": Setting("--material", getattr(scheme.material, "name", None)),
            "dt": Setting("--timestep", scheme.dt, "s", may_change=True),
            "backend": Setting("backend", application.backend(), may_change=True),
            **{name: Setting(name, value) for name, value in application.settings_of_scene().items()}}


def settings(application):
    """The settings of a run as three dicts name -> :class:`Setting`: of the scene, of the scheme, of the effects."""
    p, scheme = application.parameters, application.scheme
    may = marks(p)
    scene = {name: Setting(option(name), row["value"], row["unit"], may[name])
             for name, row in with_units(p).items()}
    effects = {}
    for slot in scheme.slots:
        effect = scheme.effects.get(slot)
        effects[slot] = Setting(option(slot), "off" if effect is None else type(effect).__name__)
        for name, row in with_units(effect).items() if effect is not None else ():
            effects[f"{slot}.{name}"] = Setting(option(f"{slot}.{name}"), row["value"], row["unit"],
                                                marks(effect)[name])
    return scene, scheme_settings(application), effects


def stored_settings(record, slots, t):
    """The values in ``run.json`` that held at time ``t`` [s], in the order of :func:`settings`."""
    scene = {name: row["value"] for name, row in record["parameters"].items()}
    solver = dict(record)
    effects = dict.fromkeys(slots, "off")
    for slot, row in record["effects"].items():
        effects[slot] = row["class"]
        effects.update((f"{slot}.{name}", one["value"]) for name, one in row.items() if name != "class")
    for change in reversed(record.get("changes", ())):
        for stored in (scene, solver, effects):
            if change["t"] > t and change["parameter"] in stored:
                stored[change["parameter"]] = change["before"]
    return scene, solver, effects


def compare(application, record, t):
    """The settings that have changed since ``run.json`` was written, as rows for its entry ``changes``.

    Errors: ``ValueError`` that names the settings that must not change, with both values. If parameters of the scene
    have changed, settings of the scheme and of effects, which follow from them, are not listed.
    """
    changes, scene = [], application.scene_name()
    if record["scene"] != scene:
        raise ValueError(f"a run of {record['scene']} cannot be resumed as {scene}")
    refuse(other_constants(application, record), record)
    for prefix, now, before in zip(("scene.", "", ""), settings(application),
                                   stored_settings(record, application.scheme.slots, t)):
        before = {name if name in now else current_name(prefix + name).removeprefix(prefix): value
                  for name, value in before.items()}
        refused = []
        for name, setting in now.items():
            value = json.loads(json.dumps(setting.value, default=str))
            if name not in before or before[name] == value:
                continue
            if setting.may_change:
                changes.append({"t": t, "parameter": name, "before": before[name], "after": value,
                                "unit": setting.unit})
            else:
                refused.append(f"{setting.flag} (it was {setting.text(before[name])} and would become "
                               f"{setting.text(value)})")
        refuse(refused, record)
    return changes


def refuse(refused, record):
    """Raise ``ValueError`` if there are settings that must not change."""
    if refused:
        raise ValueError(f"a run cannot be resumed with another {', '.join(refused)}. It was started with: "
                         f"{' '.join(record['arguments'])}")


def other_constants(application, record):
    """The fluid of a run if it is called otherwise now, and else the constants of it that have other values.

    Parameters of the scene follow from its fluid, so this comes first.
    """
    name = scheme_settings(application)["material"]
    if record.get("material", name.value) != name.value:
        return [f"{name.flag} (it was {record['material']} and would become {name.text(name.value)})"]
    now, before = application.scheme.material, record.get("constants", {})
    return [f"{constant} of {name.value} (it was {row['value']} {row['unit']} and would become "
            f"{getattr(now, constant)} {row['unit']})"
            for constant, row in before.items() if getattr(now, constant, None) != row["value"]]


def use_new_names(pa):
    """Give an array of a particle file the properties and constants that had other names in earlier versions."""
    for old in [name for name in pa.properties if current_quantity(name) != name]:
        pa.add_property(current_quantity(old), data=pa.get(old, only_real_particles=False))
        pa.add_output_arrays([current_quantity(old)])
    for old in [name for name in pa.constants if current_quantity(name) != name]:
        pa.add_constant(current_quantity(old), pa.constants.pop(old).get_npy_array())


class Resumed:
    """The state of an interrupted run, read from one of its particle files, its results and its ``run.json``.

    The values are written to arrays of a new start, so that the compiled code is the same as at the first start.
    ``changes`` lists all changes of parameters: dicts with ``t`` [s], ``parameter``, ``before``, ``after``, ``unit``.

    Errors: ``ValueError`` if the file does not belong to this scene with these effects, or if a setting has changed
    that must not change.
    """

    def __init__(self, file, application, arrays):
        self.folder = Path(file).parent
        self.record = run_record(self.folder)
        found, solver_data = read_output(file, application.share_of if application.num_procs > 1 else None)
        self.t, self.count = float(solver_data["t"]), int(solver_data["count"])
        try:
            new = compare(application, self.record, self.t)
        except (AttributeError, KeyError, TypeError) as error:
            raise ValueError(f"a run cannot be resumed from {file}: the run.json in its folder, which says how it was "
                             f"made, is {'not of pysph_boiling' if self.record else 'missing'}") from error
        self.new = [change for change in new if change["parameter"] not in ("dt", "backend")]
        self.changes = [*(one for one in self.record.get("changes", ()) if one["t"] <= self.t), *new]
        given = {name for effect in application.scheme.effects.values() for name in effect.parameter_constants}
        self.constants = {}
        for pa in arrays:
            stored = found.get(pa.name)
            if stored is not None:
                use_new_names(stored)
            lacks = ["all properties"] if stored is None else [
                *sorted(set(pa.output_property_arrays) - set(stored.output_property_arrays)),
                *sorted(set(pa.constants) - set(stored.constants) - set(TABLES))]
            if lacks:
                raise ValueError(f"{file} does not fit this scene with these effects: it lacks {', '.join(lacks)} of "
                                 f"array '{pa.name}'"
                                 + "".join(f"; {one['parameter']} has changed" for one in self.new))
            self.fill(pa, stored, given)

    def fill(self, pa, stored, given):
        """Copy particles, properties and constants from the file; constants in ``given`` keep their present values."""
        n, now = stored.get_number_of_particles(), pa.get_number_of_particles()
        if n < now:
            pa.remove_particles(np.arange(n, now))
        elif n > now:
            pa.extend(n - now)
            pa.align_particles()
        for name in pa.output_property_arrays:
            pa.get(name, only_real_particles=False)[:] = stored.get(name, only_real_particles=False)
        for name in set(pa.constants) - given:
            pa.constants[name].get_npy_array()[:] = stored.constants[name].get_npy_array()
        self.constants[pa.name] = {name: stored.constants[name].get_npy_array().copy() for name in
                                   set(stored.constants) - set(pa.constants)}

    def apply(self, solver, ledger, tools):
        """Set the time, and restore what the ledger and the tools had collected."""
        from pysph_boiling.schemes.bubbles import Departures
        from pysph_boiling.schemes.effects.venting import VentingTool

        solver.t, solver.count = self.t, self.count
        for pa in solver.particles:
            for name, values in self.constants[pa.name].items():
                pa.add_constant(name, values)
        early = self.t * (1.0 + 1e-12)
        if (self.folder / "results.npz").exists():
            table = load_results(self.folder)
            ledger.resume({current_quantity(name): values for name, values in table.items()}, early)
        for tool in tools:
            name = {Departures: "departures", VentingTool: "vents"}.get(type(tool))
            if name:
                tool.events = [tuple(event) for event in self.record.get(name, ()) if event[0] <= early]

    def later(self, name):
        """Whether a file of the run's folder belongs to a later step, or is a picture, which may show later steps."""
        return step_of(name) > self.count or name.endswith((".png", ".gif", ".mp4", ".vtu", ".pvd"))

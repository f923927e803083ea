"""Runs one version of the package for boil.py: takes steps of ``steady_boiling`` on request, and times them.

    python boil_worker.py ROOT HDX STATE FOLDER [options of the scene]

``ROOT`` is the folder from which the package is imported, and ``STATE`` a file of :meth:`Boil.state_now` or "-".
Requests are lines of JSON on the standard input; each is answered by one line on the standard output. Output of the
package goes to the error output. This file must work with every version since 1aae54e, and may only use what they have.
"""
import dataclasses
import json
import os
import sys
from pathlib import Path
from time import perf_counter

import numpy as np
from pysph.solver.tools import Tool

import pysph_boiling
from pysph_boiling.examples.steady_boiling import SteadyBoiling
from pysph_boiling.materials import WATER_1ATM

EVERY_VERSION_ITS_OWN = {"h", "tag", "pid", "gid"}  # properties: of the scheme and of PySPH, not of the boiling water


class Boil(SteadyBoiling):
    """Steady boiling at a given h/dx, from a given state, in steps that are taken on request."""

    hdx = state = answers = None

    def consume_user_options(self):
        """Sites are alike and in rows, as they are in every version."""
        super().consume_user_options()
        known = {field.name for field in dataclasses.fields(self.Parameters)}
        alike = dict(pattern="regular", smallest_cavity=0.0)
        if getattr(self.options, "scene.sites") is None:
            alike["sites"] = 9
        self.parameters = dataclasses.replace(
            self.parameters, **{name: value for name, value in alike.items() if name in known})

    def make_scheme(self, p):
        scheme = super().make_scheme(p)
        scheme.hdx = self.hdx
        slot = "cohesion" if "cohesion" in scheme.effects else "tension"  # as older versions call it
        cohesion, support = scheme.effects[slot], scheme.kernel.radius_scale * self.hdx  # it may reach no further
        scheme.effects[slot] = dataclasses.replace(cohesion, radius=min(cohesion.radius, support))
        return scheme

    def start(self, arrays, p, scheme):
        super().start(arrays, p, scheme)
        if self.state is not None:
            fill(arrays["fluid"], self.state)

    def create_tools(self):
        if self.state is not None:
            self.solver.t, self.solver.count = float(self.state["t"]), int(self.state["count"])
        self.pfreq, self.solver.pfreq = self.solver.pfreq, sys.maxsize  # particle files are timed apart
        return [Requests(self), *super().create_tools()]

    def state_now(self):
        """The boiling water: its properties, constants and material, the clock, and bubbles that left the base."""
        fluid = self.scheme.arrays[0]
        return dict(
            {f"property {name}": fluid.get(name) for name in fluid.output_property_arrays
             if name not in EVERY_VERSION_ITS_OWN},
            **{f"constant {name}": values.get_npy_array() for name, values in fluid.constants.items()},
            **{f"water {field.name}": getattr(WATER_1ATM, field.name) for field in dataclasses.fields(WATER_1ATM)
               if isinstance(getattr(WATER_1ATM, field.name), float)},
            spacing=self.scheme.spacing, t=self.solver.t, count=self.solver.count, departures=len(self.departures))


def fill(pa, state):
    """Give an array the particles of a state: all properties and constants that both have with equal lengths."""
    n, now = len(state["property x"]), pa.get_number_of_particles()
    if n < now:
        pa.remove_particles(np.arange(n, now))
    elif n > now:
        pa.extend(n - now)
        pa.align_particles()
    for key in state:
        kind, _, name = key.partition(" ")
        if kind == "property" and name in pa.properties:
            pa.get(name, only_real_particles=False)[:] = state[key]
        elif kind == "constant" and name in pa.constants and pa.constants[name].length == len(state[key]):
            pa.constants[name].get_npy_array()[:] = state[key]


def take_water(state):
    """Give water the constants that it has in the state: versions differ in the third digit of some."""
    for key, value in state.items():
        kind, _, name = key.partition(" ")
        if kind == "water" and hasattr(WATER_1ATM, name):
            object.__setattr__(WATER_1ATM, name, float(value))


class Requests(Tool):
    """First of the tools: between two steps it answers, and waits for what is asked next.

    A step lasts from the moment that this tool lets go to the moment that it is called again: tools, ledger and all.
    """

    def __init__(self, application):
        self.application, self.left, self.steps, self.began = application, 0, None, None

    def stages(self):
        return dict(self.application.scheme.integrator.wall_time)  # name -> s since the start

    def pre_step(self, solver):
        now = perf_counter()
        if self.steps is not None:
            before, stages = self.began[1], self.stages()
            self.steps.append(dict(
                {name: 1e3 * (seconds - before[name]) for name, seconds in stages.items()},
                whole=1e3 * (now - self.began[0]), sweeps=float(self.application.scheme.arrays[0].sweeps[1])))
            self.left -= 1
        while not self.left:
            self.answer(solver)
        self.began = perf_counter(), self.stages()

    def answer(self, solver):
        """The next request: {"steps": n} takes n of them, {"files": n} writes a particle file so often, {"state": path}
        writes the state; without one the run is over."""
        if self.steps is not None:
            self.tell(self.steps)
            self.steps = None
        request = json.loads(sys.stdin.readline() or "{}")
        if not request:
            raise SystemExit
        if "steps" in request:
            self.left, self.steps = request["steps"], []
        elif "files" in request:
            self.tell(dict(ms=[self.file(solver) for _ in range(request["files"])], every=self.application.pfreq))
        else:
            state = self.application.state_now()
            np.savez(request["state"], **state)
            self.tell(None)

    def file(self, solver):
        """Milliseconds that a particle file takes, with what is written beside it."""
        begin = perf_counter()
        solver.dump_output()
        return 1e3 * (perf_counter() - begin)

    def tell(self, answer):
        self.application.answers.write(json.dumps(answer) + "\n")
        self.application.answers.flush()


def main(root, hdx, state, folder, *arguments):
    found = Path(pysph_boiling.__file__).parents[1]
    if found != Path(root):
        raise RuntimeError(f"pysph_boiling came from {found}, not from {root}")
    Boil.answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    Boil.hdx = float(hdx)
    if state != "-":
        with np.load(state) as data:
            Boil.state = dict(data)
        take_water(Boil.state)
    backend = () if "--opencl" in arguments else ("--openmp",)
    Boil(output_dir=folder).run([*backend, "--no-pictures", "--duration", "1e3", "-d", folder, *arguments])


if __name__ == "__main__":
    main(*sys.argv[1:])

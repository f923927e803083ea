"""Whole scenes on OpenCL make the events that Cython makes, in double and in single precision, and fetch little for it.

The equations themselves run on every backend by the tests beside this one: ``make parity``. Runs here are processes of
their own, since PySPH is configured once for a process.
"""
import json
import os
import subprocess
import sys

import numpy as np
import pytest
from pysph.solver.utils import load

from pysph_boiling.examples import scenes

BACKENDS = {"openmp": ("--openmp",), "double": ("--opencl", "--use-double"), "single": ("--opencl",)}
POOL = ("--flat", "--fill", "10", "--subcooling", "80", "--no-pictures", "--results-every", "5")
SCENES = {  # of explosive_boiling, in one set of compiled stages: options, steps
    "burst": ((*POOL, "--width", "40", "--hot", "0.7", "--superheat", "220", "--time-scaling", "8000"), 60),
    # measured: 6 particles condense, from step 75 on, and 9 leave
    "cooling": ((*POOL, "--width", "48", "--hot", "0.4", "--superheat", "240", "--time-scaling", "16000"), 200),
}
STEADY = ("--flat", "--width", "40", "--fill", "20", "--subcooling", "0", "--superheat", "200", "--time-scaling",
          "20000", "--smallest-cavity", "0", "--pattern", "regular", "--no-pictures", "--results-every", "10")
EVENTS = ("n_nucleated", "n_burst", "n_fired", "n_condensed", "n_vented", "n_bubbles", "n_vapour")
LEDGER = {"openmp": 1e-10, "double": 1e-10, "single": 1e-4}  # measured 3e-14 and 4e-6


def run(scene, folder, steps, *options):
    """A run of a scene in another process; its folder."""
    subprocess.run(
        [sys.executable, "-m", "pysph_boiling", "run", scene, "--max-steps", str(steps), "-d", str(folder), *options],
        check=True, capture_output=True, env={"PYOPENCL_CTX": "0", **os.environ})
    return folder


def by_uid(file, *names):
    """Properties of the fluid in a particle file, in the order of the uids."""
    fluid = load(str(file))["arrays"]["fluid"]
    return np.stack([fluid.get(name)[np.argsort(fluid.uid)] for name in names])


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Results tables of the scenes on a backend, each run once."""
    made = {}

    def table(scene, backend):
        if (scene, backend) not in made:
            options, steps = SCENES[scene]
            folder = run("explosive_boiling", tmp_path_factory.mktemp(f"{scene}_{backend}"), steps, *options,
                         *BACKENDS[backend])
            made[scene, backend] = dict(np.load(folder / "results.npz"))
        return made[scene, backend]

    return table


def test_motion_agrees_with_cython(tmp_path):
    options = ("--spacing", "0.05", "--no-pictures")
    host = run("dam_break", tmp_path / "host", 10, *options, "--no-openmp")
    device = run("dam_break", tmp_path / "device", 10, *options, *BACKENDS["double"])
    want, got = (by_uid(folder / "dam_break_00010.hdf5", "x", "y", "u", "v") for folder in (host, device))
    assert np.max(np.abs(want[2:])) > 0.1, "nothing moved"
    # round-off in another order of summation, grown over ten steps; measured 1e-14
    np.testing.assert_allclose(got, want, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("backend", ["double", "single"])
@pytest.mark.parametrize("scene", SCENES)
def test_scene_makes_the_same_events(results, scene, backend):
    host, device = results(scene, "openmp"), results(scene, backend)
    agreed = {"double": len(host["t"]), "single": 4}[backend]  # rows of five steps
    for name in EVENTS:
        np.testing.assert_array_equal(device[name][:agreed], host[name][:agreed], err_msg=name)
    for name in ("T_mean", "density_error_mean"):  # beyond that, statistics: measured to 1 %
        np.testing.assert_allclose(np.mean(device[name]), np.mean(host[name]), rtol=0.05, err_msg=name)
    assert np.max(np.abs(device["energy_residual"])) <= LEDGER[backend]
    assert np.all(device["mass_residual"] == 0.0)


def test_the_runs_that_are_compared_hold_every_kind_of_event(results):
    burst, cooling = (results(scene, "openmp") for scene in SCENES)
    assert burst["n_nucleated"][-1] >= 20 and burst["n_burst"][-1] >= 1
    assert cooling["n_condensed"][-1] >= 1 and cooling["n_vented"][-1] >= 1
    left = np.diff(burst["n_vented"] + burst["n_condensed"]) > 0
    assert np.any((np.diff(burst["n_bubbles"]) < 0) & ~left), "no bubbles merged"


@pytest.mark.slow
@pytest.mark.parametrize("name", scenes())
@pytest.mark.parametrize("backend", ["double", "single"])
def test_every_scene_takes_its_first_steps(tmp_path, name, backend):
    options = {"dam_break": ("--spacing", "0.05"), "heated_slab": (), "heat_wave_tvf": (), "heat_wave": (),
               "vessel": ("--demo",)}
    folders = [run(name, tmp_path / which, 5, *options.get(name, ("--flat",)), *BACKENDS[which])
               for which in ("openmp", backend)]
    host, device = (load(str(folder / f"{name}_00005.hdf5"))["arrays"]["fluid"] for folder in folders)
    size = max(np.ptp(host.x), np.ptp(host.y))
    moved = 0.0 if name == "heated_slab" else 1e-12
    assert np.max(np.hypot(host.u, host.v)) >= moved, "nothing moved"
    for axis in "xy":  # of the real particles: PySPH's own schemes write the ghosts too; measured 1e-15 and 1.1e-6
        want, got = (np.sort(pa.get(axis)[pa.tag == 0]) for pa in (host, device))
        np.testing.assert_allclose(got, want, rtol=0.0, atol={"double": 1e-12, "single": 1e-5}[backend] * size)


ENDLESS = """
import sys
from pysph.base.nnps import DomainManager
from pysph_boiling.cli import report
from pysph_boiling.examples import scene_class

class Endless(scene_class("dam_break")):
    def create_domain(self):
        return DomainManager(xmin=-1.0, xmax=9.0, periodic_in_x=True)

try:
    Endless().run(sys.argv[1:])
except Exception as error:
    sys.exit(report(error))
"""


def test_a_device_refuses_a_periodic_domain_in_motion(tmp_path):
    options = "--spacing", "0.05", "--max-steps", "1", "--no-pictures", "-d", str(tmp_path)
    done = subprocess.run([sys.executable, "-c", ENDLESS, *options, *BACKENDS["double"]], check=False,
                          capture_output=True, text=True, env={"PYOPENCL_CTX": "0", **os.environ})
    assert done.returncode != 0 and not list(tmp_path.glob("*.hdf5"))
    assert "on a device a periodic domain only works for conduction at rest" in " ".join(done.stderr.split())


COUNT = """
import json, sys
import numpy as np
import pyopencl.array
from pysph_boiling.examples import scene_class
from pysph_boiling.schemes.integrator import PBFIntegrator

fetched, sent, steps = [], [], []
get, put, step = pyopencl.array.Array.get, pyopencl.array.Array.set, PBFIntegrator.step

def counting(self, *args, **kwargs):
    fetched.append(self.nbytes)
    return get(self, *args, **kwargs)

def counting_sent(self, array, *args, **kwargs):
    sent.append(array.nbytes)
    return put(self, array, *args, **kwargs)

def counted(self, time, dt):
    fetched.clear(), sent.clear()
    step(self, time, dt)
    own, given = list(fetched), list(sent)  # of the step itself; tools come after it
    phase, joined = (get(self.arrays[0].gpu.get_device_array(name).dev) for name in ("phase", "joined"))
    vapour = int(np.sum(phase == 3))
    members = int(np.sum(joined < 4294967295)) if vapour else 0  # without a bubble nothing has joined one yet
    steps.append(dict(n=len(phase), vapour=vapour, members=members,
                      reads=len(own), total=sum(own), largest=max(own), writes=len(given), given=max(given)))

pyopencl.array.Array.get, pyopencl.array.Array.set, PBFIntegrator.step = counting, counting_sent, counted
scene_class(sys.argv[1])().run(sys.argv[2:])
print(json.dumps(steps))
"""


def counted(scene, folder, steps, *options):
    """What each step of a run fetched and sent, as a list of dicts; the first, which settles the start, is left out."""
    done = subprocess.run([sys.executable, "-c", COUNT, scene, *options, "--max-steps", str(steps), "-d", str(folder)],
                          check=True, capture_output=True, text=True, env={"PYOPENCL_CTX": "0", **os.environ})
    return json.loads(done.stdout.splitlines()[-1])[1:]


def assert_no_whole_property(steps, size):
    """No step fetches or sends more than the vapour and what belongs to it, in numbers of ``size`` bytes."""
    for step in steps:
        some = step["vapour"] + step["members"]  # at the end of the step, when members may have become vapour
        assert max(step["largest"], step["given"]) <= max(size * some, 64) < size * step["n"]
        assert step["total"] <= 16 * step["reads"] + 200 * some
        assert step["reads"] <= 90 and step["writes"] <= 90


def test_a_step_fetches_numbers_and_the_vapour_and_no_more(tmp_path):
    options, _ = SCENES["burst"]
    steps = counted("explosive_boiling", tmp_path, 8, *options, *BACKENDS["double"], "--disable-output")
    assert min(step["vapour"] for step in steps) > 20 and max(step["members"] for step in steps) > 20
    assert_no_whole_property(steps, 8)


def test_steady_boiling_in_single_precision_copies_no_property_and_closes_its_ledger(tmp_path):
    steps = counted("steady_boiling", tmp_path, 80, *STEADY, *BACKENDS["single"])
    results = dict(np.load(tmp_path / "results.npz"))
    assert results["n_nucleated"][-1] >= 10 and results["n_vapour"][-1] >= 10
    assert_no_whole_property(steps, 4)
    assert np.max(np.abs(results["energy_residual"])) <= LEDGER["single"]
    assert np.all(results["mass_residual"] == 0.0)

"""Lean equations against those whose place they take: the same, to the order of a sum, on random particles.

Two schemes, one of them without lean equations, run a stage on the same particles. All properties that a sum may read
are random, some particles lie at one place, some outside the container, and some have hundreds of neighbours.
"""
import numpy as np
import pytest
from harness import Stepper, host_only, native_only, random_cloud
from pysph.base.kernels import WendlandQuintic
from pysph.base.nnps import LinkedListNNPS
from sets import scheme

from pysph_boiling import native
from pysph_boiling.equations.lean import HostSum, LeanSum
from pysph_boiling.particles import WALL_PROPERTIES, add_properties, fluid_array
from pysph_boiling.rooms import Room, ball
from pysph_boiling.schemes.effects import (
    BoxContainer,
    CylinderContainer,
    DensityConstraint,
    DistanceContainer,
    XSPHViscosity,
)
from pysph_boiling.search.sorted_cells import EmbeddedModule

pytestmark = [host_only, native_only]

ROUND_OFF = 1e-12  # sums of up to 300 terms, in another order
RHO0, N_FLUID, N_WALL, N_CROWD = 958.0, 400, 120, 150
PRIOR = (0.8, 0.7, 0.5)  # as in a short step: shares of the error, of what the velocity feels, and of the bounds
INSIDE = ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
STATE = ("m", "h", "x", "y", "z", "uid", "gid", "pid", "tag", "bubble", "parent", "grandparent")  # not drawn at random
WITHIN = ("gcx", "gcy", "gcz", "gc2", "dpx", "dpy", "dpz", "pull_x", "pull_y", "pull_z")  # kept between two groups
ACCELERATED = DensityConstraint(chebyshev_radius=0.9, max_sweeps=4, tolerance=1e-6)
CASES = {
    "boil 2-D": ("boil", 2, dict(density=DensityConstraint(max_sweeps=4, tolerance=1e-6)), {}),
    "boil 3-D": ("boil", 3, dict(density=DensityConstraint(max_sweeps=4, tolerance=1e-6)), {}),
    "Wendland's kernel": ("motion", 3, {}, dict(kernel=WendlandQuintic(dim=3))),
    "accelerated sweeps": ("motion", 3, dict(density=ACCELERATED), {}),
    "artificial pressure, multipliers of walls": ("pressed", 2, {}, {}),
    "the same, Wendland's kernel": ("pressed", 3, {}, dict(kernel=WendlandQuintic(dim=3))),
    "swollen 2-D": ("expand", 2, {}, {}),
    "swollen 3-D": ("expand", 3, {}, {}),
    "nothing is swollen": ("expand", 3, {}, {}),
    "swollen, Wendland's kernel": ("expand", 3, {}, dict(kernel=WendlandQuintic(dim=3))),
    "cylinder": ("cylinder", 3, dict(container=CylinderContainer(
        centre=(0.5, 0.5), radius=0.45, bottom=0.0, top=1.0)), {}),
    # ten sweeps at most: in forty of this crowd in 2-D round-off grows to 1e-5
    "room 2-D": ("room", 2, dict(density=DensityConstraint(max_sweeps=1, min_sweeps=1, tolerance=1e-6)), {}),
    "room 3-D": ("room", 3, dict(container=DistanceContainer(room=Room.of(ball((0.5,) * 3, 0.45), spacing=0.1))), {}),
}
STAGES = {"boil": ("heat", "density", "forces"), "motion": ("density", "forces"), "pressed": ("density", "forces"),
          "cylinder": ("density",), "room": ("density",), "expand": ("density", "forces")}


def vessel(case, lean):
    """The scheme of a case on random particles, ready to run its stages."""
    name, dim, changes, options = CASES[case]
    changes = dict(changes)
    spacing = N_FLUID ** (-1.0 / dim)
    points = random_cloud(N_FLUID + N_CROWD, dim, seed=1)
    points[-N_CROWD:, :dim] = 0.5 + spacing * (points[-N_CROWD:, :dim] - 0.5)
    points[1:6:2] = points[0:5:2]  # pairs at one place
    points[6:12, :dim] += 0.7  # outside
    fluid = fluid_array(points, spacing=spacing, dim=dim, rho0=RHO0)
    wall = fluid_array(random_cloud(N_WALL, dim, seed=2) - [0.5, 0.0, 0.0], spacing=spacing, dim=dim, rho0=RHO0,
                       name="wall")
    sites = fluid_array(random_cloud(3, dim, seed=4), spacing=spacing, dim=dim, rho0=RHO0, name="sites")
    if name not in ("cylinder", "room"):
        changes = changes | dict(container=BoxContainer(lower=INSIDE[0], upper=INSIDE[1]),
                                 viscosity=XSPHViscosity(wall=1.0 if name == "motion" else 0.0))
    density = changes.pop("density", DensityConstraint(max_sweeps=4, tolerance=1e-6))
    made = scheme(name, dim=dim, spacing=spacing, changes=changes, density=density, lean=lean, **options)
    arrays = [fluid, wall, *([sites] if name in ("boil", "expand") else [])]
    random = np.random.default_rng(3)
    wall.m *= random.uniform(0.5, 2.0, N_WALL)
    add_properties(wall, WALL_PROPERTIES)
    wall.heated[:] = random.integers(0, 2, N_WALL)
    wall.T_heater[:] = 400.0 * random.integers(0, 2, N_WALL)
    made.setup_properties(arrays)
    for prop, array in fluid.properties.items():
        if prop not in STATE:
            values, n = array.get_npy_array(), fluid.get_number_of_particles()
            values[:] = random.uniform(0.5, 1.5, n) if values.dtype.kind == "f" else random.integers(0, 4, n)
    for prop in {"pulled_x", "pulled_y", "pulled_z"} & set(fluid.properties):
        fluid.get(prop)[20:] *= 1e-3  # what cohesion moves in a step; the first ones run into the limit
    if name == "expand":
        fluid.swell[:] = 1.0
        if case == "nothing is swollen":
            fluid.swelling[:] = 0.0
        else:
            fluid.swell[::2] = random.uniform(1.0, 1.5, len(fluid.x[::2]))
    for prop in ("u", "v", "w"):
        fluid.get(prop)[:] = random.normal(size=len(fluid.x))
    return Stepper(made, arrays, dt=1e-3)


def after(stepper, stage):
    """Fluid and constants after one run of a stage from the state in which the stepper was made: name -> values."""
    fluid = stepper.arrays["fluid"]
    begin = {name: fluid.get(name).copy() for name in fluid.properties}
    constants = {name: values.get_npy_array().copy() for name, values in fluid.constants.items()}
    if stage == "density":
        stepper.solver.integrator.density(1e-3)
        stepper.solver.integrator.c_integrator.dt = 0.01  # s; cohesion moves by some tenths of a spacing
        fluid.prior[:] = PRIOR
    stepper.run_stage(stage)
    found = {name: fluid.get(name).copy() for name in begin if name not in WITHIN}
    found |= {f"constant {name}": fluid.constants[name].get_npy_array().copy() for name in constants}
    for name, values in begin.items():
        fluid.get(name)[:] = values
    for name, values in constants.items():
        fluid.constants[name].get_npy_array()[:] = values
    return begin, found


@pytest.fixture(scope="module", params=CASES)
def both(request):
    """The name of a set, and its vessel with general equations and with lean ones."""
    return CASES[request.param][0], *(vessel(request.param, lean) for lean in (False, True))


def compare(begin, general, lean, scale=ROUND_OFF):
    changed = [name for name in begin if name in general and np.any(general[name] != begin[name])]
    assert changed
    for name in general:
        if name == "contacts":  # who was put on a round wall is beyond it by round-off, or not
            assert np.mean(lean[name] != general[name]) < 0.05
            continue
        size = np.max(np.abs(general[name] - begin.get(name, 0.0)), initial=0.0, where=np.isfinite(general[name]))
        np.testing.assert_allclose(lean[name], general[name], rtol=0.0, atol=scale * size, err_msg=name)
    return changed


@pytest.mark.parametrize("stage", ["heat", "density", "forces"])
def test_lean_equations_are_the_general_ones(both, stage):
    name, general, lean = both
    if stage not in STAGES[name]:
        return
    begin, expected = after(general, stage)
    _, found = after(lean, stage)
    changed = compare(begin, expected, found)
    wanted = {"heat": {"ae"}, "density": {"x", "sx", "rho", "lmbda", "compression", "limited"}, "forces": {"au", "aw"}}
    assert wanted[stage] - ({"aw"} if general.scheme.dim == 2 else set()) <= set(changed)
    if stage == "density":
        assert (name in ("boil", "expand")) == ("pulled_x" in changed)
        assert expected["constant sweeps"][0] >= 4 and np.any(expected["lmbda"] == 0.0)
        assert np.any(found["contacts"] != begin["contacts"])


@pytest.mark.parametrize("case", ["boil 3-D", "swollen 3-D"])
def test_processors_without_avx512_compute_the_same(case, monkeypatch):
    """The sums of four neighbours at a time, also where the processor could take eight."""
    monkeypatch.setattr(native, "processor_features", lambda: native.AVX2_NEEDS)
    monkeypatch.setattr(EmbeddedModule, "modules", {})
    assert "-mavx512f" not in native.FluidModule.flags()
    general, lean = (vessel(case, lean) for lean in (False, True))
    for stage in STAGES[CASES[case][0]]:
        begin, expected = after(general, stage)
        compare(begin, expected, after(lean, stage)[1])


def test_what_is_compared_is_lean(both):
    def built(stepper):
        return {type(e) for stage in stepper.equations.groups for parent in stage for group in parent.equations
                for e in group.equations}

    _, general, lean = both
    assert not any(issubclass(cls, (HostSum, LeanSum)) for cls in built(general))
    assert any(issubclass(cls, HostSum) for cls in built(lean))


def test_lists_of_another_search_serve(both):
    """PySPH's linked list keeps lists of its own, in another order."""
    _, _, lean = both
    _, expected = after(lean, "density")
    integrator, arrays = lean.solver.integrator, list(lean.arrays.values())
    ours = integrator.nnps
    theirs = LinkedListNNPS(dim=lean.scheme.dim, particles=arrays, radius_scale=lean.scheme.kernel.radius_scale,
                            cache=True)
    assert not hasattr(theirs, "lists")
    try:
        integrator.nnps = theirs
        begin, found = after(lean, "density")
    finally:
        integrator.nnps = ours
    compare(begin, expected, found)

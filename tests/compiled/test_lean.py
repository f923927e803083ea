"""Lean sums against the equations whose place they take: the same, to the order of a sum, on random particles.

Both stand in one compiled module; a group runs when its name is asked for. All properties that a sum may read are
random, some particles lie at one place, and one has more neighbours than a lean sum fetches at once.
"""
from copy import copy

import numpy as np
import pytest
from harness import Evaluator, host_only, random_cloud
from pysph.sph.equation import Group
from sets import scheme

from pysph_boiling.equations.lean import LEAN
from pysph_boiling.particles import WALL_PROPERTIES, add_properties, fluid_array
from pysph_boiling.schemes.effects import XSPHViscosity

pytestmark = host_only

ROUND_OFF = 1e-12  # sums of up to 300 terms, in another order
RHO0, N_FLUID, N_WALL, N_CROWD = 958.0, 400, 80, 150
STATE = ("m", "h", "x", "y", "z", "uid", "gid", "pid", "tag")  # not drawn at random


class Both:
    """Each general equation and its lean sum, as groups of one module."""

    def __init__(self, dim):
        spacing = N_FLUID ** (-1.0 / dim)
        points = random_cloud(N_FLUID + N_CROWD, dim, seed=1)
        points[-N_CROWD:, :dim] = 0.5 + spacing * (points[-N_CROWD:, :dim] - 0.5)
        points[1:6:2] = points[0:5:2]  # pairs at one place
        fluid = fluid_array(points, spacing=spacing, dim=dim, rho0=RHO0)
        wall = fluid_array(random_cloud(N_WALL, dim, seed=2) - [0.5, 0.0, 0.0], spacing=spacing, dim=dim, rho0=RHO0,
                           name="wall")
        random = np.random.default_rng(3)
        wall.m *= random.uniform(0.5, 2.0, N_WALL)
        self.scheme = scheme("boil", dim=dim, spacing=spacing, changes=dict(viscosity=XSPHViscosity(wall=1.0)))
        add_properties(wall, WALL_PROPERTIES)
        wall.heated[:] = random.integers(0, 2, N_WALL)
        wall.T_heater[:] = 400.0 * random.integers(0, 2, N_WALL)
        add_properties(fluid, self.scheme.effect_rows("properties"))
        constants = {}
        for effect in self.scheme.effects.values():
            constants.update(effect.constants(self.scheme.scene()))
        for name, value in constants.items():
            fluid.add_constant(name, value)
        self.fluid, self.arrays, self.wanted = fluid, [fluid, wall], None
        self.shuffle(random)
        general = {type(term.equation): term.equation for term in self.scheme.terms()}
        groups = []
        for cls in LEAN:
            for name, equation in ((f"{cls.__name__}_general", copy(general[cls])),
                                   (f"{cls.__name__}_lean", LEAN[cls](general[cls], self.scheme.kernel))):
                groups.append(Group([equation], name=name, condition=lambda t, dt, name=name: name == self.wanted))
        self.evaluator = Evaluator(self.arrays, groups, dim=dim)

    def shuffle(self, random):
        """Give every property of the fluid random values of its kind, and keep them."""
        n = self.fluid.get_number_of_particles()
        for name, array in self.fluid.properties.items():
            if name not in STATE:
                values = array.get_npy_array()
                values[:] = random.uniform(0.5, 1.5, n) if values.dtype.kind == "f" else random.integers(0, 4, n)
        self.fluid.lmbda[::3] = 0.0
        for name in ("u", "v", "w"):
            self.fluid.get(name)[:] = random.normal(size=n)
        self.fluid.heat_dt[0] = self.fluid.heater_on[0] = 1.0
        self.kept = {name: array.get_npy_array().copy() for name, array in self.fluid.properties.items()}

    def run(self, cls, form):
        """All properties of the fluid after one evaluation from the kept state."""
        for name, values in self.kept.items():
            self.fluid.get(name)[:] = values
        self.wanted = f"{cls.__name__}_{form}"
        self.evaluator.run()
        return {name: self.fluid.get(name).copy() for name in self.kept}


@pytest.fixture(scope="module", params=[2, 3], ids=["2-D", "3-D"])
def both(request):
    return Both(request.param)


@pytest.mark.parametrize("cls", LEAN, ids=lambda cls: cls.__name__)
def test_a_lean_sum_is_the_general_equation(both, cls):
    general, lean = both.run(cls, "general"), both.run(cls, "lean")
    changed = [name for name in general if np.any(general[name] != both.kept[name])]
    assert changed
    for name in general:
        scale = np.max(np.abs(general[name] - both.kept[name]), initial=0.0)
        np.testing.assert_allclose(lean[name], general[name], rtol=0.0, atol=ROUND_OFF * scale, err_msg=name)

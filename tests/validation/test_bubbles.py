"""Bubbles in still water (2-D): they merge into one, and are torn apart by shear. How they rise: ``bubble_rise``."""
from types import SimpleNamespace

import numpy as np
import pytest
import sets
from harness import Stepper

from pysph_boiling.evaluation.problems.bubble_at_rest import BubbleAtRest
from pysph_boiling.evaluation.problems.capillary import length
from pysph_boiling.particles import box_vessel, fluid_block, positions, site_array
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.bubbles import equivalent_radius, mean_radius
from pysph_boiling.schemes.effects import BoxContainer, Buoyancy, HeatConduction, Heater, Venting
from pysph_boiling.schemes.vapour import Vapour

DX = 0.004


def pool(width, fill, centres, radius=3.2):
    """A pool at rest (sizes in spacings) in which disks at ``centres`` are turned into vapour; heat stands still."""
    size = (width * DX, 1.4 * fill * DX, 0.0)
    scheme = sets.scheme("boil", dim=2, spacing=DX,
                         changes=dict(container=BoxContainer(upper=size), buoyancy=Buoyancy(k_bubble=0.0),
                                      heat=HeatConduction(time_scaling=1e-9), heater=Heater(temperature=373.15),
                                      venting=Venting(free_steps=10**6)))
    common = dict(spacing=DX, dim=2, rho0=scheme.rho0)
    fluid = fluid_block((0.0, 0.0, 0.0), (size[0], fill * DX, 0.0), jitter=0.01, **common)
    arrays = [fluid, box_vessel((0.0, 0.0), size[:2], kernel=scheme.kernel, heated_fraction=0.1, **common),
              site_array([(0.0, -0.1, 0.0)], reach=2.4 * DX, spacing=DX)]
    scheme.setup_properties(arrays)
    scheme.set_temperature(fluid, 372.0)
    stepper = Stepper(scheme, arrays)
    stepper.step(400)
    inside = np.zeros(len(fluid.x), bool)
    for x, y in centres:
        inside |= np.hypot(fluid.x - x * DX, fluid.y - y * DX) < radius * DX
    fluid.phase[inside], fluid.e[inside] = Phase.VAPOUR, scheme.material.L
    return SimpleNamespace(scheme=scheme, stepper=stepper, fluid=fluid, vapour=inside,
                           bubbles=lambda: Vapour(scheme.arrays))


def test_bubbles_that_touch_become_one_round_bubble_and_their_volumes_add():
    p = pool(30, 24, [(11.0, 12.0), (18.0, 12.0)])
    p.stepper.step()
    before = p.bubbles()
    volumes = equivalent_radius(before, p.scheme.scene())**2
    mass = before.get("m").sum()
    assert len(before.n) == 2
    merged = None
    for _ in range(600):
        p.fluid.u[p.vapour] += 0.002 * np.sign(15.0 * DX - p.fluid.x[p.vapour])  # a breeze that brings them together
        p.stepper.step()
        merged = p.bubbles()
        if len(merged.n) == 1:
            break
    assert len(merged.n) == 1 and merged.n[0] == before.n.sum()
    assert merged.get("m").sum() == pytest.approx(mass, rel=1e-12)
    assert equivalent_radius(merged, p.scheme.scene())[0] ** 2 == pytest.approx(volumes.sum(), rel=1e-12)
    assert length(positions(p.fluid)[p.vapour, :2]) > 2.0
    p.stepper.step(600)
    natural = 0.3761 * DX * np.sqrt(merged.n[0])  # mean distance from the centre of a disk of this volume
    assert len(p.bubbles().n) == 1
    assert mean_radius(p.bubbles(), p.scheme.scene())[0] == pytest.approx(natural, rel=0.04)  # measured .99
    assert length(positions(p.fluid)[p.vapour, :2]) < 1.25  # measured 1.12


@pytest.mark.parametrize("dim, cells", [(2, 24), pytest.param(3, 14, marks=pytest.mark.slow)])
def test_bubble_at_rest_stays_at_rest(dim, cells):
    """At twice the default step, strong cohesion: .040 and .069. As a force of the start it came to 1.3 and tore."""
    errors = BubbleAtRest(dim=dim, cells=cells, dt_factor=0.14, strength=10.0).run().errors
    assert errors["speed"] < 0.12 and errors["torn"] == 0.0, errors


def test_sheared_bubble_splits_and_a_still_one_does_not():
    p = pool(60, 24, [(30.0, 12.0)], radius=4.5)
    n = np.count_nonzero(p.vapour)
    p.stepper.step(200)
    assert p.bubbles().n.tolist() == [n]
    speed = 12.0 * DX / p.scheme.scene().fall_time
    for _ in range(60):
        p.fluid.u[:] = np.clip((p.fluid.y / DX - 12.0) / 4.0, -1.0, 1.0) * speed * np.sin(np.pi * p.fluid.x / (60 * DX))
        p.stepper.step()
    pieces = p.bubbles().n
    assert len(pieces) >= 2 and pieces.sum() == n and pieces.max() <= 0.9 * n

"""Bubbles in still water (2-D): they rise at a speed of their own, merge into one, and are torn apart by shear."""
from types import SimpleNamespace

import numpy as np
import pytest
import sets
from harness import Stepper

from pysph_boiling.analysis.bubbles import bubble_table
from pysph_boiling.particles import box_vessel, fluid_block, site_array
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.effects import BoxContainer, Buoyancy, DensityConstraint, HeatConduction, Heater, Venting

DX = 0.004


def pool(width, fill, centres, radius=3.2, k_bubble=0.0, sweeps=(2, 6), share=0.07, settle=400):
    """A pool at rest (sizes in spacings) in which disks at ``centres`` are turned into vapour; heat stands still."""
    size = (width * DX, 1.4 * fill * DX, 0.0)
    density = DensityConstraint(min_sweeps=sweeps[0], max_sweeps=sweeps[1])
    scheme = sets.scheme("boil", dim=2, spacing=DX, density=density,
                         changes=dict(container=BoxContainer(upper=size), buoyancy=Buoyancy(k_bubble=k_bubble),
                                      heat=HeatConduction(acceleration=1e-9), heater=Heater(temperature=373.15),
                                      venting=Venting(steps=10**6)))
    common = dict(spacing=DX, dim=2, rho0=scheme.rho0)
    fluid = fluid_block((0.0, 0.0, 0.0), (size[0], fill * DX, 0.0), jitter=0.01, **common)
    arrays = [fluid, box_vessel((0.0, 0.0), size[:2], kernel=scheme.kernel, heated_fraction=0.1, **common),
              site_array([(0.0, -0.1, 0.0)], reach=2.4 * DX, spacing=DX)]
    scheme.setup_properties(arrays)
    scheme.set_temperature(fluid, 372.0)
    stepper = Stepper(scheme, arrays, dt=scheme.time_step(share))
    stepper.step(int(settle * 0.07 / share))
    inside = np.zeros(len(fluid.x), bool)
    for x, y in centres:
        inside |= np.hypot(fluid.x - x * DX, fluid.y - y * DX) < radius * DX
    fluid.phase[inside], fluid.e[inside] = Phase.VAPOUR, scheme.material.L
    return SimpleNamespace(scheme=scheme, stepper=stepper, fluid=fluid, vapour=inside,
                           table=lambda: bubble_table(scheme.arrays, scheme.scene()))


def rise_speed(**parameters):
    """Speed [dx/t*] of a bubble between 20 and 40 spacings above the base, and what is left of it in one piece."""
    p = pool(24, 56, [(12.0, 6.0)], k_bubble=1.5, **parameters)
    unit, heights, times = p.scheme.scene().fall_time, [], []
    while not heights or heights[-1] < 42.0:
        p.stepper.step()
        table = p.table()
        heights.append(table.centroid[np.argmax(table.n), 1] / DX)
        times.append(p.stepper.t / unit)
        assert len(times) < 3000, "the bubble does not rise"
    begin, end = np.searchsorted(heights, (20.0, 40.0))
    return (heights[end] - heights[begin]) / (times[end] - times[begin]), table.n.max() / table.n.sum(), heights, times


def test_rise_speed_is_terminal_and_independent_of_time_step_and_sweeps():
    speeds = {}
    for name, parameters in {"standard": {}, "half the step": dict(share=0.035), "fixed 4 sweeps": dict(sweeps=(4, 4)),
                             "fixed 8 sweeps": dict(sweeps=(8, 8))}.items():
        speeds[name], whole, heights, times = rise_speed(**parameters)
        assert whole > 0.8, f"{name}: the bubble fell apart"
        if name == "standard":
            at = np.interp([20.0, 30.0, 40.0], heights, times)
            lower, upper = 10.0 / np.diff(at)
            assert upper == pytest.approx(lower, rel=0.2), "not terminal"
    middle = np.mean(list(speeds.values()))
    assert 0.5 < middle < 6.0
    assert list(speeds.values()) == pytest.approx([middle] * 4, rel=0.2), speeds


def test_bubbles_that_touch_merge_and_their_volumes_add():
    p = pool(30, 24, [(11.0, 12.0), (18.0, 12.0)])
    p.stepper.step()
    before = p.table()
    assert len(before.n) == 2
    merged = None
    for _ in range(600):
        p.fluid.u[p.vapour] += 0.002 * np.sign(15.0 * DX - p.fluid.x[p.vapour])  # a breeze that brings them together
        p.stepper.step()
        merged = p.table()
        if len(merged.n) == 1:
            break
    assert len(merged.n) == 1 and merged.n[0] == before.n.sum()
    assert merged.mass[0] == pytest.approx(before.mass.sum(), rel=1e-12)
    assert merged.equivalent_radius[0] ** 2 == pytest.approx(np.sum(before.equivalent_radius**2), rel=1e-12)
    p.stepper.step(600)
    natural = 0.3761 * DX * np.sqrt(merged.n[0])  # mean distance from the centre of a disk of this volume
    assert len(p.table().n) == 1 and p.table().mean_radius[0] == pytest.approx(natural, rel=0.15)


def test_sheared_bubble_splits_and_a_still_one_does_not():
    p = pool(60, 24, [(30.0, 12.0)], radius=4.5)
    n = np.count_nonzero(p.vapour)
    p.stepper.step(200)
    assert p.table().n.tolist() == [n]
    speed = 12.0 * DX / p.scheme.scene().fall_time
    for _ in range(60):
        p.fluid.u[:] = np.clip((p.fluid.y / DX - 12.0) / 4.0, -1.0, 1.0) * speed * np.sin(np.pi * p.fluid.x / (60 * DX))
        p.stepper.step()
    pieces = p.table().n
    assert len(pieces) >= 2 and pieces.sum() == n and np.sort(pieces)[-2] >= 0.1 * n

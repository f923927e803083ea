"""Expansion: the ramp in closed form, and a pool in which vapour swells."""
from types import SimpleNamespace

import numpy as np
import pytest
import sets
from harness import Stepper

from pysph_boiling.particles import box_vessel, fluid_block, site_array
from pysph_boiling.phases import Phase
from pysph_boiling.runs.ledger import Ledger
from pysph_boiling.schemes.effects import BoxContainer, Buoyancy, Expansion, Heater, Venting

DX, WIDTH, FILL, RADIUS = 0.004, 24, 18, 3.6  # m, and in spacings


def pool(v_exp, ramp=10.0):
    """A 2-D pool of nearly saturated water at rest, for .6 s to settle; then the disk in its middle is vapour."""
    size = (WIDTH * DX, 2 * FILL * DX, 0.0)
    scheme = sets.scheme("expand", dim=2, spacing=DX, changes=dict(
        container=BoxContainer(upper=size), expansion=Expansion(v_exp=v_exp, ramp=ramp),
        buoyancy=Buoyancy(k_bubble=0.0), venting=Venting(free_steps=10**6),
        heater=Heater(temperature=sets.WATER_1ATM.T_sat)))
    common = dict(spacing=DX, dim=2, rho0=scheme.rho0)
    fluid = fluid_block((0.0, 0.0, 0.0), (size[0], FILL * DX, 0.0), jitter=0.01, **common)
    arrays = [fluid, box_vessel((0.0, 0.0), size[:2], kernel=scheme.kernel, heated_fraction=0.1, **common),
              site_array([(0.0, -0.1, 0.0)], reach=2.4 * DX, spacing=DX)]
    scheme.setup_properties(arrays)
    scheme.set_temperature(fluid, scheme.material.T_sat - 0.1)
    stepper = Stepper(scheme, arrays, dt=scheme.time_step())
    stepper.step(400)
    vapour = np.hypot(fluid.x - 0.5 * size[0], fluid.y - 0.5 * FILL * DX) < RADIUS * DX
    fluid.phase[vapour] = Phase.VAPOUR
    fluid.e[vapour] = scheme.material.L
    fluid.q_heater[:] = 0.0
    return SimpleNamespace(scheme=scheme, stepper=stepper, fluid=fluid, vapour=vapour)


def level(fluid):
    """Height of the surface [m]: the mean over the columns of their highest particle, and half a spacing."""
    column = (fluid.x / DX).astype(int)
    return np.mean([fluid.y[column == c].max() for c in range(WIDTH) if np.any(column == c)]) + 0.5 * DX


def speed(fluid):
    return float(np.max(np.hypot(fluid.u, fluid.v)))


def test_swell_is_ramped_to_that_of_the_phase_and_back():
    p = pool(v_exp=2.5, ramp=5.0)
    fluid, scene = p.fluid, p.scheme.scene()
    rate = 1.5 / (5.0 * scene.fall_time)
    assert np.all(fluid.swell == 1.0)
    for n in range(1, 5):
        p.stepper.step()
        np.testing.assert_allclose(fluid.swell[p.vapour], 1.0 + n * rate * p.stepper.dt, rtol=1e-12)
        assert np.all(fluid.swell[~p.vapour] == 1.0)
    p.stepper.step(int(5.0 * scene.fall_time / p.stepper.dt))
    assert np.all(fluid.swell[fluid.phase == Phase.VAPOUR] == 2.5)
    gone = fluid.phase == Phase.VAPOUR
    fluid.phase[gone], fluid.e[gone] = Phase.LIQUID, -1.0
    p.stepper.step()
    np.testing.assert_allclose(fluid.swell[gone], 2.5 - rate * p.stepper.dt, rtol=1e-12)
    p.stepper.step(int(5.0 * scene.fall_time / p.stepper.dt) + 1)
    assert np.all(fluid.swell == 1.0)


@pytest.mark.parametrize("v_exp", [1.0, 1.5, 2.0])
def test_level_rises_by_the_volume_of_the_vapour_and_the_ledger_closes(v_exp):
    p = pool(v_exp, ramp=2.0)
    ledger = Ledger(p.scheme)
    ledger.begin(p.scheme.arrays)
    before = level(p.fluid)
    p.stepper.step(int(2.5 * p.scheme.scene().fall_time / p.stepper.dt))
    row = ledger.row(p.stepper.t, p.stepper.dt)
    n = np.count_nonzero(p.vapour)
    assert row["n_vapour"] == n > 30 and row["n_vented"] == 0
    assert row["rest_volume"] == pytest.approx((len(p.fluid.x) + n * (v_exp - 1.0)) * DX**2, rel=1e-12)
    rise = n * (v_exp - 1.0) * DX / WIDTH
    assert level(p.fluid) - before == pytest.approx(rise, abs=0.25 * rise + 0.1 * DX)  # the pool is still moving
    assert abs(row["energy_residual"]) <= 1e-12 and row["mass_residual"] == 0.0
    assert row["density_error_mean"] < 0.02


@pytest.mark.many_steps
def test_ramp_keeps_vapour_from_kicking_the_pool():
    """At once, twice the volume throws the pool; over 10 t* it hardly moves."""
    fastest = {}
    for at_once in (True, False):
        p = pool(2.0)
        if at_once:
            p.fluid.swell[p.vapour] = 2.0
        quiet, fastest[at_once] = speed(p.fluid), 0.0
        for _ in range(int(3.0 * p.scheme.scene().fall_time / p.stepper.dt)):
            p.stepper.step()
            fastest[at_once] = max(fastest[at_once], speed(p.fluid))
        unit = DX / p.scheme.scene().fall_time
    assert quiet < fastest[False] < 1.5 * unit
    assert fastest[True] > 3.0 * fastest[False]


@pytest.mark.parametrize("short", [False, True])
def test_fastest_swelling_that_is_accepted_throws_nothing(short):
    """Just below the largest swell, in ordinary steps, and every other of any length; 1 t* has 2.4 times the limit."""
    p = pool(v_exp=3.16, ramp=2.0)
    ordinary, random, fastest = p.stepper.dt, np.random.default_rng(0), 0.0
    for step in range(150):
        if short and step % 2:
            p.stepper.dt = ordinary * 10.0 ** random.uniform(-5.0, 0.0)
        else:
            p.stepper.dt = ordinary
        p.stepper.step()
        fastest = max(fastest, speed(p.fluid))
    assert np.count_nonzero(p.fluid.swell > 3.1) > 30
    limit = np.sqrt(2.0 * 9.81 * level(p.fluid))
    assert 0.1 * limit < fastest < 2.0 * limit


def test_short_steps_swell_at_the_same_speed_and_one_gives_no_kick():
    """The swell that a long step has left is no velocity in a short one; what the short step itself swells is."""
    kinetic, heights = [], []
    for parts in (1, 20):
        p = pool(v_exp=2.0)
        ordinary = p.stepper.dt
        p.stepper.dt = ordinary / parts
        p.stepper.step(12 * parts)
        heights.append(level(p.fluid))
        p.stepper.dt = 1e-8
        before = np.sum(p.fluid.m * (p.fluid.u**2 + p.fluid.v**2))
        p.stepper.step()
        kinetic.append(np.sum(p.fluid.m * (p.fluid.u**2 + p.fluid.v**2)))
        assert 0.9 * before < kinetic[-1] < 1.02 * before
    assert 0.2 < kinetic[1] / kinetic[0] < 1.6 and kinetic[0] > 1e-3  # measured .34: it dissipates more
    assert heights[1] == pytest.approx(heights[0], abs=0.1 * DX)

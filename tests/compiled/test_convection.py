"""Convection: both forms against all pairs in NumPy, and what they do to a pool."""
from types import SimpleNamespace

import numpy as np
import pytest
import sets
from harness import Evaluator, Stepper, one_group_each, random_cloud

from pysph_boiling.equations.convection import ConvectionBoussinesq, ConvectionGradient
from pysph_boiling.particles import box_vessel, fluid_array, fluid_block
from pysph_boiling.schemes.effects import BoxContainer, Convection, HeatConduction, Heater

DX, WIDTH, FILL = 0.004, 30, 20  # m, and in spacings
BETA, GAIN, LARGEST, RHO0, K_LIQUID_MIN = 2e-3, 0.03, 1.5, 958.0, 0.1
GRAVITY = np.array([1.0, -2.0, -9.0])


def test_both_forms_equal_the_reference():
    n = 80
    fluid = fluid_array(random_cloud(n, 3, seed=1), spacing=0.22, dim=3, rho0=RHO0)
    random = np.random.default_rng(2)
    for name in ("T", "k", "gTx", "gTy", "gTz", "au", "av", "aw"):
        fluid.add_property(name)
    fluid.add_constant("convection_T", 350.0)
    fluid.T[:], fluid.k[:] = random.uniform(300.0, 400.0, n), np.where(random.uniform(size=n) < 0.8, 0.6, 0.02)
    fluid.m *= random.uniform(0.5, 2.0, n)
    run = Evaluator([fluid], one_group_each([
        ConvectionBoussinesq("fluid", None, beta=BETA, k_liquid_min=K_LIQUID_MIN,
                             **dict(zip(("gx", "gy", "gz"), GRAVITY))),
        ConvectionGradient("fluid", ["fluid"], gain=GAIN, largest=LARGEST, rho0=RHO0, k_liquid_min=K_LIQUID_MIN),
    ]), dim=3)
    run.run()
    wet = fluid.k >= K_LIQUID_MIN
    gradient, G, zero = np.zeros((n, 3)), np.zeros(3), np.zeros(3)
    for i, j in np.ndindex(n, n):
        x = np.array([fluid.x[i] - fluid.x[j], fluid.y[i] - fluid.y[j], fluid.z[i] - fluid.z[j]])
        run.kernel.gradient(x, np.linalg.norm(x), fluid.h[0], G)
        gradient[i] += wet[j] * fluid.m[j] / RHO0 * (fluid.T[j] - fluid.T[i]) * G
    size = GAIN * np.linalg.norm(gradient, axis=1)
    along = -GAIN * gradient * np.minimum(1.0, LARGEST / np.maximum(size, 1e-300))[:, None]
    a = np.where(wet[:, None], -BETA * (fluid.T - 350.0)[:, None] * GRAVITY + along, zero)
    assert 5 < np.count_nonzero(size[wet] > LARGEST) < np.count_nonzero(wet) - 5  # capped and not
    np.testing.assert_allclose(np.stack([fluid.au, fluid.av, fluid.aw], -1), a, atol=1e-12 * np.abs(a).max())
    np.testing.assert_allclose(np.stack([fluid.gTx, fluid.gTy, fluid.gTz], -1), gradient,
                               atol=1e-12 * np.abs(gradient).max())


def pool(form, T, base=None, **parameters):
    """A 2-D pool of water; ``T`` [K] of its particles from (x, y); the base is at ``base`` [K] or adiabatic."""
    size = (WIDTH * DX, 2 * FILL * DX, 0.0)
    scheme = sets.scheme(form, dim=2, spacing=DX, changes=dict(
        container=BoxContainer(upper=size), heater=Heater(temperature=base or 300.0),
        heat=HeatConduction(time_scaling=300.0 if base else 1e-6), convection=Convection(form=form, **parameters)))
    common = dict(spacing=DX, dim=2, rho0=scheme.rho0)
    fluid = fluid_block((0.0, 0.0, 0.0), (size[0], FILL * DX, 0.0), jitter=0.01, **common)
    wall = box_vessel((0.0, 0.0), size[:2], kernel=scheme.kernel, heated_fraction=0.4, **common)
    scheme.setup_properties([fluid, wall])
    scheme.set_temperature(fluid, T(fluid.x, fluid.y))
    return SimpleNamespace(scheme=scheme, fluid=fluid, stepper=Stepper(scheme, [fluid, wall]))


def uniform(x, y):
    return np.full(len(x), 340.0)


FORMS = {"boussinesq": dict(beta=4e-3), "gradient": dict(gain=0.02)}  # the latter below its cap


@pytest.mark.parametrize("form", FORMS)
def test_fluid_hot_below_accelerates_upwards_on_the_first_step(form):
    """A warm blob at the bottom: its own acceleration beyond gravity points up. An isothermal fluid feels nothing."""
    def blob(x, y):
        return 320.0 + 40.0 * np.exp(-((x - 0.5 * WIDTH * DX) ** 2 + (y - 3 * DX) ** 2) / (4 * DX) ** 2)

    accelerations = []
    for T in (blob, uniform):
        p = pool(form, T, **FORMS[form])
        p.stepper.step()
        accelerations.append(np.stack([p.fluid.au, p.fluid.av], -1))
    force = accelerations[0] - accelerations[1]  # the motion of this step, and so the viscosity, is the same
    above = (np.abs(p.fluid.x - 0.5 * WIDTH * DX) < 2 * DX) & (np.abs(p.fluid.y - 5 * DX) < 2 * DX)
    assert np.count_nonzero(above) > 8 and np.all(force[above, 1] > 0.1)


@pytest.mark.parametrize("form", FORMS)
def test_isothermal_fluid_feels_no_force(form):
    with_it, without = (pool(form, uniform, **parameters) for parameters in (
        FORMS[form], {name: 0.0 for name in FORMS[form]}))
    for p in (with_it, without):
        p.stepper.step(3)
    np.testing.assert_allclose(with_it.fluid.av, without.fluid.av, atol=1e-9)


def kinetic(p):
    return float(np.mean(p.fluid.u**2 + p.fluid.v**2))


def columns(form, T, base=None, **parameters):
    """Rise [m/s] and temperature [K] of each three-spacing column of the pool's middle, averaged over a second."""
    p = pool(form, T, base=base, **parameters)
    p.stepper.step(900)
    n = WIDTH // 3
    lift, warm = np.zeros(n), np.zeros(n)
    for _ in range(700):
        p.stepper.step()
        middle = np.abs(p.fluid.y / DX - 0.5 * FILL) < 0.25 * FILL
        column = np.clip((p.fluid.x[middle] / (3 * DX)).astype(int), 0, n - 1)
        count = np.maximum(np.bincount(column, minlength=n), 1)
        lift += np.bincount(column, weights=p.fluid.v[middle], minlength=n) / count / 700
        warm += np.bincount(column, weights=p.fluid.T[middle], minlength=n) / count / 700
    return lift, warm


def cold(x, y):
    return np.full(len(x), 300.0)


@pytest.mark.parametrize("form", FORMS)
def test_stable_stratification_stays_at_rest(form):
    p = pool(form, lambda x, y: 300.0 + 60.0 * y / (FILL * DX), **FORMS[form])
    p.stepper.step(500)
    motion = np.mean([kinetic(p) for _ in range(100) if p.stepper.step() is None])
    assert np.sqrt(motion) < 0.01 * np.sqrt(9.81 * FILL * DX)


def test_unstable_stratification_overturns():
    """Warm below and cold above, a little tilted, is no rest."""
    p = pool("boussinesq", lambda x, y: 360.0 - 60.0 * y / (FILL * DX) + 10.0 * np.cos(np.pi * x / (WIDTH * DX)),
             beta=1e-2)
    p.stepper.step(500)
    motion = np.mean([kinetic(p) for _ in range(100) if p.stepper.step() is None])
    assert np.sqrt(motion) > 0.03 * np.sqrt(9.81 * FILL * DX)


@pytest.mark.many_steps
def test_heated_base_sets_up_rolls():
    """Some columns rise and others sink, the rising ones warm; a still pool has neither."""
    lift, warm = columns("boussinesq", cold, base=370.0, beta=2e-2)
    still, _ = columns("boussinesq", uniform, beta=2e-2)
    assert np.std(lift) > 4.0 * np.std(still)  # measured 180 times; with half of beta 2.4 times
    assert min(lift) < -0.001 and max(lift) > 0.001  # m/s; measured -.054 and .135
    assert np.corrcoef(lift, warm)[0, 1] > 0.5


@pytest.mark.many_steps
def test_only_the_cap_of_the_gradient_force_sets_up_rolls():
    """The gradient of a field is balanced by a pressure: below its cap at |g| the force moves nothing."""
    still, _ = columns("gradient", uniform)
    for gain, rolls in ((0.01, False), (0.3, True)):  # measured: 1.0 and 19 times the still pool
        lift, _ = columns("gradient", cold, base=370.0, gain=gain)
        assert (np.std(lift) > 4.0 * np.std(still)) == rolls

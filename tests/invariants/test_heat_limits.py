"""Heat stays within its limits: no term overshoots what it relaxes to, T is never behind e, and energy closes.

Still scenes but for one; energies are compared with what was moved.
"""
import numpy as np
import pytest
from harness import Stepper
from pysph.base.kernels import CubicSpline, WendlandQuintic
from sets import scheme

from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.particles import box_vessel, fluid_block, site_array, wall_array
from pysph_boiling.phases import Phase, temperature
from pysph_boiling.runs.ledger import Ledger
from pysph_boiling.schemes.effects import AmbientLoss, HeatConduction, Heater, HeatSource, heat_step_limit

DX, T_AIR, T_START, A = 0.004, 293.15, 363.15, 800.0
ROUND_OFF = 1e-12  # of the energy that was moved


def still(name, *, dt, heated=None, T_heater=None, T=T_START, **changes):
    """A stepper, its fluid (10 x 10, 2-D) and its ledger; walls below, as wide as the fluid, ``heated`` (10,)."""
    made = scheme(name, dim=2, spacing=DX, changes=changes)
    common = dict(spacing=DX, dim=2, rho0=made.rho0)
    fluid = fluid_block((0.0, 0.0, 0.0), (10 * DX, 10 * DX, 0.0), **common)
    points = np.column_stack([DX * (np.arange(10) + 0.5), np.full(10, -0.5 * DX), np.zeros(10)])
    heated = np.ones(10) if heated is None else heated
    arrays = [fluid, wall_array(points, kernel=made.kernel, heated=heated, T_heater=T_heater, **common)]
    made.setup_properties(arrays)
    made.set_temperature(fluid, T)
    stepper, ledger = Stepper(made, arrays, dt=dt), Ledger(made)
    ledger.begin([fluid])
    stepper.tools.append(ledger)
    return stepper, fluid, ledger


def exchange(*, eta=0.0, source=0.0, T_ambient=T_AIR, dt=0.0014, A=A, **kwargs):
    return still("exchange", dt=dt, heat=HeatConduction(laplacian="paper", time_scaling=A), heater=Heater(flux=0.0),
                 loss=AmbientLoss(coefficient=eta, T_ambient=T_ambient), source=HeatSource(density=source), **kwargs)


# --- loss to the ambient ----------------------------------------------------------------------------------------------

@pytest.mark.parametrize("T_ambient", [T_AIR, 370.0])
@pytest.mark.parametrize("eta", [10.0, 2e4, 5e4, 2e5, 1e9])
def test_no_coefficient_cools_or_heats_beyond_the_ambient(eta, T_ambient):
    """From an uneven start, so that some surface is colder than the liquid below it, and some warmer."""
    random = np.random.default_rng(1)
    stepper, fluid, ledger = exchange(eta=eta, T_ambient=T_ambient, T=random.uniform(T_AIR + 20.0, T_START, 100))
    low, high = min(T_ambient, fluid.T.min()), max(T_ambient, fluid.T.max())
    for _ in range(40):
        stepper.step()
        assert low - 1e-9 <= fluid.T.min() and fluid.T.max() <= high + 1e-9  # K
    row = ledger.rows[-1]
    assert abs(row["energy_loss"]) > 0.1 * 2e3 * min(eta, 1e4) / 1e4  # J/m: something was lost, or gained
    assert abs(row["energy_residual"]) <= ROUND_OFF
    surface = fluid.gsx**2 + fluid.gsy**2 > (0.25 / DX) ** 2
    assert surface.sum() >= 25
    if eta >= 2e5:  # the surface has the temperature of the air
        np.testing.assert_allclose(fluid.T[surface], T_ambient, atol=2.0)


@pytest.mark.parametrize("start", [Phase.TRANSITION, Phase.SUPERHEATED])
@pytest.mark.parametrize("dim", [2, 3])
def test_hot_air_makes_nothing_hotter_than_itself(dim, start):
    """Water boils at its surface, in steps that bring it far beyond what boiling takes.

    It is about to become vapour, or has been interrupted shortly before, and is near no site.
    """
    T_hot, n = 640.0, 6
    made = scheme("ihmsen", dim=dim, spacing=DX, changes=dict(
        heater=Heater(temperature=WATER.T_sat), loss=AmbientLoss(coefficient=1e9, T_ambient=T_hot)))
    upper = [n * DX] * (dim - 1) + [2 * n * DX] + [0.0] * (3 - dim)
    common = dict(spacing=DX, dim=dim, rho0=made.rho0)
    fluid = fluid_block((0.0, 0.0, 0.0), [n * DX] * dim + [0.0] * (3 - dim), **common)
    arrays = [fluid, box_vessel((0.0,) * 3, upper, kernel=made.kernel, heated_fraction=0.8, **common),
              site_array([(0.5 * n * DX, 0.0, 0.0)], reach=2.4 * DX, spacing=DX)]
    made.setup_properties(arrays)
    made.set_temperature(fluid, WATER.T_sat - 1.0)
    inside = fluid.get("xyz"[dim - 1]) > (n - 2) * DX
    fluid.phase[inside], fluid.e[inside] = start, 0.95 * WATER.L
    fluid.e_lat[inside] = 0.95 * WATER.L * (start == Phase.SUPERHEATED)
    stepper, ledger = Stepper(made, arrays), Ledger(made)
    ledger.begin([fluid])
    stepper.tools.append(ledger)
    hottest = 0.0
    for _ in range(40):
        stepper.step()
        hottest = max(hottest, fluid.T.max())
    row = ledger.rows[-1]
    assert row["n_nucleated"] >= 5 * (start == Phase.TRANSITION) and WATER.T_sat + 50.0 < hottest <= T_hot + 1e-9
    assert abs(row["energy_residual"]) <= ROUND_OFF


def test_loss_follows_the_exact_law_at_any_step():
    """One heat step or a hundred: a film that does not conduct cools as exp(-rate t)."""
    ends = []
    for steps in (1, 100):
        stepper, fluid, _ = exchange(eta=2e4, dt=0.002 / steps, A=1.0)
        for _ in range(steps):
            fluid.ae[:] = 0.0
            stepper.step()
        ends.append(fluid.T.copy())
    assert ends[0].min() < T_START - 1e-3
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-4 * (T_START - ends[0].min()) + 1e-9)


# --- beyond physics ---------------------------------------------------------------------------------------------------

@pytest.mark.parametrize(("source", "T"), [(-1e9, "-"), (1e9, "6")])
def test_liquid_beyond_zero_or_the_critical_point_ends_a_run_stepped_by_hand(source, T):
    stepper, fluid, ledger = exchange(source=source, dt=0.05, A=1.0)
    with pytest.raises(FloatingPointError, match=rf"T = {T}[\d.]+ K of particle \d+ of 'fluid' at .* liquid must stay "
                       r"between 0 K and 647.1 K, the critical point of water at 1 atm, vapour above 0 K"):
        stepper.step(60)
    assert 5 < len(ledger.rows) < 59
    assert all(0.0 < T < WATER.T_crit for T in ledger.table()["T_mean"])


# --- heaters ----------------------------------------------------------------------------------------------------------

def test_two_heaters_of_their_own_temperatures():
    """Left 330 K, right 350 K, cold water above: each side warms towards its own heater, and never beyond."""
    left = np.arange(10) < 5
    stepper, fluid, ledger = still("slab", dt=20.0, T=300.0, heater=Heater(temperature=350.0),
                                   T_heater=np.where(left, 330.0, 0.0))
    stepper.step(300)
    low = fluid.y < DX
    T = fluid.T[low][np.argsort(fluid.x[low])]
    assert np.all(T[:3] < 334.0) and np.all(T[:3] > 325.0) and np.all(T[-3:] > 345.0) and T.max() < 350.0
    row = ledger.rows[-1]
    assert row["energy_heater"] > 0.5 * row["mass"] * WATER.c_l * 30.0  # of both heaters
    assert abs(row["energy_residual"]) <= ROUND_OFF
    effect, scene = stepper.scheme.effects["heater"], stepper.scheme.scene()
    assert effect.temperatures(scene, stepper.arrays) == [(330.0, 5), (350.0, 5)]


def test_no_heat_from_where_no_heater_is():
    stepper, fluid, ledger = still("slab", dt=20.0, T=300.0, heated=np.arange(10) < 5,
                                   heater=Heater(temperature=350.0))
    stepper.step(20)
    assert fluid.q_heater[fluid.x > 8 * DX].max() == 0.0 < fluid.q_heater.max()


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("kernel", [CubicSpline, WendlandQuintic])
def test_contact_with_a_heater_is_within_the_explicit_limit(kernel, dim):
    """Share of the difference that one heat step at its limit evens out, by place: 2 and more would grow."""
    kernel, hdx, reach = kernel(dim=dim), 1.2, 3
    lattice = np.zeros(((2 * reach + 1) ** dim, 3))
    lattice[:, :dim] = np.indices((2 * reach + 1,) * dim).reshape(dim, -1).T - reach

    def share(place, heater):
        total = 0.0
        for offset in place - heater:
            gradient, r = [0.0] * 3, float(np.linalg.norm(offset))
            kernel.gradient(xij=offset, rij=r, h=hdx, grad=gradient)
            total -= np.dot(offset, gradient) / (r * r + 0.01 * hdx * hdx)
        return heat_step_limit(1.0, 1.0, 1.0, hdx) * 4.0 * total

    places = [np.pad([x] * (dim - 1) + [up], (0, 3 - dim)) for x in (0.0, 0.5) for up in (0.0, 0.1, 0.5)]
    up = np.eye(3)[dim - 1]
    block = lattice[lattice[:, dim - 1] <= 0.0] - 0.5 * up
    face, inside = ([share(place, heater) for place in places] for heater in (block, lattice))
    assert 0.25 < min(face) < max(face) < 0.7  # the liquid on the other side evens out .3 more
    assert 0.8 < min(inside) < max(inside) < 1.4  # no particle gets there: the container keeps it before the face


@pytest.mark.parametrize(("heated", "T_heater", "message"), [
    (2, 0.0, "heated of wall particle 3 of 'wall' must be 0 or 1; T_heater .K. sets the temperature of "
             "individual heaters, got 2"),
    (1, -5.0, "T_heater of wall particle 3 of 'wall' must be below the critical point, 647.1 K, and > 0 K"),
    (1, 700.0, "T_heater of wall particle 3 of 'wall' must be below the critical point, 647.1 K"),
    (1, np.nan, "T_heater of wall particle 3 of 'wall' must be below the critical point"),
])
def test_heater_that_would_be_silently_dead_is_refused(heated, T_heater, message):
    """Also where the array was edited after it was made."""
    made = scheme("slab", dim=2, spacing=DX)
    fluid = fluid_block((0.0, 0.0, 0.0), (4 * DX, 4 * DX, 0.0), spacing=DX, dim=2, rho0=made.rho0)
    wall = wall_array(np.column_stack([DX * np.arange(5), np.zeros((5, 2))]), spacing=DX, dim=2, rho0=made.rho0,
                      kernel=made.kernel, heated=np.ones(5))
    wall.heated[3], wall.T_heater[3] = heated, T_heater
    with pytest.raises(ValueError, match=message):
        made.setup_properties([fluid, wall])


def test_heater_of_a_flux_has_no_temperature():
    with pytest.raises(ValueError, match="with a flux wall particles must not have a T_heater, but some of 'wall'"):
        exchange(T_heater=400.0)


# --- T and e ----------------------------------------------------------------------------------------------------------

def behind(pa, subcooling=1.0):
    """Largest distance [K] of T from what e says."""
    phase, e_lat = (pa.get(name) if name in pa.properties else 0.0 for name in ("phase", "e_lat"))
    return np.abs(pa.T - temperature(pa.e, phase, WATER, e_lat, subcooling)).max()


def test_temperature_is_never_behind_the_enthalpy_at_rest():
    """One heat step a step, and several."""
    for dt in (20.0, 200.0):
        stepper, fluid, ledger = still("slab", dt=dt, T=300.0)
        for _ in range(5):
            before = fluid.T.copy()
            stepper.step()
            assert behind(fluid) <= 1e-12 and np.abs(fluid.T - before).max() > 0.1
            row = ledger.rows[-1]
            assert row["T_mean"] == pytest.approx(WATER.T_sat + row["energy"] / row["mass"] / WATER.c_l, rel=1e-13)
    assert row["heat_subcycles"] > 1.0


@pytest.mark.parametrize("name", ["boil", "paper"])
def test_temperature_is_never_behind_the_enthalpy_in_a_boil(name):
    """Latent heat held or converted, bubbles that condense, pools, a lid or a vent."""
    n = 9
    heater = Heater(temperature=WATER.T_sat + 60.0) if name == "boil" else Heater(flux=2e5)
    made = scheme(name, dim=2, spacing=DX, changes=dict(heater=heater, heat=HeatConduction(
        laplacian=scheme(name, dim=2, spacing=DX).effects["heat"].laplacian, time_scaling=A)))
    upper = (n * DX, 1.6 * n * DX, 0.0)
    common = dict(spacing=DX, dim=2, rho0=made.rho0)
    fluid = fluid_block((0.0, 0.0, 0.0), (n * DX, n * DX, 0.0), jitter=0.02, **common)
    arrays = [fluid, box_vessel((0.0,) * 3, upper, kernel=made.kernel, heated_fraction=0.8, **common),
              site_array([(0.5 * n * DX, 0.0, 0.0)], reach=2.4 * DX, spacing=DX)]
    made.setup_properties(arrays)
    made.set_temperature(fluid, WATER.T_sat - 3.0 + 100.0 * np.exp(-fluid.y / (1.5 * DX)))
    inside = (fluid.x - 0.5 * n * DX) ** 2 + (fluid.y - 0.5 * n * DX) ** 2 < (1.6 * DX) ** 2
    fluid.phase[inside], fluid.e[inside] = Phase.VAPOUR, 0.8 * WATER.L
    stepper, ledger = Stepper(made, arrays), Ledger(made)
    ledger.begin([fluid])
    stepper.tools.append(ledger)
    for _ in range(120):
        stepper.step()
        assert behind(fluid, made.effects["condensation"].subcooling) <= 1e-9
    row = ledger.rows[-1]
    assert row["n_nucleated"] + row["n_condensed"] >= 1 and abs(row["energy_residual"]) <= ROUND_OFF

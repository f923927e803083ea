"""The mechanical ledger: kinetic energy closes part by part, and each part is what it is by another way to find it."""

import numpy as np
import pytest
import sets
from harness import Stepper, host_only

from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.particles import box_vessel, fluid_block, site_array
from pysph_boiling.phases import Phase
from pysph_boiling.runs.ledger import Ledger
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    ArtificialPressure,
    Buoyancy,
    Cohesion,
    DensityConstraint,
    Drag,
    Expansion,
    MechanicalLedger,
    Oscillation,
    Refill,
    SiteAdhesion,
    Venting,
    XSPHViscosity,
)

pytestmark = host_only  # the mechanical ledger refuses a device

DX, CLOSED = 0.004, 1e-12
EVERYTHING = {**sets.BOIL, "expansion": Expansion(), "oscillation": Oscillation(form="hysteresis"),
              "venting": Venting(mode="remove", free_fraction=0.1, free_steps=1), "refill": Refill(),
              "mechanics": MechanicalLedger()}


def vessel(width=12, fill=9, bubble=2.2, aside=0.0, gravity=None, **effects):
    """A pool in a vessel, with a bubble below its surface and random velocities: (stepper, fluid, row).

    It stands ``aside`` [spacings] of the walls.
    """
    size = (width * DX, 2 * fill * DX, 0.0)
    effects = {**EVERYTHING, **effects}
    effects["container"] = type(effects["container"])(upper=size)
    scheme = BoilingScheme(["fluid"], ["wall"], dim=2, spacing=DX, sites=["sites"], gravity=gravity, **effects)
    common = dict(spacing=DX, dim=2, rho0=WATER.rho_l)
    fluid = fluid_block((aside * DX, 0.0, 0.0), ((width - aside) * DX, fill * DX, 0.0), jitter=0.02, seed=3, **common)
    arrays = [fluid, box_vessel((0.0,) * 3, size, kernel=scheme.kernel, heated_fraction=0.5, **common),
              site_array([(0.5 * width * DX, 0.0, 0.0)], reach=2.4 * DX, spacing=DX)]
    scheme.setup_properties(arrays)
    scheme.set_temperature(fluid, WATER.T_sat - 0.5)
    ball = np.hypot(fluid.x - 0.5 * width * DX, fluid.y - (fill - 4.0) * DX) < bubble * DX
    fluid.phase[ball], fluid.e[ball] = Phase.VAPOUR, WATER.L
    fluid.u[:], fluid.v[:] = 0.05 * np.random.default_rng(4).standard_normal((2, len(fluid.x)))
    ledger = Ledger(scheme)
    ledger.begin([fluid])
    stepper = Stepper(scheme, arrays, dt=1e-3)
    return stepper, fluid, lambda: ledger.row(stepper.t, stepper.dt)


@pytest.mark.filterwarnings("ignore:.*density sweeps")
def test_every_part_of_a_boil_closes():
    stepper, fluid, row = vessel()
    rows = []
    for _ in range(200):
        stepper.step()
        rows.append(row())
        assert abs(rows[-1]["work_residual"]) <= CLOSED
    last = rows[-1]
    assert last["n_vented"] >= 5 and last["n_refilled"] >= 1 and last["n_pushed"] >= 3
    parts = MechanicalLedger().booked(stepper.scheme.scene())
    for part in ("gravity", "density", "expansion", "viscosity", "artificial_pressure", "buoyancy", "cohesion",
                 "drag", "vented", "oscillation"):
        assert part in parts and last[f"work_{part}"] != 0.0, part
    assert last["work_viscosity"] < 0.0 and last["work_vented"] < 0.0 and last["work_drag"] < 0.0
    start, moved = float(fluid.kinetic_start[0]), float(fluid.work_moved[0])
    booked = sum(last[f"work_{part}"] for part in parts)
    assert last["kinetic_energy"] - start == pytest.approx(booked, rel=0.0, abs=CLOSED * moved)


@pytest.mark.filterwarnings("ignore:.*density sweeps")
def test_split_steps_close_too():
    stepper, fluid, row = vessel(viscosity=XSPHViscosity(rate=1.0))
    fluid.v[:] -= 3.0  # 0.75 spacings in a step
    for _ in range(5):
        stepper.step()
    assert row()["n_split"] >= 1 and abs(row()["work_residual"]) <= CLOSED


def test_falling_block():
    """Free fall: gravity does m g h, the kinetic energy lacks m g^2 dt^2/2 a step, which the finite step took."""
    stepper, fluid, row = vessel(fill=4, bubble=0.0, aside=3.0, artificial_pressure=ArtificialPressure(strength=0.0))
    fluid.y[:] += 3.0 * DX
    fluid.u[:] = fluid.v[:] = 0.0
    for name in ("au", "av"):  # as at rest: only gravity acts
        fluid.get(name)[:] = 0.0 if name == "au" else -9.81
    stepper.settle()
    start, dt, n = fluid.y.copy(), stepper.dt, 12
    stepper.step(n)
    now, m = row(), fluid.m.sum()
    fallen = np.sum(fluid.m * (start - fluid.y)) / m
    assert fallen == pytest.approx(0.5 * 9.81 * dt**2 * n * (n + 1), rel=1e-5)  # the site below attracts a little
    assert now["work_gravity"] == pytest.approx(m * 9.81 * fallen, rel=1e-9)
    assert now["kinetic_energy"] == pytest.approx(0.5 * m * (9.81 * n * dt) ** 2, rel=1e-5)
    assert now["work_density"] == pytest.approx(-0.5 * m * (9.81 * dt) ** 2 * n, rel=1e-3)
    assert abs(now["work_viscosity"]) <= 1e-6 * now["work_gravity"]
    assert now["work_expansion"] == now["work_container"] == 0.0  # nothing swells, nothing touches


def column(ramp, **density):
    """A pool at rest on two layers that are to swell to 1.5 in ``ramp`` t*, and nothing else moves it.

    (stepper, fluid, row, low): ``low`` (n,) tells which particles the layers are.
    """
    stepper, fluid, row = vessel(
        fill=16, bubble=0.0, expansion=Expansion(v_exp=1.5, ramp=ramp), density=DensityConstraint(**density),
        buoyancy=Buoyancy(k_bubble=0.0),
        cohesion=Cohesion(sigma=0.0), adhesion=SiteAdhesion(strength=0.0), drag=Drag(rate=0.0),
        refill=Refill(rate=0.0), venting=Venting(mode="remove", free_steps=10**6),
        oscillation=Oscillation(form="hysteresis", min_particles=10**6))
    fluid.u[:] = fluid.v[:] = 0.0
    stepper.dt = stepper.scheme.time_step()
    stepper.step(200)
    assert row()["work_expansion"] == 0.0
    low = fluid.y < 2.0 * DX
    assert 20 < np.count_nonzero(low) < 30
    fluid.phase[low], fluid.e[low] = Phase.VAPOUR, WATER.L
    return stepper, fluid, row, low


@pytest.mark.filterwarnings("ignore:.*density sweeps")
@pytest.mark.parametrize(("parts", "ramp"), [(1, 10), (6, 5)], ids=["steps", "short steps"])
def test_swelling_vapour_does_p_dV(parts, ramp):
    """p is the weight above. It lifts the pool as it swells, and gets back what it gave when it is liquid again."""
    stepper, fluid, row, low = column(ramp)
    stepper.dt /= parts
    assert (stepper.dt < stepper.solver.integrator.motion.short_step) == (parts > 1)
    done, before = [], fluid.swell.copy()
    for goal in (1.5, 1.0):
        expected, then = 0.0, row()
        for _ in range(16 * ramp * parts):
            change, before = fluid.swell - before, fluid.swell.copy()
            stepper.step()
            order = np.argsort(-fluid.y)
            above = np.cumsum(fluid.m[order]) - 0.5 * fluid.m[order]
            expected += 9.81 / (12 * DX) * np.sum(above * (fluid.m * change)[order]) / WATER.rho_l
        assert np.all(np.abs(fluid.swell[low] - goal) < 1e-9) and abs(expected) > 0.1
        now = row()
        done.append(now["work_expansion"] - then["work_expansion"])
        assert done[-1] == pytest.approx(expected, rel=0.12)  # measured .98 to 1.09 times
        assert done[-1] == pytest.approx(then["work_gravity"] - now["work_gravity"], rel=0.12)  # .96 to 1.06
        assert abs(now["work_residual"]) <= CLOSED
        fluid.phase[low], fluid.e[low] = Phase.LIQUID, -1.0
    assert done[0] > 0.0 > done[1] and abs(sum(done)) < 0.1 * done[0]  # measured .055 and .065


@pytest.mark.filterwarnings("ignore:.*density sweeps")
def test_short_step_after_long_ones_does_no_more_than_its_share():
    """What a long step has swelled is in the positions to come, but not in the velocity of a short one."""
    stepper, fluid, row, low = column(ramp=5.0, min_sweeps=6)
    stepper.step(40)
    works = []
    for steps, dt in ((10, stepper.dt), (1, 0.01 * stepper.dt)):
        then, stepper.dt = row()["work_expansion"], dt
        stepper.step(steps)
        works.append((row()["work_expansion"] - then) / steps)
    assert works[0] > 1e-4 and -0.01 * works[0] < works[1] < 0.1 * works[0]


def test_container_takes_the_speed_at_which_it_is_hit():
    """A row of particles, below rest density all alone, is thrown at the lid and slides on along it."""
    stepper, fluid, row = vessel(width=40, fill=4, bubble=0.0, aside=16.0, gravity=(0.0, 0.0, 0.0),
                                 refill=Refill(rate=0.0), expansion=None, oscillation=None)
    fluid.x[:], fluid.y[:] = DX * np.linspace(4.0, 36.0, len(fluid.x)), 6.0 * DX
    fluid.u[:], fluid.v[:] = 0.1, 1.0
    stepper.step(12)
    now, m = row(), fluid.m.sum()
    assert now["n_contacts"] >= len(fluid.x) == 32
    assert now["work_container"] == pytest.approx(-0.5 * m, rel=1e-9)
    assert now["kinetic_energy"] == pytest.approx(0.5 * m * 0.1**2, rel=1e-9)
    assert abs(now["work_density"]) <= 1e-12 * m and "work_expansion" not in now


def test_viscosity_takes_what_its_pairs_lose():
    """Its work in the second step: -r/2 sum m_i m_j/rho0 |v_i - v_j|^2 W dt over all pairs at the first one's end."""
    stepper, fluid, row = vessel(bubble=0.0, gravity=(0.0, 0.0, 0.0), refill=Refill(rate=0.0),
                                 viscosity=XSPHViscosity(rate=20.0), expansion=None, oscillation=None)
    stepper.step()
    first, scene, kernel = row(), stepper.scheme.scene(), stepper.scheme.kernel
    rate, power = 20.0, 0.0
    for i in range(len(fluid.x)):
        r = np.hypot(fluid.x - fluid.x[i], fluid.y - fluid.y[i])
        for j in np.flatnonzero(r < scene.support):
            v2 = (fluid.u[i] - fluid.u[j])**2 + (fluid.v[i] - fluid.v[j])**2
            power -= 0.5 * rate * fluid.m[i] * fluid.m[j] / scene.rho0 * v2 * kernel.kernel([0.0] * 3, r[j], scene.h)
    stepper.step()
    work = row()["work_viscosity"] - first["work_viscosity"]
    assert work == pytest.approx(power * stepper.dt, rel=0.05)  # first order in dt, and neighbours of x* not of x


def test_drag_slows_a_bubble_in_liquid_at_rest():
    stepper, fluid, row = vessel(venting=Venting(mode="remove", free_fraction=1.0, free_steps=50))
    bubble = fluid.phase == Phase.VAPOUR
    fluid.u[:] = fluid.v[:] = 0.0
    fluid.u[bubble] = 0.2
    stepper.step(2)
    start = 0.5 * fluid.m[bubble].sum() * 0.2**2
    assert -start < row()["work_drag"] < 0.0


def test_ledger_is_refused_where_it_cannot_read(monkeypatch):
    monkeypatch.setattr("pysph_boiling.schemes.effects.mechanics.get_backend", lambda: "opencl")
    with pytest.raises(ValueError, match="mechanical ledger.*--mechanics"):
        vessel()

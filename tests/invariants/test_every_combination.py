"""Energy and mass close in every mode and every combination of effects.

The switches below are combined so that every pair of their values occurs in some run (a covering set of strength two);
each run starts with bubbles, subcooled vapour and superheat, so that something happens in every one of them. Forms that
differ in a force alone are left out: forces move no energy, and each new set of equations is half a minute to compile.
"""
import itertools

import numpy as np
import pytest
from harness import Stepper

from pysph_boiling.evaluation.stress.scenes import EVERYTHING
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.particles import box_vessel, fluid_block, site_array
from pysph_boiling.phases import Phase
from pysph_boiling.runs.ledger import Ledger
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    AmbientLoss,
    BoxContainer,
    Condensation,
    Convection,
    HeatConduction,
    Heater,
    HeatSource,
    Oscillation,
    PhaseChange,
    Venting,
)
from pysph_boiling.schemes.modes import effects_in_mode, widen_sites

DX, T_SAT, L = 0.004, WATER_1ATM.T_sat, WATER_1ATM.L

SWITCHES = {
    "oscillation": (None, "relative", "rayleigh_plesset"),
    "mode": ("dynamic", "gu", "li_xiao"),
    "condensation": (None, "latent", "paper"),
    "convection": (None, "boussinesq"),
    "venting": (None, "lid", "remove"),
    "laplacian": ("cleary_monaghan", "paper"),
    "interrupt": ("hold", "convert"),
    "heater": ("temperature", "flux"),
    "loss": (False, True),
    "dynamic_nucleation": (False, True),
    "pooling": (False, True),
    "expansion": (False, True),
    "vapour_as_site": (True, False),
    "positions": ("predicted", "corrected"),
}


def possible(row):
    """Whether values (of some switches, or of all) may occur together."""
    if row.get("oscillation") == "rayleigh_plesset" and row.get("expansion") is False:
        return False
    return not (row.get("dynamic_nucleation") and row.get("mode") in ("gu", "li_xiao"))


def covering_set():
    """Rows (switch -> value) that hold every possible pair of values: greedy, the same on every machine."""
    names, rows = list(SWITCHES), []

    def pairs(row, name):
        """Pairs of the value of ``name`` with all others of the row, in the order of the switches."""
        couples = (((name, row[name]), (other, row[other])) for other in row if other != name)
        return {tuple(sorted(couple, key=lambda item: names.index(item[0]))) for couple in couples}

    missing = {((a, x), (b, y)) for a, b in itertools.combinations(names, 2) for x in SWITCHES[a] for y in SWITCHES[b]
               if possible({a: x, b: y})}
    while missing:
        row = dict(min(missing, key=repr))
        for name in names:
            if name not in row:
                fits = [{**row, name: value} for value in SWITCHES[name] if possible({**row, name: value})]
                row = fits[int(np.argmax([len(pairs(fit, name) & missing) for fit in fits]))]
        rows.append(row)
        missing -= set().union(*(pairs(row, name) for name in names))
    return rows


ROWS = covering_set()


def effects_of(row, upper):
    """The effects of a row."""
    heater = Heater(temperature=T_SAT + 60.0) if row["heater"] == "temperature" else Heater(flux=2e4)
    effects = EVERYTHING | dict(
        container=BoxContainer(upper=upper), heat=HeatConduction(
            laplacian=row["laplacian"], positions=row["positions"], time_scaling=800.0),
        heater=heater, phases=PhaseChange(interrupt=row["interrupt"], vapour_as_site=row["vapour_as_site"]),
        loss=AmbientLoss(coefficient=100.0), source=HeatSource(density=1e4))
    for slot, make in {"condensation": Condensation, "convection": Convection, "oscillation": Oscillation}.items():
        effects[slot] = row[slot] and make(form=row[slot])
    effects["venting"] = row["venting"] and Venting(mode=row["venting"])
    built = {slot: row.get(slot, True) for slot in effects} | {"source": row["loss"],
                                                               "refill": row["venting"] == "remove"}
    return effects_in_mode(row["mode"], {slot: effect for slot, effect in effects.items() if built[slot]})


def vessel(row):
    """A 3-D vessel with a hot layer, a subcooled bubble, and a bubble near the surface."""
    n = 9
    upper = (n * DX, n * DX, 1.6 * n * DX)
    scheme = BoilingScheme(["fluid"], ["wall"], dim=3, spacing=DX, sites=["sites"], **effects_of(row, upper))
    common = dict(spacing=DX, dim=3, rho0=scheme.rho0)
    fluid = fluid_block((0.0, 0.0, 0.0), (n * DX,) * 3, jitter=0.02, **common)
    arrays = [fluid, box_vessel((0.0,) * 3, upper, kernel=scheme.kernel, heated_fraction=0.8, **common),
              site_array([(0.5 * n * DX, 0.5 * n * DX, 0.0)], reach=2.4 * DX, spacing=DX)]
    widen_sites(scheme, arrays)
    scheme.setup_properties(arrays)
    scheme.set_temperature(fluid, T_SAT - 3.0 + 100.0 * np.exp(-fluid.z / (1.5 * DX)))
    for height, e in ((0.45, 0.8 * L), (0.85, 1.01 * L)):
        inside = (fluid.x - 0.5 * n * DX) ** 2 + (fluid.y - 0.5 * n * DX) ** 2 + (fluid.z - height * n * DX) ** 2
        inside = inside < (1.6 * DX) ** 2
        fluid.phase[inside], fluid.e[inside] = Phase.VAPOUR, e
    return scheme, arrays


def test_rows_cover_every_pair():
    for (a, x), (b, y) in itertools.product(*[[(name, value) for name in SWITCHES for value in SWITCHES[name]]] * 2):
        if a != b and possible({a: x, b: y}):
            assert any(row[a] == x and row[b] == y for row in ROWS), (a, x, b, y)
    assert all(possible(row) for row in ROWS)


@pytest.mark.slow
@pytest.mark.parametrize("row", ROWS, ids=[f"{n}-{row['mode']}-{row['oscillation']}" for n, row in enumerate(ROWS)])
def test_ledger_closes(row):
    scheme, arrays = vessel(row)
    stepper = Stepper(scheme, arrays)
    ledger = Ledger(scheme)
    ledger.begin(scheme.arrays)
    stepper.tools.append(ledger)
    stepper.step(400)
    table = ledger.table()
    assert np.max(np.abs(table["energy_residual"])) <= 1e-10
    assert np.max(np.abs(table["mass_residual"])) <= 1e-13
    assert table["energy_in"][-1] > 0.0 and np.all(np.isfinite(np.concatenate(list(table.values()))))
    events = {name: table[name][-1] for name in table if name in (
        "n_nucleated", "n_burst", "n_condensed", "n_vented", "n_refilled", "n_emitted", "n_interrupted",
        "energy_sites")}
    assert sum(events.values()) > 0, events
    if row["condensation"] == "latent":
        assert events["n_condensed"] > 0
    if row["dynamic_nucleation"]:
        assert events["n_burst"] > 0
    if row["laplacian"] == "paper":
        assert table["energy_model_leak"][-1] != 0.0

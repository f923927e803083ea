"""Extreme heat fluxes, conductivities, temperatures and latent heats."""
from functools import partial

import numpy as np

from pysph_boiling.evaluation.stress.case import Case
from pysph_boiling.evaluation.stress.ends import accounted, all_of, count, temperatures
from pysph_boiling.evaluation.stress.scenes import BOIL, DX, EVERYTHING, NO_HEAT, T_SAT, ball, block, vessel
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.schemes.effects import Buoyancy, HeatConduction, Heater

__all__ = ["cases"]

FLUX = 2e4  # [W/m^2] before the factor A, as in the calibration
WATER = WATER_1ATM
HOTTEST = T_SAT + 60.0  # of the heater


def pool(dim, changes=None, effects=BOIL, layers=10, **options):
    """Water on a heated base; ``changes`` replaces some of the effects."""
    upper, size = ((12, layers), (12, 1.6 * layers)) if dim == 2 else ((8, 8, layers), (8, 8, 1.6 * layers))
    return vessel(dim, size, block(dim, (0.0,) * dim, upper), {**effects, **(changes or {})}, **options)


def flux(dim, times):
    """A high flux into a fluid without a critical point (ten times the flux heats water past it in 22 steps)."""
    return pool(dim, {"heater": Heater(flux=FLUX * times)}, material=WATER.with_(T_crit=1e9))


def stiff(dim, excess):
    """A conductivity with which the explicit limit of the heat step is exceeded ``excess``-fold."""
    step = 0.07 * np.sqrt(DX / 9.81)
    limit = 0.1 * WATER.rho_l * WATER.c_l * (1.2 * DX) ** 2 / WATER.k_l
    return pool(dim, {"heat": HeatConduction(enhancement=excess * limit / step)}, layers=6)


def contrast(dim):
    """Vapour that is 200 K hotter than the adjacent liquid and conducts 1e4 times worse."""
    middle = (6.0, 5.0) if dim == 2 else (4.0, 4.0, 5.0)
    return pool(dim, {"heater": None}, vapour=ball(middle, 2.5), e_vapour=WATER.L + 200.0 * WATER.c_v,
                material=WATER.with_(k_v=WATER.k_l / 1e4), temperature=T_SAT - 10.0)


def quench(dim):
    """A bubble 300 K above saturation in water of 0 degrees Celsius, without buoyancy and with heat 20 times faster."""
    middle = (6.0, 4.0) if dim == 2 else (4.0, 4.0, 4.0)
    effects = {"heater": None, "buoyancy": Buoyancy(k_bubble=0.0), "heat": HeatConduction(time_scaling=16e3)}
    return pool(dim, effects, vapour=ball(middle, 2.0), e_vapour=WATER.L + 300.0 * WATER.c_v,
                temperature=273.15)


def burst(dim):
    """Water 100 K above saturation everywhere, with a threshold of 30 K."""
    effects = {**NO_HEAT, "heater": Heater(temperature=T_SAT + 100.0)}
    return pool(dim, effects, EVERYTHING, layers=8, temperature=T_SAT + 100.0)


def flicker(dim):
    """Enthalpies within round-off of saturation near a site and vapour, so that phases may change at every step."""
    def temperature(points):
        return T_SAT + np.random.default_rng(0).choice([-1e-9, 0.0, 1e-9], len(points))

    return pool(dim, {"heater": None}, temperature=temperature, vapour=ball((3.0,) * dim, 1.6))


def latent(dim, L):
    """Water with another latent heat."""
    return pool(dim, {"heater": Heater(temperature=T_SAT + 20.0)}, material=WATER.with_(L=L))


def delivered(run):
    """The heater must deliver flux times area times time, for any flux."""
    flux = run.scene.effects["heater"].flux * run.scene.effects["heat"].time_scaling
    area = np.sum(run.setup.arrays[1].heated) * run.scene.spacing ** (run.scene.dim - 1)
    given = run.last("energy_heater") + run.last("energy_undelivered")
    if not abs(given / (flux * area * run.steps * run.dt) - 1.0) <= 1e-9:
        yield f"the heater delivered {given:.4g} J instead of {flux * area * run.steps * run.dt:.4g} J"
    if run.last("energy_undelivered") > 0.05 * given:
        yield f"{run.last('energy_undelivered') / given:.0%} of the heater's energy was not delivered"


def nothing_made(run):
    """A state within round-off of saturation must make and lose no vapour."""
    made = sum(run.events[name] for name in ("n_nucleated", "n_condensed"))
    if made:
        yield f"{made} particles vaporised or condensed because of round-off"


def cases():
    """Yields the cases of this module."""
    for dim in (2, 3):
        quick = 100 if dim == 2 else 0
        for times in (1, 10, 100, 1000):
            yield Case(name=f"flux-{times}-{dim}d", hard=f"{times} times the default heat flux", steps=600, quick=quick,
                       build=partial(flux, dim, times), end=all_of(accounted, delivered))
        yield Case(name=f"conductivity-1000-{dim}d", hard="explicit limit of the heat step exceeded 1000-fold",
                   steps=20, quick=5 if dim == 2 else 0, build=partial(stiff, dim, 1000.0),
                   end=all_of(accounted, temperatures(T_SAT - 2.0, HOTTEST), count("heat_subcycles", 1000)))
        yield Case(name=f"contrast-{dim}d", hard="conductivity ratio 1e4 between neighbours", steps=800, quick=quick,
                   build=partial(contrast, dim),
                   end=all_of(accounted, temperatures(T_SAT - 10.0, T_SAT + 200.0)))
        yield Case(name=f"heater-250K-{dim}d", hard="heater 250 K above saturation", steps=800, quick=quick,
                   build=partial(pool, dim, {"heater": Heater(temperature=T_SAT + 250.0)}),
                   end=all_of(accounted, temperatures(T_SAT - 2.0, T_SAT + 250.0), count("n_nucleated", 1)))
        yield Case(name=f"quench-{dim}d", hard="vapour at 400 °C in water at 0 °C", steps=1500, quick=4 * quick,
                   build=partial(quench, dim),
                   end=all_of(accounted, temperatures(273.15, T_SAT + 300.0), count("n_condensed", 1)))
        yield Case(name=f"burst-{dim}d", hard="all liquid above the dynamic threshold at once", steps=800,
                   quick=quick, build=partial(burst, dim), end=all_of(accounted, count("n_burst", 5)))
        yield Case(name=f"flicker-{dim}d", hard="all liquid at T_sat to round-off", steps=500, quick=quick,
                   build=partial(flicker, dim), end=all_of(accounted, nothing_made))
    yield Case(name="heater-1000K-2d", hard="heater 1000 K above saturation, past the critical point", steps=1, quick=1,
               build=partial(pool, 2, {"heater": Heater(temperature=T_SAT + 1000.0)}),
               refused="heater.temperature must be below the critical point")
    yield Case(name="latent-zero-2d", hard="zero latent heat", steps=1, quick=1, build=partial(latent, 2, 0.0),
               refused="L of water at 1 atm must be > 0 J/kg")
    for L in (1e4, 1e2):
        yield Case(name=f"latent-{L:g}-2d", hard=f"latent heat {L:g} J/kg instead of 2.3e6", steps=200, quick=40,
                   build=partial(latent, 2, L), end=all_of(accounted, count("n_nucleated", 1)))

"""Detachment (the paper, 4.2.1): a bubble grown by heating at one site leaves larger, the stronger it adheres."""
import numpy as np
from harness import Stepper
from sets import scheme

from pysph_boiling.analysis.bubbles import Departures
from pysph_boiling.particles import box_vessel, fluid_block, site_array
from pysph_boiling.schemes.effects import BoxContainer, HeatConduction, Heater, SiteAdhesion, Venting

# In units of gravity. Measured N (median of 5): 5, 9, 12, 17. Above 10 g it saturates at 16: adhesion holds what lies
# within its range, and the bubble pinches off above that.
ADHESION = (0.0, 2.5, 5.0, 10.0)
SPACING, WIDTH, FILL = 0.002, 24, 20


def size_at_departure(adhesion, departures=3, longest=4000):
    """Median N of the first bubbles to leave a single heated site in a 2-D vessel."""
    upper = (WIDTH * SPACING, 1.6 * FILL * SPACING, 0.0)
    boil = scheme("boil", dim=2, spacing=SPACING, changes=dict(
        container=BoxContainer(lower=(0.0, 0.0, 0.0), upper=upper), heat=HeatConduction(acceleration=1000.0),
        heater=Heater(temperature=433.15), adhesion=SiteAdhesion(strength=adhesion), venting=Venting(T_feed=371.15)))
    common = dict(spacing=SPACING, dim=2, rho0=boil.rho0, hdx=boil.hdx)
    middle = np.array([[0.5 * upper[0], 0.0, 0.0]])
    arrays = [
        fluid_block((0.0, 0.0, 0.0), (upper[0], FILL * SPACING, 0.0), jitter=0.01, seed=1, **common),
        box_vessel((0.0, 0.0, 0.0), upper, kernel=boil.kernel, heated_fraction=0.6, **common),
        site_array(middle, reach=2.4 * SPACING, spacing=SPACING),
    ]
    boil.setup_properties(arrays)
    boil.set_temperature(arrays[0], 371.15)
    stepper = Stepper(boil, arrays)
    events = next(tool for tool in stepper.tools if isinstance(tool, Departures)).events
    assert not np.any(arrays[0].phase == 3), "the bubble must be grown, not placed"
    while len(events) < departures and stepper.solver.count < longest:
        stepper.step(50)
    sizes = [n for _, n in events]
    assert len(sizes) >= departures, f"adhesion {adhesion} g: {len(sizes)} bubbles left in {stepper.t:.2f} s"
    return float(np.median(sizes[:departures]))


def test_bubble_at_departure_grows_with_adhesion():
    sizes = [size_at_departure(adhesion) for adhesion in ADHESION]
    assert np.all(np.diff(sizes) > 0.0), f"N at departure for adhesion {ADHESION} g: {sizes}"

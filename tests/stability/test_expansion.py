"""Expansion to just below what is refused, and in a vessel that it fills; crowded sites. Whole runs of 2-D boils."""
import numpy as np
import pytest

from pysph_boiling.evaluation.problems.from_scene import from_scene
from pysph_boiling.evaluation.stress.judge import load_bounds
from pysph_boiling.examples.steady_boiling import SteadyBoiling
from pysph_boiling.examples.superheat_sites import SuperheatSites
from pysph_boiling.schemes.effects import BoxContainer, DynamicNucleation, Expansion, Heater, PhaseChange

FLAT = dict(dim=2, spacing=0.002, heated=0.7, time_scaling=1000.0)


def bursting(v_exp, top):
    """Vapour from bursts and two sites, none of which leaves; ``top`` is the height of the vessel over the filling.

    The base has a temperature: with a given flux it burns out under the vapour, and the water there passes 647 K.
    """
    width, fill = 20, 14
    upper = (width * FLAT["spacing"], top * fill * FLAT["spacing"], 0.0)
    _, stepper = from_scene(SuperheatSites, effects=dict(
        container=BoxContainer(upper=upper), expansion=Expansion(v_exp=v_exp), venting=None, pooling=None,
        buoyancy=None, heater=Heater(temperature=573.0),
        dynamic_nucleation=DynamicNucleation(superheat_limit=10.0, radius=2.4),
        phases=PhaseChange(vapour_as_site=False)), width=width, fill=fill, sites=2, duration=2.0, **FLAT)
    fluid = stepper.arrays["fluid"]
    return stepper, fluid, load_bounds()["rules"]["speed"]["bound"] * np.sqrt(2.0 * 9.81 * fill * FLAT["spacing"])


@pytest.mark.slow
@pytest.mark.parametrize("v_exp", [3.15, 2.5])
def test_pool_of_vapour_that_swells_far_stays_calm(v_exp):
    """At 4 it reached a thousand m/s; 3.15 has 1.0 m/s at most in 1 s, of the 1.48 allowed."""
    stepper, fluid, most = bursting(v_exp, 1.5)
    fastest = 0.0
    for _ in range(int(1.0 / stepper.dt)):
        stepper.step()
        fastest = max(fastest, float(np.max(np.hypot(fluid.u, fluid.v))))
    assert np.count_nonzero(fluid.swell > 0.9 * v_exp) >= 20
    assert 0.05 < fastest < most


@pytest.mark.slow
@pytest.mark.parametrize("v_exp", [3.1, 2.5])
def test_vessel_that_vapour_has_filled_stays_calm(v_exp):
    """It came apart, at 24 and 42 m/s, where vapour swelled beyond the room that there is."""
    stepper, fluid, most = bursting(v_exp, 1.08)
    room = stepper.scheme.effects["container"].volume(stepper.scheme.scene())
    fastest, fullest = 0.0, 0.0
    with pytest.warns(UserWarning, match="vapour has filled its container"):
        for _ in range(int(0.6 / stepper.dt)):
            stepper.step()
            fastest = max(fastest, float(np.max(np.hypot(fluid.u, fluid.v))))
            fullest = max(fullest, float(np.sum(fluid.m * fluid.swell)) / stepper.scheme.rho0 / room)
    assert 1.0 < fullest < 1.03 and 0.05 < fastest < most


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*nucleation sites are closer than")
@pytest.mark.parametrize(("sites", "departs"), [(9, False), (7, True)])
def test_bubbles_depart_from_sites_that_are_far_enough_apart(sites, departs):
    """2.33 and 3.0 spacings apart: none, and 3 to 4 in 3 s."""
    scene, stepper = from_scene(SteadyBoiling, width=30, fill=35, sites=sites, pattern="regular", smallest_cavity=0.0,
                                duration=3.0, seed=1, **FLAT)
    (departures,) = (tool for tool in stepper.tools if type(tool).__name__ == "Departures")
    stepper.step(int(3.0 / stepper.dt))
    assert np.count_nonzero(stepper.arrays["fluid"].bubble_n) > 10
    assert bool(departures.events) is departs

"""A guest in another scheme: its effects, what it gives the arrays, and what it refuses. Nothing is compiled."""
import numpy as np
import pytest
from full import CLASSES, FULL
from pysph.base.utils import get_particle_array
from pysph.sph.scheme import WCSPHScheme

from pysph_boiling.particles import site_array
from pysph_boiling.schemes import effects
from pysph_boiling.schemes.guest import BoilingGuest

DX = 0.01
OWN_MOTION = {"density", "container", "viscosity", "artificial_pressure", "wall_multipliers", "mechanics", "expansion",
              "oscillation", "refill"}
GUEST = {slot: effect for slot, effect in FULL.items() if slot not in OWN_MOTION}


def guest(**changed):
    return BoilingGuest(["fluid"], ["wall"], ["sites"], **{**dict(dim=2, spacing=DX, hdx=1.3), **GUEST, **changed})


def arrays():
    """A block of water on a wall in PySPH's WCSPH scheme, and a site."""
    x, y = (grid.ravel() for grid in np.mgrid[0.005:0.1:DX, -0.025:0.05:DX])
    made = [get_particle_array(name=name, x=x[where], y=y[where], m=958.0 * DX**2, rho=958.0, h=1.3 * DX)
            for name, where in (("fluid", y > 0.0), ("wall", y < 0.0))]
    scheme = WCSPHScheme(["fluid"], ["wall"], dim=2, rho0=958.0, c0=10.0, h0=1.3 * DX, hdx=1.3)
    scheme.setup_properties(made)
    return [*made, site_array([(0.05, 0.0, 0.0)], reach=0.024, spacing=DX)]


def test_effects_that_need_our_density_constraint_say_so_and_no_others():
    assert {cls.slot for cls in CLASSES if not cls.in_guest} == OWN_MOTION
    made = guest()
    assert set(made.scheme.effects) == set(GUEST)
    assert {term.place.split(".")[0] for term in made.scheme.terms()} == {
        "heat", "phases", "dynamic_nucleation", "bubbles", "forces"}
    own = {**FULL, "density": effects.DensityConstraint(), "mechanics": effects.MechanicalLedger(),
           "artificial_pressure": effects.ArtificialPressure()}
    for slot in OWN_MOTION:
        with pytest.raises(ValueError, match=rf"effect '{slot}' \(.*\) needs the density constraint of BoilingScheme"):
            guest(**{slot: own[slot]})


def test_what_an_effect_requires_is_still_asked_for():
    with pytest.raises(ValueError, match=r"effect 'drag' \(Drag\) needs the effect 'phases'"):
        BoilingGuest(["fluid"], dim=2, spacing=DX, drag=effects.Drag())


def test_arrays_keep_what_the_scheme_needs_and_get_their_own_outputs():
    particles = arrays()
    fluid, wall, _ = particles
    before = {pa.name: (set(pa.properties), set(pa.output_property_arrays)) for pa in particles}
    heated = (wall.y > -DX) & (wall.x > 0.05)
    guest().setup(particles, heated={"wall": heated})
    for pa in particles:
        properties, outputs = before[pa.name]
        assert properties <= set(pa.properties) and outputs <= set(pa.output_property_arrays)
        assert set(pa.output_property_arrays) <= set(pa.properties)  # PySPH's writer would raise KeyError
    assert {"e", "phase", "departed"} <= set(fluid.output_property_arrays)
    assert not {"e", "phase"} & set(wall.properties)
    np.testing.assert_array_equal(wall.heated, heated)
    assert wall.heated.sum() == 5


@pytest.mark.parametrize(("change", "error"), [
    (dict(hdx=1.2), "smoothing lengths of 'fluid' are 1.3 spacings: pass hdx=1.3"),
    (dict(heated={"floor": np.ones(30)}), "no wall of the guest 'floor'"),
    (dict(heated={"wall": np.ones(4)}), r"heated of 'wall' must have shape \(30,\), got \(4,\)"),
    (dict(heated=None), "no wall particle is heated"),
])
def test_arrays_that_do_not_fit_are_refused(change, error):
    options = {"heated": {"wall": np.ones(30)}, **change}
    heated = options.pop("heated")
    with pytest.raises(ValueError, match=error):
        guest(**options).setup(arrays(), heated=heated)


def test_step_in_which_drag_overshoots_is_refused():
    made = guest()
    rate = GUEST["drag"].rate_in(made.scheme.scene())
    made.check_time_step(0.89 / rate)
    with pytest.raises(ValueError, match="the time step must be at most"):
        made.check_time_step(0.91 / rate)


def test_models_of_others_can_be_guests():
    gu = guest(mode="gu").scheme.effects
    assert gu["phases"].kinetic == "always" and not {"dynamic_nucleation", "pooling"} & set(gu)
    assert "storage" in guest(mode="li_xiao").scheme.effects



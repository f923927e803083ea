"""States and temperature: enthalpy and temperature undo each other, and the table of edges hangs together."""
from inspect import signature
from itertools import combinations

import numpy as np
import pytest

from pysph_boiling.equations import phase_change
from pysph_boiling.equations.helpers import boiling_capacity, boiling_temperature
from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.phases import EDGES, Phase, enthalpy, heat_capacity, temperature
from pysph_boiling.schemes.effects import HeatConduction

L, T_SAT, C_V = WATER.L, WATER.T_sat, WATER.c_v
PARTS = {"negative": {"negative"}, "stored": {"stored"}, "full": {"full"}, "not negative": {"stored", "full"},
         "lacking": {"negative", "stored"}}


@pytest.mark.parametrize("T", [1.0, 293.15, T_SAT, 400.0, 647.0])
def test_enthalpy_and_temperature_undo_each_other(T):
    e = enthalpy(T, WATER)
    assert (e < 0.0) == (T < T_SAT)
    phase = Phase.LIQUID if T < T_SAT else Phase.SUPERHEATED
    assert temperature(e, phase, WATER) == pytest.approx(T, rel=1e-15)


def test_enthalpy_of_saturated_liquid_is_zero_and_slopes_by_its_heat_capacity():
    assert enthalpy(T_SAT, WATER) == 0.0
    assert enthalpy(T_SAT + 2.0, WATER) - enthalpy(T_SAT + 1.0, WATER) == pytest.approx(4216.0, rel=1e-12)


@pytest.mark.parametrize("e, phase, e_lat, T", [
    (-4216.0, Phase.LIQUID, 0.0, T_SAT - 1.0),
    (4216.0, Phase.SUPERHEATED, 0.0, T_SAT + 1.0),
    (0.0, Phase.TRANSITION, 0.0, T_SAT),
    (0.5 * L, Phase.TRANSITION, 0.0, T_SAT),  # latent heat moves no temperature
    (L, Phase.TRANSITION, 0.0, T_SAT),
    (L, Phase.VAPOUR, 0.0, T_SAT),
    (L + C_V, Phase.VAPOUR, 0.0, T_SAT + 1.0),
    (L - C_V, Phase.VAPOUR, 0.0, T_SAT - 1.0),
    (0.3 * L, Phase.SUPERHEATED, 0.5 * L, T_SAT),  # held: nothing shows up to e_lat
    (0.5 * L, Phase.SUPERHEATED, 0.5 * L, T_SAT),
    (0.5 * L + 0.5 * (4216.0 + 2077.0), Phase.SUPERHEATED, 0.5 * L, T_SAT + 1.0),  # half of it is vapour
    (0.9 * L + 421.6 + 1869.3, Phase.SUPERHEATED, 0.9 * L, T_SAT + 1.0),
    (L + C_V, Phase.SUPERHEATED, L, T_SAT + 1.0),
    (-4216.0, Phase.SUPERHEATED, 0.5 * L, T_SAT - 1.0),
])
def test_temperature_of_each_state(e, phase, e_lat, T):
    assert temperature(e, phase, WATER, e_lat) == pytest.approx(T, rel=1e-14)


def test_temperature_is_continuous_where_its_reading_changes():
    """At saturation, at the end of the latent heat, and at the end of the heat that is held."""
    def around(e, low, high, e_lat=0.0):
        return temperature(np.array([e - 1e-6, e + 1e-6]), np.array([low, high]), WATER, e_lat)

    for readings in (around(0.0, Phase.LIQUID, Phase.TRANSITION), around(0.0, Phase.LIQUID, Phase.SUPERHEATED),
                     around(L, Phase.TRANSITION, Phase.VAPOUR),
                     around(0.4 * L, Phase.SUPERHEATED, Phase.SUPERHEATED, 0.4 * L),
                     around(0.0, Phase.LIQUID, Phase.SUPERHEATED, 0.4 * L)):
        np.testing.assert_allclose(readings, T_SAT, atol=1e-9)  # 1e-6 J/kg over c


HELD, SUPERHEAT = np.meshgrid(np.linspace(0.0, L, 41), np.linspace(0.0, WATER.T_crit - T_SAT, 41))


def mixture(held, superheat):
    """Enthalpy [J/kg]: saturated liquid, what it holds, and the superheat of both of its parts."""
    x = held / L
    return held + (1.0 - x) * WATER.c_l * superheat + x * C_V * superheat


def test_temperature_of_what_holds_latent_heat_is_that_of_a_mixture_of_liquid_and_vapour():
    T = temperature(mixture(HELD, SUPERHEAT), Phase.SUPERHEATED, WATER, HELD)
    np.testing.assert_allclose(T, T_SAT + SUPERHEAT, rtol=1e-14)


def test_becoming_vapour_heats_nothing():
    """From no superheat up to the critical point, with any held heat; with all of it, T stays as it is."""
    e = mixture(HELD, SUPERHEAT)
    gain = temperature(e, Phase.VAPOUR, WATER) - temperature(e, Phase.SUPERHEATED, WATER, HELD)
    assert gain.max() <= 1e-10  # K, round-off
    np.testing.assert_allclose(gain[HELD == L], 0.0, atol=1e-10)
    np.testing.assert_array_less(gain[HELD < L], -10.0)  # at least L/40 is lacking


def test_superheat_up_to_which_becoming_vapour_heats_nothing():
    bound, held = L / (WATER.c_l - C_V), HELD[0, :-1]
    assert bound > WATER.T_crit - T_SAT
    for superheat, sign in ((bound - 1.0, -1.0), (bound + 1.0, 1.0)):
        e = mixture(held, superheat)
        gain = temperature(e, Phase.VAPOUR, WATER) - temperature(e, Phase.SUPERHEATED, WATER, held)
        assert np.all(sign * gain > 0.0)


def test_heat_capacity_without_held_heat_is_exactly_that_of_liquid():
    assert heat_capacity(0.0, WATER) == boiling_capacity(0.0, L, WATER.c_l, C_V) == WATER.c_l
    np.testing.assert_array_equal(heat_capacity([-L, 2.0 * L], WATER), [WATER.c_l, heat_capacity(L, WATER)])


@pytest.mark.parametrize("c_v", [0.05, 0.5, 2.0])
def test_liquid_counts_as_wet_whatever_it_holds(c_v):
    """Its conductivity goes with its heat capacity, but stays above what counts as vapour."""
    material, heat = WATER.with_(c_v=c_v * WATER.c_l), HeatConduction(time_scaling=800.0)
    state = dict(T_sat=T_SAT, L=L, c_l=material.c_l, c_v=material.c_v)
    kernel = phase_change.PhaseTemperature("fluid", None, **state, k_l=heat.conductivity(material.k_l),
                                           k_v=heat.conductivity(material.k_v))
    e_lat = np.linspace(0.0, L, 9)
    particles = dict(d_e=e_lat + 1e4, d_e_lat=e_lat, d_phase=np.full(9, Phase.SUPERHEATED), d_T=np.zeros(9),
                     d_k=np.zeros(9), d_ae=np.zeros(9))
    for i in range(9):
        kernel.initialize(i, **particles)
    k = particles["d_k"]
    diffusivity = k / heat_capacity(e_lat, material)
    np.testing.assert_allclose(diffusivity, heat.conductivity(material.k_l) / material.c_l, rtol=1e-14)
    assert k[0] == heat.conductivity(material.k_l)  # to the last bit
    assert heat.conductivity(material.k_v) < 0.9 * heat.k_liquid_min(material) and heat.k_liquid_min(material) < k.min()


@pytest.mark.parametrize("e, T", [(-L, T_SAT), (0.0, T_SAT), (L - 1.0, T_SAT), (L, T_SAT), (L + C_V, T_SAT + 1.0)])
def test_vapour_stays_at_saturation_where_what_it_lacks_is_latent(e, T):
    assert temperature(e, Phase.VAPOUR, WATER, subcooling=0.0) == pytest.approx(T, rel=1e-14)
    for phase in (Phase.LIQUID, Phase.TRANSITION, Phase.SUPERHEATED):  # and only vapour
        assert temperature(e, phase, WATER, subcooling=0.0) == temperature(e, phase, WATER)


@pytest.mark.parametrize("subcooling", [0.0, 1.0])
def test_kernel_helper_is_the_twin(subcooling):
    random = np.random.default_rng(1)
    e, e_lat, phase = random.uniform(-L, 2.0 * L, 400), random.uniform(0.0, L, 400), random.integers(0, 4, 400)
    helper = [boiling_temperature(*row, T_SAT, L, WATER.c_l, WATER.c_v, subcooling) for row in zip(e, e_lat, phase)]
    np.testing.assert_array_equal(helper, temperature(e, phase, WATER, e_lat, subcooling))


@pytest.mark.parametrize("subcooling", [0.0, 1.0])
@pytest.mark.parametrize("name", ["PhaseTemperature", "PhaseEdges"])
def test_kernels_hand_the_reading_of_vapour_on(name, subcooling):
    """The kernels run as Python, on one particle."""
    constants = dict(T_sat=T_SAT, L=L, c_l=WATER.c_l, c_v=WATER.c_v, k_l=1.0, k_v=1.0, subcooling=subcooling)
    cls = getattr(phase_change, name)
    kernel = cls("fluid", None, **{key: value for key, value in constants.items() if key in signature(cls).parameters})
    method = kernel.post_loop if "Edges" in name else kernel.initialize
    particle = {key: np.zeros(1) for key in signature(method).parameters if key != "d_idx"}
    particle["d_phase"][:], particle["d_e"][:] = Phase.VAPOUR, L - C_V
    method(0, **particle)
    assert particle["d_T"][0] == pytest.approx(T_SAT - subcooling, rel=1e-14)


@pytest.mark.parametrize("T", [0.0, -1.0, 647.1, 700.0, np.nan, np.inf])
def test_temperature_of_liquid_outside_its_limits_is_refused(T):
    with pytest.raises(ValueError, match=rf"^temperature of liquid water .* must lie in \(0, 647\.1\) K, got {T} K$"):
        enthalpy([300.0, T, 310.0], WATER)


def test_phases_are_the_integers_that_kernels_write():
    assert [(phase.name, int(phase)) for phase in Phase] == [
        ("LIQUID", 0), ("TRANSITION", 1), ("SUPERHEATED", 2), ("VAPOUR", 3)]


def test_edges_never_contradict_each_other():
    """No two rows of one mechanism apply to the same particle, and each row changes the state."""
    for a, b in combinations(EDGES, 2):
        overlap = PARTS[a.enthalpy] & PARTS[b.enthalpy] and None in (a.kinetic, b.kinetic) or a.kinetic == b.kinetic
        if (a.source, a.by) == (b.source, b.by) and PARTS[a.enthalpy] & PARTS[b.enthalpy]:
            assert not overlap, (a, b)
    assert all(edge.source != edge.target for edge in EDGES)
    assert len({(edge.source, edge.target) for edge in EDGES}) == len(EDGES)


def test_every_state_can_be_entered_and_left():
    assert {edge.source for edge in EDGES} == {edge.target for edge in EDGES} == set(Phase)
    ways = {(edge.source, edge.target): edge.by for edge in EDGES}
    assert ways[Phase.SUPERHEATED, Phase.VAPOUR] == "nucleation"
    assert ways[Phase.VAPOUR, Phase.LIQUID] == "condensation"
    assert {ways[source, target] for source, target in ways if source != Phase.VAPOUR} == {"phase_change", "nucleation"}

"""States and temperature: enthalpy and temperature undo each other, and the table of edges hangs together."""
from inspect import signature
from itertools import combinations

import numpy as np
import pytest

from pysph_boiling.equations import phase_change
from pysph_boiling.equations.helpers import boiling_temperature
from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.phases import EDGES, Phase, enthalpy, temperature

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
    (0.5 * L + 4216.0, Phase.SUPERHEATED, 0.5 * L, T_SAT + 1.0),
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

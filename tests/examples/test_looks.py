"""The looks of a boil: what each sets, what overrides it, and that the three differ as they say."""
import numpy as np
import pytest
from small_scenes import built

from pysph_boiling.analysis.drops import drops
from pysph_boiling.examples.steady_boiling import SteadyBoiling
from pysph_boiling.phases import Phase
from pysph_boiling.schemes.looks import LOOKS, effects_in_look

SMALL = ["--flat", "--width", "36", "--fill", "20", "--sites", "4", "--duration", "2", "--frame", "0.05"]
# Departures, their median size in particles, share of vapour, particles in drops above the pool. Measured with seed 0:
# calm 3, 10, .015, 0.6; rolling 7, 31, .083, 0.5; violent 78, 8.5, .073, 34. With seed 1: calm 2, 9.5, .013, 0.2;
# rolling 9, 21, .084, 0.3.
EXPECTED = {
    "calm": ((1, 8), (5, 18), (0.004, 0.04), (0, 4)),
    "rolling": ((3, 16), (15, 60), (0.05, 0.15), (0, 6)),
    "violent": ((40, 150), (4, 14), (0.042, 0.13), (12, 90)),
}


@pytest.mark.parametrize("scene", ["steady_boiling", "rolling_boil"])
@pytest.mark.parametrize("look", LOOKS)
def test_a_look_sets_what_its_row_says_and_options_override_it(scene, look):
    row = LOOKS[look]
    made, plain = built(scene, "--look", look), built(scene)
    assert made.parameters.superheat == row.parameters["superheat"] != plain.parameters.superheat
    effects, k = made.scheme.effects, row.changes["buoyancy"]["k_bubble"]
    assert effects["buoyancy"].k_bubble == k
    assert effects["heater"].temperature == pytest.approx(made.scheme.material.T_sat + row.parameters["superheat"])
    assert {slot: effect for slot, effect in effects.items() if slot not in ("buoyancy", "heater")} == {
        slot: effect for slot, effect in plain.scheme.effects.items() if slot not in ("buoyancy", "heater")}
    changed = built(scene, "--look", look, "--superheat", "40", "--buoyancy.k-bubble", "1.1")
    assert changed.parameters.superheat == 40.0 and changed.scheme.effects["buoyancy"].k_bubble == 1.1


def test_a_scene_without_sites_has_no_look():
    with pytest.raises(ValueError, match="--look calm sets --superheat, .* looks are for boils over sites"):
        built("dam_break", "--look", "calm")
    with pytest.raises(ValueError, match="--look calm needs the effect 'preset_nucleation', .* boils over sites"):
        effects_in_look("calm", {})


def test_a_misspelt_look_gives_the_nearest(capsys):
    with pytest.raises(SystemExit):
        built("steady_boiling", "--look", "violet")
    assert "did you mean 'violent'?" in capsys.readouterr().err


class Watched(SteadyBoiling):
    """Measures vapour and spray, and makes no check of its own, which is for the full scene."""

    def measure(self, arrays, t):
        p, fluid = self.parameters, arrays["fluid"]
        sizes, places = drops(fluid, p.spacing)
        spray = sizes[places[:, 1] > p.fill * p.spacing].sum()
        return np.count_nonzero(fluid.phase == Phase.VAPOUR) / len(fluid.x), spray

    def check_final(self):
        pass


@pytest.fixture(scope="module")
def boils(tmp_path_factory):
    """Look -> (departures, median of their particles, share of vapour, particles in drops above the pool)."""
    found = {}
    for look in LOOKS:
        app = Watched(output_dir=str(tmp_path_factory.mktemp(look)))
        app.run([*SMALL, "--look", look, "--no-pictures", "--openmp"])
        void, spray = np.array(app.measured())[10:].mean(axis=0)
        found[look] = len(app.departures), np.median([n for _, n, _ in app.departures]), void, spray
    return found


@pytest.mark.slow
@pytest.mark.parametrize("look", LOOKS)
def test_a_look_boils_as_it_says(boils, look):
    for value, (least, most) in zip(boils[look], EXPECTED[look]):
        assert least <= value <= most, boils

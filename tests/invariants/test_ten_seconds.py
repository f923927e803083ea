"""Ten seconds of steady boiling in each mode: bubbles reach the surface all the time, and the chain is consistent."""
import numpy as np
import pytest

from pysph_boiling.examples.steady_boiling import SteadyBoiling

pytestmark = pytest.mark.slow  # two to three minutes each, and as much to compile


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Results of a mode, made once: results("gu")."""
    made = {}

    def results(mode):
        if mode not in made:
            app = SteadyBoiling(output_dir=str(tmp_path_factory.mktemp(mode)))
            app.check_final = lambda: None  # asks for the sizes at which bubbles depart in the mode "dynamic"
            app.run(["--flat", "--sites", "5", "--pattern", "regular", "--smallest-cavity", "0", "--mode", mode,
                     "--duration", "10", "--frame", "1", "--no-pictures", "--openmp"])
            made[mode] = app.ledger.table(), app.scheme.scene()
        return made[mode]

    return results


@pytest.mark.parametrize("mode", ["dynamic", "gu", "li_xiao"])
def test_bubbles_reach_the_surface_to_the_end_and_the_ledger_closes(runs, mode):
    table, _ = runs(mode)
    assert table["t"][-1] == pytest.approx(10.0, rel=1e-6)
    assert np.max(np.abs(table["energy_residual"])) <= 1e-10 and np.all(table["mass_residual"] == 0.0)
    for begin, end in ((4.0, 7.0), (7.0, 10.0)):
        vented = np.interp([begin, end], table["t"], table["n_bubbles_vented"])
        assert vented[1] - vented[0] >= 3, f"{mode}: {vented[1] - vented[0]:g} bubbles vented from {begin} to {end} s"


def test_modes_show_the_signature_that_sets_them_apart(runs):
    """Gu superheats nothing; Li & Xiao superheats more than the paper's model, whose count is bounded."""
    late = {mode: {name: column[len(column) // 2:].mean() for name, column in runs(mode)[0].items()}
            for mode in ("dynamic", "gu", "li_xiao")}
    assert np.all(runs("gu")[0]["n_superheated"] == 0.0)
    assert np.all(runs("li_xiao")[0]["n_transition"] == 0.0)
    assert late["li_xiao"]["n_superheated"] > late["dynamic"]["n_superheated"] > 0.0
    assert late["li_xiao"]["T_mean"] > late["dynamic"]["T_mean"] > late["gu"]["T_mean"]
    superheated = runs("dynamic")[0]["n_superheated"]
    third = len(superheated) // 3
    assert superheated[-third:].mean() < 1.15 * superheated[third:2 * third].mean(), "not bounded"


def test_vapour_production_is_the_heater_power_over_the_latent_heat(runs):
    """Over the last four seconds: particles made and not condensed, against (heater - warming of the feed)/(m_p L)."""
    table, scene = runs("dynamic")
    material, window = scene.material, np.searchsorted(table["t"], [6.0, 10.0 - 1e-9])

    def change(name):
        return table[name][window[1]] - table[name][window[0]]

    made = change("n_nucleated") - change("n_condensed")
    price = scene.particle_mass * (material.L + material.c_l * 2.0)  # the lid returns liquid 2 K below saturation
    assert made > 100
    assert made == pytest.approx(change("energy_heater") / price, rel=0.05)

"""Modes: what each changes, and what tells the three apart in a small vessel that shares the modules of the scene."""
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from harness import OPTIONS
from pysph.solver.tools import Tool
from sets import BOIL

from pysph_boiling.examples.dam_break import DamBreak
from pysph_boiling.examples.superheat_sites import SuperheatSites
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import DynamicNucleation, PhaseChange, PresetNucleation, SiteStorage
from pysph_boiling.schemes.modes import MODES, effects_in_mode


@pytest.mark.parametrize("mode, effects, words", [
    ("gu", {}, "mode 'gu' needs a scene with the effect 'phases', but this one has none"),
    ("li_xiao", {"phases": PhaseChange()},
     "needs a scene with the effect 'preset_nucleation', but this one has phases"),
    ("macklin", BOIL, "no mode 'macklin'; there are: dynamic, gu, li_xiao"),
])
def test_scene_that_has_no_such_mode(mode, effects, words):
    with pytest.raises(ValueError, match=words):
        effects_in_mode(mode, effects)


def test_table_of_modes():
    effects = {**BOIL, "dynamic_nucleation": DynamicNucleation()}
    assert effects_in_mode("dynamic", effects) == effects
    gu, li_xiao = (effects_in_mode(mode, effects) for mode in ("gu", "li_xiao"))
    others = {slot: effect for slot, effect in BOIL.items() if slot != "pooling"}
    assert gu == {**others, "phases": PhaseChange(kinetic="always"),
                  "preset_nucleation": PresetNucleation(attracts="transition")}
    others = {slot: effect for slot, effect in others.items() if slot != "adhesion"}
    assert li_xiao == {**others, "phases": PhaseChange(kinetic="never", vapour_as_site=False), "storage": SiteStorage()}
    assert "dynamic_nucleation" in effects and list(MODES) == ["dynamic", "gu", "li_xiao"]

    def kernels(effects):
        terms = BoilingScheme(["fluid"], ["wall"], dim=2, spacing=0.01, sites=["sites"], **effects).terms()
        return {type(term.equation).__name__ for term in terms}

    conditions = {"PhaseVapourCondition", "NucleationSiteCondition", "PoolingInterface", "PoolingJoin", "PoolingShare"}
    assert kernels(BOIL) - kernels(gu) == conditions and kernels(gu) <= kernels(BOIL)
    assert kernels(BOIL) - kernels(li_xiao) == conditions | {"BubbleSiteAdhesion"}
    assert {name for name in kernels(li_xiao) - kernels(BOIL) if not name.startswith("Storage")} == set()


class Watched(SuperheatSites):
    """The vessel of Fig. 14, whose modules the quick reproduction needs too, adding up what the sites hold.

    The final check of the full scene is for the full scene.
    """

    def create_tools(self):
        tools, self.held = super().create_tools(), []

        class Watch(Tool):
            def post_step(watch, solver):
                scheme = self.scheme
                self.held.append(sum(float(np.sum(pa.Q_s)) for pa in scheme.site_arrays) if "storage" in scheme.effects
                                 else 0.0)

        return [*tools, Watch()]

    def check_final(self):
        pass


SMALL = ["--flat", "--width", "40", "--fill", "24", "--sites", "3", "--duration", "1.5", "--seed", "2"]


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A small vessel in the three modes: mode -> application."""
    finished = {}
    for mode in MODES:
        finished[mode] = Watched(output_dir=str(tmp_path_factory.mktemp(mode)))
        finished[mode].run([*OPTIONS, *SMALL, "--mode", mode, "--no-pictures"])
    return finished


def results(app):
    return SimpleNamespace(**app.ledger.table())


def test_energy_with_the_sites_and_mass_close_at_every_step(runs):
    for mode, app in runs.items():
        table = results(app)
        made = table.n_emitted[-1] if mode == "li_xiao" else table.n_nucleated[-1]
        assert made >= 20 and table.n_bubbles_vented[-1] >= 1, f"too little happened in mode {mode}"
        assert len(table.t) == app.solver.count
        assert np.max(np.abs(table.energy_residual)) <= 1e-10
        assert np.all(table.mass_residual == 0.0)
    held, column = np.array(runs["li_xiao"].held), results(runs["li_xiao"]).energy_sites
    assert held.max() > 0.0
    np.testing.assert_allclose(column, held, atol=1e-11 * held.max())  # sums over all that was paid and received


def test_what_tells_the_modes_apart(runs):
    """Table 1 of the paper: superheated and latent states, and which of the modes gets hottest.

    Measured after the first second: 275, 0 and 639 superheated of 960, T_max - T_sat 50, 28 and 55 K on average
    (dynamic, gu, li_xiao).
    """
    dynamic, gu, li_xiao = (results(runs[mode]) for mode in ("dynamic", "gu", "li_xiao"))
    assert np.all(gu.n_superheated == 0) and gu.n_transition.max() > 0
    assert np.all(li_xiao.n_transition == 0) and li_xiao.n_nucleated[-1] == 0 and li_xiao.n_superheated.max() > 0
    assert dynamic.n_transition.max() > 0 and dynamic.n_superheated.max() > 0
    later = dynamic.t > 1.0  # after the first bubbles
    assert li_xiao.n_superheated[later].mean() > 1.5 * dynamic.n_superheated[later].mean()
    assert li_xiao.T_max[later].mean() > dynamic.T_max[later].mean()
    assert gu.T_max.max() < dynamic.T_max[later].mean()


def test_run_json_and_options_of_a_mode(runs, tmp_path):
    for mode, app in runs.items():
        run = json.loads((Path(app.output_dir) / "run.json").read_text())
        assert run["mode"] == mode and ("storage" in run["effects"]) == (mode == "li_xiao")
    app = SuperheatSites(output_dir=str(tmp_path))
    app.set_args([*SMALL, "--mode", "li_xiao", "--storage.n-emit", "9", "--storage.rate", "3", "--disable-output"])
    app._parse_command_line(force=True)
    app._prepare()
    assert app.scheme.effects["storage"] == SiteStorage(n_emit=9, rate=3.0)
    app = DamBreak(output_dir=str(tmp_path))
    app.set_args(["--mode", "gu", "--disable-output"])
    app._parse_command_line(force=True)
    with pytest.raises(ValueError, match="needs a scene with the effect 'phases', but this one has density"):
        app._prepare()

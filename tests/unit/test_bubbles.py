"""The command ``bubbles`` on the files of a run that never was."""
import json
from types import SimpleNamespace

import numpy as np
import pytest
from pysph.base.utils import get_particle_array
from pysph.solver.output import dump

from pysph_boiling import cli
from pysph_boiling.evaluation.bubbles import boil
from pysph_boiling.particles import NO_BUBBLE
from pysph_boiling.phases import Phase
from pysph_boiling.runs.ledger import save_results

DX = 0.002
EVENTS = [[t, 9, 0] for t in (1.0, 1.5, 2.0, 2.5, 3.0)] + [[2.1, 25, 1]]


@pytest.fixture
def folder(tmp_path):
    """Two outputs of a 2-D pool of 12 x 12 particles with a block of 3 x 3 vapour, in the middle and then at the base.
    """
    grid = np.indices((12, 12)).reshape(2, -1).T
    for step, low in enumerate((5, 1)):
        inside = np.all((grid >= [5, low]) & (grid < [8, low + 3]), axis=1)
        points = DX * (grid + 0.5 + np.random.default_rng(1).uniform(-1e-6, 1e-6, grid.shape))
        fluid = get_particle_array(name="fluid", x=points[:, 0], y=points[:, 1], m=1.0, h=DX)
        fluid.add_property("phase", type="int", data=np.where(inside, Phase.VAPOUR, Phase.LIQUID))
        fluid.add_property("bubble", type="unsigned int", data=np.where(inside, 60, NO_BUBBLE))
        fluid.add_output_arrays(["phase", "bubble"])
        wall = get_particle_array(name="wall", x=DX * (np.arange(12) + 0.5), y=-0.5 * DX, m=1.0, h=DX)
        sites = get_particle_array(name="sites", x=DX * np.array([4.0, 8.0]), y=0.0, m=1.0, h=DX)
        dump(str(tmp_path / f"scene_{step}.hdf5"), [fluid, wall, sites], {"t": 0.1 * step, "dt": 0.1, "count": step})
    t = np.linspace(0.0, 4.0, 9)
    save_results(tmp_path / "results.npz", {"t": t, "n_nucleated": 40.0 * t**2, "n_condensed": 10.0 * t**2})
    (tmp_path / "run.json").write_text(json.dumps({
        "dim": 2, "spacing": DX, "particles": {"fluid": 144, "sites": 3}, "departures": EVENTS,
        "effects": {"preset_nucleation": {"class": "PresetNucleation", "radius": {"value": 1.6, "unit": "-"}}}}))
    return tmp_path


def test_what_is_known_of_the_run_is_found(folder):
    found = boil(folder)
    assert (found.departed.gap, found.departed.gap_at, found.departed.rate) == (1.0, 3.0, pytest.approx(5 / 3))
    assert found.vaporised == pytest.approx(30.0 * (16.0 - 1.0) / 3.0)  # from 1 to 4 s
    (bubble,) = found.free  # that of the second output is at the base
    assert (bubble.shape.n, bubble.whole) == (9, 1.0) and bubble.shape.aspect == pytest.approx(1.0, abs=1e-3)
    assert bubble.void == pytest.approx(0.0, abs=1e-4 * DX)


def test_the_command_prints_it(folder, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "120")
    assert cli.main(["bubbles", str(folder)]) == 0
    said = " ".join(capsys.readouterr().out.replace("│", " ").split())
    for words in ("vaporised per second 150.0", "departed 6, from 2 of 3 sites", "per second 1.67, from 1.00 to 4.00 s",
                  "without one 1.000 s, from 3.00 s on", "at departure 9, 9, 9, 9, 25",
                  "3.4, 3.4, 3.4, 3.4, 5.6 spacings",
                  "period of 1 sites 0% to 0%, median 0%", "width over height mean 1.00", "one piece mean 100.0%",
                  "above one spacing for 0%", "0 5 0.500 0%"):
        assert words in said, (words, said)


def test_what_is_not_a_boil_is_refused(folder, tmp_path, capsys):
    assert cli.main(["bubbles", str(tmp_path / "nothing")]) == 2
    assert "there is no run.json in" in capsys.readouterr().err
    record = SimpleNamespace(**json.loads((folder / "run.json").read_text()))
    (folder / "run.json").write_text(json.dumps({**vars(record), "effects": {}}))
    assert cli.main(["bubbles", str(folder)]) == 2
    assert "has no preset sites, so no bubble departs from one" in capsys.readouterr().err

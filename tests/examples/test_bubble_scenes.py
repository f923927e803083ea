"""The scenes of single bubbles in their flat form: what each must show takes place, and energy and mass close."""
import numpy as np
import pytest

from pysph_boiling.analysis.shapes import merger, split
from pysph_boiling.evaluation.reproduce.single_bubbles import Figure7, Figure8, Figure9
from pysph_boiling.examples import scene_class
from pysph_boiling.particles import NO_BUBBLE
from pysph_boiling.phases import Phase

SMALL = {figure.scene: figure.small for figure in (Figure7, Figure8, Figure9)}


@pytest.fixture(scope="module", params=sorted(SMALL))
def ran(request, tmp_path_factory):
    app = scene_class(request.param)(output_dir=str(tmp_path_factory.mktemp(request.param)))
    app.run([*SMALL[request.param], "--no-pictures", "--openmp"])  # its final check must pass
    return request.param, app, app.history()


def test_the_scene_shows_its_event(ran):
    name, app, history = ran
    assert app.ledger.rows[-1]["n_burst"] == 0, "the pool is below its limit"
    if name == "bubble_rise":
        assert app.ledger.rows[-1]["n_bubbles_vented"] >= 1 and np.all(history["bubbles"] <= 1)
    elif name == "bubble_merge":
        event = merger(history)
        assert history["bubbles"][0] == 2 and event.smaller >= 4 and 0.9 <= event.ratio <= 1.1
    else:
        event = split(history)
        assert history["bubbles"][0] == 1 and event.smaller >= 4 and 0.9 <= event.ratio <= 1.1


def test_what_is_measured_in_the_run_is_what_the_files_hold(ran):
    """Where no files are written the check takes the one for the other."""
    _, app, history = ran
    now = app.measure({pa.name: pa for pa in app.particles}, app.solver.t)
    last = {name: values[-1] for name, values in history.items()} if now else {}
    assert now.keys() == last.keys()
    for name, value in now.items():
        np.testing.assert_equal(float(value), last[name], err_msg=name)


def test_energy_and_mass_close_and_vapour_is_accounted_for(ran):
    _, app, history = ran
    results, last = app.ledger.table(), app.ledger.rows[-1]
    # measured 1e-15: sums over 5e2 particles of numbers that are exact to 1e-16 each
    assert np.max(np.abs(results["energy_residual"])) <= 1e-10 and np.all(results["mass_residual"] == 0.0)
    assert last["n_vapour"] - history["n"][0] == (
        last["n_nucleated"] + last["n_burst"] - last["n_condensed"] - last["n_vented"])


@pytest.mark.parametrize("name", sorted(SMALL))
def test_bubbles_are_there_at_the_start(name, tmp_path):
    app = scene_class(name)(output_dir=str(tmp_path))
    app.set_args([*SMALL[name], "--no-pictures"])
    app._parse_command_line(force=True)
    app._prepare()
    fluid = app.prepared[0]
    vapour = fluid.phase == Phase.VAPOUR
    assert len(np.unique(fluid.bubble[vapour])) == len(app.bubbles(app.parameters))
    assert np.all(fluid.bubble[~vapour] == NO_BUBBLE) and np.all(fluid.e[vapour] == app.scheme.material.L)
    area = sum(np.pi / 4.0 * diameter**2 for _, _, diameter in app.bubbles(app.parameters))
    assert vapour.sum() == pytest.approx(area, rel=0.15)  # of disks of 4 to 9 spacings, from a lattice

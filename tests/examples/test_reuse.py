"""Our model as the guest of PySPH's own schemes: vessels that boil, and the dam break of docs/python.md."""
import re
from pathlib import Path

import numpy as np
import pytest
from pysph.solver.utils import load

from pysph_boiling import cli
from pysph_boiling.examples import reuse_wcsph, scene_class
from pysph_boiling.files import last_output, read_output
from pysph_boiling.phases import Phase
from pysph_boiling.results import load_results, load_run

HOSTS = {"reuse_wcsph": "WCSPHScheme", "reuse_edac": "EDACScheme", "reuse_tvf": "TVFScheme",
         "reuse_iisph": "IISPHScheme"}


def small(name, folder, monkeypatch, *options, tf=0.3):
    """A run of a scene in a vessel half as large, until ``tf`` [s]."""
    monkeypatch.setattr(reuse_wcsph, "WIDTH", 18)
    monkeypatch.setattr(reuse_wcsph, "FILL", 9)
    monkeypatch.setattr(reuse_wcsph, "SITES", 2)
    application = scene_class(name)()
    application.run([*cli.openmp_arguments([]), "-d", str(folder), "--loglevel", "none", "--tf", str(tf), *options])
    return application


@pytest.mark.parametrize("name", [
    pytest.param(name, marks=pytest.mark.slow if name == "reuse_iisph" else ()) for name in HOSTS])  # compiles a minute
def test_a_vessel_boils_in_pysphs_scheme(name, tmp_path, monkeypatch):
    application = small(name, tmp_path, monkeypatch, "--no-pictures")
    host = application.scheme
    assert type(host).__name__ == HOSTS[name] and type(host).__module__.startswith("pysph.sph.")
    own = host.get_equations()
    assert len(application.equations) == len(own) + 1  # one group of ours, which calls the guest

    table = load_run(tmp_path).results
    assert all(table.unit(column) and table.meaning(column) for column in table)
    assert table["n_nucleated"][-1] >= 4 and 1 <= table["n_bubbles"][-1] <= 3  # at both sites
    assert table["energy_heater"][-1] > 0.0 and np.max(np.abs(table["energy_residual"])) <= 1e-12
    assert np.max(np.abs(table["mass_residual"])) <= 1e-12
    assert application.guest.count_subcycles(9.5 * application.guest.heat_limit) >= 10  # as in our schemes
    arrays = load(str(last_output(tmp_path)))["arrays"]  # PySPH's own reader
    fluid = arrays["fluid"]
    assert np.count_nonzero(fluid.phase == Phase.VAPOUR) == table["n_vapour"][-1]
    assert {"au", "p"} <= set(fluid.properties) and set(arrays) == {"fluid", "wall", "sites"}
    assert min(fluid.x.min(), 18 * reuse_wcsph.SPACING - fluid.x.max(), fluid.y.min()) > -0.5 * reuse_wcsph.SPACING


def test_model_of_gu_is_an_sph_model_that_never_superheats(tmp_path, monkeypatch):
    application = small("reuse_wcsph", tmp_path, monkeypatch, "--no-pictures", "--mode", "gu")
    table = load_results(tmp_path)
    assert table["n_nucleated"][-1] >= 4 and np.max(table["n_superheated"]) == 0
    assert application.record()["mode"] == "gu"


@pytest.mark.parametrize(("change", "message"), [
    (lambda app: app.ledger.rows.columns.__setitem__(app.ledger.rows.names.index("energy_residual"), 1e-9), "energy"),
    (lambda app: app.ledger.rows.columns.__setitem__(app.ledger.rows.names.index("mass_residual"), 1e-9), "mass"),
])
def test_final_check_fails_on(change, message, tmp_path, monkeypatch):
    application = small("reuse_wcsph", tmp_path, monkeypatch, "--disable-output", tf=0.002)
    with pytest.raises(AssertionError, match="no bubble left the base"):
        application.check_final()
    change(application)
    with pytest.raises(AssertionError, match=f"the {message} is not balanced"):
        application.check_final()


def test_dam_break_of_the_docs_boils_on_a_hot_floor(tmp_path):
    """The file of docs/python.md, as it stands there: at most thirty lines of the user's."""
    text = (Path(__file__).parents[2] / "docs" / "python.md").read_text()
    code = re.search("```python\n(.*?)```", text[text.index("## Boiling in another scheme"):], re.S)[1]
    assert len([line for line in code.splitlines() if line.strip()]) <= 30
    names = {}
    exec(code, names)
    application = names["HotDam"](fname="hot_dam", output_dir=str(tmp_path))
    application.run(["--openmp", "--tf", "0.35", "-d", str(tmp_path), "--loglevel", "none"])
    table = application.ledger.table()
    assert table["n_nucleated"][-1] >= 10 and table["n_bubbles"][-1] >= 3
    assert np.max(np.abs(table["energy_residual"])) <= 1e-12
    fluid = read_output(last_output(tmp_path))[0]["fluid"]
    assert np.count_nonzero(fluid.phase == Phase.VAPOUR) == table["n_vapour"][-1]
    assert fluid.x.max() > 1.2  # the dam has broken

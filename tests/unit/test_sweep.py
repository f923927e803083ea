"""The command ``sweep``: what is swept, the table and the pictures, and what it says of points that fail.

``pysph_boiling run`` is played by a script, whose vessel boils above 10 K and has a heat flux that is known.
"""
import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from pysph_boiling import cli
from pysph_boiling.analysis.boiling import FIGURES, figure_of
from pysph_boiling.evaluation import sweep as module
from pysph_boiling.evaluation.sweep import Axis, points, split, values
from pysph_boiling.results import Event, Quantities

PYTHON = sys.executable  # which a test replaces
ACTOR = '''#!{python}
import json, os, sys, time
import numpy as np
given = sys.argv[1:]
assert given[:4] == ["-m", "pysph_boiling", "run", "superheat_sites"] and "--flat" in given, given
option = dict(zip(given, given[1:]))
folder, superheat, seed = option["--directory"], float(option["--superheat"]), int(option["--seed"])
with open(os.path.join(os.path.dirname(folder), "journal"), "a") as file:
    print(superheat, seed, file=file)
if superheat == 99.0:
    sys.exit("pysph-boiling: it broke")
if superheat == 44.0 and not os.path.exists(folder + "_seen"):
    open(folder + "_seen", "w").close()
    time.sleep(60.0)
t, flux = np.linspace(0.01, 2.0, 200), 100.0 * superheat + 10.0 * seed
energy = 1000.0 * 0.04 * (5e5 * np.minimum(t, 0.5) + flux * t)  # at first, more
np.savez(os.path.join(folder, "results.npz"), t=t, energy_heater=energy, n_nucleated=np.where(superheat > 10.0, t, 0.0),
         T_mean=np.where(t > 1.0, 370.0 + superheat, 0.0))
left = [[0.5, 4, 0]] + [[1.1, 9, 0], [1.5, 9, 0], [1.6, 25, 1]] * (superheat > 10.0)
with open(os.path.join(folder, "run.json"), "w") as file:
    json.dump(dict(completed=True, scene="superheat_sites", dim=2, spacing=0.002, departures=left, particles={{}},
                   heated_area=dict(value=0.04, unit="m"), parameters={{}},
                   effects=dict(heat=dict(time_scaling=dict(value=1000.0, unit="-")))), file)
sys.exit(0 if superheat > 10.0 else 1)  # its final check wants bubbles
'''


@pytest.fixture
def there(tmp_path, monkeypatch):
    """A folder in which the actor plays the runs."""
    actor = tmp_path / "actor"
    actor.write_text(ACTOR.format(python=sys.executable))
    actor.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(actor))
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.chdir(tmp_path)
    return tmp_path / "sweep_superheat_sites"


def swept(*arguments):
    return cli.main(["sweep", "superheat_sites", "--flat", *arguments])


def table(folder):
    with open(folder / "sweep.csv", newline="") as file:
        return list(csv.DictReader(file))


def played(folder):
    return sorted((folder / "runs" / "journal").read_text().splitlines())


@pytest.mark.parametrize(("text", "found"), [
    ("5:60:3", ("5", "32.5", "60")), ("5:60:8", ("5", "12.8571", "20.7143", "28.5714", "36.4286", "44.2857", "52.1429",
                                                 "60")),
    ("2:8:4", ("2", "4", "6", "8")), ("5,10,2.5", ("5", "10", "2.5")), ("1e-6,2e-6", ("1e-06", "2e-06")),
    ("-1:1:3", ("-1", "0", "1")), ("5", None), ("dynamic,64", None), ("a,b", None), ("5:60", None), ("", None)])
def test_ranges_and_lists_are_swept_and_nothing_else(text, found):
    assert values(text) == found


@pytest.mark.parametrize(("text", "said"), [("5:60:1", "2 to 1000 values"), ("5:60:4000", "2 to 1000 values"),
                                            ("5,5", "swept twice in 5,5"), ("1:1.0000001:3", "swept twice")])
def test_ranges_without_sense_are_refused(text, said):
    with pytest.raises(ValueError, match=said):
        values(text)


def test_options_are_swept_or_passed_on_in_their_order():
    axes, fixed = split("--flat --superheat 5:15:2 --mode gu --sites=2,4 --omp-schedule static,8".split())
    assert axes == (Axis("--superheat", ("5", "15")), Axis("--sites", ("2", "4")))
    assert fixed == ("--flat", "--mode", "gu", "--omp-schedule", "static,8")
    with pytest.raises(ValueError, match="--sites is swept twice"):
        split(["--sites", "2,4", "--sites", "6,8"])


def test_points_are_a_grid_with_every_seed():
    axes = Axis("--superheat", ("5", "15")), Axis("--heater.until", ("1", "2"))
    made = points("steady_boiling", axes, ("--flat",), 2, 7)
    assert len({point.run.name for point in made}) == len(made) == 8
    assert made[1].run.name == "superheat=5_heater.until=1_seed=8" and made[1].seed == 8
    assert made[-1].run.options == ("--flat", "--superheat", "15", "--heater.until", "2", "--seed", "8")


def test_table_has_a_row_a_run_and_the_picture_the_mean(there, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "150")
    assert swept("--superheat", "5:45:3", "--seeds", "2", "--plot", "heat_flux", "--plot", "T_mean") == 0
    rows = table(there)
    assert [(row["superheat [K]"], row["seed [-]"]) for row in rows] == [
        (superheat, seed) for superheat in ("5", "25", "45") for seed in ("1", "2")]
    for row in rows:
        superheat, seed = float(row["superheat [K]"]), int(row["seed [-]"])
        assert float(row["heat_flux [W/m^2]"]) == pytest.approx(100.0 * superheat + 10.0 * seed)  # of the second half
        assert float(row["T_mean [K]"]) == pytest.approx(370.0 + superheat) and row["state"] == "done"
        boils = superheat > 10.0
        assert float(row["departures [1/s]"]) == pytest.approx(3.0 * boils)
        assert row["frequency [1/s]"] == ("1.5" if boils else "")  # of two sites
        mean = 0.002 * np.mean(np.sqrt(4.0 * np.array([9, 9, 25]) / np.pi))
        assert row["bubble_diameter [m]"] == (f"{mean:.9g}" if boils else "")
        assert float(row["vaporised [-]"]) == pytest.approx(2.0 * boils)
    said = capsys.readouterr().out
    assert "its final check failed" in said and "2515 (2510 to 2520)" in said
    for name in ("heat_flux", "T_mean"):
        assert (there / f"{name}.png").read_bytes().startswith(b"\x89PNG")


def test_picture_shows_mean_and_spread_and_a_line_for_each_value_of_the_others(tmp_path, monkeypatch):
    from matplotlib.axes import Axes

    drawn, errorbar = [], Axes.errorbar

    def seen(ax, x, y, yerr, label=None, **style):
        drawn.append((label, x.tolist(), y.tolist(), np.array(yerr).tolist()))
        return errorbar(ax, x, y, yerr=yerr, label=label, **style)

    monkeypatch.setattr(Axes, "errorbar", seen)
    numbers = {("5", "2"): np.array([1.0, 2.0, 6.0]), ("15", "2"): np.array([6.0]), ("5", "4"): np.array([9.0]),
               ("15", "4"): np.array([])}
    module.draw(tmp_path / "a.png", (Axis("--superheat", ("5", "15")), Axis("--sites", ("2", "4"))),
                {"superheat": ("K", "of the base"), "sites": ("-", "sites")}, FIGURES["heat_flux"], numbers, "")
    assert drawn == [("sites = 2", [5.0, 15.0], [3.0, 6.0], [[2.0, 0.0], [3.0, 0.0]]), ("sites = 4", [5.0], [9.0],
                                                                                        [[0.0], [0.0]])]


def test_a_point_that_fails_is_recorded_and_the_others_go_on(there, capsys):
    assert swept("--superheat", "20,99,30") == 1
    assert [row["state"] for row in table(there)] == [
        "done", "the process ended with exit status 1; pysph-boiling: it broke", "done"]
    assert table(there)[1]["heat_flux [W/m^2]"] == "" and (there / "heat_flux.png").exists()
    said = capsys.readouterr().err
    assert "1 of 3 runs failed" in said and "superheat=99_seed=1: the process ended with" in said


def test_what_is_done_is_not_repeated(there):
    assert swept("--superheat", "20,30") == 0
    assert swept("--superheat", "20,30,40", "--seeds", "2", "--plot", "n_nucleated") == 0
    assert played(there) == ["20.0 1", "20.0 2", "30.0 1", "30.0 2", "40.0 1", "40.0 2"]
    assert [row["n_nucleated [1/s]"] for row in table(there)] == ["1"] * 6


def test_interrupted_sweep_goes_on(there):
    command = f"""
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell starts what is in the background without it
sys.executable = {str(there.parent / "actor")!r}
os.cpu_count = lambda: 2
from pysph_boiling import cli
sys.exit(cli.main(["sweep", "superheat_sites", "--flat", "--superheat", "20,44", "--jobs", "1"]))
"""
    child = subprocess.Popen([PYTHON, "-c", command], stderr=subprocess.PIPE)
    deadline = time.time() + 120.0
    while not (there / "runs" / "superheat=44_seed=1_seen").exists():
        assert time.time() < deadline and child.poll() is None
        time.sleep(0.05)
    child.send_signal(signal.SIGINT)
    assert child.wait(60.0) == 130 and child.stderr.read() == b"pysph-boiling: interrupted\n"
    assert not (there / "sweep.csv").exists()
    assert swept("--superheat", "20,44", "--jobs", "1") == 0
    assert played(there) == ["20.0 1", "44.0 1", "44.0 1"] and len(table(there)) == 2


@pytest.mark.parametrize(("arguments", "said"), [
    (["superheat_sites"], "give an option a range or a list of values, such as --superheat 5:60:8"),
    (["superheat_sites", "--superheet", "5:60:8"], "superheat_sites has no number --superheet to sweep; did you mean "
                                                   "'--superheat'?"),
    (["superheat_sites", "--seed", "1,2"], "has no number --seed to sweep"),
    (["superheat_sites", "--superheat", "5:600:3"], "--superheat must be <= 250"),
    (["superheat_sites", "--superheat", "5:60:3", "--plot", "heat_flow"],
     "no figure 'heat_flow'; did you mean 'heat_flux'?"),
    (["superheat_sites", "--superheat", "5:60:3", "--seeds", "0"], "--seeds must be 1 or more, got 0"),
    (["superheat_sites", "--superheat", "5:60:3", "--jobs", "99"], "--jobs must be 1 to 2, got 99"),
    (["superheat_sites", "--superheat", "5:60:600", "--seeds", "2"], "this sweep has 1200 runs, more than 1000"),
    (["superheat_site", "--superheat", "5:60:3"], "no scene 'superheat_site'; did you mean 'superheat_sites'?"),
    (["reuse_wcsph", "--superheat", "5:60:3"], "reuse_wcsph has a scheme of PySPH and no parameters of ours"),
    (["dam_break", "--density.omega", "0.4,0.6"], "--plot is missing; dam_break has the figures dt, mass"),
    (["--superheat", "5:60:3"], "name a scene first, one of: bubble_held"),
])
def test_what_cannot_be_swept_is_refused_before_anything_runs(there, capsys, arguments, said):
    assert cli.main(["sweep", *arguments]) == 2
    assert said in capsys.readouterr().err
    assert not there.exists()


def test_number_that_is_not_whole_is_refused_before_anything_runs(there, capsys):
    with pytest.raises(SystemExit) as ended:
        swept("--sites", "2:5:3")
    assert ended.value.code == 2 and "invalid int value: '3.5'" in capsys.readouterr().err and not there.exists()


def test_sweeps_with_other_options_are_kept_apart(there, capsys):
    assert swept("--superheat", "20,30") == 0
    assert swept("--superheat", "20,30", "--sites", "7") == 2
    assert "holds a sweep of superheat_sites --flat: choose another folder with --directory" in capsys.readouterr().err
    assert json.loads((there / "sweep.json").read_text()) == {"scene": "superheat_sites", "options": ["--flat"]}
    assert len(table(there)) == 2


def run_of(table, events=()):
    columns = {name: np.array(column) for name, column in table.items()}
    return SimpleNamespace(results=Quantities("column", columns, {}), events=list(events))


def test_figures_of_columns_are_means_or_growth_over_the_second_half():
    run = run_of({"t": [1.0, 2.0, 3.0, 4.0], "n": [0.0, 5.0, 6.0, 8.0]})
    assert figure_of("n", "-", "particles").value(run) == 7.0
    counted = figure_of("n", "-", "particles since the start, of all")
    assert (counted.unit, counted.value(run)) == ("1/s", 2.0)
    assert figure_of("n", "J/m", "heat since the start").unit == "J/m/s"
    short = run_of({"t": [1.0], "n": [5.0]})
    assert np.isnan(counted.value(short)) and figure_of("n", "-", "particles").value(short) == 5.0


def test_the_page_lists_the_figures():
    page = (Path(__file__).parents[2] / "docs/sweep.md").read_text().partition("## Figures")[2]
    rows = re.findall(r"^\| `(\w+)` \| (\S+) \| (.*) \|$", page, re.M)
    assert rows == [(name, figure.unit, figure.meaning) for name, figure in FIGURES.items()]


def test_departures_of_the_first_half_do_not_count():
    run = run_of({"t": [1.0, 2.0, 3.0, 4.0]}, [Event(t, kind, 9, 3.0, 0, 0.0, 0.0, 0.0) for t, kind in (
        (1.5, "departure"), (2.5, "departure"), (2.6, "vent"), (3.5, "departure"))])
    assert FIGURES["departures"].value(run) == FIGURES["frequency"].value(run) == 1.0
    assert FIGURES["bubble_diameter"].value(run) == 3.0

"""The history plot: a panel for what was measured, and none for what was not."""
import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread

from pysph_boiling.analysis import plots
from pysph_boiling.analysis.drawing import STATE_COLOURS
from pysph_boiling.analysis.plots import PANELS, plot_history

N = 50
T = np.linspace(0.0, 1.0, N)
PLAIN = {"t": T, "dt": np.full(N, 0.02), "sweeps": np.full(N, 4), "density_error_mean": 1e-3 * T,
         "density_error_max": 1e-2 * T, "mass": np.ones(N)}
BOIL = {
    **PLAIN, "n_liquid": 5000 - 900 * T, "n_transition": 40 * T, "n_superheated": 800 * T, "n_held": 300 * T,
    "n_vapour": 60 * T, "n_bubbles": np.round(5 * T), "bubble_radius_mean": 4e-3 * (T > 0.3), "T_mean": 371.0 + T,
    "T_max": 373.0 + 9 * T, "energy": -50.0 + 8 * T, "energy_in": 10 * T, "energy_out": 2 * T,
    "energy_residual": 1e-15 * T, "energy_model_leak": np.zeros(N), "kinetic_energy": T, "work_gravity": -3 * T,
    "work_drag": 1e-3 * T, "n_nucleated": 90 * T, "n_burst": 5 * T, "n_condensed": 3 * T, "n_vented": 30 * T,
    "heat_subcycles": np.ones(N),
}


def has_colour(path, colour):
    rgb = np.array([int(colour[i:i + 2], 16) for i in (1, 3, 5)]) / 255
    return bool((np.abs(imread(path)[..., :3] - rgb).max(axis=-1) < 0.02).any())


@pytest.mark.parametrize(("dim", "unit"), [(2, "[J/m]"), (3, "[J]")])
def test_energies_of_two_dimensions_are_for_a_metre_of_depth(tmp_path, monkeypatch, dim, unit):
    labels = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_, **__: labels.extend(
        axes.get_ylabel() for axes in figure.axes))
    plot_history(BOIL, tmp_path / "history.png", dim=dim)
    assert [label for label in labels if "[J" in label] == [f"energy {unit}", f"work since the start {unit}"]


def test_full_history_has_every_panel_and_leaves_no_trace(tmp_path):
    path, style, energy = tmp_path / "history.png", dict(matplotlib.rcParams), BOIL["energy"].copy()
    assert plot_history(BOIL, path) == list(PANELS)
    assert dict(matplotlib.rcParams) == style
    assert np.array_equal(BOIL["energy"], energy)
    assert path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    for colour in STATE_COLOURS.values():
        assert has_colour(path, colour)


def test_plain_scene_has_only_its_own_panels(tmp_path):
    path = tmp_path / "history.png"
    assert plot_history(PLAIN, path) == ["density", "sweeps"]
    assert not any(has_colour(path, colour) for colour in STATE_COLOURS.values())


@pytest.mark.parametrize(("panel", "columns"), [(name, needs) for name, (_, _, needs) in PANELS.items()])
def test_one_column_makes_its_panel_and_no_other(tmp_path, monkeypatch, panel, columns):
    monkeypatch.setattr(Figure, "savefig", lambda *_, **__: None)  # the artists are made, not their pixels
    kept = {name: BOIL[name] for name in ("t", columns[-1])}
    assert plot_history(kept, tmp_path / "one.png") == [panel]


def test_curves_are_in_the_units_of_their_axes():
    figure = plots._draw_panels(list(PANELS), T, BOIL)
    curves = {line.get_label(): line.get_ydata() for ax in figure.axes for line in ax.lines}
    labels = " ".join(ax.get_ylabel() for ax in figure.axes)
    assert curves["change of energy"] == pytest.approx(8 * T)
    assert curves["in − out"] == pytest.approx(8 * T)
    assert curves["gravity"] == pytest.approx(-3 * T) and "drag" not in curves  # less than 1 % of the largest
    radius = curves["mean radius"]  # mm; no bubble, no radius
    assert np.all(np.isnan(radius[T <= 0.3]))
    assert radius[T > 0.3] == pytest.approx(4.0)
    assert [curves["mean"][0], curves["maximum"][-1]] == pytest.approx([0.0, 1.0])  # %, the density panel is last
    temperature = figure.axes[list(PANELS).index("temperature")].lines[0].get_ydata()
    assert temperature == pytest.approx(99.85 + 9 * T)
    for unit in ("[mm]", "[J]", "[°C]", "[%]"):
        assert unit in labels


def test_reads_an_archive_of_a_run_that_just_began(tmp_path, monkeypatch):
    monkeypatch.setattr(plots, "DPI", 40)
    first = {"t": [0.0], "n_vapour": [0], "n_bubbles": [0], "bubble_radius_mean": [0.0], "energy_residual": [0.0]}
    np.savez(tmp_path / "results.npz", **first)
    with np.load(tmp_path / "results.npz") as results:
        assert plot_history(results, tmp_path / "history.png") == ["phases", "bubbles", "residual"]


@pytest.mark.parametrize(("results", "message"), [
    ({"sweeps": T}, "column 't'"), ({"t": T[:0]}, "at least one row"), ({"t": T}, "no column to plot"),
    ({"t": T, "sweeps": T[1:]}, "'sweeps' has shape"),
])
def test_bad_results_are_named(tmp_path, results, message):
    with pytest.raises(ValueError, match=message):
        plot_history(results, tmp_path / "no.png")

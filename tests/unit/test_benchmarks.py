"""What the benchmarks measure by: pure functions, and processes that are stand-ins; nothing is compiled."""
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pysph.base.kernels import CubicSpline

from pysph_boiling.particles import akinci_volume, box_vessel, fluid_block, lattice_density, positions
from pysph_boiling.runs.jobs import Outcome

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import boil  # noqa: E402
import peers  # noqa: E402
import scenes  # noqa: E402
import summary  # noqa: E402


@pytest.fixture(scope="module")
def scene():
    return scenes.Scene("column", (4, 4, 6), (6, 6, 9), 1.0, 0.5)


def test_kernel_is_that_of_pysph():
    kernel, h = CubicSpline(dim=3), 0.03
    for r in np.linspace(0.0, 2.2 * h, 12):
        assert scenes.cubic_spline(r, h) == pytest.approx(kernel.kernel(xij=[r, 0, 0], rij=r, h=h), abs=1e-9 / h**3)


def test_walls_and_their_volumes_are_those_of_a_vessel(scene):
    kernel = CubicSpline(dim=3)
    vessel = box_vessel((0.0,) * 3, scene.size, spacing=scene.spacing, dim=3, rho0=1000.0, kernel=kernel, hdx=1.0)
    np.testing.assert_allclose(positions(vessel), scene.wall, atol=1e-12)
    volume = akinci_volume(scene.wall, kernel, h=scene.h, dim=3)
    np.testing.assert_allclose(scene.wall_volume, volume, rtol=1e-6)  # akinci_volume rounds distances


def test_a_lattice_is_at_rest_and_a_squeezed_one_is_denser(scene):
    """Inside, far from walls and surface: 0 on the lattice; squeezed by s in one direction, the lattice sum itself."""
    size = np.array([9, 9, 9]) * scene.spacing
    block = fluid_block((0, 0, 0), size, spacing=scene.spacing, dim=3, rho0=1000.0)
    points = positions(block)
    middle = np.argmin(np.linalg.norm(points - 0.5 * size, axis=1))
    away = points + 100.0  # far from the tank
    assert scenes.compression(scene, away)[middle] == pytest.approx(0.0, abs=1e-9)
    squeezed = (away - 100.0) * 0.98 + 100.0
    expected = lattice_density(CubicSpline(dim=3), dim=3, hdx=1.0 / 0.98)[0] / 0.98**3 / lattice_density(
        CubicSpline(dim=3), dim=3, hdx=1.0)[0] - 1.0
    assert expected > 0.05
    assert scenes.compression(scene, squeezed)[middle] == pytest.approx(expected, rel=1e-9)


def test_walls_count_in_the_density(scene):
    """A fluid lattice that goes on where the walls are: what the walls add is their kernel sum, by hand."""
    point = np.array([[3.0, 3.0, 0.5]]) * scene.spacing
    near = np.linalg.norm(scene.wall - point, axis=1)
    by_hand = np.sum(scenes.cubic_spline(near, scene.h) * scene.wall_volume) + scenes.cubic_spline(0.0, scene.h) * (
        scene.spacing**3)
    crowd = np.repeat(point, 3, axis=0)  # three at one place: compressed
    own = 3.0 * scenes.cubic_spline(0.0, scene.h) * scene.spacing**3
    rest = lattice_density(CubicSpline(dim=3), dim=3, hdx=1.0)[0]
    alone = scenes.cubic_spline(0.0, scene.h) * scene.spacing**3
    assert scenes.compression(scene, crowd)[0] == pytest.approx((by_hand - alone + own) / rest - 1.0, rel=1e-9)


def test_level_and_front_of_the_start(scene):
    assert scene.level == pytest.approx(4 * 4 * 6 / 36 * scene.spacing)
    assert scenes.front(scene, scene.fluid) == pytest.approx(1.0, abs=0.01)
    assert scenes.front(scene, scene.fluid + [scene.spacing, 0.0, 0.0]) == pytest.approx(1.25, abs=0.01)
    assert not scenes.outside(scene, scene.fluid).any()
    assert scenes.outside(scene, scene.fluid - [0.0, 0.0, 2.2 * scene.spacing]).sum() == 16  # the lowest layer


def test_front_leaves_out_what_left_the_tank(scene):
    points = scene.fluid.copy()
    points[:3] = [10.0, 0.05, 0.05]  # more than half a row, which the front leaves out anyway
    assert scenes.front(scene, points) == pytest.approx(1.0, abs=0.01)


def test_cost_at_equal_error():
    line = [(1e-2, 1.0), (1e-4, 100.0)]
    assert scenes.at_equal_error(line, 1e-3) == pytest.approx(10.0)  # log-log
    assert scenes.at_equal_error(line, 1e-2) == pytest.approx(1.0)
    beaten = [*line, (1e-3, 50.0), (2e-2, 3.0)]  # worse than the line, but nothing beats it; beaten by the first
    assert scenes.at_equal_error(beaten, 1e-3) == pytest.approx(50.0)
    assert scenes.at_equal_error(beaten, 2e-2) is None
    assert scenes.at_equal_error(line, 2e-2) is None  # never beyond the settings that were run
    assert scenes.at_equal_error(line, 1e-5) is None
    assert scenes.at_equal_error([], 1e-3) is None


def test_pareto_keeps_what_nothing_beats_in_both():
    points = [(3.0, 1.0), (1.0, 3.0), (2.0, 4.0), (2.0, 2.0), (4.0, 1.0)]
    assert scenes.by_rising_error(points) == [1, 3, 0]


def settings_run(scene, error, cost, *, outside=0):
    """A run of ours on two threads with this density error and cost [s/s]."""
    run = peers.Run(peers.OURS, scene, 0.1, {}, "settings")
    run.rounds[2] = [1e3 * cost * run.dt]
    run.record = dict(density_mean=error, outside=outside)
    return run


def test_settings_next_to_the_targets_are_run_again(scene):
    """Of the front, on either side of each error asked for; not what is beaten, nor what lost its particles."""
    high, low = peers.TARGETS
    between = np.sqrt(high * low)
    near = [settings_run(scene, *pair) for pair in ((1.5 * high, 2.0), (between, 3.0), (0.7 * low, 5.0))]
    far = [settings_run(scene, 4.0 * high, 1.0), settings_run(scene, 0.2 * low, 9.0)]
    beaten, lost = settings_run(scene, 1.1 * between, 4.0), settings_run(scene, 0.9 * low, 0.5, outside=96)
    assert set(peers.best([*far, beaten, lost, *near], 2)) == set(near)
    assert peers.best([far[0], near[0]], 2) == [near[0]]  # none is exact enough: the last one alone


def test_times_as_fast_at_equal_error(scene):
    """Twice the cost on a front of the same slope is a ratio of 2; where a front does not reach, none."""
    high, low = peers.TARGETS
    runs = [settings_run(scene, *pair) for pair in ((2.0 * high, 1.0), (0.5 * high, 4.0))]
    other = "Taichi PBF"
    for run in [settings_run(scene, *pair) for pair in ((2.0 * high, 2.0), (0.5 * high, 8.0))]:
        run.code = other
        runs.append(run)
    found = {row["error"]: row["median"] for row in peers.ratios(runs, 2) if row["peer"] == other}
    assert low < 0.5 * high
    assert found == pytest.approx({high: 2.0})


# --- steady boiling, version against version --------------------------------------------------------------------------

def boiling(x=(0.0, 1.0, 2.0, 3.0), phase=(0, 0, 3, 3), bubble=(9, 9, 2, 2), uid=(0, 1, 2, 3), vented=0):
    """A state as a worker writes it; spacing 2 m."""
    state = {"property x": np.array(x), "property y": np.zeros(4), "property z": np.zeros(4),
             "property phase": np.array(phase), "property bubble": np.array(bubble), "property uid": np.array(uid)}
    return state | {"constant n_vented": np.array([float(vented)]), "constant n_bubbles_vented": np.zeros(1),
                    "departures": np.array(1), "spacing": np.array(2.0)}


def test_versions_are_compared_particle_by_particle():
    """In another order in memory they are the same; moved by 1e-8 spacings they are not."""
    turned = boiling(x=(3.0, 2.0, 1.0, 0.0), phase=(3, 3, 0, 0), bubble=(2, 2, 9, 9), uid=(3, 2, 1, 0))
    assert boil.same_positions(boiling(), turned, 12)["holds"]
    assert boil.same_events(boiling(), turned, 50)["holds"]
    moved = boil.same_positions(boiling(), boiling(x=(0.0, 1.0, 2.0 + 2e-8, 3.0)), 12)
    assert not moved["holds"] and "1.0e-08" in moved["found"]
    assert boil.same_positions(boiling(), boiling(x=(0.0, 1.0, 2.0 + 1e-9, 3.0)), 12)["holds"]


@pytest.mark.parametrize("change, found", [
    (dict(phase=(0, 3, 0, 3), bubble=(9, 2, 9, 2)), "2 particles are in another phase; 2 particles have another label"),
    (dict(bubble=(9, 9, 2, 3)), "bubbles 1 here, 2 there; 1 particles have another label"),
    (dict(vented=5), "n_vented 0 here, 5 there"),
    (dict(uid=(0, 1, 2, 7)), "the particles are not the same ones"),
])
def test_what_differs_between_versions_is_told(change, found):
    verdict = boil.same_events(boiling(), boiling(**change), 50)
    assert not verdict["holds"] and verdict["found"] == found


def test_a_twin_says_what_round_off_does():
    """What differs by as much as in the twin is the same; more is not."""
    twin, changed = boiling(x=(0.0, 1.0, 2.002, 3.0), phase=(0, 3, 3, 3)), boiling(phase=(3, 3, 3, 3))
    assert boil.same_positions(boiling(), boiling(x=(0.0, 1.009, 2.0, 3.0)), 12, twin)["holds"]
    assert not boil.same_positions(boiling(), boiling(x=(0.0, 1.021, 2.0, 3.0)), 12, twin)["holds"]
    assert not boil.same_events(boiling(), changed, 50)["holds"]
    verdict = boil.same_events(boiling(), changed, 50, twin)
    assert verdict["holds"] and "in the twin 1 are in another phase, and 0 have another label" in verdict["found"]
    assert not boil.same_events(boiling(), boiling(bubble=(9, 9, 2, 3)), 50, twin)["holds"]
    assert not boil.same_events(boiling(), boiling(phase=(3, 3, 1, 3)), 50, twin)["holds"]


def test_a_twin_starts_a_little_away(tmp_path):
    state = boiling()
    with np.load(boil.moved(state, tmp_path / "moved.npz")) as data:
        away = boil.distances(state, dict(data))
    assert 0.0 < away.max() < 10 * boil.TWIN


def test_other_particles_are_at_no_distance():
    assert not boil.same_positions(boiling(), boiling(uid=(0, 1, 2, 7)), 12)["holds"]


def boiled(scale, **more):
    """Figures of a version whose steps take ``scale`` times as long as those by hand below."""
    steps = [dict(search=scale * search, density=scale * 2.0, whole=scale * 10.0, sweeps=3.0, **more)
             for search in (4.0, 1.0, 2.0)]
    return boil.figures(steps, dict(ms=[900.0, 20.0 * scale, 20.0 * scale], every=10))


def test_figures_of_steps_by_hand():
    """Least and median of each part, and of the rest; a file every ten steps is 2 ms a step, and its first is left out.
    """
    found = boiled(1.0)
    assert found["parts"]["search"] == dict(least=1.0, median=2.0)
    assert found["parts"][boil.OUTSIDE] == dict(least=4.0, median=6.0)
    assert found["parts"][boil.FILE] == dict(least=20.0, median=20.0)
    assert found["outside"] == pytest.approx((17.0 / 3.0 + 2.0) / 12.0)
    assert found["sweeps"] == 3.0 and found["steps"] == 3


def test_table_of_two_versions():
    """A stage that one of them lacks, or that did not run, has no ratio."""
    row = dict(hdx=1.2, particles=4, vapour=2, threads=2, load=[0.1, 0.2],
               versions={boil.HERE: boiled(1.0, film=1.0, idle=0.0), "abc": boiled(2.0, idle=0.0)})
    title, head, rows = boil.table(row)
    cells = {cells[0]: cells[1:] for cells in rows}
    assert "load 0.1 before and 0.2 after" in title and len(head) == 4 and {len(line) for line in rows} == {4}
    assert cells["search"] == ["1.00, 2.00", "2.00, 4.00", "2.00, 2.00"]
    assert cells["film"] == ["1.00, 1.00", "", ""] and cells["idle"][-1] == ""
    assert cells[boil.WHOLE][-1] == "2.00, 2.00"
    assert [line[0] for line in rows[-6:-3]] == [boil.OUTSIDE, boil.WHOLE, boil.FILE]


def test_a_version_that_cannot_be_had_is_a_plain_sentence(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(boil, "ROOT", tmp_path)
    with pytest.raises(boil.NoVersion, match="needs a git checkout"):
        boil.unpack("HEAD", tmp_path / "out")
    subprocess.run(["git", "init", "--quiet", str(tmp_path)], check=True)
    with pytest.raises(boil.NoVersion, match="no commit 'nowhere'"):
        boil.unpack("nowhere", tmp_path / "out")
    with pytest.raises(SystemExit):
        boil.main(["--against", "nowhere"])
    assert capsys.readouterr().err.splitlines()[-1].endswith("this checkout has no commit 'nowhere'")


def test_a_commit_is_unpacked_beside_what_is_edited(tmp_path, monkeypatch):
    git = ["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b"]
    (tmp_path / "file").write_text("committed")
    subprocess.run(["git", "init", "--quiet", str(tmp_path)], check=True)
    subprocess.run([*git, "add", "file"], check=True)
    subprocess.run([*git, "commit", "--quiet", "-m", "one"], check=True)
    (tmp_path / "file").write_text("edited")
    monkeypatch.setattr(boil, "ROOT", tmp_path.resolve())
    out = tmp_path / "out"
    name = boil.unpack("HEAD", out)
    assert (out / "file").read_text() == "committed" and (tmp_path / "file").read_text() == "edited"
    assert boil.git("rev-parse", "HEAD").decode().startswith(name)


# --- all of them ------------------------------------------------------------------------------------------------------

def test_without_the_other_codes_the_rest_of_the_table_stands(tmp_path, monkeypatch, capsys):
    """peers.py says that they are not installed; that is no failure, a benchmark that breaks is one."""
    size = dict(rows=[dict(fluid=1000, wall=500, ns=1500.0, low=1400.0, high=1600.0, share=dict(search=0.5))],
                flatness=1.1, bytes=394.0)
    status = dict(size=0)

    def stand_in(job):
        path = Path(job.command[job.command.index("--json") + 1])
        if job.name == "peers":
            assert "--no-install" in job.command
            return Outcome(job, peers.NOT_INSTALLED, 1.0, "the process ended with exit status 3")
        path.write_text(json.dumps(size))
        return Outcome(job, status[job.name], 1.0, "it failed" * status[job.name])

    monkeypatch.setattr(summary, "run_job", stand_in)
    page, arguments = tmp_path / "table.md", ["--only", "size", "peers", "--report", str(tmp_path / "table.md")]
    assert summary.main(arguments) == 0
    text = page.read_text()
    assert "| size | memory of a particle | 394 bytes |" in text
    assert "| peers | did not run | the other codes are not installed |" in text
    status["size"] = 1
    assert summary.main(arguments) == 1


def test_other_codes_are_not_fetched_unasked(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["peers.py", "--quick", "--no-install", "--environment", str(tmp_path / "none")])
    assert peers.main() == peers.NOT_INSTALLED
    assert "not installed" in capsys.readouterr().err

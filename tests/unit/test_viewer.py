"""The page of a run: what it shows, to whom, and that it follows a run that is being written."""
import json
import os
import socket
import sys

import numpy as np
import pytest
from browser import tab, until
from standin import DX, FILL, N, ball, block, glass

from pysph_boiling.analysis import viewer as module
from pysph_boiling.analysis.drawing import PHASE_COLOURS, bubble_colours, to_rgb
from pysph_boiling.analysis.viewer import HOST, KEPT, Outputs, Viewer
from pysph_boiling.cli import main
from pysph_boiling.phases import Phase

POINTS = block(N, N, FILL)
LABEL = int(np.argmax(bubble_colours(np.arange(50)) @ [-1.0, 0.0, 1.0]))  # of a bubble that is blue


def vapour(step):
    """Mask (n,) of the vapour in output ``step``: a bubble that rises by a spacing, and none in the first."""
    return ball((5, 5, 1.5 + step), 1.6, POINTS) & (step > 0)


def temperature(step):
    return 350.0 + 10.0 * step + 20.0 * POINTS[:, 2] / (N * DX)


def write(folder, step, t=None, heat=True):
    """Write output ``step`` of a run, with or without temperatures; returns its path."""
    from pysph.base.utils import get_particle_array
    from pysph.solver.output import dump

    arrays = []
    phase = np.where(vapour(step), Phase.VAPOUR, Phase.LIQUID)
    for name, pa in glass(POINTS).items():
        array = get_particle_array(name=name, x=pa.x, y=pa.y, z=pa.z, m=1000.0 * DX**3, rho=1000.0, h=DX)
        if name == "fluid":
            for prop, data in (("phase", phase), ("bubble", np.full(len(POINTS), LABEL))):
                array.add_property(prop, type="int", data=data)
            array.add_property("T", data=temperature(step))
            array.add_output_arrays(["phase", "bubble", *["T"] * heat])
        arrays.append(array)
    path = folder / f"glass_{step}.hdf5"
    dump(str(path), arrays, {"t": 0.1 * step if t is None else t, "dt": 0.1, "count": step})
    return path


@pytest.fixture
def folder(tmp_path):
    """The folder of a run without outputs."""
    folder = tmp_path / "glass_output"
    folder.mkdir()
    (folder / "glass.info").write_text("{}")
    (folder / "run.json").write_text(json.dumps({"dim": 3, "spacing": DX, "scene": "glass_of_water"}))
    return folder


@pytest.fixture
def started():
    """Viewers that a test starts, closed at its end."""
    viewers = []

    def start(*args, **options):
        viewers.append(Viewer(*args, **{"port": 18080, **options}))
        return viewers[-1]

    yield start
    for one in viewers:
        one.close()


def test_outputs_leave_out_a_half_written_file_and_few_stay_in_memory(folder):
    paths = [write(folder, step) for step in range(7)]
    content = paths[-1].read_bytes()
    paths[-1].write_bytes(content[:len(content) // 2])
    outputs = Outputs(folder)
    assert len(outputs) == 6 and outputs[5][0] == pytest.approx(0.5)
    assert not outputs.refresh()
    paths[-1].write_bytes(content)
    assert outputs.refresh() and len(outputs) == 7 and outputs[-1][0] == pytest.approx(0.6)
    assert [outputs[k][0] for k in range(7)] == pytest.approx(0.1 * np.arange(7)) and len(outputs.loaded) == KEPT
    write(folder, 0, t=5.0)  # the run starts anew
    os.utime(paths[0], (1.0, 1.0))
    assert outputs[0][0] == pytest.approx(5.0)
    paths[3].unlink()
    assert outputs[3] is None
    assert outputs.refresh() and len(outputs) == 6


def test_it_shows_what_the_controls_say(folder, started):
    for step in range(3):
        write(folder, step)
    page = started(folder)
    assert page.shown.t == 0.0 and len(page.shown.points) == len(POINTS)
    assert page.shown.colours == pytest.approx(np.tile(to_rgb(PHASE_COLOURS[Phase.LIQUID]), (len(POINTS), 1)))
    page.time.value = 2
    assert page.shown.t == pytest.approx(0.2) and "t = 0.200 s" in page.text.content
    steam = np.all(page.shown.colours == to_rgb(PHASE_COLOURS[Phase.VAPOUR]), axis=1)
    assert np.array_equal(steam, vapour(2)) and steam.any()
    page.part.value = "bubbles"
    assert len(page.shown.points) == vapour(2).sum()
    page.colour.value = "bubble"
    assert page.shown.colours == pytest.approx(np.tile(bubble_colours(np.array([LABEL])), (vapour(2).sum(), 1)))
    page.part.value = "half"
    assert page.shown.points[:, 1].min() > 0.45 * N * DX and len(page.shown.points) == pytest.approx(
        0.5 * len(POINTS), rel=0.05)
    page.part.value, page.colour.value = "all", "temperature"
    red, _, blue = page.shown.colours[temperature(2).argmax()]
    assert red - blue > 0.4
    assert page.limits["temperature"][1] == pytest.approx(temperature(2).max() - 273.15, abs=0.1)
    assert "temperature" in page.text.content
    page.time.value = 0  # the scale is that of the run: what is hottest in the first output is not red
    red, _, blue = page.shown.colours[temperature(0).argmax()]
    assert red - blue < 0.4
    red, _, blue = page.shown.colours[temperature(0).argmin()]
    assert blue - red > 0.3


def test_surfaces_are_there_when_they_are_asked_for(folder, started):
    write(folder, 2)
    page = started(folder)
    find = page.server.scene.get_handle_by_name
    assert find("/water") is None and find("/fluid") is not None
    page.surfaces.value = True
    assert find("/water") is not None and find("/bubbles") is not None
    page.surfaces.value = False
    assert find("/water") is None and find("/bubbles") is None


def test_only_this_machine_can_see_it(folder, started):
    write(folder, 0)
    page = started(folder)
    assert page.address.startswith(f"http://{HOST}:") and HOST == "127.0.0.1"
    port = page.server.get_port()
    socket.create_connection((HOST, port), timeout=10).close()
    others = ["127.0.0.2"] if sys.platform.startswith("linux") else []  # all of 127/8 is this machine there
    others += {info[4][0] for info in socket.getaddrinfo(socket.gethostname(), port, socket.AF_INET)} - {HOST}
    assert others
    for address in others:
        with pytest.raises(OSError):
            socket.create_connection((address, port), timeout=10)


def test_live_waits_follows_and_stays_where_one_looks(folder, started, monkeypatch):
    page = started(folder, live=True)
    assert page.shown is None and "waiting" in page.text.content
    monkeypatch.setattr(module, "LOOK", 0.0)
    write(folder, 0)
    page.step()
    assert page.shown.t == 0.0
    for step in (1, 2):
        write(folder, step)
        page.step()
    assert page.shown.t == pytest.approx(0.2) and page.time.value == 2
    page.time.value = 1
    write(folder, 3)
    page.step()
    assert page.shown.t == pytest.approx(0.1) and page.time.max == 3
    (folder / "glass_4.hdf5").write_bytes(b"\x89HDF\r\n\x1a\n half")
    page.step()
    assert page.time.max == 3
    for step in range(1, 5):  # a run that starts anew removes its files
        (folder / f"glass_{step}.hdf5").unlink()
    page.step()
    assert page.time.value == 0 and page.shown.t == 0.0


def test_bad_requests_are_named(folder, monkeypatch, capsys):
    assert main(["view", str(folder)]) == main(["view", str(folder / "no")]) == 2
    write(folder, 0, heat=False)
    assert main(["view", str(folder), "--port", "70000"]) == 2
    assert main(["view", str(folder), "--colour", "temperature"]) == 2
    monkeypatch.setitem(sys.modules, "viser", None)
    assert main(["view", str(folder)]) == 2
    empty, missing, port, colour, package = capsys.readouterr().err.splitlines()
    assert "no particle files" in empty and "--live waits" in missing
    assert "--port must be 1 to 65535, got 70000" in port
    assert "colour must be one of phase, bubble, speed, density in this run, got 'temperature'" in colour
    assert "viser is missing: pip install 'pysph_boiling[watch]'" in package


def test_the_page_in_a_browser(folder, started, tmp_path):
    """Keys on the slider change the time, and pixels follow the time and the colour."""
    for step in range(3):
        write(folder, step)
    page = started(folder)
    page.part.value = "bubbles"
    red = to_rgb(PHASE_COLOURS[Phase.VAPOUR]) * 255.0

    def like(colour):
        rows, _ = np.nonzero(np.abs(seen.pixels() - colour).max(axis=2) < 40.0)
        return rows

    with tab(page.address, tmp_path) as seen:
        until(page.server.get_clients)
        until(lambda: seen.value("document.querySelector('[role=slider]') !== null"))
        assert len(like(red)) == 0
        seen.value("document.querySelector('[role=slider]').focus()")
        seen.press("ArrowRight")
        until(lambda: page.shown.number == 1)
        until(lambda: len(like(red)) > 100)
        low = like(red)
        seen.press("ArrowRight")
        until(lambda: page.shown.number == 2)
        until(lambda: (found := like(red)).size and np.median(found) < np.median(low) - 5)  # it rises
        page.colour.value = "bubble"
        hue = bubble_colours(np.array([LABEL]))[0] * 255.0
        assert np.abs(hue - red).max() > 80.0
        until(lambda: len(like(hue)) > 0.5 * len(low) and not len(like(red)))

"""Pictures: what is in the scene, and nothing else, is in the pixels."""
import json
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.image import imread, imsave
from standin import cloud

from pysph_boiling.analysis import drawing, rendering
from pysph_boiling.analysis.rendering import (
    BUBBLE_COLOURS,
    PHASE_COLOURS,
    STATE_COLOURS,
    bubble_colours,
    contact_sheet,
    draw_scene,
    render_run,
)
from pysph_boiling.cli import main
from pysph_boiling.particles import NO_BUBBLE
from pysph_boiling.phases import Phase

DX = 0.01
SQUARE = np.array([[0.0, 0.0, 0.0], [10 * DX, 10 * DX, 10 * DX]])
DPI = 75  # half of the real one, for speed
PIXELS_PER_METRE = rendering.LONGEST * DPI / (1.04 * 10 * DX)  # of SQUARE: 2 % of margin at each end


@pytest.fixture(autouse=True)
def _small_pictures(monkeypatch):
    monkeypatch.setattr(rendering, "DPI", DPI)


def lattice(n, dim):
    grid = np.zeros((n**dim, 3))
    grid[:, :dim] = DX * (np.stack(np.meshgrid(*[np.arange(n)] * dim, indexing="ij"), -1).reshape(-1, dim) + 0.5)
    return grid


def pixels(path, colour, tolerance=0.02):
    """Mask (h, w) of the pixels of a colour."""
    return np.abs(imread(path)[..., :3] - rendering.to_rgb(colour)).max(axis=-1) < tolerance


def assert_is_picture(path):
    assert path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert np.ptp(imread(path)) > 0.0


def test_vapour_colour_is_there_only_with_vapour(tmp_path):
    points = lattice(10, 2)
    phase = np.zeros(100, dtype=int)
    draw_scene({"fluid": cloud(points, phase=phase)}, tmp_path / "calm.png", dim=2, spacing=DX)
    assert not pixels(tmp_path / "calm.png", PHASE_COLOURS[Phase.VAPOUR]).any()

    phase[[44, 45, 54, 55]] = Phase.VAPOUR
    path = draw_scene({"fluid": cloud(points, phase=phase)}, tmp_path / "boil.png", dim=2, spacing=DX, bounds=SQUARE)
    assert_is_picture(path)
    core = np.pi / 4 * (rendering.DISC[1][0] * DX * PIXELS_PER_METRE) ** 2  # a disc without its darker rim
    found = pixels(path, PHASE_COLOURS[Phase.VAPOUR]).sum()
    assert found == pytest.approx(4 * core, rel=0.12)  # antialiased edges, and the dot in the legend
    for p in (Phase.TRANSITION, Phase.SUPERHEATED):
        assert not pixels(path, PHASE_COLOURS[p]).any()


@pytest.mark.parametrize(("e_lat", "hot"), [(None, [True, True, True, False]), (5.0, [False, False, True, False])])
def test_liquid_held_at_saturation_is_not_drawn_as_superheated(tmp_path, monkeypatch, e_lat, hot):
    """Four particles without a site, of e = 1, 5, 9 and 0 J/kg; an interruption held 5 J/kg in each, or nothing."""
    monkeypatch.setattr(rendering, "MARGINS", SimpleNamespace(left=0.05, right=0.05, bottom=0.05, top=0.05))
    said = []
    monkeypatch.setattr(rendering, "_legend_entries", lambda *a, made=rendering._legend_entries: said.extend(
        entry.get_label() for entry in made(*a)))  # their dots would count as pixels
    held = {} if e_lat is None else {"e_lat": e_lat}
    fluid = cloud(DX * np.array([[x, 5.0, 0.0] for x in (1, 4, 6, 9)]), phase=int(Phase.SUPERHEATED),
                  e=np.array([1.0, 5.0, 9.0, 0.0]), **held)
    path = draw_scene({"fluid": fluid}, tmp_path / "held.png", dim=2, spacing=DX, bounds=SQUARE)
    disc = np.pi / 4 * (rendering.DISC[1][0] * DX * PIXELS_PER_METRE) ** 2
    hot = sum(hot)
    assert pixels(path, STATE_COLOURS["superheated"]).sum() == pytest.approx(hot * disc, rel=0.12)
    assert pixels(path, STATE_COLOURS["held"]).sum() == pytest.approx((4 - hot) * disc, rel=0.12)
    assert said == [f"superheated {hot}", f"held {4 - hot}"]


@pytest.mark.parametrize(("spacing", "shape"), [(DX, (10, 10)), (DX, (10, 3)), (DX, (3, 10)), (2 * DX, (10, 4))])
def test_disc_has_the_size_of_the_particle_whatever_the_axes(tmp_path, spacing, shape):
    bounds = np.array([[0.0, 0.0, 0.0], [shape[0] * DX, shape[1] * DX, 0.0]])
    fluid = cloud([[1.5 * DX, 1.5 * DX, 0.0]], u=1.0, v=0.0, w=0.0)
    draw_scene({"fluid": fluid}, tmp_path / "one.png", dim=2, spacing=spacing, bounds=bounds, limits=(0.0, 1.0))
    yellow = pixels(tmp_path / "one.png", tuple(_top_of("viridis")), tolerance=0.05)
    yellow[:, -int(rendering.MARGINS.right * DPI):] = False  # the colour bar
    width, height = yellow.any(axis=0).sum(), yellow.any(axis=1).sum()
    expected = rendering.DISC[1][0] * spacing * PIXELS_PER_METRE
    assert (width, height) == pytest.approx((expected, expected), abs=2)  # [pixel]


def _top_of(name):
    from matplotlib import colormaps
    return [colormaps[name](1.0)[:3]]


def test_slice_hides_liquid_off_the_plane_but_no_vapour(tmp_path):
    middle, front = [5 * DX, 5 * DX, 2 * DX], [5 * DX, 0.5 * DX, 8 * DX]
    for phase, hidden in ((Phase.LIQUID, True), (Phase.VAPOUR, False)):
        fluid = cloud([middle, front], phase=np.array([Phase.SUPERHEATED, phase]))
        path = draw_scene({"fluid": fluid}, tmp_path / "slice.png", dim=3, spacing=DX, bounds=SQUARE)
        upper = imread(path)[75:200, 100:450, :3]  # holds the second particle only
        assert np.all(upper == 1.0) == hidden
        assert pixels(path, PHASE_COLOURS[Phase.SUPERHEATED]).sum() > 250


def test_slice_puts_near_vapour_over_far(tmp_path):
    near, far = [5 * DX, 0.5 * DX, 5 * DX], [5 * DX, 9.5 * DX, 5 * DX]
    labels = np.array([3, 4])
    for order in ([near, far], [far, near]):
        fluid = cloud(order, phase=int(Phase.VAPOUR), bubble=labels)
        path = draw_scene({"fluid": fluid}, tmp_path / "v.png", dim=3, spacing=DX, bounds=SQUARE, colour="bubble")
        expected = bubble_colours(labels[order.index(near)])
        assert pixels(path, tuple(map(tuple, expected[None])), 0.03).sum() > 80


def test_3d_view_colours_bubbles_by_label_and_leaves_liquid_out(tmp_path):
    points = lattice(10, 3)
    phase = np.where(np.linalg.norm(points - 5 * DX, axis=1) < 2.5 * DX, Phase.VAPOUR, Phase.LIQUID)
    label = np.where(phase == Phase.VAPOUR, 77, NO_BUBBLE).astype(np.uint32)
    wall = cloud([[-0.5 * DX, y, z] for y in points[:10, 2] for z in points[:10, 2]], heated=1)
    sites = cloud([[5 * DX, 5 * DX, 0.0]])
    path = draw_scene({"fluid": cloud(points, phase=phase, bubble=label), "wall": wall, "sites": sites},
                      tmp_path / "3d.png", dim=3, spacing=DX, view="3d", t=1.0, title="test")
    assert_is_picture(path)
    hue = bubble_colours(77) - bubble_colours(77).min()
    inside = imread(path)[..., :3].astype(float)
    inside = inside[np.ptp(inside, axis=-1) > 0.25]
    shades = inside - inside.min(axis=-1, keepdims=True)
    alike = shades @ hue / np.linalg.norm(shades, axis=-1) / np.linalg.norm(hue)
    assert np.mean(alike > 0.97) > 0.5  # most strongly coloured pixels are shades of that one bubble
    assert not pixels(path, PHASE_COLOURS[Phase.LIQUID]).any()


def test_a_bubble_keeps_its_colour():
    many = bubble_colours(np.arange(5000, dtype=np.uint32))
    assert np.array_equal(bubble_colours(np.array([4321], dtype=np.uint32))[0], many[4321])
    counts = np.unique(many, axis=0, return_counts=True)[1]
    assert len(counts) == len(BUBBLE_COLOURS)
    assert counts.min() > 0.8 * 5000 / len(BUBBLE_COLOURS)
    none = bubble_colours(np.array([NO_BUBBLE], dtype=np.uint32))[0]
    assert np.array_equal(none, rendering.to_rgb(drawing.UNLABELLED))


def test_scene_without_phases_is_coloured_by_speed(tmp_path):
    points = lattice(6, 3)
    fluid = cloud(points, u=points[:, 2], v=0.0, w=0.0, rho=1000.0)
    for view in ("slice", "3d"):
        default = draw_scene({"fluid": fluid}, tmp_path / f"{view}.png", dim=3, spacing=DX, view=view)
        speed = draw_scene({"fluid": fluid}, tmp_path / f"{view}_speed.png", dim=3, spacing=DX, view=view,
                           colour="speed")
        assert_is_picture(default)
        assert np.array_equal(imread(default), imread(speed))
    density = draw_scene({"fluid": fluid}, tmp_path / "rho.png", dim=3, spacing=DX, colour="density", slice_axis="x")
    assert_is_picture(density)


@pytest.mark.parametrize(("options", "message"), [
    ({"colour": "taste"}, "colour must be one of"), ({"colour": "temperature"}, "needs the properties T"),
    ({"view": "side"}, "view must be"), ({"slice_axis": "w"}, "slice_axis must be"), ({"dim": 1}, "dim must be"),
    ({"spacing": 0.0}, "spacing"),
])
def test_bad_requests_are_named(tmp_path, options, message):
    arguments = {"dim": 2, "spacing": DX, **options}
    with pytest.raises(ValueError, match=message):
        draw_scene({"fluid": cloud(lattice(2, 2), phase=0)}, tmp_path / "no.png", **arguments)
    with pytest.raises(ValueError, match="no fluid"):
        draw_scene({"wall": cloud(lattice(2, 2))}, tmp_path / "no.png", dim=2, spacing=DX)


@pytest.mark.parametrize("layers", [1, 3])
def test_room_between_the_walls(layers):
    grid = DX * (np.stack(np.meshgrid(*[np.arange(-layers, 8 + layers)] * 3, indexing="ij"), -1).reshape(-1, 3) + 0.5)
    inside = np.all((grid > 0.0) & (grid < 8 * DX), axis=1) | (grid[:, 2] > 8 * DX)  # no lid
    walls = [cloud(grid[~inside])]
    bounds = np.array([np.full(3, -layers * DX), DX * np.array([8 + layers, 8 + layers, 8.0])])
    room = rendering.inner_bounds(walls, bounds, DX)
    assert room == pytest.approx(np.array([[0.0, 0.0, 0.0], [8 * DX, 8 * DX, 8 * DX]]), abs=1e-12)


def test_free_surface_is_the_top_of_each_column():
    points = lattice(4, 3)[np.random.default_rng(1).permutation(64)]
    top = rendering._free_surface(points, DX)
    assert len(top) == 16
    assert top[:, 2] == pytest.approx(3.5 * DX)


@pytest.fixture
def run_folder(tmp_path):
    """Five PySPH output files of a falling 2-D drop that turns to vapour; ``T`` is a property but never written."""
    from pysph.base.utils import get_particle_array
    from pysph.solver.output import dump

    folder = tmp_path / "drop_output"
    folder.mkdir()
    (folder / "drop.info").write_text("{}")
    for step in range(5):
        x, y, z = (lattice(8, 2) - [0.0, 2 * DX * step, 0.0]).T
        pa = get_particle_array(name="fluid", x=x, y=y, z=z, m=1000.0 * DX**2, rho=1000.0, h=DX)
        pa.add_property("phase", type="int", data=np.full(64, Phase.VAPOUR if step == 4 else Phase.LIQUID))
        pa.add_property("T")
        pa.add_output_arrays(["phase"])
        dump(str(folder / f"drop_{step}.hdf5"), [pa], {"t": 0.1 * step, "dt": 0.1, "count": step})
    return folder


def test_render_run(run_folder, tmp_path):
    paths = render_run(run_folder)
    assert [p.name for p in paths] == [f"frame_{i:05d}.png" for i in range(5)]
    assert paths[0].parent == run_folder / "frames"
    shapes = {imread(p).shape for p in paths}
    assert len(shapes) == 1  # nothing moves between frames
    height, width = shapes.pop()[:2]
    assert (height % 2, width % 2) == (0, 0)
    assert [pixels(p, PHASE_COLOURS[Phase.VAPOUR]).any() for p in paths] == [False] * 4 + [True]
    picture = slice(0, -int(rendering.MARGINS.right * DPI))  # without the legend
    tops = [np.argmax(pixels(p, PHASE_COLOURS[Phase.LIQUID])[:, picture].any(axis=1)) for p in paths[:4]]
    assert np.all(np.diff(tops) > 0)  # one view for all frames: the drop is seen to fall
    assert np.ptp(np.diff(tops)) <= 2

    # the record of the run and the estimate from mass and density agree; every fourth file; older frames go
    (run_folder / "run.json").write_text(json.dumps({"dim": 2, "spacing": DX}))
    first = imread(paths[0])
    again = render_run(run_folder, every=4)
    assert np.array_equal(imread(again[0]), first)
    assert len(list((run_folder / "frames").iterdir())) == len(again) == 2
    assert len(render_run(run_folder, every=5, out=tmp_path / "elsewhere", colour="speed")) == 1


def test_render_run_does_not_read_what_was_not_written(run_folder, tmp_path):
    with pytest.raises(ValueError, match="needs the properties T"):
        render_run(run_folder, colour="temperature")
    with pytest.raises(FileNotFoundError, match="no particle files"):
        render_run(tmp_path)


def test_command_draws_and_makes_a_movie(run_folder, capsys):
    from PIL import Image

    assert main(["render", str(run_folder), "--every", "2", "--movie", "gif", "--fps", "10"]) == 0
    assert {p.name for p in run_folder.glob("*.*") if p.suffix != ".hdf5"} == {"drop.info", "frames.png", "movie.gif"}
    with Image.open(run_folder / "movie.gif") as movie:
        assert (movie.n_frames, movie.info["duration"]) == (3, 100)
    assert "3 pictures" in capsys.readouterr().out
    assert main(["render", str(run_folder), "--every", "0"]) == 2
    assert "--every must be 1 or more" in capsys.readouterr().err


def test_contact_sheet_takes_frames_evenly_and_in_order(tmp_path):
    paths = [tmp_path / f"{i}.png" for i in range(17)]
    for i, path in enumerate(paths):
        imsave(path, np.full((20, 30, 3), i / 32))
    sheet = imread(contact_sheet(paths, tmp_path / "sheet.png"))
    assert sheet.shape[:2] == (60, 90)
    cells = sheet.reshape(3, 20, 3, 30, -1)[:, 10, :, 15, 0].ravel()
    assert cells == pytest.approx(np.arange(0, 17, 2) / 32, abs=1 / 255)
    small = imread(contact_sheet(paths[:4], tmp_path / "small.png", width=45))
    assert small.shape[:2] == (20, 45)  # 4 pictures in 2 rows, every 2 x 2 pixels averaged
    assert np.all(small[11:, 16:] == 1.0)  # the rest of the last row is blank
    with pytest.raises(ValueError, match="at least one"):
        contact_sheet([], tmp_path / "none.png")

"""Movies: every picture, in order, at its time."""
import numpy as np
import pytest
from PIL import Image

from pysph_boiling import cli
from pysph_boiling.analysis.movie import GIF_WIDTHS, write_movie


@pytest.fixture
def pictures(tmp_path):
    """Nine pictures (101 wide, 75 high): a dark bar moves over a gradient, from left to right."""
    paths = []
    for i in range(9):
        pixels = np.zeros((75, 101, 3), np.uint8)
        pixels[..., 2] = np.linspace(120, 250, 75)[:, None]
        pixels[..., 1] = 200
        pixels[:, 10 * i:10 * i + 20] = 20
        paths.append(tmp_path / f"p{i}.png")
        Image.fromarray(pixels).save(paths[-1])
    return paths


def assert_bar_moves(frames, step):
    """The dark columns of the frames (h, w, 3) are those of the pictures, in order."""
    for i, frame in enumerate(frames):
        dark = np.nonzero(np.asarray(frame, dtype=float)[..., 1].mean(axis=0) < 100)[0]
        assert (dark.min(), dark.max()) == pytest.approx((10 * step * i, (10 * i + 19) * step), abs=max(1.5, 2 * step))


@pytest.mark.parametrize("fps", [15, 4])
def test_gif(pictures, tmp_path, fps):
    path = write_movie(pictures, tmp_path / "m.gif", fps=fps)
    with Image.open(path) as movie:
        assert (movie.n_frames, movie.size, movie.info["loop"]) == (9, (101, 75), 0)
        frames, times = [], []
        for i in range(movie.n_frames):
            movie.seek(i)
            frames.append(np.asarray(movie.convert("RGB")))
            times.append(movie.info["duration"])
    assert sum(times) == pytest.approx(9000 / fps, abs=5)  # [ms]
    assert_bar_moves(frames, 1.0)
    background = np.asarray(Image.open(pictures[0]).convert("RGB"))[:, 60:].astype(float)
    assert np.abs(frames[0][:, 60:] - background).mean() < 3.0


def test_gif_is_small_and_has_one_palette(pictures, tmp_path):
    wide = []
    for picture in pictures[:3]:
        wide.append(tmp_path / f"wide_{picture.name}")
        Image.open(picture).resize((1010, 750)).save(wide[-1])
    path = write_movie(wide, tmp_path / "m.gif")
    with Image.open(path) as movie:
        assert movie.size == (GIF_WIDTHS[0], round(GIF_WIDTHS[0] * 750 / 1010))
        frames = []
        for i in range(3):
            movie.seek(i)
            frames.append(np.asarray(movie.convert("RGB")))
    assert_bar_moves(frames, GIF_WIDTHS[0] / 101)
    colours = [set((frame.astype(int) @ [1, 256, 65536]).ravel()) for frame in frames]
    assert len(colours[0]) > 50 and len(set.union(*colours)) <= 256


def test_mp4(pictures, tmp_path):
    import imageio_ffmpeg

    path = write_movie(pictures, tmp_path / "m.MP4", fps=12)
    reader = imageio_ffmpeg.read_frames(str(path))
    meta = next(reader)
    assert (meta["codec"], meta["fps"]) == ("h264", 12.0)
    assert meta["pix_fmt"].startswith("yuv420p")
    assert meta["size"] == (102, 76)  # even, as yuv420p asks; the last column and row are repeated
    frames = [np.frombuffer(data, np.uint8).reshape(76, 102, 3) for data in reader]
    assert len(frames) == 9
    assert_bar_moves(frames, 1.0)
    assert np.abs(frames[0][:, 60:].astype(float)[:75, :41] - np.asarray(Image.open(pictures[0]))[:, 60:]).mean() < 6.0
    assert path.read_bytes().find(b"moov") < path.read_bytes().find(b"mdat")  # plays while it loads


@pytest.mark.parametrize("fps", [25, 7])
def test_webp(pictures, tmp_path, fps):
    path = write_movie(pictures, tmp_path / "m.webp", fps=fps)
    with Image.open(path) as movie:
        assert (movie.n_frames, movie.size, movie.info["loop"]) == (9, (101, 75), 0)
        frames, times = [], []
        for i in range(movie.n_frames):
            movie.seek(i)
            movie.load()
            frames.append(np.asarray(movie.convert("RGB")))
            times.append(movie.info["duration"])
    assert np.cumsum(times) == pytest.approx(1000 / fps * np.arange(1, 10), abs=0.51)  # [ms]
    assert_bar_moves(frames, 1.0)


@pytest.fixture
def noise(tmp_path):
    """Six pictures of noise, which hardly compress."""
    random, paths = np.random.default_rng(1), [tmp_path / f"n{i}.png" for i in range(6)]
    for path in paths:
        Image.fromarray(random.integers(0, 256, (120, 160, 3), dtype=np.uint8)).save(path)
    return paths


@pytest.mark.parametrize("suffix", [".gif", ".mp4", ".webp"])
def test_a_limit_lowers_the_quality(noise, tmp_path, suffix):
    """60 % of the size is reached; a hundredth is not, and the movie that was there stays."""
    if suffix == ".gif":
        for path in noise:  # wide ones, for its width is what is lowered
            with Image.open(path) as small:
                small.resize((480, 360), Image.Resampling.NEAREST).save(path)
    path = tmp_path / f"m{suffix}"
    full = write_movie(noise, path).stat().st_size
    assert write_movie(noise, path, limit=1.01e-6 * full).stat().st_size == full
    less = write_movie(noise, path, limit=0.6e-6 * full).stat().st_size
    assert 0.05 * full < less <= 0.6 * full
    with pytest.raises(ValueError, match="even at the lowest quality, which is above the limit of .* fewer or smaller"):
        write_movie(noise, path, limit=0.01e-6 * full)
    assert path.stat().st_size == less and not list(tmp_path.glob(".m*"))


def test_bad_requests_are_named(pictures, tmp_path):
    other = tmp_path / "other.png"
    Image.new("RGB", (50, 50)).save(other)
    for paths, name, options, message in (
            (pictures, "m.avi", {}, "must end in .gif, .mp4, .webp, got 'm.avi'"),
            ([], "m.gif", {}, "at least one picture"),
            ([*pictures, other], "m.mp4", {}, r"the same size, got 101 x 75 \(p0.png\), 50 x 50 \(other.png\)"),
            (pictures, "m.mp4", {"fps": 0}, "fps must be > 0"),
            (pictures, "m.webp", {"limit": 0}, "limit of a movie's size must be > 0 MB, got 0 MB")):
        with pytest.raises(ValueError, match=message):
            write_movie(paths, tmp_path / name, **options)
        assert not (tmp_path / name).exists()


@pytest.mark.parametrize("suffix", [".gif", ".mp4", ".webp"])
def test_a_movie_that_fails_leaves_the_earlier_one(pictures, tmp_path, suffix):
    path = tmp_path / f"m{suffix}"
    write_movie(pictures[:2], path)
    before = path.read_bytes()
    pictures[5].write_bytes(pictures[5].read_bytes()[:150])  # its size can still be read
    with pytest.raises(OSError):
        write_movie(pictures, path)
    assert path.read_bytes() == before
    assert {p.name for p in tmp_path.iterdir()} == {path.name, *(p.name for p in pictures)}


@pytest.mark.parametrize(("arguments", "message"), [
    (["--movie", "mp4"], "there is no ffmpeg to write an mp4: No ffmpeg exe could be found; a gif does not need it"),
    (["--movie", "gif", "--fps", "0"], "fps must be > 0, got 0.0"),
    (["--movie", "gif", "--fps", "nan"], "fps must be > 0, got nan"),
    (["--movie", "webp", "--limit", "-1"], "the limit of a movie's size must be > 0 MB, got -1.0 MB"),
])
def test_what_a_movie_needs_is_asked_for_before_pictures_are_drawn(tmp_path, monkeypatch, capsys, arguments, message):
    def none():
        raise RuntimeError("No ffmpeg exe could be found\n and more")

    monkeypatch.setattr("imageio_ffmpeg.get_ffmpeg_exe", none)
    monkeypatch.setattr("pysph_boiling.analysis.rendering.render_run", lambda *_, **__: pytest.fail("drawn"))
    assert cli.main(["render", str(tmp_path), *arguments]) == 2
    assert capsys.readouterr().err == f"pysph-boiling: {message}\n"

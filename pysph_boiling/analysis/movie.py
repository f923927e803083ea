"""Movies from series of pictures: GIF and WebP with Pillow, MP4 with the ffmpeg of the package imageio-ffmpeg."""
import math
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pysph_boiling.analysis.drawing import needed

__all__ = ["KINDS", "check_movie", "write_movie"]

KINDS = ("gif", "mp4", "webp")
GIF_WIDTHS = (480, 400, 320, 240, 160)  # [pixel], from the best; wider pictures are scaled down to keep the GIF small
GIF_SAMPLES = 8  # pictures from which the palette is made
MP4_QUALITIES = (18, 22, 26, 30, 34)  # constant rate factors of H.264: 0 lossless .. 51
WEBP_QUALITIES = (80, 65, 50, 35, 20)  # 0 .. 100


def check_movie(kind: str, fps: float, limit: float | None = None) -> None:
    """Raise the errors of :func:`write_movie` before pictures are drawn; ``kind`` is one of ``KINDS``."""
    if not (math.isfinite(fps) and fps > 0.0):
        raise ValueError(f"fps must be > 0, got {fps}")
    if limit is not None and not limit > 0.0:
        raise ValueError(f"the limit of a movie's size must be > 0 MB, got {limit} MB")
    needed("PIL.Image")
    if kind == "mp4":
        try:
            needed("imageio_ffmpeg").get_ffmpeg_exe()
        except RuntimeError as error:
            raise OSError(f"there is no ffmpeg to write an mp4: {str(error).splitlines()[0]}; a gif does not need it"
                          ) from None


def write_movie(paths: Sequence, path: str | os.PathLike, fps: float = 15, limit: float | None = None) -> Path:
    """Write pictures of equal size, in order, as a movie; returns its path.

    The suffix of ``path`` chooses the format. A ``.gif`` loops forever, has one palette for all pictures and is at most
    480 pixels wide. A ``.webp`` loops forever and has the size of the pictures. An ``.mp4`` is H.264 (yuv420p) of full
    size; if that is odd, the last row or column is repeated. With a ``limit`` [MB], the quality (of a GIF: the width)
    is lowered in up to four steps until the file is not larger. The file only appears when it is complete.

    Errors: ``ValueError`` for another suffix, no pictures, pictures of different size, fps or limit <= 0, and a limit
    that cannot be kept; ``ModuleNotFoundError`` where a package is missing.
    """
    paths, path = [Path(p) for p in paths], Path(path)
    kind = path.suffix.lower()[1:]
    if kind not in KINDS:
        raise ValueError(f"the name of a movie must end in {', '.join(f'.{one}' for one in KINDS)}, got {path.name!r}")
    if not paths:
        raise ValueError("a movie needs at least one picture")
    check_movie(kind, fps, limit)
    open_picture = needed("PIL.Image").open
    sizes = {}
    for picture in paths:
        with open_picture(picture) as image:
            sizes.setdefault(image.size, picture)
    if len(sizes) > 1:
        raise ValueError("the pictures of a movie must all have the same size, got " + ", ".join(
            f"{w} x {h} ({picture.name})" for (w, h), picture in sizes.items()))
    write, levels = {"gif": (_write_gif, GIF_WIDTHS), "mp4": (_write_mp4, MP4_QUALITIES),
                     "webp": (_write_webp, WEBP_QUALITIES)}[kind]
    part = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        for level in levels:
            write(paths, part, next(iter(sizes)), fps, level)
            megabytes = part.stat().st_size / 1e6
            if limit is None or megabytes <= limit:
                os.replace(part, path)
                return path
        raise ValueError(f"the movie has {megabytes:.3g} MB even at the lowest quality, which is above the limit of "
                         f"{limit:g} MB: draw fewer or smaller pictures")
    finally:
        part.unlink(missing_ok=True)


def _ends(count, fps, unit):
    """Durations [ms] of ``count`` pictures, in multiples of ``unit`` [ms], that do not drift from ``fps``."""
    return [int(unit * step) for step in np.diff(np.round(1000.0 / (unit * fps) * np.arange(count + 1)))]


def _write_gif(paths, path, size, fps, widest):
    image = needed("PIL.Image")
    width = min(size[0], widest)
    small = (width, max(1, round(size[1] * width / size[0])))

    def load(picture):
        with image.open(picture) as opened:
            return opened.convert("RGB").resize(small, image.Resampling.LANCZOS)

    chosen = np.unique(np.linspace(0, len(paths) - 1, min(GIF_SAMPLES, len(paths))).round().astype(int))
    strip = image.fromarray(np.concatenate([np.asarray(load(paths[i])) for i in chosen]))
    palette = strip.quantize(256, image.Quantize.MEDIANCUT)
    frames = [load(picture).quantize(palette=palette, dither=image.Dither.NONE) for picture in paths]
    frames[0].save(path, save_all=True, append_images=frames[1:], loop=0,
                   duration=_ends(len(frames), fps, 10))  # a GIF counts hundredths of a second


def _write_webp(paths, path, size, fps, quality):
    image = needed("PIL.Image")

    def load(picture):
        with image.open(picture) as opened:
            return opened.convert("RGB")

    load(paths[0]).save(path, save_all=True, append_images=map(load, paths[1:]), loop=0, quality=quality, method=4,
                        duration=_ends(len(paths), fps, 1))


def _write_mp4(paths, path, size, fps, quality):
    image = needed("PIL.Image")
    even = tuple(length + length % 2 for length in size)
    writer = needed("imageio_ffmpeg").write_frames(
        str(path), even, fps=fps, codec="libx264", pix_fmt_out="yuv420p", macro_block_size=1, quality=None,
        output_params=["-crf", str(quality), "-movflags", "+faststart"], ffmpeg_log_level="error")
    writer.send(None)
    try:
        for picture in paths:
            with image.open(picture) as opened:
                pixels = np.asarray(opened.convert("RGB"))
            pad = [(0, even[1] - size[1]), (0, even[0] - size[0]), (0, 0)]
            writer.send(np.ascontiguousarray(np.pad(pixels, pad, mode="edge")))
    finally:
        writer.close()

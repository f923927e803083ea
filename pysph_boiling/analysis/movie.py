"""Movies from series of pictures: GIF with Pillow, MP4 with the ffmpeg of the package imageio-ffmpeg."""
import math
import os
from pathlib import Path

import numpy as np

from pysph_boiling.analysis.drawing import needed

__all__ = ["check_movie", "write_movie"]

GIF_WIDTH = 480  # [pixel]; wider pictures are scaled down to keep the GIF small
GIF_SAMPLES = 8  # pictures from which the palette is made
QUALITY = 18  # constant rate factor of H.264: 0 lossless .. 51


def check_movie(kind, fps):
    """Raise the errors of :func:`write_movie` before pictures are drawn; ``kind`` is ``"gif"`` or ``"mp4"``."""
    if not (math.isfinite(fps) and fps > 0.0):
        raise ValueError(f"fps must be > 0, got {fps}")
    needed("PIL.Image")
    if kind == "mp4":
        try:
            needed("imageio_ffmpeg").get_ffmpeg_exe()
        except RuntimeError as error:
            raise OSError(f"there is no ffmpeg to write an mp4: {str(error).splitlines()[0]}; a gif does not need it"
                          ) from None


def write_movie(paths, path, fps=15):
    """Write pictures of equal size, in order, as a movie; returns its path.

    The suffix of ``path`` chooses the format. A ``.gif`` loops forever, has one palette for all pictures and is at most
    480 pixels wide. An ``.mp4`` is H.264 (yuv420p) of full size; if that is odd, the last row or column is repeated.
    The file only appears when it is complete.

    Errors: ``ValueError`` for another suffix, no pictures, pictures of different size, and fps <= 0;
    ``ModuleNotFoundError`` where a package is missing.
    """
    paths, path = [Path(p) for p in paths], Path(path)
    writers = {".gif": _write_gif, ".mp4": _write_mp4}
    if path.suffix.lower() not in writers:
        raise ValueError(f"the name of a movie must end in .gif or .mp4, got {path.name!r}")
    if not paths:
        raise ValueError("a movie needs at least one picture")
    check_movie(path.suffix.lower()[1:], fps)
    open_picture = needed("PIL.Image").open
    sizes = {}
    for picture in paths:
        with open_picture(picture) as image:
            sizes.setdefault(image.size, picture)
    if len(sizes) > 1:
        raise ValueError("the pictures of a movie must all have the same size, got " + ", ".join(
            f"{w} x {h} ({picture.name})" for (w, h), picture in sizes.items()))
    part = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        writers[path.suffix.lower()](paths, part, next(iter(sizes)), fps)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
    return path


def _write_gif(paths, path, size, fps):
    image = needed("PIL.Image")
    width = min(size[0], GIF_WIDTH)
    small = (width, max(1, round(size[1] * width / size[0])))

    def load(picture):
        with image.open(picture) as opened:
            return opened.convert("RGB").resize(small, image.Resampling.LANCZOS)

    chosen = np.unique(np.linspace(0, len(paths) - 1, min(GIF_SAMPLES, len(paths))).round().astype(int))
    strip = image.fromarray(np.concatenate([np.asarray(load(paths[i])) for i in chosen]))
    palette = strip.quantize(256, image.Quantize.MEDIANCUT)
    frames = [load(picture).quantize(palette=palette, dither=image.Dither.NONE) for picture in paths]
    ends = np.round(100.0 / fps * np.arange(len(frames) + 1))  # a GIF counts hundredths of a second
    frames[0].save(path, save_all=True, append_images=frames[1:], loop=0,
                   duration=[int(10 * step) for step in np.diff(ends)])


def _write_mp4(paths, path, size, fps):
    image = needed("PIL.Image")
    even = tuple(length + length % 2 for length in size)
    writer = needed("imageio_ffmpeg").write_frames(
        str(path), even, fps=fps, codec="libx264", pix_fmt_out="yuv420p", macro_block_size=1, quality=None,
        output_params=["-crf", str(QUALITY), "-movflags", "+faststart"], ffmpeg_log_level="error")
    writer.send(None)
    try:
        for picture in paths:
            with image.open(picture) as opened:
                pixels = np.asarray(opened.convert("RGB"))
            pad = [(0, even[1] - size[1]), (0, even[0] - size[0]), (0, 0)]
            writer.send(np.ascontiguousarray(np.pad(pixels, pad, mode="edge")))
    finally:
        writer.close()

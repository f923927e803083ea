"""Make the pictures of README.md by the package's own commands: ``make pictures``. Needs the extra ``view``.

Each scene is run and drawn in ``build/pictures``; a run that is complete is not repeated. One frame of it, without its
margins, goes to ``docs/pictures`` as a small WebP. All frames of ``MOVING`` make the moving picture ``boiling.webp``.
"""
import subprocess
import sys
from pathlib import Path

import numpy as np
from PIL import Image

from pysph_boiling.analysis.rendering import DPI, MARGINS

ROOT = Path(__file__).parents[1]
WORK, OUT = ROOT / "build" / "pictures", ROOT / "docs" / "pictures"
MOVING = "steady_boiling"
SURFACE = ["--view", "surface"]
# scene -> options of the run, options of the drawing, number of the frame
SCENES = {
    "steady_boiling": (["--demo", "--frame", "0.025"], SURFACE, 48),
    "superheat_sites": (["--flat"], [], 68),
    "cooling": (["--flat"], [], 25),
    "explosive_boiling": (["--demo"], SURFACE, 8),
    "geyser": (["--flat"], [], 75),
    "bubble_rise": (["--demo"], SURFACE, 9),
    "bubble_merge": (["--demo"], SURFACE, 11),
    "bubble_split": (["--demo"], SURFACE, 6),
    "bubble_held": ([], SURFACE, 34),
    "dam_break": ([], [], 25),
    "heated_slab": ([], ["--colour", "temperature"], 8),
}


def command(*arguments):
    subprocess.run([sys.executable, "-m", "pysph_boiling", *arguments], cwd=WORK, check=True)


def inside(path, view):
    """Box (left, upper, right, lower) of a frame without its margins."""
    picture = np.asarray(Image.open(path).convert("RGB"), dtype=int)
    height, width = picture.shape[:2]
    if view != SURFACE:
        left, right, bottom, top = (round(DPI * getattr(MARGINS, side)) for side in ("left", "right", "bottom", "top"))
        return left + 4, top + 4, width - right - 4, height - bottom - 4  # without the frame
    differs = np.abs(picture - picture[:, :1]).max(axis=2) > 24
    columns = np.flatnonzero(differs[height // 12:].any(axis=0))  # the line of text is above that
    left, right = int(columns[0]), int(columns[-1])
    edge = (right - left) // 32  # of the shadow, where the text ends
    return left + edge, 0, right - edge, height


def load(path, box, *size):
    """What is inside ``box`` of a frame, shrunk to fit into ``size`` (width, height) [pixel]."""
    part = Image.open(path).convert("RGB").crop(box)
    part.thumbnail(size, Image.Resampling.LANCZOS)
    return part


def main():
    WORK.mkdir(parents=True, exist_ok=True)
    OUT.mkdir(exist_ok=True)
    for scene, (run, view, number) in SCENES.items():
        folder = WORK / f"{scene}_output"
        if not (folder / "frames.png").exists():
            command("run", scene, *run, "--quiet", "--no-pictures")
            command("render", folder.name, *view)
        frames = sorted((folder / "frames").glob("frame_*.png"))
        box = inside(frames[number], view)
        load(frames[number], box, 320, 280).save(OUT / f"{scene}.webp", quality=85, method=6)
        if scene == MOVING:
            first, *rest = (load(frame, box, 720, 540) for frame in frames)
            first.save(OUT / "boiling.webp", save_all=True, append_images=rest, duration=50, loop=0, quality=75,
                       method=6)


if __name__ == "__main__":
    main()

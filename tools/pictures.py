"""Make the pictures of README.md by the package's own commands: ``make pictures``. Needs the extra ``view``.

``python tools/pictures.py SCENE ...`` makes those of some scenes only.

Each scene is run and drawn in ``build/pictures``; a run that is complete is not repeated. One frame of it, without the
margins of a plot, goes to ``docs/pictures`` as a small WebP. The movie of ``MOVING`` becomes ``boiling.webp``.
"""
import shutil
import subprocess
import sys
from pathlib import Path

from PIL import Image

from pysph_boiling.analysis.rendering import DPI, MARGINS
from pysph_boiling.schemes.looks import LOOKS

ROOT = Path(__file__).parents[1]
WORK, OUT = ROOT / "build" / "pictures", ROOT / "docs" / "pictures"
SURFACE = ["--view", "surface", "--size", "640x560"]
MOVING = "rolling_boil"  # 4 s in 10 s
MOVIE = ["--view", "surface", "--camera=-70,7", "--size", "640x480", "--movie", "webp", "--fps", "20", "--limit", "8"]
# scene -> options of the run, options of the drawing, number of the frame
SCENES = {
    "rolling_boil": (["--duration", "4", "--frame", "0.02"], MOVIE, 60),
    "steady_boiling": (["--demo", "--frame", "0.025"], SURFACE, 48),
    "superheat_sites": (["--flat"], [], 68),
    "cooling": (["--flat"], [], 25),
    "explosive_boiling": (["--demo"], SURFACE, 8),
    "geyser": (["--flat"], [], 75),
    "bubble_rise": (["--demo"], SURFACE, 9),
    "bubble_merge": (["--demo"], SURFACE, 11),
    "bubble_split": (["--demo"], SURFACE, 6),
    "bubble_ring": (["--demo"], SURFACE, 4),
    "pulsating_boil": (["--demo", "--frame", "0.025"], SURFACE, 48),
    "bubble_held": ([], SURFACE, 34),
    "dam_break": ([], [], 25),
    "vessel": (["--demo"], [], 28),
    "heated_slab": ([], ["--colour", "temperature"], 8),
}
SCENES |= {f"look_{look}": (["--flat", "--look", look, "--frame", "0.05"], [], 45) for look in LOOKS}


def chosen(names):
    """Those of ``names`` that the command line asks for, all if it asks for none; ends at one that is not there."""
    unknown = set(sys.argv[1:]) - set(names)
    if unknown:
        sys.exit(f"no pictures are made of {', '.join(sorted(unknown))}; there are {', '.join(names)}")
    return sys.argv[1:] or names


def command(*arguments):
    subprocess.run([sys.executable, "-m", "pysph_boiling", *arguments], cwd=WORK, check=True)


def inside(path, view):
    """Box (left, upper, right, lower) of a frame without the margins of a plot."""
    with Image.open(path) as picture:
        width, height = picture.size
    if "surface" in view:
        return 0, 0, width, height
    left, right, bottom, top = (round(DPI * getattr(MARGINS, side)) for side in ("left", "right", "bottom", "top"))
    return left + 4, top + 4, width - right - 4, height - bottom - 4  # without the frame


def load(path, box, *size):
    """What is inside ``box`` of a frame, shrunk to fit into ``size`` (width, height) [pixel]."""
    part = Image.open(path).convert("RGB").crop(box)
    part.thumbnail(size, Image.Resampling.LANCZOS)
    return part


def main():
    WORK.mkdir(parents=True, exist_ok=True)
    OUT.mkdir(exist_ok=True)
    for scene in chosen(SCENES):
        run, view, number = SCENES[scene]
        folder = WORK / f"{scene}_output"
        if not (folder / "frames.png").exists():
            name = "steady_boiling" if scene.startswith("look_") else scene
            command("run", name, *run, "--quiet", "--no-pictures", "-d", folder.name)
            command("render", folder.name, *view)
        frames = sorted((folder / "frames").glob("frame_*.png"))
        box = inside(frames[number], view)
        load(frames[number], box, 320, 280).save(OUT / f"{scene}.webp", quality=85, method=6)
        if scene == MOVING:
            shutil.copy(folder / "movie.webp", OUT / "boiling.webp")


if __name__ == "__main__":
    main()

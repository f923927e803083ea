"""Follow the tutorials: run their commands and their code, and take their pictures to ``docs/images``.

``python tools/tutorials.py NAME ...`` follows some of ``docs/tutorials`` only. Each is followed in a folder of its own,
``build/tutorials/NAME``, from the first block to the last, as a reader would do it.
"""
import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
TUTORIALS, WORK, OUT = ROOT / "docs/tutorials", ROOT / "build/tutorials", ROOT / "docs/images"
WIDTH = 1200  # [pixel] of a picture in a tutorial, at most
PICTURES = {"first_boil": "steady_boiling_output/frames.png", "own_vessel": "vessel_output/frames.png",
            "heat_in_sph": "warm_eddies.png", "boiling_curve": "sweep_steady_boiling/heat_flux.png"}  # one of each


def blocks(path):
    """The blocks of code of a tutorial that a reader uses, in their order: (language, text, file).

    ``file`` is the name in the comment that a block begins with, under which the reader saves it; ``None`` for a block
    that is run at once.
    """
    found = []
    for language, text in re.findall(r"^```(sh|python|toml)\n(.*?)^```", path.read_text(encoding="utf-8"), re.M | re.S):
        named = re.match(r"# (\S+\.\w+)\n", text)
        found.append((language, text, named[1] if named else None))
    return found


def follow(path, folder):
    """Do in ``folder`` what a tutorial says, and yield after each block; ``CalledProcessError`` if one fails."""
    folder.mkdir(parents=True, exist_ok=True)
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}", "MPLBACKEND": "Agg"}
    for language, text, file in blocks(path):
        if file:
            (folder / file).write_text(text, encoding="utf-8")
        else:
            program = {"sh": ["bash", "-e", "-c"], "python": [sys.executable, "-c"]}[language]
            subprocess.run([*program, text], cwd=folder, env=environment, check=True)
        yield


def main():
    from PIL import Image

    for name in sys.argv[1:] or sorted(path.stem for path in TUTORIALS.glob("*.md")):
        drawn, taken = WORK / name / PICTURES[name], False
        drawn.unlink(missing_ok=True)
        for _ in follow(TUTORIALS / f"{name}.md", WORK / name):
            if drawn.exists() and not taken:  # at once, since a later block may draw over it
                picture, taken = Image.open(drawn).convert("RGB"), True
                picture.thumbnail((WIDTH, WIDTH), Image.Resampling.LANCZOS)
                picture.save(OUT / f"{name}.webp", quality=80, method=6)


if __name__ == "__main__":
    main()

"""Run the scenes that boil, and draw and tabulate them for docs/boils.md: ``python tools/boils.py``.

Needs the extra ``view``. Runs are kept in ``build/boils``; one that is complete is not repeated. Each picture has a
slice and the view as water at five times. The table of costs and residuals is written between the two markers of the
page. ``python tools/boils.py NAME ...`` runs and draws some scenes only, and leaves the rows of the others.
"""
import subprocess
import sys
from pathlib import Path

import numpy as np
from pictures import chosen, load
from PIL import Image

from pysph_boiling.analysis.rendering import DPI, MARGINS, draw_scene
from pysph_boiling.analysis.surface import draw_surface
from pysph_boiling.results import load_run

ROOT = Path(__file__).parents[1]
WORK, PAGE, PICTURES = ROOT / "build" / "boils", ROOT / "docs" / "boils.md", ROOT / "docs" / "images"
BEGIN, END = "<!-- made by tools/boils.py -->\n", "<!-- end -->\n"
HEAD = ("| run | fluid particles | steps a frame | ms a step | s a frame | bubbles that departed | "
        "largest residual of energy, mass |\n|---|---|---|---|---|---|---|\n")
# name -> scene, options, times of the pictures [s]
BOILS = {
    "demo": ("steady_boiling", ["--demo"], (0.5, 1.0, 1.5, 2.0, 2.5)),
    "standard": ("steady_boiling", [], (0.6, 1.2, 2.0, 3.0, 4.0)),
    "fine": ("steady_boiling", ["--fine", "--frame", "0.05"], (0.6, 1.2, 2.0, 3.0, 4.0)),
    "rolling": ("rolling_boil", [], (0.3, 0.6, 1.2, 2.0, 3.0)),
    "explosive": ("explosive_boiling", [], (0.05, 0.15, 0.3, 0.6, 1.0)),
}
WIDTH = 300  # of a moment [pixel]


def run(name):
    scene, options, _ = BOILS[name]
    folder = WORK / name
    if not (folder / "frames.png").exists():
        WORK.mkdir(parents=True, exist_ok=True)
        subprocess.run([sys.executable, "-m", "pysph_boiling", "run", scene, *options, "-d", str(folder)], check=True)


def draw(name):
    """A sheet of slices, with the view as water below each."""
    result, drawn = load_run(WORK / name), WORK / "moment.png"
    common, columns = dict(dim=3, spacing=result.record["spacing"]), []
    for wanted in BOILS[name][2]:
        arrays = result.particles(wanted)
        part = draw_scene(arrays, drawn, t=arrays.time, **common)
        with Image.open(part) as picture:
            plain = 0, 0, picture.width - round(DPI * MARGINS.right) + 4, picture.height  # without the legend
        upper = load(part, plain, WIDTH, 10 * WIDTH)  # before the next picture takes its place
        columns.append((upper, load(draw_surface(arrays, drawn, size=(900, 800), **common), None, WIDTH, 10 * WIDTH)))
    heights = [max(pictures[row].height for pictures in columns) for row in (0, 1)]
    sheet = Image.new("RGB", (WIDTH * len(columns), sum(heights)), "white")
    for k, pictures in enumerate(columns):
        for row, picture in enumerate(pictures):
            sheet.paste(picture, (WIDTH * k, row * heights[0]))
    sheet.save(PICTURES / f"boil_{name}.webp", quality=80, method=6)


def command(name):
    """The first cell of a run in the table."""
    scene, options, _ = BOILS[name]
    return f"`{' '.join(['run', scene, *options])}`"


def row(name):
    """The row of a run in the table."""
    result = load_run(WORK / name)
    record, table = result.record, result.results
    seconds = record["timed"]["seconds"] / record["timed"]["steps"]
    frame = round(record["parameters"]["frame"]["value"] / record["dt"])
    worst = [float(np.max(np.abs(table[column]))) for column in ("energy_residual", "mass_residual")]
    return (f"| {command(name)} | {record['particles']['fluid']:,} | {frame} | "
            f"{1e3 * seconds:.0f} | {seconds * frame:.2g} | {len(record['departures'])} | {worst[0]:.0e}, "
            f"{worst[1]:.0e} |\n")


def main():
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    table, _, after = rest.partition(END)
    rows = {line.split("|")[1]: f"{line}\n" for line in table.removeprefix(HEAD).splitlines()}
    for name in chosen(BOILS):
        run(name)
        draw(name)
        rows |= {f" {command(name)} ": row(name)}
    kept = "".join(rows.get(f" {command(name)} ", "") for name in BOILS)
    PAGE.write_text(f"{before}{BEGIN}{HEAD}{kept}{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()

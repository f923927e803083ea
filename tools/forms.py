"""Boil one small vessel in our forms and in those of the paper, for docs/forms.md: ``python tools/forms.py``.

Runs are kept in ``build/forms``; one that is complete is not repeated. The tables are written between the markers of
the page, the pictures to ``docs/images``. From nothing it takes a quarter of an hour on one core.
"""
import subprocess
import sys
from pathlib import Path

import numpy as np
from matplotlib import color_sequences
from matplotlib.figure import Figure
from pictures import load
from PIL import Image

from pysph_boiling.analysis.rendering import DPI, MARGINS, draw_scene
from pysph_boiling.names import option
from pysph_boiling.results import SavedRun, load_run
from pysph_boiling.schemes.forms import FORMS

ROOT = Path(__file__).parents[1]
WORK, PAGE, PICTURES = ROOT / "build" / "forms", ROOT / "docs" / "forms.md", ROOT / "docs" / "images"
SCENE = ["superheat_sites", "--width", "14", "--fill", "12", "--sites", "4", "--duration", "3", "--frame", "0.1",
         "--convection", "--oscillation"]
SEEDS = ("2", "3")  # of further runs in our forms, which show by how much a run differs from another
RUNS = {"ours": [], **{f"ours, seed {seed}": ["--seed", seed] for seed in SEEDS},
        **{name: ["--forms", name] for name in FORMS}, "paper": ["--forms", "paper"],
        "paper, but our convection": ["--forms", ",".join(name for name in FORMS if name != "convection")]}
WHOLE = 8  # particles of the smallest bubble that counts; smaller ones are fragments
TIMES = (0.5, 1.0, 1.5, 2.0, 3.0)  # s; of the pictures
WIDTH = 260  # of a picture [pixel]


def result(name):
    """The finished run of that name."""
    folder = WORK / name.replace(", ", "_").replace(" ", "_")
    if not (folder / "run.json").exists() or not SavedRun(folder).completed:
        WORK.mkdir(parents=True, exist_ok=True)
        subprocess.run([sys.executable, "-m", "pysph_boiling", "run", *SCENE, *RUNS[name], "--no-pictures", "-d",
                        str(folder)], check=True)
    return load_run(folder)


def vaporised(table):
    """Net number of particles that have become vapour, (rows,)."""
    return table["n_nucleated"] + table["n_burst"] - table["n_condensed"]


def settings(form):
    """The options of a form, as on the command line."""
    return ", ".join([f"`{option(f'{form.slot}.{name}')} {'no' if value is False else value}`"
                      for name, value in form.changes.items()] + [f"`{option(f'no_{slot}')}`" for slot in form.without])


def table_of_forms():
    rows = "".join(f"| `{name}` | {form.source} | {form.paper} | {form.ours} | {settings(form)} |\n"
                   for name, form in FORMS.items())
    return f"| form | where | the paper | ours, and why | options |\n|---|---|---|---|---|\n{rows}"


def table_of_runs(results):
    rows = ""
    for name, run in results.items():
        table = run.results
        whole = [n for _, n in run.record["vents"] if n >= WHOLE]
        leak, heat = table["energy_model_leak"][-1], table["energy_heater"][-1]
        sizes = f"{min(whole)} to {max(whole)}" if whole else "none"
        rows += (f"| {name} | {vaporised(table)[-1] / table['t'][-1]:.0f} | {len(whole)} | {sizes} | "
                 f"{table['n_interrupted'][-1]:.0f} | {table['T_max'].max():.0f} | {table['T_mean'][-1]:.1f} | "
                 f"{np.abs(table['energy_residual']).max():.0e} | {100.0 * leak / heat + 0.0:.1f} |\n")
    return ("| forms | net vaporised [1/s] | bubbles | their sizes | interruptions | T_max [K] | T_mean at the end "
            "[K] | largest residual of energy | leak [% of the heater's energy] |\n"
            f"|---|---|---|---|---|---|---|---|---|\n{rows}")


def plot(results):
    """Vapour made and highest temperature over time; our forms in black, the paper's all at once in red."""
    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    styles = {"ours": dict(color="black", lw=2.0), "paper": dict(color="red", lw=2.0),
              "paper, but our convection": dict(color="red", lw=1.0, ls="--"),
              **{name: dict(color=colour, lw=1.0) for name, colour in zip(FORMS, color_sequences["Paired"])}}
    for ax, values, label in zip(figure.subplots(1, 2), (vaporised, lambda table: table["T_max"]),
                                 ("net particles vaporised", "highest temperature [K]")):
        for name, run in results.items():
            style = styles.get(name, dict(color="0.6", lw=1.0))  # further seeds are grey
            ax.plot(run.results["t"], values(run.results), label=name, **style)
        ax.set(xlabel="time [s]", ylabel=label)
    figure.legend(*ax.get_legend_handles_labels(), loc="outside right center", fontsize=8, frameon=False)
    figure.savefig(PICTURES / "forms_history.png", dpi=110)


def draw(results):
    """Slices at five times: our forms above, the paper's below."""
    parts, drawn = [], WORK / "moment.png"
    for name in ("ours", "paper"):
        run, row = results[name], []
        for wanted in TIMES:
            arrays = run.particles(wanted)
            part = draw_scene(arrays, drawn, t=arrays.time, dim=3, spacing=run.record["spacing"])
            with Image.open(part) as picture:
                plain = 0, 0, picture.width - round(DPI * MARGINS.right) + 4, picture.height  # without the legend
            row.append(load(part, plain, WIDTH, 10 * WIDTH))
        parts.append(row)
    height = max(picture.height for row in parts for picture in row)
    sheet = Image.new("RGB", (WIDTH * len(TIMES), 2 * height), "white")
    for k, row in enumerate(parts):
        for j, picture in enumerate(row):
            sheet.paste(picture, (WIDTH * j, k * height))
    sheet.save(PICTURES / "forms_moments.webp", quality=80, method=6)


def filled(page, tables):
    """The page with each table between its two markers: ``tables`` is marker -> text."""
    for marker, text in tables.items():
        begin, end = f"<!-- {marker}: made by tools/forms.py -->\n", f"<!-- end of {marker} -->\n"
        before, _, rest = page.partition(begin)
        page = f"{before}{begin}{text}{end}{rest.partition(end)[2]}"
    return page


def main():
    results = {name: result(name) for name in RUNS}
    plot(results)
    draw(results)
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8"), {
        "forms": table_of_forms(), "runs": table_of_runs(results)}), encoding="utf-8")


if __name__ == "__main__":
    main()

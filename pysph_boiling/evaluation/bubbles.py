"""The command ``pysph-boiling bubbles``: how runs boil, from their folders."""
from dataclasses import dataclass, fields
from functools import partial

import numpy as np

from pysph_boiling.analysis.departures import ENOUGH, Departed, departed
from pysph_boiling.analysis.shapes import PIECE, free_bubbles
from pysph_boiling.files import load_output
from pysph_boiling.names import Parser
from pysph_boiling.results import diameter, load_run
from pysph_boiling.schemes.effects import PresetNucleation

__all__ = ["Boil", "boil", "bubbles"]


@dataclass(frozen=True)
class Boil:
    """How a run boils: its :class:`~.departures.Departed` bubbles, and the :class:`~.shapes.Free` ones of its outputs.

    ``spacing`` is in m, and ``sites`` is the number of sites. ``vaporised`` [1/s] is the number of particles vaporised
    minus those condensed, per second since the first departure, or since the start if there was none.
    """

    dim: int
    spacing: float
    sites: int
    departed: Departed
    free: tuple
    vaporised: float


def boil(folder, *, track=iter):
    """The :class:`Boil` of a run of a scene with preset sites, from the files in its ``folder``.

    ``track`` wraps the list of particle files, to show progress.

    Errors: ``FileNotFoundError`` for a folder without a run, ``ValueError`` for a run without preset sites.
    """
    run = load_run(folder, unfinished=True)
    record = run.record
    recorded = record["effects"].get("preset_nucleation")
    if recorded is None:
        raise ValueError(f"the run in {folder} has no preset sites, so no bubble departs from one")
    nucleation = PresetNucleation(**{spec.name: recorded[spec.name]["value"] for spec in fields(PresetNucleation)
                                     if spec.name in recorded})
    table, dim, spacing = run.results, run.dim, run.spacing
    end = float(table["t"][-1])
    found = departed(record["departures"], end)
    begin = found.begin if len(found.sizes) else float(table["t"][0])
    made = np.diff(np.interp([begin, end], table["t"], table["n_nucleated"] - table.get("n_condensed", 0.0)))[0]
    free = []
    for file in track(run.files):
        arrays, _ = load_output(file)
        walls = [pa for name, pa in arrays.items() if "wall" in name]
        base = max(float(np.max(pa.get("xyz"[dim - 1]))) for name, pa in arrays.items() if "site" in name)
        free += free_bubbles(arrays["fluid"], walls, dim=dim, spacing=spacing, floor=base + nucleation.reach * spacing)
    return Boil(dim, spacing, int(record["particles"]["sites"]), found, tuple(free),
                float(made) / (end - begin) if end > begin else 0.0)


def rows(found):
    """What a :class:`Boil` is, in words: list of (quantity, value)."""
    left, free = found.departed, found.free
    made = [("particles vaporised per second", f"{found.vaporised:.1f}"),
            ("bubbles that departed", f"{len(left.sizes)}, from {len(left.sites)} of {found.sites} sites")]
    if len(left.sizes):
        sizes = np.quantile(left.sizes, (0.0, 0.25, 0.5, 0.75, 1.0))
        made += [("departures per second", f"{left.rate:.2f}, from {left.begin:.2f} to {left.end:.2f} s"),
                 ("longest time without one", f"{left.gap:.3f} s, from {left.gap_at:.2f} s on"),
                 ("particles at departure", ", ".join(f"{n:.0f}" for n in sizes) + " (least, quartiles, most)"),
                 ("diameter at departure", ", ".join(f"{d:.1f}" for d in diameter(sizes, found.dim)) + " spacings")]
    if len(left.scatters):
        made.append((f"scatter of the period of {len(left.scatters)} sites",
                     f"{left.scatters.min():.0%} to {left.scatters.max():.0%}, median {np.median(left.scatters):.0%}"))
    made.append((f"free bubbles of {PIECE[found.dim]} particles and more, in all outputs", f"{len(free)}"))
    if free:
        aspect = np.array([one.shape.aspect for one in free])
        whole, void = np.array([one.whole for one in free]), np.array([one.void for one in free]) / found.spacing
        made += [("their width over height", f"mean {aspect.mean():.2f}, quartiles "
                  + ", ".join(f"{a:.2f}" for a in np.quantile(aspect, (0.25, 0.5, 0.75)))),
                 ("their share in one piece", f"mean {whole.mean():.1%}, least {whole.min():.0%}"),
                 ("thickest void in or round them", f"median {np.median(void):.2f}, most {void.max():.2f} spacings; "
                  f"above one spacing for {np.mean(void > 1.0):.0%}")]
    return made


def bubbles(arguments):
    """Print when and from which sites bubbles departed in finished runs, how large they were, and how they look."""
    from rich.console import Console
    from rich.progress import track
    from rich.table import Table

    parser = Parser(prog="pysph-boiling bubbles", description=bubbles.__doc__)
    parser.add_argument("directories", nargs="+", metavar="DIR", help="output folder of a run")
    console = Console(highlight=False)
    for folder in parser.parse_args(arguments).directories:
        found = boil(folder, track=partial(track, description="reading", console=console, transient=True))
        table = Table(title=str(folder), show_header=False, title_justify="left")
        for row in rows(found):
            table.add_row(*row)
        console.print(table)
        table = Table("site", "bubbles", "mean period [s]", "scatter", title_justify="left",
                      caption=f"period and scatter are given for {ENOUGH} bubbles and more", caption_justify="left")
        for site in found.departed.sites:
            told = np.isfinite(site.scatter)
            table.add_row(str(site.number), str(site.left), f"{site.period:.3f}" if told else "",
                          f"{site.scatter:.0%}" if told else "")
        if found.departed.sites:
            console.print(table)

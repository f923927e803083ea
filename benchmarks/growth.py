"""Growth of one bubble in superheated liquid, against the similarity solution R = 2 b sqrt(alpha t).

A disc or a sphere of vapour grows in superheated liquid of equal density, on particles that do not move. It starts with
the exact temperature profile at a radius of a few spacings, and grows until its radius is ``growth`` times as large.
Its volume is then compared with the exact one, with and without pooled latent heat, for several distances at which
vapour acts as a site, and for held and converted heat. At the end liquid takes its place.

    python benchmarks/growth.py [--quick] [--json FILE] [--report FILE.md]

The exit status is 1 if a claim of the documentation does not hold.
"""
import argparse
import itertools
import sys
from dataclasses import asdict, replace

from rich.console import Console
from rich.markup import escape

from pysph_boiling.evaluation.problems.growth import Growth
from pysph_boiling.report import markdown
from pysph_boiling.report.options import add_report_options
from pysph_boiling.report.terminal import show
from pysph_boiling.runs.ledger import write_json


def measured(case):
    """The results of a run, as one row of the table."""
    outcome = case.run()
    return dict(asdict(case), **outcome.errors, **outcome.facts, particles=outcome.particles, steps=outcome.steps,
                seconds=outcome.seconds)


BASE = Growth()
SPHERE = replace(BASE, dim=3, growth=2.0)


def quick_cases():
    """Two resolutions in 2-D, pooled and not; held and converted heat."""
    for radius, pooled in itertools.product((2.0, 4.0), (True, False)):
        yield replace(BASE, radius=radius, pooled=pooled)
    for pooled in (True, False):
        yield replace(BASE, radius=2.0, pooled=pooled, interrupt="convert")


def all_cases():
    """The grid of parameters from which the defaults were chosen."""
    yield from quick_cases()
    yield replace(BASE, radius=2.0, vapour_as_site=False)
    for pooled, reach, jitter, radius in itertools.product((True, False), (1.0, 1.2, 1.4, 1.5), (0.0, 0.2), (2.0, 4.0)):
        yield replace(BASE, pooled=pooled, kinetic_radius=reach, jitter=jitter, radius=radius)
    for pooled, reach, radius in itertools.product((True, False), (1.4, 1.5), (2.0, 4.0)):
        yield replace(SPHERE, pooled=pooled, kinetic_radius=reach, radius=radius)
    for reach, radius in itertools.product((1.2, 1.4, 1.5), (2.0, 4.0)):
        yield replace(SPHERE, kinetic_radius=reach, radius=radius, jitter=0.2)
    for pooled in (True, False):
        yield replace(BASE, radius=2.0, stefan=0.1, pooled=pooled)
    for pooled in (True, False):
        yield replace(BASE, radius=8.0, pooled=pooled)


COLUMNS = (  # heading, what a row shows
    ("dim", lambda row: f"{row['dim']}"),
    ("St", lambda row: f"{row['stefan']:g}"),
    ("R [dx]", lambda row: f"{row['radius']:g} to {row['radius'] * row['growth']:g}"),
    ("jitter", lambda row: f"{row['jitter']:g}"),
    ("pooled", lambda row: "yes" if row["pooled"] else "no"),
    ("interrupted", lambda row: row["interrupt"]),
    ("reach [dx]", lambda row: f"{row['kinetic_radius']:g}" if row["vapour_as_site"] else "off"),
    ("vapour", lambda row: f"{row['error']:+.1%}"),
    ("ahead [dx]", lambda row: f"{row['ahead']:+.2f}"),
    ("with stored", lambda row: f"{row['latent_error']:+.1%}"),
    ("out of round", lambda row: f"{row['roundness']:.1%}"),
    ("T_max", lambda row: f"{max(row['hottest'], row['departure'], 0.0):.2f}"),
    ("held", lambda row: f"{row['hidden']:.1%}" if row["interrupt"] == "hold" else ""),
)
LEGEND = (
    "vapour: error of its volume; ahead: of its radius; with stored: error of the volume with stored latent heat "
    "counted; out of round: standard deviation of the radius of the outermost vapour; T_max: how far anything gets "
    "hotter than the liquid far away, over its superheat, also after the bubble has departed; held: stored heat that "
    "no temperature shows after the departure, over the latent heat of the exact volume; reach 1: on a lattice, the "
    "last digit decides who is within reach")


def claims(rows):
    """(claim, whether it holds) for every claim that the rows can decide."""
    def find(**wanted):
        return [row for row in rows if all(row[name] == value for name, value in wanted.items())]

    grown = [row for row in rows if row["vapour_as_site"] and row["kinetic_radius"] > 1.0]
    yield "energy is conserved to round-off", all(row["energy"] < 1e-12 for row in rows)
    yield "nothing gets hotter than the liquid far away", all(row["hottest"] < 1e-9 for row in rows)
    yield "pooled bubbles stay round", all(row["roundness"] < 0.1 for row in grown if row["pooled"])
    yield "others grow dendrites", all(row["roundness"] > 0.2 for row in grown if not row["pooled"])
    for dim, jitter, reach in itertools.product((2, 3), (0.0, 0.2), (1.2, 1.4, 1.5)):
        same = dict(dim=dim, jitter=jitter, kinetic_radius=reach, stefan=0.3, interrupt="hold", vapour_as_site=True)
        where = f"{dim}-D, jitter {jitter:g}, reach {reach:g}"
        for pooled in (True, False):
            finer = sorted(find(**same, pooled=pooled), key=lambda row: row["radius"])
            if pooled and finer:
                yield f"{where}: the radius of pooled bubbles is within 0.3 spacings", all(
                    abs(row["lattice_ahead"]) < 0.3 for row in finer)
            for a, b in itertools.pairwise(row["latent_error"] for row in finer):
                if not pooled:
                    yield f"{where}: growth without pooling diverges", b > 1.5 * a > 0.0
    for row in find(vapour_as_site=False):
        yield "without vapour as a site nothing grows", row["vaporised"] == 0
    for row in grown:
        if row["interrupt"] == "hold":
            yield "held heat makes nothing hotter", row["departure"] < 1e-9
        elif not row["pooled"]:
            yield "converted heat makes liquid hotter than the liquid far away", row["departure"] > 0.1


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    add_report_options(parser, quick="six runs instead of the whole grid", report="write the table to this file",
                       json="write the rows to this file")
    options = parser.parse_args(argv)

    cases, rows, console = list(dict.fromkeys(quick_cases() if options.quick else all_cases())), [], Console(width=160)
    for number, case in enumerate(cases, 1):
        rows.append(measured(case))
        console.print(f"{number}/{len(cases)} {rows[-1]['seconds']:.0f} s", highlight=False)
    rows.sort(key=lambda row: (row["dim"], -row["stefan"], not row["vapour_as_site"], row["kinetic_radius"],
                               row["interrupt"] != "hold", not row["pooled"], row["jitter"], row["radius"]))
    headings, shown = [heading for heading, _ in COLUMNS], [[cell(row) for _, cell in COLUMNS] for row in rows]
    show(console, map(escape, headings), shown, title="Growth of a bubble in superheated liquid")
    console.print(LEGEND)
    if options.json:
        write_json(options.json, rows)
    if options.report:
        markdown.write(options.report, markdown.table(headings, shown), LEGEND + ".")
    broken = [claim for claim, holds in claims(rows) if not holds]
    for claim in broken:
        console.print(f"[red]does not hold: {claim}")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())

"""Threads and MPI ranks: time of a step, data exchanged between ranks, and an estimate for up to 1e8 particles.

    python benchmarks/scaling.py [--quick] [--json FILE]

The dam break (3-D) runs on one core, with threads on all cores, and with one MPI rank per core, in turn and several
times; times are medians. It needs ``make setup-mpi``. The estimate takes the bytes per ghost from the runs, and
everything else from geometry.

The exit status is 1 unless ranks and threads have the same number of particles, and ranks take at most 0.8 of the time
of one core.
"""
import argparse
import json
import os
import sys
import tempfile
from pathlib import Path

import machine
import numpy as np
from rich.console import Console

from pysph_boiling.report.options import add_report_options
from pysph_boiling.report.terminal import show
from pysph_boiling.runs.jobs import Job, run_job
from pysph_boiling.runs.ledger import write_json
from pysph_boiling.threads import variables

FASTER = 0.8
LAYER = 2.4  # spacings: particles nearer than the support to those of another rank are its ghosts
SIZES = ((1e6, 10), (1e7, 100), (1e8, 1000))  # particles, ranks
VAPOUR, BUBBLE = 0.1, 20  # share of the particles, particles in a bubble: a vessel in full boil
SUMS = 30  # collectives of one number a bubble, in a step: three per label, condensation, pooling, oscillation, results
SILENT = ("--no-pictures", "--pfreq", "100000")  # a step, not its output
PROPERTIES = 75  # of a particle, with every effect; 8 bytes each


def run(ranks, threads, steps, spacing):
    """One run in a process of its own: its ``run.json``."""
    with tempfile.TemporaryDirectory() as folder:
        root = ["--allow-run-as-root"] if os.geteuid() == 0 else []
        launcher = ["mpirun", *root, "--oversubscribe", "-n", str(ranks)] if ranks > 1 else []
        openmp = "--openmp" if threads > 1 else "--no-openmp"
        run_job(Job(name=f"{ranks} ranks", environment=variables(threads), command=(
            *launcher, sys.executable, "-m", "pysph_boiling", "run", "dam_break", "--dim", "3", "--spacing",
            str(spacing), "--max-steps", str(steps), "--density.settle", "0", *SILENT, openmp, "-d", folder),
            log=Path(folder) / "log.txt")).result()
        return json.loads((Path(folder) / "run.json").read_text())


def model(ghost, refreshed):
    """What a step costs at the sizes of ``SIZES``; ``ghost`` and ``refreshed`` are bytes per ghost and step."""
    rows = []
    for particles, ranks in SIZES:
        side = (particles / ranks) ** (1.0 / 3.0)
        ghosts = (side + 2.0 * LAYER) ** 3 - side**3
        bubbles = particles * VAPOUR / BUBBLE
        pairs = 6.0 * side**2 * VAPOUR / BUBBLE ** (2.0 / 3.0)  # bubbles that lie across the faces of a rank
        rows.append(dict(
            particles=particles, ranks=ranks, own=particles / ranks, ghosts=ghosts,
            exchange=ghosts * (ghost + refreshed),
            labels=8.0 * pairs * ranks, sums=8.0 * bubbles * SUMS, start=8.0 * PROPERTIES * particles))
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    add_report_options(parser, quick="fewer particles and steps", report=None)
    options = parser.parse_args()
    console, cores = Console(width=140), max(2, os.cpu_count() or 2)
    console.print(machine.load())
    steps, spacing, rounds = (10, 0.04, 1) if options.quick else (60, 0.02, 5)
    layouts = [(1, 1), (1, cores), (cores, 1)]
    found = {layout: [] for layout in layouts}
    for ranks, threads in layouts:
        run(ranks, threads, 1, spacing)  # compiles
    for _ in range(rounds):
        for layout in layouts:
            found[layout].append(run(*layout, steps, spacing))
    time = {layout: float(np.median([row["timed"]["seconds"] / row["timed"]["steps"] for row in rows]))
            for layout, rows in found.items()}
    last = {layout: rows[-1] for layout, rows in found.items()}
    show(console, ("ranks", "threads", "ms a step", "of one core's"),
         [(str(ranks), str(threads), f"{1e3 * seconds:.1f}", f"{seconds / time[1, 1]:.2f}")
          for (ranks, threads), seconds in time.items()], title=f"dam break, {last[1, 1]['particles']}")
    talk = last[cores, 1]["communication"]
    ghost, refreshed = talk["copied"] / talk["exported"], talk["refreshed"] / talk["exported"]
    searches = last[cores, 1]["timed"]["steps"]
    console.print(f"{cores} ranks: {talk['exported'] / searches:.0f} ghosts, {talk['copied'] / searches / 1e6:.2f} MB "
                  f"to make and {talk['refreshed'] / searches / 1e6:.2f} MB to refresh them in a step: {ghost:.0f} and "
                  f"{refreshed:.0f} bytes a ghost")
    rows = model(8.0 * PROPERTIES, refreshed)
    show(console, ("particles", "ranks", "own", "ghosts", "ghosts, MB a step and rank", "labels, MB gathered by each",
                   "sums over bubbles, MB through each", "start, GB on each"),
         [(f"{row['particles']:.0e}", f"{row['ranks']}", f"{row['own']:.0f}", f"{row['ghosts']:.0f}",
           f"{row['exchange'] / 1e6:.0f}", f"{row['labels'] / 1e6:.2f}", f"{row['sums'] / 1e6:.0f}",
           f"{row['start'] / 1e9:.1f}") for row in rows], title="on paper, 3-D, every effect")
    same = last[1, 1]["particles"] == last[cores, 1]["particles"]
    ratio = time[cores, 1] / time[1, 1]
    holds = same and ratio <= FASTER
    console.print(f"{'holds' if holds else 'FAILS'}: {cores} ranks take {ratio:.2f} of the time of one core (at most "
                  f"{FASTER}); particles {'are the same' if same else 'got lost'}")
    if options.json:
        write_json(options.json, dict(
            seconds={f"{ranks}x{threads}": seconds for (ranks, threads), seconds in time.items()},
            ghost_bytes=ghost, refreshed_bytes=refreshed, model=rows, ratio=ratio))
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())

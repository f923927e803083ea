"""Threads and MPI ranks: time of a step, data exchanged, memory of a rank, and an estimate for up to 1e9 particles.

    python benchmarks/scaling.py [--quick] [--memory | --ghosts] [--json FILE]

The dam break (3-D) runs on one core, with threads on all cores, and with one MPI rank per core, in turn and several
times; times are medians. For weak scaling, one core has its share of the particles alone. ``--memory`` instead starts
and resumes a vessel of a million particles on 1, 2 and 4 ranks, and prints the largest memory of a rank. ``--ghosts``
instead prints what each of 2 and 4 ranks sends in a step of the dam break, beside the surface of its box of water. It
needs ``make setup-mpi``.

The estimate is on paper. A step takes a fixed time + (work of a particle) x (particles of a rank) + (cost of a ghost) x
ghosts + (collective operations) x (latency of one) x log2(ranks). The first three are fitted to the runs, the number of
operations is counted in them, the latency is measured between the ranks of this machine, and ghosts follow from
geometry. A network has another latency: the table shows what 5 us would make of it. The cost of a ghost is an upper
bound, since it contains what an exchange costs for any number of ghosts.

The exit status is 1 unless ranks and threads have the same number of particles, and ranks take at most 0.8 of the time
of one core.
"""
import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import machine
import numpy as np
from rich.console import Console

from pysph_boiling.files import last_output, part_of, read_output
from pysph_boiling.report.options import add_report_options
from pysph_boiling.report.terminal import show
from pysph_boiling.runs.jobs import Job, run_job
from pysph_boiling.runs.ledger import write_json
from pysph_boiling.threads import variables

FASTER = 0.8
LAYER = 2.4  # spacings: particles nearer than the support to those of another rank are its ghosts
SIZES = ((1e6, 10), (1e7, 100), (1e8, 1000), (1e9, 1000))  # particles, ranks
NETWORK = 5e-6  # s, latency of a collective operation between two nodes, as networks of clusters have it
A_MILLION = ("--width", "100", "--fill", "100", "--sites", "9", "--frame", "10")  # of steady_boiling
VAPOUR, BUBBLE = 0.1, 20  # share of the particles, particles in a bubble: a vessel in full boil
SUMS = 30  # collectives of one number a bubble, in a step: three per label, condensation, pooling, oscillation, results
SILENT = ("--no-pictures", "--pfreq", "100000")  # a step, not its output
PROPERTIES = 75  # of a particle, with every effect; 8 bytes each


def run(ranks, threads, *options, scene="dam_break", folder=None):
    """One run in a process of its own: its ``run.json``. Its files stay in ``folder`` if that is given."""
    with tempfile.TemporaryDirectory() as temporary:
        folder, openmp = folder or temporary, "--openmp" if threads > 1 else "--no-openmp"
        run_job(Job(name=f"{ranks} ranks", environment=variables(threads), command=(
            *launcher(ranks), sys.executable, "-m", "pysph_boiling", "run", scene, *options, *SILENT, openmp, "-d",
            folder), log=Path(folder) / "log.txt")).result()
        return json.loads((Path(folder) / "run.json").read_text())


def launcher(ranks):
    """The command that starts a program on so many ranks; empty for one."""
    root = ["--allow-run-as-root"] if os.geteuid() == 0 else []
    return ["mpirun", *root, "--oversubscribe", "-n", str(ranks)] if ranks > 1 else []


def dam_break(steps, spacing):
    """Options of the dam break."""
    return ("--dim", "3", "--spacing", str(spacing), "--max-steps", str(steps), "--density.settle", "0")


def seconds_a_step(row):
    """Wall time of a step of a run [s]."""
    return row["timed"]["seconds"] / row["timed"]["steps"]


def latency(ranks, repeats=2000):
    """Time of a sum of one number over the ranks of this machine [s]."""
    code = ("from mpi4py import MPI; from time import perf_counter; c = MPI.COMM_WORLD; c.allreduce(1.0); "
            f"t = perf_counter(); [c.allreduce(1.0) for _ in range({repeats})]; "
            f"print((perf_counter() - t) / {repeats}) if c.rank == 0 else None")
    done = subprocess.run([*launcher(ranks), sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return float(done.stdout)


def ghosts_of(own):
    """Ghosts of a rank that owns a cube of so many particles."""
    side = own ** (1.0 / 3.0)
    return (side + 2.0 * LAYER) ** 3 - side**3


def model(refreshed, fixed, work, ghost, collectives, wait):
    """What a step costs at the sizes of ``SIZES``.

    ``refreshed`` [B] is sent for a ghost in a step besides its copy. ``fixed`` [s] is the time of a step without
    particles, ``work`` [s] that of a particle and ``ghost`` [s] that of a ghost, ``collectives`` [-] the operations in
    a step, each of which takes ``wait`` [s] between two ranks.
    """
    rows = []
    for particles, ranks in SIZES:
        own = particles / ranks
        side, ghosts = own ** (1.0 / 3.0), ghosts_of(own)
        bubbles = particles * VAPOUR / BUBBLE
        pairs = 6.0 * side**2 * VAPOUR / BUBBLE ** (2.0 / 3.0)  # bubbles that lie across the faces of a rank
        depth = math.log2(ranks)
        parts = dict(work=fixed + work * own, ghosts=ghost * ghosts, waiting=collectives * wait * depth,
                     network=collectives * NETWORK * depth)
        rows.append(dict(
            particles=particles, ranks=ranks, own=own, ghosts=ghosts,
            exchange=ghosts * (8.0 * PROPERTIES + refreshed), labels=8.0 * pairs * ranks,
            sums=8.0 * bubbles * SUMS, start=8.0 * PROPERTIES * own, seconds=parts,
            efficiency=parts["work"] / (parts["work"] + parts["ghosts"] + parts["network"])))
    return rows


def memory(console, quick):
    """Print and return the largest memory of a rank [B], as (started, resumed), on 1, 2 and 4 ranks."""
    options = ("--width", "60", "--fill", "60", *A_MILLION[4:]) if quick else A_MILLION
    peaks, particles = {}, {}
    for ranks in (1, 2, 4):
        with tempfile.TemporaryDirectory() as folder:
            rows = [run(ranks, 1, *options, "--density.settle", "0", *more, scene="steady_boiling", folder=folder)
                    for more in (("--max-steps", "1"), ("--max-steps", "2", "--resume"))]
        peaks[ranks], particles = [max(row["peak_memory"]["value"]) for row in rows], rows[0]["particles"]
    show(console, ("ranks", "memory at the start [GB]", "of one rank's", "when resumed [GB]", "of one rank's"),
         [(str(ranks), *(text for peak, one in zip(found, peaks[1])
                         for text in (f"{peak / 1e9:.2f}", f"{peak / one:.2f}"))) for ranks, found in peaks.items()],
         title=f"steady_boiling, {particles}")
    return peaks


def ghosts(console, quick):
    """Print and return what each rank sends in a step: a list of dicts.

    ``layer`` [particles] is a layer of water as thick as the support on all faces of the box around a rank's water.
    """
    steps, spacing = (10, 0.04) if quick else (30, 0.02)
    rows = []
    for ranks in (2, 4):
        with tempfile.TemporaryDirectory() as folder:
            found = run(ranks, 1, *dam_break(steps, spacing), folder=folder)
            talk, last = found["communication"], Path(last_output(folder))
            for rank in range(ranks):
                fluid = read_output(part_of(last, rank))[0]["fluid"]
                sides = np.ptp([fluid.x, fluid.y, fluid.z], axis=1) / spacing + 1.0
                a_step = {name: sent[rank] / steps for name, sent in (
                    *talk["exported"].items(), ("copied", talk["copied"]), ("refreshed", talk["refreshed"]))}
                layer = LAYER * (np.sum(sides)**2 - np.sum(sides**2))
                rows.append(dict(ranks=ranks, rank=rank, own=len(fluid.x), sides=sides.tolist(), layer=layer, **a_step))
    show(console, ("ranks", "rank", "water", "its box", "a layer on its faces", "ghosts of water", "of the layer",
                   "ghosts of walls", "copied, kB", "refreshed, kB"),
         [(f"{row['ranks']}", f"{row['rank']}", f"{row['own']}", " x ".join(f"{side:.0f}" for side in row["sides"]),
           f"{row['layer']:.0f}", f"{row['fluid']:.0f}", f"{row['fluid'] / row['layer']:.2f}", f"{row['wall']:.0f}",
           f"{row['copied'] / 1e3:.0f}", f"{row['refreshed'] / 1e3:.0f}") for row in rows],
         title="sent by each rank in a step")
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    add_report_options(parser, quick="fewer particles and steps", report=None)
    other = parser.add_mutually_exclusive_group()
    other.add_argument("--memory", action="store_true", help="measure the memory of a rank instead")
    other.add_argument("--ghosts", action="store_true", help="count what each rank sends instead")
    options = parser.parse_args()
    console, cores = Console(width=140), max(2, os.cpu_count() or 2)
    console.print(machine.load())
    if options.memory:
        peaks = memory(console, options.quick)
        if options.json:
            write_json(options.json, {"peak_memory": peaks})
        return 0 if all(four < two < one for one, two, four in zip(*(peaks[ranks] for ranks in (1, 2, 4)))) else 1
    if options.ghosts:
        rows = ghosts(console, options.quick)
        if options.json:
            write_json(options.json, {"ghosts": rows})
        return 0 if all(row["fluid"] <= row["layer"] for row in rows) else 1
    steps, spacing, rounds = (10, 0.04, 1) if options.quick else (60, 0.02, 5)
    layouts = [(1, 1), (1, cores), (cores, 1)]
    found, shares = {layout: [] for layout in layouts}, []
    for ranks, threads in layouts:
        run(ranks, threads, *dam_break(1, spacing))  # compiles
    for _ in range(rounds):
        for layout in layouts:
            found[layout].append(run(*layout, *dam_break(steps, spacing)))
        shares.append(run(1, 1, *dam_break(steps, spacing * cores ** (1.0 / 3.0))))
    time = {layout: float(np.median(list(map(seconds_a_step, rows)))) for layout, rows in found.items()}
    alone = float(np.median(list(map(seconds_a_step, shares))))
    last = {layout: rows[-1] for layout, rows in found.items()}
    show(console, ("ranks", "threads", "ms a step", "of one core's"),
         [(str(ranks), str(threads), f"{1e3 * seconds:.1f}", f"{seconds / time[1, 1]:.2f}")
          for (ranks, threads), seconds in time.items()], title=f"dam break, {last[1, 1]['particles']}")
    talk = dict(last[cores, 1]["communication"])
    talk.update(exported=sum(map(sum, talk["exported"].values())), copied=sum(talk["copied"]),
                refreshed=sum(talk["refreshed"]))
    ghost, refreshed = talk["copied"] / talk["exported"], talk["refreshed"] / talk["exported"]
    searches = last[cores, 1]["timed"]["steps"]
    console.print(f"{cores} ranks: {talk['exported'] / searches:.0f} ghosts, {talk['copied'] / searches / 1e6:.2f} MB "
                  f"to make and {talk['refreshed'] / searches / 1e6:.2f} MB to refresh them in a step: {ghost:.0f} and "
                  f"{refreshed:.0f} bytes a ghost")
    one, many = (last[layout]["particles"]["fluid"] for layout in ((1, 1), (cores, 1)))
    few = shares[-1]["particles"]["fluid"]
    console.print(f"weak scaling: one core takes {1e3 * alone:.1f} ms for its share of {few} particles alone, "
                  f"{cores} ranks take {1e3 * time[cores, 1]:.1f} ms for {many}: efficiency "
                  f"{alone * many / cores / few / time[cores, 1]:.2f}")
    wait, work = latency(cores), (time[1, 1] - alone) / (one - few)
    fixed, operations = time[1, 1] - work * one, talk["collectives"] / searches
    spent = time[cores, 1] - fixed - work * many / cores - operations * wait
    ghost_time = max(spent, 0.0) / (talk["exported"] / searches / cores)
    console.print(f"fitted: {1e3 * fixed:.1f} ms, {1e6 * work:.2f} us a particle, {1e6 * ghost_time:.2f} us a ghost; "
                  f"{operations:.0f} collective operations a step, {1e6 * wait:.1f} us each between {cores} ranks of "
                  "this machine")
    rows = model(refreshed, fixed, work, ghost_time, operations, wait)
    show(console, ("particles", "ranks", "own", "ghosts", "ghosts, MB a step and rank", "labels, MB gathered by each",
                   "sums over bubbles, MB through each", "start, GB on each", "work, ms", "ghosts, ms", "waiting, ms",
                   "at 5 us, ms", "efficiency"),
         [(f"{row['particles']:.0e}", f"{row['ranks']}", f"{row['own']:.0f}", f"{row['ghosts']:.0f}",
           f"{row['exchange'] / 1e6:.0f}", f"{row['labels'] / 1e6:.2f}", f"{row['sums'] / 1e6:.0f}",
           f"{row['start'] / 1e9:.1f}", *(f"{1e3 * row['seconds'][name]:.1f}" for name in (
               "work", "ghosts", "waiting", "network")), f"{row['efficiency']:.2f}") for row in rows],
         title="on paper, 3-D: bytes with every effect, times as in the dam break")
    same = last[1, 1]["particles"] == last[cores, 1]["particles"]
    ratio = time[cores, 1] / time[1, 1]
    holds = same and ratio <= FASTER
    console.print(f"{'holds' if holds else 'FAILS'}: {cores} ranks take {ratio:.2f} of the time of one core (at most "
                  f"{FASTER}); particles {'are the same' if same else 'got lost'}")
    if options.json:
        write_json(options.json, dict(
            seconds={f"{ranks}x{threads}": seconds for (ranks, threads), seconds in time.items()},
            ghost_bytes=ghost, refreshed_bytes=refreshed, model=rows, ratio=ratio, share_alone=alone,
            fixed=fixed, work=work, ghost=ghost_time, collectives=operations, latency=wait))
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())

"""Cost against size: time per particle and step, and memory per particle, from 5,000 to 500,000 particles of water.

    python benchmarks/size.py [--quick] [--orders] [--threads N] [--json FILE]

A cube of water stands in an open tank of boundary particles; the density constraint makes a fixed number of sweeps. A
boundary particle costs less than a fluid particle, and small tanks have a larger share of them. So the rim of each tank
is made so high that the share is equal at all sizes. Each size runs in a process of its own, and the sizes take turns
in several rounds; times are medians. ``--orders`` compares orders of the particles in memory: a lattice, shuffled, and
shuffled but sorted in space again by PySPH's ``reorder_particles``.

The exit status is 1 unless the time per particle (fluid and wall) and step is flat within 25 %: largest over smallest.
"""
import argparse
import os
import sys
import warnings
from time import perf_counter, process_time

import machine
import numpy as np
from rich.console import Console

from pysph_boiling.report.options import add_report_options
from pysph_boiling.report.terminal import show
from pysph_boiling.runs.jobs import Job, run_job
from pysph_boiling.runs.ledger import write_json
from pysph_boiling.threads import variables

SIDES, QUICK = (17, 27, 40, 58, 80), (17, 24, 34)  # particles along an edge of the cube
FLAT = 1.25
SPACING, SWEEPS = 0.02, 4
WALLS = 0.8  # boundary particles per fluid particle: what the smallest tank needs, with a rim of a fifth of its height
CLOCKS = {"wall": perf_counter, "cpu": process_time}
ORDERS = ("lattice", "shuffled", "reordered")


def resident():
    """Resident memory of this process [bytes]."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def rim(side):
    """Layers of boundary particles above the floor for a share ``WALLS``; two layers of floor and sides."""
    outside = (side + 4) ** 2
    return max(side + 2, round((WALLS * side**3 - 2 * outside) / (outside - side**2)))


def measure(side, order, seconds, clock):
    """One size, in this process: a dictionary of figures. Steps for about ``seconds`` [s], three at least, timed by the
    clock of that name.
    """
    from compyle.config import get_config

    from pysph_boiling.particles import box_vessel, fluid_block
    from pysph_boiling.runs.stepper import Stepper
    from pysph_boiling.schemes.effects import BoxContainer, DensityConstraint
    from pysph_boiling.schemes.pbf import PBFScheme

    get_config().use_openmp = True
    warnings.simplefilter("ignore")
    before, clock = resident(), CLOCKS[clock]
    width = side * SPACING
    upper = (width, width, rim(side) * SPACING)
    scheme = PBFScheme(["fluid"], ["wall"], dim=3, spacing=SPACING, container=BoxContainer(upper=upper),
                       density=DensityConstraint(min_sweeps=SWEEPS, max_sweeps=SWEEPS, tolerance=0.0))
    common = dict(spacing=SPACING, dim=3, rho0=scheme.rho0)
    fluid = fluid_block((0.0,) * 3, (width,) * 3, jitter=0.02, **common)
    wall = box_vessel((0.0,) * 3, upper, kernel=scheme.kernel, **common)
    scheme.setup_properties([fluid, wall])
    if order != "lattice":
        for pa in (fluid, wall):
            shuffle(pa)
    stepper = Stepper(scheme, [fluid, wall])
    reorder = 0.0
    if order == "reordered":
        begin = clock()
        stepper.solver.reorder_particles()
        reorder = clock() - begin
    stepper.step(2)
    count = len(fluid.x) + len(wall.x)
    times, stages, passed = [], dict(scheme.integrator.wall_time), stepper.seconds
    while len(times) < 3 or sum(times) < seconds:
        begin = clock()
        stepper.step()
        times.append(clock() - begin)
    passed = stepper.seconds - passed
    return dict(
        side=side, order=order, fluid=len(fluid.x), wall=len(wall.x), ms=1e3 * float(np.median(times)),
        ns=1e9 * float(np.median(times)) / count, steps=len(times), bytes=(resident() - before) / count,
        reorder=1e3 * reorder, share={name: (total - stages[name]) / passed
                                      for name, total in scheme.integrator.wall_time.items()})


def shuffle(pa):
    """Particles in random order."""
    order = np.random.default_rng(0).permutation(pa.get_number_of_particles())
    for array in pa.properties.values():
        values = array.get_npy_array()
        values[:] = values[order]


def run_child(side, order, seconds, clock, threads):
    """:func:`measure` in a process of its own."""
    return run_job(Job(name=f"{side}^3 particles", call=(measure, side, order, seconds, clock),
                       environment=variables(threads))).result()


def median(rows):
    """Figures of several rounds of one size as one: medians, and the range of the time."""
    ns = [row["ns"] for row in rows]
    return dict(rows[0], ns=float(np.median(ns)), low=min(ns), high=max(ns),
                ms=float(np.median([row["ms"] for row in rows])),
                bytes=float(np.median([row["bytes"] for row in rows])),
                share={name: float(np.median([row["share"][name] for row in rows])) for name in rows[0]["share"]})


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    add_report_options(parser, quick="5,000 to 40,000 particles", report=None)
    parser.add_argument("--orders", action="store_true", help="compare orders of the particles in memory as well")
    parser.add_argument("--threads", type=int, default=os.cpu_count(), help="OpenMP threads (%(default)s)")
    parser.add_argument("--cpu-time", action="store_true", help="for a busy machine: seconds of the processor, and one "
                        "thread alone")
    options = parser.parse_args()
    console = Console(width=140)
    console.print(machine.load())
    sides, rounds, seconds = (QUICK, 3, 1.0) if options.quick else (SIDES, 3, 4.0)
    clock, threads = ("cpu", 1) if options.cpu_time else ("wall", options.threads)
    orders = ORDERS if options.orders else ORDERS[:1]
    found = {(side, order): [] for side in sides for order in orders}
    with console.status("") as status:
        for k in range(rounds):
            for side, order in found:
                status.update(f"round {k + 1}: {side}^3 particles, {order}")
                found[side, order].append(run_child(side, order, seconds, clock, threads))
    rows = {key: median(values) for key, values in found.items()}

    show(console, ("fluid", "wall", "order", "ms a step", "ns per particle and step", "search", "sweeps",
                   "ns per fluid particle", "bytes per particle"),
         [(f"{row['fluid']:,}", f"{row['wall']:,}", order, f"{row['ms']:.1f}",
           f"{row['ns']:.0f} ({row['low']:.0f}-{row['high']:.0f})", f"{row['share']['search']:.0%}",
           f"{row['share']['density']:.0%}", f"{1e6 * row['ms'] / row['fluid']:.0f}", f"{row['bytes']:.0f}")
          for (_, order), row in rows.items()],
         title=f"{SWEEPS} sweeps, {threads} threads, {rounds} rounds, {clock} time")
    for (side, order), row in rows.items():
        if order == "reordered":
            console.print(f"{row['fluid']:,}: putting particles in order takes {row['reorder']:.0f} ms; unordered ones "
                          f"cost {rows[side, 'shuffled']['ms'] - row['ms']:.0f} ms more in every step")
    first, last = rows[sides[0], "lattice"], rows[sides[-1], "lattice"]
    particles = [row["fluid"] + row["wall"] for row in (first, last)]
    slope = (last["bytes"] * particles[1] - first["bytes"] * particles[0]) / (particles[1] - particles[0])
    console.print(f"memory: {slope:.0f} bytes a particle, fluid and wall, from {particles[0]:,} to {particles[1]:,}")
    ns = [rows[side, "lattice"]["ns"] for side in sides]
    flatness = max(ns) / min(ns)
    console.print(f"{'holds' if flatness <= FLAT else 'FAILS'}: time per particle and step is flat within "
                  f"{FLAT - 1.0:.0%}: largest over smallest {flatness:.2f}")
    if options.json:
        write_json(options.json, dict(rows=list(rows.values()), flatness=flatness, bytes=slope, threads=threads,
                                      clock=clock))
    return 0 if flatness <= FLAT else 1


if __name__ == "__main__":
    sys.exit(main())

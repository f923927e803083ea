"""Our neighbour search compared with PySPH's, in PySPH's own dam breaks, which are not modified.

    python benchmarks/search.py [--dim 2|3] [--dx M] [--steps N] [--rounds N] [--json FILE]

The same example is set up three times: with PySPH's default search, which searches in every sum; with its neighbour
lists (``--cache-nnps``); and with our search, returned by ``create_nnps``. They take turns in one process with all
threads, with equal numbers of steps in each round. The table has the least and the median time of a step, the least
time of a search alone (sorting, and the lists of all pairs of arrays that the equations use), and the largest distance
between positions at the end: neighbours are found in another order, so sums differ by round-off.
"""
import argparse
import importlib
import io
import os
import tempfile
import time
from contextlib import redirect_stdout

from pysph_boiling.particles import positions
from pysph_boiling.threads import WAITING

os.environ.update(WAITING)

import numpy as np
from rich.console import Console
from rich.table import Column

from pysph_boiling.report.options import add_report_options
from pysph_boiling.report.terminal import show
from pysph_boiling.runs.ledger import write_json
from pysph_boiling.search import search_for

EXAMPLES = {2: ("dam_break_2d", "DamBreak2D", 0.03), 3: ("dam_break_3d", "DamBreak3D", 0.04)}
WAYS = {"PySPH's default": [], "PySPH's lists": ["--cache-nnps"], "ours": []}


class Way:
    """One application, set up and ready to step."""

    def __init__(self, name, dim, dx, folder):
        module, cls, _ = EXAMPLES[dim]
        example = getattr(importlib.import_module(f"pysph.examples.{module}"), cls)
        if name == "ours":
            example = type(cls, (example,), {"create_nnps": search_for})
        self.application, self.steps, self.searches = example(fname=cls.lower()), [], []
        with redirect_stdout(io.StringIO()):
            self.application.setup(["--openmp", "--disable-output", "--dx", str(dx), "-d", folder, *WAYS[name]])
        self.solver, self.nnps = self.application.solver, self.application.nnps
        groups = [group for evaluation in self.solver.acceleration_evals for group in evaluation.mega_groups]
        names = [pa.name for pa in self.application.particles]
        self.pairs = sorted({(names.index(dest), names.index(source)) for group in groups
                             for dest, (_, sources, _) in group.data.items() for source in sources})

    def step(self, n):
        """Take ``n`` steps; their mean time [ms]."""
        self.solver.set_max_steps(self.solver.count + n)
        begin = time.perf_counter()
        self.solver.solve(show_progress=False)
        self.steps.append(1e3 * (time.perf_counter() - begin) / n)

    def search(self):
        """One search with lists [ms]; nothing where there are none."""
        if not self.application.options.cache_nnps and not hasattr(self.nnps, "ghosts_stay_behind"):
            return
        begin = time.perf_counter()
        self.nnps.update()
        for dest, source in self.pairs:
            self.nnps.set_context(source, dest)
            self.nnps.current_cache.find_all_neighbors()
        self.searches.append(1e3 * (time.perf_counter() - begin))

    def places(self):
        fluid = next(pa for pa in self.application.particles if pa.name == "fluid")
        return positions(fluid)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dim", type=int, choices=tuple(EXAMPLES), default=3)
    parser.add_argument("--dx", type=float, help="particle spacing [m]; 0.03 in 2-D and 0.04 in 3-D if not given")
    parser.add_argument("--steps", type=int, default=10, help="steps in a round")
    parser.add_argument("--rounds", type=int, default=5)
    add_report_options(parser, report=None)
    options = parser.parse_args()
    dx = options.dx or EXAMPLES[options.dim][2]
    with tempfile.TemporaryDirectory() as folder:
        ways = {name: Way(name, options.dim, dx, folder) for name in WAYS}
        for _ in range(options.rounds):
            for way in ways.values():
                way.step(options.steps)
                way.search()
    ours = ways["ours"]
    particles = sum(pa.get_number_of_particles() for pa in ours.application.particles)
    rows = {}
    for name, way in ways.items():
        rows[name] = {"least": min(way.steps), "median": float(np.median(way.steps)),
                      "ratio": min(way.steps) / min(ours.steps), "search": min(way.searches, default=None),
                      "apart": float(np.max(np.abs(way.places() - ours.places()))) / dx}
    console = Console()
    show(console, ("search", *(Column(name, justify="right") for name in (
        "step [ms]", "median", "times ours", "search [ms]", "apart [dx]"))),
         [(name, f"{row['least']:.1f}", f"{row['median']:.1f}", f"{row['ratio']:.2f}",
           "" if row["search"] is None else f"{row['search']:.1f}", f"{row['apart']:.1e}")
          for name, row in rows.items()],
         title=f"{EXAMPLES[options.dim][0]}: {particles} particles, {ours.solver.count} steps")
    console.print(f"load average {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores")
    if options.json:
        write_json(options.json, rows)


if __name__ == "__main__":
    main()

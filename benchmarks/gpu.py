"""Tests and times on a graphics card: every equation, and steady boiling with 20,000, 200,000 and 2 million particles.

Run ``python benchmarks/gpu.py`` on a machine where OpenCL finds a card, or with ``--backend cuda`` and PyCUDA, which
was never tried. It prints a table with the number of particles, milliseconds per step, the share of each stage, and the
residual of the energy ledger.
"""
import argparse
import json
import os
import sys
import tempfile
from pathlib import Path

import numpy as np

from pysph_boiling.report import markdown
from pysph_boiling.runs.jobs import Job, run_job

ROOT = Path(__file__).parents[1]
SIZES = {"20k": ("28", "26"), "200k": ("60", "56"), "2M": ("130", "120")}  # width and fill in spacings, in 3-D
ALIKE = "--pattern", "regular", "--smallest-cavity", "0", "--sites", "9"


def cards():
    """Names of the graphics cards that OpenCL sees."""
    import pyopencl

    return [device.name for platform in pyopencl.get_platforms() for device in platform.get_devices()
            if device.type & pyopencl.device_type.GPU]


def timed(size, steps, backend, precision):
    """A row of the table for one size."""
    width, fill = SIZES[size]
    with tempfile.TemporaryDirectory() as folder:
        run_job(Job(name=f"{size} particles", command=(
            sys.executable, "-m", "pysph_boiling", "run", "steady_boiling", "--width", width, "--fill", fill, *ALIKE,
            "--max-steps", str(steps), "--results-every", str(steps), "--no-pictures", "-d", folder, f"--{backend}",
            *precision))).result()
        record = json.loads((Path(folder) / "run.json").read_text())
        residual = float(np.load(Path(folder) / "results.npz")["energy_residual"][-1])
    stages = {name: value for name, value in record["wall_time"].items() if name != "unit"}
    spent = sum(stages.values())
    shares = ", ".join(f"{name} {value / spent:.0%}" for name, value in stages.items() if value > 0.02 * spent)
    per_step = 1e3 * record["timed"]["seconds"] / record["timed"]["steps"]
    return record["particles"]["fluid"], f"{per_step:.1f}", shares, f"{residual:.1e}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--backend", choices=("opencl", "cuda"), default="opencl")
    parser.add_argument("--use-double", action="store_true", help="double precision; default single")
    parser.add_argument("--sizes", nargs="+", choices=SIZES, default=list(SIZES))
    parser.add_argument("--steps", type=int, default=50, help="steps of each size; default %(default)s")
    parser.add_argument("--any-device", action="store_true", help="run even if OpenCL finds no graphics card")
    parser.add_argument("--no-parity", action="store_true", help="leave out the tests of the equations")
    options = parser.parse_args()
    if options.backend == "opencl" and not options.any_device and not cards():
        sys.exit("OpenCL sees no graphics card here (--any-device runs on what there is)")
    if options.backend == "opencl" and not options.no_parity:
        run_job(Job(name="the tests of the equations", directory=ROOT, command=(
            sys.executable, "-m", "pytest", "-q", str(ROOT / "tests" / "compiled")),
            environment={**os.environ, "PYSPH_BOILING_BACKEND": "opencl"})).result()
    precision = ("--use-double",) if options.use_double else ()
    print("\n".join(markdown.table(("particles", "ms a step", "stages", "energy residual"), ())))
    for size in options.sizes:
        print(markdown.cells(timed(size, options.steps, options.backend, precision)), flush=True)


if __name__ == "__main__":
    main()

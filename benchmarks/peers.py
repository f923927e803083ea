"""Cost of accuracy here and in other codes: SPlisHSPlasH's PBF and DFSPH, and Position Based Fluids in Taichi.

    python benchmarks/peers.py [--quick] [--json FILE] [--report FILE.md]

All codes run a hydrostatic column and a dam break with the same particles (fluid and walls), spacing, kernel, support
radius and duration, without viscosity. Every code runs a small grid of time steps and tolerances, and one function
measures the errors of all codes from the positions (:mod:`scenes`). The front of a code consists of the settings that
none of its others beats in both error and time. Its settings next to the required errors are run again, in turn with
the other codes, with one and two threads. The codes are compared at equal density error: costs are interpolated between
the settings in log-log scale, and never extrapolated.

The other codes are installed into an environment of their own (``--environment``, 1 GB). The exit status is 1 if a run
failed or the codes did not get the same scene, and 3 if the other codes are not installed.
"""
import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import machine
import numpy as np
from rich.console import Console

from pysph_boiling.report import markdown
from pysph_boiling.report.options import add_report_options
from pysph_boiling.report.terminal import show
from pysph_boiling.runs.jobs import Job, run_job
from pysph_boiling.runs.ledger import write_json
from pysph_boiling.threads import variables

CODES_FOLDER = Path(__file__).resolve().parent / "peer_codes"
sys.path.insert(0, str(CODES_FOLDER))
from scenes import ESCAPES, GRAVITY, Scene, at_equal_error, by_rising_error, compression, front, outside  # noqa: E402

PACKAGES = ("pysplishsplash==2.19.0", "taichi==1.7.4", "numpy")
LIBRARIES = ("GLdispatch", "GLX", "OpenGL")  # bundled with pysplishsplash, and in conflict with the system's
NOT_INSTALLED = 3  # exit status
SNAPSHOTS = 24
TARGETS = (1e-3, 4e-4)  # mean density errors at which codes are compared
OURS = "pysph_boiling"
WINDOW = (0.5, 2.5)  # t sqrt(g/H) in which the front is compared with experiments, as the scene dam_break does
SAME = dict(volume=1e-4, support=1e-4, wall_volume=1e-3, within_support=0.02)  # relative differences that are allowed

JACOBI = dict(omega=1.0, eps=0.0)  # the plain sweep of the other codes
# the other codes split no step and do no sweep beyond their maximum: here steps in which a particle would move further
# than a spacing are split, no others
OURS_PLAIN = dict(JACOBI, courant=1.0, longest_step=1.0, max_mean_error=1.0)
PLAIN = dict(min_sweeps=1, max_sweeps=100)
SHARES = (0.2, 0.1, 0.05, 0.025)  # time steps in sqrt(spacing/g)
TOLERANCES = (2e-3, 3e-4)


def percent(tolerance):
    """Tolerances of SPlisHSPlasH are in percent."""
    return float(100.0 * tolerance)


# code -> (worker, settings by tolerance)
CODES = {
    OURS: ("ours", lambda e: dict(PLAIN, **OURS_PLAIN, tolerance=e, **OUR_BEST)),
    f"{OURS}, plain": ("ours", lambda e: dict(PLAIN, **OURS_PLAIN, tolerance=e)),
    "SPlisHSPlasH PBF": ("splishsplash", lambda e: dict(
        method="PBF", MIN_ITERATIONS=1, MAX_ITERATIONS=100, MAX_ERROR=percent(e))),
    "SPlisHSPlasH DFSPH": ("splishsplash", lambda e: dict(
        method="DFSPH", MIN_ITERATIONS=1, MAX_ITERATIONS=100, MAX_ERROR=percent(e))),
    "Taichi PBF": ("taichi_pbf", lambda e: dict(PLAIN, **JACOBI, tolerance=e)),
}
OUR_BEST = dict(chebyshev_radius=0.95)  # a skin does not pay while all of the water moves
EQUAL_SHARE, EQUAL_SWEEPS = 0.05, 5
EQUAL = {  # settings that all PBF codes know
    OURS: dict(min_sweeps=EQUAL_SWEEPS, max_sweeps=EQUAL_SWEEPS, tolerance=0.0, **OURS_PLAIN),
    "SPlisHSPlasH PBF": dict(method="PBF", MIN_ITERATIONS=EQUAL_SWEEPS, MAX_ITERATIONS=EQUAL_SWEEPS),
    "Taichi PBF": dict(min_sweeps=EQUAL_SWEEPS, max_sweeps=EQUAL_SWEEPS, tolerance=0.0, **JACOBI),
}


def column(n, duration):
    return Scene("hydrostatic column", (n, n, 2 * n), (n + 2, n + 2, 2 * n + 5), duration, 0.5 * duration)


def dam_break(n, duration):
    return Scene("dam break", (n, n, 2 * n), (5 * n, n + 2, 2 * n + 5), duration, 0.2 * duration)


# --- the environment of the other codes -------------------------------------------------------------------------------

class NotInstalled(Exception):
    """The other codes are not installed; the message gives the reason."""


def environment(folder, console, install=True):
    """Python of an environment with the other codes, made if ``install``, and mended if need be."""
    python = folder / "bin" / "python"
    if not python.exists():
        if not install:
            raise NotInstalled(f"the other codes (SPlisHSPlasH, Taichi) are not installed in {folder}: "
                               "python benchmarks/peers.py installs them, 1 GB")
        console.print(f"installing {', '.join(PACKAGES)} into {folder}")
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
        subprocess.run([str(python), "-m", "pip", "install", "--quiet", *PACKAGES], check=True)
    if loads(python) != 0:
        use_system_libraries(folder)
    if loads(python) != 0:
        raise NotInstalled(f"pysplishsplash cannot be imported in {folder}: remove the folder and try again; on Debian "
                           "and Ubuntu it needs libgl1 and libopengl0")
    return python


def loads(python):
    return subprocess.run([str(python), "-c", "import pysplishsplash, taichi"], capture_output=True).returncode


def use_system_libraries(folder):
    """Replace the OpenGL libraries that the wheel bundles, whose import crashes, by links to the system's."""
    listing = subprocess.run(["ldconfig", "-p"], capture_output=True, text=True).stdout
    system = {line.split()[0]: line.split()[-1] for line in listing.splitlines() if "=>" in line}
    for bundled in folder.glob("lib/python*/site-packages/pysplishsplash.libs/*"):
        name = f"{bundled.name.split('-')[0]}.so.0"
        if name in {f"lib{library}.so.0" for library in LIBRARIES} and name in system:
            bundled.unlink()
            bundled.symlink_to(system[name])


# --- one run ----------------------------------------------------------------------------------------------------------

class Run:
    """One setting of a code on a scene; ``rounds`` collects ms per step for each number of threads."""

    def __init__(self, code, scene, share, settings, label):
        self.code, self.scene, self.settings, self.label = code, scene, settings, label
        self.dt = share * scene.unit
        self.rounds, self.record, self.failure = {}, None, None

    def execute(self, python, threads, folder, cpu_time=False):
        """Run once in a process of its own."""
        scene, worker = self.scene, CODES[self.code][0]
        job = dict(spacing=scene.spacing, h=scene.h, gravity=GRAVITY, dt=self.dt, duration=scene.duration,
                   threads=threads, settings=self.settings, snapshots=SNAPSHOTS, cpu_time=cpu_time)
        path, out = folder / "job.npz", folder / "out.npz"
        out.unlink(missing_ok=True)
        np.savez(path, fluid=scene.fluid, wall=scene.wall, volume=scene.wall_volume, size=scene.size,
                 job=json.dumps(job))
        environ = variables(threads)
        environ.pop("PYTHONPATH", None)
        if worker == "ours":
            python, environ["PYTHONPATH"] = sys.executable, str(CODES_FOLDER.parents[1])
        log = folder / "log.txt"
        log.unlink(missing_ok=True)
        outcome = run_job(Job(name=self.code, directory=folder, environment=environ, log=log, command=(
            str(python), str(CODES_FOLDER / f"{worker}.py"), str(path), str(out))))
        if outcome.failure or not out.exists():
            self.failure = f"{outcome.failure or 'it wrote no result'}: {outcome.output[-800:]}"
            return
        with np.load(out) as data:
            # the first step holds what codes put off until then
            self.rounds.setdefault(threads, []).append(1e3 * float(np.mean(data["seconds"][1:])))
            if self.record is None:
                self.record = self.measure(data)

    def measure(self, data):
        """Measure errors from the positions, with the same functions for every code."""
        scene, times = self.scene, data["times"]
        watched = times >= scene.watched
        errors = np.array([compression(scene, x) for x in data["positions"][watched]])
        record = dict(
            sweeps=float(data["sweeps"].mean()), neighbours=float(data["neighbours"][-1]),
            within_support=float(data["neighbours"][0]),
            density_mean=float(errors.mean()), density_max=float(errors.max()),
            outside=int(outside(scene, data["positions"][-1]).sum()), **json.loads(str(data["facts"])))
        if scene.name == "dam break":
            record["known"] = front_error(scene, times, [front(scene, x) for x in data["positions"]])
        else:
            record["known"] = float(np.mean([2.0 * x[:, 2].mean() / scene.level - 1.0
                                             for x in data["positions"][watched]]))
        return record

    @property
    def valid(self):
        """Whether the run succeeded without losing particles."""
        return self.record is not None and self.record["outside"] <= ESCAPES * len(self.scene.fluid)

    def point(self, threads, k=None):
        """(density error, wall seconds per simulated second): median, or of round ``k``."""
        ms = self.rounds[threads]
        return self.record["density_mean"], 1e-3 * (np.median(ms) if k is None else ms[k]) / self.dt


def front_error(scene, times, fronts):
    """Largest relative distance of the front from the range of the experiments, signed: positive ahead of them."""
    from pysph.examples.db_exp_data import get_koshizuka_oka_data, get_martin_moyce_1, get_martin_moyce_2

    height = scene.spacing * scene.counts[2]
    t, x = np.array(times) * np.sqrt(GRAVITY / height), np.array(fronts)
    measured = np.array([np.interp(2.0 * t, *data(), left=np.nan, right=np.nan)
                         for data in (get_martin_moyce_1, get_martin_moyce_2, get_koshizuka_oka_data)])
    window = (t >= WINDOW[0]) & (t <= WINDOW[1]) & np.isfinite(measured).any(axis=0)
    low, high = np.nanmin(measured[:, window], axis=0), np.nanmax(measured[:, window], axis=0)
    distance = np.where(x[window] > high, x[window] / high - 1.0, np.minimum(x[window] / low - 1.0, 0.0))
    return float(distance[np.argmax(np.abs(distance))])


# --- comparison -------------------------------------------------------------------------------------------------------

def grid(scene, quick):
    """The runs of the survey on a scene, code by code at each place of the grid: neighbours in time are compared."""
    rows = []
    for share in SHARES[1:3] if quick else SHARES:
        for tolerance in TOLERANCES:
            rows += [Run(code, scene, share, settings(tolerance), f"{tolerance:.2%}")
                     for code, (_, settings) in CODES.items()]
    rows += [Run(code, scene, EQUAL_SHARE, settings, f"{EQUAL_SWEEPS} sweeps") for code, settings in EQUAL.items()]
    return rows


def best(runs, threads):
    """Of the runs of one code those on its front that lie next to a target, on either side."""
    valid = [run for run in runs if run.valid and not run.label.endswith("sweeps")]
    points, keep = [run.point(threads) for run in valid], set()
    front = by_rising_error(points)
    for target in TARGETS:
        below = sum(points[k][0] < target for k in front)
        keep.update(front[max(0, below - 1):below + 1])
    return [valid[k] for k in front if k in keep]


def ratios(runs, threads):
    """Rows: target, peer, ratio of its cost to ours by round, at equal density error."""
    rows = []
    of = {code: [run for run in runs if run.code == code and run.valid and threads in run.rounds
                 and not run.label.endswith("sweeps")] for code in CODES}
    for target in TARGETS:
        for peer in CODES:
            if peer == OURS or not of[peer] or not of[OURS]:
                continue
            rounds = min(len(run.rounds[threads]) for run in of[peer] + of[OURS])
            found = []
            for k in range(rounds):
                ours, theirs = (at_equal_error([run.point(threads, k) for run in of[code]], target)
                                for code in (OURS, peer))
                if ours and theirs:
                    found.append(theirs / ours)
            if found:
                rows.append(dict(threads=threads, error=target, peer=peer, median=float(np.median(found)),
                                 low=min(found), high=max(found), rounds=len(found)))
    return rows


def equal_settings(runs, threads):
    """Rows: peer, ratio of its time per step to ours at the same time step and sweeps."""
    of = {run.code: run for run in runs if run.label.endswith("sweeps") and threads in run.rounds}
    rows = []
    for peer in of:
        if peer != OURS and OURS in of:
            found = np.array(of[peer].rounds[threads]) / np.array(of[OURS].rounds[threads])
            rows.append(dict(threads=threads, peer=peer, median=float(np.median(found)), low=float(found.min()),
                             high=float(found.max()), rounds=len(found),
                             density_mean={code: of[code].record["density_mean"] for code in (OURS, peer)}))
    return rows


def differences(runs):
    """What is not the same in the scenes that the codes were given: sentences."""
    found, records = [], [run for run in runs if run.record]
    for scene in {run.scene for run in records}:
        here = [run for run in records if run.scene is scene]
        reference = next((run for run in here if run.code == OURS), here[0])
        for run in here:
            for what in ("fluid", "wall"):
                if run.record[what] != reference.record[what]:
                    found.append(f"{scene.name}: {run.code} has {run.record[what]} {what} particles, "
                                 f"{reference.code} {reference.record[what]}")
            for what, tolerance in SAME.items():
                mine, its = reference.record[what], run.record[what]
                if abs(its / mine - 1.0) > tolerance:
                    found.append(f"{scene.name}: {what} is {its:.6g} in {run.code}, {mine:.6g} in {reference.code}")
    return sorted(set(found))


def run_table(scene, runs, threads):
    """Rows of text of every setting that was run on a scene."""
    known = "front" if scene.name == "dam break" else "level"
    head = ["code", "tolerance", "dt [ms]", "split", "neighbours", "sweeps", "ms a step", "s per s", "density error",
            "largest", f"{known} error", "outside"]
    rows = []
    for run in sorted((r for r in runs if r.scene is scene and r.record and threads in r.rounds),
                      key=lambda r: (list(CODES).index(r.code), -r.dt, r.label)):
        ms, record = run.rounds[threads], run.record
        spread = f" ({min(ms):.1f}-{max(ms):.1f})" if len(ms) > 1 else ""
        split = f"{record['split']:.0%}" if "split" in record else ""
        rows.append([run.code, run.label, f"{1e3 * run.dt:.2f}", split, f"{record['neighbours']:.1f}",
                     f"{record['sweeps']:.1f}", f"{np.median(ms):.1f}{spread}", f"{run.point(threads)[1]:.2f}",
                     f"{record['density_mean']:.3%}", f"{record['density_max']:.2%}", f"{record['known']:+.1%}",
                     str(record["outside"])])
    return head, rows


def ratio_table(runs, scenes):
    """Rows of text: times as fast at equal error, by scene, error and threads."""
    peers = [code for code in CODES if code != OURS]
    head, rows, data = ["scene", "threads", "at", *peers], [], []
    for scene in scenes:
        here = [run for run in runs if run.scene is scene]
        for threads in (2, 1):
            found = [dict(row, scene=scene.name) for row in ratios(here, threads)]
            data += found
            for target in TARGETS:
                cells = {row["peer"]: f"{row['median']:.2f} ({row['low']:.2f}-{row['high']:.2f})"
                         for row in found if row["error"] == target}
                if cells:
                    rows.append([scene.name, str(threads), f"density error {target:.2%}",
                                 *(cells.get(peer, "") for peer in peers)])
            equal = [dict(row, scene=scene.name, error=None) for row in equal_settings(here, threads)]
            data += equal
            if equal:
                cells = {row["peer"]: f"{row['median']:.2f} ({row['low']:.2f}-{row['high']:.2f})" for row in equal}
                rows.append([scene.name, str(threads), f"{EQUAL_SWEEPS} sweeps, dt {EQUAL_SHARE} sqrt(dx/g)",
                             *(cells.get(peer, "") for peer in peers)])
    return head, rows, data


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    add_report_options(parser, quick="a small column alone, fewer settings: two minutes")
    parser.add_argument("--environment", metavar="FOLDER", default="~/.cache/pysph_boiling_peers",
                        help="where the other codes are installed (%(default)s)")
    parser.add_argument("--no-install", dest="install", action="store_false", help="only where they are installed")
    parser.add_argument("--cpu-time", action="store_true", help="for a busy machine: seconds of the processor, and one "
                        "thread alone")
    options = parser.parse_args()
    console = Console(width=180)
    scenes = [column(8, 0.5)] if options.quick else [column(12, 1.0), dam_break(14, 0.5)]
    survey, plan = 2, [(2, 1)] if options.quick else [(2, 2), (1, 2)]  # (threads, rounds) after the survey
    if options.cpu_time:
        survey, plan = 1, [(1, 1)]
    try:
        python = environment(Path(options.environment).expanduser(), console, options.install)
    except NotInstalled as error:
        print(error, file=sys.stderr)
        return NOT_INSTALLED
    console.print(machine.load())

    runs, begin = [run for scene in scenes for run in grid(scene, options.quick)], time.perf_counter()
    with tempfile.TemporaryDirectory() as name, console.status("") as status:
        def execute(run, threads, what):
            status.update(f"{what}: {run.scene.name}, {run.code}, {run.label}, dt {1e3 * run.dt:.2f} ms, "
                          f"{threads} threads ({time.perf_counter() - begin:.0f} s)")
            run.execute(python, threads, Path(name), options.cpu_time)

        for run in runs:
            execute(run, survey, "survey")
        kept = [run for scene in scenes for code in CODES
                for run in best([r for r in runs if r.scene is scene and r.code == code], survey)]
        kept += [run for run in runs if run.label.endswith("sweeps") and run.valid]
        kept.sort(key=lambda run: (scenes.index(run.scene), run.label.endswith("sweeps"), -run.dt))
        for threads, rounds in plan:
            for k in range(rounds):
                for run in kept:
                    execute(run, threads, f"round {k + 1}")

    tables = []  # title, heading, rows
    for scene in scenes:
        for threads in sorted({threads for run in kept for threads in run.rounds}, reverse=True):
            title = (f"{scene.name}: {len(scene.fluid)} fluid and {len(scene.wall)} wall particles, "
                     f"{scene.duration} s, {threads} thread{'s' if threads > 1 else ''}")
            tables.append((title, *run_table(scene, runs, threads)))
    head, rows, data = ratio_table([run for run in kept if run.valid], scenes)
    tables.append((f"how many times as fast {OURS} is (median and range of the rounds)", head, rows))
    for title, head, rows in tables:
        show(console, head, rows, title)

    failed = [f"{run.scene.name}, {run.code}, {run.label}: {run.failure}" for run in runs if run.failure]
    different = differences(runs)
    for sentence in failed + different:
        console.print(f"FAILS: {sentence}", markup=False)
    console.print(f"{time.perf_counter() - begin:.0f} s in all")
    if options.report:
        markdown.write(options.report, *(block for title, head, rows in (tables[-1], *tables[:-1])
                                         for block in (title, markdown.table(head, rows))))
    if options.json:
        write_json(options.json, dict(
            ratios=data, failed=failed, different=different, seconds=time.perf_counter() - begin,
            runs=[dict(code=run.code, scene=run.scene.name, tolerance=run.label, settings=run.settings, dt=run.dt,
                       ms=run.rounds, record=run.record, failure=run.failure) for run in runs]))
    return 1 if failed or different else 0


if __name__ == "__main__":
    sys.exit(main())

"""Time of a step of ``steady_boiling`` while it boils, stage by stage, and a comparison with another version.

    python benchmarks/boil.py [--quick] [--against REV | --opencl] [--json FILE] [--report FILE.md] [scene options]

For each h/dx the vessel first boils for a second or more. Each version then starts from these particles, in a process
of its own, with the constants of water that this version has. The versions take turns of a few steps, so that other
load on the machine affects both. ``--against`` takes the other version from this git checkout. The time of a step
includes tools and ledger. The first steps are not timed, and particle files are timed separately. Below h/dx 1.2 the
range of cohesion ends at the kernel support. Unknown options are passed to the scene (``--width 20``). The first run of
a version compiles it, which takes minutes.

With ``--against``, the exit status is 1 unless both versions give the same result: positions to 1e-9 spacings after 12
steps, and equal phases, bubble labels and counts after 50. A boil is chaotic: summing in another order changes which
particles boil first. So a twin of this version starts with positions moved by 1e-13 spacings, and the versions may
differ by ten times its largest distance, and by twice its number of particles in another phase or bubble. Changes of
the physics between the versions exceed that.

``--opencl`` compares OpenMP with OpenCL in single precision instead (``--opencl --use-double`` for double), both of
this version. With it, the exit status is 1 if a step on OpenCL takes more than four times as long.
"""
import argparse
import io
import json
import os
import subprocess
import sys
import tarfile
import tempfile
from contextlib import ExitStack
from pathlib import Path

import machine
import numpy as np
from rich.console import Console

from pysph_boiling.phases import Phase
from pysph_boiling.report import markdown
from pysph_boiling.report.options import add_report_options
from pysph_boiling.report.terminal import show
from pysph_boiling.runs.ledger import write_json
from pysph_boiling.threads import variables

ROOT, WORKER = Path(__file__).resolve().parents[1], Path(__file__).with_name("boil_worker.py")
HERE, OPENMP, OPENCL = "this version", "OpenMP", "OpenCL"
SLOWER = 4.0  # how many times as long a step may take on OpenCL, on a processor
STATE, QUICK_STATE = 1000, 600  # steps to the state that is common
SAME_POSITIONS, SAME_EVENTS = 12, 50  # steps after which versions are compared
DISTANCE = 1e-9  # spacings: how far a particle may be from itself in the other version
TWIN, FURTHER, AS_MANY = 1e-13, 10.0, 2  # spacings that a twin starts away; how much more than in it may differ
BLOCK, UNTIMED, FILES = 6, 2, 5  # steps in turn; steps at first that are not timed; particle files that are timed
OUTSIDE, WHOLE, FILE = "outside the stages", "whole step", "a particle file"


class NoVersion(Exception):
    """The other version is not available; the message gives the reason."""


def git(*arguments):
    """The output of git in this checkout, as bytes. Raises :class:`NoVersion` with its error message if it fails."""
    try:
        done = subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True)
    except FileNotFoundError:
        raise NoVersion("--against needs git, which is not installed") from None
    if done.returncode:
        raise NoVersion(done.stderr.decode().strip())
    return done.stdout


def unpack(revision, folder):
    """Put a commit into a folder and return its short name."""
    try:
        top = git("rev-parse", "--show-toplevel").decode().strip()
    except NoVersion as error:
        raise NoVersion(f"--against needs a git checkout, and {ROOT} is none ({error})") from None
    if Path(top).resolve() != ROOT:
        raise NoVersion(f"--against needs a git checkout, and {ROOT} is none, but a folder in that of {top}")
    try:
        name = git("rev-parse", "--verify", "--quiet", "--short", f"{revision}^{{commit}}")
    except NoVersion:
        raise NoVersion(f"--against: this checkout has no commit '{revision}'") from None
    name = name.decode().strip()
    with tarfile.open(fileobj=io.BytesIO(git("archive", name))) as archive:
        archive.extractall(folder, filter="data")
    return name


class Process:
    """A version that runs in a process of its own; ``ask`` requests steps, particle files and states from it."""

    def __init__(self, name, root, *, hdx, state, threads, scene):
        self.name, self.folder, self.errors = name, tempfile.TemporaryDirectory(), tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(
            [sys.executable, str(WORKER), str(root), str(hdx), str(state or "-"), self.folder.name, *scene],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.errors, text=True, cwd=self.folder.name,
            env={**variables(threads), "PYTHONPATH": str(root)})

    def close(self):
        self.process.communicate()  # the end of its input ends it
        self.folder.cleanup()

    def ask(self, **request):
        try:
            self.process.stdin.write(json.dumps(request) + "\n")
            self.process.stdin.flush()
            answer = self.process.stdout.readline()
        except BrokenPipeError:
            answer = ""
        if not answer:
            self.process.wait()
            self.errors.seek(0)
            raise RuntimeError(f"{self.name} ended: {self.errors.read()[-2000:]}")
        return json.loads(answer)

    def state(self, folder, steps):
        """The state after ``steps`` steps as (path of its file in ``folder``, dict of name -> array)."""
        path = Path(folder) / f"{self.name} {steps}.npz"
        self.ask(state=str(path))
        with np.load(path) as data:
            return path, dict(data)


def measure(versions, *, hdx, steps, before, threads, scene, say):
    """A dict of times and differences at one h/dx; ``versions`` maps names to roots, and the first makes the state.

    The version named OPENCL runs there, and only its times are compared.
    """
    maker, *others = versions
    others = [name for name in others if name != OPENCL]
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        def started(name, state=None):
            process = Process(name, versions[name], hdx=hdx, state=state, threads=threads,
                              scene=[*scene, "--opencl"] if name == OPENCL else scene)
            stack.callback(process.close)
            return process

        say(f"h/dx {hdx}: {before} steps to a state that boils (a first run compiles)")
        process = started(maker)
        process.ask(steps=before)
        path, state = process.state(folder, 0)
        stack.close()
        say(f"h/dx {hdx}: {steps} steps from there (a first run compiles)")
        processes = [started(name, path) for name in versions]
        times, states, taken = {name: [] for name in versions}, {}, 0
        files = {process.name: process.ask(files=1) for process in processes}  # they start, one after the other
        for goal in sorted({min(SAME_POSITIONS, steps), min(SAME_EVENTS, steps), steps}):
            while taken < goal:
                block = min(BLOCK, goal - taken)
                for process in processes:
                    times[process.name] += process.ask(steps=block)
                taken += block
            states[goal] = [process.state(folder, goal)[1] for process in processes if process.name != OPENCL]
        for _ in range(FILES):
            for process in processes:
                files[process.name]["ms"] += process.ask(files=1)["ms"]
        wanted = [min(SAME_POSITIONS, steps), min(SAME_EVENTS, steps)]
        twins = []
        if others:
            twin = started(maker, moved(state, Path(folder) / "moved.npz"))
            for begin, goal in zip((0, *wanted), wanted):
                if goal > begin:
                    twin.ask(steps=goal - begin)
                twins.append(twin.state(folder, goal)[1])
    row = dict(hdx=hdx, particles=len(state["property x"]), vapour=int((state["property phase"] == Phase.VAPOUR).sum()),
               versions={name: figures(times[name][UNTIMED:], files[name]) for name in versions}, same=[])
    if others:
        row["same"] = [same(*states[goal], goal, twin)
                       for same, goal, twin in zip((same_positions, same_events), wanted, twins)]
    if OPENCL in versions:
        row["same"] = [fast_enough(row["versions"])]
    return row


def fast_enough(versions):
    """Whether a step on OpenCL takes at most SLOWER times as long as one on OpenMP: dict with claim, verdict and text.
    """
    ratio = {what: 1.0 / faster for what, faster in
             times_as_fast(versions[OPENCL], versions[OPENMP], WHOLE).items()}
    return dict(claim=f"a step on OpenCL takes at most {SLOWER:g} times as long as one on OpenMP",
                holds=ratio["median"] <= SLOWER,
                found=f"{ratio['median']:.2f} times by the medians, {ratio['least']:.2f} by the least")


def moved(state, path):
    """Write a state whose particles are moved by about TWIN spacings in random directions; returns the path."""
    random, other = np.random.default_rng(1), dict(state)
    for name in ("property x", "property y", "property z"):
        other[name] = state[name] + TWIN * state["spacing"] * random.normal(size=len(state[name]))
    np.savez(path, **other)
    return path


def figures(steps, files):
    """Times of the steps of one version: least and median of each part [ms], sweeps, and the share outside the stages.
    """
    stages = [name for name in steps[0] if name not in ("whole", "sweeps")]
    parts = {name: [step[name] for step in steps] for name in stages}
    parts[OUTSIDE] = [step["whole"] - sum(step[name] for name in stages) for step in steps]
    parts[WHOLE] = [step["whole"] for step in steps]
    parts[FILE] = files["ms"][1:]  # the first one loads what it takes
    per_step = np.mean(parts[FILE]) / files["every"]
    outside = (np.mean(parts[OUTSIDE]) + per_step) / (np.mean(parts[WHOLE]) + per_step)
    return dict(parts={name: dict(least=float(min(values)), median=float(np.median(values)))
                       for name, values in parts.items()},
                steps=len(steps), sweeps=float(np.mean([step["sweeps"] for step in steps])),
                outside=float(outside), steps_per_file=files["every"])


def by_uid(state, name):
    """A property of the particles in the order of their uid."""
    return state[f"property {name}"][np.argsort(state["property uid"])]


def distances(ours, theirs):
    """Distance of each particle between two states [spacings], or ``None`` if the states have other particles."""
    if not np.array_equal(by_uid(ours, "uid"), by_uid(theirs, "uid")):
        return None
    return np.sqrt(sum((by_uid(ours, axis) - by_uid(theirs, axis)) ** 2 for axis in "xyz")) / ours["spacing"]


def same_positions(ours, theirs, steps, twin=None):
    """Whether particles have the same positions in both versions, as a dict with claim, verdict and text.

    ``twin`` is the state of a run that started TWIN spacings away, if there is one.
    """
    claim = f"positions agree to {DISTANCE:g} spacings after {steps} steps"
    apart, chaos = distances(ours, theirs), None if twin is None else distances(ours, twin)
    if apart is None:
        return dict(claim=claim, holds=False, found="the particles are not the same ones")
    found = f"the largest distance is {apart.max():.1e} spacings, the median {np.median(apart):.1e}"
    allowed = DISTANCE
    if chaos is not None:
        claim += f", or {FURTHER:g} times the largest distance of a twin"
        found += f"; in the twin {chaos.max():.1e} and {np.median(chaos):.1e}"
        allowed = max(allowed, FURTHER * chaos.max())
    return dict(claim=claim, holds=bool(apart.max() <= allowed), found=found)


def counts(state):
    """Numbers of particles in each phase, of bubbles, of departures, and of particles and bubbles vented, by name."""
    phase, bubble = state["property phase"], state["property bubble"]
    found = {phase_.name.lower(): int((phase == phase_).sum()) for phase_ in Phase}
    found["bubbles"] = len(np.unique(bubble[phase == Phase.VAPOUR]))
    found["departures"] = int(state["departures"])
    return found | {name: int(state[f"constant {name}"][0]) for name in ("n_vented", "n_bubbles_vented")}


def differing(ours, theirs):
    """Numbers of particles with another phase and with another label; ``None`` if the states have other particles."""
    if not np.array_equal(by_uid(ours, "uid"), by_uid(theirs, "uid")):
        return None
    return [int((by_uid(ours, name) != by_uid(theirs, name)).sum()) for name in ("phase", "bubble")]


def same_events(ours, theirs, steps, twin=None):
    """Whether phases, labels and counts are equal in both versions, as a dict with claim, verdict and text.

    ``twin`` is the state of a run that started TWIN spacings away, if there is one.
    """
    claim = f"phases, labels and counts are the same after {steps} steps"
    mine, its = counts(ours), counts(theirs)
    found = [f"{name} {mine[name]} here, {its[name]} there" for name in mine if mine[name] != its[name]]
    differ, chaos = differing(ours, theirs), None if twin is None else differing(ours, twin)
    if differ is None:
        found.append("the particles are not the same ones")
    else:
        found += [f"{number} particles {what}" for number, what in zip(
            differ, ("are in another phase", "have another label")) if number]
    holds = not found
    if differ is not None and chaos is not None:
        claim += f", or differ by {AS_MANY} times the particles of a twin"
        found.append(f"in the twin {chaos[0]} are in another phase, and {chaos[1]} have another label")
        holds = holds or all(number <= AS_MANY * allowed for number, allowed in zip(differ, chaos))
    return dict(claim=claim, holds=holds, found="; ".join(found) or ", ".join(
        f"{number} {name}" for name, number in mine.items()))


def table(row):
    """Title, heading and rows of the table of one h/dx."""
    versions = row["versions"]
    mine, *others = versions.values()
    title = (f"steady boiling, h/dx {row['hdx']:g}: {row['particles']} particles, {row['vapour']} of them vapour; "
             f"least and median of {mine['steps']} steps, {row['threads']} threads, "
             f"load {row['load'][0]:.1f} before and {row['load'][1]:.1f} after")
    head = ["ms", *versions, *("times as fast: least, median" for _ in others)]
    parts = dict.fromkeys(part for version in versions.values() for part in version["parts"])
    rows = []
    for part in sorted(parts, key=(OUTSIDE, WHOLE, FILE).__contains__):  # stages first
        cells = [version["parts"].get(part) for version in versions.values()]
        rows.append([part, *(f"{cell['least']:.2f}, {cell['median']:.2f}" if cell else "" for cell in cells)])
        for other in others:
            faster = times_as_fast(mine, other, part)
            rows[-1].append(", ".join(f"{ratio:.2f}" for ratio in faster.values()))
    for what, text in (("sweeps a step", "{sweeps:.2f}"), ("files: steps to each", "{steps_per_file}"),
                       ("outside the stages, files included, of the mean step", "{outside:.1%}")):
        rows.append([what, *(text.format(**version) for version in versions.values()), *("" for _ in others)])
    return title, head, rows


def times_as_fast(mine, other, part):
    """How many times as fast a part is here: ratio of the least and of the median times, if both are above 0."""
    here, there = mine["parts"].get(part, {}), other["parts"].get(part, {})
    return {what: there[what] / here[what] for what in here if here[what] > 0.0 < there.get(what, 0.0)}


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0], epilog="Other options go to the scene.")
    add_report_options(parser, quick="use the scene's demo, and h/dx 1.2 only")
    parser.add_argument("--against", metavar="REV", help="another version: a commit, branch or tag of this checkout")
    parser.add_argument("--opencl", action="store_true", help="compare OpenMP with OpenCL in single precision")
    parser.add_argument("--use-double", action="store_true", help="with --opencl: in double precision")
    parser.add_argument("--hdx", type=float, nargs="+", help="smoothing lengths over spacing; default 1.2 and 1.0")
    parser.add_argument("--before", type=int,
                        help=f"steps before the measurement; default {STATE}, {QUICK_STATE} with --quick")
    parser.add_argument("--steps", type=int, default=SAME_EVENTS, help="steps that are measured; default %(default)s")
    parser.add_argument("--threads", type=int, default=os.cpu_count(), help="OpenMP threads; default %(default)s")
    options, scene = parser.parse_known_args(argv)
    if options.steps <= UNTIMED:
        parser.error(f"--steps must be more than {UNTIMED}, which are not timed; got {options.steps}")
    if options.opencl and options.against:
        parser.error("--against compares on OpenMP alone: leave out --opencl")
    if options.use_double:
        scene = ["--use-double", *scene]  # the host computes in double precision in any case
    if options.quick:
        scene = ["--demo", *scene]
    console, rows = Console(width=140), []
    before = options.before or (QUICK_STATE if options.quick else STATE)
    console.print(machine.load())
    with tempfile.TemporaryDirectory() as folder, console.status("") as status:
        versions = {OPENMP: ROOT, OPENCL: ROOT} if options.opencl else {HERE: ROOT}
        if options.against:
            try:
                versions[unpack(options.against, folder)] = Path(folder).resolve()
            except NoVersion as error:
                parser.error(str(error))
        for hdx in options.hdx or ([1.2] if options.quick else [1.2, 1.0]):
            begin = os.getloadavg()[0]
            row = measure(versions, hdx=hdx, steps=options.steps, before=before, threads=options.threads,
                          scene=scene, say=status.update)
            rows.append(dict(row, threads=options.threads, load=[begin, os.getloadavg()[0]]))
    blocks, holds = [], True
    for row in rows:
        title, head, cells = table(row)
        show(console, head, cells, title)
        verdicts = [f"{'holds' if one['holds'] else 'FAILS'}: h/dx {row['hdx']:g}: {one['claim']}: {one['found']}"
                    for one in row["same"]]
        console.print("\n".join(verdicts), markup=False, highlight=False)
        holds &= all(one["holds"] for one in row["same"])
        blocks += [title, markdown.table(head, cells), [f"- {verdict}" for verdict in verdicts]]
    if options.report:
        markdown.write(options.report, *blocks)
    if options.json:
        write_json(options.json, rows)
    return 0 if holds else 1


if __name__ == "__main__":
    sys.exit(main())

"""PySPH's own options, as our scenes inherit them: those that work, and those that are refused, each with the reason.

An option that is refused is gone from ``--help``. The page ``docs/options.md`` is this table.
"""
import argparse
import re

from pysph_boiling.names import nearest

__all__ = ["KERNELS", "REFUSED", "SEARCHES", "WORKS", "asks_for_ours", "settle", "table"]

# Our search, and PySPH's that find the neighbours that its linked lists find: positions and enthalpies equal to
# round-off (1.4e-14) after 20 steps of a dam break and of a heated slab.
SEARCHES = ("sorted", "ll", "box", "sh", "esh", "ci", "comp_tree", "strat_hash", "tree")
UNSORTED = ("sh", "esh", "strat_hash")  # which know no spatial order
BAD_SEARCHES = {
    "sfc": "gives wrong neighbours where they are cached, as they are here",
    "strat_sfc": "misses neighbours: no heat flows, and a dam break is 35 % off",
    "gpu_octree": "has not been tried: a device has a search of its own",
}
NEGATIVE = re.compile(r"-\.?\d")  # begins a value; argparse's own takes -1e9 and -1,0,0 for options
LEVELS = ("debug", "info", "warning", "error", "critical", "none")
KERNELS = ("CubicSpline", "WendlandQuintic")

SEARCH = "neighbour searches are used as they were checked, with PySPH's settings"
RANKS = "has not been tried with the boxes that ranks have here"
STEP = "a scene has a fixed time step, which is split where particles would move too far: give --timestep or --substeps"
WATCH = "watch a run by its results.npz and particle files, stop it with Ctrl-C, and go on with --resume"

WORKS = {
    "--help": "",
    "--openmp": "the default of `pysph-boiling run` on Linux with more than one core; contradicts `--no-openmp`",
    "--no-openmp": "one thread",
    "--omp-schedule": "`static`, `dynamic` or `guided`, a comma and a chunk",
    "--opencl": "see [backends.md](backends.md); contradicts `--cuda`",
    "--cuda": "see [backends.md](backends.md)",
    "--use-double": "double precision on a device; the host has no other",
    "--profile": "seconds by part of the step, at the end and in `profile_info.csv`",
    "--loglevel": "of the log file: debug, info, warning, error, critical, none",
    "--logfile": "name of the log file; none if it is empty",
    "--print-log": "the log on stderr too",
    "--quiet": "no header, progress and closing lines; warnings and errors are said",
    "--tf": "the same as `--duration` [s]",
    "--timestep": "[s], instead of `--substeps`",
    "--max-steps": "at most so many steps, counted from the first start; a run that it ends makes no final check",
    "--no-adaptive-timestep": "what a scene does anyway",
    "--disable-output": "no particle files, results and pictures; the final check works from memory",
    "--fname": "particle files, log and info file bear this name",
    "--directory": "the output folder",
    "--pfreq": "steps between two particle files, instead of a frame",
    "--detailed-output": "every property in the particle files; a run goes on from them all the same",
    "--compress-output": "smaller particle files",
    "--reorder-freq": "steps between two spatial sorts of particles; 10 if not given, with our search; equal to "
                      "round-off",
    "--kernel": " or ".join(KERNELS),
    "--restart-file": "go on from this particle file (see also our `--resume`)",
    "--nnps": ", ".join(SEARCHES) + ": equal to round-off; the first is ours ([search.md](search.md)); a device has "
              "its own",
    "--fixed-h": "what a scene does anyway",
    "--cache-nnps": "what a scene does anyway",
    "--sort-gids": "neighbours in the order of their numbers; equal to round-off",
    "--with-zoltan": "what ranks do anyway",
    "--zoltan-lb-method": "RCB (default), RIB or HSFC, on several ranks (see [ranks.md](ranks.md))",
    "--lb-freq": "steps between two balancings, on several ranks",
}

REFUSED = {
    "--backend": "choose it with --openmp, --no-openmp, --opencl or --cuda",
    "--suppress-warnings": "nothing here warns of what it silences; --loglevel sets what is logged",
    "--n-damp": "a start is settled before the first step and needs no short steps",
    "--adaptive-timestep": STEP,
    "--cfl": STEP,
    "--output-dump-remote": "copies that ranks have of each other's particles are not for files: no run could go on "
                            "from them",
    "--use-local-memory": "it has not been tried",
    "--post-process": "pysph-boiling render DIRECTORY draws a run again",
    "--rescale-dt": "give --timestep or --substeps",
    "--spatial-hash-sub-factor": SEARCH,
    "--approximate-nnps": "neighbours that are missed break the balance of energy and momentum",
    "--spatial-hash-table-size": SEARCH,
    "--stratified-grid-num-levels": SEARCH,
    "--tree-leaf-max-particles": SEARCH,
    "--rcb-lock": RANKS,
    "--rcb-reuse": RANKS,
    "--rcb-rectilinear": RANKS,
    "--rcb-set-direction": RANKS,
    "--zoltan-weights": RANKS,
    "--ghost-layers": "one layer is what a step needs and refreshes",
    "--zoltan-debug-level": RANKS,
    "--update-cell-sizes": "smoothing lengths are fixed, and cells with them",
    "--parallel-scale-factor": "one layer of cells, as wide as the support, is what a step needs and refreshes",
    "--parallel-output-mode": "all ranks write one file together",
    "--interactive": f"it changes a run between two steps, of which results and run.json know nothing: {WATCH}",
    "--xml-rpc": f"it lets anyone on the network command the run, without a key: {WATCH}",
    "--multiproc": f"it listens on the network with a key that everyone knows, and runs what it is sent: {WATCH}",
    "--octree-leaf-size": SEARCH,
    "--octree-elementwise-nnps": SEARCH,
}


class Refused(argparse.Action):
    """An option that ends the run with the reason, whatever follows it."""

    def __init__(self, option_strings, dest, *, reason, **keywords):
        super().__init__(option_strings, dest, nargs="?", help=argparse.SUPPRESS, **keywords)
        self.reason = reason

    def __call__(self, parser, namespace, values, option_string=None):
        raise ValueError(f"{self.option_strings[-1]} is not for our scenes: {self.reason}")


def one_of(known, bad=()):
    """A type of ``argparse`` that takes the ``known`` names, and says why not for those of ``bad``."""
    def chosen(name):
        if name not in known:
            why = f"'{name}' {bad[name]}; there are" if name in bad else f"'{name}' is not one of"
            raise argparse.ArgumentTypeError(f"{why} {', '.join(known)}{nearest(name, known)}")
        return name

    return chosen


def schedule(text):
    """A type of ``argparse``: a schedule of OpenMP, such as ``dynamic,64``."""
    kind, _, chunk = text.partition(",")
    if kind not in ("static", "dynamic", "guided") or not chunk.isdecimal() or int(chunk) < 1:
        raise argparse.ArgumentTypeError("static, dynamic or guided, a comma and a whole number >= 1 are asked for, as "
                                         f"in dynamic,64; got '{text}'")
    return text


def settle(parser, also=None):
    """Take away from PySPH's ``parser`` what is refused (``also``: more of it), and choices that give wrong results."""
    parser._negative_number_matcher = NEGATIVE
    inherited = parser._option_string_actions
    ours = parser.add_argument_group("Kernel, search and threads", conflict_handler="resolve")
    for flag, reason in {**REFUSED, **(also or {})}.items():
        old = inherited[flag]
        ours.add_argument(*old.option_strings, action=Refused, dest=old.dest, default=old.default, reason=reason)
    ours.add_argument("--nnps", default=SEARCHES[0], type=one_of(SEARCHES, BAD_SEARCHES), metavar="SEARCH",
                      help=f"neighbour search: {', '.join(SEARCHES)}")
    ours.add_argument("--kernel", default=None, type=one_of(KERNELS), help=" or ".join(KERNELS))
    ours.add_argument("--omp-schedule", dest="omp_schedule", default="dynamic,64", type=schedule, metavar="KIND,CHUNK",
                      help="how threads share a loop: static, dynamic or guided, a comma, iterations at a time")


def asks_for_ours(options):
    """Whether ``--nnps`` names our neighbour search, as it does by default."""
    return options.nnps == SEARCHES[0]


def check(options):
    """Raise ``ValueError`` for options that contradict each other or lie outside their range."""
    for bad, text in (
        (options.openmp and options.with_openmp is False, "--openmp and --no-openmp contradict each other"),
        (options.with_opencl and options.with_cuda, "--opencl and --cuda contradict each other"),
        ((options.with_opencl or options.with_cuda) and not asks_for_ours(options),
         f"--nnps {options.nnps} is for the host: a device has its own search"),
        (options.max_steps < 1, f"--max-steps must be >= 1 step, got {options.max_steps}"),
        (options.lb_freq < 1, f"--lb-freq must be >= 1 step, got {options.lb_freq}"),
        (options.freq is not None and options.freq < 1, f"--pfreq must be >= 1 step, got {options.freq}"),
        (options.reorder_freq is not None and options.reorder_freq < 1,
         f"--reorder-freq must be >= 1 step, got {options.reorder_freq}"),
        (options.reorder_freq is not None and options.nnps in UNSORTED,
         f"--reorder-freq: the search '{options.nnps}' knows no order to sort particles in; take another --nnps"),
        (options.fname in ("", ".", "..") or "/" in options.fname,
         f"--fname must be a name without a folder, got '{options.fname}': the folder is --directory"),
        (options.loglevel not in LEVELS, f"--loglevel must be one of {', '.join(LEVELS)}; got {options.loglevel!r}"),
    ):
        if bad:
            raise ValueError(text)



def table():
    """The page in Markdown."""
    rows = [f"| `{flag}` | {text} |" for flag, text in WORKS.items() if text]
    refused = [f"| `{flag}` | {text} |" for flag, text in REFUSED.items()]
    return "\n".join([
        "# PySPH's own options", "",
        "Every scene is a PySPH application and inherits its options. Those below work; the others are refused, with",
        "the reason, and are gone from `--help`. The tables are those of `pysph_boiling/runs/pysph_options.py`; a test",
        "compares them with PySPH's parser. Options of the scene and its effects are our own:",
        "`pysph-boiling run SCENE --help`.",
        "",
        "| works | |", "|---|---|", *rows, "", "| refused | why |", "|---|---|", *refused, ""])

"""PySPH's own options, which our scenes inherit: those that work, and those that are refused with the reason.

Refused options do not appear in ``--help``. :func:`table` makes the page ``docs/options.md``, and a test compares both.
"""
import argparse
import re
from itertools import pairwise

from pysph_boiling.names import Refused, nearest
from pysph_boiling.runs.scene_help import SceneParser

__all__ = ["KERNELS", "REFUSED", "SEARCHES", "WORKS", "asks_for_ours", "check_switches", "settle", "table"]

# Our search, and those of PySPH that find the same neighbours as its linked lists: positions and enthalpies are equal
# to round-off (1.4e-14) after 20 steps of a dam break and of a heated slab.
SEARCHES = ("sorted", "ll", "box", "sh", "esh", "ci", "comp_tree", "strat_hash", "tree")
UNSORTED = ("sh", "esh", "strat_hash")  # these cannot sort particles in space
BAD_SEARCHES = {
    "sfc": "gives wrong neighbours when they are cached, as they are here",
    "strat_sfc": "misses neighbours: no heat flows, and a dam break is 35 % off",
    "gpu_octree": "has not been tested, since a device uses a different search",
}
NEGATIVE = re.compile(r"-\.?\d")  # begins a value; argparse itself would take -1e9 and -1,0,0 for options
LEVELS = ("debug", "info", "warning", "error", "critical", "none")
KERNELS = ("CubicSpline", "WendlandQuintic")

SEARCH = "neighbour searches are used with PySPH's default settings, with which they were checked"
RANKS = "it has not been tested with our domain decomposition on ranks"
STEP = ("a scene has a fixed time step, and a step is split where particles would move too far in it: give --timestep "
        "or --substeps")
WATCH = ("to watch a run, use pysph-boiling view DIRECTORY --live, which only this machine can reach; stop it with "
         "Ctrl-C, and continue it with --resume")

WORKS = {
    "--help": "",
    "--openmp": "Runs on several threads. `pysph-boiling run` does this by default on Linux with more than one core. "
                "Contradicts `--no-openmp`.",
    "--no-openmp": "Runs on one thread.",
    "--omp-schedule": "How threads share a loop: `static`, `dynamic` or `guided`, a comma, and the number of "
                      "iterations that a thread takes at a time.",
    "--opencl": "Runs on an OpenCL device ([backends.md](backends.md)). Contradicts `--cuda`.",
    "--cuda": "Runs on a CUDA device ([backends.md](backends.md)).",
    "--use-double": "Double precision on a device. The host always computes in double precision.",
    "--profile": "Prints the seconds that each part of a step took, at the end, and writes them to `profile_info.csv`.",
    "--loglevel": "Level of the log file: debug, info, warning, error, critical or none.",
    "--logfile": "Name of the log file. If it is empty, no log is written.",
    "--print-log": "Prints the log on stderr, too.",
    "--quiet": "Prints no header, progress and closing lines. Warnings and errors are still printed.",
    "--tf": "Simulated time [s]; the same as `--duration`.",
    "--timestep": "Time step [s], in place of `--substeps`.",
    "--max-steps": "Ends the run after this many steps, counted from its first start. A run that ends in this way "
                   "makes no final check.",
    "--no-adaptive-timestep": "Changes nothing: the time step of a scene is always fixed.",
    "--disable-output": "Writes no particle files, results or pictures. The final check uses the data in memory.",
    "--fname": "Name of the particle files, the log file and the info file.",
    "--directory": "The output folder.",
    "--pfreq": "Steps between two particle files, in place of the time between two frames.",
    "--detailed-output": "Writes every property to the particle files. A run can be resumed from them as from any "
                         "others.",
    "--compress-output": "Compresses the particle files.",
    "--reorder-freq": "Steps between two spatial sorts of the particles in memory; 10 by default with our search. "
                      "Results are equal to round-off.",
    "--kernel": f"{' or '.join(KERNELS)}.",
    "--restart-file": "Continues from this particle file (see also our `--resume`).",
    "--post-process": "Runs nothing: makes the final check and the pictures of an earlier run again, from its files. "
                      "Its value is the folder of that run, or the `.info` file in it. Our scenes do this in the "
                      "method `post_process`, which a scene of your own may override.",
    "--nnps": f"Neighbour search: {', '.join(SEARCHES)}. The first is the default, and ours ([search.md](search.md)). "
              "Results are equal to round-off. A device has a search of its own.",
    "--fixed-h": "Changes nothing: smoothing lengths are always fixed.",
    "--cache-nnps": "Changes nothing: neighbour lists are always cached.",
    "--sort-gids": "Sorts each neighbour list by the global numbers of the particles. Results are equal to round-off.",
    "--with-zoltan": "Changes nothing: several ranks always use Zoltan.",
    "--zoltan-lb-method": "Load balancing on several ranks: RCB (default), RIB or HSFC ([ranks.md](ranks.md)).",
    "--lb-freq": "Steps between two load balancings on several ranks.",
}

REFUSED = {
    "--backend": "choose the backend with --openmp, --no-openmp, --opencl or --cuda",
    "--suppress-warnings": "our scenes do not print the warnings that it silences; --loglevel sets what is logged",
    "--n-damp": "the start is settled before the first step, so that no short first steps are needed",
    "--adaptive-timestep": STEP,
    "--cfl": STEP,
    "--output-dump-remote": "a run could not be resumed from files that contain ghosts, the copies of other ranks' "
                            "particles",
    "--use-local-memory": "it has not been tested",
    "--rescale-dt": "give --timestep or --substeps",
    "--spatial-hash-sub-factor": SEARCH,
    "--approximate-nnps": "missing neighbours would break the conservation of energy and momentum",
    "--spatial-hash-table-size": SEARCH,
    "--stratified-grid-num-levels": SEARCH,
    "--tree-leaf-max-particles": SEARCH,
    "--rcb-lock": RANKS,
    "--rcb-reuse": RANKS,
    "--rcb-rectilinear": RANKS,
    "--rcb-set-direction": RANKS,
    "--zoltan-weights": RANKS,
    "--ghost-layers": "a step needs and refreshes exactly one layer of ghosts",
    "--zoltan-debug-level": RANKS,
    "--update-cell-sizes": "smoothing lengths are fixed, and so are the cells of the neighbour search",
    "--parallel-scale-factor": "a step needs and refreshes exactly one layer of cells, as wide as the kernel support",
    "--parallel-output-mode": "all ranks together write one file",
    "--interactive": f"it changes a run between two steps, which results.npz and run.json would not record; {WATCH}",
    "--xml-rpc": f"it lets anyone on the network control the run, without a key; {WATCH}",
    "--multiproc": "unless told otherwise, it listens on all networks of this machine with a key that everyone knows, "
                   "as it stands in PySPH's source, and it unpickles what it receives, by which a sender can execute "
                   f"any code; {WATCH}",
    "--octree-leaf-size": SEARCH,
    "--octree-elementwise-nnps": SEARCH,
}


def one_of(known, bad=()):
    """An argparse type that accepts the ``known`` names; for a name in ``bad`` the error gives the reason."""
    def chosen(name):
        if name not in known:
            why = f"'{name}' {bad[name]}; use one of" if name in bad else f"'{name}' is not one of"
            raise argparse.ArgumentTypeError(f"{why} {', '.join(known)}{nearest(name, known)}")
        return name

    return chosen


def schedule(text):
    """An argparse type for a schedule of OpenMP, such as ``dynamic,64``."""
    kind, _, chunk = text.partition(",")
    if kind not in ("static", "dynamic", "guided") or not chunk.isdecimal() or int(chunk) < 1:
        raise argparse.ArgumentTypeError("it must be static, dynamic or guided, a comma and a whole number >= 1, such "
                                         f"as dynamic,64; got '{text}'")
    return text


def settle(parser, scheme, also=None):
    """Remove refused options (those in ``also`` too) and choices with wrong results from PySPH's ``parser``.

    Its help becomes that of :class:`SceneParser`, with the effects of ``scheme``.
    """
    parser._negative_number_matcher = NEGATIVE
    inherited = parser._option_string_actions
    ours = parser.add_argument_group("Kernel, search and threads", conflict_handler="resolve")
    for flag, reason in {**REFUSED, **(also or {})}.items():
        old = inherited[flag]
        ours.add_argument(*old.option_strings, action=Refused, dest=old.dest, default=old.default,
                          reason=f"is not available in these scenes: {reason}")
    ours.add_argument("--nnps", default=SEARCHES[0], type=one_of(SEARCHES, BAD_SEARCHES), metavar="SEARCH",
                      help=f"neighbour search: {', '.join(SEARCHES)}")
    ours.add_argument("--kernel", default=None, type=one_of(KERNELS), help=" or ".join(KERNELS))
    ours.add_argument("--omp-schedule", dest="omp_schedule", default="dynamic,64", type=schedule, metavar="KIND,CHUNK",
                      help="how threads share a loop: static, dynamic or guided, a comma, and the chunk size")
    parser.description = "Run one scene. docs/ranks.md says how to run it on several MPI ranks."
    parser.__class__ = SceneParser
    parser.take_over(WORKS, scheme)
    for flag, text in WORKS.items():
        if text and flag not in (also or {}):
            inherited[flag].help = help_text(text)


def check_switches(parser, arguments):
    """End the command if an option that takes no value is given one, as in ``--cohesion 3``.

    The message names the options of the effect's parameters if the option is the switch of an effect.
    """
    known = parser._option_string_actions
    for given, following in pairwise([*arguments, "--"]):
        flag, equals, value = given.partition("=")
        if not equals and (not following.startswith("-") or NEGATIVE.match(following)):
            equals, value = "=", following
        if equals and flag in known and known[flag].nargs == 0:
            parameters = [name for name, action in known.items() if name.startswith(f"{flag}.")
                          and not isinstance(action, Refused)]
            parser.error(f"{flag} takes no value, got '{value}'" + (
                f": it switches an effect on, whose parameters are {', '.join(parameters)}" if parameters else ""))


def help_text(text):
    """A text of :data:`WORKS` without Markdown, for ``--help``."""
    return re.sub(r"\[(\S+?)\]\(\S+?\)", r"docs/\1", text).replace("`", "").replace("%", "%%")


def asks_for_ours(options):
    """Whether ``--nnps`` names our neighbour search, as it does by default."""
    return options.nnps == SEARCHES[0]


def check(options):
    """Raise ``ValueError`` for options that contradict each other or lie outside their range."""
    for bad, text in (
        (options.openmp and options.with_openmp is False, "--openmp and --no-openmp contradict each other"),
        (options.with_opencl and options.with_cuda, "--opencl and --cuda contradict each other"),
        ((options.with_opencl or options.with_cuda) and not asks_for_ours(options),
         f"--nnps {options.nnps} only works on the host: a device has its own search"),
        (options.max_steps < 1, f"--max-steps must be >= 1 step, got {options.max_steps}"),
        (options.lb_freq < 1, f"--lb-freq must be >= 1 step, got {options.lb_freq}"),
        (options.freq is not None and options.freq < 1, f"--pfreq must be >= 1 step, got {options.freq}"),
        (options.reorder_freq is not None and options.reorder_freq < 1,
         f"--reorder-freq must be >= 1 step, got {options.reorder_freq}"),
        (options.reorder_freq is not None and options.nnps in UNSORTED,
         f"--reorder-freq: the search '{options.nnps}' cannot sort particles in space; choose another --nnps"),
        (options.fname in ("", ".", "..") or "/" in options.fname,
         f"--fname must be a name without a folder, got '{options.fname}': the folder is --directory"),
        (options.loglevel not in LEVELS, f"--loglevel must be one of {', '.join(LEVELS)}; got {options.loglevel!r}"),
    ):
        if bad:
            raise ValueError(text)


def table():
    """The page ``docs/options.md`` in Markdown."""
    rows = [f"| `{flag}` | {text} |" for flag, text in WORKS.items() if text]
    refused = [f"| `{flag}` | {text} |" for flag, text in REFUSED.items()]
    return "\n".join([
        "# PySPH's own options", "",
        "Every scene is a PySPH application and inherits PySPH's command-line options. This page lists those that",
        "work, and those that are refused with the reason. Refused options do not appear in `--help pysph`. The",
        "options of the scene and of its effects are our own: `pysph-boiling run SCENE --help` shows the main ones,",
        "`--help scene`, `--help effects` and `--help NAME` (of an effect) all others, with units, defaults, bounds.",
        "", "The tables are those of `pysph_boiling/runs/pysph_options.py`; a test compares them with PySPH's parser.",
        "", "| works | what it does |", "|---|---|", *rows,
        "", "| refused | why |", "|---|---|", *refused, ""])

"""The command ``pysph-boiling``: list and run the example scenes."""
import dataclasses
import os
import sys
import time
import traceback
import warnings
from functools import partial

from pysph_boiling.checks import CheckFailed
from pysph_boiling.examples import picture_of, said_of, scene_class, scenes
from pysph_boiling.names import Parser, as_typed, nearest
from pysph_boiling.threads import wait_briefly

__all__ = ["main"]


def openmp_arguments(arguments, ranks=1):
    """``--openmp`` on Linux, unless a backend was chosen, there is only one core, or several ranks share the cores.

    On other systems the compiler may not support OpenMP, so the user has to ask for it.
    """
    chosen = {"--openmp", "--no-openmp", "--opencl", "--cuda"} & set(arguments)
    useful = sys.platform.startswith("linux") and (os.cpu_count() or 1) > 1 and ranks == 1
    return ["--openmp"] if useful and not chosen else []


def list_scenes(arguments):
    """Print of every scene what it shows, how large it is, about how long it takes, and the path of its picture."""
    from rich.console import Console
    from rich.table import Table

    Parser(prog="pysph-boiling list", description="List the scenes.").parse_args(arguments)
    table, pictures = Table("scene", "what it shows, how long it takes, and its picture", show_lines=True), False
    for name in scenes():
        picture = picture_of(name)
        pictures = pictures or picture is not None
        table.add_row(name, "\n".join([*said_of(name), *([os.path.relpath(picture)] if picture else [])]))
    console = Console()
    console.print(table)
    console.print("Times are estimates for two cores; machines and boils differ by up to a factor of three.")
    if not pictures:
        console.print("Pictures of the scenes are in the folder docs/pictures of the repository.")


def render(arguments):
    """Draw the pictures of a finished run again, make a movie of them, or write files for ParaView, Blender, Houdini.
    """
    from rich.progress import track

    from pysph_boiling.analysis.film import MESHES, blender_script, write_meshes, write_usd
    from pysph_boiling.analysis.movie import KINDS, check_movie, write_movie
    from pysph_boiling.analysis.rendering import contact_sheet, render_run, write_paraview
    from pysph_boiling.analysis.surface import CAMERAS
    from pysph_boiling.files import Manifest

    parser = Parser(prog="pysph-boiling render")
    parser.add_argument("directory", help="output folder of a run")
    parser.add_argument("--colour", default=None, help="phase, temperature, bubble, speed or density; "
                        "in the surface view: bubble")
    parser.add_argument("--view", default=None, choices=("slice", "3d", "surface"),
                        help="slice (default), 3d, or surface: clear water in which light is traced, which is for 3-D "
                             "only and needs pip install 'pysph_boiling[view]'")
    parser.add_argument("--camera", default=None, help=f"surface view: {', '.join(CAMERAS)}, or "
                        "AZIMUTH,ELEVATION[,ZOOM] in degrees; default corner")
    parser.add_argument("--size", default=None, metavar="WIDTHxHEIGHT",
                        help="surface view: size of the pictures in pixels; default 1280x960")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="draw every N-th output only")
    made = parser.add_mutually_exclusive_group()
    made.add_argument("--movie", default=None, choices=KINDS, help="also make a movie of the pictures")
    made.add_argument("--paraview", action="store_true", help="write VTK files for ParaView instead of pictures")
    made.add_argument("--mesh", default=None, choices=MESHES,
                      help="write closed meshes of water and bubbles instead of pictures, 3-D only, which needs pip "
                           "install 'pysph_boiling[film]': ply has the velocity and the bubble's label at each point; "
                           "obj cannot, it has a group for each bubble (docs/film.md)")
    made.add_argument("--usd", action="store_true",
                      help="write the same meshes, with velocities and labels, as one USD file for the whole run")
    parser.add_argument("--fps", type=float, default=15.0, help="frames per second of the movie; default 15")
    parser.add_argument("--limit", type=float, default=None, metavar="MB",
                        help="largest size of the movie, for which its quality is lowered; no limit if not given")
    options = parser.parse_args(arguments)
    if options.every < 1:
        raise ValueError(f"--every must be 1 or more, got {options.every}")
    if options.view != "surface" and (options.camera or options.size):
        raise ValueError("--camera and --size are for the surface view: add --view surface")
    surface = {name: value for name, value in (("camera", options.camera), ("size", picture_size(options.size)))
               if value is not None}
    if options.movie:
        check_movie(options.movie, options.fps, options.limit)
    folder = options.directory
    if options.paraview:
        made = write_paraview(folder, every=options.every, track=partial(track, description="writing"))
        print(f"ParaView files: open {', '.join(map(str, made))}")
        return
    if options.mesh:
        made = write_meshes(folder, options.mesh, every=options.every, track=partial(track, description="writing"))
        print(f"meshes: {made.parent}, with the time of each frame in {made.name}")
        if options.mesh == "ply":
            print(f"in Blender: blender --python {blender_script()} -- {made.parent}")
        return
    if options.usd:
        print(f"USD: {write_usd(folder, every=options.every, track=partial(track, description='writing'))}")
        return
    frames = render_run(folder, colour=options.colour, view=options.view, every=options.every, **surface,
                        track=partial(track, description="drawing"))
    Manifest(folder).claim("frames.png", *([f"movie.{options.movie}"] if options.movie else []))
    contact_sheet(frames, os.path.join(folder, "frames.png"))
    print(f"wrote {len(frames)} pictures to {os.path.join(folder, 'frames')}, and an overview to frames.png")
    if options.movie:
        path = os.path.join(folder, f"movie.{options.movie}")
        print(f"movie: {write_movie(frames, path, fps=options.fps, limit=options.limit)}")


def view(arguments):
    """Show a run in the browser: particles and surfaces, a slider for the time. The page is for this machine only."""
    from pysph_boiling.analysis.rendering import COLOURS
    from pysph_boiling.analysis.viewer import Viewer

    parser = Parser(prog="pysph-boiling view", description=view.__doc__)
    parser.add_argument("directory", help="output folder of a run")
    parser.add_argument("--live", action="store_true", help="follow a run that is still being written")
    parser.add_argument("--colour", default=None, choices=COLOURS, help="colour at the start; default phase")
    parser.add_argument("--port", type=int, default=8080, help="port of the page, or the next free one; default 8080")
    options = parser.parse_args(arguments)
    if not 1 <= options.port <= 65535:
        raise ValueError(f"--port must be 1 to 65535, got {options.port}")
    viewer = Viewer(options.directory, live=options.live, port=options.port, colour=options.colour)
    print(f"open {viewer.address} in a browser on this machine; Ctrl-C ends", flush=True)
    viewer.run()


def picture_size(text):
    """(width, height) in pixels from "WIDTHxHEIGHT", or ``None`` from ``None``; raises ``ValueError``."""
    if text is None:
        return None
    width, _, height = text.partition("x")
    if not (width.isdecimal() and height.isdecimal() and min(int(width), int(height)) >= 16):
        raise ValueError(f"--size must be WIDTHxHEIGHT in pixels, at least 16x16, got {text!r}")
    return int(width), int(height)


def run(arguments):
    """Run one scene; all further arguments are options of the scene."""
    if not arguments or arguments[0].startswith("-"):
        raise ValueError(f"name a scene, one of: {', '.join(scenes())}")
    name, rest = arguments[0], arguments[1:]
    from pysph_boiling.runs.application import SceneApplication
    from pysph_boiling.schemes.cache import checked

    app = file_scene(name) if name.endswith(".toml") else scene_class(name)()
    if app.num_procs > 1 and not isinstance(app, SceneApplication):
        raise ValueError(f"{name} uses a scheme of PySPH, which we do not run on several MPI ranks: run it on one")
    app.arg_parse.prog = f"pysph-boiling run {name}"
    with checked():
        app.run(openmp_arguments(rest, app.num_procs) + rest)


def file_scene(path):
    """The application of the scene in a TOML file."""
    from pysph_boiling.runs.application import SceneApplication
    from pysph_boiling.runs.described import DescribedScene
    from pysph_boiling.runs.scene_file import SceneFileError, read_scene

    def application(scene):
        cls = DescribedScene if scene is None else scene_class(scene)
        if not issubclass(cls, SceneApplication):
            raise SceneFileError(f"{path}: {scene} uses a scheme of PySPH, and cannot be started from a file")
        return cls

    file = read_scene(path, lambda scene: [spec.name for spec in dataclasses.fields(application(scene).Parameters)])
    return application(file.scene)(file=file)


def bubbles(arguments):
    """Measure how finished runs boil."""
    from pysph_boiling.evaluation.bubbles import bubbles as command

    command(arguments)


def reproduce(arguments):
    """Reproduce figures and tables of the paper."""
    from pysph_boiling.evaluation.reproduce.command import reproduce as command

    command(arguments)


def sweep(arguments):
    """Run a scene over ranges of its parameters."""
    from pysph_boiling.evaluation.sweep import sweep as command

    command(arguments)


def accuracy(arguments):
    """Measure how much computing time a given accuracy takes."""
    from pysph_boiling.evaluation.accuracy.command import accuracy as command

    command(arguments)


def validate(arguments):
    """Compare the model with formulas, with experiments, and with statistics stored by an earlier version."""
    from pysph_boiling.evaluation.validate import validate as command

    command(arguments)


def stress(arguments):
    """Run difficult cases and judge whether they stay stable."""
    from pysph_boiling.evaluation.stress.command import stress as command

    command(arguments)


USAGE = """usage: pysph-boiling COMMAND [options]

  list                 list the scenes
  run SCENE [options]  run a scene, or one in a TOML file (pysph-boiling run SCENE --help lists its options)
  render DIR           draw the pictures of a run again, make a movie, or export to ParaView, Blender or USD
  view DIR [--live]    show a run in the browser, or follow one that is being written
  bubbles DIR          say when and where bubbles depart in runs, how large they are and how they look
  sweep SCENE          run a scene over ranges of its parameters (--superheat 5:60:8 --seeds 3), as a table and pictures
  reproduce [FIGURE]   reproduce the paper's figures and tables, all or those named (--quick: small scenes)
  accuracy [STUDY]     measure what accuracy costs in computing time on this machine (--quick: small scenes)
  validate [CASE]      compare the model with formulas, experiments and stored statistics (--quick: coarse)
  stress [CASE]        run difficult cases and judge whether they stay stable (--quick: shorter runs)
  --version            print the version
"""


def main(argv=None):
    """Entry point; returns the exit status."""
    wait_briefly()
    warnings.filterwarnings("ignore", message="Creating a dataset without")  # PySPH's HDF5 writer, harmless
    arguments = list(sys.argv[1:] if argv is None else argv)
    command, rest = (arguments[0], arguments[1:]) if arguments else ("--help", [])
    commands = {"list": list_scenes, "run": run, "render": render, "view": view, "bubbles": bubbles, "sweep": sweep,
                "reproduce": reproduce, "accuracy": accuracy, "validate": validate, "stress": stress}
    if command == "--version":
        from pysph_boiling import __version__

        print(__version__)
        return 0
    if command in ("--help", "-h"):
        print(USAGE, end="")
        return 0
    if command not in commands:
        print(f"pysph-boiling: no command '{command}'{nearest(command, commands)}\n{USAGE}", end="", file=sys.stderr)
        return 2
    try:
        commands[command](rest)
    except KeyboardInterrupt as error:
        from pysph_boiling.parallel import ranks

        if ranks.rank() == 0:
            print(f"pysph-boiling: {error if error.args else 'interrupted'}", file=sys.stderr, flush=True)
        return 130  # the shell's convention: 128 + SIGINT
    except Exception as error:
        return report(error)
    return 0


def report(error):
    """Print what went wrong and return the exit status; raise the error again if it is a bug in this package.

    On several ranks the others may not know of the error and would wait for this one forever, so all are ended.
    """
    from pysph_boiling.parallel import ranks

    message, status = explain(error)
    if message is None and ranks.size() == 1:
        raise error
    if ranks.rank() > 0:
        time.sleep(1.0)  # if all ranks found the error, the first one reports it and ends them in this time
    text = f"pysph-boiling: {message}" if message else "".join(traceback.format_exception(error))
    print(text if ranks.size() == 1 else f"rank {ranks.rank()}: {text}", file=sys.stderr, flush=True)
    if ranks.size() > 1:
        ranks.abort(status)
    return status


def explain(error):
    """(message, exit status) of an error that the user can act on; the message is ``None`` for all others."""
    if isinstance(error, ModuleNotFoundError):
        if error.name in ("pyopencl", "pycuda"):
            return f"this backend needs the package '{error.name}', which is not installed", 2
        if error.name == "pysph.parallel.parallel_manager":
            return ("mpi4py and pyzoltan are installed, but PySPH's parallel manager is not built, and PySPH does not "
                    "start without it: run 'python tools/build_parallel_manager.py', or 'make setup-mpi'"), 2
        return (str(error), 2) if "pip install" in str(error) else (None, 1)
    if isinstance(error, ChildProcessError):
        return str(error), 1
    if isinstance(error, (ValueError, OSError)):
        from pysph_boiling.schemes.effects import EFFECTS

        return as_typed(error, EFFECTS), 2
    if isinstance(error, FloatingPointError):
        return str(error), 1
    if isinstance(error, ArithmeticError):
        return f"these parameters lead to numbers too large to represent ({error})", 2
    if isinstance(error, CheckFailed):
        return f"the final check failed: {error}", 1
    return None, 1

"""Pictures of finished runs for reports: sheets of moments, rendered moments, movies, and plots in one style."""
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from pysph_boiling.analysis.plots import DPI, STYLE
from pysph_boiling.analysis.rendering import contact_sheet, draw_scene, render_run
from pysph_boiling.report.sections import Picture

__all__ = ["band", "movie", "plot", "rendered", "sheet"]


def sheet(cells, path, caption, *, columns=None, **options):
    """Draw several moments into one PNG; returns the :class:`Picture`.

    ``cells`` is a list of (result, time [s], title); ``options`` are passed to
    :func:`~pysph_boiling.analysis.rendering.draw_scene`.
    """
    path = Path(path)
    with TemporaryDirectory() as folder:
        frames = []
        for number, (result, t, title) in enumerate(cells):
            particles = result.particles(t)
            frames.append(draw_scene(particles, Path(folder) / f"{number}.png", dim=result.dim, t=particles.time,
                                     spacing=result.spacing, title=title, **options))
        contact_sheet(frames, path, columns=columns or min(3, len(frames)), count=len(frames))
    return Picture(path.name, caption)


def rendered(result, t, path, caption):
    """Draw a moment with its reconstructed surface (3-D); returns the :class:`Picture`."""
    from pysph_boiling.analysis.surface import draw_surface

    particles = result.particles(t)
    draw_surface(particles, path, dim=result.dim, spacing=result.spacing, t=particles.time)
    return Picture(Path(path).name, caption)


def movie(result, path, caption, *, fps=15, **options):
    """Make a movie of a run, GIF or MP4 by the suffix of ``path``; returns the :class:`Picture`."""
    from pysph_boiling.analysis.movie import write_movie

    with TemporaryDirectory() as folder:
        frames = render_run(result.folder, out=folder, **options)
        write_movie(frames, path, fps=fps)
    return Picture(Path(path).name, caption)


@contextmanager
def plot(path, width=6.4, height=3.6, columns=1):
    """Axes of a new figure in the style of the histories, which is saved at the end of the block::

        with plot(folder / "count.png") as ax: ax.plot(t, n)
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(STYLE):
        figure = Figure(figsize=(width, height), layout="constrained")
        axes = figure.subplots(1, columns, squeeze=False)[0]
        yield axes[0] if columns == 1 else axes
        figure.savefig(path, dpi=DPI)


def band(ax, results, column, label, colour, scale=1.0):
    """Draw the mean of a column over an ensemble of runs, and its range as a band."""
    t = results[0].results["t"]
    values = scale * np.array([np.interp(t, result.results["t"], result.results[column]) for result in results])
    ax.plot(t, values.mean(axis=0), color=colour, label=label)
    if len(values) > 1:
        ax.fill_between(t, values.min(axis=0), values.max(axis=0), color=colour, alpha=0.2, linewidth=0.0)

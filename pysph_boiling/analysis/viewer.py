"""A run in the browser: particles and surfaces, a slider for the time, colours by phase, temperature or bubble.

The page is served by viser, to this machine only. A run that is still being written can be followed.
"""
import threading
import time
from collections import OrderedDict
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from pysph_boiling.analysis.drawing import bubble_colours, by_role, have_all, is_vapour, positions, wall_colours
from pysph_boiling.analysis.rendering import COLOURS, NEEDS, SCALES, colour_limits, geometry, particle_colours
from pysph_boiling.extras import needed
from pysph_boiling.files import load_output, output_files

__all__ = ["HOST", "PARTS", "Outputs", "Viewer"]

HOST = "127.0.0.1"  # this machine alone; there is no option for another
KEPT = 4  # outputs in memory
PARTS = ("all", "half", "bubbles")  # which of the particles are shown
RATE = 12.0  # outputs per second when the run is played
LOOK = 1.0  # [s] between two looks at the folder of a run that is being written
WATER, OPACITY = (140, 199, 230), 0.35
UNREADABLE = (OSError, ValueError, KeyError, RuntimeError)  # what reading a file raises that is half written or gone


class Outputs:
    """The outputs of a run in ``folder``, of which at most ``KEPT`` are in memory.

    ``refresh`` looks for new files. The newest file may be half written, so it counts only once it can be read.
    """

    def __init__(self, folder):
        self.folder, self.files = Path(folder), []
        self.loaded = OrderedDict()
        self.refresh()

    def refresh(self):
        """Look at the folder again; returns whether there are other files than before."""
        before = self.files
        files = list(map(Path, output_files(self.folder))) if self.folder.is_dir() else []
        if files[-1:] != before[-1:]:
            while files and self._readable(files[-1]) is None:
                files.pop()
        self.files = files
        return files != before

    def _readable(self, file):
        try:
            return self._load(file)
        except UNREADABLE:
            return None

    def _load(self, file):
        """(time [s], arrays by role) of a file, from memory if it has not been written anew."""
        stamp = file.stat().st_mtime_ns
        if file not in self.loaded or self.loaded[file][0] != stamp:
            arrays, t = load_output(file)
            self.loaded[file] = stamp, (t, by_role(arrays), arrays)
        self.loaded.move_to_end(file)
        while len(self.loaded) > KEPT:
            self.loaded.popitem(last=False)
        return self.loaded[file][1]

    def __len__(self):
        return len(self.files)

    def __getitem__(self, number):
        """(time [s], arrays by role, name -> array) of an output, or ``None`` if its file is gone."""
        return self._readable(self.files[number])


class Viewer:
    """The page of a run at ``http://127.0.0.1:<port>``, and what it shows.

    ``colour`` is one of the colours of :func:`~.rendering.draw_scene`. With ``live`` the folder is looked at again each
    second, and the newest output is shown while the slider is at its end. Without, there must be outputs. If ``port``
    is taken, the next free one is used. Lengths on the page are in spacings, about the middle of the scene.

    Errors: ``ModuleNotFoundError`` without viser; ``FileNotFoundError`` if there is no output and not ``live``;
    ``ValueError`` for a colour that the fluid lacks.
    """

    def __init__(self, folder, *, live=False, port=8080, colour=None):
        viser = needed("viser", "watch")
        self.outputs, self.live = Outputs(folder), live
        if not len(self.outputs) and not live:
            raise FileNotFoundError(f"there are no particle files (HDF5) in {folder}; --live waits for them")
        self.known, self.limits, self.choice, self.looked, self.shown = None, {}, colour, 0.0, None
        self.lock = threading.RLock()  # viser calls from threads of its own
        if len(self.outputs):
            self._measure()
        self.server = viser.ViserServer(host=HOST, port=port, label="pysph_boiling", verbose=False)
        self.server.gui.configure_theme(show_share_button=False, show_logo=False)
        self.server.scene.set_up_direction("+z")
        self._controls()
        self._view()
        self.show()

    @property
    def address(self):
        """Address of the page."""
        return f"http://{HOST}:{self.server.get_port()}"

    def close(self):
        """Stop the server."""
        self.server.stop()

    # --- the run

    def _measure(self):
        """Read what does not change in time, and the ends of the colour scales so far."""
        self.known = geometry(self.outputs.folder, self.outputs.files)
        fluid = self.known.samples[-1].fluid
        self.colours = [name for name in COLOURS if have_all(fluid, *NEEDS[name])]
        if self.choice is not None and self.choice not in self.colours:
            raise ValueError(f"colour must be one of {', '.join(self.colours)} in this run, got {self.choice!r}")
        self.limits = {}
        for scene in self.known.samples:
            self._widen(scene)
        self.first = self.outputs.files[0]

    def _widen(self, scene):
        """Widen the colour scales to hold an output."""
        for name in self.colours if len(positions(scene.fluid)) else ():
            if name in SCALES:
                low, high = colour_limits(scene.fluid, name)
                old = self.limits.get(name, (low, high))
                self.limits[name] = min(low, old[0]), max(high, old[1])

    def _place(self, points):
        """Points (n, 3) [m] as they are on the page: in spacings, z up, about the middle of the scene."""
        at = (points - self.known.bounds.mean(axis=0)) / self.known.spacing
        return at[:, [0, 2, 1]] * [1.0, -1.0, 1.0] if self.known.dim == 2 else at

    # --- the page

    def _controls(self):
        gui, last = self.server.gui, max(len(self.outputs) - 1, 0)
        self.text = gui.add_markdown("")
        self.time = gui.add_slider("output", 0, max(last, 1), 1, last if self.live else 0)
        self.play = gui.add_checkbox("play", False)
        names = self.colours if self.known else list(COLOURS)
        self.colour = gui.add_dropdown("colour", names, initial_value=self.choice or (
            "phase" if "phase" in names else names[0]))
        self.part = gui.add_dropdown("particles", PARTS, initial_value=PARTS[0],
                                     hint="half: those behind the middle")
        self.walls = gui.add_checkbox("walls and sites", False)
        self.surfaces = None
        if self.known is None or self.known.dim == 3:
            try:
                for name in ("pysplashsurf", "manifold3d"):
                    needed(name, "film")
                self.surfaces = gui.add_checkbox("surfaces", False)
            except ModuleNotFoundError as error:
                gui.add_markdown(f"no surfaces: {error}")
        for control in (self.time, self.colour, self.part, self.walls, self.surfaces):
            if control is not None:
                control.on_update(lambda _: self.show())

    def _view(self):
        """Place the camera so that the whole scene is in its view."""
        if self.known is None:
            return
        size = float(np.linalg.norm(np.ptp(self.known.bounds, axis=0))) / self.known.spacing
        away = (0.0, -0.7, 0.02) if self.known.dim == 2 else (0.4, -0.75, 0.35)
        camera = self.server.initial_camera
        camera.far = max(1000.0, 20.0 * size)
        camera.look_at, camera.position = (0.0, 0.0, 0.0), tuple(size * x for x in away)
        for client in self.server.get_clients().values():
            client.camera.look_at, client.camera.position = camera.look_at, camera.position

    def show(self):
        """Show the output that the slider is at, as the controls say."""
        with self.lock:
            self._show()

    def _show(self):
        number = min(int(self.time.value), len(self.outputs) - 1)
        found = self.outputs[number] if number >= 0 else None
        if found is None or self.known is None:
            self.text.content = "**waiting** for outputs" if number < 0 else f"output {number} cannot be read"
            return
        t, scene, arrays = found
        state = (self.outputs.files[number], t, self.limits.copy(), *(
            control.value for control in (self.colour, self.part, self.walls, self.surfaces) if control is not None))
        if self.shown is not None and self.shown.state == state:
            return
        points, vapour = positions(scene.fluid), is_vapour(scene.fluid)
        shown = np.all(np.isfinite(points), axis=1)
        if self.part.value == "bubbles":
            shown &= vapour
        elif self.part.value == "half":
            shown &= self._behind(points)
        colour = self.colour.value
        rgb = particle_colours(scene.fluid, colour, self.limits.get(colour)) if len(points) else np.empty((0, 3))
        with self.server.atomic():
            self._points("/fluid", points[shown], rgb[shown])
            walls, sites = (group if self.walls.value else [] for group in (scene.walls, scene.sites))
            solid, tint = positions(walls), wall_colours(walls)[0] if walls else np.empty((0, 3))
            self._points("/walls", solid[self._behind(solid)], tint[self._behind(solid)])
            places = positions(sites)[self._behind(positions(sites))]
            self._points("/sites", places, np.zeros((len(places), 3)))
            self._meshes(arrays)
        text = f"**t = {t:.3f} s**, {len(points):,} particles of the fluid, {int(vapour.sum()):,} of vapour"
        if colour in self.limits:
            text += "; {} from {:.4g} to {:.4g}".format(SCALES[colour][0], *self.limits[colour])
        self.text.content = text
        self.shown = SimpleNamespace(state=state, number=number, t=t, points=points[shown], colours=rgb[shown])

    def _behind(self, points):
        """Mask (n,) of the points in the half of a 3-D scene that is behind its middle; all of a 2-D one."""
        return (points[:, 1] >= self.known.bounds[:, 1].mean()) | (self.known.dim == 2)

    def _points(self, name, points, rgb):
        """Balls of one spacing; nothing where there are no points."""
        if len(points):
            self.server.scene.add_point_cloud(
                name, self._place(points).astype(np.float32), np.round(255.0 * rgb).astype(np.uint8),
                point_size=0.5, point_shape="circle", point_shading="flat", precision="float32")
        else:
            self._remove(name)

    def _meshes(self, arrays):
        wanted = self.surfaces is not None and self.surfaces.value and self.known.dim == 3
        parts = {"water": None, "bubbles": None}
        if wanted:
            from pysph_boiling.analysis.surface import closed_meshes

            parts = vars(closed_meshes(arrays, spacing=self.known.spacing, bounds=self.known.bounds))
        for name, mesh in parts.items():
            if mesh is None or not len(mesh.points):
                self._remove(f"/{name}")
                continue
            points = self._place(mesh.points).astype(np.float32)
            if name == "water":
                self.server.scene.add_mesh_simple(f"/{name}", points, mesh.triangles.astype(np.uint32), color=WATER,
                                                  opacity=OPACITY)
            else:
                self.server.scene.add_mesh_trimesh(f"/{name}", needed("trimesh", "watch").Trimesh(
                    points, mesh.triangles, vertex_colors=bubble_colours(mesh.label), process=False))

    def _remove(self, name):
        handle = self.server.scene.get_handle_by_name(name)
        if handle is not None:
            handle.remove()

    # --- in time

    def refresh(self):
        """Look for new outputs; the slider goes on to the newest if it is at the last."""
        with self.lock:
            self._refresh()

    def _refresh(self):
        at_end = self.time.value >= len(self.outputs) - 1
        if not self.outputs.refresh() or not len(self.outputs):
            return
        first = self.known is None or self.outputs.files[0] != self.first
        newest = self.outputs[-1]
        if first:
            self._measure()
            self.colour.options = tuple(self.colours)
            self._view()
        elif newest is not None:
            self._widen(newest[1])
        last = len(self.outputs) - 1
        self.time.max = max(last, 1)
        if at_end or self.time.value > last:
            self.time.value = last
        self.show()

    def step(self):
        """What happens ``RATE`` times per second: the next output if the run is played, and a look at the folder."""
        if self.live and time.monotonic() - self.looked >= LOOK:
            self.looked = time.monotonic()
            self.refresh()
        if self.play.value and len(self.outputs) > 1 and self.server.get_clients():
            self.time.value = (int(self.time.value) + 1) % len(self.outputs)

    def run(self):
        """Serve the page until the process is interrupted."""
        try:
            while True:
                begun = time.monotonic()
                self.step()
                time.sleep(max(0.01, 1.0 / RATE - (time.monotonic() - begun)))
        finally:
            self.close()

"""Our heat equations as guests of PySPH's own schemes: both examples run to their end, and their checks can fail."""
import re
from pathlib import Path

import numpy as np
import pytest
from pysph.examples.dam_break_2d import DamBreak2D
from pysph.sph import scheme as pysph_schemes

from pysph_boiling import cli
from pysph_boiling.equations import heat
from pysph_boiling.examples import heat_wave
from pysph_boiling.files import last_output, read_output

HOSTS = {"heat_wave": "WCSPHScheme", "heat_wave_tvf": "TVFScheme"}
GUESTS = [heat.HeatTemperature, heat.HeatConductionClearyMonaghan, heat.HeatUpdate, heat.HeatTemperatureAfter]


@pytest.fixture(scope="module", params=HOSTS)
def app(request, tmp_path_factory):
    """One finished run of each example; ``run`` has drawn the picture and made the final check."""
    application = cli.scene_class(request.param)()
    folder = tmp_path_factory.mktemp(request.param)
    application.run([*cli.openmp_arguments([]), "-d", str(folder), "--loglevel", "none"])
    return application


def classes(groups):
    return [type(equation) for group in groups for equation in group.equations]


def test_host_is_pysphs_own(app):
    host = type(app.scheme)
    assert host is getattr(pysph_schemes, HOSTS[app.fname]) and host.__module__ == "pysph.sph.scheme"
    own = classes(app.scheme.get_equations())
    assert all(cls.__module__.startswith("pysph.sph.") for cls in own)
    assert classes(app.equations) == own + GUESTS


def test_wave_decays_drifts_and_keeps_its_energy(app):
    assert app.decay_error() == pytest.approx(0.0, abs=0.01)  # Laplacian of the lattice: 0.2 % and 0.8 % measured
    assert app.shape_error() <= 0.01  # 0.8 % measured, all of it the amplitude's
    assert abs(app.energy_drift()) <= 1e-14  # round-off; 2e-16 measured
    fluid = app.particles[0]
    e, T = (fluid.get(name, only_real_particles=True) for name in ("e", "T"))
    np.testing.assert_allclose(T, heat_wave.T_MEAN + e / heat_wave.WATER.c_l, rtol=1e-14)  # not a step behind


def test_flow_is_that_of_the_host(app):
    fluid = app.particles[0]
    assert fluid.get_number_of_particles(True) == 480
    assert fluid.get_number_of_particles() > 480, "no ghosts: no heat crossed a border"
    for speed, values in ((heat_wave.U, fluid.u), (heat_wave.V, fluid.v)):
        np.testing.assert_allclose(values, speed, rtol=1e-9)  # a lattice in uniform motion stays one


def test_files(app):
    names = {path.name for path in Path(app.output_dir).iterdir()}
    assert {"profile.png", f"{app.fname}.info"} <= names and len(app.output_files) == 2
    measured = Path(app.output_dir) / f"{app.fname}_measured.hdf5"  # the user's, who names it alike
    measured.write_text("mine")
    assert len(app.output_files) == 2 and app.post_process(app.info_filename).endswith("profile.png")
    measured.unlink()


@pytest.mark.parametrize(("prop", "change", "message"), [
    ("e", lambda e: 1.03 * e, "the amplitude differs by"),
    ("e", lambda e: np.roll(e, 30), "from the exact"),
    ("e", lambda e: e + 1e-9 * np.max(e), "the energy changed"),
    ("x", lambda x: x + 1e-4, "the wave differs"),
])
def test_final_check_fails_on(app, prop, change, message):
    values = app.particles[0].get(prop)
    kept = values.copy()
    values[:] = change(kept)
    with pytest.raises(AssertionError, match=message):
        app.check_final()
    values[:] = kept
    app.check_final()


# --- the snippet of docs/python.md, in PySPH's dam break with its wall ---------------------------------------------

def snippet():
    """The code of docs/python.md for another scheme: imports, create_particles, create_equations, create_tools."""
    text = (Path(__file__).parents[2] / "docs" / "python.md").read_text()
    section = text[text.index("## One equation in another scheme"):]
    parts = re.search("```python\n(.*?)```", section, re.S)[1].split("\n\n")
    assert len(parts) == 4
    return parts


class GuestInDamBreak(DamBreak2D):
    """PySPH's dam break with the lines of docs/python.md where it says that they go."""

    def lines(self, number, **names):
        parts = snippet()
        exec(parts[0], names)
        exec(parts[number], names)
        return names

    def create_particles(self):
        particles = super().create_particles()
        self.fluid, self.wall = particles
        self.lines(1, fluid=self.fluid)
        self.fluid.e[:] = 4186.0 * 50.0 * (self.fluid.x > 0.5)  # half of the water is 50 K hotter
        return particles

    def create_equations(self):
        equations = self.lines(2, equations=super().create_equations())["equations"]
        for number, group in enumerate(equations):  # named, so that PySPH's cache serves the next session
            group.name = f"group{number}"
        return equations

    def create_tools(self):
        return self.lines(3, fluid=self.fluid)["tools"]


def test_snippet_of_the_readme_in_a_scheme_with_a_wall(tmp_path):
    application = GuestInDamBreak(fname="dam_break_2d", output_dir=str(tmp_path))
    application.run(["--openmp", "--max-steps", "20", "-d", str(tmp_path), "--loglevel", "none"])
    arrays, data = read_output(last_output(tmp_path))
    fluid, wall = arrays["fluid"], arrays["boundary"]
    assert data["count"] == 20 and {"e", "T"} <= set(fluid.output_property_arrays)
    assert not {"e", "T"} & set(wall.output_property_arrays) and "au" in wall.properties
    np.testing.assert_allclose(fluid.T, 300.0 + fluid.e / 4186.0, rtol=1e-14)  # not an update behind e
    middle = np.abs(fluid.x - 0.5) < 0.1  # more than a support of the kernel on both sides
    assert np.ptp(fluid.T[~middle]) == pytest.approx(50.0, rel=1e-3)  # away from the border between hot and cold
    moved = fluid.e - 4186.0 * 50.0 * (fluid.x > 0.5)
    assert 1e-3 < np.max(np.abs(moved[middle])) < 0.1  # J/kg, measured .013: heat has crossed the border
    assert abs(np.sum(moved)) < 1e-12 * np.sum(fluid.e)

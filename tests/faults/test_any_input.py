"""Whatever is typed: each parameter of the tables, and option lines made up, by hypothesis. Nothing is compiled."""
import dataclasses
import math
import os

import numpy as np
import pytest
import sets
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from pysph.base.kernels import CubicSpline

from pysph_boiling.cli import main
from pysph_boiling.examples import scene_class, scenes
from pysph_boiling.particles import add_properties, fluid_array, site_array, wall_array
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import EFFECTS

CLASSES = [cls for slot in BoilingScheme.slots for cls in EFFECTS[slot]] + [
    scene_class(name).Parameters for name in scenes() if hasattr(scene_class(name), "Parameters")]
TABLE = [(cls, spec) for cls in CLASSES for spec in dataclasses.fields(cls) if "unit" in spec.metadata]
IDS = [f"{cls.__name__}.{spec.name}" for cls, spec in TABLE]
settings.register_profile("quiet", deadline=None, suppress_health_check=list(HealthCheck))
settings.load_profile("quiet")


def label(cls, spec):
    return f"{getattr(cls, 'slot', 'scene')}.{spec.name}"


def numbers(spec):
    return not spec.metadata["choices"] and not isinstance(spec.default, (bool, tuple)) and spec.type is not str


def wrong(spec):
    """Values that the parameter must refuse."""
    meta = spec.metadata
    other = st.sampled_from(["much", object(), {}, "nan", b"1"])
    if meta["choices"]:
        return other | st.text(max_size=5).filter(lambda value: value not in meta["choices"])
    if spec.type is str:
        return st.sampled_from([object(), {}, b"1", "", 2.5])
    if isinstance(spec.default, bool):
        return other | st.floats()
    if isinstance(spec.default, tuple):
        return other | st.sampled_from([(math.nan,) * len(spec.default), (1.0, math.inf, 0.0), ("a", "b", "c")])
    values = [other, st.sampled_from([math.nan, math.inf, -math.inf, True, (1.0, 2.0)])]
    if meta["low"] is not None:
        values.append(st.floats(max_value=meta["low"], exclude_max=True, allow_infinity=False))
    if meta["above"] is not None:
        values.append(st.floats(max_value=meta["above"], allow_infinity=False))
    if meta["high"] is not None:
        values.append(st.floats(min_value=meta["high"], exclude_min=True, allow_infinity=False))
    if isinstance(spec.default, int) and not isinstance(spec.default, bool):
        values.append(st.just(2.5))
    return st.one_of(values)


@pytest.mark.parametrize(("cls", "spec"), TABLE, ids=IDS)
def test_wrong_value_is_an_error_that_names_the_parameter(cls, spec):
    @settings(max_examples=15)
    @given(wrong(spec))
    def refused(value):
        with pytest.raises(ValueError) as caught:
            cls(**{spec.name: value})
        said, meta = str(caught.value), spec.metadata
        assert label(cls, spec) in said
        outside = numbers(spec) and isinstance(value, float) and math.isfinite(value) and value != 2.5
        if outside and meta["unit"] != "-":
            assert meta["unit"] in said, said
        if outside:
            assert any(f"{bound}" in said for bound in (meta["low"], meta["above"], meta["high"]) if bound is not None)

    refused()


FLAGS = ("--flat", "--demo", "--quick", "--describe", "--mode", "--effects", "--resume", "--quality", "--no-heat",
         "--tf", "--heater.temperature", "--density.max-sweeps", "--density.skin", "--dynamic-nucleation.q-crit",
         "--no-drag", "--oscillation", "--spacing", "--seed", "--sites", "--frame", "--pfreq", "--dim", "--kernel",
         "--no-density", "--venting.mode", "--forms")
VALUES = ("1", "0", "-1", "nan", "inf", "1e300", "-1e-300", "2.5", "x", "", "gu", "auto", "reference", "1,2,3", "--",
          "=", "paper", "QuinticSpline", "remove", "\u2603", "../..", "%s", "{}")


@settings(max_examples=80)
@given(st.sampled_from(scenes()), st.lists(st.sampled_from(FLAGS + VALUES), max_size=7))
@example("steady_boiling", ["--flat", "--kernel", "QuinticSpline"])
@example("steady_boiling", ["--flat", "--spacing", "1e300"])
@example("steady_boiling", ["--flat", "--no-density"])
@example("superheat_sites", ["--flat", "--forms", "paper", "--no-density"])
def test_fuzzed_option_line_never_ends_in_a_traceback(tmp_path_factory, scene, tokens):
    """It describes, or says what is wrong: status 0, 1 or 2, one word on stderr at least, nothing written."""
    folder = tmp_path_factory.mktemp("fuzz")
    before = os.getcwd()
    os.chdir(folder)
    try:
        try:
            status = main(["run", scene, *tokens, "--describe"])
        except SystemExit as stop:  # argparse
            status = stop.code
        assert status in (0, 1, 2)
        assert os.listdir(folder) == []
    finally:
        os.chdir(before)


# --- arrays -----------------------------------------------------------------------------------------------------------

SHAPES = st.lists(st.integers(0, 4), max_size=3).map(tuple).filter(lambda shape: not (
    len(shape) == 2 and shape[0] > 0 and shape[1] == 3))


@settings(max_examples=40)
@given(SHAPES)
@pytest.mark.parametrize("make", [
    lambda points: fluid_array(points, spacing=0.1, dim=2, rho0=1e3),
    lambda points: wall_array(points, spacing=0.1, dim=2, rho0=1e3, kernel=CubicSpline(dim=2)),
    lambda points: site_array(points, reach=0.3, spacing=0.1),
], ids=["fluid", "wall", "sites"])
def test_positions_of_a_wrong_shape_are_refused(make, shape):
    with pytest.raises(ValueError, match=r"must have shape \(n, 3\)|is empty"):
        make(np.zeros(shape))


@settings(max_examples=20)
@given(st.sampled_from(["boil", "paper", "expand"]), st.sampled_from(["fluid", "wall", "sites"]), st.integers(2, 3))
def test_missing_and_empty_arrays_are_named(name, missing, dim):
    """And nothing has been changed in the arrays that are there."""
    scheme = sets.scheme(name, dim=dim, spacing=0.1)
    points = np.argwhere(np.ones((3,) * dim)) * 0.1
    points = np.pad(points, ((0, 0), (0, 3 - dim)))
    arrays = {"fluid": fluid_array(points, spacing=0.1, dim=dim, rho0=scheme.rho0),
              "wall": wall_array(points - 0.5, spacing=0.1, dim=dim, rho0=scheme.rho0, kernel=CubicSpline(dim=dim)),
              "sites": site_array(points[:1], reach=0.3, spacing=0.1)}
    before = {key: set(pa.properties) for key, pa in arrays.items()}
    empty = dict(arrays)
    empty[missing] = arrays[missing].extract_particles(np.array([], dtype=int))
    others = [pa for key, pa in arrays.items() if key != missing]
    for given_arrays, said in ((others, f"the particle array '{missing}'"),
                               (list(empty.values()), f"particle array '{missing}' is empty")):
        with pytest.raises(ValueError, match=said):
            scheme.setup_properties(given_arrays)
        assert {key: set(pa.properties) for key, pa in arrays.items()} == before


@settings(max_examples=30)
@given(st.integers(1, 5).filter(lambda n: n != 4), st.floats(280.0, 400.0))
def test_temperatures_of_a_wrong_length_are_refused(n, T):
    scheme = sets.scheme("boil", dim=2, spacing=0.1)
    fluid = fluid_array(np.pad(np.argwhere(np.ones((2, 2))) * 0.1, ((0, 0), (0, 1))), spacing=0.1, dim=2, rho0=1e3)
    add_properties(fluid, [row for row in scheme.effect_rows("properties")])
    if n == 1:
        scheme.set_temperature(fluid, T)  # one for all
        assert np.allclose(fluid.T, T)
        return
    with pytest.raises(ValueError, match=r"T of 'fluid' must be a number or have shape \(4,\)"):
        scheme.set_temperature(fluid, np.full(n, T))

"""Whatever is typed: each parameter of the tables, and option lines made up, by hypothesis. Nothing is compiled."""
import dataclasses
import math
import os

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from pysph_boiling.cli import main, scene_class, scenes
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
    return not spec.metadata["choices"] and not isinstance(spec.default, (bool, tuple, str))


def wrong(spec):
    """Values that the parameter must refuse."""
    meta = spec.metadata
    other = st.sampled_from(["much", object(), {}, "nan", b"1"])
    if meta["choices"]:
        return other | st.text(max_size=5).filter(lambda value: value not in meta["choices"])
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
         "--tf", "--heater.temperature", "--density.max-sweeps", "--density.skin", "--burst.q-crit", "--no-drag",
         "--oscillation", "--spacing", "--seed", "--sites", "--frame", "--pfreq", "--dim", "--kernel", "--no-density",
         "--venting.mode")
VALUES = ("1", "0", "-1", "nan", "inf", "1e300", "-1e-300", "2.5", "x", "", "gu", "auto", "reference", "1,2,3", "--",
          "=", "QuinticSpline", "remove", "\u2603", "../..", "%s", "{}")


@settings(max_examples=80)
@given(st.sampled_from(scenes()), st.lists(st.sampled_from(FLAGS + VALUES), max_size=7))
@example("steady_boiling", ["--flat", "--kernel", "QuinticSpline"])
@example("steady_boiling", ["--flat", "--spacing", "1e300"])
@example("steady_boiling", ["--flat", "--no-density"])
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

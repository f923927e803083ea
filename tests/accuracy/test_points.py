"""Settings, the file of points, what is found in them and the claims, on a problem that takes no time."""
import json
import math
import os
from dataclasses import dataclass, field

import pytest

from pysph_boiling.evaluation.accuracy import knobs, measure, results
from pysph_boiling.evaluation.accuracy.knobs import (
    Study,
    Trend,
    along,
    changed,
    describe_settings,
    fixed_sweeps,
    together,
)
from pysph_boiling.evaluation.accuracy.measure import Points
from pysph_boiling.evaluation.problems.problem import Outcome, Problem
from pysph_boiling.schemes.effects import DensityConstraint
from pysph_boiling.schemes.quality import QUALITIES, Quality


@dataclass(frozen=True, kw_only=True)
class Toy(Problem):
    """Error h^2 at a cost of 1/h; ``mode`` makes it fail."""

    title = "toy"
    reference = "nothing"
    h: float = 1.0
    dt_factor: float = 0.07
    kernel: str = "CubicSpline"
    hdx: float = 1.2
    density: DensityConstraint = field(default_factory=DensityConstraint)
    mode: str = "run"

    def run(self):
        if self.mode == "raise":
            raise FloatingPointError("it blew up")
        if self.mode == "die":
            os._exit(3)
        return Outcome(errors={"e": -self.h**2, "bad": math.nan}, seconds=2.0 / self.h, simulated=2.0, steps=4,
                       particles=7, facts={"speed": 1.0 + self.h})


@pytest.fixture
def points(tmp_path):
    return Points(tmp_path / "points.json")


def study(**kw):
    return Study(**{"key": "toy", "problem": Toy(), "error": "e", "what": "error",
                    "knobs": {"h": along("h", 0.5, 0.25)}, **kw})


def run_all(study, points):
    for problem in study.problems():
        if not points.repeats(problem):
            points.add(problem)
    return points


def test_settings_reach_fields_and_effects():
    problem = changed(Toy(), {"h": 0.5, **fixed_sweeps(3)[0], "density.omega": 0.4})
    assert problem.h == 0.5
    assert problem.density == DensityConstraint(min_sweeps=3, max_sweeps=3, tolerance=0.0, omega=0.4)
    with pytest.raises(TypeError, match="nothing_such"):
        changed(Toy(), {"nothing_such": 1})
    with pytest.raises(TypeError, match="nothing_such"):
        changed(Toy(), {"density.nothing_such": 1})


def test_combinations_and_words():
    settings = together(along("dt_factor", 0.14, 0.07), fixed_sweeps(2, 4))
    assert len(settings) == 4 and describe_settings(settings[1]) == "step/t* 0.14, 4 sweeps"
    assert describe_settings({}) == "default settings"
    assert describe_settings({"kernel": "WendlandQuintic", "hdx": 1.5}) == "WendlandQuintic, h/dx 1.5"
    assert describe_settings({"density.min_sweeps": 2, "density.max_sweeps": 4, "density.tolerance": 0.01}) == (
        "2 to 4 sweeps, until 0.01")
    assert describe_settings({"pooled": False, "vapour_as_site": True}) == "not pooled, vapour as site"
    assert describe_settings({"density.max_sweeps": 60, "density.tolerance": 1e-3}) == "at most 60 sweeps, until 0.001"


def test_a_point_is_run_once_whatever_asks_for_it():
    one = study(knobs={"a": along("h", 0.5, 1.0), "b": along("h", 0.5)}, presets=False)
    assert [(settings, names) for settings, names in one.settings()] == [
        ({}, ["default settings", "a"]), ({"h": 0.5}, ["a", "b"])]
    assert one.problems() == [Toy(), Toy(h=0.5)]
    presets = {changed(Toy(), quality.settings()) for quality in QUALITIES.values()}
    assert set(study(knobs={"eps": along("density.eps", 0.1)}).problems()) == {Toy()} | presets
    assert set(study().problems()) == {Toy(), Toy(h=0.5), Toy(h=0.25)} | presets


def test_points_are_kept_and_told_apart(points):
    points.add(Toy())
    points.add(Toy())
    again = Points(points.file)
    record = again.get(Toy())
    assert record["seconds"] == [2.0, 2.0] and len(record["load"]) == 2 and record["same"] is True
    assert record["errors"] == {"e": -1.0, "bad": None}
    assert (again.repeats(Toy()), again.repeats(Toy(h=0.5)), Points(points.file, threads=2).repeats(Toy())) == (2, 0, 0)
    assert again.get(changed(Toy(), {"density.omega": 0.69})) is None


def test_a_change_of_the_model_makes_points_anew(points, monkeypatch):
    points.add(Toy())
    monkeypatch.setattr(measure, "digest", lambda: "other")
    assert points.get(Toy()) is None


@pytest.mark.parametrize("mode, why", [("raise", "FloatingPointError: it blew up"), ("die", "exit status 3")])
def test_a_run_that_fails_is_a_point_with_its_reason(points, mode, why):
    one = study(problem=Toy(mode=mode), knobs={}, presets=False)
    run_all(one, points)
    assert why in points.get(Toy(mode=mode))["failed"] and points.repeats(Toy(mode=mode)) == math.inf
    found = results.find(one, points, quick=True, claims=[])
    assert found.front == [] and math.isnan(found.rows[0].error) and math.isnan(found.rows[0].cost)


def test_front_orders_and_csv(points, tmp_path):
    one = study(trends=(Trend("finer", "h", tuple(along("h", 1.0, 0.5, 0.25))),
                        Trend("count", "h", tuple(along("h", 1.0, 0.5)), finer="larger")), presets=False)
    found = results.find(one, run_all(one, points), quick=True, claims=[])
    assert [(row.settings, row.error, row.cost) for row in found.rows] == [
        ("default settings", 1.0, 1.0), ("h 0.5", 0.25, 2.0), ("h 0.25", 0.0625, 4.0)]
    assert found.front == [0, 1, 2]
    assert found.orders["finer"].order == pytest.approx(2.0) and found.orders["count"].order == pytest.approx(-2.0)
    results.write_points(found, tmp_path / "points.csv")
    assert (tmp_path / "points.csv").read_text().count("\n") == 4


def test_what_makes_another_scene_is_off_the_front_and_on_the_trend(points):
    one = study(trends=(Trend("finer", "h", tuple(along("h", 1.0, 0.5, 0.25))),), presets=False, apart=("h",))
    found = results.find(one, run_all(one, points), quick=True, claims=[])
    assert found.front == [0] and len(found.rows) == 3 and found.orders["finer"].order == pytest.approx(2.0)


def test_what_breaks_another_bound_is_off_the_front(points):
    found = results.find(study(presets=False, keeps={"e": 0.5, "bad": 1.0}), run_all(study(presets=False), points),
                         quick=True, claims=[])
    assert found.front == [1, 2] and math.isnan(found.rows[0].error)


def test_self_convergence_compares_with_the_finest(points):
    one = study(error="speed", finest={"h": 0.0625}, presets=False)
    found = results.find(one, run_all(one, points), quick=True, claims=[])
    errors = {row.settings: row.error for row in found.rows}
    assert errors["default settings"] == pytest.approx(2.0 / 1.0625 - 1.0) and math.isnan(errors["h 0.0625"])


@pytest.mark.parametrize("claim, holds", [
    ({"error": "e", "at_most": 1.0}, True), ({"error": "e", "at_most": 0.9}, False),
    ({"error": "e", "at_most": 0.3, "of": ["h"]}, True), ({"error": "bad", "at_most": 1.0}, False),
    ({"trend": "finer", "order": [1.9, 2.1]}, True), ({"trend": "finer", "order": [0, 1]}, False),
    ({"trend": "finer", "order": [1.9, 2.1], "form": "quick"}, True), ({"trend": "unknown", "order": [0, 9]}, False)])
def test_claims_hold_or_fail(points, claim, holds):
    one = study(trends=(Trend("finer", "h", tuple(along("h", 1.0, 0.5))),), presets=False)
    found = results.find(one, run_all(one, points), quick=True, claims=[{"study": "toy", "why": "so", **claim}, {
        "study": "another", "error": "e", "at_most": 0.0, "why": ""}, {
        "study": "toy", "error": "e", "at_most": 0.0, "why": "", "form": "full"}])
    assert [statement.agrees for statement in found.statements] == [holds]


@pytest.mark.parametrize("bound, promised, holds", [
    (1.0, {}, True), (0.5, {}, False), (0.5, {"h": 0.5}, True), (1.0, {"h": 2.0}, False)])
def test_presets_keep_what_they_state(points, monkeypatch, bound, promised, holds):
    """Where the study says that it is checked, and that point is off the front if it does not compete."""
    preset = {"fine": Quality(dt_factor=0.1, density=DensityConstraint(), cost=1.0, stated={
        ("toy", "e"): bound, ("another", "e"): 0.0})}
    monkeypatch.setattr(knobs, "QUALITIES", preset)
    monkeypatch.setattr(results, "QUALITIES", preset)
    one = study(promised=promised, apart=("h",))
    found = results.find(one, run_all(one, points), quick=True, claims=[])
    assert [statement.agrees for statement in found.statements] == [holds] and found.presets()["fine"].cost == 1.0
    deep = [row for row in found.rows if row.settings.startswith("preset fine, ")]
    assert len(deep) == len(promised) and all(math.isnan(row.error) for row in deep)


def test_every_claim_is_about_what_is_there():
    every = {(quick, one.key): one for quick in (False, True) for one in knobs.studies(quick)}
    for claim in json.loads(results.CLAIMS.read_text()):
        assert claim["why"], claim
        for quick in {"quick": (True,), "full": (False,)}.get(claim.get("form"), (False, True)):
            one = every[quick, claim["study"]]
            assert "trend" not in claim or claim["trend"] in {trend.name for trend in one.trends}, claim
            for name in claim.get("of", ()):
                assert name in {"default settings", *one.knobs}, claim
    for preset in QUALITIES.values():
        for key, _ in preset.stated:
            assert key in knobs.STUDIES


def test_unknown_study_is_refused_with_the_known_ones():
    with pytest.raises(ValueError, match="no study 'fig3'; there are: hydrostatic_2d"):
        knobs.studies(True, ["fig3"])

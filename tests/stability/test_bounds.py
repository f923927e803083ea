"""The judge of hard cases: a made-up run that breaks one rule fails by that rule, and by no other."""
import json
from types import SimpleNamespace

import pytest

from pysph_boiling.evaluation.stress.case import Case
from pysph_boiling.evaluation.stress.cases import all_cases
from pysph_boiling.evaluation.stress.judge import RULES, bounds_of, judge, load_bounds

STEPS = 10
FALL = 2.0  # [m/s] from the depth below: sqrt(2 g H)


def made_up(factor=1.0, closed=True, **columns):
    """A run that breaks no rule, but for the columns given: their last value."""
    table = dict(bad=0.0, outside=0.0, speed=0.5 * FALL, density_error_mean=1e-3, density_error_max=1e-2,
                 energy_residual=1e-15, mass_residual=0.0, n_limited=0.0, n_projected=0.0, mechanical=5.0)
    table = {name: [value] * STEPS for name, value in table.items()}
    for name, value in columns.items():
        table[name][-1] = value
    return SimpleNamespace(
        table=table, setup=SimpleNamespace(factor=factor, closed=closed, every=1), g=10.0,
        depth=FALL**2 / 20.0, fastest=0.0, first=5.0, scale=100.0, stopped="", refusal="")


CASE = Case(name="made-up", hard="", build=None, steps=STEPS)
BOUNDS = load_bounds()

BROKEN = {  # rule -> column and a value just above its bound
    "bad": ("bad", 1.0),
    "outside": ("outside", 1.0),
    "speed": ("speed", 2.01 * FALL),
    "density_mean": ("density_error_mean", 0.0201),
    "density_max": ("density_error_max", 0.201),
    "energy_residual": ("energy_residual", -1.01e-10),
    "mass_residual": ("mass_residual", -1.01e-13),
    "limited": ("n_limited", 1.0),
    "projected": ("n_projected", 1.0),
    "rise": ("mechanical", 5.0 + 1.01e-2 * 100.0),
}


def rules(case, run, bounds=BOUNDS):
    return [rule for rule, _ in judge(case, run, bounds)]


def test_a_run_within_all_bounds_passes():
    assert judge(CASE, made_up(), BOUNDS) == []


@pytest.mark.parametrize("rule", BROKEN)
def test_each_rule_is_seen_to_fail(rule):
    name, value = BROKEN[rule]
    assert rules(CASE, made_up(**{name: value})) == [rule]
    assert rules(CASE, made_up(**{name: float("nan")})) == [rule]  # a comparison with NaN must not pass


def test_every_rule_is_covered():
    assert set(BROKEN) | {"counted_until", "settle"} == set(RULES)


def test_safeguards_may_act_in_steps_beyond_twice_the_default():
    for name in ("n_limited", "n_projected"):
        assert rules(CASE, made_up(factor=2.0, **{name: 1.0})) != []
        assert rules(CASE, made_up(factor=5.0, **{name: 1.0})) == []


def test_density_errors_count_once_the_start_has_settled():
    late = json.loads(json.dumps(BOUNDS))
    late["exceptions"].append({"cases": ["made-*"], "rule": "settle", "bound": STEPS // 2, "reason": "test"})
    early = made_up()
    early.table["density_error_max"][0] = 0.5
    assert rules(CASE, early) == ["density_max"] and rules(CASE, early, late) == []
    assert rules(CASE, made_up(density_error_max=0.5), late) == ["density_max"]


def test_energy_may_rise_in_an_open_case():
    assert rules(CASE, made_up(closed=False, mechanical=1e3)) == []


def test_a_run_that_stopped_or_was_refused_fails():
    run = made_up()
    run.stopped = "step 3: ValueError"
    assert rules(CASE, run) == ["stopped"]
    run = made_up()
    run.refusal = "spacing must be > 0 m"
    assert rules(CASE, run) == ["refused"]


def test_the_end_state_is_judged():
    odd = Case(name="made-up", hard="", build=None, steps=STEPS, end=lambda run: ["water on the ceiling"])
    assert judge(odd, made_up(), BOUNDS) == [("end", "water on the ceiling")]


def test_a_case_that_must_be_refused():
    must = Case(name="made-up", hard="", build=None, steps=STEPS, refused="L must be")
    run = made_up()
    assert rules(must, run) == ["refused"]
    run.refusal = "L must be > 0 J/kg"
    assert judge(must, run, BOUNDS) == []
    run.refusal = "something else"
    assert rules(must, run) == ["refused"]


def test_bounds_need_a_reason_and_a_known_rule(tmp_path):
    file = tmp_path / "bounds.json"
    for broken in ({"rules": {**BOUNDS["rules"], "colour": {"bound": 0, "reason": "x"}}, "exceptions": []},
                   {"rules": {**BOUNDS["rules"], "bad": {"bound": 0}}, "exceptions": []},
                   {**BOUNDS, "exceptions": [{"cases": ["x"], "rule": "bad", "bound": 1, "reason": ""}]},
                   {**BOUNDS, "exceptions": [{"cases": ["x"], "rule": "colour", "bound": 1, "reason": "x"}]}):
        file.write_text(json.dumps(broken))
        with pytest.raises(ValueError, match="bounds"):
            load_bounds(file)


def test_exceptions_are_for_cases_that_exist():
    from fnmatch import filter as matching

    known = all_cases()
    for entry in BOUNDS["exceptions"]:
        for pattern in entry["cases"]:
            assert matching(known, pattern), pattern
            name = matching(known, pattern)[0]
            assert entry["rule"] in bounds_of(name, BOUNDS)

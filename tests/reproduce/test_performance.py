"""Table 4: the cost of a frame, what is timed, and how verdicts of the figures make those of its key observations."""
import numpy as np
import pytest

from pysph_boiling.evaluation.reproduce import performance
from pysph_boiling.evaluation.reproduce.performance import (
    PAPER,
    TIMED,
    Performance,
    Scenario,
    cost,
    observations,
    observed,
    rates,
)
from pysph_boiling.report.sections import Section, Statement
from pysph_boiling.results import SavedRun


def record(seconds, steps, **more):
    return dict(timed=dict(seconds=seconds, steps=steps), dt=1.0 / 600.0, particles=dict(fluid=20000), threads=2,
                processor="a processor", machine="a machine", wall_time=dict(unit="s", search=1.0, density=2.0)) | more


def test_cost_of_a_frame():
    one = cost(record(8.0, 40))
    assert (one["steps"], one["step"], one["frame"]) == pytest.approx((20.0, 0.2, 4.0))


def test_scenes_that_cost_about_the_same_step():
    costs = {"steady_boiling": cost(record(0.8, 40)), "bubble_rise": cost(record(1.1, 40))}  # 50 and 36 steps a second
    boils = dict.fromkeys(costs, 0.9)
    assert [row.agrees for row in rates(costs, boils, quick=False)] == [True, True]
    costs["cooling"] = cost(record(1.3, 40, wall_time=dict(unit="s", heat=0.4, density=0.3)))
    boils["cooling"] = 0.9
    assert [row.agrees for row in rates(costs, boils, quick=False)] == [True, False]
    assert [row.agrees for row in rates(costs, boils, quick=True)] == [None, None]
    why = rates(costs, boils, quick=False)[1].why
    assert "a step of post-heating cooling takes 32.5 ms, one of steady boiling 20.0 ms" in why
    assert "10.0 ms, is the stage 'heat'" in why
    assert [row.agrees for row in rates(costs, boils | {"cooling": 0.3}, quick=False)] == [False, False]


@pytest.mark.parametrize("seconds, agrees", [(8.0, False), (0.8, True), (0.1, False)])
def test_steps_a_second_are_neither_below_the_papers_nor_far_above(seconds, agrees):
    costs = {"steady_boiling": cost(record(seconds, 40))}
    assert rates(costs, {"steady_boiling": 1.0}, quick=False)[0].agrees is agrees


@pytest.mark.parametrize("quick", [False, True])
def test_every_scene_is_timed_alone_in_the_full_form_only(quick):
    runs = Performance().runs(quick)
    assert [run.scene for run in runs] == list(PAPER) == list(TIMED)
    assert all(run.alone != quick for run in runs) and not any("--no-" in run.command for run in runs)


@pytest.mark.parametrize("verdicts, agrees", [
    ((True, True), True), ((True, False), False), ((None, False), False), ((True, None), None), ((None, None), None)])
def test_key_observation_agrees_if_all_that_bears_on_it_does(tmp_path, monkeypatch, verdicts, agrees):
    monkeypatch.setattr(performance, "PAPER", {"s": Scenario("S", "fig3", 1.0, "seen", ("first", "second"))})
    rows = [Statement("the first", "1", verdicts[0], "a"), Statement("no matter", "0", False, "b"),
            Statement("the second", "2", verdicts[1], "c")]
    (tmp_path / "fig3").mkdir()
    Section("fig3", "t", statements=rows).save(tmp_path / "fig3")
    found = observed(tmp_path)
    assert found["s"] == [rows[0], rows[2]]
    made, = observations(found)
    assert made.agrees is agrees and "measured for Fig. 3" in made.ours
    assert made.why == " ".join(f"{row.why.upper()}." for row in found["s"] if row.agrees is not True)
    assert [row[1] for row in performance.observation_table(found)[0].rows] == ["the first", "the second"]

    Section("fig3", "t", statements=rows[:2]).save(tmp_path / "fig3")
    with pytest.raises(ValueError, match="Fig. 3 should have one statement for each of"):
        observed(tmp_path)


def test_table_says_what_was_not_made_yet(tmp_path):
    (tmp_path / "table4").mkdir()
    figure = Performance()
    results = {run.name: SavedRun(tmp_path) for run in figure.runs(False)}
    for result in results.values():
        result.record, result.results = record(0.8, 40), {"n_vapour": np.array([0.0, 5.0, 5.0, 5.0])}
    section = figure.make(results, tmp_path / "table4", quick=False)
    assert [row.agrees for row in section.statements] == [True, True] + [None] * len(PAPER)
    assert all("was not made yet" in row.ours for row in section.statements[2:])
    assert len(section.tables) == 1
    assert section.tables[0].rows[0][1:8] == ("20000", "1.67", "75%", "20.0", "50.0", "0.40", "2")
    assert "a processor (a machine)" in section.tables[0].caption
    assert (tmp_path / "table4" / "stages.png").stat().st_size > 5000

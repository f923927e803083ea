"""How large a run is, and about how long it takes: what the lists of scenes and of figures say is what would be run."""
import pytest

from pysph_boiling import cli, examples
from pysph_boiling.evaluation.reproduce.command import Sizes
from pysph_boiling.evaluation.reproduce.figure import figures
from pysph_boiling.evaluation.reproduce.runs import Run
from pysph_boiling.examples import picture_of, said_of, scene_class, scenes
from pysph_boiling.runs.size import Size, about, size_of


@pytest.mark.parametrize("name", scenes())
def test_docstring_says_how_large_the_scene_is_and_how_long_it_takes(name):
    size = size_of(scene_class(name)())
    assert said_of(name)[1].startswith(
        f"about {about(size.seconds)} on two cores ({size.dim}-D, {size.particles:,} particles, {size.steps:,} steps "
        f"for {size.duration:.3g} s)")


def test_size_follows_the_options_and_times_change_no_particles():
    application, known = scene_class("steady_boiling")(), {}
    assert size_of(application, known=known) == Size(3, 28 * 28 * 26, 2880, 4.0)
    assert size_of(application, ["--duration", "1", "--seed", "3"], known) == Size(3, 28 * 28 * 26, 720, 1.0)
    assert len(known) == 1
    assert size_of(application, ["--demo"], known) == Size(3, 20 * 20 * 18, 1800, 2.5)
    assert size_of(application, ["--flat"], known)[:2] == (2, 60 * 35)
    assert size_of(application, ["--max-steps", "10"], known).steps == 10


@pytest.mark.parametrize(("particles", "measured"), [
    (20384, 23e-3), (480, 5e-3),  # steady_boiling and reuse_wcsph, on a fast machine
    (20384, 93e-3), (20328, 159e-3),  # the quickest and the slowest of Table 4 in docs/reproduction.md
    (3200, 10.4e-3)])  # dam_break, processor time on a busy machine
def test_time_is_within_a_factor_of_three_of_what_was_measured(particles, measured):
    assert measured / 3.0 < Size(3, particles, 1, 1.0).seconds < 3.0 * measured


@pytest.mark.parametrize(("seconds", "words"), [
    (0.4, "1 s"), (4.2, "4 s"), (32.0, "30 s"), (190.0, "3 minutes"), (5000.0, "83 minutes"), (18000.0, "5 hours")])
def test_words(seconds, words):
    assert about(seconds) == words


def test_list_names_the_picture_of_each_scene_that_has_one(capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.chdir(examples.PICTURES.parents[1])
    assert cli.main(["list"]) == 0
    out = capsys.readouterr().out
    for name in scenes():
        there = (examples.PICTURES / f"{name}.webp").exists()
        assert (f"docs/pictures/{name}.webp" in out) == there == (picture_of(name) is not None)
        assert " ".join(said_of(name)[1].split()[:6]) in out
    assert out.count(".webp") >= 14 and "of the repository" not in out
    monkeypatch.setattr(examples, "PICTURES", tmp_path)  # an installed package
    assert cli.main(["list"]) == 0
    out = capsys.readouterr().out
    assert ".webp" not in out and "Pictures of the scenes are in the folder docs/pictures of the repository." in out


def test_reproduce_lists_figures_with_what_they_take_and_their_runs(capsys):
    assert cli.main(["reproduce", "--list", "--quick", "fig2", "fig3", "table1"]) == 0
    out = capsys.readouterr().out
    known = figures()
    for key in ("fig2", "fig3", "table1"):
        assert f"{key}  {known[key].title}" in out
        for run in known[key]().runs(True):
            assert f"    {run.name}: {run.command}\n" in out
    assert "no runs: drawn at once" in out and "fig4" not in out
    assert out.count("particle steps, about") == 3  # two figures, and together


def test_shared_runs_count_once():
    sizes = Sizes()
    one = Run("one", "dam_break", ("--quick",))
    size = sizes.of(one)
    assert sizes.summary([one]) == (f"1 run, {size.particles * size.steps:.2g} particle steps, about "
                                    f"{about(size.seconds)}")
    assert sizes.summary([one, one]) == sizes.summary([one])
    two = Run("two", "dam_break", ("--quick",))
    assert sizes.summary([one, two]).startswith(f"2 runs, {2 * size.particles * size.steps:.2g} particle steps")

"""Runs are started once, kept, continued and reported; the command makes a page of them. No scene is simulated here.

``pysph_boiling run`` is played by a script that does what its scene's name says.
"""
import json
import multiprocessing.spawn  # noqa: F401  it keeps sys.executable of now, which a test replaces
import os
import sys
import time
from itertools import combinations

import pytest
from pysph.base.utils import get_particle_array
from pysph.solver.utils import dump

from pysph_boiling import cli
from pysph_boiling.evaluation.reproduce import command, runs
from pysph_boiling.evaluation.reproduce.figure import FIGURES, Figure
from pysph_boiling.evaluation.reproduce.runs import Run, perform
from pysph_boiling.report.sections import Statement, Table, write_csv
from pysph_boiling.results import SavedRun
from pysph_boiling.runs.size import Size

ACTOR = '''#!{python}
import json, os, shutil, sys, time
given = sys.argv[1:]
assert given[:3] == ["-m", "pysph_boiling", "run"] and "--no-pictures" in given, given
scene, folder = given[3], given[given.index("--directory") + 1]
restart = os.path.basename(given[given.index("--restart-file") + 1]) if "--restart-file" in given else None
begin = time.time()
print("playing", scene)

def record(completed):
    with open(os.path.join(folder, "run.json"), "w") as file:
        json.dump(dict(completed=completed, machine="a machine", processor="a processor", versions=dict(python="3"),
                       finished="2024-05-06"), file)

def output(number, source={output!r}):
    shutil.copy(source, os.path.join(folder, "{{}}_{{}}.hdf5".format(os.path.basename(folder), number)))

record(False)
if scene == "fails":
    print("it broke")
    sys.exit(3)
if scene in ("halts", "hangs") and not restart:
    output(0)
    output(10)
    with open(os.path.join(folder, os.path.basename(folder) + "_20.hdf5"), "wb") as file:
        file.write(b"cut off")
    with open(os.path.join(folder, "pid"), "w") as file:
        file.write(str(os.getpid()))
    if scene == "hangs":
        time.sleep(60)
    sys.exit(9)
time.sleep(1.0 if scene == "naps" else 0.0)
shutil.copy({results!r}, folder)
record(True)
with open(os.path.join(os.path.dirname(folder), "journal"), "a") as file:
    print(json.dumps(dict(name=os.path.basename(folder), begin=begin, end=time.time(), restart=restart,
                          threads=os.environ["OMP_NUM_THREADS"])), file=file)
sys.exit(1 if scene == "lacks" else 0)
'''


@pytest.fixture(scope="module")
def real_files(tmp_path_factory):
    """An output file of PySPH and a table of results."""
    import numpy as np

    folder = tmp_path_factory.mktemp("files")
    dump(str(folder / "output.hdf5"), [get_particle_array(name="fluid", x=[1.0, 2.0])], dict(t=0.5, dt=0.1, count=5))
    np.savez(folder / "results.npz", t=np.array([0.0, 1.0]))
    return folder


@pytest.fixture
def root(tmp_path, real_files, monkeypatch):
    """The folder of the runs, with the actor in Python's place."""
    actor = tmp_path / "actor"
    actor.write_text(ACTOR.format(python=sys.executable, output=str(real_files / "output.hdf5"),
                                  results=str(real_files / "results.npz")))
    actor.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(actor))
    monkeypatch.setattr(os, "cpu_count", lambda: 4)
    monkeypatch.setattr(runs, "wanted", lambda run: run.command)
    return tmp_path / "runs"


def played(root):
    """What was played to its end, in order."""
    journal = root / "journal"
    return [json.loads(line) for line in journal.read_text().splitlines()] if journal.exists() else []


def names(root):
    return [row["name"] for row in played(root)]


def test_finished_runs_are_kept_and_others_started(root):
    a, b = Run("a", "works"), Run("b", "works", ("--seed", "2"))
    told = []
    results = perform([a, b, a], root, report=told.append)
    assert sorted(names(root)) == ["a", "b"] and set(results) == {"a", "b"}
    assert list(results["a"].results["t"]) == [0.0, 1.0] and results["b"].record["completed"]
    assert (root / "b" / "console.txt").read_text() == "playing works\n"
    assert "[1/2] a: pysph-boiling run works" in told and "[2/2] b: pysph-boiling run works --seed 2" in told

    told.clear()
    perform([a, b, Run("c", "works")], root, report=told.append)
    assert names(root)[2:] == ["c"] and len(told) == 2 and told[0].startswith("[1/1] c: ")


def test_run_asked_for_with_other_options_is_done_again(root):
    perform([Run("a", "works", ("--seed", "1"))], root, report=str)
    perform([Run("a", "works", ("--seed", "2"))], root, report=str)
    perform([Run("a", "works", ("--seed", "2"))], root, report=str)
    assert names(root) == ["a", "a"]


def test_a_run_is_known_by_every_parameter(monkeypatch):
    from pysph_boiling.examples.dam_break import DamBreak

    before = runs.wanted(Run("a", "dam_break", ("--spacing", "0.05")))
    assert before.startswith("pysph-boiling run dam_break --spacing 0.05\n") and "DensityConstraint(" in before
    default = DamBreak.Parameters.__dataclass_fields__["duration"].default
    monkeypatch.setattr(DamBreak.Parameters.__init__, "__kwdefaults__",
                        {**DamBreak.Parameters.__init__.__kwdefaults__, "duration": default + 1.0})
    after = runs.wanted(Run("a", "dam_break", ("--spacing", "0.05")))
    assert after != before and f"duration={default + 1.0}" in after


def test_runs_that_compile_the_same_do_not_start_together(root):
    perform([Run(f"n{k}", "naps", ("--seed", str(k))) for k in range(3)], root, jobs=3, report=str)
    first, *others = sorted(played(root), key=lambda row: row["begin"])
    assert first["end"] <= min(row["begin"] for row in others)
    assert max(row["begin"] for row in others) < min(row["end"] for row in others)


def test_two_runs_of_one_name_are_refused(root):
    with pytest.raises(ValueError, match=r"two different runs are called 'a': .* --seed 2 and .* run works$"):
        perform([Run("a", "works"), Run("a", "works", ("--seed", "2"))], root, report=str)
    assert not root.exists()


def test_failure_is_reported_once_the_others_are_done(root):
    told = []
    with pytest.raises(ChildProcessError, match="these runs failed: bad, worse; each has its console.txt in") as raised:
        perform([Run("bad", "fails"), Run("good", "works"), Run("worse", "fails")], root, jobs=1, report=told.append)
    assert str(root) in str(raised.value)
    assert names(root) == ["good"] and "it broke" in (root / "bad" / "console.txt").read_text()
    assert any(line.startswith("bad: failed (the process ended with exit status 3) after") for line in told)
    with pytest.raises(ChildProcessError):  # a failed run is not taken for a finished one
        perform([Run("bad", "fails")], root, report=str)


def test_failed_final_check_is_a_finding_and_no_failure(root):
    told = []
    results = perform([Run("a", "lacks")], root, report=told.append)
    assert results["a"].record["completed"] and told[-1].startswith("a: done, but its final check failed after")


def test_interrupted_run_goes_on_from_its_last_whole_output(root):
    run = Run("a", "halts", ("--seed", "1"))
    with pytest.raises(ChildProcessError):
        perform([run], root, report=str)
    assert played(root) == []
    assert (root / "a" / "a_20.hdf5").exists()
    perform([run], root, report=str)
    assert not (root / "a" / "a_20.hdf5").exists() and SavedRun(root / "a").times == pytest.approx([0.5, 0.5])
    assert [row["restart"] for row in played(root)] == ["a_10.hdf5"]
    assert (root / "a" / "console.txt").read_text() == "playing halts\n" * 2  # both parts are there


def test_interrupted_run_with_other_options_starts_anew(root):
    with pytest.raises(ChildProcessError):
        perform([Run("a", "halts", ("--seed", "1"))], root, report=str)
    with pytest.raises(ChildProcessError):  # the actor halts whenever it starts anew
        perform([Run("a", "halts", ("--seed", "2"))], root, report=str)
    assert played(root) == [] and (root / "a" / "console.txt").read_text() == "playing halts\n"


def test_interrupt_stops_what_runs_and_the_next_call_continues_it(root):
    run = Run("a", "hangs")

    def interrupt(_):
        deadline = time.time() + 30.0
        while not (root / "a" / "pid").exists() or not (root / "a" / "pid").read_text():
            assert time.time() < deadline
            time.sleep(0.05)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        perform([run], root, report=interrupt)
    with pytest.raises(ProcessLookupError):
        os.kill(int((root / "a" / "pid").read_text()), 0)
    perform([run], root, report=str)
    assert [row["restart"] for row in played(root)] == ["a_10.hdf5"]


def test_a_timed_run_has_the_machine_to_itself(root):
    timed = [Run("timed", "naps", alone=True), Run("also", "naps", alone=True)]
    perform([timed[0], *(Run(f"n{k}", "naps") for k in range(3)), timed[1]], root, jobs=2, report=str)
    rows = {row["name"]: row for row in played(root)}
    assert len(rows) == 5
    together = [{a, b} for a, b in combinations(rows, 2)
                if rows[a]["begin"] < rows[b]["end"] and rows[b]["begin"] < rows[a]["end"]]
    assert together and not any({"timed", "also"} & pair for pair in together)
    assert max(rows[f"n{k}"]["end"] for k in range(3)) < min(rows["timed"]["begin"], rows["also"]["begin"])
    assert {rows["timed"]["threads"], rows["also"]["threads"]} == {"4"} and rows["n0"]["threads"] == "2"


# --- the command ------------------------------------------------------------------------------------------------------


with pytest.MonkeyPatch.context() as kept:
    kept.setattr("pysph_boiling.evaluation.reproduce.figure.FIGURES", dict(FIGURES))

    class Plain(Figure):
        key, title = "table9", "nothing to run"

        def make(self, results, folder, quick):
            assert results == {}
            return self.section(tables=[Table(("a",), [["b"]])], statements=[Statement("p", "o", None)])

    class Needy(Figure):
        key, title = "fig9", "one run"

        def runs(self, quick):
            return [Run("one", "works", ("--flat",) * quick)]

        def make(self, results, folder, quick):
            t = results["one"].results["t"]
            return self.section(data=[write_csv(folder / "t.csv", {"t [s]": t})],
                                statements=[Statement("two rows", f"{len(t)}", len(t) == 2)])


@pytest.fixture
def two_figures(monkeypatch):
    """Two made-up figures, of which one needs a run, in place of the paper's."""
    made = {"fig9": Needy, "table9": Plain}
    monkeypatch.setattr(command, "figures", lambda: made)
    assert not set(made.values()) & set(FIGURES.values())
    return made


def test_command_makes_sections_page_and_verdicts(root, two_figures, tmp_path):
    out, verdicts = tmp_path / "out", tmp_path / "verdicts.json"
    page = command.reproduce(["--quick", "--directory", str(out), "--json", str(verdicts)])
    assert page == out / "index.html" and "One run" in page.read_text()
    assert json.loads(verdicts.read_text()) == {"fig9": {"two rows": True}, "table9": {"p": None}}
    section = json.loads((out / "fig9" / "section.json").read_text())
    assert section["commands"] == ["pysph-boiling run works --flat"] and section["data"] == ["t.csv"]
    assert section["origins"] == [dict(machine="a machine", processor="a processor", versions=dict(python="3"),
                                       finished="2024-05-06")]
    assert "a processor (a machine)" in page.read_text()


def test_one_figure_is_made_and_the_page_keeps_the_others(root, two_figures, tmp_path):
    command.reproduce(["table9", "--directory", str(tmp_path)])
    assert names(root.parent / "runs") == []
    page = command.reproduce(["fig9", "--directory", str(tmp_path)])
    assert names(tmp_path / "runs") == ["one"]
    html = page.read_text()
    assert html.index('id="fig9"') < html.index('id="table9"') and "quick form" not in html


def test_list_prints_figures_and_runs_and_starts_none(root, two_figures, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(command.Sizes, "of", lambda self, run: Size(2, 1000, 100, 1.0))
    assert command.reproduce(["--list", "--directory", str(tmp_path / "out")]) is None
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("fig9  ") and lines[1:3] == ["  1 run, 1e+05 particle steps, about 1 s",
                                                            "    one: pysph-boiling run works"]
    assert lines[3].startswith("table9  ") and not (tmp_path / "out").exists()
    assert lines[-3].startswith("together: 1 run, 1e+05 particle steps")


@pytest.mark.parametrize("arguments, message", [
    (["fig99"], "no figure 'fig99'; did you mean 'fig9'? There are: fig9, table9"),
    (["--jobs", "0"], "--jobs must be 1 to 4, got 0"),
    (["--jobs", "5"], "--jobs must be 1 to 4, got 5")])
def test_what_cannot_be_done_is_refused_in_a_sentence(root, two_figures, capsys, arguments, message):
    assert cli.main(["reproduce", *arguments]) == 2
    assert capsys.readouterr().err == f"pysph-boiling: {message}\n"


def test_failed_run_ends_the_command_with_its_name(root, two_figures, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(two_figures["fig9"], "runs", lambda self, quick: [Run("one", "fails")])
    assert cli.main(["reproduce", "--directory", str(tmp_path)]) == 1
    assert "these runs failed: one" in capsys.readouterr().err
    assert not (tmp_path / "index.html").exists()


def test_figures_of_the_paper_come_in_its_order():
    from pysph_boiling.evaluation.reproduce.figure import figures

    keys = list(figures())
    assert len(keys) == len(set(keys)) and {"fig2", "table1", "table2"} <= set(keys)
    numbers = [(key.rstrip("0123456789"), int(key.lstrip("figtable"))) for key in keys]
    assert numbers == sorted(numbers)

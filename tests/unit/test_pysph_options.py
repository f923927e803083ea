"""PySPH's own options: each one works or is refused by name, and the documents say which."""
from pathlib import Path

import pytest
from pysph.solver.application import Application

from pysph_boiling import cli
from pysph_boiling.names import Refused
from pysph_boiling.runs import pysph_options

ROOT = Path(__file__).parents[2]


class Bare(Application):
    """What PySPH gives every application."""


def actions(application):
    """Option -> action of an application's parser; of several spellings the last."""
    return {action.option_strings[-1]: action for action in application.arg_parse._actions}


def test_every_option_of_pysph_is_in_the_table_and_nothing_else_is(tmp_path):
    known = set(actions(Bare(fname="bare", output_dir=str(tmp_path))))
    assert len(known) > 55
    assert known == pysph_options.WORKS.keys() | pysph_options.REFUSED.keys()
    assert not pysph_options.WORKS.keys() & pysph_options.REFUSED.keys()


@pytest.mark.parametrize("scene", cli.scenes())
def test_every_scene_has_what_works_and_refuses_the_rest(scene):
    found = actions(cli.scene_class(scene)())
    text = cli.scene_class(scene)().arg_parse.text("all")
    refused = {flag for flag, action in found.items() if isinstance(action, Refused)
               and action.reason.startswith("is not available in these scenes: ")}
    assert refused - pysph_options.REFUSED.keys() <= {"--restart-file"} and pysph_options.REFUSED.keys() <= refused
    assert pysph_options.WORKS.keys() - refused <= found.keys()
    assert not [flag for flag in refused if f"{flag} " in text or f"{flag}\n" in text]


@pytest.mark.parametrize("scene", ["dam_break", "heat_wave"])
@pytest.mark.parametrize("flag", pysph_options.REFUSED)
def test_refused_option_ends_the_run_with_its_name_and_reason(scene, flag, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for arguments in ([flag, "1"], [f"{flag}=1"], [flag]):
        with pytest.raises(SystemExit, match="^2$"):
            cli.main(["run", scene, *arguments])
        assert capsys.readouterr().err == (
            f"usage: pysph-boiling run {scene} [options]\npysph-boiling run {scene}: error: {flag} is not available in "
            f"these scenes: {pysph_options.REFUSED[flag]}\n")
    assert not list(tmp_path.iterdir())


def test_nothing_listens_on_the_network(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("multiprocessing.managers.BaseManager.get_server", lambda self: pytest.fail("it listens"))
    for scene in ("heated_slab", "heat_wave_tvf"):
        with pytest.raises(SystemExit, match="^2$"):
            cli.main(["run", scene, "--multiproc", "auto", "-d", str(tmp_path / "run")])
        assert "with a key that everyone knows" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("arguments", "message"), [
    ("--nnps strat_sfc", "argument --nnps: 'strat_sfc' misses neighbours: no heat flows, and a dam break is 35 % off"),
    ("--nnps sfc", "argument --nnps: 'sfc' gives wrong neighbours when they are cached"),
    ("--nnps gpu_octree", "argument --nnps: 'gpu_octree' has not been tested, since a device uses a different search"),
    ("--nnps bix", "argument --nnps: 'bix' is not one of sorted, ll, box, sh, esh, ci, comp_tree, strat_hash, tree; "),
    ("--kernel Gaussian", "argument --kernel: 'Gaussian' is not one of CubicSpline, WendlandQuintic"),
    ("--omp-schedule dynamic", "argument --omp-schedule: it must be static, dynamic or guided, a comma and a"),
    ("--omp-schedule static,x", "argument --omp-schedule: it must be static, dynamic or guided, a comma and a"),
    ("--omp-schedule often,64", "argument --omp-schedule: it must be static, dynamic or guided, a comma and a"),
    ("--openmp --no-openmp", "--openmp and --no-openmp contradict each other"),
    ("--opencl --cuda", "--opencl and --cuda contradict each other"),
    ("--nnps sh --reorder-freq 4", "--reorder-freq: the search 'sh' cannot sort particles in space"),
    ("--opencl --nnps box", "--nnps box only works on the host: a device has its own search"),
    ("--max-steps 0", "--max-steps must be >= 1 step, got 0"),
    ("--reorder-freq 0", "--reorder-freq must be >= 1 step, got 0"),
    ("--lb-freq 0", "--lb-freq must be >= 1 step, got 0"),
    ("--fname a/b", "--fname must be a name without a folder, got 'a/b': the folder is --directory"),
])
def test_value_that_is_not_served_is_refused(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    try:
        status = cli.main(["run", "dam_break", *arguments.split()])
    except SystemExit as error:  # argparse
        status = error.code
    assert status == 2 and message in " ".join(capsys.readouterr().err.split())
    assert not list(tmp_path.iterdir())


def test_page_is_the_table():
    assert (ROOT / "docs" / "options.md").read_text() == pysph_options.table()


def test_help_is_that_of_the_page(capsys):
    with pytest.raises(SystemExit):
        cli.main(["run", "dam_break", "--help", "pysph"])
    text = " ".join(capsys.readouterr().out.split())
    assert "default: None" not in text and "](" not in text
    assert "Time step [s], in place of --substeps." in text and "HSFC (docs/ranks.md)" in text

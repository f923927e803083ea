"""The folder of a run: what the user has there stays, what an earlier run left there goes, and both are told."""
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from pysph_boiling.cli import main
from pysph_boiling.files import Manifest, output_files, read_output
from pysph_boiling.results import load_results

OURS = {"MANIFEST", "dam_break.info", "dam_break.log", "profile_info.csv", "results.npz", "run.json"}
FRAME = 6  # steps between two particle files


def dam(folder, *options, tf=0.06, pictures=False):
    """Run a small dam break to ``tf`` [s]; the exit status."""
    plain = () if pictures else ("--no-pictures",)
    return main(["run", "dam_break", "--quick", "--tf", str(tf), *plain, "-d", str(folder), *options])


def slab(folder, *options):
    return main(["run", "heated_slab", "--tf", "10", "--no-pictures", "-d", str(folder), *options])


def names(folder):
    return {path.relative_to(folder).as_posix() for path in Path(folder).rglob("*") if path.is_file()}


def particle_files(steps):
    return {f"dam_break_{step:05d}.hdf5" for step in range(0, steps + 1, FRAME)}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A finished run with its pictures, to be copied."""
    folder = tmp_path_factory.mktemp("finished")
    assert dam(folder, pictures=True) == 0
    return folder


@pytest.fixture
def copy(run, tmp_path):
    return shutil.copytree(run, tmp_path / "copy")


def test_files_of_the_user_stay(tmp_path):
    mine = ["dam_break_2d_experiment.npz", "dam_break_2019_measured.hdf5", "dam_break_1234.hdf5", "film.part",
            "dam_break_00006.npz", "results.tmp.npz", "run.tmp", "frames/frame_title.png", "notes/run.json"]
    for name in mine:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(name)
    for tf in (0.06, 0.04):
        assert dam(tmp_path, tf=tf) == 0
        assert main(["render", str(tmp_path)]) == 0
        assert all((tmp_path / name).read_text() == name for name in mine)
        assert {Path(file).name for file in output_files(tmp_path)} == particle_files(round(tf / 0.02) * FRAME)


@pytest.mark.parametrize("name", ["results.npz", "run.json", "MANIFEST", "dam_break.info", "profile_info.csv",
                                  "dam_break_00012.hdf5", "history.png", "front.png", "frames/frame_00003.png"])
def test_file_of_the_user_in_the_way_is_named_and_nothing_is_written(tmp_path, name, capsys):
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).write_text("mine")
    assert dam(tmp_path, pictures=True) == 2
    assert f"holds {name}, which pysph_boiling did not write" in capsys.readouterr().err
    assert names(tmp_path) == {name} and (tmp_path / name).read_text() == "mine"


def test_folder_of_another_scene_is_refused(copy, capsys):
    before = {name: (copy / name).read_bytes() for name in names(copy)}
    assert slab(copy) == 2
    assert "holds a run of dam_break: choose another folder with --directory" in capsys.readouterr().err
    assert slab(copy, "--resume") == 2
    assert "a run of dam_break cannot be resumed as heated_slab" in capsys.readouterr().err
    assert {name: (copy / name).read_bytes() for name in names(copy)} == before


def test_second_run_replaces_the_first_and_says_so(copy, capsys):
    drawn = {"front.png", "history.png", "frames.png", *(f"frames/frame_{k:05d}.png" for k in range(4))}
    assert names(copy) == OURS | particle_files(18) | drawn
    assert main(["render", str(copy), "--every", "2", "--movie", "gif"]) == 0
    assert names(copy) == OURS | particle_files(18) | drawn - {f"frames/frame_{k:05d}.png" for k in (2, 3)} | {
        "movie.gif"}
    capsys.readouterr()
    assert dam(copy, tf=0.04) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "removed an earlier run of this scene from" in said and "4 particle files, 9 others" in said
    assert names(copy) == OURS | particle_files(12)
    assert len(load_results(copy)["t"]) == 12


def test_restart_takes_back_what_came_later(copy, capsys):
    (copy / "dam_break_00018_kept.hdf5").write_text("mine")
    assert dam(copy, "--restart-file", output_files(copy)[1], "--viscosity.rate", "9", "--max-steps", "10") == 0
    assert "removed the output after t = 0.02 s" in " ".join(capsys.readouterr().out.split())
    assert names(copy) == OURS | particle_files(6) | {"dam_break_00010.hdf5", "dam_break_00018_kept.hdf5"}
    assert dam(copy, "--resume", "--viscosity.rate", "9") == 0
    files, results = output_files(copy), load_results(copy)
    assert [Path(file).name[-10:-5] for file in files] == ["00000", "00006", "00010", "00012", "00018"]
    np.testing.assert_allclose(np.diff(results["t"]), results["dt"][0], rtol=1e-9)
    assert len(results["t"]) == 18 and results["t"][-1] == pytest.approx(float(read_output(files[-1])[1]["t"]))


def test_resume_keeps_what_is_there(copy, capsys):
    before = names(copy)
    assert dam(copy, "--resume", tf=0.08) == 0
    assert "removed" not in capsys.readouterr().out
    assert names(copy) == before | {"dam_break_00024.hdf5"}


def test_what_a_killed_run_was_writing_goes(copy):
    for name in (".dam_break_00012.hdf5.part", ".results.npz.part", "film.part", ".film.part"):
        (copy / name).write_text("half")
    assert dam(copy, "--resume", tf=0.06) == 0
    assert {name for name in names(copy) if name.endswith(".part")} == {"film.part", ".film.part"}


def test_folder_of_an_earlier_version_is_ours(copy):
    (copy / "MANIFEST").unlink()
    (copy / "dam_break_other.hdf5").write_text("mine")
    assert dam(copy, tf=0.02) == 0
    assert names(copy) == OURS | particle_files(6) | {"dam_break_other.hdf5"}


def test_pictures_of_the_user_are_not_drawn_over(copy, capsys):
    (copy / "movie.gif").write_text("mine")
    assert main(["render", str(copy), "--movie", "gif"]) == 2
    assert "holds movie.gif, which pysph_boiling did not write" in capsys.readouterr().err
    assert (copy / "movie.gif").read_text() == "mine"


def test_files_of_two_runs_are_told_apart(copy, tmp_path, capsys):
    other = copy / "sloshing_00000.hdf5"
    shutil.copy(output_files(copy)[0], other)
    assert str(other) not in output_files(copy)
    for name in ("MANIFEST", "run.json"):
        os.remove(copy / name)
    with pytest.raises(ValueError, match="particle files of several runs, dam_break, sloshing"):
        output_files(copy)
    assert main(["render", str(copy)]) == 2


def test_manifest_lists_before_and_removes_what_it_lists(tmp_path):
    listed = Manifest(tmp_path)
    listed.claim("a.txt", "b.txt")
    for name in ("a.txt", "c.txt"):
        (tmp_path / name).write_text(name)
    again = Manifest(tmp_path)
    assert again.known == {"MANIFEST", "a.txt", "b.txt"}
    with pytest.raises(FileExistsError, match=r"holds c.txt"):
        again.claim("b.txt", "c.txt")
    assert again.remove(lambda name: name == "a.txt") == ["a.txt"]
    assert Manifest(tmp_path).known == {"MANIFEST", "b.txt"} and names(tmp_path) == {"MANIFEST", "c.txt"}

"""What a newcomer sees: the demo fits a screen, warns of nothing, and ends in a picture of water; own scenes; old runs.

The commands run as a user types them, because warnings and what a library prints count too.
"""
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).parents[2]
SCREEN = 24, 100  # lines and columns
COMPILING = 9  # lines that the first run prints before: two searches, the stages in two lines, and one for each of five
HIDE = "import sys; sys.modules['pysplashsurf'] = None; "  # as if it were not installed
OWN = '''
"""A scene of my own."""
from pysph_boiling.examples.heated_slab import HeatedSlab


class MySlab(HeatedSlab):
    title = ""


if __name__ == "__main__":
    MySlab().run()
'''
PYSPH_STYLE = '''
from pysph_boiling.examples.heated_slab import HeatedSlab


class Mine(HeatedSlab):
    def post_process(self, info_fname_or_directory):
        info = self.read_info(info_fname_or_directory)
        print(info["fname"], len(self.output_files), self.parameters.T_1, self.output_dir)


if __name__ == "__main__":
    app = Mine()
    app.run()
    app.post_process(app.info_filename)
'''


def run(folder, *arguments, code="", status=0):
    """What a command prints on stdout and on stderr; ``code`` is executed before it."""
    program = f"{code}from pysph_boiling.cli import main; sys.exit(main())" if code else None
    start = [sys.executable, "-c", program] if code else [sys.executable, "-m", "pysph_boiling"]
    done = subprocess.run([*start, *map(str, arguments)], cwd=folder, capture_output=True, text=True, check=False,
                          env={**os.environ, "OMP_NUM_THREADS": "1", "COLUMNS": "100", "PYTHONPATH": str(ROOT)})
    assert done.returncode == status, done.stdout + done.stderr
    return done.stdout, done.stderr


def program(folder, name, text, *arguments):
    """What a scene in a file of its own prints."""
    (folder / name).write_text(text)
    done = subprocess.run([sys.executable, name, *map(str, arguments)], cwd=folder, capture_output=True, text=True,
                          check=True, env={**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)})
    return done.stdout


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    """The folder of a short demo, and what it printed."""
    folder = tmp_path_factory.mktemp("demo")
    run(folder, "run", "steady_boiling", "--demo", "--tf", "0.001", "-q", "--no-pictures", "-d", "compiles")
    return folder, run(folder, "run", "steady_boiling", "--demo", "--tf", "0.1")


def test_demo_fits_a_screen_warns_of_nothing_and_ends_in_a_picture_of_water(demo):
    folder, (out, err) = demo
    lines = out.splitlines()
    assert err == "" and "warning" not in out.lower()
    assert len(lines) + COMPILING <= SCREEN[0] and max(map(len, lines)) <= SCREEN[1], out
    assert lines[-1] == "as water: steady_boiling_output/surface.png"
    assert "pictures there: history.png, frames.png" in lines
    with Image.open(folder / "steady_boiling_output" / "surface.png") as opened:
        picture = np.asarray(opened.convert("RGB"), dtype=float)
    assert picture.shape == (600, 800, 3)
    blue = picture[..., 2] - picture[..., 0] > 25.0  # water is blue, the room and its floor are not
    assert 0.1 < blue.mean() < 0.5


def test_without_the_extra_the_demo_says_how_to_get_the_picture(demo):
    folder, _ = demo
    out, _ = run(folder, "run", "steady_boiling", "--demo", "--tf", "0.001", "-d", "bare", code=HIDE)
    assert out.splitlines()[-1] == ("for a picture as water: pysplashsurf is missing: pip install "
                                    "'pysph_boiling[view]', then pysph-boiling render bare --view surface")
    assert (folder / "bare" / "frames.png").exists() and not (folder / "bare" / "surface.png").exists()


def test_post_process_draws_a_moved_run_again_and_computes_nothing(demo):
    folder, (first, _) = demo
    moved = folder / "moved"
    shutil.copytree(folder / "steady_boiling_output", moved)
    pictures = {name: (moved / name).read_bytes() for name in ("frames.png", "history.png", "surface.png")}
    kept = {path.name: path.read_bytes() for path in moved.iterdir() if path.suffix in (".npz", ".json", ".hdf5")}
    for name in pictures:
        (moved / name).unlink()
    computes = "import pysph_boiling.schemes.solver as s; s.build_side_by_side = None; "
    out, _ = run(folder, "run", "steady_boiling", "--post-process", moved, code=f"import sys; {computes}")
    assert "read from moved: results.npz (72 rows), run.json, 3 particle files" in out
    assert [line for line in out.splitlines() if line.startswith(("time", "conservation", "the final"))] == [
        line for line in first.splitlines() if line.startswith(("time", "conservation", "the final"))]
    assert {name: (moved / name).read_bytes() for name in pictures} == pictures
    assert all((moved / name).read_bytes() == data for name, data in kept.items()), "the run itself was changed"


def test_post_process_of_what_is_no_run_of_this_scene_is_refused(demo):
    folder, _ = demo
    for where, scene, said in (("nowhere", "steady_boiling", "there is no run in nowhere"),
                               ("steady_boiling_output", "cooling", "holds a run of steady_boiling, not of cooling"),
                               ("steady_boiling_output", "reuse_wcsph", "of steady_boiling, not of reuse_wcsph")):
        assert said in run(folder, "run", scene, "--post-process", where, status=2)[1]


def test_post_process_makes_the_final_check_again(tmp_path):
    run(tmp_path, "run", "heated_slab", "--tolerance", "1e-9", "-q", "--no-pictures", status=1)
    out, err = run(tmp_path, "run", "heated_slab", "--post-process", "heated_slab_output/heated_slab.info", status=1)
    assert "the final check failed: L2 error" in err and "pictures there: profile.png, history.png" in out


def test_own_scene_has_the_name_of_its_file(tmp_path):
    out = program(tmp_path, "my_boil.py", OWN, "--no-pictures")
    record = json.loads((tmp_path / "my_boil_output" / "run.json").read_text())
    assert record["scene"] == record["fname"] == "my_boil" and out.startswith("my boil: ")
    assert (tmp_path / "my_boil_output" / "my_boil_00000.hdf5").exists()
    assert "read from my_boil_output" in program(tmp_path, "my_boil.py", OWN, "--post-process", "my_boil_output")


def test_post_process_of_a_user_of_pysph_is_called_in_both_ways(tmp_path):
    out = program(tmp_path, "mine.py", PYSPH_STYLE, "--T-1", "370", "--no-pictures", "-q")
    assert out.split() == ["mine", "13", "370.0", str(tmp_path / "mine_output")]
    out = program(tmp_path, "mine.py", PYSPH_STYLE, "--post-process", "mine_output")
    assert out.split() == ["mine", "13", "370.0", str(tmp_path / "mine_output")], "once, without a run"

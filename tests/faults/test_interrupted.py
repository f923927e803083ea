"""Runs that die: killed while they write, no room on the disk, Ctrl-C. Whole files stay, and --resume goes on."""
import json
import os
import random
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from same import assert_same_results

from pysph_boiling.files import check_output, output_files, read_output
from pysph_boiling.phases import Phase
from pysph_boiling.results import load_results
from pysph_boiling.runs.progress import Interrupt, Stopped

# within .7 s this pool vaporises, bursts, merges, vents and, once its heater is off, condenses; it writes every 5 steps
SCENE = ["cooling", "--flat", "--width", "30", "--fill", "14", "--sites", "1", "--duration", "0.7", "--heater-until",
         "0.4", "--superheat", "60", "--superheat-limit", "5", "--seed", "1", "--frame", "0.005", "--no-pictures",
         "--openmp"]
HAPPENS = dict(n_nucleated=20, n_burst=1, n_condensed=1, n_vented=1)  # column -> at least so many after the resume


def command(folder, *more):
    return [sys.executable, "-m", "pysph_boiling", "run", *SCENE, "--directory", str(folder), *more]


def environment():
    return {**os.environ, "OMP_NUM_THREADS": "1", "OMP_WAIT_POLICY": "passive"}


def finish(folder, *more):
    return subprocess.run(command(folder, *more), capture_output=True, text=True, env=environment(), check=False)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    finish(folder)
    assert json.loads((folder / "run.json").read_text())["completed"]
    return folder


def wait_for(folder, n):
    """Until the run has written ``n`` particle files."""
    begin = time.time()
    while len(output_files(folder)) < n:
        assert time.time() - begin < 300.0, "the run writes nothing"
        time.sleep(0.01)


def goes_on(folder, whole, t):
    """Resume from ``t`` to the end: enough happens after it, to the same bits as in ``whole``; the results."""
    assert finish(folder, "--resume").returncode in (0, 1)  # 1: the pool is too small for the scene's final check
    ours, theirs = load_results(folder), load_results(whole)
    for name, least in HAPPENS.items():
        happened = theirs[name][-1] - theirs[name][np.searchsorted(theirs["t"], t)]
        assert happened >= least, f"{name}: {happened} after the last resume"
    assert_same_results(ours, theirs)
    return ours


def merges(files):
    """How often two bubbles of one file are one bubble in the next."""
    count, before = 0, {}
    for file in files:
        fluid = read_output(file)[0]["fluid"]
        vapour = fluid.phase == Phase.VAPOUR
        now = dict(zip(fluid.uid[vapour].tolist(), fluid.bubble[vapour].tolist()))
        came_from = {}
        for uid in now.keys() & before.keys():
            came_from.setdefault(now[uid], set()).add(before[uid])
        count += sum(len(labels) - 1 for labels in came_from.values())
        before = now
    return count


def test_run_killed_at_random_goes_on_as_if_it_had_not_been(whole, tmp_path):
    """Five times, at random moments early in the run; what happens after the last resume is counted."""
    chance, total = random.Random(1), len(output_files(whole))
    for share in (0.01, 0.03, 0.05, 0.07, 0.09):
        with subprocess.Popen(command(tmp_path, "--resume"), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              env=environment()) as run:
            wait_for(tmp_path, max(2, int(share * total)))
            time.sleep(chance.uniform(0.0, 0.1))
            run.send_signal(signal.SIGKILL)
            assert run.wait() == -signal.SIGKILL
        for file in output_files(tmp_path):
            check_output(file)  # every one is whole, not only the last
        load_results(tmp_path)
        assert json.loads((tmp_path / "run.json").read_text())["completed"] is False
    t, n = float(read_output(output_files(tmp_path)[-1])[1]["t"]), len(output_files(tmp_path))
    ours = goes_on(tmp_path, whole, t)
    assert merges(output_files(tmp_path)[n - 1:]) >= 1
    assert max(ours["energy_residual"]) <= 1e-10 and not ours["mass_residual"].any()
    assert len(output_files(tmp_path)) == total
    assert not list(tmp_path.glob("*.part")), "what the killed runs were writing lies about"


def stop(run):
    """Ctrl-C; what the run says."""
    run.send_signal(signal.SIGINT)
    complaint = run.communicate(timeout=120)[1]
    assert "Traceback" not in complaint and "ignored" not in complaint, complaint
    assert run.returncode == 130, "the exit status says that it was interrupted"
    return " ".join(complaint.split())


def test_ctrl_c_ends_between_two_steps_and_the_run_goes_on(whole, tmp_path):
    """Three times early in the run, whatever it is doing; what happens after the last resume is counted."""
    for files in (3, 8, 13):
        with subprocess.Popen(command(tmp_path, "--resume"), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                              env=environment(),
                              preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)) as run:
            wait_for(tmp_path, files)
            assert "--resume continues" in stop(run)
        assert json.loads((tmp_path / "run.json").read_text())["completed"] is False
        t = float(read_output(output_files(tmp_path)[-1])[1]["t"])
        assert load_results(tmp_path)["t"][-1] == pytest.approx(t) and 0.0 < t < 0.7
    goes_on(tmp_path, whole, t)


@pytest.mark.parametrize("before", [signal.SIG_IGN, lambda number, frame: None], ids=["ignored", "handled"])
def test_a_handler_of_the_user_stays(before):
    kept = signal.signal(signal.SIGINT, before)
    try:
        with Interrupt():
            assert signal.getsignal(signal.SIGINT) is before
        assert signal.getsignal(signal.SIGINT) is before
    finally:
        signal.signal(signal.SIGINT, kept)


def test_ctrl_c_waits_for_the_step_and_a_second_one_does_not():
    kept, interrupt = signal.signal(signal.SIGINT, signal.default_int_handler), Interrupt()
    try:
        with interrupt:
            interrupt.pre_step(None)
            signal.raise_signal(signal.SIGINT)
            with pytest.raises(Stopped):
                interrupt.pre_step(None)
            with pytest.raises(KeyboardInterrupt) as second:
                signal.raise_signal(signal.SIGINT)
            assert second.type is KeyboardInterrupt
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, kept)


def limited():
    """As if the disk were full: no file may grow beyond 60 kB."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))


def test_full_disk_is_a_clear_error_and_earlier_output_stays(whole, tmp_path):
    for file in output_files(whole)[:3]:
        (tmp_path / os.path.basename(file)).write_bytes(open(file, "rb").read())
    for name in ("results.npz", "run.json"):
        (tmp_path / name).write_bytes((whole / name).read_bytes())
    done = subprocess.run(command(tmp_path, "--resume"), capture_output=True, text=True, env=environment(),
                          preexec_fn=limited, check=False)
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert "cannot be written" in done.stderr, done.stderr
    kept = output_files(tmp_path)
    assert [os.path.basename(file) for file in kept] == [os.path.basename(file) for file in output_files(whole)[:3]]
    for file in kept:
        check_output(file)
    load_results(tmp_path)


@pytest.mark.parametrize("folder", ["in the way/folder", "read-only"])
def test_folder_that_cannot_be_written_is_a_clear_error(tmp_path, folder):
    (tmp_path / "in the way").write_text("")
    (tmp_path / "read-only").mkdir(mode=0o500)
    folder = tmp_path / folder
    if folder.exists() and os.geteuid() == 0:
        folder = Path("/proc/self")  # permissions do not stop root, this file system does
    before = sorted(tmp_path.rglob("*"))
    done = finish(folder)
    assert done.returncode == 2 and "Traceback" not in done.stderr
    assert f"the output folder '{folder}' cannot be written to" in " ".join(done.stderr.split())
    assert sorted(tmp_path.rglob("*")) == before

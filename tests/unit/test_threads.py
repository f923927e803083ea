"""How idle threads wait: what a process is given, and that a choice of the user's stays."""
import os
import signal
import subprocess
import sys

import pytest

from pysph_boiling.threads import variables, wait_briefly


@pytest.mark.parametrize(("policy", "spins"), [(None, "1000"), ("active", None)])
def test_a_policy_of_the_user_stays(monkeypatch, policy, spins):
    for name in ("OMP_WAIT_POLICY", "GOMP_SPINCOUNT"):
        monkeypatch.delenv(name, raising=False)
    if policy:
        monkeypatch.setenv("OMP_WAIT_POLICY", policy)
    wait_briefly()
    assert os.environ["OMP_WAIT_POLICY"] == (policy or "passive") and os.environ.get("GOMP_SPINCOUNT") == spins


def test_timed_processes_wait_alike_whatever_the_user_set(monkeypatch):
    monkeypatch.setenv("OMP_WAIT_POLICY", "active")
    monkeypatch.setenv("KEPT", "1")
    given = variables(2)
    assert {name: given[name] for name in ("OMP_WAIT_POLICY", "GOMP_SPINCOUNT", "OMP_NUM_THREADS", "KEPT")} == dict(
        OMP_WAIT_POLICY="passive", GOMP_SPINCOUNT="1000", OMP_NUM_THREADS="2", KEPT="1")


def test_process_that_works_for_another_ends_on_ctrl_c_without_a_word():
    program = ("from pysph_boiling.threads import end_on_interrupt; import signal; end_on_interrupt(); "
               "print('ready', flush=True); signal.pause()")
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                          text=True) as process:
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGINT)
        assert process.communicate(timeout=30) == ("", "") and process.returncode == -signal.SIGINT

"""Jobs in processes of their own: what they return, how each way to fail is reported, and that none is left behind."""
import os
import signal
import sys
import time

import pytest

from pysph_boiling.runs.jobs import Job, run_job, run_jobs


def python(text, **more):
    return Job(name="it", command=(sys.executable, "-c", text), **more)


def divide(a, b):
    print("dividing")
    return a / b


def nap(seconds, folder, name):
    (folder / name).write_text(str(os.getpid()))
    begin = time.time()
    time.sleep(seconds)
    return begin, time.time()


def fill(size):
    return len(bytearray(size))


def variable(name):
    return os.environ.get(name)


def die(number):
    os.kill(os.getpid(), number)


def test_outcomes_come_in_the_order_of_the_jobs():
    jobs = [Job(name="slow", call=(divide, 6.0, 2.0)), python(""), Job(name="c", call=(divide, 1.0, 2.0))]
    seen = []
    outcomes = run_jobs(jobs, 2, started=lambda job: seen.append(job.name), ended=lambda one: seen.append(one.status))
    assert [outcome.result() for outcome in outcomes] == [3.0, None, 0.5] and seen[:2] == ["slow", "it"]
    assert [outcome.job for outcome in outcomes] == jobs and seen.count(0) == 3 and len(seen) == 6
    assert run_jobs([]) == []


@pytest.mark.parametrize(("job", "status", "failure"), [
    (python("raise SystemExit(3)"), 3, "the process ended with exit status 3"),
    (python("import os; os.abort()"), -6, "the process was ended by SIGABRT"),
    (python("import time; time.sleep(60)", time_limit=0.5), -15, "the process took longer than 0.5 s"),
    (python("bytearray(2**31)", memory_limit=2**30), 1, "the process ended with exit status 1"),
    (Job(name="it", call=(divide, 1, 0)), 0, "ZeroDivisionError: division by zero"),
    (Job(name="it", call=(sys.exit, 3)), 3, "the process ended with exit status 3"),
    (Job(name="it", call=(die, signal.SIGKILL)), -9, "the process was ended by SIGKILL"),
    (Job(name="it", call=(time.sleep, 60), time_limit=0.5), -15, "the process took longer than 0.5 s"),
    (Job(name="it", call=(fill, 2**33), memory_limit=2**32), 0, "the process ran out of memory (it may use 4 GiB)"),
], ids=lambda value: str(value)[-40:] if isinstance(value, str) else "")
def test_each_way_to_fail_is_told(job, status, failure):
    outcome = run_job(job)
    assert (outcome.status, outcome.failure, outcome.value) == (status, failure, None)
    with pytest.raises(ChildProcessError, match="^it: "):
        outcome.result()


def test_a_job_that_stays_when_it_is_asked_to_end_is_killed(monkeypatch):
    monkeypatch.setattr("pysph_boiling.runs.jobs.PATIENCE", 0.2)
    stubborn = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); time.sleep(60)"
    assert run_job(python(stubborn, time_limit=2.0)).status == -signal.SIGKILL


def test_a_failure_stops_no_other_job(tmp_path):
    outcomes = run_jobs([Job(name="a", call=(divide, 1, 0)), Job(name="b", call=(divide, 1, 1))])
    assert outcomes[0].failure and outcomes[1].result() == 1.0


def test_logs_environment_and_directory(tmp_path):
    log = tmp_path / "log"
    log.write_text("before\n")
    job = python("import os; print(os.environ['JOB'], os.getcwd())", log=log, directory=tmp_path,
                 environment={**os.environ, "JOB": "one"})
    assert run_job(job).output == f"before\none {tmp_path}\n"
    assert run_job(Job(name="a", call=(divide, 1, 1), log=log)).output.endswith("dividing\n")
    assert run_job(Job(name="a", call=(variable, "JOB"), environment={**os.environ, "JOB": "two"})).value == "two"
    assert "JOB" not in os.environ and run_job(Job(name="a", call=(variable, "JOB"))).value is None


def test_what_is_alone_has_the_machine_to_itself_and_others_are_held(tmp_path):
    def job(name, **more):
        return Job(name=name, call=(nap, 0.3, tmp_path, name), **more)

    held = []

    def hold(running):
        held.append([one.name for one in running])
        return "first" in held[-1]

    times = {one.job.name: one.value for one in run_jobs(
        [job("first"), job("b"), job("c"), job("alone", alone=True), job("d")], 3, hold=hold)}
    assert times["first"][1] <= min(times["b"][0], times["c"][0])
    assert max(times["b"][1], times["c"][1]) <= times["alone"][0] and times["alone"][1] <= times["d"][0]


@pytest.mark.parametrize("kind", ["call", "command"])
def test_ctrl_c_ends_what_runs(tmp_path, kind):
    write = f"open({str(tmp_path / 'pid')!r}, 'w').write(str(os.getpid()))"
    job = python(f"import os, time; {write}; time.sleep(60)") if kind == "command" else Job(
        name="it", call=(nap, 60, tmp_path, "pid"))

    def interrupt(running):
        if running and (tmp_path / "pid").exists() and (tmp_path / "pid").read_text():
            raise KeyboardInterrupt
        return bool(running)

    with pytest.raises(KeyboardInterrupt):
        run_jobs([job, job], 2, hold=interrupt)
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "pid").read_text()), 0)


@pytest.mark.parametrize("what", [{}, {"command": ("true",), "call": (divide, 1, 1)}])
def test_a_job_is_a_command_or_a_call(what):
    with pytest.raises(ValueError, match="job 'a' needs a command or a call, and not both"):
        Job(name="a", **what)

"""Compiled modules: cut off, empty, foreign, made by two at once, locked by the dead, or with no place to be."""
import multiprocessing
import os
import signal
import time
from pathlib import Path

import pytest
from pysph.sph import acceleration_eval_cython_helper

from pysph_boiling import cli
from pysph_boiling.schemes import cache, solver
from pysph_boiling.schemes.cache import CheckedModule

SOURCE = "answer = 42\n"
FORK = multiprocessing.get_context("fork")


@pytest.fixture
def told(monkeypatch):
    """What is said."""
    sentences = []
    monkeypatch.setattr(CheckedModule, "say", sentences.append)
    return sentences


@pytest.fixture
def compiled(monkeypatch):
    """Which modules are compiled, by a compiler that writes down the source."""
    built = []

    def build(self, force=False):
        built.append(self.name)
        Path(self.ext_path).write_text(f"compiled from {Path(self.src_path).read_text()}")

    monkeypatch.setattr(CheckedModule, "build", build)
    monkeypatch.setattr(CheckedModule, "load", lambda self: self.write_and_build() or Path(self.ext_path).read_text())
    return built


def module(folder, source=SOURCE):
    return CheckedModule(source, root=str(folder))


def test_module_is_compiled_once(tmp_path, told, compiled):
    assert [module(tmp_path).load() for _ in range(3)] == [f"compiled from {SOURCE}"] * 3
    assert len(compiled) == 1 and told == ["compiling a set of equations, which takes 20 to 60 s; later runs reuse it"]
    assert module(tmp_path).whole() and not module(tmp_path, "other").whole()


@pytest.mark.parametrize("spoil", [
    lambda m: os.truncate(m.ext_path, 20), lambda m: os.truncate(m.ext_path, 0),
    lambda m: Path(m.ext_path).write_text("compiled from something else"), lambda m: os.unlink(m.ext_path),
    lambda m: os.unlink(m.sum_path), lambda m: os.truncate(m.sum_path, 10),
    lambda m: (os.truncate(m.src_path, 4), os.unlink(m.ext_path)),
    lambda m: (os.mkdir(m.lock_path), os.unlink(m.ext_path)),  # PySPH's own lock, left behind
], ids=["cut off", "empty", "foreign", "gone", "no checksum", "checksum cut off", "source cut off", "lock of PySPH"])
def test_what_is_not_whole_is_made_again(tmp_path, told, compiled, spoil):
    module(tmp_path).load()
    spoil(module(tmp_path))
    begin = time.perf_counter()
    assert module(tmp_path).load() == f"compiled from {SOURCE}"
    assert len(compiled) == 2 and module(tmp_path).whole() and time.perf_counter() - begin < 5.0


def test_module_older_than_pysph_is_made_again(tmp_path, told, compiled):
    def own():
        return CheckedModule(SOURCE, root=str(tmp_path), depends=["pysph.base.nnps_base"])

    own().load()
    os.utime(own().ext_path, (0, 0))
    own().load()
    assert len(compiled) == 2


def test_whoever_comes_second_waits_and_says_for_whom(tmp_path, told, compiled, monkeypatch):
    """Another process compiles the module; this one waits for it, and takes what it has made."""
    begun, go_on = FORK.Event(), FORK.Event()

    def other():
        def slow(self, force=False):
            begun.set()
            go_on.wait(30)
            Path(self.ext_path).write_text("compiled by the other")

        CheckedModule.build = slow
        module(tmp_path).load()

    process = FORK.Process(target=other)
    process.start()
    assert begun.wait(30) and not module(tmp_path).whole()
    monkeypatch.setattr(CheckedModule, "say", staticmethod(lambda sentence: (told.append(sentence), go_on.set())))
    assert module(tmp_path).load() == "compiled by the other" and compiled == []
    assert told == [f"waiting for process {process.pid}, which is compiling the same module ({module(tmp_path).name})"]
    process.join()


def test_lock_of_a_process_that_was_killed_is_free(tmp_path, told, compiled):
    begun = FORK.Event()

    def other():
        CheckedModule.build = lambda self, force=False: (begun.set(), time.sleep(60))
        module(tmp_path).load()

    process = FORK.Process(target=other)
    process.start()
    assert begun.wait(30)
    os.kill(process.pid, signal.SIGKILL)
    process.join()
    assert module(tmp_path).load() == f"compiled from {SOURCE}" and len(compiled) == 1
    assert not any("waiting" in sentence for sentence in told)


def test_home_that_cannot_be_written_to_is_one_message_at_once(tmp_path, monkeypatch, capsys):
    """Before a compiler is started, and without the modules that are there already."""
    monkeypatch.setattr(multiprocessing.get_context("fork"), "Process", lambda **_: pytest.fail("compiled"))
    (tmp_path / "file").touch()
    monkeypatch.setenv("HOME", str(tmp_path / "file" / "home"))
    begin = time.perf_counter()
    assert cli.main(["run", "heated_slab", "--no-pictures", "-d", str(tmp_path / "run")]) == 2
    err = capsys.readouterr().err
    assert f"compiled modules are kept in {tmp_path}/file/home/.pysph/source/" in err and len(err.splitlines()) == 1
    assert "which cannot be written to (Not a directory): set the environment variable HOME to a writable" in err
    assert time.perf_counter() - begin < 10.0


def test_scenes_of_pysphs_own_schemes_load_checked_modules_too(monkeypatch):
    loaded = []
    monkeypatch.setattr(cli, "scene_class", lambda name: type("Scene", (), dict(
        num_procs=1, arg_parse=type("Parser", (), {})(), __init__=lambda self: None,
        run=lambda self, arguments: loaded.append(acceleration_eval_cython_helper.ExtModule))))
    monkeypatch.setattr(cli, "explain", lambda error: pytest.fail(repr(error)))
    assert cli.main(["run", "heat_wave"]) == 0
    assert loaded == [cache.CheckedModule] and issubclass(solver.VectorModule, cache.CheckedModule)
    assert acceleration_eval_cython_helper.ExtModule is not cache.CheckedModule

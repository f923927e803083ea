"""Checksums for PySPH's cache of compiled modules: an incomplete or foreign module is compiled again, not loaded.

PySPH loads any file with the name of a module. Here each module has a checksum in a file ``m_HASH.sum`` beside it. This
file is also the lock for compiling the module; the system releases it when a process ends for any reason.
"""
import os
from contextlib import contextmanager, suppress
from functools import partial
from hashlib import sha256
from pathlib import Path

from compyle.ext_module import ExtModule, get_platform_dir
from Cython.Compiler import Errors

try:
    import fcntl
except ImportError:  # on Windows two simultaneous first runs may compile a module twice
    fcntl = None

__all__ = ["CheckedModule"]

NO_WARNINGS = 10  # a level that none of Cython's warnings has


class CheckedModule(ExtModule):
    """A compiled module of PySPH that is loaded only if its checksum is right.

    ``say`` is called with a sentence before the module is compiled, if ``announces`` is true, and before it waits for
    another process that compiles it. ``what`` names the module in the sentence.

    Errors: ``OSError`` if the module is not in the cache and the cache cannot be written to.
    """

    say = staticmethod(partial(print, flush=True))
    announces = True
    what = "a set of equations, which takes 20 to 60 s"

    @classmethod
    def of(cls, source, **options):
        """The module for a ``source`` in PySPH's cache; nothing is compiled."""
        return cls(source, root=os.path.expanduser(os.path.join("~", ".pysph", "source", get_platform_dir())),
                   depends=["pysph.base.nnps_base"], **options)

    @property
    def sum_path(self):
        return os.path.splitext(self.src_path)[0] + ".sum"

    def whole(self):
        """Whether the module exists, is unchanged since it was compiled, and fits the installed PySPH."""
        try:
            found = sha256(Path(self.ext_path).read_bytes()).hexdigest()
            return found == Path(self.sum_path).read_text() and not self._dependencies_have_changed()
        except OSError:
            return False

    def check_writable(self):
        """Raise ``OSError`` if the cache cannot be written to, before the compiler is started."""
        with self.open_sum():
            pass

    def write_and_build(self):
        if self.whole():
            return
        with self._lock() as checksum:
            if self.whole():  # the process that held the lock has made it
                return
            if self.announces:
                self.say(f"compiling {self.what}; later runs reuse it")
            checksum.truncate(0)
            checksum.write(f"process {os.getpid()}")
            checksum.flush()
            with suppress(FileNotFoundError):
                os.unlink(self.ext_path)  # a process that has loaded it keeps its copy
            Path(self.src_path).write_text(self.code, encoding="utf-8")
            self.build(force=True)
            checksum.truncate(0)
            checksum.write(sha256(Path(self.ext_path).read_bytes()).hexdigest())

    def build(self, force=False):
        """Compile without Cython's warnings about PySPH's own declarations."""
        level, Errors.LEVEL = Errors.LEVEL, NO_WARNINGS
        try:
            super().build(force)
        finally:
            Errors.LEVEL = level

    def open_sum(self):
        try:
            return open(self.sum_path, "a+", encoding="utf-8")
        except OSError as error:
            raise OSError(f"compiled modules are kept in {self.root}, which cannot be written to ({error.strerror}): "
                          "set the environment variable HOME to a writable folder") from error

    @contextmanager
    def _lock(self):
        with self.open_sum() as checksum:
            if fcntl:
                try:
                    fcntl.flock(checksum, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    checksum.seek(0)
                    owner = checksum.read() or "another process"
                    self.say(f"waiting for {owner}, which is compiling the same module ({self.name})")
                    fcntl.flock(checksum, fcntl.LOCK_EX)
            yield checksum

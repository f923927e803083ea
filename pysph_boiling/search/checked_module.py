"""PySPH's cache of compiled modules, checked: what is cut off or foreign is not loaded, but made again.

PySPH loads whatever file bears the name of a module. Here each module has its checksum beside it, ``m_HASH.sum``, which
is also the lock of those who make it: the system takes it from a process that ends, however it ends.
"""
import os
from contextlib import contextmanager, suppress
from functools import partial
from hashlib import sha256
from pathlib import Path

from compyle.ext_module import ExtModule, get_platform_dir

try:
    import fcntl
except ImportError:  # Windows: two first runs at once may make a module twice
    fcntl = None

__all__ = ["CheckedModule"]


class CheckedModule(ExtModule):
    """A compiled module of PySPH's that is loaded only if it is what the compiler made.

    ``say`` is called with a sentence before it compiles ``what``, if it ``announces`` that, and before it waits for
    another.

    Errors: ``OSError`` where the cache cannot be written to and the module is not in it.
    """

    say = staticmethod(partial(print, flush=True))
    announces = True
    what = "a set of equations: 20 to 60 s"

    @classmethod
    def of(cls, source, **options):
        """The module of a ``source`` where PySPH keeps it; nothing is compiled."""
        return cls(source, root=os.path.expanduser(os.path.join("~", ".pysph", "source", get_platform_dir())),
                   depends=["pysph.base.nnps_base"], **options)

    @property
    def sum_path(self):
        return os.path.splitext(self.src_path)[0] + ".sum"

    def whole(self):
        """Whether the module is there, unchanged since it was compiled, for the PySPH that is installed."""
        try:
            found = sha256(Path(self.ext_path).read_bytes()).hexdigest()
            return found == Path(self.sum_path).read_text() and not self._dependencies_have_changed()
        except OSError:
            return False

    def check_writable(self):
        """``OSError`` where nothing can be compiled, before the compiler is started."""
        with self.open_sum():
            pass

    def write_and_build(self):
        if self.whole():
            return
        with self._lock() as checksum:
            if self.whole():  # whoever had the lock has made it
                return
            if self.announces:
                self.say(f"compiling {self.what}, once")
            checksum.truncate(0)
            checksum.write(f"process {os.getpid()}")
            checksum.flush()
            with suppress(FileNotFoundError):
                os.unlink(self.ext_path)  # a process that runs it keeps what it has
            Path(self.src_path).write_text(self.code, encoding="utf-8")
            self.build(force=True)
            checksum.truncate(0)
            checksum.write(sha256(Path(self.ext_path).read_bytes()).hexdigest())

    def open_sum(self):
        try:
            return open(self.sum_path, "a+", encoding="utf-8")
        except OSError as error:
            raise OSError(f"compiled modules are kept in {self.root}, which cannot be written to ({error.strerror}): "
                          "set the variable HOME to a folder that can") from error

    @contextmanager
    def _lock(self):
        with self.open_sum() as checksum:
            if fcntl:
                try:
                    fcntl.flock(checksum, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    checksum.seek(0)
                    owner = checksum.read() or "another process"
                    self.say(f"waiting for {owner}, which compiles the same ({self.name})")
                    fcntl.flock(checksum, fcntl.LOCK_EX)
            yield checksum

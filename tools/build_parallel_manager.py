"""Build PySPH's parallel manager into the PySPH that is installed: the one module that its wheel lacks on ranks.

    ZOLTAN_INCLUDE=/usr/include/trilinos ZOLTAN_LIBRARY=/usr/lib/x86_64-linux-gnu python tools/build_parallel_manager.py

The two folders are those of Debian's libtrilinos-zoltan-dev if not given. Needs mpi4py, pyzoltan, Cython, setuptools,
an MPI compiler and PySPH's sources, which are in its wheel. Building all of PySPH anew would take minutes.
"""
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import mpi4py
import numpy
import pyzoltan
from Cython.Build import cythonize
from setuptools import Distribution, Extension

MODULE = "pysph.parallel.parallel_manager"


def package_folder(name):
    """Folder of an installed package, found without importing it: PySPH does not start without what is built here."""
    from importlib.util import find_spec

    return Path(find_spec(name).submodule_search_locations[0])


def mpi_flags(kind):
    """Flags of the MPI compiler, ``kind`` is compile or link."""
    return subprocess.run(["mpic++", f"--showme:{kind}"], check=True, capture_output=True, text=True).stdout.split()


def build():
    """Build the module; returns the path of the library."""
    site = package_folder("pysph").parent
    zoltan = package_folder("pyzoltan") / "czoltan"
    libraries = Path(os.environ.get("ZOLTAN_LIBRARY", "/usr/lib/x86_64-linux-gnu"))
    name = next((name for name in ("trilinos_zoltan", "zoltan") if (libraries / f"lib{name}.so").exists()), None)
    if name is None:
        raise SystemExit(f"no Zoltan library in {libraries} (Debian: apt install libtrilinos-zoltan-dev)")
    extension = Extension(
        MODULE, [str(Path(*MODULE.split(".")).with_suffix(".pyx"))], language="c++",
        include_dirs=[numpy.get_include(), mpi4py.get_include(), str(zoltan), str(site),
                      os.environ.get("ZOLTAN_INCLUDE", "/usr/include/trilinos")],
        library_dirs=[str(libraries)], libraries=[name],
        extra_compile_args=[*mpi_flags("compile"), "-w"], extra_link_args=mpi_flags("link"))
    with tempfile.TemporaryDirectory() as scratch:
        before = os.getcwd()
        os.chdir(site)  # Cython names the module by its path from here
        try:
            modules = cythonize([extension], include_path=[str(site), str(zoltan)], build_dir=scratch, force=True,
                                compile_time_env={"MPI4PY_V2": True}, quiet=True)
            command = Distribution({"ext_modules": modules}).get_command_obj("build_ext")
            command.build_lib, command.build_temp, command.inplace = scratch, scratch, False
            command.ensure_finalized()
            command.run()
        finally:
            os.chdir(before)
        built = Path(command.get_ext_fullpath(MODULE))
        return shutil.copy(built, site / "pysph" / "parallel")


if __name__ == "__main__":
    print(f"built {build()} for {Path(sys.executable).parent.parent}, pyzoltan {Path(pyzoltan.__file__).parent}")

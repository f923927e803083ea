"""Metadata of pysph_boiling; the version is read from the package without importing it."""
import re
from pathlib import Path

from setuptools import find_packages, setup

HERE = Path(__file__).parent
INIT = (HERE / "pysph_boiling" / "__init__.py").read_text(encoding="utf-8")
OPENCL = ["pyopencl[pocl]"]  # a driver for the processor
NVRTC = "nvidia-cuda-nvrtc-cu12; platform_system == 'Linux' and platform_machine == 'x86_64'"  # compiles CUDA
# Our solver edits the code that PySPH generates and compiles it by compyle's means: these versions are known to work.
# NumPy 2.4 breaks PySPH's device helper.
PYSPH = ["pysph==1.0b2", "compyle==0.9.1", "cyarray==1.2", "cython~=3.3.1", "numpy<2.4"]
EMBREE = "embreex; platform_machine == 'x86_64' or platform_machine == 'AMD64'"  # there are wheels for these
FLUIDS = ["CoolProp"]
VIEW = [EMBREE, "pysplashsurf", "imageio-ffmpeg", "pillow", "pyvisfile"]
FILM = ["pysplashsurf", "manifold3d", "usd-core"]
WATCH = ["viser>=1.0", "trimesh"]
MESH = ["trimesh", "rtree"]
DOCS = ["sphinx", "myst-nb", "sphinx-gallery", "furo"]

setup(
    name="pysph_boiling",
    version=re.search(r'^__version__ = "(.+)"', INIT, re.M).group(1),
    description="Boiling with Position Based Fluids: a plugin for PySPH",
    long_description=(HERE / "README.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    author="The pysph_boiling developers",
    license="BSD-3-Clause",
    keywords="boiling, bubbles, phase change, particles, SPH, PBF, PySPH",
    packages=find_packages(include=["pysph_boiling*"]),
    python_requires=">=3.10",
    package_data={"pysph_boiling": ["py.typed"],
                  "pysph_boiling.evaluation": ["validation/*.md", "validation/*/*"],
                  "pysph_boiling.evaluation.accuracy": ["*.json"], "pysph_boiling.evaluation.stress": ["*.json"],
                  "pysph_boiling.search": ["*.h", "*.pyx"], "pysph_boiling.native": ["*.h", "*.pyx"]},
    install_requires=[*PYSPH, "scipy", "h5py", "rich", "matplotlib", "tomlkit"],
    extras_require={
        "test": ["pytest", "pytest-xdist", "hypothesis", "iapws", "pyvista", "xarray", *FLUIDS, *VIEW, *FILM, *WATCH,
                 *MESH, *OPENCL, *DOCS, NVRTC],
        "mpi": ["mpi4py", "pyzoltan"],
        "opencl": OPENCL,
        "fluids": FLUIDS,
        "view": VIEW,
        "film": FILM,
        "watch": WATCH,
        "mesh": MESH,
        "analysis": ["xarray"],
        "docs": DOCS,
    },
    entry_points={"console_scripts": ["pysph-boiling = pysph_boiling.cli:main"]},
    classifiers=[
        "Intended Audience :: Science/Research",
        "Programming Language :: Python :: 3",
        "Topic :: Scientific/Engineering :: Physics",
    ],
)

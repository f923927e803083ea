"""The CUDA source of every kernel compiles: NVIDIA's own compiler turns it into PTX on a machine without a GPU.

What runs where there is one is ``benchmarks/gpu.py``. PyCUDA cannot be installed without the CUDA toolkit, so that its
preamble, which PySPH puts before each source, is written out below.
"""
import ctypes
import sys
from itertools import chain
from pathlib import Path
from types import ModuleType

import numpy as np
import pysph.sph.acceleration_eval_gpu_helper as generator
import pytest
from compyle.config import get_config
from harness import use_backend
from pysph.sph.acceleration_eval import make_acceleration_evals
from pysph.sph.integrator_gpu_helper import IntegratorGPUHelper
from sets import BOIL, SETS

from pysph_boiling.particles import fluid_array, site_array
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import DynamicNucleation, Expansion, Oscillation, PhaseChange, SiteStorage

nvrtc = pytest.importorskip("nvidia.cuda_nvrtc", reason="NVIDIA's compiler is there for Linux and Windows alone")

PREAMBLE = """
#define LOCAL_BARRIER __syncthreads()
#define WITHIN_KERNEL __device__
#define KERNEL extern "C" __global__
#define GLOBAL_MEM
#define LOCAL_MEM __shared__
#define CONSTANT __constant__
#define LID_0 threadIdx.x
#define GID_0 blockIdx.x
#define LDIM_0 blockDim.x
#define GDIM_0 gridDim.x
"""
MORE = {
    "explosive": {**{slot: effect for slot, effect in BOIL.items()
                     if slot not in ("heater", "preset_nucleation", "adhesion")},
                  "dynamic_nucleation": DynamicNucleation(superheat_limit=100.0), "expansion": Expansion(),
                  "oscillation": Oscillation()},
    "stored": {**BOIL, "phases": PhaseChange(kinetic="never"), "pooling": None, "storage": SiteStorage()},
}


@pytest.fixture
def cuda(monkeypatch):
    """PySPH generates CUDA, for arrays that stay on the host."""
    preamble = ModuleType("pycuda._cluda")
    preamble.CLUDA_PREAMBLE = PREAMBLE
    for name, module in (("pycuda", ModuleType("pycuda")), ("pycuda._cluda", preamble)):
        monkeypatch.setitem(sys.modules, name, module)
    for name in ("get_context", "get_queue"):
        monkeypatch.setattr(generator, name, lambda backend: None)
    config = get_config()
    config.use_opencl = config.use_openmp = False
    yield config
    config.use_cuda = False
    use_backend()


def sources(effects, config, double):
    """CUDA sources of the stages of a scheme, the integrator's among them."""
    size = dict(spacing=0.01, dim=2, rho0=958.0)
    walls = fluid_array(np.zeros((1, 3)), name="wall", **size)
    walls.add_property("heated", type="int", data=np.ones(1, int))
    arrays = [fluid_array(0.01 * np.eye(3), **size), walls, site_array(np.zeros((1, 3)), reach=0.1, spacing=0.01)]
    scheme = BoilingScheme(["fluid"], ["wall"], dim=2, spacing=0.01, sites=["sites"], lean=False, **effects)
    scheme.setup_properties(arrays)
    scheme.configure_solver(dt=1e-3)
    equations = scheme.get_equations()
    config.use_cuda, config.use_double = True, double
    helpers = [generator.AccelerationEvalGPUHelper(evaluation) for evaluation in make_acceleration_evals(
        arrays, equations, scheme.kernel)]
    code = [helper.get_code() for helper in helpers]
    code[0] += IntegratorGPUHelper(scheme.integrator, helpers[0]).get_code()
    return [generator.convert_to_float_if_needed(text) for text in code]


def ptx(source):
    """PTX of a CUDA source; ``AssertionError`` with the compiler's words where it does not compile."""
    library = ctypes.CDLL(str(next(chain.from_iterable(
        Path(folder).glob(pattern) for folder in nvrtc.__path__ for pattern in ("lib/libnvrtc.so*", "bin/nvrtc64*")))))
    program = ctypes.c_void_p()
    assert library.nvrtcCreateProgram(ctypes.byref(program), source.encode(), b"stage.cu", 0, None, None) == 0
    failed = library.nvrtcCompileProgram(program, 1, (ctypes.c_char_p * 1)(b"--gpu-architecture=compute_80"))

    def text(what):
        size = ctypes.c_size_t()
        getattr(library, f"nvrtcGet{what}Size")(program, ctypes.byref(size))
        buffer = ctypes.create_string_buffer(size.value)
        getattr(library, f"nvrtcGet{what}")(program, buffer)
        return buffer.value.decode()

    assert not failed, "\n".join(line for line in text("ProgramLog").splitlines() if "error" in line)
    return text("PTX")


@pytest.mark.parametrize("double", [True, False], ids=["double", "single"])
@pytest.mark.parametrize("name", [*SETS, *MORE])
def test_every_stage_compiles(cuda, name, double):
    made = [ptx(source) for source in sources({**SETS, **MORE}[name], cuda, double)]
    entries = sum(text.count(".entry") for text in made)
    assert entries >= 4
    assert any(".f64" in text for text in made) == double or not double


def test_a_source_that_is_wrong_does_not_compile():
    with pytest.raises(AssertionError, match="error"):
        ptx('extern "C" __global__ void f(double *x) { x[0] = missing; }')

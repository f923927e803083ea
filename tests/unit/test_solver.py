"""Modules are compiled for the vector unit and declare what they use; a user's own flags are left alone."""
import pytest
from compyle import ext_module
from compyle.config import get_config
from pysph.sph import acceleration_eval_cython_helper

from pysph_boiling.schemes import solver


@pytest.fixture(autouse=True)
def asked_anew():
    solver.vector_flags.cache_clear()
    yield
    solver.vector_flags.cache_clear()


@pytest.mark.parametrize("openmp", [False, True])
def test_modules_are_compiled_with_them_on_one_core_too(monkeypatch, openmp):
    """--no-openmp was compiled with Python's own flags alone."""
    monkeypatch.setattr(get_config(), "use_openmp", openmp)
    flags = solver.vector_flags()
    assert flags[:len(solver.REORDER)] == solver.REORDER  # gcc and clang both know them
    compile_flags, link_flags = solver.VectorModule.of("# nothing")._get_extra_args()
    assert tuple(compile_flags[:len(flags)]) == flags and ("-fopenmp" in compile_flags) == openmp
    assert ("-fopenmp" in link_flags) == openmp


def test_pysphs_own_module_is_back_after_the_block():
    before = acceleration_eval_cython_helper.ExtModule, acceleration_eval_cython_helper.AccelerationEvalCythonHelper
    with pytest.raises(RuntimeError), solver.vectorised():
        assert acceleration_eval_cython_helper.ExtModule is solver.VectorModule
        raise RuntimeError
    assert before == (acceleration_eval_cython_helper.ExtModule,
                      acceleration_eval_cython_helper.AccelerationEvalCythonHelper)


def test_tag_names_the_flags(monkeypatch):
    tags = []
    for flags in ((), solver.REORDER, (*solver.REORDER, solver.AVX2)):
        monkeypatch.setattr(solver, "vector_flags", lambda flags=flags: flags)
        tags.append(solver.vector_tag())
    assert tags[0] == "" and len(set(tags)) == 3 and all(tag.lstrip("_").isalnum() for tag in tags[1:])


def test_flags_of_the_user_are_left_alone(monkeypatch):
    monkeypatch.setitem(ext_module.CONFIG_OPTS, "OMP_CFLAGS", ["-fopenmp", "-O1"])
    monkeypatch.setitem(ext_module.CONFIG_OPTS, "OMP_LINK", ["-fopenmp"])
    assert solver.vector_flags() == () and solver.vector_tag() == ""
    monkeypatch.setattr(get_config(), "use_openmp", True)
    with solver.vectorised():
        assert solver.VectorModule.of("# nothing")._get_extra_args() == (["-fopenmp", "-O1", "-O3"], ["-fopenmp"])


def test_compiler_that_knows_no_such_flag_gets_none(monkeypatch):
    monkeypatch.setattr(solver.sysconfig, "get_config_var", lambda name: "false")
    assert solver.vector_flags() == ()


def test_a_prediction_of_few_particles_wakes_no_thread():
    """Loops of the integrator, not those of the equations, which begin at D_START_IDX."""
    loops = "for d_idx in prange({}, NP_DEST, 1, schedule='dynamic', chunksize=64, nogil=True):\n"
    source = loops.format("0") + loops.format("D_START_IDX")
    first, second = solver.step_few_alone(source).splitlines()
    assert f"use_threads_if=NP_DEST > {solver.FEW}" in first and second + "\n" == loops.format("D_START_IDX")


def test_lean_source_declares_what_it_uses():
    source = """before
cdef class ParticleArrayWrapper:
    cdef public int index
    cdef public ParticleArray array
    cdef public DoubleArray T, d, e, x, y
    cdef public IntArray phase
    cdef public str name

    d_x = dst.x.data
    s_e = src.e.data
    D_START_IDX = self.fluid.d[0]
"""
    wanted = source
    for before, after in (("Wrapper:\n", "Wrapper:\n    cdef dict __dict__\n"), ("T, d, e, x, y", "d, e, x"),
                          ("    cdef public IntArray phase\n", "")):
        wanted = wanted.replace(before, after)
    assert solver.strip_unused_declarations(source) == wanted
    with pytest.raises(RuntimeError, match="the wrapper of particle arrays"):
        solver.strip_unused_declarations("nothing of the kind")

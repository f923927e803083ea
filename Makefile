# The first `make demo` or `make test` sets up .venv; later ones find it ready. `rm -rf .venv` starts afresh.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
TESTABLE := $(VENV)/.testable
# setuptools compiles PySPH's modules one after the other unless a file that DIST_EXTRA_CONFIG names says otherwise.
ALL_CORES := $(VENV)/all_cores.cfg
CORES = $(shell $(PYTHON) -c "import os; print(os.cpu_count())")

.PHONY: demo test test-all parity setup-mpi test-ranks mutants bench pictures docs lint clean

demo: $(READY)
	@$(BIN)/pysph-boiling run steady_boiling --demo

# Files side by side: compiling takes most of the time of a first run. `make test WORKERS=0` is one after the other.
WORKERS ?= 2
SIDE_BY_SIDE := -n $(WORKERS) --dist loadfile
# Side by side, idle OpenMP threads sleep at once; alone they spin first (pysph_boiling/threads.py).
test test-all parity mutants: export OMP_WAIT_POLICY ?= passive

test: $(TESTABLE)
	@$(BIN)/python -m pytest $(SIDE_BY_SIDE)

test-all: $(TESTABLE)
	@$(BIN)/python -m pytest $(SIDE_BY_SIDE) -m ""

# The equations against their references on every backend; make test has run OpenMP, and whole scenes on OpenCL.
parity: $(TESTABLE)
	@for backend in cython opencl; do PYOPENCL_CTX=0 PYSPH_BOILING_BACKEND=$$backend \
	  $(BIN)/python -m pytest $(SIDE_BY_SIDE) -m "not slow and not many_steps" tests/compiled || exit 1; done

# MPI ranks, on Debian: Open MPI and Zoltan, their Python packages, and the one module of PySPH that needs both.
MPI_PACKAGES := libopenmpi-dev openmpi-bin libtrilinos-zoltan-dev
export ZOLTAN_INCLUDE ?= /usr/include/trilinos
export ZOLTAN_LIBRARY ?= /usr/lib/$(shell uname -m)-linux-gnu

setup-mpi: $(READY)
	@command -v mpic++ >/dev/null && test -d $(ZOLTAN_INCLUDE) || { \
	  test "$$(id -u)" = 0 || { echo "first, as root: apt install $(MPI_PACKAGES)"; exit 1; }; \
	  apt-get update -qq && DEBIAN_FRONTEND=noninteractive \
	  apt-get install -y -qq --no-install-recommends $(MPI_PACKAGES) >/dev/null; }
	@$(BIN)/python -m pip install --quiet mpi4py wheel setuptools cython
	@USE_TRILINOS=1 $(BIN)/python -m pip install --quiet pyzoltan
	@$(BIN)/python tools/build_parallel_manager.py
	@echo "ready: mpirun -n 2 $(BIN)/pysph-boiling run SCENE"

test-ranks: setup-mpi
	@$(BIN)/python -m pip install --quiet pytest
	@RANKS=required $(BIN)/python -m pytest tests/ranks

mutants: $(TESTABLE)
	@$(BIN)/python tests/mutants.py

# On an idle machine. `make bench AGAINST=COMMIT TABLE=FILE.md` measures that version too, and writes the table there.
bench: $(READY)
	@$(BIN)/python benchmarks/summary.py $(if $(AGAINST),--against $(AGAINST)) $(if $(TABLE),--report $(TABLE))

# Of README.md. Runs are kept in build/pictures, so that one that is complete is not repeated.
pictures: $(TESTABLE)
	@$(BIN)/python tools/pictures.py

# The site, in build/site; what does not resolve is an error. `make docs GALLERY=0` runs no gallery and no notebook.
GALLERY ?= 1
docs: $(BIN)/sphinx-build
	@$(BIN)/sphinx-build -W --keep-going -q -c docs $(if $(filter 0,$(GALLERY)),-D plot_gallery=0 -D nb_execution_mode=off) \
	  . build/site
	@echo "open build/site/index.html"

lint: $(BIN)/mypy
	@$(BIN)/ruff check .
	@$(BIN)/mypy

clean:
	rm -rf build docs/generated docs/gallery/*_output dist *.egg-info .pytest_cache .ruff_cache .mypy_cache .hypothesis
	find pysph_boiling tests -name __pycache__ -type d -prune -exec rm -rf {} +

$(BIN)/sphinx-build: $(READY)
	@PYTHONWARNINGS=ignore $(BIN)/python -m pip install --quiet --editable ".[docs]"
	@touch $@

$(BIN)/mypy: $(READY)
	@$(BIN)/python -m pip install --quiet "ruff~=0.17.6" "mypy~=2.4.1"
	@touch $@

$(READY): setup.py pyproject.toml
	@command -v g++ >/dev/null || { echo "g++ is missing (Debian, Ubuntu: apt install g++)"; exit 1; }
	@$(PYTHON) -c "import os, sysconfig as s; open(os.path.join(s.get_path('include'), 'Python.h'))" 2>/dev/null || { \
	  echo "the headers of $(PYTHON) are missing (Debian, Ubuntu: apt install python3-dev)"; exit 1; }
	@echo "Setting up $(VENV) ..."
	@$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); \
	  echo "$(PYTHON) cannot make a virtual environment (Debian, Ubuntu: apt install python3-venv)"; exit 1; }
	@$(BIN)/python -m pip install --quiet --upgrade pip
	@$(BIN)/python -c "import pysph" 2>/dev/null || \
	  echo "PySPH is built from source now: on two idle cores about 3 minutes, once. pip keeps the result for the next set-up."
	@printf '[build_ext]\nparallel = %s\n' "$(CORES)" > $(ALL_CORES)
	@DIST_EXTRA_CONFIG=$(abspath $(ALL_CORES)) PYTHONWARNINGS=ignore $(BIN)/python -m pip install --quiet --editable .
	@rm $(ALL_CORES)
	@touch $@

# The tests read files for ParaView: this fetches VTK, about 1 GB once unpacked.
$(TESTABLE): $(READY)
	@PYTHONWARNINGS=ignore $(BIN)/python -m pip install --quiet --editable ".[test]"
	@touch $@

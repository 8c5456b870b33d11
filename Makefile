# Everything from a fresh clone: `make demo`, `make test`, ... each sets up what it needs first. `make help` lists the targets.
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help
MAKEFLAGS += --no-print-directory

UV_VERSION := 0.13.9
UV := .bootstrap/bin/uv
PY := .venv/bin/python
PY311 := .venv311/bin/python
BIN := $(CURDIR)/.venv/bin
VERSION = $(shell sed -n 's/^version = "\(.*\)".*/\1/p' pyproject.toml)
JOBS ?= $(shell nproc 2>/dev/null || echo 2)
export CMAKE_BUILD_PARALLEL_LEVEL ?= $(JOBS)

VLP_CUDA ?= AUTO
VLP_CUDA_ARCHITECTURES ?= 90
WHEEL_CUDA_ARCHITECTURES ?= 75-real;80-real;86-real;89-real;90-real;100-real;120
# Settings for CMake, for example make build CMAKE_DEFINES="VLP_WERROR=ON"
CMAKE_DEFINES ?=

TIDY_ISA := $(if $(filter x86_64 amd64,$(shell uname -m)),avx2,baseline)
PYTEST_ARGS ?=
# --write: what the kernels take now is what they may take
CUDA_CHECK_ARGS ?=

CXX_FILES = $(shell find native tests/native -name '*.cpp' -o -name '*.h' -o -name '*.cu' | sort)
NATIVE := $(shell find native -type f -not -name '*.md' 2>/dev/null) pyproject.toml

# Changes when the settings do, so that the next build takes them up.
SETTINGS := $(VLP_CUDA) $(VLP_CUDA_ARCHITECTURES) $(CMAKE_DEFINES)
ifneq ($(SETTINGS),$(file <build/settings))
$(shell mkdir -p build)$(file >build/settings,$(SETTINGS))
endif

.PHONY: demo
demo: build ## render scenes/cornell_box.blend through Blender and the add-on to out/cornell_box.png
	@mkdir -p out
	.venv/bin/vlp-bpt render scenes/cornell_box.blend -o out/cornell_box.png

.PHONY: test
test: test-native test-python test-python311 ## native tests, and pytest with the bpy modules of Blender 5.2 and 4.5

.PHONY: test-native
test-native: build
	@.ci/system.sh gtest
	@$(BIN)/cmake -DVLP_TESTS=ON build/venv >build/configure.log || { cat build/configure.log >&2; exit 1; }
	@$(BIN)/cmake --build build/venv --target vlp_tests
	$(BIN)/ctest --test-dir build/venv --output-on-failure -j $(JOBS)

.PHONY: test-python
test-python: build
	$(PY) -m pytest tests --ignore=tests/blender --ignore=tests/gpu $(PYTEST_ARGS)

# Blender 4.5's Python. Where it is missing, only a developer's machine may go without it.
.PHONY: test-python311
test-python311: .bootstrap/.uv-$(UV_VERSION) build
	@if [ -e .venv311/.ready ] || .ci/venv.sh .venv311 3.11; then \
	  $(MAKE) build311; \
	  echo "$(PY311) -m pytest tests/addon $(PYTEST_ARGS)"; \
	  if compgen -G "tests/addon/test_*.py" >/dev/null; then $(PY311) -m pytest tests/addon $(PYTEST_ARGS); \
	  else echo "vlp-bpt: LEFT OUT: tests/addon holds no test yet"; fi; \
	elif [ -n "$${CI:-}" ]; then exit 1; \
	else echo "vlp-bpt: LEFT OUT: the tests with Blender 4.5, which need Python 3.11"; fi

# Debian's libllvm19 makes Mitsuba several times faster; it works without.
.PHONY: test-slow
test-slow: build .venv/.peers ## the tests that take minutes each, beside Cycles, Mitsuba and LuxCore
	$(PY) -m pytest tests --ignore=tests/blender --ignore=tests/gpu --slow -m slow $(PYTEST_ARGS)

.PHONY: bench
bench: build ## speed and error over time beside Cycles, and a short form of the paper's experiment (half an hour)
	.venv/bin/vlp-bpt bench
	.venv/bin/vlp-bpt bench paper --seconds 5 --reference-seconds 6 --sweep-seconds 1 --sweep-k 3 5 --output out/bench

.PHONY: bench-paper
bench-paper: build ## the paper's experiment: out/bench-paper/report.md (half an hour)
	.venv/bin/vlp-bpt bench paper

.PHONY: bench-peers
bench-peers: build .venv/.peers ## beside Cycles, Mitsuba and LuxCore: out/bench-peers/report.md (an hour)
	.venv/bin/vlp-bpt bench peers

.PHONY: bench-growth
bench-growth: build ## how costs grow with triangles, lights, pixels and threads: out/bench-growth/report.md (minutes)
	.venv/bin/vlp-bpt bench growth

.PHONY: bench-start
bench-start: build ## from Blender's scene to the first iteration, beside Cycles: out/bench-start/report.md (minutes)
	.venv/bin/vlp-bpt bench start

.PHONY: bench-rays
bench-rays: build ## rays a second, beside Embree's where its headers are (Debian: libembree-dev), and steps a ray
	@$(BIN)/cmake -DVLP_BENCH=ON build/venv >build/configure.log || { cat build/configure.log >&2; exit 1; }
	@$(BIN)/cmake --build build/venv --target vlp_rays vlp_ray_visits
	build/venv/vlp_rays $(RAYS_ARGS)
	build/venv/vlp_ray_visits

.PHONY: bench-refit
bench-refit: build ## what it takes that hierarchies follow edits, and how rays fare afterwards
	@$(BIN)/cmake -DVLP_BENCH=ON build/venv >build/configure.log || { cat build/configure.log >&2; exit 1; }
	@$(BIN)/cmake --build build/venv --target vlp_refit
	build/venv/vlp_refit
	mkdir -p out; [ -e out/million.blend ] || $(PY) scenes/million.py --output out/million.blend
	[ -e out/million.vlp.npz ] || .venv/bin/vlp-bpt export out/million.blend -o out/million.vlp.npz
	$(PY) native/bench/updates.py out/million.vlp.npz

.PHONY: extension
extension: wheel ## dist/vlp_bpt-VERSION-PLATFORM.zip, to be installed in Blender
	$(PY) addon/build_extension.py dist/vlp_bpt-$(VERSION)-cp311-abi3-*.whl --output dist

.PHONY: build
build: .venv/.native ## compile the native core and install the package in .venv (editable)

.PHONY: build311
build311: .venv311/.native

.PHONY: format
format: .venv/.lint ## format C++, CUDA and Python
	@$(BIN)/clang-format -i $(CXX_FILES)
	@$(BIN)/ruff check --quiet --fix-only .
	@$(BIN)/ruff format .

.PHONY: lint
lint: lint-format lint-python typecheck lint-native ## formatting, ruff, mypy, clang-tidy

.PHONY: lint-format
lint-format: .venv/.lint
	@echo clang-format --dry-run; $(BIN)/clang-format --dry-run -Werror $(CXX_FILES)
	$(BIN)/ruff format --check .

.PHONY: lint-python
lint-python: .venv/.lint
	$(BIN)/ruff check .

.PHONY: typecheck
typecheck: .venv/.lint ## mypy
	$(BIN)/mypy

# clang-tidy reads one variant's compile commands, in a build directory that never compiles.
.PHONY: lint-native
lint-native: .venv/.lint
	@PATH=$(BIN):$$PATH cmake -S native -B build/tidy -G Ninja -DVLP_CUDA=OFF -DVLP_ISA_VARIANTS=$(TIDY_ISA) -DPython_EXECUTABLE=$(CURDIR)/$(PY) \
	  -DCMAKE_BUILD_TYPE=Debug >build/tidy.log || { cat build/tidy.log >&2; exit 1; }
	find native -name '*.cpp' -not -path '*/bench/*' | sort | \
	  xargs -P $(JOBS) -n 1 $(BIN)/clang-tidy -p build/tidy --quiet --extra-arg=-Wno-unknown-warning-option

# Wheels carry GPU code made with the PyPI toolchain, whatever CUDA the machine has; WHEEL_CUDA=OFF leaves it out.
.PHONY: wheel
wheel: .venv/.wheel .venv311/.ready .ci/wheel.sh ## dist/*.whl: the package for Python 3.11 and every later one
	@root=$(if $(filter OFF,$(WHEEL_CUDA)),,$$(.ci/cuda.sh)); CUDA_ROOT=$$root ARCHITECTURES="$(WHEEL_CUDA_ARCHITECTURES)" .ci/wheel.sh .venv311 .venv

.PHONY: sanitize
sanitize: .venv/.ready ## native tests under the address and undefined-behaviour sanitizers
	@.ci/system.sh gtest
	@cd native && export PATH=$(BIN):$$PATH && cmake --preset asan >/dev/null && cmake --build --preset asan && ctest --preset asan

.PHONY: cuda-check
cuda-check: .venv/.ready ## compile the CUDA code with the PyPI toolchain alone (no GPU needed), and what its kernels take
	@rm -rf build/cuda; root=$$(.ci/cuda.sh); \
	PATH=$(BIN):/usr/bin:/bin env -u CUDA_HOME -u CUDA_PATH -u LIBRARY_PATH bash -euo pipefail -c " \
	  cmake -S native -B build/cuda -G Ninja -DVLP_PYTHON=OFF -DVLP_CUDA=ON -DVLP_CUDA_ROOT=$$root -DVLP_CUDA_ARCHITECTURES='75-real;90-real' -DVLP_CUDA_REPORT=ON -DVLP_WERROR=ON -DVLP_BENCH=ON && \
	  cmake --build build/cuda --target vlp_cuda vlp_gpu_rays_object -v >build/cuda/build.log 2>&1 || { cat build/cuda/build.log >&2; exit 1; }"
	$(PY) .ci/kernel-resources.py build/cuda/build.log build/cuda/libvlp_cuda.a "$$(.ci/cuda.sh)/bin/nvdisasm" native/backend/kernels.md $(CUDA_CHECK_ARGS)

.PHONY: gpu-check
gpu-check: ## build with CUDA and test, on a machine with a GPU and no package registry
	.ci/gpu-check.sh

##@ Environments
.bootstrap/.uv-$(UV_VERSION):
	@python3 -m venv .bootstrap || { echo "vlp-bpt: python3 with its venv module is missing; on Debian or Ubuntu: apt-get install python3-venv" >&2; exit 1; }
	@.bootstrap/bin/python -m pip install --quiet --disable-pip-version-check uv==$(UV_VERSION)
	@touch $@

.venv/.ready: .bootstrap/.uv-$(UV_VERSION) pyproject.toml .ci/venv.sh
	@.ci/venv.sh .venv "3.13 3.11" dev blender
	@.ci/system.sh bpy $(PY)
	@touch $@

.venv311/.ready: .bootstrap/.uv-$(UV_VERSION) pyproject.toml .ci/venv.sh
	@.ci/venv.sh .venv311 3.11 dev blender
	@.ci/system.sh bpy $(PY311)
	@touch $@

.venv/.lint .venv/.wheel .venv/.peers: .venv/.%: .venv/.ready
	@.ci/venv.sh .venv "" $*
	@touch $@

# An editable install: Python files are used where they lie, the native core is compiled in build/venv* and copied into the environment.
%/.native: %/.ready $(NATIVE) build/settings
	@.ci/system.sh compiler $*/bin/python
	@PATH=$(CURDIR)/$*/bin:$$PATH $(UV) pip install --quiet --python $* --no-deps --no-build-isolation \
	  -C build-dir=build/$(*:.%=%) -C cmake.define.VLP_CUDA=$(VLP_CUDA) -C "cmake.define.VLP_CUDA_ARCHITECTURES=$(VLP_CUDA_ARCHITECTURES)" \
	  $(foreach d,$(CMAKE_DEFINES),-C cmake.define.$(d)) --editable .
	@touch $@

.PHONY: clean
clean: ## remove builds and outputs; environments stay
	rm -rf build dist out .mypy_cache .ruff_cache .pytest_cache

.PHONY: help
help: ## this list
	@awk -F ':.*## ' '/^[a-z0-9-]+:.*## / {printf "  make %-12s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

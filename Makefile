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

NATIVE := $(shell find native -type f -not -name '*.md' 2>/dev/null) pyproject.toml

##@ Use
.PHONY: demo
demo: build ## render scenes/cornell_box.blend through Blender and the add-on to out/cornell_box.png
	@mkdir -p out
	.venv/bin/vlp-bpt render scenes/cornell_box.blend -o out/cornell_box.png

.PHONY: bench
bench: build ## speed and error over time, beside Cycles
	.venv/bin/vlp-bpt bench

##@ Develop
.PHONY: build
build: .venv/.native ## compile the native core and install the package in .venv (editable)

.PHONY: build311
build311: .venv311/.native

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

# An editable install: Python files are used where they lie, the native core is compiled in build/venv* and copied into the environment.
%/.native: %/.ready $(NATIVE)
	@.ci/system.sh compiler
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

#!/usr/bin/env bash
# wheel.sh VENV...: builds one wheel with each environment's Python into dist/wheels and gives it the oldest manylinux tag that is true.
# CUDA_ROOT: toolkit to build the GPU code with (empty: none). ARCHITECTURES: for which GPUs.
set -euo pipefail
uv=.bootstrap/bin/uv cmake_bin=$PWD/.venv/bin
rm -rf dist/wheels build/wheels
mkdir -p dist/wheels
for venv in "$@"; do
  "$uv" pip install --quiet --python "$venv" --group build
  out=build/wheels/${venv#.}
  PATH=$cmake_bin:$PATH "$uv" build --quiet --wheel --no-build-isolation --python "$venv/bin/python" --out-dir "$out" \
    -C build-dir="build/wheel-${venv#.}" -C cmake.define.VLP_CUDA="$([ -n "${CUDA_ROOT:-}" ] && echo ON || echo OFF)" \
    -C cmake.define.VLP_CUDA_ROOT="${CUDA_ROOT:-}" -C "cmake.define.VLP_CUDA_ARCHITECTURES=${ARCHITECTURES:-90}"
  PATH=$cmake_bin:$PATH auditwheel --quiet repair --plat auto --wheel-dir dist/wheels "$out"/*.whl
done
ls -sh dist/wheels

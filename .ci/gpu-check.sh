#!/usr/bin/env bash
# gpu-check.sh: builds the package with CUDA and runs tests/gpu and the native tests, on a machine that has a GPU, nvcc, CMake, ninja, a C++
# compiler and a Python with nanobind, numpy and pytest, and that reaches no package registry. PYTHON and VLP_CUDA_ARCHITECTURES may be set.
set -euo pipefail
cd "$(dirname "$0")/.."
python=$(command -v "${PYTHON:-python3}")
build=build/gpu site=$PWD/build/gpu/site
tests=$(.ci/system.sh gtest 2>/dev/null && echo ON || echo OFF)

cmake -S native -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DPython_EXECUTABLE="$python" -DVLP_TESTS="$tests" \
  -DVLP_CUDA=ON -DVLP_CUDA_ARCHITECTURES="${VLP_CUDA_ARCHITECTURES:-native}"
cmake --build "$build"
rm -rf "$site" && mkdir -p "$site" && cp -r python/vlp_bpt "$site" && cmake --install "$build" --prefix "$site" >/dev/null
export PYTHONPATH=$site
"$python" -c 'from vlp_bpt import _native; print("vlp_bpt", _native.__version__, _native.isa)'

if [ "$tests" = ON ]; then
  cmake --build "$build" --target vlp_tests
  ctest --test-dir "$build" --output-on-failure -j "$(nproc)"
else
  echo "vlp-bpt: LEFT OUT: the native tests, which need GoogleTest"
fi
if compgen -G 'tests/gpu/test_*.py' >/dev/null; then
  "$python" -m pytest tests/gpu
else
  echo "vlp-bpt: LEFT OUT: tests/gpu holds no test yet"
fi

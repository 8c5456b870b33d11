#!/usr/bin/env bash
# gpu-check.sh: builds the package with CUDA, runs the native tests and tests/gpu, and writes what the benchmarks
# measure to $OUT/gpu.json, $OUT/gpu_rays.json and $OUT/gpu.md, on a machine that has a GPU, nvcc, CMake, ninja, a C++
# compiler and a Python with nanobind, numpy and pytest, and that reaches no package registry. PYTHON and
# VLP_CUDA_ARCHITECTURES may be set.
set -euo pipefail
cd "$(dirname "$0")/.."
python=$(command -v "${PYTHON:-python3}")
build=build/gpu site=$PWD/build/gpu/site
tests=$(.ci/system.sh gtest 2>/dev/null && echo ON || echo OFF)

cmake -S native -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DPython_EXECUTABLE="$python" -DVLP_TESTS="$tests" -DVLP_BENCH=ON \
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
"$python" -m pytest tests/gpu -p no:cacheprovider
if command -v compute-sanitizer >/dev/null; then
  for tool in memcheck racecheck; do
    compute-sanitizer --tool "$tool" --error-exitcode 1 "$python" -m pytest tests/gpu -p no:cacheprovider -k window_is_a_part
  done
else
  echo "vlp-bpt: LEFT OUT: compute-sanitizer, which is not installed"
fi
mkdir -p "${OUT:=$build}"
"$python" tests/gpu/bench.py "$OUT" | tee "$OUT/gpu.md"
cmake --build "$build" --target vlp_gpu_rays
"$build"/vlp_gpu_rays "$OUT/gpu_rays.json" | tee -a "$OUT/gpu.md"

#!/usr/bin/env bash
# gpu-check.sh: builds the package with CUDA, runs the native tests and tests/gpu, and writes what the benchmarks
# measure to $OUT/gpu.json, $OUT/gpu_rays.json and $OUT/gpu.md, on a machine that has a GPU, nvcc, CMake, ninja, a C++
# compiler and a Python with nanobind, numpy and pytest, and that reaches no package registry. A step that fails does not
# keep the others from running; no step runs longer than LIMIT seconds (530) after the start. PYTHON and
# VLP_CUDA_ARCHITECTURES may be set.
set -euo pipefail
cd "$(dirname "$0")/.."
python=$(command -v "${PYTHON:-python3}")
build=build/gpu site=$PWD/build/gpu/site
export OUT=${OUT:-$build}
mkdir -p "$OUT"
tests=$(.ci/system.sh gtest 2>/dev/null && echo ON || echo OFF)
failed=()

step() { # NAME SECONDS COMMAND...: for so long at most
  local name=$1 most=$2 left=$((${LIMIT:-530} - SECONDS)) start=$SECONDS status=124
  shift 2
  [ "$left" -ge "$most" ] || most=$left
  echo "=== $name"
  if [ "$most" -gt 0 ]; then timeout --signal=INT --kill-after=5 "$most" "$@" && status=0 || status=$?; fi
  echo "=== $name: $((SECONDS - start)) s"
  case $status in
    0) return ;;
    124 | 137) failed+=("$name: out of time") ;;
    *) failed+=("$name: status $status") ;;
  esac
  return "$status"
}
told() { # NAME SECONDS COMMAND...: whose output goes to gpu.md too
  step "$1" "$2" bash -o pipefail -c '"$0" "$@" | tee -a "$OUT/gpu.md"' "${@:3}"
}

step configure 120 cmake -S native -B "$build" -G Ninja -DCMAKE_BUILD_TYPE=Release -DPython_EXECUTABLE="$python" -DVLP_TESTS="$tests" \
  -DVLP_BENCH=ON -DVLP_CUDA=ON -DVLP_CUDA_ARCHITECTURES="${VLP_CUDA_ARCHITECTURES:-native}"
targets=(all)
[ "$tests" = OFF ] || targets+=(vlp_tests)
step build 400 cmake --build "$build" --target vlp_gpu_rays "${targets[@]}"
rm -rf "$site" && mkdir -p "$site" && cp -r python/vlp_bpt "$site" && cmake --install "$build" --prefix "$site" >/dev/null
export PYTHONPATH=$site
"$python" -c 'from vlp_bpt import _native; print("vlp_bpt", _native.__version__, _native.isa)'

step tests 150 "$python" -m pytest tests/gpu -p no:cacheprovider || true
rm -f "$OUT/gpu.md"
told bench 200 "$python" tests/gpu/bench.py "$OUT" || true
told rays 60 "$build"/vlp_gpu_rays "$OUT/gpu_rays.json" || true
if command -v compute-sanitizer >/dev/null; then
  # Only the scans of CUB share memory within a block: there is nothing of ours for racecheck.
  step memcheck 120 compute-sanitizer --error-exitcode 1 "$python" -m pytest tests/gpu -p no:cacheprovider -k window_is_a_part || true
else
  echo "vlp-bpt: LEFT OUT: compute-sanitizer, which is not installed"
fi
if [ "$tests" = ON ]; then
  step native-tests 120 ctest --test-dir "$build" --output-on-failure -j "$(nproc)" || true
else
  echo "vlp-bpt: LEFT OUT: the native tests, which need GoogleTest"
fi

[ ${#failed[@]} -eq 0 ] || { printf 'gpu-check: failed: %s\n' "${failed[@]}" >&2; exit 1; }

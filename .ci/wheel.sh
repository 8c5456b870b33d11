#!/usr/bin/env bash
# wheel.sh VENV311 VENV: makes one wheel in dist/ that serves Python 3.11 and every later one, with the oldest manylinux tag that is true.
# CUDA_ROOT: toolkit to build the GPU code with (empty: none). ARCHITECTURES: for which GPUs.
#
# It holds every module twice: compiled for Python 3.11, which nanobind's stable ABI does not reach, and for the stable ABI of 3.12. Python 3.11
# prefers NAME.cpython-311-*.so to NAME.abi3.so. Two wheels would not do: Blender takes an extension with a cp311 wheel as one for 3.11 only.
set -euo pipefail
uv=.bootstrap/bin/uv out=build/wheels
"$2/bin/python" -c 'import sys; sys.exit(sys.version_info < (3, 12))' || { echo "vlp-bpt: wheels need Python 3.12 or later beside 3.11" >&2; exit 1; }
export PATH=$PWD/.venv/bin:$PATH
rm -rf "$out" dist/*.whl
cuda_library=
for venv in "$@"; do
  "$uv" build --quiet --wheel --no-build-isolation --python "$venv/bin/python" --out-dir "$out/${venv#.}" \
    -C build-dir="build/wheel-${venv#.}" -C cmake.define.VLP_CUDA="$([ -n "${CUDA_ROOT:-}" ] && echo ON || echo OFF)" \
    -C cmake.define.VLP_CUDA_ROOT="${CUDA_ROOT:-}" -C "cmake.define.VLP_CUDA_ARCHITECTURES=${ARCHITECTURES:-90}" \
    -C cmake.define.VLP_CUDA_LIBRARY="$cuda_library"
  [ -z "${CUDA_ROOT:-}" ] || cuda_library=$PWD/build/wheel-venv311/libvlp_cuda.a # compiled with the first, used again by the second
done

wheel unpack --dest "$out/venv311" "$out"/venv311/*.whl >/dev/null
wheel unpack --dest "$out/venv" "$out"/venv/*.whl >/dev/null
cp "$out"/venv311/*/vlp_bpt/*.cpython-311-*.so "$out"/venv/*/vlp_bpt/
wheel pack --dest-dir "$out" "$out"/venv/vlp_bpt-*/ >/dev/null
wheel tags --remove --python-tag cp311 --abi-tag abi3 "$out"/*.whl >/dev/null
auditwheel repair --plat auto --wheel-dir dist "$out"/*.whl 2>/dev/null || auditwheel -v repair --plat auto --wheel-dir dist "$out"/*.whl
ls -sh dist/*.whl

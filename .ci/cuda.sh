#!/usr/bin/env bash
# cuda.sh: installs the CUDA compiler from PyPI (group `cuda` of pyproject.toml) into .venv-cuda and prints the toolkit's folder.
set -euo pipefail
cd "$(dirname "$0")/.."
if [ ! -e .venv-cuda/.ready ] || [ pyproject.toml -nt .venv-cuda/.ready ]; then
  .ci/venv.sh .venv-cuda "3.13 3.12 3.11" cuda >&2
  touch .venv-cuda/.ready
fi
ls -d "$PWD"/.venv-cuda/lib/python3*/site-packages/nvidia/cu13

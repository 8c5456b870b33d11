#!/usr/bin/env bash
# venv.sh DIR "VERSION..." GROUP...: makes the virtual environment DIR with the first Python VERSION that can be had, and installs the exact
# versions that the dependency groups GROUP of pyproject.toml name. Run by the Makefile; needs .bootstrap/bin/uv.
set -euo pipefail
dir=$1 versions=$2
shift 2
uv=.bootstrap/bin/uv
for pyenv in "${PYENV_ROOT:-$HOME/.pyenv}"/versions/*/bin; do PATH=$PATH:$pyenv; done # pyenv's shims hide versions that are not active

if [ ! -x "$dir/bin/python" ]; then
  for version in $versions; do
    "$uv" venv --quiet --python "$version" "$dir" 2>"$dir.log" && break
  done
  [ -x "$dir/bin/python" ] || { echo "vlp-bpt: no Python ${versions// / or } found, and none could be downloaded; install one (apt, pyenv, python.org)" >&2; exit 1; }
  rm -f "$dir.log"
  wanted=${versions%% *}
  [ "$version" = "$wanted" ] || echo "vlp-bpt: Python $wanted not found: using $version, with Blender $([ "$version" = 3.11 ] && echo 4.5 || echo 'as PyPI has it') as the bpy module" >&2
fi
[ $# -eq 0 ] || "$uv" pip install --quiet --python "$dir" "${@/#/--group=}"

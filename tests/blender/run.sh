#!/usr/bin/env bash
# run.sh: installs the newest dist/vlp_bpt-*.zip into a real Blender and tests it there. `make extension` makes the zip.
set -euo pipefail
cd "$(dirname "$0")/../.."
VLP_BLENDER=$(tests/blender/get_blender.sh)
export VLP_BLENDER
"$VLP_BLENDER" --version | head -1
.venv/bin/python -m pytest tests/blender "$@"

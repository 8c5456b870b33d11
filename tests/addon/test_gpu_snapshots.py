"""The snapshots that the GPU's tests render, where there is no Blender, are those of the .blend files."""

from __future__ import annotations

from pathlib import Path

import bpy
import pytest

from vlp_bpt.snapshot import load_snapshot, scene_digest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.skipif(bpy.app.version < (5, 0), reason="made by Blender 5")
@pytest.mark.parametrize("path", sorted((ROOT / "tests/gpu").glob("*.vlp.npz")), ids=lambda path: path.name)
def test_a_snapshot_is_that_of_its_file(path: Path) -> None:
    """If not: vlp-bpt export scenes/NAME.blend -o tests/gpu/NAME.vlp.npz"""
    from vlp_bpt._blender import capture_blend

    captured, _ = capture_blend(ROOT / "scenes" / path.name.replace(".vlp.npz", ".blend"), None, {})
    assert scene_digest(load_snapshot(path).scene) == scene_digest(captured.scene)

"""What the GPU's tests and benchmark share: the device, and snapshots of the scenes, as there is no bpy.

VLP_TEST_DEVICE=CPU runs them on the processor, to test the tests.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vlp_bpt import Renderer, RenderSettings
from vlp_bpt.scene import Film, Scene
from vlp_bpt.snapshot import load_snapshot

DEVICE = os.environ.get("VLP_TEST_DEVICE", "CUDA")
SCENES = ("cornell_box", "sierpinski", "indirect_room")
FORM = "VLP_BPT_GPU_EYE_PASS"  # names the form of the eye pass; without it the faster one is found out
FORMS = ("paths", "wavefront")


def load(name: str, film: Film | None = None) -> Scene:
    """A scene of `scenes/`, 48 pixels wide unless `film` says more."""
    scene = load_snapshot(Path(__file__).with_name(f"{name}.vlp.npz")).scene
    scene.film = film or Film(48, 48)
    return scene


def renderer(scene: Scene, device: str = DEVICE, iterations: int = 4, first: int = 0, **values: object) -> Renderer:
    """After `iterations` from `first` on, on the device itself: no other took its place."""
    settings = RenderSettings.from_dict({"samples": iterations, "device": device, "filter": "BOX", **values})
    made = Renderer(scene, settings, first_iteration=first)
    assert made.iterate(iterations) == iterations
    assert not made.warnings
    assert made.statistics.dropped == 0
    if device == "CUDA" and FORM in os.environ:
        assert made.statistics.eye_form == os.environ[FORM]
    return made


def picture(scene: Scene, device: str = DEVICE, iterations: int = 4, **values: object) -> NDArray[np.float64]:
    return renderer(scene, device, iterations, **values).read()[..., :3].astype(np.float64)

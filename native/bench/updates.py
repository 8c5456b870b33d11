"""Seconds of Renderer.update after one mesh or one instance of a scene has moved, beside making the scene anew.

.venv/bin/python scenes/million.py --output out/million.blend
.venv/bin/vlp-bpt export out/million.blend -o out/million.vlp.npz
.venv/bin/python native/bench/updates.py out/million.vlp.npz
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from unittest import mock

import numpy as np

from vlp_bpt import Device, Renderer, RenderSettings
from vlp_bpt.changes import Changes
from vlp_bpt.scene import Mesh, Scene
from vlp_bpt.snapshot import load_snapshot


def edit_mesh(scene: Scene, step: int) -> None:
    """The last mesh, a little twisted."""
    mesh = scene.geometries[-1]
    assert isinstance(mesh, Mesh)
    x, y, z = mesh.positions.T
    angle = 0.1 * np.sin(step + z / np.ptp(z))
    turned = np.stack([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y, z], axis=1)
    mesh.positions = turned.astype(np.float32)


def move_instance(scene: Scene, step: int) -> None:
    transform = scene.instances[-1].transform.copy()
    transform[step % 3, 3] += np.float32(0.01)
    scene.instances[-1].transform = transform


def seconds(renderer: Renderer, scene: Scene, edit: Callable[[Scene, int], None], step: int) -> tuple[float, float]:
    """Wall clock and processor."""
    edit(scene, step)
    started, worked = time.perf_counter(), time.process_time()
    renderer.update(scene)
    return time.perf_counter() - started, time.process_time() - worked


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("snapshot", type=Path)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--threads", type=int, default=0)
    args = parser.parse_args()
    scene = load_snapshot(args.snapshot).scene
    scene.film.width = scene.film.height = 64
    renderer = Renderer(scene, RenderSettings(samples=1, device=Device.CPU, threads=args.threads))
    for edit in (edit_mesh, move_instance):
        rows = []
        for step in range(args.repeats):
            with mock.patch("vlp_bpt.render.changes", lambda *_: Changes()):
                anew = seconds(renderer, scene, edit, 3 * step)
            first = seconds(renderer, scene, edit, 3 * step + 1)  # after a build it looks at all of the tree twice
            later = seconds(renderer, scene, edit, 3 * step + 2)
            rows.append((*anew, *first, *later, anew[0] / later[0], anew[1] / later[1]))
        medians = [statistics.median(column) for column in zip(*rows, strict=True)]
        names = ["anew", "anew (CPU)", "first", "first (CPU)", "later", "later (CPU)", "ratio", "ratio (CPU)"]
        print(f"{edit.__name__}: " + ", ".join(f"{n} {m:.3f}" for n, m in zip(names, medians, strict=True)))


if __name__ == "__main__":
    main()

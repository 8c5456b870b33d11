"""Converged REFERENCE pictures of the four scenes against Cycles: regions within 1 %, blocks equal, plus noise.

Slow: run with --slow. Both renderers' batches are kept in out/references, so a second run is quick. A false alarm of
any comparison has a probability of 1e-3.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from stats import assert_agree, compare

bpy = pytest.importorskip("bpy")

from vlp_bpt import Renderer, RenderSettings  # noqa: E402
from vlp_bpt.bench import find_scene, load_scene, mesh_variant, native_file  # noqa: E402
from vlp_bpt.bench.references import batches, cycles_batches, fingerprint  # noqa: E402
from vlp_bpt.snapshot import scene_digest  # noqa: E402

SIZE = 128
CYCLES_SAMPLES = 256  # of one batch
LONGEST = 64  # surface hits of a path, in both renderers


@dataclass(frozen=True)
class Case:
    """A scene, the iterations of each of our batches, both renderers' batches, and whether the scenes are the same."""

    name: str
    iterations: int
    our_batches: int
    cycles_batches: int
    blocks_equal: bool = True


CASES = [
    Case("cornell_box", iterations=64, our_batches=16, cycles_batches=16),
    Case("caustics", iterations=64, our_batches=64, cycles_batches=64),
    Case("indirect_room", iterations=64, our_batches=64, cycles_batches=64),
    # Cycles renders meshes for the spheres: blocks at the rim of a mirror or glass sphere differ by their facets.
    Case("sierpinski", iterations=128, our_batches=48, cycles_batches=16, blocks_equal=False),
]


def our_batches(name: str, path: Path, iterations: int, count: int) -> np.ndarray:
    """(count, SIZE, SIZE, 3) of REFERENCE mode, top row first, a seed for each batch."""
    scene = load_scene(path, SIZE)
    key = fingerprint([native_file()], {"scene": scene_digest(scene), "iterations": iterations})

    def make(index: int) -> np.ndarray:
        settings = RenderSettings.from_dict({"mode": "REFERENCE", "samples": iterations, "seed": index + 1})
        return np.ascontiguousarray(Renderer(scene, settings).render().pixels[::-1, :, :3])

    return batches(f"{name}-ours", key, count, make)


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_reference_agrees_with_cycles(case: Case) -> None:
    path = find_scene(case.name)
    ours = our_batches(case.name, path, case.iterations, case.our_batches)
    other = mesh_variant(path, levels=6) if case.name == "sierpinski" else path
    theirs = cycles_batches(
        other, size=(SIZE, SIZE), count=case.cycles_batches, samples=CYCLES_SAMPLES, scatterings=LONGEST
    )
    comparison = compare(ours, theirs, tolerance=0.01, most_noise=0.006, blocks_equal=case.blocks_equal)
    again = f"pytest --slow tests/python/test_against_cycles.py -k {case.name} (seeds from 1)"
    assert_agree(f"{case.name}_against_cycles", comparison, again)

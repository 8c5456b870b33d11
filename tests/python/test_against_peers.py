"""Converged REFERENCE pictures against Cycles and Mitsuba: regions within 0.5 %, blocks equal, plus noise.

Slow: run with --slow, which needs bpy and Mitsuba (`make test-slow` installs both). All renderers' batches are kept in
out/references, so a second run is quick. A false alarm of any comparison has a probability of 1e-3, that of any in this
file 3 %; the seeds are fixed, so what has passed passes again.

Where the peers disagree with each other, the case names the one that computes something else, and why; the test holds
us against the other, and the two peers against each other, so that no excuse outlives its reason.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from peer_scenes import MAKERS, blend
from stats import assert_agree, compare

from vlp_bpt import Renderer, RenderSettings, Scene
from vlp_bpt.bench.references import batches, cycles_batches, fingerprint, mitsuba_batches, native_file
from vlp_bpt.bench.scenes import find_scene, load_scene, mesh_variant
from vlp_bpt.snapshot import scene_digest

SIZE = 64
BATCHES = 32
LONGEST = 64  # surface hits of a path, in all renderers
TOLERANCE = 0.005
MOST_NOISE = 0.006

SHADING_HORIZON = (
    "Mitsuba's diffuse surfaces scatter all around the shading normal, below the surface too, and are black where they "
    "are seen from behind it; Cycles and this renderer scatter above the surface alone, whatever side it is seen from"
)


@dataclass(frozen=True)
class Case:
    """A scene, the iterations and samples of one batch, and the number of our batches.

    `joined` batches are taken as one: where there are fireflies, means of more samples are closer to normal. `regions`
    is their number along each side, fewer where the dark ones stay too noisy. `other` says in which peer's picture, and
    why, something else is computed; `facets` that Cycles has meshes where Mitsuba and we have spheres.
    """

    name: str
    iterations: int
    cycles: int
    mitsuba: int
    our_batches: int = BATCHES
    joined: int = 1
    regions: int = 4
    other: tuple[str, str] | None = None
    facets: bool = False


CASES = [
    Case("cornell_box", iterations=64, cycles=64, mitsuba=128),
    Case("caustics", iterations=256, cycles=256, mitsuba=256, joined=2, regions=2),
    Case("indirect_room", iterations=256, cycles=640, mitsuba=512, regions=2),
    Case("sierpinski", iterations=512, cycles=320, mitsuba=512, joined=4, facets=True),
    Case("bumpy_furnace", iterations=32, cycles=32, mitsuba=32, other=("mitsuba", SHADING_HORIZON)),
    Case("mis_plates", iterations=256, cycles=128, mitsuba=256),
    Case("thousand_lights", iterations=128, cycles=64, mitsuba=128),
    Case("sun_and_glass", iterations=256, cycles=64, mitsuba=128, joined=2),
    Case("sky", iterations=32, cycles=32, mitsuba=32),
    Case("depth_of_field", iterations=96, cycles=192, mitsuba=320),
    Case("scaled_emitters", iterations=128, cycles=64, mitsuba=256),
    Case("glass_window", iterations=192, cycles=256, mitsuba=256, our_batches=40),
]


def our_batches(name: str, scene: Scene, iterations: int, count: int) -> np.ndarray:
    """(count, h, w, 3) of REFERENCE mode, top row first, a seed for each batch."""
    values = {"mode": "REFERENCE", "samples": iterations, "filter": "BOX", "filter_width": 1.0}
    key = fingerprint([native_file()], {"scene": scene_digest(scene), **values})

    def make(index: int) -> np.ndarray:
        settings = RenderSettings.from_dict(values | {"seed": index + 1})
        return np.ascontiguousarray(Renderer(scene, settings).render().pixels[::-1, :, :3])

    return batches(f"{name}-ours", key, count, make)


def join(pictures: np.ndarray, count: int) -> np.ndarray:
    """Means of `count` batches each: (n, h, w, 3) -> (n / count, h, w, 3)."""
    return pictures.astype(np.float64).reshape(-1, count, *pictures.shape[1:]).mean(axis=1)


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_reference_agrees_with_peers(case: Case) -> None:
    path = blend(case.name) if case.name in MAKERS else find_scene(case.name)
    scene = load_scene(path, SIZE)
    ours = our_batches(case.name, scene, case.iterations, case.our_batches)
    meshes = mesh_variant(path, levels=6) if case.facets else path
    peers = {
        "cycles": cycles_batches(meshes, size=(SIZE, SIZE), count=BATCHES, samples=case.cycles, scatterings=LONGEST),
        "mitsuba": mitsuba_batches(case.name, scene, count=BATCHES, samples=case.mitsuba, scatterings=LONGEST),
    }
    again = f"pytest --slow tests/python/test_against_peers.py -k {case.name} (seeds from 1)"
    for peer, theirs in peers.items():
        if case.other is not None and peer == case.other[0]:
            continue
        equal = not (case.facets and peer == "cycles")  # blocks at the rim of a mirror or glass ball show its facets
        comparison = compare(
            join(ours, case.joined),
            join(theirs, case.joined),
            tolerance=TOLERANCE,
            most_noise=MOST_NOISE,
            regions=case.regions,
            blocks_equal=equal,
        )
        assert_agree(f"{case.name}_against_{peer}", comparison, again)
    if case.other is not None:
        peer, reason = case.other
        agree = not compare(*peers.values(), tolerance=TOLERANCE).failures
        assert not agree, f"{case.name}: the peers agree now, so {peer} need not be left out because {reason}"

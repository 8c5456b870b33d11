"""bench/luxcore.py: the Cornell box looks as it does here, and what LuxCore has no equivalent for is named.

What needs pyluxcore is slow: `make test-slow` installs it. The comparisons are t-tests over independent batches.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scenes_for_tests import Builder, ball, grey, looking, quad, sphere, square, transform
from stats import assert_agree, compare

from vlp_bpt import Renderer, RenderSettings, Scene, materials
from vlp_bpt.bench import luxcore
from vlp_bpt.bench.contestants import LuxCore
from vlp_bpt.bench.remote import Remote
from vlp_bpt.bench.scenes import find_scene, load_scene
from vlp_bpt.scene import AreaLight, Material, PointLight, Projection, Visibility, World

BATCHES, SIZE, SECONDS = 10, 64, 4.0


def test_the_ball_that_stands_for_spheres_is_round_and_faces_outwards() -> None:
    points, normals = luxcore._ball()
    assert len(points) == 2 * (luxcore.RINGS - 1) * luxcore.SEGMENTS
    across = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    assert (np.sum(across * points.mean(axis=1), axis=1) > 0).all()
    assert np.linalg.norm(across, axis=1).sum() / 2 == pytest.approx(4 * np.pi, rel=2e-3)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1, atol=1e-12)


def test_mirrored_meshes_face_the_same_way() -> None:
    mesh = ball(6, 8)
    matrix = transform((1, 2, 3), (-2, 1, 1)).astype(np.float64)
    points, normals = luxcore._placed(mesh, matrix, np.arange(len(mesh.triangles)))
    assert normals is not None
    across = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    assert (np.sum(across * (points.mean(axis=1) - matrix[:, 3]), axis=1) > 0).all()
    assert (np.sum(across * normals.mean(axis=1), axis=1) > 0).all()


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["PATHCPU", "BIDIRCPU"])
def test_the_cornell_box_agrees(engine: str) -> None:
    scene = load_scene(find_scene("cornell_box"), SIZE)
    values = {"mode": "REFERENCE", "samples": 96, "filter": "BOX", "filter_width": 1.0}
    ours = [
        Renderer(scene, RenderSettings.from_dict(values | {"seed": seed})).render().pixels[::-1, :, :3]
        for seed in range(BATCHES)
    ]
    theirs = []
    for seed in range(BATCHES):
        with Remote(LuxCore(engine, scene, engine, 64, seed=seed)) as remote:
            remote.prepare()
            remote.run(SECONDS)
            theirs.append(remote.picture())
    found = compare(
        np.stack(ours).astype(float), np.stack(theirs), tolerance=0.005, most_noise=0.02, blocks_equal=False
    )
    assert_agree(f"cornell_box_against_luxcore_{engine}", found, "pytest --slow tests/python/test_luxcore_scenes.py")


def stage(material: Material | None = None, shape: Any = None) -> Builder:
    """A floor, a wall and a thing, seen by a pinhole."""
    wall = quad((-1.5, 1.2, 0), (1.5, 1.2, 0), (1.5, 1.2, 2), (-1.5, 1.2, 2), name="wall")
    builder = Builder(16, looking((0.4, -2.6, 1.8), (0, 0.2, 0.5), 0.4)).add(square(8), grey(0.6)).add(wall, grey(0.7))
    return builder.add(shape or sphere(), material) if material else builder


def changed(change: Callable[[Scene], object]) -> Scene:
    scene = stage().scene
    change(scene)
    return scene


LAMP = AreaLight("lamp", transform((0, 0, 2)), (20, 18, 15), (0.8, 0.5))
REFUSED: dict[str, Callable[[], Scene]] = {
    "'the paint' has 2 lobes": lambda: stage(materials.principled(name="the paint")).scene,
    "'neon' shines": lambda: stage(materials.emission(name="neon")).scene,
    "'Translucent': TRANSLUCENT": lambda: stage(materials.translucent()).scene,
    "DIELECTRIC with roughness 0.3": lambda: stage(materials.glass(roughness=0.3)).scene,
    "'bulb' is a PointLight": lambda: changed(lambda s: s.lights.append(PointLight("bulb", (0, 0, 1), (1, 1, 1)))),
    "'lamp' is an ellipse": lambda: changed(lambda s: s.lights.append(replace(LAMP, ellipse=True))),
    "world 'World' has an image": lambda: changed(
        lambda s: setattr(s, "world", World(radiance=(1, 1, 1), image=np.ones((4, 8, 3), np.float32)))
    ),
    "not a pinhole": lambda: changed(lambda s: setattr(s.camera, "projection", Projection.ORTHOGRAPHIC)),
    "no camera": lambda: changed(lambda s: setattr(s, "camera", None)),
    "hidden from the camera": lambda: changed(lambda s: setattr(s.instances[0], "visibility", Visibility(0))),
}


@pytest.mark.slow
@pytest.mark.parametrize("words", REFUSED)
def test_what_has_no_equivalent_is_refused(words: str) -> None:
    with pytest.raises(luxcore.NotConvertible, match=words):
        luxcore.Session(REFUSED[words](), "PATHCPU", {}, threads=1, seed=0)

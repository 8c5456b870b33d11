"""Light paths sent through windows and begun at the lamps that matter find the same light as eye paths alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scenes_for_tests import Builder, assert_same_mean, batches, blocks, grey, looking, settings, transform

from vlp_bpt import Renderer, RenderSettings
from vlp_bpt.scene import AreaLight, Film, Mesh, Scene, SunLight, World
from vlp_bpt.settings import Mode


def block(low: tuple[float, float, float], high: tuple[float, float, float]) -> Mesh:
    points = [(x, y, z) for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    return Mesh("block", np.array(points), np.array(triangles))


def windowed_room() -> Builder:
    """3 m wide, with a window of 1 x 1 m, in a land of 60 m."""
    builder = Builder()
    white, ground = grey(0.6), grey(0.3)
    for low, high in (
        ((-2, -2, -0.1), (2, 2, 0)),
        ((-2, -2, 3), (2, 2, 3.1)),
        ((-2, 2, 0), (2, 2.1, 3)),
        ((-2, -2.1, 0), (2, -2, 3)),
        ((-2.1, -2, 0), (-2, 2, 3)),
        ((2, -2, 0), (2.1, 2, 1)),
        ((2, -2, 2), (2.1, 2, 3)),
        ((2, -2, 1), (2.1, -0.5, 2)),
        ((2, 0.5, 1), (2.1, 2, 2)),
    ):
        builder.add(block(low, high), white)
    builder.add(block((-30, -30, -1), (30, 30, -0.5)), ground)
    return builder


def sun() -> SunLight:
    z = np.array([1.0, 0.2, 0.8]) / np.linalg.norm([1.0, 0.2, 0.8])
    x = np.cross([0, 0, 1], z) / np.linalg.norm(np.cross([0, 0, 1], z))
    matrix = np.stack([x, np.cross(z, x), z, [0, 0, 0]], axis=1)
    return SunLight("sun", matrix.astype(np.float32), (12.0, 11.0, 10.0), 0.2)


CAMERA = looking((-1.5, -1.5, 1.5), (-0.5, 2.0, 0.5), 0.5)  # away from the window: hits alone show the sky in it


def under_sky_and_sun() -> Scene:
    scene = windowed_room().scene
    scene.lights.append(sun())
    scene.world = World("sky", (0.5, 0.7, 1.0))
    return scene


def under_sky() -> Scene:
    scene = windowed_room().scene
    scene.world = World("sky", (1.5, 1.7, 2.0))
    return scene


def among_lamps() -> Scene:
    scene = windowed_room().scene
    scene.lights.append(AreaLight("lamp", transform((0.0, 0.0, 2.9)), (10.0, 9.0, 8.0), (0.5, 0.5)))
    for i in range(6):
        scene.lights.append(AreaLight(f"lamp {i}", transform((4.0 + i, 8.0, 3.0)), (30.0, 30.0, 30.0), (0.5, 0.5)))
    return scene


@pytest.mark.parametrize("make, portals, lights", [(under_sky_and_sun, True, False), (among_lamps, False, True)])
def test_what_it_found_is_told(make: Callable[[], Scene], portals: bool, lights: bool) -> None:
    scene = make()
    scene.camera = CAMERA
    renderer = Renderer(scene, RenderSettings(samples=1, adaptive=False))
    told, taken = renderer.metadata(), renderer.statistics
    assert (taken.portals > 0, taken.favoured_lights > 0) == (portals, lights)
    assert (told["portals"], told["favoured_lights"]) == (taken.portals, taken.favoured_lights)
    same = Renderer(scene, RenderSettings(mode=Mode.PAPER, samples=1)).statistics
    assert (same.portals, same.favoured_lights) == (0, 0), "PAPER weighs all strategies the same"


def test_where_light_paths_are_left_out_nothing_is_told_of_them() -> None:
    scene = among_lamps()
    scene.camera, scene.film = CAMERA, Film(128, 128)
    renderer = Renderer(scene, RenderSettings(samples=1))
    renderer.render()
    assert (renderer.statistics.light_paths, renderer.statistics.favoured_lights) == (0, 0)


@pytest.mark.parametrize("make", [under_sky_and_sun, under_sky, among_lamps])
def test_finds_the_light_that_eye_paths_find(make: Callable[[], Scene]) -> None:
    scene = make()
    scene.camera = CAMERA
    common = {"samples": 400, "eye_path_length": 24, "roulette": True}
    guided = batches(scene, settings(light_path_length=12, splats=True, **common))
    # Renders that weigh all strategies the same have no guide; next event alone finds all light of diffuse surfaces.
    alone = batches(scene, settings(light_path_length=0, vlp_connections=0, weighting="UNIFORM", hits=False, **common))
    assert_same_mean(blocks(guided), blocks(alone), make.__name__)

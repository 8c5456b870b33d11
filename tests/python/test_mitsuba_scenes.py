"""bench/mitsuba.py: what it converts looks as it does here, and what it cannot convert is named.

Slow, as it needs Mitsuba: `make test-slow` installs it. Comparisons are t-tests over independent batches with Sidak's
correction, at a false-alarm rate of 1e-4 each, of fixed seeds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scenes_for_tests import (
    Builder,
    assert_same_mean,
    ball,
    batches,
    blocks,
    from_above,
    grey,
    looking,
    quad,
    settings,
    sphere,
    square,
    transform,
)

from vlp_bpt import Scene, materials
from vlp_bpt.bench import mitsuba
from vlp_bpt.scene import AreaLight, Camera, Film, Material, PointLight, SpotLight, SunLight, Visibility, World

pytestmark = pytest.mark.slow

TURNED = np.array([[0.8, 0, 0.6, 0.2], [0, 1, 0, -0.1], [-0.6, 0, 0.8, 1.4]], np.float32)
SHINING = Material("light", (), (3.0, 2.0, 1.0))
AT = transform((0.1, -0.1, 0.6), (0.5, 0.5, 0.5))


def stage(camera: Camera | None = None) -> Builder:
    """A floor and a wall, without light."""
    wall = quad((-1.5, 1.2, 0), (1.5, 1.2, 0), (1.5, 1.2, 2), (-1.5, 1.2, 2), name="wall")
    view = camera or looking((0.4, -2.6, 1.8), (0, 0.2, 0.5), 0.4)
    return Builder(16, view).add(square(8), grey(0.6)).add(wall, Material("red", grey(0.7).lobes))


def lit(*lights: Any, camera: Camera | None = None) -> Scene:
    builder = stage(camera)
    builder.scene.lights = list(lights)
    return builder.scene


def holding(material: Material, shape: Any = None, matrix: Any = AT) -> Scene:
    """A thing under a sky."""
    builder = stage().add(sphere() if shape is None else shape, material, matrix)
    builder.scene.world = World(radiance=(0.5, 0.8, 1.0))
    return builder.scene


def under_lamp(material: Material) -> Scene:
    """A thing whose highlight shows how rough it is."""
    scene = stage().add(sphere(), material, AT).scene
    scene.lights = [PointLight("lamp", (0.6, -1.8, 2.0), (60, 50, 40), 0.1)]
    return scene


def hidden_lamp(**change: Any) -> AreaLight:
    return replace(AreaLight("lamp", TURNED, (20, 18, 15), (0.8, 0.5)), **change)


ALIKE: dict[str, Callable[[], Scene]] = {
    "point": lambda: lit(PointLight("lamp", (0.2, -0.3, 1.2), (20, 18, 15))),
    "sphere of light": lambda: lit(PointLight("lamp", (0.2, -0.3, 1.2), (20, 18, 15), 0.3)),
    "sphere of light in view": lambda: lit(PointLight("lamp", (0.2, 0.3, 0.9), (20, 18, 15), 0.3, Visibility.CAMERA)),
    "spot": lambda: lit(SpotLight("lamp", TURNED, (50, 40, 30), 1.2, 0.0)),
    "sharp sun": lambda: lit(SunLight("sun", TURNED, (3, 2, 1))),
    "wide sun": lambda: lit(SunLight("sun", TURNED, (3, 2, 1), 0.4)),
    "rectangle": lambda: lit(hidden_lamp()),
    "mirrored ellipse": lambda: lit(hidden_lamp(transform=TURNED * np.array([-1.5, 1, 1, 1]), ellipse=True)),
    "lamp in view that does not block": lambda: lit(
        hidden_lamp(transform=transform((0, 0, 0.7)), visibility=Visibility.CAMERA),
        PointLight("behind it", (0, 0, 1.4), (20, 18, 15)),
    ),
    "sheet that shines on both sides": lambda: stage().add(square(0.6), SHINING, TURNED).scene,
    "mirrored mesh that shines and scatters": lambda: (
        stage().add(ball(6, 8, smooth=False), grey(0.5, 2.0), transform((0.2, 0, 0.9), (-0.5, 0.3, 0.4))).scene
    ),
    "smooth mesh that shines": lambda: stage().add(ball(6, 8), SHINING, transform((0, 0, 0.9), (0.3, -0.3, 0.3))).scene,
    "shining sphere": lambda: stage().add(sphere(), grey(0.4, 2.0), AT).scene,
    "sky": lambda: holding(grey(0.5)),
    "mirror": lambda: holding(materials.mirror((0.9, 0.8, 0.7))),
    "metal": lambda: under_lamp(materials.glossy((0.9, 0.8, 0.7), 0.4, "GGX")),
    "conductor": lambda: under_lamp(materials.conductor(roughness=0.3, distribution="GGX")),
    "glass": lambda: holding(materials.glass((0.9, 1.0, 0.95))),
    "mirrored mesh of glass": lambda: holding(
        materials.glass(), ball(smooth=False), transform((0, 0, 0.7), (-0.5, 0.5, 0.5))
    ),
    "rough glass": lambda: holding(materials.glass((0.9, 1.0, 0.95), 0.3, distribution="GGX")),
    "clear sheet": lambda: holding(materials.transparent(), square(1.0), TURNED),
    "thin lens": lambda: lit(
        hidden_lamp(), camera=looking((0.4, -2.6, 1.8), (0, 0.2, 0.5), 0.4, aperture_radius=0.2, focus_distance=1.5)
    ),
    "parallel rays": lambda: lit(hidden_lamp(), camera=from_above(3, 1.2)),
}


@pytest.mark.parametrize("name", ALIKE)
def test_pictures_are_alike(name: str) -> None:
    scene = ALIKE[name]()
    options = {"mode": "REFERENCE", "samples": 96, "light_path_length": 8, "eye_path_length": 64, "light_paths": 256}
    ours = blocks(batches(scene, settings(**options), 12)[:, ::-1])
    theirs = blocks(
        np.stack([mitsuba.render(scene, samples=128, scatterings=64, seed=i) for i in range(12)]).astype(float)
    )
    assert_same_mean(ours, theirs, name)


def without_square_pixels() -> Scene:
    scene = lit()
    scene.film = Film(16, 8)
    return scene


REFUSED: dict[str, Callable[[], Scene]] = {
    "lobes": lambda: holding(materials.principled(name="the paint")),
    "adds back": lambda: holding(materials.glossy(roughness=0.3, name="the metal")),
    "roughness": lambda: holding(materials.glossy(roughness=0.8, distribution="GGX")),
    "SCHLICK": lambda: holding(materials.metallic(roughness=0.0)),
    "TRANSLUCENT": lambda: holding(materials.translucent()),
    "'Transparent': TRANSPARENT": lambda: holding(materials.transparent((0.5, 0.5, 0.5))),
    "shines and scatters": lambda: holding(grey(0.5, 1.0), ball()),
    "ellipsoids": lambda: holding(grey(0.5), sphere(), transform((0, 0, 1), (1, 2, 1))),
    "soft edge": lambda: lit(SpotLight("spot", TURNED, (1, 1, 1), 1.0, 0.2)),
    "spread": lambda: lit(hidden_lamp(spread=1.0)),
    "hidden": lambda: lit(hidden_lamp(), PointLight("seen", (0, 0, 1), (1, 1, 1), 0.1, Visibility.CAMERA)),
    "square": without_square_pixels,
}


@pytest.mark.parametrize("words", REFUSED)
def test_what_differs_is_refused(words: str) -> None:
    with pytest.raises(mitsuba.NotConvertible, match=words):
        mitsuba.convert(REFUSED[words](), 64)

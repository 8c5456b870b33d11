"""Settings that may change the noise and nothing else: equal means by t-tests over independent seeds.

Every comparison tests block means with Sidak's correction at a false-alarm rate of 1e-4; seeds are fixed and printed by
`assert_same_mean` along with the figures.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import pytest
from scenes_for_tests import (
    Array,
    Builder,
    assert_same_mean,
    ball,
    batches,
    blocks,
    grey,
    looking,
    quad,
    render,
    settings,
    sphere,
    square,
    transform,
)

from vlp_bpt import Renderer, Scene, materials
from vlp_bpt.scene import AreaLight, Lobe, LobeKind, Material, PointLight, World

RED = Material("red", (Lobe(LobeKind.DIFFUSE, (0.7, 0.3, 0.2)),))


def plates() -> Builder:
    """Diffuse, glossy and layered surfaces with smooth normals, apart: the noise of short connections has no bound."""
    wall = quad((-1, 1.3, 0.4), (1, 1.3, 0.4), (1, 1.3, 2), (-1, 1.3, 2), name="wall")
    side = quad((-1.4, 1, 0.3), (-1.4, -1, 0.3), (-1.4, -1, 1.5), (-1.4, 1, 1.5), name="side")
    camera = looking((0.3, -3.4, 1.5), (0, 0.2, 0.7), 0.42)
    builder = Builder(16, camera).add(square(2), grey(0.7))
    builder.add(wall, materials.glossy((0.8, 0.8, 0.8), 0.5)).add(
        side, materials.principled((0.6, 0.6, 0.7), roughness=0.5)
    )
    builder.add(ball(5, 6), RED, transform((-0.35, 0, 0.7), (0.35, 0.35, -0.3)))
    return builder.add(ball(6, 8), materials.glossy((0.9, 0.8, 0.7), 0.6), transform((0.6, 0.1, 0.8), (0.35, 0.3, 0.4)))


def lit_by_area() -> Scene:
    scene = plates().scene
    scene.lights = [AreaLight("lamp", transform((0.1, -0.2, 2.2), (1.5, 1, 1)), (40, 36, 30))]
    return scene


def lit_by_point() -> Scene:
    scene = plates().scene
    scene.lights = [PointLight("lamp", (0.1, -0.2, 2.2), (40, 36, 30))]
    return scene


def lit_by_sky() -> Scene:
    scene = plates().scene
    scene.world = World(radiance=(1, 0.9, 0.8))
    return scene


def lit_by_many() -> Scene:
    """Lamps, a shining mesh and a shining sphere among the surfaces, mirror and glass."""
    builder = plates().add(sphere((0.3, -0.6, 0.45), 0.2), materials.glass())
    builder.add(sphere((-0.9, -0.5, 0.5), 0.2), materials.mirror((0.9, 0.9, 0.9)))
    builder.add(ball(4, 6), grey(0.4, 4.0), transform((0.2, 0.6, 1.6), (0.2, 0.2, 0.1)))
    builder.add(sphere((-0.6, -0.4, 1.7), 0.2), grey(0.4, 3.0))
    scene = builder.scene
    scene.lights = [
        AreaLight("lamp", transform((0.1, -0.2, 2.2)), (20, 18, 15)),
        PointLight("p", (1, -1, 2), (5, 5, 9), 0.3),
    ]
    scene.world = World(radiance=(0.2, 0.2, 0.3))
    return scene


SCENES = {"area": lit_by_area, "point": lit_by_point, "sky": lit_by_sky}

# Without splats, (L, K) = (0, 6) finds paths of up to 8 vertices, and so do these:
SAME_LENGTHS = [(1, 5), (2, 4), (3, 3)]


def pictures(scene: Scene, count: int, seed: int, **options: Any) -> Array:
    return blocks(batches(scene, settings(**({"samples": 96} | options)), count, seed))


@cache
def by_paths(name: str) -> Array:
    """Path tracing with light samples: what the others must equal."""
    return pictures(
        SCENES[name](), 24, 1000, light_path_length=0, eye_path_length=6, vlp_connections=0, light_samples=2
    )


CHANGES: dict[str, dict[str, Any]] = {
    **{f"L{L}_K{K}": {"light_path_length": L, "eye_path_length": K} for L, K in SAME_LENGTHS},
    "N1": {"light_paths": 1, "samples": 1500},  # few light paths are skewed: more iterations
    "N64": {"light_paths": 64},
    "C3": {"vlp_connections": 3},
    "M4": {"vlp_candidates": 4},
    "C2_M11": {"vlp_connections": 2, "vlp_candidates": 11},
    "S4": {"light_samples": 4},
    "C3_S4_N64": {"light_paths": 64, "vlp_connections": 3, "light_samples": 4},
    "uniform": {"weighting": "UNIFORM"},
    "power": {"weighting": "POWER"},
    "fixed": {"roulette": False},
    "fixed_L3": {"roulette": False, "light_path_length": 3, "eye_path_length": 3},
}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("change", CHANGES)
def test_switches_leave_the_mean(name: str, change: str) -> None:
    options = {"light_path_length": 2, "eye_path_length": 4, "light_paths": 500, **CHANGES[change]}
    assert_same_mean(pictures(SCENES[name](), 12, 0, **options), by_paths(name), f"{name}, {change}")


@pytest.mark.parametrize("name", SCENES)
def test_many_light_paths(name: str) -> None:
    options = {"light_path_length": 2, "eye_path_length": 4, "light_paths": 100_000}
    few = blocks(batches(SCENES[name](), settings(samples=6, **options), 10, 0))
    assert_same_mean(few, by_paths(name), f"{name}, N = 1e5")


@cache
def many_lights_by_paths() -> Array:
    options = {"light_path_length": 0, "eye_path_length": 10, "vlp_connections": 0}
    return blocks(batches(lit_by_many(), settings(samples=1024, **options), 16, 500), 8)


@pytest.mark.slow
@pytest.mark.parametrize(
    "change",
    [{}, {"vlp_connections": 0, "light_samples": 3}, {"light_samples": 4, "vlp_connections": 3},
     {"weighting": "POWER"}, {"roulette": False}],
)  # fmt: skip
def test_many_lights_and_mirrors(change: dict[str, Any]) -> None:
    """Through mirrors and glass the windows differ in the paths that they find, so both are long: what only one of them
    finds has 10 reflections, below 1e-5 of the light."""
    options = {"light_path_length": 2, "eye_path_length": 10, "light_paths": 500, **change}
    pictures = blocks(batches(lit_by_many(), settings(samples=768, **options), 16, 0), 8)
    assert_same_mean(pictures, many_lights_by_paths(), f"many lights, {change}")


@pytest.mark.parametrize(("connections", "candidates"), [(1, 1), (3, 1), (2, 4)])
@pytest.mark.parametrize("L", [1, 4])
def test_kappa_counts_draws_of_a_virtual_light_point(L: int, connections: int, candidates: int) -> None:
    """kappa = M N / V, V by a pilot pass of its own: within four standard deviations of what an iteration stores."""
    N = 20_000
    options = {"light_path_length": L, "vlp_connections": connections, "vlp_candidates": candidates}
    renderer = Renderer(lit_by_area(), settings(light_paths=N, **options))
    renderer.iterate(1)
    per_path = renderer.statistics.vlps / N
    deviation = 0.5 * L / 4096**0.5  # of the pilot's mean; what a path stores lies in [0, L]
    assert candidates / renderer._native.kappa == pytest.approx(per_path, abs=4 * deviation)


def test_weights_prefer_the_better_strategy() -> None:
    """BALANCE and POWER are less noisy than UNIFORM where the light is small: weights do more than add up to one."""
    scene = plates().scene
    scene.lights = [AreaLight("lamp", transform((0.1, -0.2, 2.2), (0.1, 0.1, 1)), (40, 36, 30))]
    noise = {
        w: batches(scene, settings(samples=32, weighting=w, light_paths=500), 6).std(axis=0, ddof=1).mean()
        for w in ("UNIFORM", "BALANCE", "POWER")
    }
    print({w: round(float(n), 4) for w, n in noise.items()})
    assert noise["BALANCE"] < 0.6 * noise["UNIFORM"]
    assert noise["POWER"] < 0.6 * noise["UNIFORM"]


def test_candidates_are_kept_by_their_light() -> None:
    """The same light with less noise, where connections alone find it."""
    options = {"light_samples": 0, "hits": False, "splats": False, "light_paths": 500, "samples": 64}
    few, many = (batches(lit_by_area(), settings(vlp_candidates=m, **options), 12) for m in (1, 8))
    assert_same_mean(blocks(few), blocks(many), "M = 1, M = 8")
    assert many.std(axis=0, ddof=1).mean() < 0.7 * few.std(axis=0, ddof=1).mean()


@pytest.mark.parametrize("strategies", [{}, {"light_samples": 0}, {"splats": False, "vlp_connections": 0}])
def test_clamps_bound_what_is_indirect_or_direct(strategies: dict[str, Any]) -> None:
    """A limit that nothing reaches changes no bit; a low one keeps the other kind of light as it was."""
    scene = lit_by_area()
    options = {"samples": 32, "light_paths": 500, "light_path_length": 2, "eye_path_length": 4, "seed": 3, **strategies}
    free = render(scene, settings(**options))
    assert (render(scene, settings(clamp_direct=1e6, clamp_indirect=1e6, **options)) == free).all()
    direct = {"eye_path_length": 2 if strategies.get("light_samples") == 0 else 1, "light_path_length": 1}
    alone = settings(**options | direct | {"vlp_connections": 0})
    dark = render(scene, settings(clamp_indirect=1e-9, **options))
    assert render(scene, settings(clamp_direct=1e-9, clamp_indirect=1e-9, **options))[..., :3].max() < 1e-6
    assert dark[..., :3].mean() < 0.97 * free[..., :3].mean()
    assert dark[..., :3].mean() == pytest.approx(render(scene, alone)[..., :3].mean(), rel=0.03)


def test_world_and_lamps_add_up() -> None:
    """Light is linear: two lights together are the sum of each alone."""
    scene = lit_by_area()
    sky = lit_by_sky()
    options = {"light_path_length": 2, "eye_path_length": 4, "light_paths": 500}
    alone = pictures(scene, 12, 0, **options) + pictures(sky, 12, 100, **options)
    scene.world = sky.world
    assert_same_mean(pictures(scene, 12, 200, **options), alone, "area and sky")


def test_nothing_shines() -> None:
    scene = plates().scene
    assert any("black" in warning for warning in scene.validate())
    assert (render(scene, settings()) == 0).all()

"""Pictures with a closed form: furnaces, form factors, lamps over a plane, spheres lit from inside and from everywhere.

Noisy ones are t-tests of independent batches with Sidak's correction, at a false-alarm rate of 1e-4 each, of fixed
seeds.
"""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
from scenes_for_tests import (
    Array,
    Builder,
    assert_mean,
    ball,
    batches,
    blocks,
    cube,
    from_above,
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
from vlp_bpt.scene import (
    AreaLight,
    Lobe,
    LobeKind,
    Material,
    Mesh,
    PointLight,
    Spheres,
    SpotLight,
    SunLight,
    Visibility,
    World,
)

HITS_ONLY: dict[str, Any] = {"light_samples": 0, "vlp_connections": 0, "splats": False, "roulette": False}
DIRECT: dict[str, Any] = {"light_path_length": 0, "vlp_connections": 0, "eye_path_length": 2}


def geometric(ratio: float, terms: int) -> float:
    return float(sum(ratio**i for i in range(terms)))


# Furnaces: inside a closed surface of albedo a that emits e everywhere, light of i reflections has radiance e a^i


def furnace(shape: Mesh | Spheres, matrix: Any, albedo: float = 0.6, emission: float = 0.5) -> Scene:
    camera = looking((0.1, -0.2, 0.05), (0.5, 1, 0.3), 0.8)
    return Builder(8, camera).add(shape, grey(albedo, emission), matrix).scene


FURNACES = {
    "cube": (cube(), transform(), 1e-5),
    "inward_cube": (cube(inward=True), transform(), 1e-5),
    "mirrored_cube": (cube(), transform(scale=(-1, 1, 1)), 1e-5),
    "flattened_cube": (cube(), transform(scale=(1, 1.5, 0.6)), 1e-5),
    "ball": (ball(smooth=False), transform(), 1e-5),
    "sphere": (sphere(), transform(), 1e-5),
    "large_sphere": (sphere(radius=100), transform(), 1e-5),
    "ellipsoid": (sphere(), transform(scale=(1, 1.5, -0.6)), 1e-5),
    # The lobe around a shading normal loses what lies beyond the surface: (1 - cos) / 2 of the normals
    "smooth_ball": (ball(40, 80), transform(), 2e-3),
    "mirrored_smooth_ball": (ball(40, 80), transform(scale=(1, 1, -1)), 2e-3),
    "inward_smooth_ball": (ball(40, 80, inward=True), transform(scale=(1, 1.2, 0.8)), 2e-3),
}


@pytest.mark.parametrize("name", FURNACES)
@pytest.mark.parametrize("hits", [1, 2, 7, 30])
def test_furnace_by_hits_is_exact(name: str, hits: int) -> None:
    """Hits alone have no noise, as every path meets the same light: K hits see K terms of the series."""
    shape, matrix, rounding = FURNACES[name]
    scene = furnace(shape, matrix)
    picture = render(scene, settings(samples=4, eye_path_length=hits, light_path_length=0, **HITS_ONLY))
    np.testing.assert_allclose(picture, 0.5 * geometric(0.6, hits), rtol=rounding)


@pytest.mark.parametrize("name", FURNACES)
def test_furnace_by_all_strategies(name: str) -> None:
    """L = 2, K = 4: paths of up to K + 1 + L + 1 = 8 vertices, 6 reflections. Ellipsoids are found by hits alone."""
    shape, matrix, rounding = FURNACES[name]
    terms = 4 if name == "ellipsoid" else 7
    options = settings(samples=64, eye_path_length=4, light_path_length=2, light_paths=300)
    pictures = blocks(batches(furnace(shape, matrix), options, 12), 8)
    assert_mean(pictures, 0.5 * geometric(0.6, terms), name, rounding=max(rounding, 1e-4))


# Inside of a diffuse sphere of radius R with a point light of power P at its centre: i reflections a^i P / (4 pi^2 R^2)


def lit_inside(albedo: float = 0.7) -> Scene:
    camera = looking((0.3, -0.5, 0.2), (0.5, 1, 0.3), 0.7)
    scene = Builder(8, camera).add(sphere(radius=2), grey(albedo)).scene
    scene.lights = [PointLight("lamp", (0, 0, 0), (100, 50, 25))]
    return scene


@pytest.mark.parametrize("splats", [False, True])
@pytest.mark.parametrize(
    ("L", "K", "C", "S"),
    [(0, 1, 1, 1), (0, 4, 1, 2), (3, 3, 0, 1), (5, 2, 0, 1), (1, 1, 1, 1), (1, 3, 3, 1), (3, 1, 1, 1), (3, 2, 1, 1),
     (2, 5, 2, 3), (5, 5, 1, 1)],
)  # fmt: skip
def test_windows_lose_exactly_the_longer_paths(L: int, K: int, C: int, S: int, splats: bool) -> None:
    """The longest path has K + 1 vertices of the eye walk and L + 1 of the light walk, or 1 where no VLP is joined; a
    splat has L + 1 and the lens."""
    longest = max(K + 1 + (L + 1 if L > 0 and C > 0 else 1), L + 2 if splats and L > 0 else 0)
    expected = 100 / (4 * pi**2 * 2**2) * sum(0.7 ** (n - 2) for n in range(3, longest + 1)) * np.array([1, 0.5, 0.25])
    options = settings(
        samples=64, light_path_length=L, eye_path_length=K, vlp_connections=C, light_samples=S, light_paths=200,
        splats=splats,
    )  # fmt: skip
    pictures = blocks(batches(lit_inside(), options, 12), 8)
    assert_mean(pictures, expected, f"L {L}, K {K}, C {C}, S {S}, splats {splats}", rounding=1e-4)


@pytest.mark.parametrize("splats", [False, True])
@pytest.mark.parametrize(("L", "K", "C"), [(0, 1, 1), (0, 4, 1), (3, 2, 1), (5, 1, 0), (2, 5, 2), (64, 64, 1)])
def test_lost_light_is_that_of_the_longer_paths(L: int, K: int, C: int, splats: bool) -> None:
    """Of a geometric series; the pilot itself follows 64 reflections. Within four of its standard errors."""
    longest = max(K + 1 + (L + 1 if L > 0 and C > 0 else 1), L + 2 if splats and L > 0 else 0)
    lost = 1 - geometric(0.7, longest - 2) / geometric(0.7, 64)
    options = settings(light_path_length=L, eye_path_length=K, vlp_connections=C, light_paths=200, splats=splats)
    share, error = Renderer(lit_inside(), options).lost_light()
    assert error < 0.02
    assert share == pytest.approx(max(lost, 0), abs=4 * error + 1e-6)


def test_lost_light_knows_mirrors() -> None:
    """The camera sees a ground in a mirror alone, which joins neither light samples nor virtual light points: an eye
    path of one hit finds nothing, whatever the light paths are."""
    mirror = Material("mirror", (Lobe(LobeKind.REFLECTION, (1, 1, 1)),))
    builder = Builder(16, looking((0, 0, 1), (0, 0, 3), 0.2, up=(0, 1, 0)))
    builder.add(square(2, (0, 0, 3)), mirror).add(square(8, (0, 0, 0)), grey(0.5))
    builder.scene.lights = [PointLight("lamp", (2, 0, 1), (10, 10, 10))]
    lengths = {K: settings(eye_path_length=K, light_path_length=5) for K in (1, 2, 8)}
    shares = {K: Renderer(builder.scene, options).lost_light() for K, options in lengths.items()}
    assert shares[1][0] == 1
    assert shares[2][0] < 0.5
    assert shares[8][0] < 0.001


@pytest.mark.parametrize("splats", [False, True])
@pytest.mark.parametrize(("L", "K"), [(2, 2), (4, 3)])
def test_light_paths_without_light_samples(L: int, K: int, splats: bool) -> None:
    """S = 0: no hits on a point light either, so the shortest path has two vertices of the light walk and, but for
    splats, two of the eye walk."""
    lengths = range(3 if splats else 4, K + 1 + L + 1 + 1)
    expected = 100 / (4 * pi**2 * 2**2) * sum(0.7 ** (n - 2) for n in lengths) * np.array([1, 0.5, 0.25])
    options = settings(
        samples=64, light_path_length=L, eye_path_length=K, light_samples=0, light_paths=200, splats=splats
    )
    assert_mean(blocks(batches(lit_inside(), options, 12), 8), expected, f"L {L}, K {K}", rounding=1e-4)


def test_reference_mode_converges_to_the_whole_series() -> None:
    """Russian roulette: 100 / (16 pi^2) * a / (1 - a), but for what lies beyond 64 + 64 reflections."""
    options = settings(mode="REFERENCE", samples=64, light_path_length=64, eye_path_length=64, light_paths=200)
    pictures = blocks(batches(lit_inside(), options, 12), 8)
    assert_mean(pictures, 100 / (16 * pi**2) * 0.7 / 0.3 * np.array([1, 0.5, 0.25]), "REFERENCE", rounding=1e-4)


# Convex bodies under a constant sky: white ones and clear ones vanish in it


@pytest.mark.parametrize(
    ("shape", "matrix"),
    [
        (sphere(), transform()),
        (sphere(), transform(scale=(1.2, 0.4, -0.8))),
        (cube(), transform(scale=(0.7, 0.7, 0.7))),
        (ball(smooth=False), transform(scale=(-1, 1, 0.5))),
    ],
)
def test_white_bodies_vanish_under_a_white_sky(shape: Mesh | Spheres, matrix: Any) -> None:
    scene = Builder(12, looking((1, -3, 1.5), (0, 0, 0), 0.45)).add(shape, grey(1.0), matrix).scene
    scene.world = World(radiance=(1, 1, 1))
    by_hits = render(scene, settings(samples=8, light_path_length=0, **HITS_ONLY))
    np.testing.assert_allclose(by_hits, 1.0, rtol=1e-5)
    options = settings(samples=64, light_path_length=2, light_samples=2, vlp_connections=2)
    assert_mean(blocks(batches(scene, options, 12), 6), 1.0, "all strategies", rounding=1e-4)


@pytest.mark.parametrize("share", [0.25, 0.7])
def test_veils_vanish_under_a_white_sky(share: float) -> None:
    """Half transparent and half white bodies: what passes and what is scattered make up for each other's chances."""
    veil = materials.mix(materials.transparent(), grey(1.0), 1 - share)
    scene = Builder(12, looking((1, -3, 1.5), (0, 0, 0), 0.45)).add(sphere(), veil).add(cube(), veil).scene
    scene.world = World(radiance=(1, 1, 1))
    by_hits = render(scene, settings(samples=8, light_path_length=0, eye_path_length=64, **HITS_ONLY))
    np.testing.assert_allclose(by_hits, 1.0, rtol=1e-4)
    options = settings(samples=64, light_path_length=2, eye_path_length=64, light_samples=2, vlp_connections=2)
    assert_mean(blocks(batches(scene, options, 12), 6), 1.0, "all strategies", rounding=2e-4)


def test_clear_bodies_vanish_under_a_white_sky() -> None:
    """Glass reflects and refracts, but takes nothing; what is left inside after 64 hits is below 1e-4."""
    builder = Builder(12, looking((1, -3, 1.5), (0, 0, 0), 0.45))
    scene = (
        builder.add(sphere(), materials.glass(ior=1.5)).add(sphere((0.2, 0, 0.1), 0.4), materials.glass(ior=1.3)).scene
    )
    scene.world = World(radiance=(1, 1, 1))
    options = settings(samples=16, light_path_length=0, eye_path_length=64, roulette=False)
    np.testing.assert_allclose(render(scene, options), 1.0, rtol=1e-4)


def test_shining_sphere_does_not_light_itself() -> None:
    scene = Builder(12, looking((0, -3, 0.1), (0, 0, 0), 0.2)).add(sphere(), grey(0.8, 0.7)).scene
    for connections in (0, 2):
        options = settings(samples=16, vlp_connections=connections, light_samples=2)
        np.testing.assert_allclose(render(scene, options), 0.7, rtol=1e-5)


# Form factors of unit squares


def receiver(albedo: float, pixels: int = 8) -> Builder:
    """A unit square at the ground, exactly what the camera sees."""
    return Builder(pixels, from_above(5, 0.5)).add(square(1), grey(albedo))


def mean_of(scene: Scene, expected: float, what: str, **options: Any) -> None:
    pictures = batches(scene, settings(samples=256, **(DIRECT | options)), 12).mean(axis=(1, 2, 3))
    assert_mean(pictures[:, None], expected, what, rounding=1e-4)


PARALLEL = 0.1998249  # unit squares, one metre apart
PERPENDICULAR = 0.2000438  # unit squares that share an edge


@pytest.mark.parametrize("strategies", [{}, {"light_samples": 0}, {"light_samples": 4}])
def test_parallel_squares(strategies: dict[str, int]) -> None:
    scene = receiver(0.8).add(square(1, (0, 0, 1)), Material("light", (), (2, 2, 2))).scene
    scene.instances[-1].visibility = Visibility(0)
    mean_of(scene, 0.8 * 2 * PARALLEL, "parallel squares", **strategies)


def test_parallel_area_light() -> None:
    scene = receiver(0.8).scene
    scene.lights = [AreaLight("lamp", transform((0, 0, 1)), (2 * pi,) * 3)]  # radiance power / (pi area)
    mean_of(scene, 0.8 * 2 * PARALLEL, "area light")


@pytest.mark.parametrize("strategies", [{}, {"light_samples": 0}, {"light_samples": 4}])
def test_perpendicular_squares(strategies: dict[str, int]) -> None:
    wall = quad((0.5, -0.5, 0), (0.5, 0.5, 0), (0.5, 0.5, 1), (0.5, -0.5, 1))
    scene = receiver(0.8).add(wall, Material("light", (), (2, 2, 2))).scene
    mean_of(scene, 0.8 * 2 * PERPENDICULAR, "perpendicular squares", **strategies)


# Lamps over the ground, seen by parallel rays from above: every pixel has its own closed form


def ground(lights: list[Any], pixels: int = 16) -> Scene:
    scene = Builder(pixels, from_above(5, 1.0)).add(square(20), grey(0.5)).scene
    scene.lights = lights
    return scene


def pixel_means(f: Any, pixels: int = 16, half: float = 1.0, fine: int = 16) -> Array:
    """Means of f(x, y) over the pixels, (pixels, pixels, 1)."""
    at = ((np.arange(pixels * fine) + 0.5) / (pixels * fine) * 2 - 1) * half
    x, y = np.meshgrid(at, at)
    return np.asarray(f(x, y).reshape(pixels, fine, pixels, fine).mean(axis=(1, 3))[..., None])


def under_point(height: float, power: float, x0: float = 0, y0: float = 0) -> Any:
    """Radiance of a ground of albedo 0.5 under a point light: the cosine and the square of the distance."""

    def radiance(x: Array, y: Array) -> Array:
        d2 = (x - x0) ** 2 + (y - y0) ** 2 + height**2
        return np.asarray(0.5 / pi * power / (4 * pi) * height / d2**1.5)

    return radiance


@pytest.mark.parametrize("radius", [0.0, 0.1, 0.5])
def test_point_light_over_the_ground(radius: float) -> None:
    """A sphere of constant radiance lights what faces all of it like a point in its middle."""
    scene = ground([PointLight("lamp", (0.3, -0.2, 0.7), (10, 10, 10), radius)])
    pictures = batches(scene, settings(samples=256, **DIRECT), 10)[..., :1]
    assert_mean(pictures, pixel_means(under_point(0.7, 10, 0.3, -0.2)), f"radius {radius}", rounding=2e-3)


@pytest.mark.parametrize("scale", [1.0, 3.0, -0.5])
def test_sphere_emitter_over_the_ground(scale: float) -> None:
    """An instance that scales a sphere alike in all directions makes a larger or smaller one, mirrored or not."""
    scene = ground([])
    builder = Builder(16, scene.camera)
    builder.scene = scene
    position, matrix = (0.3, -0.2, 0.7), transform((0, 0, 0), (scale, scale, scale))
    center = (position[0] / scale, position[1] / scale, position[2] / scale)
    builder.add(sphere(center, 0.3 / abs(scale)), Material("light", (), (2, 2, 2)), matrix)
    scene.instances[-1].visibility = Visibility(0)
    power = 4 * pi**2 * 0.3**2 * 2
    pictures = batches(scene, settings(samples=256, **DIRECT), 10)[..., :1]
    assert_mean(pictures, pixel_means(under_point(0.7, power, 0.3, -0.2)), "sphere emitter", rounding=2e-3)


@pytest.mark.parametrize("blend", [0.0, 0.4])
def test_spot_light_over_the_ground(blend: float) -> None:
    """Within the cone a point light, times smoothstep over the share `blend` of the cone's cosines."""
    cos_half = np.cos(0.5)

    def radiance(x: Array, y: Array) -> Array:
        cosine = 0.9 / np.sqrt(x**2 + y**2 + 0.9**2)
        t = np.clip((cosine - cos_half) / max((1 - cos_half) * blend, 1e-9), 0, 1)
        return np.asarray(under_point(0.9, 10)(x, y) * t * t * (3 - 2 * t))

    scene = ground([SpotLight("spot", transform((0, 0, 0.9)), (10, 10, 10), spot_size=1.0, blend=blend)])
    pictures = batches(scene, settings(samples=256, **DIRECT), 10)[..., :1]
    assert_mean(
        blocks(pictures, 4), blocks(pixel_means(radiance, fine=64)[None], 4)[0], f"blend {blend}", rounding=3e-3
    )


@pytest.mark.parametrize("angle", [0.0, 0.0093, 0.6])
def test_sun_over_the_ground(angle: float) -> None:
    """Irradiance times the cosine, whatever the width of the disc while all of it is above the horizon."""
    tilt = 0.5
    matrix = np.array(
        [[1, 0, 0, 0], [0, np.cos(tilt), -np.sin(tilt), 0], [0, np.sin(tilt), np.cos(tilt), 0]], np.float32
    )
    scene = ground([SunLight("sun", matrix, (3, 2, 1), angle)], 8)
    pictures = batches(scene, settings(samples=64, **DIRECT), 10)
    assert_mean(pictures, 0.5 / pi * np.cos(tilt) * np.array([3, 2, 1.0]), f"angle {angle}", rounding=1e-4)


def test_disc_over_the_ground() -> None:
    """On the axis of a disc of radius r at height h: irradiance pi L r^2 / (r^2 + h^2); near it, to second order."""
    scene = ground([AreaLight("disc", transform((0, 0, 1.0)), (7, 7, 7), (1.2, 1.2), ellipse=True)], 8)
    assert scene.camera is not None
    scene.camera = from_above(5, 0.02)
    expected = 0.5 * (7 / (pi * pi * 0.36)) * 0.36 / 1.36
    pictures = batches(scene, settings(samples=128, **DIRECT), 10).mean(axis=(1, 2))
    assert_mean(pictures, expected, "disc", rounding=1e-3)


def test_ellipsoid_emitter_over_the_ground() -> None:
    """A sphere that its transform flattens shines as the ellipsoid does: cosine-weighted solid angle by quadrature."""
    center, axes = np.array([0.2, 0.1, 0.8]), np.array([0.5, 0.3, 0.15])
    n = 1500
    at = (np.arange(n) + 0.5) / n * 2 - 1
    x, y = np.meshgrid(at, at)  # directions by their projection on the ground, which carries the cosine
    inside = x * x + y * y < 1
    d = np.stack([x, y, np.sqrt(np.where(inside, 1 - x * x - y * y, 0))], axis=-1) / axes
    o = -center / axes
    b, a, c = (d @ o), (d * d).sum(-1), o @ o - 1
    seen = inside & (b * b - a * c > 0) & (b < 0)
    expected = 0.5 / pi * 2 * seen.mean() * 4
    scene = ground([], 8)
    scene.camera = from_above(5, 0.01)
    builder = Builder(8)
    builder.scene = scene
    builder.add(sphere(), Material("light", (), (2, 2, 2)), transform((0.2, 0.1, 0.8), (0.5, 0.3, 0.15)))
    scene.instances[-1].visibility = Visibility(0)
    pictures = batches(scene, settings(samples=512, **DIRECT), 10).mean(axis=(1, 2))
    assert_mean(pictures, expected, "ellipsoid", rounding=2e-3)

"""Light paths joined to the lens: the light that other strategies find, on the right pixels, whatever the camera.

Means are compared by t-tests with Sidak's correction over all blocks or pixels, at a false-alarm rate of 1e-4 each;
seeds are fixed. Many tests compare two strategies, each alone: `BY_SPLATS` and `BY_LIGHT_SAMPLES` both find exactly the
light of one reflection.
"""

from __future__ import annotations

from itertools import combinations
from math import pi
from typing import Any

import numpy as np
import pytest
from scenes_for_tests import (
    Array,
    Builder,
    assert_mean,
    assert_same_mean,
    batches,
    blocks,
    from_above,
    grey,
    looking,
    render,
    settings,
    sphere,
    square,
    transform,
)
from test_transport import SCENES, by_paths, lit_by_area, pictures

from vlp_bpt import Renderer, Scene, materials
from vlp_bpt.scene import Camera, Film, Lobe, LobeKind, Material, PointLight, Projection, SunLight, Visibility

BY_SPLATS: dict[str, Any] = {
    "splats": True, "hits": False, "light_samples": 0, "vlp_connections": 0, "light_path_length": 1,
    "eye_path_length": 1, "light_paths": 4000,
}  # fmt: skip
BY_LIGHT_SAMPLES: dict[str, Any] = BY_SPLATS | {"splats": False, "light_samples": 1}
VEIL = Material("veil", (Lobe(LobeKind.TRANSPARENT, (0.5, 0.6, 0.7)), Lobe(LobeKind.DIFFUSE, (0.3, 0.3, 0.2))))


# Every subset of the strategies

STRATEGIES = ("hits", "light_samples", "vlps", "splats")
SUBSETS = [
    set(chosen)
    for size in range(1, 5)
    for chosen in combinations(STRATEGIES, size)
    if set(chosen) != {"vlps"}  # which find nothing of a single reflection
]


def options_of(subset: set[str]) -> dict[str, Any]:
    """Lengths with which a subset finds all paths of 3 to 8 vertices, and no others."""
    if "vlps" in subset:
        lengths = {"light_path_length": 2, "eye_path_length": 4}
    else:
        lengths = {"light_path_length": 6, "eye_path_length": 6 if "light_samples" in subset else 7}
    counts = {"light_samples": int("light_samples" in subset), "vlp_connections": int("vlps" in subset)}
    switches = {"splats": "splats" in subset, "hits": "hits" in subset}
    return lengths | counts | switches | {"light_paths": 500}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("subset", SUBSETS, ids=lambda subset: "_".join(sorted(subset)))
def test_subsets_of_strategies_leave_the_mean(name: str, subset: set[str]) -> None:
    if name == "point" and not subset & {"light_samples", "splats"}:
        pytest.skip("no ray meets a point light")
    if name == "sky" and "hits" not in subset:
        pytest.skip("hits alone show the sky itself")
    assert_same_mean(pictures(SCENES[name](), 12, 0, **options_of(subset)), by_paths(name), f"{name}, {sorted(subset)}")


@pytest.mark.parametrize("weighting", ["UNIFORM", "POWER"])
@pytest.mark.parametrize("name", SCENES)
def test_weightings_leave_the_mean(name: str, weighting: str) -> None:
    options = options_of(set(STRATEGIES)) | {"weighting": weighting}
    assert_same_mean(pictures(SCENES[name](), 12, 0, **options), by_paths(name), f"{name}, {weighting}")


def test_switched_off_strategies_find_nothing() -> None:
    """Without hits the lit square itself is black; without anything from the light no light path is traced."""
    scene = Builder(8, from_above(2, 0.4)).add(square(1), Material("light", (), (1, 2, 3))).scene
    everything = {"light_samples": 1, "vlp_connections": 1}
    assert (render(scene, settings(samples=2, hits=True, **everything)) == (1, 2, 3)).all()
    assert (render(scene, settings(samples=2, hits=False, **everything)) == 0).all()


@pytest.mark.parametrize(("splats", "connections", "traced"), [(1, 0, 1), (0, 1, 1), (1, 1, 1), (0, 0, 0)])
def test_light_paths_are_traced_where_they_serve(splats: int, connections: int, traced: int) -> None:
    options = settings(samples=3, splats=bool(splats), vlp_connections=connections, light_paths=700)
    renderer = Renderer(lit_by_area(), options)
    assert renderer.iterate(3) == 3
    assert renderer.statistics.light_paths == traced * 3 * 700
    assert (renderer.statistics.vlps > 0) == (connections > 0)


# Cameras


def tilted_ground(camera: Camera, *, lamp: tuple[float, float, float] = (0.2, -0.1, 0.9)) -> Builder:
    """A large ground under a point light, so that splats and light samples find light of one reflection."""
    builder = Builder(12, camera).add(square(6), grey(0.8))
    builder.scene.lights = [PointLight("lamp", lamp, (30, 20, 10))]
    return builder


def assert_splats_agree(scene: Scene, what: str, side: int = 2, samples: int = 64, **options: Any) -> None:
    """Splats alone against light samples alone. Blocks that are nearly dark, such as the tails of filters, hold too few
    splats for a t-test: they must be dark in both."""
    found = batches(scene, settings(**({"samples": samples} | BY_SPLATS | options)), 12)
    expected = batches(scene, settings(**({"samples": 4 * samples} | BY_LIGHT_SAMPLES | options)), 12, 100)
    found, expected = blocks(found, side), blocks(expected, side)
    level = expected.mean(axis=0)
    lit = level > 1e-2 * level.max()
    assert lit.mean() > 0.1
    assert_same_mean(found[:, lit], expected[:, lit], what)
    assert (found.mean(axis=0)[~lit] < 2e-2 * level.max()).all()


CAMERAS: dict[str, Camera] = {
    "perspective": looking((0.3, -2.5, 1.5), (0, 0, 0), 0.5),
    "wide": looking((0.3, -1.0, 1.0), (0, 0, 0), 1.5, shift=(0.2, -0.4)),
    "orthographic": looking((0.3, -2.5, 1.5), (0, 0, 0), 0.9, projection=Projection.ORTHOGRAPHIC, shift=(0.1, 0.2)),
    "orthographic_behind": looking(
        (0.1, -0.2, 0.1), (0, 0, 0), 0.9, projection=Projection.ORTHOGRAPHIC, clip_start=-4.0
    ),
}


@pytest.mark.parametrize("name", CAMERAS)
def test_cameras(name: str) -> None:
    assert_splats_agree(tilted_ground(CAMERAS[name]).scene, name)


@pytest.mark.parametrize("projection", list(Projection))
@pytest.mark.parametrize("focus", [0.8, 1.6])
def test_small_bright_things_out_of_focus(projection: Projection, focus: float) -> None:
    """A spot of 0.2 metres, lit alone, spreads over the circle of confusion and is dark outside."""
    size = 0.15 if projection is Projection.PERSPECTIVE else 0.3
    camera = looking(
        (0, 0, 2), (0, 0, 0), size, up=(0, 1, 0), projection=projection, aperture_radius=0.15, focus_distance=focus
    )
    scene = Builder(12, camera).add(square(0.2, (0.1, 0, 0)), grey(0.8)).scene
    scene.lights = [PointLight("lamp", (0.2, -0.1, 0.9), (30, 20, 10))]
    assert_splats_agree(scene, f"{projection}, focus {focus}", side=1, samples=256)


@pytest.mark.parametrize("projection", list(Projection))
def test_clip_planes(projection: Projection) -> None:
    """What is nearer than the near plane neither blocks nor is seen, and what is farther than the far one is not."""
    size = 0.5 if projection is Projection.PERSPECTIVE else 0.9
    camera = looking((0, -2.5, 1.5), (0, 0, 0), size, projection=projection, clip_start=2.4, clip_end=3.4)
    builder = tilted_ground(camera).add(square(0.6, (0, -1.1, 0.75)), grey(0.5))  # before the near plane
    assert_splats_agree(builder.scene, f"clip planes, {projection}")


def test_what_the_camera_does_not_see() -> None:
    """It hides nothing from the camera, but throws shadows."""
    camera = looking((0, -2.5, 1.5), (0, 0, 0), 0.5)
    builder = tilted_ground(camera, lamp=(0.2, 0.8, 1.5)).add(square(0.7, (0, -0.6, 0.5)), grey(0.9))
    seen = render(builder.scene, settings(samples=16, **BY_SPLATS))
    builder.scene.instances[-1].visibility = Visibility(0)
    assert not np.allclose(render(builder.scene, settings(samples=16, **BY_SPLATS)), seen, rtol=0.1)
    assert_splats_agree(builder.scene, "invisible")


def test_transparent_surfaces_between() -> None:
    camera = looking((0, -2.5, 1.5), (0, 0, 0), 0.5)
    builder = tilted_ground(camera).add(square(0.8, (0, -0.8, 0.5)), VEIL).add(square(0.5, (0, -1.2, 0.7)), VEIL)
    assert_splats_agree(builder.scene, "veils")


# Pixels


@pytest.mark.parametrize("filter_", ["BOX", "GAUSSIAN", "BLACKMAN_HARRIS"])
@pytest.mark.parametrize("width", [1.0, 3.0])
def test_even_light_has_no_dark_border(filter_: str, width: float) -> None:
    """Every pixel of an evenly lit ground, those at the edges among them, has the closed form (LuxCore 237)."""
    scene = Builder((12, 9), from_above(2, 1.0)).add(square(3.5), grey(0.5)).scene
    scene.lights = [SunLight("sun", transform(), (3, 3, 3))]
    options = settings(samples=48, filter=filter_, filter_width=width, **BY_SPLATS)
    found = batches(scene, options, 16)[..., :1]
    assert_mean(found, 0.5 / pi * 3, f"{filter_} {width}", rounding=1e-4)
    rows = np.concatenate([found[:, 0].mean(axis=1), found[:, -1].mean(axis=1)], axis=1)
    columns = np.concatenate([found[:, :, 0].mean(axis=1), found[:, :, -1].mean(axis=1)], axis=1)
    assert_mean(np.concatenate([rows, columns], axis=1), 0.5 / pi * 3, "edge rows and columns", rounding=1e-4)


@pytest.mark.parametrize("filter_", ["BOX", "GAUSSIAN", "BLACKMAN_HARRIS"])
def test_edges_are_filtered_alike(filter_: str) -> None:
    """Half of the film is black: pixels at the edge between hold what the filter says, from splats and from rays."""
    scene = Builder(12, from_above(2, 1.0)).add(square(1.5, (0.8, 0.75, 0)), grey(0.5)).scene
    scene.lights = [SunLight("sun", transform(), (3, 3, 3))]
    assert_splats_agree(scene, filter_, side=1, filter=filter_, filter_width=2.0)


@pytest.mark.parametrize("window", [(0, 0, 6, 5), (7, 3, 5, 9), (4, 4, 1, 1)])
def test_a_window_has_the_light_of_the_whole(window: tuple[int, int, int, int]) -> None:
    """N serves the whole film: a window gets its share of the splats, not all of them (pbrt-v4 347)."""
    scene = tilted_ground(CAMERAS["perspective"]).scene
    options = settings(samples=32, filter="BLACKMAN_HARRIS", filter_width=1.5, **BY_SPLATS)
    whole = Renderer(scene, options)
    whole.iterate(32)
    scene.film = Film(12, 12, window)
    part = Renderer(scene, options)
    part.iterate(32)
    x, y, width, height = window
    assert np.array_equal(part.film_state(), whole.film_state()[y : y + height, x : x + width])
    assert part.read()[..., :3].mean() > 0


def test_alpha_is_that_of_the_eye_paths() -> None:
    scene = tilted_ground(CAMERAS["perspective"]).scene
    scene.film = Film(12, 12, transparent=True)
    alpha = []
    for splats in (True, False):
        renderer = Renderer(scene, settings(samples=4, splats=splats))
        renderer.iterate(4)
        alpha.append(renderer.read()[..., 3])
    assert np.array_equal(alpha[0], alpha[1])
    assert 0 < alpha[0].mean() < 1


# Numbers


@pytest.mark.parametrize("exponent", [-30, 20, 40])
def test_dim_and_bright_scenes_have_the_same_picture(exponent: int) -> None:
    """Sums of splats lose what is below 2^-64: by 2^-30 dimmer light keeps 1e-5 of a pixel at the least."""
    scene = tilted_ground(CAMERAS["perspective"]).scene
    plain = render(scene, settings(samples=4, **BY_SPLATS))
    power = tuple(2.0**exponent * p for p in (30, 20, 10))
    scene.lights = [PointLight("lamp", (0.2, -0.1, 0.9), power)]  # type: ignore[arg-type]
    scaled = render(scene, settings(samples=4, **BY_SPLATS))
    np.testing.assert_allclose(scaled / 2.0**exponent, plain, rtol=1e-5)


def test_too_bright_splats_count_the_most_there_may_be() -> None:
    """One of N splats counts 2^62 / N at most, so that all of them together cannot wrap round to something small."""
    scene = tilted_ground(CAMERAS["perspective"]).scene
    scene.lights = [PointLight("lamp", (0.2, -0.1, 0.9), (1e34, 1e34, 1e34))]
    paths = 4096
    found = render(scene, settings(samples=1, **(BY_SPLATS | {"light_paths": paths})))
    splats = found / (2.0**62 / paths)
    assert np.array_equal(splats, np.round(splats))
    assert (splats > 0).mean() > 0.5
    assert (splats >= 0).all()
    assert (splats.sum(axis=(0, 1)) < paths).all()


@pytest.mark.parametrize("threads", [1, 2, 5])
@pytest.mark.parametrize("connections", [0, 1])
def test_threads_change_no_bit(threads: int, connections: int) -> None:
    """Many paths on few pixels: threads add to the same sums at once."""
    scene = tilted_ground(CAMERAS["perspective"]).scene
    states = []
    for count in (threads, 3):
        options = BY_SPLATS | {"light_path_length": 3, "light_paths": 30_000, "vlp_connections": connections}
        renderer = Renderer(scene, settings(samples=3, threads=count, **options))
        renderer.iterate(3)
        states.append(renderer.film_state())
    assert np.array_equal(states[0], states[1])


def test_a_cancelled_iteration_leaves_no_splats() -> None:
    scene = tilted_ground(CAMERAS["perspective"]).scene
    options = settings(samples=3, **(BY_SPLATS | {"light_paths": 2_000_000, "light_path_length": 3}))
    cancelled = Renderer(scene, options)
    assert cancelled.iterate(1, poll=lambda: cancelled.iteration_fraction > 0.05) == 0
    assert not cancelled.film_state().any()
    whole = Renderer(scene, options)
    assert cancelled.iterate(1) == whole.iterate(1) == 1
    assert np.array_equal(cancelled.film_state(), whole.film_state())


# Light that nothing else finds


@pytest.mark.parametrize("weighting", ["BALANCE", "UNIFORM"])
def test_a_lamp_inside_glass_lights_the_ground(weighting: str) -> None:
    """A point light in the middle of a ball of glass: 1 - ((n - 1) / (n + 1))^2 of its light leaves straight on."""
    pixels, half = 8, 1.0
    scene = Builder(pixels, from_above(5, half)).add(square(20), grey(0.5)).scene
    scene.lights = [PointLight("lamp", (0.3, -0.2, 0.7), (10, 10, 10))]
    builder = Builder(pixels)
    builder.scene = scene
    builder.add(sphere((0.3, -0.2, 0.7), 0.1), materials.glass(ior=1.5))
    scene.instances[-1].visibility = Visibility(0)
    at = ((np.arange(pixels * 16) + 0.5) / (pixels * 16) * 2 - 1) * half
    x, y = np.meshgrid(at, at)
    bare = 0.5 / pi * 10 / (4 * pi) * 0.7 / ((x - 0.3) ** 2 + (y + 0.2) ** 2 + 0.7**2) ** 1.5
    expected = 0.96 * bare.reshape(pixels, 16, pixels, 16).mean(axis=(1, 3))[..., None]
    options = {"light_path_length": 2, "eye_path_length": 1, "light_paths": 4000, "weighting": weighting}
    found: Array = batches(scene, settings(samples=64, **options), 12)[..., :1]
    assert_mean(found, expected, f"caustic, {weighting}", rounding=1e-3)
    assert (render(scene, settings(samples=4, splats=False, **options)) == 0).all()

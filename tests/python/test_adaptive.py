"""Adaptive sampling: the same picture with less noise, whatever stops and continues it.

Means are compared by t-tests with Sidak's correction at a false-alarm rate of 1e-4 each; seeds are fixed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scenes_for_tests import Array, assert_same_mean, blocks, grey, looking, settings, sphere, square, transform
from small_scenes import room

from vlp_bpt import Mode, Renderer, RenderSettings
from vlp_bpt.scene import AreaLight, Film, Instance, Lobe, LobeKind, Material, Scene, World

OPTIONS: dict[str, Any] = {"adaptive": True, "light_path_length": 4, "eye_path_length": 6, "light_paths": 200}


def glass_on_a_floor(width: int = 24, height: int = 24) -> Scene:
    """A glass ball that throws a caustic, in half of the picture; a sky without noise in the other."""
    glass = Material("glass", (Lobe(LobeKind.DIELECTRIC, (1, 1, 1), ior=1.5),))
    lamp = AreaLight("lamp", transform((0, 0, 3))[:3], (20, 20, 20), (0.3, 0.3))
    return Scene(
        [square(4.0), sphere((0, 0, 0.6), 0.5)],
        [Instance("floor", 0, materials=(0,)), Instance("ball", 1, materials=(1,))],
        [grey(0.6), glass],
        [lamp],
        world=World("sky", (0.2, 0.3, 0.4)),
        camera=looking((0, -4, 1.2), (0, 0, 1.4), 1.6),
        film=Film(width, height),
    )


def rendered(iterations: int, scene: Scene | None = None, **options: Any) -> Renderer:
    renderer = Renderer(scene or glass_on_a_floor(), settings(**(OPTIONS | {"samples": 10**6} | options)))
    assert renderer.iterate(iterations) == iterations
    return renderer


def pictures(count: int, iterations: int, seed: int, **options: Any) -> Array:
    """(count, h, w, 3)."""
    made = [rendered(iterations, seed=seed + i, **options).read()[..., :3] for i in range(count)]
    return np.stack(made).astype(np.float64)


def test_it_is_the_same_picture_with_less_noise() -> None:
    for iterations in (21, 64):  # some samples count in iterations to come, or none
        adaptive, uniform = pictures(200, iterations, 0), pictures(200, iterations, 1000, adaptive=False)
        assert_same_mean(blocks(adaptive, 2), blocks(uniform, 2), f"{iterations} iterations")
        assert_same_mean(adaptive.mean(axis=(1, 2)), uniform.mean(axis=(1, 2)), "whole")
    weight = 1 / (uniform.mean(axis=0) + 0.1) ** 2
    noise, before = ((of.var(axis=0, ddof=1) * weight).mean() for of in (adaptive, uniform))
    print(f"relative variance {noise:.2e}, before {before:.2e}")
    assert noise < 0.85 * before


def test_the_first_iterations_are_those_without_it() -> None:
    scene = {"scene": room(24, 24), "weighting": "POWER"}  # of which there is no trial
    first, without = rendered(4, **scene), rendered(4, adaptive=False, **scene)
    assert np.array_equal(first.film_state(), without.film_state())
    first.iterate(1), without.iterate(1)
    assert not np.array_equal(first.film_state(), without.film_state())


def test_threads_and_steps_change_no_bit() -> None:
    whole = rendered(40, threads=1)
    steps = rendered(3, threads=3)
    while steps.iterations < 40:
        steps.iterate(min(5, 40 - steps.iterations))
    assert np.array_equal(steps.film_state(), whole.film_state())


def test_a_cancelled_iteration_changes_no_bit() -> None:
    whole = rendered(40)
    renderer = rendered(17)
    asked = [0]

    def soon() -> bool:
        asked[0] += 1
        return asked[0] > 1

    while renderer.iterations < 40:
        asked[0] = 0
        renderer.iterate(40 - renderer.iterations, poll=soon)
    assert np.array_equal(renderer.film_state(), whole.film_state())


def test_samples_are_counted() -> None:
    renderer = rendered(64)
    pixels = 24 * 24
    assert 0.8 * 64 * pixels < renderer.statistics.eye_samples < 1.2 * 64 * pixels
    assert renderer.statistics.eye_samples != 64 * pixels
    assert rendered(64, adaptive=False).statistics.eye_samples == 64 * pixels


def test_pixels_without_noise_keep_their_value() -> None:
    """The sky: of a render that leaves most of its iterations out there."""
    picture = rendered(100).read()
    assert np.allclose(picture[-1, :, :3], (0.2, 0.3, 0.4), rtol=1e-5)
    assert np.allclose(picture[-1, :, 3], 1)


def test_an_update_begins_anew() -> None:
    renderer = rendered(40)
    renderer.update(room(24, 24))
    renderer.iterate(20)
    assert np.array_equal(renderer.film_state(), rendered(20, room(24, 24)).film_state())
    renderer.update(settings=settings(**(OPTIONS | {"adaptive": False, "samples": 10**6})))
    renderer.iterate(20)
    assert np.array_equal(renderer.film_state(), rendered(20, room(24, 24), adaptive=False).film_state())


def test_guides_are_means_of_the_same_samples() -> None:
    guided, plain = rendered(40, denoise=True), rendered(40)
    # The last bits may differ, as the passes with and without guides are compiled apart.
    picture, other = guided.read(), plain.read()
    assert (np.abs(picture - other) > 1e-4 * np.abs(other)).mean() < 0.01
    layers = guided.layers()
    uniform = rendered(40, denoise=True, adaptive=False).layers()
    for name, values in layers.items():
        assert np.isfinite(values).all()
        assert np.abs(values - uniform[name]).mean() < 0.1, name


def test_one_pixel() -> None:
    assert rendered(40, room(1, 1)).statistics.eye_samples >= 40


@pytest.mark.parametrize("mode", list(Mode))
def test_balanced_alone_has_it_by_default(mode: Mode) -> None:
    assert RenderSettings(mode=mode).resolved(8, 8).adaptive == (mode is Mode.BALANCED)


def outdoors() -> Scene:
    """A matt ball on a floor under a sky: light that has met two surfaces is little."""
    return Scene(
        [square(4.0), sphere((0, 0, 0.6), 0.5)],
        [Instance("floor", 0, materials=(0,)), Instance("ball", 1, materials=(0,))],
        [grey(0.5)],
        world=World("sky", (0.2, 0.3, 0.4)),
        camera=looking((0, -4, 2), (0, 0, 0.5), 0.9),
        film=Film(64, 64),
    )


def chosen(scene: Scene, **options: Any) -> tuple[int, int]:
    statistics = rendered(1, scene, light_path_length=12, eye_path_length=16, **options).statistics
    return statistics.light_rounds, statistics.first_connections


def test_it_chooses_light_paths_and_connections_by_the_scene() -> None:
    assert chosen(glass_on_a_floor(64, 64))[0] > 2, "caustics are made of splats"
    assert not chosen(outdoors())[1]
    assert chosen(room(64, 64))[1] > 1
    assert chosen(room(64, 64), vlp_connections=3)[1] in (3, 6, 12, 24)
    assert chosen(glass_on_a_floor(64, 64), adaptive=False) == chosen(outdoors(), adaptive=False) == (1, 1)


def test_the_choice_is_told() -> None:
    renderer = rendered(3, glass_on_a_floor(64, 64))
    rounds = renderer.statistics.light_rounds
    assert renderer.statistics.light_paths == 3 * 200 * rounds
    told = renderer.metadata()
    assert (told["light_rounds"], told["first_connections"]) == (rounds, renderer.statistics.first_connections)
    assert told["settings"]["light_paths"] == 200, "as asked"
    assert rendered(1, outdoors(), light_path_length=12, eye_path_length=16).statistics.vlps == 0


def test_the_same_choice_whatever_seed_and_threads() -> None:
    kinds = {chosen(glass_on_a_floor(64, 64), threads=n, seed=n) for n in (1, 2, 3)}
    assert len(kinds) == 1


def test_with_more_connections_it_is_the_same_picture() -> None:
    options = {"light_paths": 100, "light_path_length": 6, "eye_path_length": 8}
    assert rendered(1, room(16, 16), **options).statistics.first_connections > 1
    with_them, without = (
        np.array(
            [rendered(16, room(16, 16), seed=s, **options, **kind).read()[..., :3] for s in range(first, first + 200)]
        )
        for first, kind in ((0, {}), (1000, {"adaptive": False}))
    )
    assert_same_mean(blocks(with_them, 2), blocks(without, 2), "with more connections")
    assert with_them.var(axis=0).mean() < 0.8 * without.var(axis=0).mean()


def polished_outdoors() -> Scene:
    scene = outdoors()
    scene.materials.append(Material("polished", (Lobe(LobeKind.REFLECTION, (0.5, 0.5, 0.5), 0.2),)))
    scene.instances[1].materials = (1,)
    return scene


@pytest.mark.parametrize("make, splats", [(outdoors, False), (polished_outdoors, True)])
def test_without_connections_it_is_the_same_picture(make: Callable[[], Scene], splats: bool) -> None:
    """Eye paths that go on alone find what they found joined to virtual light points and, where nothing focuses light,
    what splats found."""
    options = {"light_path_length": 6, "eye_path_length": 8, "light_paths": 500}
    scene = make()
    scene.film = Film(16, 16)
    with_them, without = (
        np.array(
            [rendered(32, scene, seed=seed, **options, **kind).read()[..., :3] for seed in range(first, first + 150)]
        )
        for first, kind in ((0, {}), (1000, {"adaptive": False}))
    )
    taken = rendered(1, scene, **options).statistics
    assert (taken.first_connections, taken.light_paths > 0) == (0, splats)
    assert_same_mean(blocks(with_them, 2), blocks(without, 2), make.__name__)

"""What guides the denoiser: colour and normal in known scenes, the same bits on any threads, the picture as without."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scenes_for_tests import Builder, assert_same_mean, from_above, grey, settings, square, transform
from small_scenes import room

from vlp_bpt import Renderer, RenderSettings, Scene
from vlp_bpt.images import ALBEDO, NOISY, NORMAL
from vlp_bpt.scene import AreaLight, Camera, Film, Fresnel, Lobe, LobeKind, Material, Visibility, World

ORANGE = (0.8, 0.4, 0.1)
UP, DOWN = (0, 0, 1), (0, 0, -1)


def diffuse(color: tuple[float, float, float]) -> Material:
    return Material(f"diffuse {color}", (Lobe(LobeKind.DIFFUSE, color),))


def above(pixels: int = 4) -> Builder:
    """A camera that looks straight down from z = 5 with parallel rays; darkness around."""
    return Builder(pixels, from_above(5, 0.5))


def guides(scene: Scene, samples: int = 4, **options: Any) -> tuple[Any, Any]:
    """albedo and normal (h, w, 3), without roulette, which would make single paths noisy."""
    renderer = Renderer(scene, settings(denoise=True, samples=samples, roulette=False, **options))
    renderer.iterate(samples)
    layers = renderer.layers()
    return layers[ALBEDO], layers[NORMAL]


def assert_everywhere(image: Any, expected: Any, tolerance: float = 1e-6) -> None:
    assert np.abs(image - np.asarray(expected)).max() <= tolerance, image.reshape(-1, 3).mean(axis=0)


def assert_mean(image: Any, expected: Any, tolerance: float = 0.01) -> None:
    """Of walks that choose their way at random."""
    mean = image.reshape(-1, 3).mean(axis=0, dtype=float)
    assert np.abs(mean - np.asarray(expected)).max() <= tolerance, mean


@pytest.mark.parametrize("turned", [False, True], ids=["front", "back"])
def test_a_diffuse_wall_has_its_colour_and_faces_the_eye(turned: bool) -> None:
    matrix = transform(scale=(1, 1, -1)) if turned else None
    albedo, normal = guides(above().add(square(4), diffuse(ORANGE), matrix).scene)
    assert_everywhere(albedo, ORANGE)
    assert_everywhere(normal, UP)


def test_shading_normals_count_not_flat_ones() -> None:
    mesh = square(4)
    tilted = np.array([0.6, 0, 0.8], np.float32)
    mesh.corner_normals = np.broadcast_to(tilted, (2, 3, 3)).copy()
    _, normal = guides(above().add(mesh, diffuse(ORANGE)).scene)
    assert_everywhere(normal, tilted, 1e-4)


def test_a_mirror_shows_the_guides_of_what_is_seen_in_it() -> None:
    mirror = Material("mirror", (Lobe(LobeKind.REFLECTION, (0.9, 0.5, 0.9), 0.0),))
    scene = above().add(square(4), mirror).add(square(4, (0, 0, 9)), diffuse(ORANGE)).scene
    albedo, normal = guides(scene)
    assert_everywhere(albedo, np.multiply(ORANGE, (0.9, 0.5, 0.9)))
    assert_everywhere(normal, DOWN)


@pytest.mark.parametrize(("roughness", "followed"), [(0.1, True), (0.5, False)])
def test_a_glossy_surface_is_followed_where_it_is_nearly_a_mirror(roughness: float, followed: bool) -> None:
    gloss = Material("gloss", (Lobe(LobeKind.REFLECTION, (0.9, 0.9, 0.9), roughness),))
    scene = above().add(square(4), gloss).add(square(90, (0, 0, 9)), diffuse(ORANGE)).scene
    albedo, normal = guides(scene, 256)
    assert_mean(albedo, np.multiply(ORANGE, 0.9) if followed else (0.9, 0.9, 0.9))
    assert_everywhere(normal, DOWN if followed else UP, 1e-3)


def test_a_pane_of_glass_lets_the_guides_of_what_is_behind_through() -> None:
    glass = Material("glass", (Lobe(LobeKind.DIELECTRIC, (1, 1, 1), 0.0, 1.5, Fresnel.DIELECTRIC),))
    pane = above(16).add(square(4, (0, 0, 1)), glass).add(square(4, (0, 0, 0.9)), glass, transform(scale=(1, 1, -1)))
    pane.scene.instances[-1].transform[2, 3] = 1.8  # at z = 0.9, its outside below
    albedo, normal = guides(pane.add(square(4), diffuse(ORANGE)).scene, 256, eye_path_length=16)
    passes = 0.96 / 1.04  # both faces reflect 4 % at right angles, again and again
    assert_mean(albedo, np.multiply(ORANGE, passes))
    assert_mean(normal, (0, 0, passes))


def test_gloss_over_a_colour_keeps_the_colour() -> None:
    coat = Lobe(LobeKind.REFLECTION, (1, 1, 1), 0.0, 1.5, Fresnel.DIELECTRIC)
    plastic = Material("plastic", (coat, Lobe(LobeKind.DIFFUSE, ORANGE, layered_under=0)))
    scene = above(16).add(square(4), plastic).add(square(4, (0, 0, 9)), diffuse((1, 1, 1))).scene
    albedo, normal = guides(scene, 256)
    assert_mean(albedo, np.multiply(ORANGE, 0.96) + 0.04)
    share = 0.5 + normal.reshape(-1, 3).mean(axis=0)[2] / 2  # of the walks that the colour takes
    assert 0.7 < share < 0.99
    assert np.abs(normal[..., :2]).max() < 1e-6


def test_normals_of_facing_mirrors_with_a_colour_stay_unit_vectors() -> None:
    """Walks that meet the same normal again and again, of which sums would leave the range that the film keeps."""
    satin = Material(
        "satin", (Lobe(LobeKind.DIFFUSE, (0.5, 0.5, 0.5)), Lobe(LobeKind.REFLECTION, (0.5, 0.5, 0.5), 0.0))
    )
    scene = above(16).add(square(4), satin).add(square(4, (0, 0, 9)), satin).scene
    albedo, normal = guides(scene, 64, eye_path_length=16)
    assert np.abs(normal[..., 2]).max() <= 1
    assert_mean(albedo, (1, 1, 1), 0.03)


def test_a_veil_shows_some_of_what_is_behind() -> None:
    veil = Material("veil", (Lobe(LobeKind.TRANSPARENT, (0.5, 0.5, 0.5)), Lobe(LobeKind.DIFFUSE, (0.4, 0.4, 0.4))))
    scene = above(16).add(square(4, (0, 0, 1)), veil).add(square(4), diffuse(ORANGE)).scene
    albedo, normal = guides(scene, 256)
    assert_mean(albedo, 0.4 + np.multiply(ORANGE, 0.5))
    assert_everywhere(normal, UP)


@pytest.mark.parametrize("transparent", [False, True])
def test_the_background_has_its_radiance_and_no_normal(transparent: bool) -> None:
    scene = above().scene
    scene.world = World("sky", (0.5, 2.0, 0.1))
    scene.film.transparent = transparent
    albedo, normal = guides(scene)
    assert_everywhere(albedo, (0, 0, 0) if transparent else (0.5, 1, 0.1))
    assert_everywhere(normal, (0, 0, 0))


def test_what_shines_counts_with_its_radiance_up_to_1() -> None:
    dim = Material("dim", (), (0.25, 0.5, 7.0))
    albedo, normal = guides(above().add(square(4), dim).scene)
    assert_everywhere(albedo, (0.25, 0.5, 1))
    assert_everywhere(normal, UP)
    albedo, _ = guides(above().add(square(4), grey(0.5, 0.75)).scene)
    assert_everywhere(albedo, (1, 1, 1))


def test_a_lamp_in_sight_is_white() -> None:
    scene = above().add(square(4), diffuse((0, 0, 0))).scene
    upward = transform((0, 0, 2), (1, -1, -1))
    scene.lights.append(AreaLight("lamp", upward, (99, 99, 99), (3, 3), visibility=Visibility.CAMERA))
    albedo, _ = guides(scene)
    assert_everywhere(albedo, (1, 1, 1))
    scene.lights[0].visibility = Visibility(0)
    albedo, _ = guides(scene)
    assert_everywhere(albedo, (0, 0, 0))


def state(scene: Scene, begin: int = 0, samples: int = 6, **options: Any) -> Renderer:
    renderer = Renderer(scene, RenderSettings(samples=samples, denoise=True, **options), first_iteration=begin)
    renderer.iterate(samples)
    return renderer


def test_sums_are_the_same_bits_on_any_threads_and_from_ranges() -> None:
    scene = room(33, 17)
    whole = state(scene, threads=2).film_state()
    assert whole.shape == (17, 33, 13, 2)
    assert np.array_equal(whole, state(scene, threads=1).film_state())
    whole = state(scene, adaptive=False).film_state()
    part = state(scene, 0, 2, adaptive=False)
    part.add_film_state(state(scene, 2, 4, adaptive=False).film_state(), 4)
    assert np.array_equal(whole, part.film_state())


def test_sums_without_guides_are_refused() -> None:
    from vlp_bpt import SceneError

    plain = Renderer(room(), RenderSettings(samples=1)).film_state()
    with pytest.raises(SceneError, match="4 channels, but the film has 13"):
        state(room(), samples=1).add_film_state(plain, 1)


@pytest.mark.parametrize("mode", ["PAPER", "BALANCED", "REFERENCE"])
def test_guides_leave_every_bit_of_the_picture(mode: str) -> None:
    scene = room(24, 24)
    plain = Renderer(scene, RenderSettings.from_dict({"samples": 5, "mode": mode}))
    plain.iterate(5)
    guided = Renderer(scene, RenderSettings.from_dict({"samples": 5, "mode": mode, "denoise": True}))
    guided.iterate(5)
    assert np.array_equal(guided.read(), plain.read())
    assert np.array_equal(guided.layers()[NOISY], plain.read())


def test_splats_of_one_pixel_have_the_mean_of_those_of_the_filter() -> None:
    """Bit for bit where the filter has one pixel, in the mean over seeds where it has more."""
    scene = room(16, 16)
    options = {"samples": 8, "denoise": True, "light_samples": 0, "vlp_connections": 0}
    box = Renderer(scene, RenderSettings.from_dict(options | {"filter": "BOX", "filter_width": 1.0}))
    box.iterate(8)
    assert np.array_equal(box._guided()[0], box.read()[..., :3])
    whole, single = [], []
    for seed in range(24):
        renderer = Renderer(scene, RenderSettings.from_dict(options | {"seed": seed, "light_paths": 2000}))
        renderer.iterate(8)
        whole.append(renderer.read()[..., :3])
        single.append(renderer._guided()[0])
    assert not np.array_equal(whole[0], single[0])
    lit = np.array(whole).mean(axis=(0, 3)) > 0
    assert_same_mean(np.array(single, float)[:, lit], np.array(whole, float)[::-1][:, lit], "splats of one pixel")


def test_a_window_has_the_guides_of_the_whole() -> None:
    scene = above(8).add(square(0.6), diffuse(ORANGE)).scene
    albedo, normal = guides(scene)
    scene.film.window = (1, 2, 5, 3)
    part_albedo, part_normal = guides(scene)
    assert np.array_equal(part_albedo, albedo[2:5, 1:6])
    assert np.array_equal(part_normal, normal[2:5, 1:6])
    assert 0 < albedo.mean() < np.mean(ORANGE)


def test_without_denoising_there_are_no_layers() -> None:
    renderer = Renderer(Scene(camera=Camera(), film=Film(2, 2)), RenderSettings(samples=1))
    assert renderer.layers() == {}
    assert renderer.render().layers == {}

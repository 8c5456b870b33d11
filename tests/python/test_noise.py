"""The noise threshold: what is measured and when, that it tells the true error, and that stopping does not bias."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes_for_tests import assert_same_mean, blocks
from small_scenes import room
from stats import mean_p, sidak
from test_denoise import FAST

from vlp_bpt import Renderer, RenderSettings, Scene, materials
from vlp_bpt.noise import NoiseMeter, luminance_of, picture_noise
from vlp_bpt.render import Progress
from vlp_bpt.scene import Instance, Spheres

MANY = 10**6


def make(threshold: float, scene: Scene | None = None, samples: int = MANY, **settings: Any) -> Renderer:
    return Renderer(scene or room(), RenderSettings(samples=samples, noise_threshold=threshold, **settings))


def glass_room(width: int, height: int) -> Scene:
    """The room with a ball of glass, so with a caustic and its specks."""
    scene = room(width, height)
    scene.geometries.append(Spheres("ball", np.array([[0, -0.3, 0]], np.float32), np.array([0.45], np.float32)))
    scene.materials.append(materials.glass())
    scene.instances.append(Instance("ball", 1, materials=(1,)))
    return scene


# The measure


@pytest.mark.parametrize(("luminance", "unit"), [(0.01, 0.03**0.5), (0.25, 0.75**0.5), (0.5, 1.5), (4.0, 12.0)])
def test_the_error_is_relative_to_the_brightness(luminance: float, unit: float) -> None:
    grey = np.full((40, 25), luminance, np.float32)
    assert picture_noise(np.full_like(grey, 0.002), grey) == pytest.approx(0.006 / unit, rel=2e-3)
    assert picture_noise(np.full_like(grey, -0.002), grey) == pytest.approx(0.006 / unit, rel=2e-3)


def test_a_noisy_corner_counts_and_specks_do_not() -> None:
    grey = np.full((160, 160), 1 / 12, np.float32)  # R + G + B = 1/4, of which the root is 1/2
    error = np.full_like(grey, 0.001)
    assert picture_noise(error, grey) == pytest.approx(0.006, rel=1e-3)
    error[5, 5] = error[100, 37] = 1e6
    assert picture_noise(error, grey) == pytest.approx(0.006, rel=1e-3)
    error[:32, :80] *= 10  # a tenth of the picture
    assert picture_noise(error, grey) == pytest.approx(0.06, rel=0.01)


@pytest.mark.parametrize("shape", [(1, 1), (1, 300), (17, 5), (47, 33), (16, 16)])
def test_every_size_of_picture_has_tiles(shape: tuple[int, int]) -> None:
    assert picture_noise(np.full(shape, 0.1, np.float32), np.ones(shape, np.float32)) == pytest.approx(0.1, rel=1e-3)


def test_black_pixels_have_no_noise_and_those_that_are_not_finite_are_left_out() -> None:
    black = np.zeros((32, 32), np.float32)
    assert picture_noise(black, black) == 0
    for value in (np.nan, np.inf):
        error, grey = np.full_like(black, 0.1), np.ones_like(black)
        error[3, 3] = grey[7, 9] = value
        assert picture_noise(error, grey) == pytest.approx(0.1, rel=0.02)
        assert picture_noise(np.full_like(black, value), np.full_like(black, value)) == 0


# When the meter looks


def run(meter: NoiseMeter, means: Any, most: int = 10**5) -> list[int]:
    """The counts at which a render of `means(n)` was looked at, until it was enough."""
    looks, n = [], 0
    while n < most:
        n = int(min(meter.next_look(n), most))
        looks.append(n)
        if meter.look(n, lambda n=n: means(n)):
            break
    return looks


def noisy_means(deviation: float, seed: int = 1) -> Any:
    """Means of n iterations of a picture of luminance 1, each with normal noise of its own."""
    random, sums = np.random.default_rng(seed), {0: np.zeros((64, 64))}

    def means(n: int) -> NDArray[np.float32]:
        last = max(k for k in sums if k <= n)
        sums[n] = sums[last] + random.normal(scale=deviation * (n - last) ** 0.5, size=(64, 64))
        return np.repeat((1 + sums[n] / n)[..., None], 4, axis=2).astype(np.float32)

    return means


def test_the_estimate_is_that_of_the_error_wherever_it_is_looked_at() -> None:
    means, meter = noisy_means(0.3), NoiseMeter(1e-9)
    for n in (8, 16, 32, 41, 57, 64, 90, 127, 128):
        meter.look(n, lambda n=n: means(n))
        picture = luminance_of(means(n))
        if n > 8:
            assert meter.noise == pytest.approx(picture_noise(picture - 1, np.ones_like(picture)), rel=0.1)


@pytest.mark.parametrize("enough", [70, 200, 1500, 5000])
def test_a_render_stops_soon_after_it_was_enough_and_is_seldom_looked_at(enough: int) -> None:
    error = luminance_of(noisy_means(0.3)(enough)) - 1
    looks = run(NoiseMeter(picture_noise(error, np.ones_like(error))), noisy_means(0.3, seed=2))
    assert 0.8 < looks[-1] / enough < 1.3
    assert len(looks) < np.log2(enough) + 4


def test_no_render_stops_before_32_iterations() -> None:
    assert run(NoiseMeter(100.0), noisy_means(0.3)) == [8, 16, 32]
    assert run(NoiseMeter(1e-300), noisy_means(0.3), most=600)[-1] == 600


def test_iterations_that_are_lost_are_forgotten() -> None:
    meter = NoiseMeter(100.0)
    assert run(meter, noisy_means(0.3)) == [8, 16, 32]
    assert meter.next_look(20) == 32  # fewer than were looked at
    assert (meter.noise, meter.share(20)) == (None, 0)
    means = noisy_means(0.3, seed=2)
    assert not meter.look(32, lambda: means(32))
    assert meter.look(64, lambda: means(64))
    assert not meter.look(40, lambda: means(40))
    assert meter.noise is None


def test_without_a_threshold_nothing_is_read() -> None:
    meter = NoiseMeter(0.0)
    assert meter.next_look(5) == float("inf")
    assert not meter.look(64, lambda: pytest.fail("was read"))
    assert (meter.noise, meter.share(64)) == (None, 0)


# Renders


@pytest.mark.parametrize("value", [0.0, 5.0, np.nan])
def test_a_picture_without_noise_stops_at_once(fake: Any, monkeypatch: pytest.MonkeyPatch, value: float) -> None:
    monkeypatch.setattr(fake, "read", lambda self, out: out.fill(value))
    renderer = make(0.01)
    told: list[Progress] = []
    renderer.render(told.append)
    assert renderer.iterations == 32
    assert (told[-1].fraction, told[-1].noise, renderer.statistics.noise) == (1, 0, 0)


def test_samples_time_and_cancelling_end_it_sooner(fake: Any) -> None:
    renderer = make(1e-6, samples=40)  # pictures of the fake core get brighter for ever
    assert renderer.render().metadata["noise"] == renderer.statistics.noise > 0.1
    assert renderer.iterations == 40
    fake.seconds = 0.005
    renderer = make(1e-6, time_limit=0.4)
    renderer.render()
    assert 8 < renderer.iterations < 200
    flag = threading.Event()
    threading.Timer(0.3, flag.set).start()
    renderer = make(1e-6)
    renderer.render(cancel=flag)
    assert 8 < renderer.iterations < 200
    assert renderer.statistics.noise is not None


def test_few_samples_have_no_estimate(fake: Any) -> None:
    renderer = make(0.1, samples=8)
    assert "noise" not in renderer.render().metadata
    assert renderer.statistics.noise is None


def test_without_a_threshold_there_is_no_estimate_and_the_same_picture() -> None:
    stopped = make(0.04)
    picture = stopped.render()
    plain = make(0, samples=stopped.iterations)
    assert np.array_equal(plain.render().pixels, picture.pixels)
    assert plain.statistics.noise is None
    assert "noise" not in plain.metadata()
    assert picture.metadata["noise"] == stopped.statistics.noise <= 0.04
    assert picture.metadata["settings"]["noise_threshold"] == 0.04


def test_progress_goes_to_one_by_noise() -> None:
    told: list[Progress] = []
    renderer = make(0.01, room(32, 24))
    renderer.render(told.append)
    assert told[-1].fraction == 1
    assert told[-1].noise == renderer.statistics.noise
    assert all(progress.fraction < 1 for progress in told[:-1])
    assert 32 < renderer.iterations < 5000


def test_a_render_that_goes_on_measures_the_whole_picture() -> None:
    renderer = make(0.012, room(32, 24), samples=50)
    renderer.render()
    before = renderer.statistics.noise
    while renderer.statistics.noise > 0.012:
        renderer.render()
    in_one_go = make(0.012, room(32, 24))
    in_one_go.render()
    assert before > 0.012
    assert renderer.iterations == pytest.approx(in_one_go.iterations, rel=0.35)


def test_a_window_has_the_noise_of_its_own_pixels() -> None:
    scene = room(64, 48)
    scene.film.window = (3, 5, 20, 10)
    scene.film.transparent = True
    renderer = make(0.02, scene, splats=False)
    assert renderer.render().pixels.shape == (10, 20, 4)
    assert renderer.statistics.noise <= 0.02


def test_the_noise_is_that_before_denoising() -> None:
    plain, denoised = make(0.04), make(0.04, **FAST)
    picture = denoised.render()
    plain.render()
    assert picture.metadata["denoised"]
    assert denoised.iterations == plain.iterations
    assert denoised.statistics.noise == pytest.approx(plain.statistics.noise, rel=1e-6)


@pytest.mark.parametrize(("scene", "threshold"), [(room, 0.02), (glass_room, 0.03)])
def test_the_true_error_at_the_stop_is_near_the_threshold(scene: Any, threshold: float) -> None:
    converged = luminance_of(make(0, scene(48, 32), samples=2000, seed=100).render().pixels)
    for seed in range(3):
        renderer = make(threshold, scene(48, 32), seed=seed)
        picture = luminance_of(renderer.render().pixels)
        error = picture_noise(picture - converged, converged)
        told = renderer.statistics.noise
        print(f"{scene.__name__}: {renderer.iterations} iterations, told {told:.4f}, true {error:.4f}")
        assert 0.6 < error / threshold < 1.6


def test_stopping_does_not_bias_the_picture() -> None:
    """t-tests of each pixel, of 4 x 4 blocks and of the whole, false-alarm rate 1e-4 each. Pixels that stop by
    themselves fail the last of them: it would see such a bias."""
    count, threshold = 600, 0.026

    def luminances(stops: bool, seed: int) -> NDArray[np.float64]:
        renderer = make(threshold if stops else 0, samples=MANY if stops else 40, seed=seed, threads=1)
        found = luminance_of(renderer.render().pixels).astype(np.float64)
        counts.add(renderer.iterations)
        return found[..., None]

    counts: set[int] = set()
    fixed = np.stack([luminances(False, 10_000 + seed) for seed in range(count)])
    counts.clear()
    stopped = np.stack([luminances(True, seed) for seed in range(count)])
    assert len(counts) > 2  # the rule did decide
    for what, side in (("pixels", 1), ("blocks", 4)):
        assert_same_mean(blocks(stopped, side), blocks(fixed, side), what)
    assert_same_mean(stopped.mean(axis=(1, 2)), fixed.mean(axis=(1, 2)), "whole")
    alone = np.stack([_stopped_alone(seed, threshold) for seed in range(count)])
    p = mean_p(alone.mean(axis=(1, 2)), fixed.mean(axis=(1, 2)))
    print(f"pixels that stop alone: {alone.mean() / fixed.mean() - 1:+.2%}, p {p.min():.2g}")
    assert p.min() < sidak(1e-4, p.size)


def _stopped_alone(seed: int, threshold: float) -> NDArray[np.float64]:
    """(height, width, 1): each pixel keeps its mean of the first 8, 16, 32 or 64 iterations with little noise."""
    renderer = make(0, seed=seed, threads=1)
    before = picture = np.zeros(0, np.float32)
    going = np.ones((12, 16), bool)
    for n in (4, 8, 16, 32, 64):
        renderer.iterate(n - renderer.iterations)
        now = luminance_of(renderer.read())
        if n == 4:
            before = picture = now
            continue
        error = np.abs(now - before) / np.maximum(np.sqrt(3 * now), 1e-4) * 3
        picture = np.where(going, now, picture)
        going &= error > threshold
        before = now
    return picture.astype(np.float64)[..., None]

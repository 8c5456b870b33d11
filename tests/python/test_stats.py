"""The image comparison itself: it holds its false-alarm rate on noise and finds a bias of one per cent."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from stats import assert_agree, cell_means, compare, heavy_tailed, mean_p, median_p, sidak, student_p

SHAPE = (64, 64, 3)


def noise(rng: np.random.Generator, batches: int, deviation: float = 0.3, level: float = 0.5) -> np.ndarray:
    """Batches of a picture with a gradient, each pixel with gamma-distributed (skewed, positive) noise."""
    mean = level * (0.2 + np.linspace(0, 1, SHAPE[1]))[None, :, None] * np.ones(SHAPE)
    shape = 1 / deviation**2
    return rng.gamma(shape, size=(batches, *SHAPE)) / shape * mean


@pytest.mark.parametrize(
    ("t", "df", "expected"),
    [  # closed forms: df = 1 is Cauchy's distribution, df = 2 is 1 - t / sqrt(2 + t^2)
        (1.0, 1.0, 0.5),
        (12.706204736432095, 1.0, 0.05),
        (3.0, 2.0, 1 - 3 / np.sqrt(11)),
        (0.0, 7.3, 1.0),
        (2.2281388519649385, 10.0, 0.05),
        (np.inf, 5.0, 0.0),
    ],
)
def test_student_p(t: float, df: float, expected: float) -> None:
    assert student_p(np.array(t), np.array(df)) == pytest.approx(expected, rel=1e-9, abs=1e-15)


def test_student_p_far_tail_is_normal_for_many_degrees() -> None:
    # two-sided normal tail at 6 sigma, 1.97317e-9; with 1e7 degrees of freedom the two differ by about t^4 / (4 df)
    assert student_p(np.array(6.0), np.array(1e7)) == pytest.approx(1.9731752898e-9, rel=1e-3)


def test_sidak_combines_to_the_stated_rate() -> None:
    assert 1 - (1 - sidak(0.01, 5000)) ** 5000 == pytest.approx(0.01)


def test_cell_means_with_a_remainder() -> None:
    image = np.arange(2 * 5 * 3 * 1, dtype=float).reshape(2, 5, 3, 1)
    means = cell_means(image, np.array([0, 4]), np.array([0, 2]))
    assert means.shape == (2, 2, 2, 1)
    assert means[1, 0, 1, 0] == pytest.approx(image[1, :4, 2:, 0].mean())
    assert means[0, 1, 0, 0] == pytest.approx(image[0, 4:, :2, 0].mean())


def test_false_alarm_rate_is_held() -> None:
    """300 comparisons of equal images at a rate of 0.1: at most 51 alarms, which chance exceeds with p < 1e-4."""
    seed = 20261123
    rng = np.random.default_rng(seed)
    alarms = sum(
        bool(compare(noise(rng, 12, 0.3), noise(rng, 8, 0.6), false_alarm=0.1, tolerance=0.0).failures)
        for _ in range(300)
    )
    assert alarms <= 51, f"{alarms} alarms of 300 (seed {seed})"


@pytest.mark.parametrize(("n", "m", "ratio"), [(8, 8, 1.0), (12, 8, 2.0), (16, 16, 0.05)])
def test_mean_p_is_never_liberal_in_the_tail(n: int, m: int, ratio: float) -> None:
    """200,000 tests at a rate of 1e-3 give at most 263 alarms (binomial, false-alarm rate 1e-5)."""
    seed = 11
    rng = np.random.default_rng(seed)
    p = mean_p(rng.normal(1, 0.1, (n, 200_000)), rng.normal(1, 0.1 * ratio, (m, 200_000)))
    assert (p < 1e-3).sum() <= 263, f"{(p < 1e-3).sum()} alarms (seed {seed})"


def test_one_per_cent_in_one_region_is_found() -> None:
    rng = np.random.default_rng(2)
    biased = noise(rng, 24, 0.06)
    biased[:, 16:32, 32:48] *= 1.01
    comparison = compare(biased, noise(rng, 24, 0.06), tolerance=0.0)
    assert comparison.failures
    assert tuple(map(int, np.unravel_index(comparison.region_p.argmin(), comparison.region_p.shape)))[:2] == (1, 2)


def test_a_bias_of_one_block_is_found_though_regions_allow_it() -> None:
    rng = np.random.default_rng(3)
    biased = noise(rng, 16, 0.08)
    biased[:, 8:16, 24:32] *= 1.1
    comparison = compare(biased, noise(rng, 16, 0.08), tolerance=0.05)
    assert (comparison.region_p >= comparison.region_threshold).all()
    assert any("block" in failure for failure in comparison.failures)
    assert tuple(map(int, np.unravel_index(comparison.block_p.argmin(), comparison.block_p.shape)))[:2] == (1, 3)


def test_tolerance_is_relative_and_its_edge_is_sharp() -> None:
    rng = np.random.default_rng(4)
    a, b = noise(rng, 16, 0.02), noise(rng, 16, 0.02)
    assert not compare(a * 1.008, b, tolerance=0.01, blocks_equal=False).failures
    assert compare(a * 1.013, b, tolerance=0.01, blocks_equal=False).failures


def test_noiseless_pixels_may_differ_by_rounding_only() -> None:
    rng = np.random.default_rng(5)
    flat = np.full((6, *SHAPE), 0.25)
    assert not compare(flat * (1 + 3e-6), flat).failures
    assert compare(flat * (1 + 1e-4), flat, tolerance=0.0).failures
    assert not compare(np.zeros_like(flat), np.zeros_like(flat)).failures
    assert compare(flat, flat + rng.normal(0, 1e-9, flat.shape) + 1e-3, tolerance=0.0).failures


def test_a_firefly_alone_is_no_difference() -> None:
    rng = np.random.default_rng(6)
    a, b = noise(rng, 16, 0.05), noise(rng, 16, 0.05)
    a[3, 20, 20] += 500.0
    assert heavy_tailed(cell_means(a, np.arange(0, 64, 8), np.arange(0, 64, 8)))[2, 2].all()
    assert not compare(a, b).failures


def test_medians_of_means_ignore_what_one_batch_caught() -> None:
    """One image found a rare path in one batch, the other none: the means' own noise hides in the second image."""
    rng = np.random.default_rng(7)
    a, b = rng.normal(1, 0.01, (15, 1)), rng.normal(1, 0.01, (15, 1))
    a[4] += 50
    assert median_p(a, b)[0] > 1e-3
    assert median_p(a + 1, b)[0] < 1e-6


def test_many_fireflies_are_too_noisy_to_pass() -> None:
    rng = np.random.default_rng(8)
    a = noise(rng, 16, 0.05)
    a[rng.integers(0, 16, 400), rng.integers(0, 64, 400), rng.integers(0, 64, 400)] += 1000.0
    assert any("too noisy" in failure for failure in compare(a, noise(rng, 16, 0.05)).failures)


def test_regions_too_noisy_to_judge_are_a_failure() -> None:
    rng = np.random.default_rng(12)
    a, b = noise(rng, 8, 0.5), noise(rng, 8, 0.5)  # a region's standard error: 0.5 / 16 * sqrt(2 / 8) = 1.6 %
    assert any("too noisy" in failure for failure in compare(a, b, most_noise=0.005).failures)
    assert not compare(a, b, most_noise=0.03).failures


def test_failure_writes_the_images_and_says_how_to_repeat(tmp_path: Path) -> None:
    rng = np.random.default_rng(9)
    comparison = compare(noise(rng, 8) * 1.5, noise(rng, 8))
    with pytest.raises(AssertionError, match="seed 9"):
        assert_agree("bias", comparison, "seed 9", tmp_path)
    names = {p.name for p in tmp_path.iterdir()}
    assert names == {f"bias_{part}.exr" for part in ("ours", "theirs", "difference", "block_p", "region_p")}


def test_few_or_unequal_batches_are_refused() -> None:
    with pytest.raises(ValueError, match="cannot be compared"):
        compare(np.zeros((3, 8, 8, 3)), np.zeros((8, 8, 8, 3)))

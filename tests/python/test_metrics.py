"""Metrics against closed forms, and against what the published packages make of the same pictures."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from vlp_bpt import metrics
from vlp_bpt.errors import Error

Picture = NDArray[np.float64]


def pictures() -> tuple[Picture, Picture]:
    """A test and a reference, 64 x 48, by formula."""
    y, x = np.mgrid[0:48, 0:64].astype(float)
    reference = np.stack([x / 63, y / 47, 0.5 + 0.5 * np.sin(x * 0.7) * np.cos(y * 0.4)], -1)
    change = np.stack([np.sin(3.1 * x * y / 50), np.cos(x * 1.3), np.sin(y * 2.1)], -1)
    return np.clip(reference + 0.15 * change, 0, 1), reference


def test_srgb_encoding() -> None:
    assert np.allclose(metrics.srgb_encode([-1, 0, 0.0031308, 0.214041, 1, 7]), [0, 0, 0.04045, 0.5, 1, 1], atol=2e-6)
    values = np.linspace(0, 1, 1001)
    assert np.abs(metrics.srgb_decode(metrics.srgb_encode(values)) - values).max() < 1e-7


@pytest.mark.parametrize("metric", [metrics.flip, metrics.rel_mse, metrics.mean_difference])
def test_equal_pictures_do_not_differ(metric: Any) -> None:
    picture = pictures()[0]
    assert metric(picture, picture) == 0


def test_equal_pictures_are_similar() -> None:
    picture = pictures()[0]
    assert metrics.ssim(picture, picture) == pytest.approx(1, abs=1e-12)
    assert metrics.ssim_corrected(picture, picture, picture) == pytest.approx(1, abs=1e-12)


def test_ssim_is_that_of_scikit_image() -> None:
    # scikit-image 0.26.0: structural_similarity(encode(reference), encode(test), channel_axis=2, data_range=1,
    # gaussian_weights=True, sigma=1.5, use_sample_covariance=False)
    assert metrics.ssim(*pictures()) == pytest.approx(0.4452958617484086, abs=1e-12)


def test_ssim_of_constants_is_the_luminance_term() -> None:
    a, b = np.full((16, 16, 3), 1.0), np.full((16, 16, 3), 0.214041)
    c1 = 0.01**2
    assert metrics.ssim(a, b) == pytest.approx((2 * 0.5 + c1) / (1 + 0.25 + c1), abs=1e-5)


@pytest.mark.parametrize(("pixels_per_degree", "expected"), [(None, 0.1942461133), (30.0, 0.3831707239)])
def test_flip_is_that_of_its_authors(pixels_per_degree: float | None, expected: float) -> None:
    # flip-evaluator 1.7: evaluate(reference, test, "LDR", inputsRGB=False, applyMagma=False), in single precision
    more = () if pixels_per_degree is None else (pixels_per_degree,)
    assert metrics.flip(*pictures(), *more) == pytest.approx(expected, abs=2e-5)


def test_flip_of_black_and_white() -> None:
    # flip-evaluator 1.7, as above; no edge anywhere, so this is the colour term of HyAB(black, white) = 100
    black, white = np.zeros((32, 32, 3)), np.ones((32, 32, 3))
    assert metrics.flip(black, white) == pytest.approx(0.9673951268, abs=2e-5)
    assert np.ptp(metrics.flip_map(black, white)) < 1e-9


def test_flip_looks_where_the_difference_is() -> None:
    test, reference = np.full((64, 64, 3), 0.2), np.full((64, 64, 3), 0.2)
    test[:, 40:] = 0.4
    difference = metrics.flip_map(test, reference)
    assert difference.shape == (64, 64)
    assert difference[:, :20].max() < 1e-6  # beyond the reach of every filter
    assert difference[:, 50:].min() > 0.1


def test_flip_tells_left_from_right() -> None:
    test, reference = pictures()
    mirrored = metrics.flip_map(test[:, ::-1], reference[:, ::-1])[:, ::-1]
    assert np.allclose(metrics.flip_map(test, reference), mirrored, atol=1e-9)
    turned = metrics.flip_map(test.swapaxes(0, 1), reference.swapaxes(0, 1)).T
    assert np.allclose(metrics.flip_map(test, reference), turned, atol=1e-9)


def test_rel_mse_by_hand() -> None:
    test, reference = np.full((2, 2, 3), 3.0), np.full((2, 2, 3), 2.0)
    assert metrics.rel_mse(test, reference) == pytest.approx(1 / 4.01)
    test[0, 0, 0] = 2.0
    assert metrics.rel_mse(test, reference) == pytest.approx(11 / 12 / 4.01)
    assert metrics.rel_mse(np.full((2, 2, 3), 0.1), np.zeros((2, 2, 3))) == pytest.approx(1)


def test_mean_difference_by_hand() -> None:
    assert metrics.mean_difference(np.full((2, 2, 3), 1.5), np.full((2, 2, 3), 2.0)) == pytest.approx(-0.25)
    black = np.zeros((2, 2, 3))
    assert metrics.mean_difference(black, black) == 0
    assert metrics.mean_difference(np.ones((2, 2, 3)), black) == math.inf


def test_noise_of_the_reference_is_taken_out() -> None:
    # Unit pictures with noise sigma: the test's own is sigma_t², a noisy reference of two halves adds sigma_r² / 2.
    # The mean over 256 x 256 x 3 squares has a relative deviation of sqrt(2 / 196608) = 0.3 %; 2 % is 6 of them.
    random = np.random.default_rng(7)
    test, half_1, half_2 = (1 + s * random.standard_normal((256, 256, 3)) for s in (0.02, 0.05, 0.05))
    reference = (half_1 + half_2) / 2
    assert metrics.rel_mse(test, reference) == pytest.approx((0.02**2 + 0.05**2 / 2) / 1.01, rel=0.02)
    assert metrics.rel_mse_corrected(test, half_1, half_2) == pytest.approx(0.02**2 / 1.01, rel=0.02 * 5)


def test_ssim_corrected_sees_through_the_noise_of_the_reference() -> None:
    test, clean = (0.2 + 0.4 * picture for picture in pictures())
    test, clean = np.tile(test, (4, 4, 1)), np.tile(clean, (4, 4, 1))
    random = np.random.default_rng(3)
    half_1, half_2 = (clean + 0.05 * random.standard_normal(clean.shape) for _ in range(2))
    wanted = metrics.ssim(test, clean)
    plain = metrics.ssim(test, (half_1 + half_2) / 2)
    corrected = metrics.ssim_corrected(test, half_1, half_2)
    assert abs(plain - wanted) > 0.02
    assert abs(corrected - wanted) < 0.2 * abs(plain - wanted)


def test_alpha_is_ignored() -> None:
    test, reference = pictures()
    with_alpha = np.concatenate([test, np.zeros((48, 64, 1))], axis=2)
    assert metrics.compare(with_alpha, reference) == metrics.compare(test, reference)


@pytest.mark.parametrize(
    ("test", "reference", "message"),
    [
        (np.zeros((4, 5, 3)), np.zeros((5, 4, 3)), "pictures of 5 x 4 and 4 x 5 pixels cannot be compared"),
        (np.zeros((4, 5)), np.zeros((4, 5)), r"test picture has shape \(4, 5\), must be \(height, width, 3 or more\)"),
        (np.zeros((4, 5, 3)), np.zeros((4, 5, 1)), r"reference picture has shape \(4, 5, 1\), must be"),
        (np.full((4, 5, 3), np.nan), np.zeros((4, 5, 3)), "test picture has 20 pixels that are not finite"),
        (
            np.zeros((4, 50, 3)),
            np.zeros((4, 50, 3)),
            "SSIM needs pictures of at least 11 x 11 pixels, these have 50 x 4",
        ),
    ],
)
def test_what_cannot_be_compared_is_said(test: Picture, reference: Picture, message: str) -> None:
    with pytest.raises(Error, match=message):
        metrics.compare(test, reference)

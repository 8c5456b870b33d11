"""How far two pictures are apart: SSIM, FLIP, relative squared error and mean, with the conventions stated at each.

Pictures are arrays (height, width, 3 or more) of linear Rec. 709 colour; further channels (alpha) are ignored.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import Error

Float64 = NDArray[np.float64]

REL_MSE_EPSILON = 1e-2  # added to the squared reference, so that black pixels count without ruling
_SSIM_RADIUS, _SSIM_SIGMA = 5, 1.5


@dataclass(frozen=True)
class Comparison:
    """What `compare` measures. `mean_difference`: of the test's mean less the reference's, over the reference's."""

    ssim: float
    flip: float
    rel_mse: float
    mean_test: tuple[float, float, float]
    mean_reference: tuple[float, float, float]
    mean_difference: float


def compare(test: ArrayLike, reference: ArrayLike) -> Comparison:
    """Every metric of `test` against `reference`; raises Error when they differ in size or are not finite."""
    x, r = _pair(test, reference)
    red, green, blue = (float(m) for m in x.mean(axis=(0, 1)))
    means = tuple(float(m) for m in r.mean(axis=(0, 1)))
    difference = mean_difference(x, r)
    return Comparison(
        ssim(x, r), flip(x, r), rel_mse(x, r), (red, green, blue), (means[0], means[1], means[2]), difference
    )


def srgb_encode(linear: ArrayLike) -> Float64:
    """The sRGB transfer function (IEC 61966-2-1) of values clipped to [0, 1]."""
    x = np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * np.power(np.maximum(x, 0.0031308), 1 / 2.4) - 0.055)


def srgb_decode(encoded: ArrayLike) -> Float64:
    """The inverse of `srgb_encode`."""
    x = np.clip(np.asarray(encoded, dtype=np.float64), 0.0, 1.0)
    return np.where(x <= 0.04045, x / 12.92, np.power((x + 0.055) / 1.055, 2.4))


def mean_difference(test: ArrayLike, reference: ArrayLike) -> float:
    """(mean of test - mean of reference) / mean of reference, over all pixels and channels; 0 where both are black."""
    x, r = _pair(test, reference)
    difference, mean = float(x.mean() - r.mean()), float(r.mean())
    return difference / mean if mean != 0 else math.copysign(math.inf, difference) if difference != 0 else 0.0


def rel_mse(test: ArrayLike, reference: ArrayLike) -> float:
    """The mean over pixels and channels of (test - reference)² / (reference² + 1e-2)."""
    x, r = _pair(test, reference)
    return float(np.mean((x - r) ** 2 / (r**2 + REL_MSE_EPSILON)))


def rel_mse_corrected(test: ArrayLike, half_1: ArrayLike, half_2: ArrayLike) -> float:
    """`rel_mse` against the mean of two independent renders of equal length, less what the reference's own noise adds.

    (half_1 - half_2)² / 4 estimates the variance of their mean, so the numerator is that of a noise-free reference.
    """
    x, a = _pair(test, half_1)
    _, b = _pair(test, half_2)
    r = (a + b) / 2
    return float(np.mean(((x - r) ** 2 - (a - b) ** 2 / 4) / (r**2 + REL_MSE_EPSILON)))


def ssim(test: ArrayLike, reference: ArrayLike) -> float:
    """Structural similarity (Wang et al. 2004), mean over pixels and the three channels; 1 for equal pictures.

    Convention: linear values clipped to [0, 1], sRGB-encoded; Gaussian window of sigma 1.5, 11 x 11; population
    variances; K1 = 0.01, K2 = 0.03, data range 1; only windows that lie wholly in the picture.
    """
    x, r = (srgb_encode(picture) for picture in _pair(test, reference))
    return _ssim(x, r, _moments(r, r))


def ssim_corrected(test: ArrayLike, half_1: ArrayLike, half_2: ArrayLike) -> float:
    """`ssim` against the mean of two independent renders, as if that reference had no noise of its own.

    The reference's variance is the covariance of its halves, in which independent noise cancels.
    """
    x, a = (srgb_encode(picture) for picture in _pair(test, half_1))
    _, b = (srgb_encode(picture) for picture in _pair(test, half_2))
    return _ssim(x, (a + b) / 2, _moments(a, b))


def _ssim(x: Float64, r: Float64, reference_moment: Float64) -> float:
    c1, c2 = 0.01**2, 0.03**2
    mean_x, mean_r = _ssim_window(x), _ssim_window(r)
    variance_x = _moments(x, x) - mean_x**2
    covariance = _moments(x, r) - mean_x * mean_r
    variance_r = reference_moment - mean_r**2
    luminance = (2 * mean_x * mean_r + c1) / (mean_x**2 + mean_r**2 + c1)
    structure = (2 * covariance + c2) / (variance_x + variance_r + c2)
    return float(np.mean(luminance * structure))


def _moments(x: Float64, y: Float64) -> Float64:
    return _ssim_window(x * y)


def _ssim_window(picture: Float64) -> Float64:
    if min(picture.shape[:2]) < 2 * _SSIM_RADIUS + 1:
        size = f"{picture.shape[1]} x {picture.shape[0]}"
        raise Error(f"SSIM needs pictures of at least 11 x 11 pixels, these have {size}")
    kernel = np.exp(-0.5 * (np.arange(-_SSIM_RADIUS, _SSIM_RADIUS + 1) / _SSIM_SIGMA) ** 2)
    kernel /= kernel.sum()
    return _convolve_rows(_convolve_rows(picture, kernel, 0), kernel, 1)


# FLIP: Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG 2020.

PIXELS_PER_DEGREE = 0.7 * (3840 / 0.7) * math.pi / 180  # a 0.7 m wide 4K monitor seen from 0.7 m

# Contrast sensitivity as sums of Gaussians a exp(-b f²) (Table 1): achromatic, red-green, blue-yellow.
_SENSITIVITY = (((1.0, 0.0047),), ((1.0, 0.0053),), ((34.1, 0.04), (13.5, 0.025)))


def flip(test: ArrayLike, reference: ArrayLike, pixels_per_degree: float = PIXELS_PER_DEGREE) -> float:
    """The mean of `flip_map`: 0 for equal pictures, 1 for the largest difference."""
    return float(flip_map(test, reference, pixels_per_degree).mean())


def flip_map(test: ArrayLike, reference: ArrayLike, pixels_per_degree: float = PIXELS_PER_DEGREE) -> Float64:
    """LDR-FLIP of each pixel (height, width): linear values clipped to [0, 1], seen at `pixels_per_degree`."""
    x, r = (_to_opponent(np.clip(picture, 0.0, 1.0)) for picture in _pair(test, reference))
    color = _color_difference(x, r, pixels_per_degree)
    feature = _feature_difference(x[..., 0], r[..., 0], pixels_per_degree)
    return np.asarray(color ** (1 - feature))


def _color_difference(x: Float64, r: Float64, pixels_per_degree: float) -> Float64:
    """Section 4.1: filtered as the eye does, in Hunt-adjusted CIELAB, HyAB distance, compressed to [0, 1]."""
    x, r = (_to_hunt_lab(_from_opponent(_filter_by_sensitivity(p, pixels_per_degree))) for p in (x, r))
    green, blue = _to_hunt_lab(np.array([0.0, 1.0, 0.0])), _to_hunt_lab(np.array([0.0, 0.0, 1.0]))
    exponent, knee, knee_value = 0.7, 0.4, 0.95
    largest = _hyab(green, blue) ** exponent  # the pair of Rec. 709 colours that is furthest apart
    distance = _hyab(x, r) ** exponent
    below = distance * (knee_value / (knee * largest))
    above = knee_value + (distance - knee * largest) / ((1 - knee) * largest) * (1 - knee_value)
    return np.where(distance < knee * largest, below, above)


def _filter_by_sensitivity(opponent: Float64, pixels_per_degree: float) -> Float64:
    widest = max(b for channel in _SENSITIVITY for _, b in channel)
    radius = math.ceil(3 * math.sqrt(widest / (2 * math.pi**2)) * pixels_per_degree)
    degrees = np.arange(-radius, radius + 1) / pixels_per_degree
    filtered = np.empty_like(opponent)
    for i, channel in enumerate(_SENSITIVITY):
        total, weight = np.zeros(opponent.shape[:2]), 0.0
        for a, b in channel:  # each Gaussian is separable, their sum is not
            kernel = np.exp(-((math.pi * degrees) ** 2) / b)
            scale = a * math.sqrt(math.pi / b)
            total += scale * _convolve(opponent[..., i], kernel, kernel)
            weight += scale * kernel.sum() ** 2
        filtered[..., i] = total / weight
    return filtered


def _feature_difference(x: Float64, r: Float64, pixels_per_degree: float) -> Float64:
    """Section 4.2: how differently strong the edges and points of the achromatic channel are, in [0, 1]."""
    sigma = 0.5 * 0.082 * pixels_per_degree
    radius = math.ceil(3 * sigma)
    offsets = np.arange(-radius, radius + 1, dtype=np.float64)
    smooth = np.exp(-0.5 * (offsets / sigma) ** 2)
    edge = _signed_unit(-offsets * smooth)
    point = _signed_unit((offsets**2 / sigma**2 - 1) * smooth)
    smooth /= smooth.sum()

    def strength(picture: Float64, kernel: Float64) -> Float64:
        return np.asarray(np.hypot(_convolve(picture, smooth, kernel), _convolve(picture, kernel, smooth)))

    x, r = (x + 16) / 116, (r + 16) / 116
    difference = np.maximum(
        np.abs(strength(x, edge) - strength(r, edge)),
        np.abs(strength(x, point) - strength(r, point)),
    )
    return np.sqrt(difference / math.sqrt(2))


def _signed_unit(kernel: Float64) -> Float64:
    """The kernel with its positive weights summing to 1 and its negative ones to -1."""
    positive, negative = kernel[kernel > 0].sum(), -kernel[kernel < 0].sum()
    return np.asarray(np.where(kernel > 0, kernel / positive, kernel / negative))


def _rgb_to_xyz() -> Float64:
    """From the chromaticities of Rec. 709 and its white, D65."""
    xy = np.array([[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]])
    xyz = np.column_stack([xy[:, 0] / xy[:, 1], np.ones(4), (1 - xy.sum(axis=1)) / xy[:, 1]]).T
    return np.asarray(xyz[:, :3] * np.linalg.solve(xyz[:, :3], xyz[:, 3]))


_RGB_TO_XYZ = _rgb_to_xyz()
_WHITE = _RGB_TO_XYZ.sum(axis=1)


def _to_opponent(rgb: Float64) -> Float64:
    x, y, z = np.moveaxis(rgb @ _RGB_TO_XYZ.T / _WHITE, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], axis=-1)


def _from_opponent(opponent: Float64) -> Float64:
    y = (opponent[..., 0] + 16) / 116
    xyz = np.stack([y + opponent[..., 1] / 500, y, y - opponent[..., 2] / 200], axis=-1) * _WHITE
    return np.asarray(np.clip(xyz @ np.linalg.inv(_RGB_TO_XYZ).T, 0.0, 1.0))


def _to_hunt_lab(rgb: Float64) -> Float64:
    ratios = rgb @ _RGB_TO_XYZ.T / _WHITE
    delta = 6 / 29
    x, y, z = np.moveaxis(np.where(ratios > delta**3, np.cbrt(ratios), ratios / (3 * delta**2) + 4 / 29), -1, 0)
    lightness = 116 * y - 16
    return np.stack([lightness, 0.01 * lightness * 500 * (x - y), 0.01 * lightness * 200 * (y - z)], axis=-1)


def _hyab(a: Float64, b: Float64) -> Float64:
    d = a - b
    return np.asarray(np.abs(d[..., 0]) + np.hypot(d[..., 1], d[..., 2]))


# Arrays


def _pair(test: ArrayLike, reference: ArrayLike) -> tuple[Float64, Float64]:
    x, r = (_rgb(name, picture) for name, picture in (("test", test), ("reference", reference)))
    if x.shape != r.shape:
        sizes = f"{x.shape[1]} x {x.shape[0]} and {r.shape[1]} x {r.shape[0]}"
        raise Error(f"pictures of {sizes} pixels cannot be compared: they differ in size")
    return x, r


def _rgb(name: str, picture: ArrayLike) -> Float64:
    array: NDArray[Any] = np.asarray(picture)
    if array.ndim != 3 or array.shape[2] < 3 or array.size == 0:
        raise Error(f"{name} picture has shape {array.shape}, must be (height, width, 3 or more)")
    rgb = array[..., :3].astype(np.float64)
    bad = int(np.count_nonzero(~np.isfinite(rgb).all(axis=2)))
    if bad:
        raise Error(f"{name} picture has {bad} pixels that are not finite")
    return rgb


def _convolve_rows(picture: Float64, kernel: Float64, axis: int) -> Float64:
    """Correlation along one axis, only where the kernel lies wholly inside."""
    count = picture.shape[axis] - len(kernel) + 1
    rows = np.moveaxis(picture, axis, 0)
    result = kernel[0] * rows[:count]
    for i in range(1, len(kernel)):
        result += kernel[i] * rows[i : i + count]
    return np.moveaxis(result, 0, axis)


def _convolve(channel: Float64, kernel_y: Float64, kernel_x: Float64) -> Float64:
    """Separable correlation of (height, width) with its edges held."""
    padded = np.pad(channel, ((len(kernel_y) // 2,) * 2, (len(kernel_x) // 2,) * 2), mode="edge")
    return _convolve_rows(_convolve_rows(padded, kernel_y, 0), kernel_x, 1)

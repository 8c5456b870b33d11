"""The noise of a picture, told from its means at two times, and whether it is little enough to stop rendering.

The error of a pixel is taken as Cycles does for its *Noise Threshold*, after Dammertz, Hanika, Keller and Lensch, *A
Hierarchical Automatic Stopping Condition for Monte Carlo Global Illumination* (2010): the error of R + G + B, divided
by the square root of R + G + B where it is below 1, much as eyes and displays do, and by R + G + B itself where it is
brighter. Here R + G + B is three times the luminance.

Cycles stops pixel by pixel, this the picture as a whole. Its noise is that of its tiles, of 16 x 16 pixels: 95 % of
them have no more, on the mean of their pixels. So a corner that is still noisy counts, and bright specks do not: no
pixel counts much more than 1 in its tile, and the tiles of a few specks are left out. A mean of squares would hang on
the specks: between two seeds it differed by a half, the mean by a tenth.

Stopping by it does not bias the picture noticeably. Where each pixel decides for itself, those that happen to be dark
stop soonest and stay dark (Kirk and Arvo, *Unbiased Sampling Techniques for Image Synthesis*, 1991). Here few decisions
are made, from all pixels, each of which has the share of one in their number.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]

TILE = 16  # pixels along the side of a tile, or a few more or less, so that tiles are alike
SHARE_OF_TILES = 0.95
FIRST_MEAN = 8  # iterations: the first mean that is kept, later ones at twice, four times ... as many
LEAST_ITERATIONS = 32  # before which no render stops: few iterations may not have met what is rare
_MARGIN = 1.02  # the noise is looked at a little after it should be low enough, lest it just isn't
_LEAST_STEP = 1.125  # between two looks, by the factor
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)


def picture_noise(error: Float32, luminance: Float32) -> float:
    """The noise of a picture of `luminance` whose luminance is wrong by `error`, both (height, width).

    Pixels that are not finite are left out: no further iteration makes them so.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        brightness = 3 * np.maximum(luminance, 0)
        unit = np.where(brightness < 1, np.sqrt(brightness), brightness) + np.float32(1e-4)
        errors = 3 * np.abs(error) / unit
    errors[~np.isfinite(errors)] = 0
    rows, columns = (_tiles(size) for size in errors.shape)
    sums = np.add.reduceat(np.add.reduceat(errors, rows, axis=0), columns, axis=1)
    sizes = (np.diff(np.append(starts, size)) for starts, size in zip((rows, columns), errors.shape, strict=True))
    return float(np.quantile(sums / np.outer(*sizes), SHARE_OF_TILES))


def luminance_of(pixels: Float32) -> Float32:
    """(height, width) of linear RGB or RGBA (height, width, 3 or 4)."""
    return np.asarray(pixels[..., :3] @ _LUMINANCE)


class NoiseMeter:
    """Watches the mean of a render that goes on, to stop it at `threshold`; at 0 it does nothing.

    The mean m of n iterations is made of that of the first k, m_k, and that of the other n - k. These are independent,
    so (m_k - m) sqrt(k / (n - k)) has the variance of m; where adaptive sampling makes later iterations less noisy
    than earlier ones, that holds for k = n / 2, and is a little too much for other k. For normal noise its mean size
    is that of the error; where rare bright specks are still missing from both, it is less, in caustics down to two
    thirds.

    Two luminances are kept, the last of those of 8, 16, 32 ... iterations: 8 bytes a pixel.

    noise: at the last look, None before there was one. expected: iterations at which it should reach the threshold,
    None before it can be told; those that were enough, once it has.
    """

    def __init__(self, threshold: float) -> None:
        self.threshold = threshold
        self.noise: float | None = None
        self.expected: int | None = None
        self._looked = 0  # iterations at the last look
        self._kept: list[tuple[int, Float32]] = []

    def next_look(self, iterations: int) -> float:
        """The count, above `iterations`, at which `look` wants to see the picture; infinite without a threshold."""
        if self.threshold <= 0:
            return math.inf
        self._forget_lost(iterations)
        doubled = FIRST_MEAN << (iterations // FIRST_MEAN).bit_length()
        if self.expected is None or self.expected <= iterations:
            return doubled
        return min(doubled, self.expected)

    def look(self, iterations: int, read: Callable[[], Float32]) -> bool:
        """Measures the mean of `iterations`, which `read` gives as (height, width, 3 or 4); true where that is enough.

        Does nothing where this mean was seen before or there is no threshold.
        """
        if self.threshold <= 0 or iterations < FIRST_MEAN:
            return False
        self._forget_lost(iterations)
        if iterations != self._looked:
            self._measure(iterations, luminance_of(read()))
        return self._enough

    def share(self, iterations: int) -> float:
        """How much of the render is done, 0 to 1; 0 where it cannot be told."""
        return min(iterations / self.expected, 1.0) if self.expected else 0.0

    @property
    def _enough(self) -> bool:
        return self.noise is not None and self.noise <= self.threshold and self._looked >= LEAST_ITERATIONS

    def _forget_lost(self, iterations: int) -> None:
        """Begins anew where a device that failed took iterations with it: they are in the means that are kept."""
        if iterations < self._looked:
            self._looked, self._kept, self.noise, self.expected = 0, [], None, None

    def _measure(self, n: int, luminance: Float32) -> None:
        self._looked = n
        if self._kept:
            k, before = min(self._kept, key=lambda kept: abs(2 * kept[0] - n))
            self.noise = picture_noise((before - luminance) * np.float32(math.sqrt(k / (n - k))), luminance)
            ratio = min(self.noise / self.threshold, 1e6)
            needed = max(_MARGIN * n * ratio**2, _LEAST_STEP * n, LEAST_ITERATIONS)  # noise falls as 1 / sqrt(n)
            self.expected = n if self._enough else math.ceil(needed)
        if n % FIRST_MEAN == 0 and (n // FIRST_MEAN).bit_count() == 1:
            self._kept = [*self._kept[-1:], (n, luminance)]


def _tiles(size: int) -> NDArray[np.intp]:
    """Where the tiles along `size` pixels begin."""
    count = max(round(size / TILE), 1)
    return np.arange(count) * size // count

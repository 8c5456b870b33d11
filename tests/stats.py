"""Statistical comparison of two rendered images: are their differences more than noise?

Both images come as independent batches (n, h, w, c), renders of the same picture with different random numbers, from
which their noise is measured. Two families of tests share the stated false-alarm rate:

- blocks: the means of 8 x 8 pixel blocks are equal (t-test with both variances);
- regions: the means of a coarse grid of regions are equal within a tolerance, plus noise.

Each family is Sidak-corrected for its number of tests. Student's t has the degrees of freedom of the smaller set of
batches, which never raises more alarms than stated (Mickey and Brown 1966); Welch's, with unequal variances, does so
far out in the tails, where the correction looks.

The t-test assumes means of batches to be close to normal. Blocks where one batch dominates (fireflies) must be rejected
by their medians of means as well, which never raises false alarms; where there are many of them the images are too
noisy to judge, and the comparison fails.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ROUNDING = 1e-5  # relative difference that float32 sums over some thousand samples may have without noise
HEAVY_RATE = 1e-3  # share of normally distributed blocks that pass for heavy-tailed by chance
MEDIAN_GROUP = 3  # batches in one of the means whose median is taken


def sidak(false_alarm: float, tests: int) -> float:
    """The p-value below which one of `tests` independent tests fails, for `false_alarm` over all of them."""
    return float(-np.expm1(np.log1p(-false_alarm) / tests))


def _beta_fraction(a: Array, b: Array, x: Array) -> Array:
    """Lentz's continued fraction of the incomplete beta function (Press et al., Numerical Recipes, 6.4)."""
    tiny = 1e-300
    c = np.ones_like(x)
    d = 1.0 - (a + b) * x / (a + 1.0)
    d = 1.0 / np.where(np.abs(d) < tiny, tiny, d)
    result = d
    for m in range(1, 400):
        for factor in (
            m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1)),
        ):
            d = 1.0 + factor * d
            c = 1.0 + factor / c
            d = 1.0 / np.where(np.abs(d) < tiny, tiny, d)
            c = np.where(np.abs(c) < tiny, tiny, c)
            result = result * d * c
        if np.all(np.abs(d * c - 1.0) < 1e-14):
            break
    return result


_LANCZOS = (676.5203681218851, -1259.1392167224028, 771.32342877765313, -176.61502916214059,
            12.507343278686905, -0.13857109526572012, 9.9843695780195716e-6, 1.5056327351493116e-7)  # fmt: skip


def _log_gamma(x: Array) -> Array:
    """Lanczos' approximation (g = 7) for x >= 0.5."""
    x = x - 1.0
    total = 0.99999999999980993 + sum(k / (x + i + 1) for i, k in enumerate(_LANCZOS))
    t = x + 7.5
    return np.asarray(0.5 * np.log(2 * np.pi) + (x + 0.5) * np.log(t) - t + np.log(total))


def student_p(t: Array, df: Array) -> Array:
    """Two-sided p-value of Student's t: the probability of |t| or more by chance; inf gives 0."""
    t, df = np.broadcast_arrays(np.abs(np.asarray(t, float)), np.asarray(df, float))
    finite = np.isfinite(t)
    square = np.where(finite, t, 0.0) ** 2
    x, complement = df / (df + square), square / (df + square)
    a, b = df / 2, np.full_like(df, 0.5)
    with np.errstate(divide="ignore"):
        log_front = _log_gamma(a + b) - _log_gamma(a) - _log_gamma(b) + a * np.log(x) + b * np.log(complement)
    front = np.exp(log_front)
    direct = x < (a + 1) / (a + b + 2)
    small = front * _beta_fraction(a, b, np.where(direct, x, 0.0)) / a
    large = 1.0 - front * _beta_fraction(b, a, np.where(direct, 0.0, complement)) / b
    return np.where(finite, np.clip(np.where(direct, small, large), 0.0, 1.0), 0.0)


def cell_means(batches: Array, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> Array:
    """Means over the cells that begin at `rows` and `columns`: (n, h, w, c) -> (n, len(rows), len(columns), c)."""
    h, w = batches.shape[1:3]
    sums = np.add.reduceat(np.add.reduceat(batches, rows, axis=1), columns, axis=2)
    counts = np.outer(np.diff(np.append(rows, h)), np.diff(np.append(columns, w)))
    return np.asarray(sums / counts[None, :, :, None])


def _test(difference: Array, level: Array, va: Array, vb: Array, na: int, nb: int, tolerance: float) -> Array:
    """p-values of |difference| <= tolerance * level; va, vb are the variances of the two centres."""
    excess = np.maximum(np.abs(difference) - tolerance * level - ROUNDING * level, 0.0)
    noise = va + vb
    with np.errstate(divide="ignore", invalid="ignore"):
        t = np.where(excess > 0, excess / np.sqrt(noise), 0.0)
    return student_p(t, np.array(min(na, nb) - 1.0))


def mean_p(a: Array, b: Array, tolerance: float = 0.0) -> Array:
    """p-values of the means of a (n, ...) and b (m, ...) being equal within `tolerance` of b's (relative)."""
    va, vb = a.var(axis=0, ddof=1) / len(a), b.var(axis=0, ddof=1) / len(b)
    ma, mb = a.mean(axis=0), b.mean(axis=0)
    return _test(ma - mb, np.abs(mb), va, vb, len(a), len(b), tolerance)


def _median_of_means(a: Array) -> tuple[Array, Array, int]:
    """The median over groups of batches, the variance of it (from the groups' median deviation), the groups' number."""
    groups = max(len(a) // MEDIAN_GROUP, 3)
    means = np.stack([g.mean(axis=0) for g in np.array_split(a, groups)])
    median = np.median(means, axis=0)
    deviation = 1.4826 * np.median(np.abs(means - median), axis=0)
    return median, np.asarray((np.pi / 2) * deviation**2 / groups), groups


def median_p(a: Array, b: Array) -> Array:
    """p-values of the medians of means of a (n, ...) and b (m, ...) being equal."""
    ma, va, na = _median_of_means(a)
    mb, vb, nb = _median_of_means(b)
    return _test(ma - mb, np.abs(mb), va, vb, na, nb, 0.0)


def heavy_tailed(a: Array) -> NDArray[np.bool_]:
    """Where one batch of a (n, ...) lies further out than the others allow (Grubbs' test for one outlier)."""
    n = len(a)
    squares = (a - a.mean(axis=0)) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.nan_to_num(squares.max(axis=0) / squares.sum(axis=0)) * n / (n - 1)
        t = np.sqrt(np.where(share < 1, share * (n - 2) / (1 - share), np.inf))
    return np.asarray(n * student_p(t, np.array(n - 2.0)) < HEAVY_RATE)


@dataclass(frozen=True)
class Comparison:
    """The outcome of `compare`: p-values (rows, columns, channels) of both families and what they are held against."""

    ours: Array
    theirs: Array
    block_p: Array
    block_threshold: float
    heavy: NDArray[np.bool_]
    most_heavy: float
    region_p: Array
    region_threshold: float
    region_error: Array
    region_noise: Array
    most_noise: float
    tolerance: float

    @property
    def failures(self) -> list[str]:
        """What is wrong, in words; empty when the images agree."""
        result = []
        if (bad := self.block_p < self.block_threshold).any():
            worst = np.unravel_index(int(self.block_p.argmin()), self.block_p.shape)
            result.append(
                f"{int(bad.sum())} of {bad.size} block means differ; worst at block (row, column, channel) "
                f"{tuple(map(int, worst))}, p = {self.block_p.min():.2g} < {self.block_threshold:.2g}"
            )
        if self.heavy.mean() > self.most_heavy:
            result.append(
                f"{self.heavy.mean():.1%} of the blocks are heavy-tailed, more than {self.most_heavy:.1%}: too noisy"
            )
        if self.region_noise.max() > self.most_noise:
            result.append(
                f"the regions' relative standard error reaches {self.region_noise.max():.2%}, more than "
                f"{self.most_noise:.2%}: too noisy"
            )
        if (bad := self.region_p < self.region_threshold).any():
            worst = np.unravel_index(int(self.region_p.argmin()), self.region_p.shape)
            result.append(
                f"{int(bad.sum())} of {bad.size} region means differ by more than {self.tolerance:.2%}; worst at "
                f"region {tuple(map(int, worst))}: {self.region_error[worst]:+.2%}, p = {self.region_p.min():.2g}"
            )
        return result

    def summary(self) -> str:
        """One line of figures."""
        return (
            f"mean {self.ours.mean() / self.theirs.mean() - 1:+.3%}, "
            f"regions within {np.abs(self.region_error).max():.3%} "
            f"(standard error up to {self.region_noise.max():.3%}), "
            f"smallest p: blocks {self.block_p.min():.2g} (threshold {self.block_threshold:.2g}), "
            f"regions {self.region_p.min():.2g} ({self.region_threshold:.2g}), "
            f"heavy-tailed blocks {self.heavy.mean():.2%}"
        )


def compare(
    ours: Array,
    theirs: Array,
    *,
    false_alarm: float = 1e-3,
    tolerance: float = 0.01,
    block: int = 8,
    regions: int = 4,
    blocks_equal: bool = True,
    most_heavy: float = 0.02,
    most_noise: float = np.inf,
) -> Comparison:
    """Compare batches `ours` (n, h, w, c) with `theirs` (m, h, w, c), n and m at least 4.

    `tolerance` is relative and for the regions alone; with `blocks_equal` the blocks are tested too, without tolerance.
    `most_heavy` is the largest share of heavy-tailed blocks, `most_noise` the largest relative standard error of a
    region's difference, with which the images can be judged.
    """
    if min(len(ours), len(theirs)) < 4 or ours.shape[1:] != theirs.shape[1:]:
        raise ValueError(f"batches of shapes {ours.shape} and {theirs.shape} cannot be compared")
    a, b = np.asarray(ours, np.float64), np.asarray(theirs, np.float64)
    h, w = a.shape[1:3]
    share = false_alarm / 2 if blocks_equal else false_alarm

    cells = np.arange(0, h, block), np.arange(0, w, block)
    ab, bb = cell_means(a, *cells), cell_means(b, *cells)
    heavy = (heavy_tailed(ab) | heavy_tailed(bb)) if blocks_equal else np.zeros(ab.shape[1:], bool)
    block_p = mean_p(ab, bb) if blocks_equal else np.ones(ab.shape[1:])
    if heavy.any():
        block_p[heavy] = np.maximum(block_p[heavy], median_p(ab[:, heavy], bb[:, heavy]))

    cells = np.arange(regions) * h // regions, np.arange(regions) * w // regions
    ar, br = cell_means(a, *cells), cell_means(b, *cells)
    reference = br.mean(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.where(reference != 0, ar.mean(axis=0) / reference - 1, 0.0)
        spread = np.sqrt(ar.var(axis=0, ddof=1) / len(ar) + br.var(axis=0, ddof=1) / len(br))
        region_noise = np.where(spread > 0, spread / np.abs(reference), 0.0)
    region_p = mean_p(ar, br, tolerance)
    return Comparison(
        ours=a.mean(axis=0),
        theirs=b.mean(axis=0),
        block_p=block_p,
        block_threshold=sidak(share, block_p.size),
        heavy=heavy,
        most_heavy=most_heavy,
        region_p=region_p,
        region_threshold=sidak(share, region_p.size),
        region_error=error,
        region_noise=region_noise,
        most_noise=most_noise,
        tolerance=tolerance,
    )


def write_image(path: Path, pixels: Array) -> None:
    """An EXR (or whatever the ending says) of pixels (h, w, c), top row first."""
    import OpenImageIO

    data = np.ascontiguousarray(pixels, np.float32)
    buffer = OpenImageIO.ImageBuf(OpenImageIO.ImageSpec(data.shape[1], data.shape[0], data.shape[2], OpenImageIO.FLOAT))
    buffer.set_pixels(OpenImageIO.ROI(), data)
    if not buffer.write(str(path)):
        raise OSError(f"'{path}' cannot be written: {buffer.geterror()}")


def assert_agree(name: str, comparison: Comparison, again: str, folder: Path = Path("out/failures")) -> None:
    """Fail with the figures, after writing images, difference and p-values; `again` says seed and command."""
    print(f"{name}: {comparison.summary()}")
    if not comparison.failures:
        return
    folder.mkdir(parents=True, exist_ok=True)
    for part, pixels in (
        ("ours", comparison.ours),
        ("theirs", comparison.theirs),
        ("difference", comparison.ours - comparison.theirs),
        ("block_p", comparison.block_p),
        ("region_p", comparison.region_p),
    ):
        write_image(folder / f"{name}_{part}.exr", pixels)
    raise AssertionError(f"{name}: {'; '.join(comparison.failures)}\nimages: {folder}/{name}_*.exr\nagain: {again}")

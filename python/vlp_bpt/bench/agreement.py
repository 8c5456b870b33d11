"""Do two renderers make the same picture? Means of regions within a tolerance, with the noise of both known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .measure import Halves, Pixels

Doubles = NDArray[np.float64]

REGIONS = 4  # along each side
TOLERANCE = 0.01  # relative, of a region
DARK = 0.1  # of the picture's mean: the least that a region's difference is held against
LEAST_BATCH = 0.12  # of all samples
SIGMAS = 5.0  # standard errors that noise is granted


@dataclass(frozen=True)
class Agreement:
    """difference: of the pictures' means; region: the one that differs most beyond its noise, as (row, column,
    channel), row 0 at the top, with its difference and standard error; most_noise: of any region. All relative."""

    difference: float
    region: tuple[int, int, int]
    region_difference: float
    region_noise: float
    most_noise: float
    agrees: bool

    def __str__(self) -> str:
        mean = f"mean {self.difference:+.2%}"
        if not self.agrees:
            place = f"{self.region_difference:+.1%} ± {self.region_noise:.1%} at region {self.region}"
            return f"NO: {mean}, {place}"
        seen = "yes" if self.most_noise <= TOLERANCE else "no difference seen in the noise"
        return f"{seen}: {mean}, regions ± {self.most_noise:.1%}"


def compare(batches: Sequence[tuple[Pixels, float]], halves: Halves, tolerance: float = TOLERANCE) -> Agreement:
    """A picture in independent batches, (pixels, weight) each, against a reference of two independent halves.

    The batches' noise is from their spread, with variances that are as 1 / weight; the reference's from its halves.
    """
    if len(batches) < 2:
        raise ValueError(f"{len(batches)} batches have no spread: at least two are needed")
    weights = np.array([weight for _, weight in batches])
    parts = np.stack([_regions(pixels) for pixels, _ in batches])
    theirs = np.tensordot(weights, parts, 1) / weights.sum()
    spread = np.tensordot(weights, (parts - theirs) ** 2, 1) / (weights.sum() * (len(batches) - 1))
    first, second = (_regions(half) for half in halves)
    ours = (first + second) / 2
    level = np.maximum(ours, DARK * ours.mean())
    # One difference of halves, or a few batches, say little about a region; all regions together do, in proportion to
    # their light. A region of which its batches say that it is noisier is taken to be so.
    relative = spread / level**2
    noise = np.sqrt(np.maximum(relative, relative.mean()) + np.mean(((first - second) / 2 / level) ** 2))
    difference = (theirs - ours) / level
    excess = np.abs(difference) - SIGMAS * noise
    worst = np.unravel_index(int(np.argmax(excess)), excess.shape)
    return Agreement(
        float(theirs.mean() / ours.mean() - 1),
        (int(worst[0]), int(worst[1]), int(worst[2])),
        float(difference[worst]),
        float(noise[worst]),
        float(noise.max()),
        bool(np.all(excess <= tolerance)),
    )


def increments(pictures: Sequence[tuple[Pixels, float]]) -> list[tuple[Pixels, float]]:
    """The independent batches between running means: (mean so far, samples so far) -> (mean of the batch, samples).

    Batches hold at least LEAST_BATCH of all samples, the first ones together: renderers that go over the picture piece
    by piece have not been everywhere in a short one.
    """
    least = LEAST_BATCH * pictures[-1][1] if pictures else 0.0
    result: list[tuple[Pixels, float]] = []
    mean_before, samples_before = np.zeros(()), 0.0
    for mean, samples in pictures:
        count = samples - samples_before
        if count < least:
            continue
        result.append(((mean * samples - mean_before * samples_before) / count, count))
        mean_before, samples_before = mean, samples
    return result


def _regions(picture: Pixels) -> Doubles:
    """Means over REGIONS x REGIONS cells: (h, w, c) -> (REGIONS, REGIONS, c)."""
    h, w = picture.shape[:2]
    rows, columns = (np.arange(REGIONS) * n // REGIONS for n in (h, w))
    sums = np.add.reduceat(np.add.reduceat(picture, rows, axis=0), columns, axis=1)
    counts = np.outer(np.diff(np.append(rows, h)), np.diff(np.append(columns, w)))
    return np.asarray(sums / counts[..., None], np.float64)

"""The arithmetic of the benchmark with denoisers: when an SSIM was reached."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from vlp_bpt.bench.denoised import Point, measure, seconds_to


def point(seconds: float, ssim: float, name: str = "a") -> Point:
    return Point(name, 1, seconds, 0.0, ssim)


def test_an_ssim_between_two_renders_is_placed_by_what_is_missing_to_1() -> None:
    points = [point(1, 0.9), point(2, 0.99), point(4, 0.9999)]
    assert seconds_to(points, 0.999) == pytest.approx(3)
    assert seconds_to(points, 0.99) == pytest.approx(2)


def test_the_first_render_may_have_it_already_and_the_last_may_not() -> None:
    assert seconds_to([point(3, 0.95)], 0.9) == 3
    assert seconds_to([point(3, 0.85), point(6, 0.89)], 0.9) is None
    assert seconds_to([], 0.9) is None


def test_each_goes_on_until_it_is_good_enough() -> None:
    truth = np.random.default_rng(1).random((32, 32, 3))
    noise = np.random.default_rng(2).normal(size=truth.shape)

    def renders(good_from: int) -> Callable[[int], Any]:
        return lambda samples: (0.5 * samples, (truth + (0.0 if samples >= good_from else 0.5) * noise))

    points = measure({"slow": renders(4), "fast": renders(1)}, (truth, truth), 8, 0.99)
    assert [(p.name, p.samples) for p in points] == [("slow", 1), ("fast", 1), ("slow", 2), ("slow", 4)]
    assert points[-1].seconds == 2

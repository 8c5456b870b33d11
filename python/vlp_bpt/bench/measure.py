"""How good a picture is after how long: points over time, the seconds to an SSIM, and whether two renderers agree."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vlp_bpt import metrics

Pixels = NDArray[np.float64]
Halves = tuple[Pixels, Pixels]

LADDER = (0.25, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 180, 300, 600, 1200)  # seconds; the paper's instants are among them
FURTHEST = 64  # times the last measured time: no extrapolation goes beyond


@dataclass(frozen=True)
class Point:
    """A picture after `seconds` of rendering, against a reference. ssim is against the reference as it is, ssim_c and
    rel_mse less the reference's own noise."""

    seconds: float
    samples: int
    ssim: float
    ssim_c: float
    flip: float
    rel_mse: float


@dataclass(frozen=True)
class Crossing:
    """When a curve reaches a level: measured between two points (""), before the first ("<") or extrapolated ("~")."""

    seconds: float
    kind: str

    def __str__(self) -> str:
        return f"{self.kind}{self.seconds:.2g}" if self.seconds < 100 else f"{self.kind}{self.seconds:.0f}"


def columns(point: Point, samples: str) -> dict[str, str | int | float | bool | None]:
    """A point for a CSV file; `samples` is what the number of samples is called."""
    return {
        "seconds": round(point.seconds, 4),
        samples: point.samples,
        "ssim": point.ssim,
        "ssim_c": point.ssim_c,
        "flip": point.flip,
        "rel_mse": point.rel_mse,
    }


def judge(picture: Pixels, halves: Halves, seconds: float, samples: int) -> Point:
    """Every metric of a picture against a reference of two independent halves."""
    mean = (halves[0] + halves[1]) / 2
    return Point(
        seconds,
        samples,
        metrics.ssim(picture, mean),
        metrics.ssim_corrected(picture, *halves),
        metrics.flip(picture, mean),
        metrics.rel_mse_corrected(picture, *halves),
    )


def ladder(seconds: float) -> list[float]:
    """The instants at which pictures are judged, up to `seconds`, which is the last."""
    return [step for step in LADDER if step < 0.999 * seconds] + [seconds]


def add_point(points: list[Point], point: Point) -> None:
    """Appends a point, unless nothing was rendered since the last one."""
    if not points or point.seconds > points[-1].seconds:
        points.append(point)


def ssim_at(points: Sequence[Point], x: float, *, samples: bool = False) -> float | None:
    """ssim_c after x seconds, or samples, between points as in `seconds_to`; None outside of what was measured."""
    places = [float(p.samples if samples else p.seconds) for p in points]
    if not places or not places[0] <= x <= places[-1]:
        return None
    gaps = np.log([max(1 - p.ssim_c, 1e-9) for p in points])
    return float(1 - math.exp(np.interp(math.log(x), np.log(places), gaps)))


def seconds_to(points: Sequence[Point], level: float) -> Crossing | None:
    """When ssim_c first reaches `level`: between points, the logarithms of time and of 1 - ssim_c are interpolated;
    beyond the last, its last step is drawn out. None where the curve does not lead there."""
    gaps = [max(1 - point.ssim_c, 1e-9) for point in points]
    times = [point.seconds for point in points]
    wanted = 1 - level
    if gaps[0] <= wanted:
        return Crossing(times[0], "<")
    for i in range(1, len(points)):
        if gaps[i] <= wanted:
            return Crossing(math.exp(_log_time(times[i - 1 : i + 1], gaps[i - 1 : i + 1], wanted)), "")
    if len(points) < 2 or gaps[-1] >= gaps[-2]:
        return None
    log_seconds = _log_time(times[-2:], gaps[-2:], wanted)
    return Crossing(math.exp(log_seconds), "~") if log_seconds <= math.log(FURTHEST * times[-1]) else None


def _log_time(times: Sequence[float], gaps: Sequence[float], wanted: float) -> float:
    """The logarithm of the time at which the line through two points, in logarithms, has the gap that is wanted."""
    share = math.log(gaps[0] / wanted) / math.log(gaps[0] / gaps[1])
    return math.log(times[0]) + share * math.log(times[1] / times[0])


def slope(x: Sequence[float], y: Sequence[float]) -> float:
    """The exponent p of y ~ x**p, by least squares of the logarithms."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])

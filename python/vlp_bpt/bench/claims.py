"""What the paper says, held against what was measured: each claim with a verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from . import sweep
from .measure import Point, slope, ssim_at

HOLDS, FAILS, PARTLY, UNTESTED = "holds", "does not hold", "in part", "not tested here"
ENOUGH = 4  # iterations from which on their number follows the time


class Curve(Protocol):
    """See paper.Curve."""

    scene: str
    device: str
    points: list[Point]

    @property
    def iterations_per_second(self) -> float: ...


class Quoted(Protocol):
    """See paper.Quoted."""

    @property
    def ssim(self) -> dict[float, float]: ...

    @property
    def iterations(self) -> dict[str, tuple[float, int]]: ...


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper, what was found, and HOLDS, FAILS, PARTLY or UNTESTED."""

    text: str
    found: str
    verdict: str


def claims(
    curves: Sequence[Curve], sweeps: dict[str, list[sweep.Cell]], quoted: Mapping[str, Quoted], seconds: float
) -> list[Claim]:
    """All claims that the curves and the sweep say something about; `seconds`: of each cell of the sweep."""
    result = []
    for curve in curves:
        if curve.scene in quoted:
            result += quality(curve, quoted[curve.scene])
            result += speed(curve, quoted[curve.scene].iterations)
        result.append(linear(curve))
    result += simple_needs_more(curves)
    for name, cells in sweeps.items():
        result.append(shortest_light_paths(name, cells, seconds))
    if len(sweeps) > 1:
        result.append(length_depends_on_scene(sweeps))
    return result


def quality(curve: Curve, quoted: Quoted) -> list[Claim]:
    """SSIM after the times of the text, and after as many iterations as PC3 has made by then, where the text says."""
    result = []
    rates = [count / seconds for seconds, count in quoted.iterations.values()]
    for seconds, mark in quoted.ssim.items():
        amounts = [(seconds, f"{seconds:g} s (GTX 780)", False)]
        if rates:
            amounts.append(
                (max(rates) * seconds, f"{max(rates) * seconds:.0f} iterations ({seconds:g} s of PC3)", True)
            )
        for amount, words, samples in amounts:
            here = ssim_at(curve.points, amount, samples=samples)
            text = f"{curve.scene}: SSIM {mark:g} after {words}"
            if here is None:
                result.append(Claim(text, f"{curve.device}: not measured so long or so soon", UNTESTED))
            else:
                result.append(Claim(text, f"{curve.device}: {here:.4f}", HOLDS if here >= mark else FAILS))
    return result


def speed(curve: Curve, marks: Mapping[str, tuple[float, int]]) -> list[Claim]:
    """Iterations after the times of the text, by the rate."""
    result = []
    for device, (seconds, count) in marks.items():
        rate = curve.iterations_per_second
        found = f"{curve.device}: {rate * seconds:.0f} at {rate:.2f} a second, {rate * seconds / count:.2g} times that"
        verdict = HOLDS if rate * seconds >= count else FAILS
        result.append(Claim(f"{curve.scene}: {count} iterations in {seconds:g} s ({device})", found, verdict))
    return result


def linear(curve: Curve) -> Claim:
    """Figure 3 has straight lines."""
    points = [p for p in curve.points if p.samples >= ENOUGH]
    text = f"{curve.scene}: iterations grow in proportion to time (Figure 3)"
    if len(points) < 3:
        return Claim(text, f"{curve.device}: {len(points)} pictures", UNTESTED)
    exponent = slope([p.seconds for p in points], [p.samples for p in points])
    found = f"{curve.device}: as time to the power {exponent:.3f}"
    return Claim(text, found, HOLDS if abs(exponent - 1) < 0.05 else FAILS)


def simple_needs_more(curves: Sequence[Curve]) -> list[Claim]:
    """The diffuse Cornell box has the lower SSIM after the same time."""
    text = "the Cornell box needs more samples than the Sierpinski scene (lower SSIM after 1 s)"
    by_scene = {c.scene: c for c in curves}
    if not {"cornell_box", "sierpinski"} <= by_scene.keys():
        return []
    first, second = (
        min(by_scene[name].points, key=lambda p: abs(p.seconds - 1)) for name in ("cornell_box", "sierpinski")
    )
    found = f"SSIM_c {first.ssim_c:.3f} and {second.ssim_c:.3f} after {first.seconds:.1f} and {second.seconds:.1f} s"
    return [Claim(text, found, HOLDS if first.ssim_c < second.ssim_c else FAILS)]


def shortest_light_paths(name: str, cells: list[sweep.Cell], seconds: float) -> Claim:
    """L = 1 gives the best SSIM at equal time, whatever K; L = 0 is not of the paper's method."""
    measured = [c for c in cells if c.L > 0]
    found, won = [], []
    for K in dict.fromkeys(c.K for c in measured):
        top, equal = sweep.best(measured, K)
        won.append(any(c.L == 1 for c in equal))
        tied = "" if len(equal) == 1 else " (within the noise: " + ", ".join(f"L = {c.L}" for c in equal) + ")"
        found.append(f"K = {K}: L = {top.L}{tied}")
    verdict = HOLDS if all(won) else PARTLY if any(won) else FAILS
    return Claim(f"{name}: L = 1 gives the best SSIM after {seconds:g} s", "best at " + "; ".join(found), verdict)


def length_depends_on_scene(sweeps: dict[str, list[sweep.Cell]]) -> Claim:
    """The best K at L = 1 differs from scene to scene."""
    best = {}
    for name, cells in sweeps.items():
        row = [c for c in cells if c.L == 1]
        if row:
            best[name] = max(row, key=lambda c: c.ssim).K
    found = ", ".join(f"{name}: K = {K}" for name, K in best.items())
    text = "the best K depends on the scene (L = 1)"
    return Claim(text, found, HOLDS if len(set(best.values())) > 1 else FAILS)

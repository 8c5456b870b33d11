"""Path lengths at equal time: PAPER mode over L and K, against the truth; what is noise and what is lost light."""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np

from vlp_bpt import metrics
from vlp_bpt.scene import Scene
from vlp_bpt.settings import Mode, RenderSettings

from .contestants import Ours
from .measure import Halves, Pixels
from .plots import Axes, Series
from .report import Cell as CsvCell
from .report import markdown_table


@dataclass(frozen=True)
class Cell:
    """PAPER mode with light paths of L hits and eye paths of K. ssim, rel_mse: against the truth; noise: the part of
    rel_mse that more time takes away, the rest is light that these lengths lose; spread: standard error of ssim."""

    L: int
    K: int
    seconds: float
    iterations: int
    ssim: float
    spread: float
    rel_mse: float
    noise: float

    @property
    def lost(self) -> float:
        return max(self.rel_mse - self.noise, 0.0)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of the sweep."""
    parser.add_argument(
        "--sweep-seconds",
        type=float,
        default=5.0,
        help="render time of each pair of path lengths (default: 5, the paper's; 0 leaves the sweep out)",
    )
    parser.add_argument(
        "--sweep-l", type=int, nargs="+", default=[0, 1, 2, 3, 5], metavar="L", help="default: 0 1 2 3 5"
    )
    parser.add_argument("--sweep-k", type=int, nargs="+", default=[2, 3, 5, 8], metavar="K", help="default: 2 3 5 8")


def measure(name: str, scene: Scene, truth: Halves, args: argparse.Namespace) -> list[Cell]:
    """Every pair of lengths twice, half the time each, the second time in reverse order."""
    pairs = [(L, K) for K in args.sweep_k for L in args.sweep_l]
    halves: dict[tuple[int, int], list[tuple[Pixels, float, int]]] = {pair: [] for pair in pairs}
    for seed, order in enumerate((pairs, pairs[::-1])):
        for pair in order:
            halves[pair].append(_render(scene, *pair, args.sweep_seconds / 2, seed, args.threads))
        print(f"{name}: path lengths, round {seed + 1} of 2", flush=True)
    return [judge(L, K, halves[L, K][0], halves[L, K][1], truth) for L, K in pairs]


def _render(scene: Scene, L: int, K: int, seconds: float, seed: int, threads: int) -> tuple[Pixels, float, int]:
    settings = RenderSettings(
        mode=Mode.PAPER,
        samples=1 << 30,
        seed=seed,
        threads=threads,
        light_path_length=L,
        eye_path_length=K,
        vlp_connections=1 if L else 0,
    )
    runner = Ours(f"L {L}, K {K}", scene, settings)
    runner.run(seconds)
    return runner.picture(), runner.seconds, runner.iterations or 0


def judge(L: int, K: int, first: tuple[Pixels, float, int], second: tuple[Pixels, float, int], truth: Halves) -> Cell:
    """Two independent pictures of equal time, and their mean, against the truth."""
    a, b = first[0], second[0]
    reference = (truth[0] + truth[1]) / 2
    scale = reference**2 + metrics.REL_MSE_EPSILON
    each = [metrics.ssim_corrected(picture, *truth) for picture in (a, b)]
    return Cell(
        L,
        K,
        first[1] + second[1],
        first[2] + second[2],
        metrics.ssim_corrected((a + b) / 2, *truth),
        abs(each[0] - each[1]) / 2,
        metrics.rel_mse_corrected((a + b) / 2, *truth),
        float(np.mean((a - b) ** 2 / 4 / scale)),
    )


def best(cells: list[Cell], K: int) -> tuple[Cell, list[Cell]]:
    """The L of the highest SSIM at this K, and those that the noise cannot tell from it (itself among them)."""
    row = [cell for cell in cells if cell.K == K]
    top = max(row, key=lambda cell: cell.ssim)
    error = 2 * float(np.sqrt(np.mean([cell.spread**2 for cell in cells])))
    return top, [cell for cell in row if cell.ssim >= top.ssim - error]


def rows(sweeps: dict[str, list[Cell]]) -> list[dict[str, CsvCell]]:
    """For the CSV file."""
    return [
        {
            "scene": name,
            "L": c.L,
            "K": c.K,
            "seconds": round(c.seconds, 4),
            "iterations": c.iterations,
            "ssim": c.ssim,
            "ssim_spread": c.spread,
            "rel_mse": c.rel_mse,
            "noise": c.noise,
            "lost": c.lost,
        }
        for name, cells in sweeps.items()
        for c in cells
    ]


def page(sweeps: dict[str, list[Cell]], seconds: float) -> str:
    """A table for each scene: SSIM, and relMSE as noise + lost light."""
    parts = [
        f"{seconds:g} s for each pair of lengths; L = 0 is path tracing without VLPs. SSIM_c, and relMSE as noise + "
        "what the lengths lose, against a REFERENCE picture. Bold: the best of its column."
    ]
    for name, cells in sweeps.items():
        lengths = list(dict.fromkeys(c.L for c in cells))
        columns = list(dict.fromkeys(c.K for c in cells))
        top = {K: best(cells, K)[0] for K in columns}
        lines = []
        for L in lengths:
            line = [f"L = {L}"]
            for K in columns:
                cell = next(c for c in cells if (c.L, c.K) == (L, K))
                ssim = f"**{cell.ssim:.4f}**" if cell is top[K] else f"{cell.ssim:.4f}"
                line.append(f"{ssim}, {cell.noise:.2g} + {cell.lost:.2g}")
            lines.append(line)
        parts.append(markdown_table([name, *(f"K = {K}" for K in columns)], lines))
    return "\n\n".join(parts)


def panel(name: str, cells: list[Cell]) -> tuple[Axes, list[Series]]:
    """SSIM over L, a line for each K."""
    lines = []
    for K in dict.fromkeys(c.K for c in cells):
        row = [c for c in cells if c.K == K]
        lines.append(Series(f"K = {K}", [c.L for c in row], [c.ssim for c in row]))
    return Axes(f"{name}: path lengths at equal time", "L", "SSIM_c"), lines

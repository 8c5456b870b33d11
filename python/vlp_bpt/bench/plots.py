"""Line plots of the benchmarks as PNG files, by matplotlib, which only they need."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vlp_bpt.errors import Error

LOSSES = (0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1, 0.07, 0.03, 0.01, 0.005, 0.002, 0.001)  # ticks of 1 - y


@dataclass(frozen=True)
class Series:
    """A line of a plot. style: matplotlib's, such as "o-" or "--"; color None takes the next one."""

    name: str
    x: Sequence[float]
    y: Sequence[float]
    style: str = "o-"
    color: str | None = None


@dataclass(frozen=True)
class Axes:
    """What the axes say and how they run; `loss` shows 1 - y, logarithmic, so that y close to 1 can be told apart."""

    title: str
    x: str
    y: str
    log_x: bool = False
    log_y: bool = False
    loss: bool = False
    note: str = ""


def require() -> None:
    """Raises Error, with what to do, where matplotlib is missing."""
    _pyplot()


def plot(path: Path, axes: Axes, series: Sequence[Series]) -> None:
    """One plot in a file."""
    plots(path, [(axes, series)])


def plots(path: Path, panels: Sequence[tuple[Axes, Sequence[Series]]]) -> None:
    """Plots side by side in one file."""
    pyplot = _pyplot()
    figure, drawn = pyplot.subplots(1, len(panels), figsize=(6.4 * len(panels), 4.4), squeeze=False)
    for (axes, series), panel in zip(panels, drawn[0], strict=True):
        _draw(panel, axes, series)
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def _draw(panel: Any, axes: Axes, series: Sequence[Series]) -> None:
    for line in series:
        y = [max(1 - value, 1e-5) for value in line.y] if axes.loss else list(line.y)
        options = {} if line.color is None else {"color": line.color}
        panel.plot(list(line.x), y, line.style, label=line.name, markersize=4, linewidth=1.4, **options)
    panel.set_title(axes.title)
    panel.set_xlabel(axes.x)
    panel.set_ylabel(axes.y)
    panel.grid(True, which="both", alpha=0.25)
    if axes.log_x:
        panel.set_xscale("log")
    if axes.log_y or axes.loss:
        panel.set_yscale("log")
    if axes.loss:
        low, high = panel.get_ylim()
        ticks = _spread([share for share in LOSSES if low <= share <= high], (high / low) ** 0.05)
        panel.set_yticks(ticks, minor=False)
        panel.set_yticks([], minor=True)
        panel.set_yticklabels([f"{1 - tick:.3g}" for tick in ticks])
        panel.invert_yaxis()
    if axes.note:
        panel.text(0.98, 0.02, axes.note, transform=panel.transAxes, fontsize=7, ha="right", va="bottom")
    if series:
        panel.legend(fontsize=7)


def _spread(ticks: Sequence[float], factor: float) -> list[float]:
    """Falling ticks of which each is at least so many times below the one before."""
    kept: list[float] = []
    for tick in ticks:
        if not kept or tick * factor <= kept[-1]:
            kept.append(tick)
    return kept


def _pyplot() -> Any:
    try:
        matplotlib = importlib.import_module("matplotlib")
    except ImportError as error:
        text = "plots need matplotlib: `make bench-paper` and its sisters install it, or pip install matplotlib"
        raise Error(f"{text} ({error}); --no-plots leaves them out") from error
    matplotlib.use("Agg")
    return importlib.import_module("matplotlib.pyplot")

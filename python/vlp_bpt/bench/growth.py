"""`vlp-bpt bench growth`: time and memory as triangles, lights, pixels and threads grow.

Each size is measured in a process of its own. CSV, plots, and report.md with exponents: what grows faster than
n log n is named.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from vlp_bpt.errors import Error
from vlp_bpt.render import Renderer
from vlp_bpt.scene import Scene
from vlp_bpt.settings import RenderSettings

from . import plots
from .growth_scenes import balls_and_lamps
from .measure import slope
from .remote import peak_memory
from .report import Cell, busy, machine, markdown_table, number, write_csv

SLACK = 0.1  # by which an exponent over n log n may exceed 1 before it is named: the fit's own error
FEW_TRIANGLES, SIDE = 10_000, 256  # of the scenes in which something else grows
PROJECTED = (4, 8, 16, 64)  # threads


@dataclass(frozen=True)
class Sample:
    """One size. build: seconds of uploading the scene and building its hierarchy; iteration: seconds of the fastest of
    `iterations`, as whatever else the machine does can only slow it down; build_processor, processor: seconds of all
    threads together for the build and for one iteration; core: bytes that the native core accounts for; process: most
    bytes that the process had."""

    axis: str
    size: int
    build: float
    iteration: float
    build_processor: float
    processor: float
    iterations: int
    core: int
    process: int


@dataclass(frozen=True)
class Fit:
    """How a cost grows: exponents of n over all sizes, over the last three, and of n log n over the last three."""

    axis: str
    cost: str
    overall: float
    late: float
    against: float

    @property
    def worse(self) -> bool:
        return self.against > 1 + SLACK


COSTS: dict[str, tuple[str, Callable[[Sample], float]]] = {
    "build": ("building, s", lambda s: s.build),
    "iteration": ("one iteration, s", lambda s: s.iteration),
    "build_processor": ("building, processor time, s", lambda s: s.build_processor),
    "processor": ("one iteration, processor time, s", lambda s: s.processor),
    "core": ("memory of the core, MiB", lambda s: s.core / 2**20),
    "process": ("peak memory of the process, MiB", lambda s: s.process / 2**20),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `vlp-bpt bench growth`."""
    parser.add_argument("--most-triangles", type=int, default=10**7, help="default: 10 million, some 4 GB")
    parser.add_argument("--most-lights", type=int, default=10**4, help="default: 10000")
    parser.add_argument("--most-side", type=int, default=4096, help="of the picture, in pixels (default: 4096)")
    parser.add_argument("--most-threads", type=int, default=os.cpu_count() or 1, help="default: all")
    parser.add_argument("--seconds", type=float, default=3.0, help="least render time of each size (default: 3)")
    parser.add_argument("--output", type=Path, default=Path("out/bench-growth"), help="default: out/bench-growth")
    parser.add_argument("--no-plots", action="store_true", help="needs no matplotlib")


def run(args: argparse.Namespace) -> None:
    """Measures everything and writes it to the folder `output`."""
    if not args.no_plots:
        plots.require()
    args.output.mkdir(parents=True, exist_ok=True)
    samples = [
        measured(axis, size, scene, threads, args.seconds)
        for axis, sizes in axes(args).items()
        for size, scene, threads in sizes
    ]
    fits = [fit for axis in ("triangles", "lights", "pixels") for fit in fitted(axis, samples)]
    write_csv(args.output / "growth.csv", [_row(sample) for sample in samples])
    pictures = [] if args.no_plots else draw(args.output, samples)
    page = report(samples, fits, pictures)
    (args.output / "report.md").write_text(page)
    print(f"\n{page}")


Job = tuple[int, Callable[[], Scene], int]  # size, its scene, threads (0 for all)


def axes(args: argparse.Namespace) -> dict[str, list[Job]]:
    """What is to be measured: sizes of each axis."""
    few = partial(balls_and_lamps, FEW_TRIANGLES)
    return {
        "triangles": [(n, partial(balls_and_lamps, n, 1, SIDE), 0) for n in powers(10**3, args.most_triangles, 10)],
        "lights": [(n, partial(few, n, SIDE), 0) for n in powers(1, args.most_lights, 10)],
        "pixels": [(side * side, partial(few, 1, side), 0) for side in powers(256, args.most_side, 2)],
        "threads": [(n, partial(few, 1, 2 * SIDE), n) for n in range(1, args.most_threads + 1)],
    }


def powers(first: int, last: int, factor: int) -> list[int]:
    """first, first * factor, ... up to last; raises Error where there are none."""
    if last < first:
        raise Error(f"sizes up to {last}: the least is {first}")
    result = [first]
    while result[-1] * factor <= last:
        result.append(result[-1] * factor)
    return result


def measured(axis: str, size: int, scene: Callable[[], Scene], threads: int, seconds: float) -> Sample:
    """One size in a new process; raises Error where that ends, for lack of memory for example."""
    context = multiprocessing.get_context("spawn")
    mine, other = context.Pipe()
    process = context.Process(target=_measure, args=(other, axis, size, scene, threads, seconds), daemon=True)
    process.start()
    other.close()
    try:
        answer = mine.recv()
    except EOFError:
        process.join()
        raise Error(f"{size} {axis}: the process ended, exit code {process.exitcode}") from None
    process.join()
    if isinstance(answer, str):
        raise Error(f"{size} {axis}: {answer}")
    sample: Sample = answer
    print(
        f"{size} {axis}: built in {sample.build:.3g} s, {sample.iteration:.3g} s an iteration, "
        f"{sample.core / 2**20:.0f} MiB in the core, {sample.process / 2**20:.0f} MiB in the process",
        flush=True,
    )
    return sample


def _measure(
    pipe: Connection,
    axis: str,
    size: int,
    make: Callable[[], Scene],
    threads: int,
    seconds: float,
) -> None:
    try:
        pipe.send(measure(axis, size, make(), threads, seconds))
    except (Error, MemoryError) as error:
        pipe.send(str(error) or type(error).__name__)


def measure(axis: str, size: int, scene: Scene, threads: int, seconds: float) -> Sample:
    """Iterations for at least so many seconds, after a first one, which warms up and does not count."""
    started = time.process_time()
    renderer = Renderer(scene, RenderSettings(samples=1 << 30, threads=threads))
    build_processor = time.process_time() - started
    renderer.iterate(1)
    started = time.process_time()
    clock = [renderer.statistics.seconds]
    while clock[-1] - clock[0] < seconds:
        renderer.iterate(1)
        clock.append(renderer.statistics.seconds)
    processor = time.process_time() - started
    fastest, taken = min(b - a for a, b in pairwise(clock)), renderer.statistics
    iterations = len(clock) - 1
    return Sample(
        axis,
        size,
        taken.build_seconds,
        fastest,
        build_processor,
        processor / iterations,
        iterations,
        taken.memory_bytes,
        peak_memory(),
    )


def fitted(axis: str, samples: Sequence[Sample]) -> list[Fit]:
    """The exponents of each cost; none where there are fewer than three sizes."""
    rows = [sample for sample in samples if sample.axis == axis]
    if len(rows) < 3:
        return []
    sizes = [row.size for row in rows]
    last = [float(size) for size in sizes[-3:]]
    result = []
    for cost, (_, value) in COSTS.items():
        costs = [value(row) for row in rows]
        log_linear = [n * float(np.log(n + 1)) for n in last]
        fit = slope(sizes, costs), slope(last, costs[-3:]), slope(log_linear, costs[-3:])
        result.append(Fit(axis, cost, *fit))
    return result


def serial_share(samples: Sequence[Sample]) -> float | None:
    """The share of the work that one thread alone does, by Amdahl's law over the measured threads; None for one."""
    rows = [sample for sample in samples if sample.axis == "threads"]
    if len(rows) < 2:
        return None
    # time(p) / time(1) = serial + (1 - serial) / p, by least squares in serial
    ratio = np.array([row.iteration / rows[0].iteration for row in rows[1:]])
    inverse = np.array([1 / row.size for row in rows[1:]])
    serial = float(np.sum((ratio - inverse) * (1 - inverse)) / np.sum((1 - inverse) ** 2))
    return min(max(serial, 0.0), 1.0)


# What is written


def _row(sample: Sample) -> dict[str, Cell]:
    return {
        "axis": sample.axis,
        "size": sample.size,
        "build_seconds": sample.build,
        "iteration_seconds": sample.iteration,
        "build_processor_seconds": sample.build_processor,
        "iteration_processor_seconds": sample.processor,
        "iterations": sample.iterations,
        "core_bytes": sample.core,
        "process_bytes": sample.process,
    }


def report(samples: Sequence[Sample], fits: Sequence[Fit], pictures: Sequence[str]) -> str:
    """The page, in Markdown."""
    worse = [f"{fit.cost} over {fit.axis} (n log n to the power {fit.against:.2f})" for fit in fits if fit.worse]
    parts = [
        "# How costs grow",
        f"{machine()}\n\nBALANCED mode, a room with 48 bumpy balls; {FEW_TRIANGLES} triangles, one lamp and {SIDE} x "
        f"{SIDE} pixels where these do not grow, {2 * SIDE} x {2 * SIDE} for threads.",
        "Grows faster than n log n: " + ("; ".join(worse) if worse else "nothing") + ".",
    ]
    for axis in dict.fromkeys(sample.axis for sample in samples):
        lines = [[str(s.size), *(number(value(s)) for _, value in COSTS.values())] for s in samples if s.axis == axis]
        parts.append(markdown_table([axis, *(text for text, _ in COSTS.values())], lines))
        lines = [
            [f.cost, f"{f.overall:.2f}", f"{f.late:.2f}", f"{f.against:.2f}", "WORSE" if f.worse else "no"]
            for f in fits
            if f.axis == axis
        ]
        if lines:
            head = [
                f"exponent over {axis}",
                "all sizes",
                "last three",
                "last three, over n log n",
                "worse than n log n",
            ]
            parts.append(markdown_table(head, lines))
    parts.append(_threads(samples))
    parts.append("\n\n".join(f"![{name}]({name})" for name in pictures))
    return "\n\n".join(part for part in parts if part) + "\n"


def _threads(samples: Sequence[Sample]) -> str:
    serial = serial_share(samples)
    if serial is None:
        return ""
    projected = ", ".join(f"{p}: {1 / (serial + (1 - serial) / p):.1f}" for p in PROJECTED)
    if busy():
        return "The machine had other work: how well threads share an iteration cannot be told."
    return (
        f"Amdahl: {serial:.1%} of an iteration is serial. Projected speed over one thread, which supposes that memory "
        f"keeps up: {projected}."
    )


def draw(folder: Path, samples: Sequence[Sample]) -> list[str]:
    """A file for each axis: time and memory side by side, with a line of n log n through the last size."""
    names = []
    for axis in dict.fromkeys(sample.axis for sample in samples):
        rows = [sample for sample in samples if sample.axis == axis]
        if len(rows) < 2:
            continue
        sizes = [float(row.size) for row in rows]
        panels = []
        for title, costs in (
            ("time, s", ("build", "iteration", "build_processor", "processor")),
            ("memory, MiB", ("core", "process")),
        ):
            lines = [plots.Series(COSTS[c][0], sizes, [COSTS[c][1](row) for row in rows]) for c in costs]
            if axis != "threads":
                last = max(line.y[-1] for line in lines) / (sizes[-1] * np.log(sizes[-1] + 1))
                curve = [float(last * n * np.log(n + 1)) for n in sizes]
                lines.append(plots.Series("n log n", sizes, curve, "--", "gray"))
            panels.append((plots.Axes(f"{axis}: {title}", axis, title, log_x=True, log_y=True), lines))
        names.append(f"{axis}.png")
        plots.plots(folder / names[-1], panels)
    return names

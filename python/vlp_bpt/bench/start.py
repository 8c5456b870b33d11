"""`vlp-bpt bench start`: time and memory from Blender's scene to the first iteration, beside Cycles.

Each start is in a process of its own, by turns. Ours has the export, the checks, the upload and the building of the
tree; Cycles' its synchronisation and its tree. CSV and a page, report.md, with medians and ratios of neighbours.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from vlp_bpt.errors import Error

from .remote import apart
from .report import Cell, machine, markdown_table, number, write_csv
from .scenes import find_scene
from .start_engines import CYCLES, ENGINES, OURS, Start, start

MOST_TIME, MOST_MEMORY = 1.0, 1.2  # times Cycles'


@dataclass(frozen=True)
class Cost:
    """Something that starts are compared by; most: times Cycles' that ours may take, None for what has no limit."""

    name: str
    of: Callable[[Start], float | None]
    most: float | None


COSTS = [
    Cost("seconds", lambda s: s.seconds, MOST_TIME),
    Cost("processor time, s", lambda s: s.processor, MOST_TIME),
    Cost("memory at most, MiB", lambda s: None if s.peak is None else s.peak / 2**20, MOST_MEMORY),
    Cost("memory at the first iteration, MiB", lambda s: None if s.held is None else s.held / 2**20, None),
]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `vlp-bpt bench start`."""
    every = os.cpu_count() or 1
    parser.add_argument("scene", nargs="?", default="million", help="a .blend, or the name of one in scenes/")
    parser.add_argument("--runs", type=int, default=5, help="starts of each engine (default: 5)")
    parser.add_argument("--threads", type=int, nargs="+", default=sorted({1, every}), help="default: 1, and all")
    parser.add_argument("--size", type=int, default=32, help="of the picture, in pixels (default: 32)")
    parser.add_argument("--output", type=Path, default=Path("out/bench-start"), help="default: out/bench-start")


def run(args: argparse.Namespace) -> None:
    """Measures everything and writes it to the folder `output`."""
    if args.runs < 1 or min(args.threads) < 1:
        raise Error("--runs and --threads must be at least 1")
    path = find_scene(args.scene)
    if path.suffix != ".blend":
        raise Error(f"'{path}': only a .blend can be started by both")
    args.output.mkdir(parents=True, exist_ok=True)
    starts: list[Start] = []
    for threads in args.threads:
        for turn in range(args.runs):
            for engine in ENGINES if turn % 2 == 0 else ENGINES[::-1]:
                starts.append(apart(engine, start, engine, path.resolve(), threads, args.size))
                print(line_of(starts[-1]), flush=True)
    write_csv(args.output / "start.csv", [_row(s) for s in starts])
    page = report(path.stem, args.size, starts)
    (args.output / "report.md").write_text(page)
    print(f"\n{page}")


def line_of(s: Start) -> str:
    """One start, in words."""
    memory = "" if s.peak is None else f", {s.peak / 2**20:.0f} MiB"
    return f"{s.engine}, {s.threads} threads: {s.seconds:.3f} s, {s.processor:.3f} s of processor time{memory}"


def ratio(cost: Cost, ours: Sequence[Start], theirs: Sequence[Start]) -> float | None:
    """The median over pairs of neighbours, as a machine differs from hour to hour; None for what is not known."""
    pairs = [(cost.of(a), cost.of(b)) for a, b in zip(ours, theirs, strict=True)]
    ratios = [a / b for a, b in pairs if a is not None and b]
    return median(ratios) if ratios else None


def verdict(cost: Cost, value: float | None) -> str:
    """Whether ours keeps to what it may take."""
    if cost.most is None or value is None:
        return "-"
    return f"{cost.most:g}: {'yes' if value <= cost.most else 'NO'}"


# What is written


def report(scene: str, size: int, starts: Sequence[Start]) -> str:
    """The page, in Markdown."""
    parts = [
        "# From Blender's scene to the first iteration",
        f"{machine()}\n\nThe scene {scene} at {size} x {size} pixels, from the call that hands an engine Blender's "
        f"depsgraph to its first iteration or sample: medians of {len(starts) // _count(starts)} starts, each in a "
        "process of its own after a start of Blender's default scene. Memory is what the process had more than before, "
        "with what Blender itself took for the render, which is alike. Ratios are medians over pairs of neighbours.",
    ]
    for threads in dict.fromkeys(s.threads for s in starts):
        ours, theirs = ([s for s in starts if (s.engine, s.threads) == (e, threads)] for e in (OURS, CYCLES))
        rows = []
        for cost in COSTS:
            medians = [number(_median(cost.of, some)) for some in (ours, theirs)]
            value = ratio(cost, ours, theirs)
            rows.append([cost.name, *medians, number(value), verdict(cost, value)])
        name = f"{threads} thread{'s' if threads > 1 else ''}"
        parts.append(markdown_table([name, OURS, CYCLES, "ratio", "at most"], rows))
        parts.append("\n".join(f"{some[0].engine}: {_parts_text(some)}." for some in (ours, theirs) if some))
    return "\n\n".join(parts) + "\n"


def _count(starts: Sequence[Start]) -> int:
    return len({(s.engine, s.threads) for s in starts})


def _median(of: Callable[[Start], float | None], starts: Sequence[Start]) -> float | None:
    values = [value for s in starts if (value := of(s)) is not None]
    return median(values) if values else None


def _parts_text(starts: Sequence[Start]) -> str:
    names = list(dict.fromkeys(name for s in starts for name in s.parts))
    seconds = [median(s.parts.get(name, 0.0) for s in starts) for name in names]
    rest = median(s.seconds - sum(s.parts.values()) for s in starts)
    return ", ".join(
        f"{name} {value:.3f} s" for name, value in zip([*names, "the rest"], [*seconds, rest], strict=True)
    )


def _row(s: Start) -> dict[str, Cell]:
    return {
        "engine": s.engine,
        "threads": s.threads,
        "seconds": s.seconds,
        "processor_seconds": s.processor,
        "peak_bytes": s.peak,
        "held_bytes": s.held,
        "parts": "; ".join(f"{name} {value:.4f}" for name, value in s.parts.items()),
    }

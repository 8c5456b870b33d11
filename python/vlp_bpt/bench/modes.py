"""`vlp-bpt bench modes`: speed and error over time of the modes, beside Cycles in the same process."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from vlp_bpt import metrics
from vlp_bpt.scene import Scene
from vlp_bpt.settings import MODE_PRESETS, Mode, RenderSettings

from .contestants import Contestant, Cycles, Ours, race
from .references import our_halves
from .report import markdown_table
from .scenes import find_scene, load_scene, mesh_variant

ROUNDS = 6
CHECKPOINTS = (1, 3, 6)  # rounds after which the error is taken
MESH_LEVELS = 4


@dataclass
class Row:
    """One line of the table; error: (seconds, relMSE, SSIM) at the checkpoints; rate: eye samples/s over the slices."""

    scene: str
    name: str
    window: str
    seconds: float
    iterations_per_second: float | None
    rate: float
    rate_range: tuple[float, float]
    error: list[tuple[float, float, float]]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `vlp-bpt bench`."""
    parser.add_argument(
        "--scenes",
        nargs="+",
        default=["cornell_box", "sierpinski"],
        metavar="SCENE",
        help="names of files in scenes/, or .blend or .vlp.npz files (default: cornell_box sierpinski)",
    )
    parser.add_argument("--size", type=int, default=512, help="width in pixels (default: 512)")
    parser.add_argument("--seconds", type=float, default=30.0, help="render time of each contestant (default: 30)")
    parser.add_argument(
        "--reference-seconds",
        type=float,
        default=0.0,
        help="render time of each half of the reference, kept in out/references (default: ten times --seconds)",
    )
    parser.add_argument("--threads", type=int, default=0, help="0 for all (default)")
    parser.add_argument("--no-cycles", action="store_true", help="leave Cycles out; needs no bpy for .vlp.npz files")
    parser.add_argument("--json", type=Path, help="also write the figures to this file")


def run(args: argparse.Namespace) -> None:
    """Run the benchmark and print its table."""
    rows: list[Row] = []
    for name in args.scenes:
        rows += bench_scene(find_scene(name), args)
    print(f"\n{conditions(args)}\n\n{table(rows)}")
    if args.json:
        args.json.write_text(json.dumps([asdict(row) for row in rows], indent=1))


def bench_scene(path: Path, args: argparse.Namespace) -> list[Row]:
    """Race everything on one scene against a converged reference."""
    scene = load_scene(path, args.size)
    seconds = args.reference_seconds or 10 * args.seconds
    halves = our_halves(path.stem, scene, {"mode": Mode.REFERENCE, "threads": args.threads}, seconds)
    contestants = entries(path, scene, args)
    errors: dict[str, list[tuple[float, float, float]]] = {c.name: [] for c in contestants}

    def observe(contestant: Contestant, index: int) -> None:
        if index + 1 in CHECKPOINTS:
            picture = contestant.picture()
            error = metrics.rel_mse_corrected(picture, *halves), metrics.ssim_corrected(picture, *halves)
            errors[contestant.name].append((contestant.seconds, *error))
            print(f"{path.stem}: {contestant.name}, {contestant.seconds:.1f} s, relMSE {error[0]:.3g}", flush=True)

    race(contestants, [args.seconds * (i + 1) / ROUNDS for i in range(ROUNDS)], observe)
    return [
        Row(
            path.stem,
            c.name,
            c.window,
            c.seconds,
            None if c.iterations is None else c.iterations / c.seconds,
            c.eye_samples / c.seconds,
            (min(c.rates), max(c.rates)),
            errors[c.name],
        )
        for c in contestants
    ]


def entries(path: Path, scene: Scene, args: argparse.Namespace) -> list[Contestant]:
    """Who takes part. Path tracing alone is BALANCED without light paths. Cycles has its eye path length, and both end
    walks by roulette. Point clouds come a second time as meshes: inside glass Cycles' points are not spheres.
    """
    common: dict[str, Any] = {"samples": 1 << 30, "threads": args.threads}
    longest = MODE_PRESETS[Mode.BALANCED].eye_path_length
    without = RenderSettings(light_path_length=0, vlp_connections=0, **common)
    result: list[Contestant] = [
        Ours("PAPER", scene, RenderSettings(mode=Mode.PAPER, **common)),
        Ours("BALANCED", scene, RenderSettings(mode=Mode.BALANCED, **common)),
        Ours("REFERENCE", scene, RenderSettings(mode=Mode.REFERENCE, **common)),
        Ours("path tracing alone", scene, without),
    ]
    if args.no_cycles or path.suffix == ".npz":
        return result
    size = (scene.film.width, scene.film.height)
    result.append(Cycles("Cycles", path, size, longest, args.threads))
    if path.stem == "sierpinski":
        meshes = mesh_variant(path, MESH_LEVELS)
        result.append(Cycles("Cycles, spheres as meshes", meshes, size, longest, args.threads))
    return result


def conditions(args: argparse.Namespace) -> str:
    """What was measured and how, in a sentence or two above the table."""
    return (
        f"{args.size} pixels wide, {args.seconds:g} s each in {ROUNDS} slices by turns; time is rendering alone,\n"
        "reading and preparing the scene left out. relMSE and SSIM are against a REFERENCE picture, less its noise.\n"
        "K, L: most surface hits of eye and light paths; C: VLP connections. Cycles' bounces are those of K; its\n"
        "adaptive sampling, clamps, denoiser and light tree are off."
    )


def table(rows: list[Row]) -> str:
    """The rows as a Markdown table."""
    count = max(len(row.error) for row in rows)
    head = ["scene", "", "window", "iterations/s", "M eye samples/s (slices)", "after: relMSE / SSIM"]
    head += [""] * (count - 1)
    lines: list[list[str]] = []
    for row in rows:
        low, high = (rate / 1e6 for rate in row.rate_range)
        iterations = "" if row.iterations_per_second is None else f"{row.iterations_per_second:.2f}"
        errors = [f"{seconds:.1f} s: {error:.2e} / {ssim:.4f}" for seconds, error, ssim in row.error]
        rate = f"{row.rate / 1e6:.2f} ({low:.2f}-{high:.2f})"
        lines.append([row.scene, row.name, row.window, iterations, rate, *errors])
    return markdown_table(head, lines)

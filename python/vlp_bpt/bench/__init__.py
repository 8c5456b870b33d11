"""`vlp-bpt bench`: speed and error over time of the modes, beside Cycles in the same process."""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vlp_bpt import metrics
from vlp_bpt._blender import capture_blend
from vlp_bpt.errors import Error
from vlp_bpt.render import Renderer, load_native
from vlp_bpt.scene import Film, Scene
from vlp_bpt.settings import MODE_PRESETS, Mode, RenderSettings
from vlp_bpt.snapshot import load_snapshot, scene_digest

from .contestants import Contestant, Cycles, Ours, race
from .references import FOLDER, batches, fingerprint

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


def main(args: argparse.Namespace | Sequence[str] | None = None) -> int:
    """Run the benchmark and print its table; returns the exit code, 1 for a scene that cannot be rendered."""
    if not isinstance(args, argparse.Namespace):
        parser = argparse.ArgumentParser(prog="vlp-bpt bench", description=__doc__)
        add_arguments(parser)
        args = parser.parse_args(args)
    rows: list[Row] = []
    try:
        for name in args.scenes:
            rows += bench_scene(find_scene(name), args)
    except Error as error:
        print(f"vlp-bpt: {error}", file=sys.stderr)
        return 1
    print(f"\n{conditions(args)}\n\n{table(rows)}")
    if args.json:
        args.json.write_text(json.dumps([asdict(row) for row in rows], indent=1))
    return 0


def find_scene(name: str) -> Path:
    """A file by its path, or by its name in `scenes/` here or in the source tree."""
    root = Path(__file__).resolve().parents[3]
    for path in (Path(name), Path("scenes") / f"{name}.blend", root / "scenes" / f"{name}.blend"):
        if path.is_file():
            return path
    raise Error(f"scene '{name}': there is neither such a file nor scenes/{name}.blend")


def load_scene(path: Path, size: int) -> Scene:
    """The scene of a .blend (needs bpy) or snapshot file, `size` pixels wide and as high as its shape asks."""
    if path.suffix == ".npz":
        scene = load_snapshot(path).scene
    else:
        snapshot, warnings = capture_blend(path, None, {})
        scene = snapshot.scene
        for warning in warnings:
            print(f"{path.stem}: {warning}")
    height = max(1, round(size * scene.film.height / scene.film.width))
    scene.film = Film(size, height)
    return scene


def bench_scene(path: Path, args: argparse.Namespace) -> list[Row]:
    """Race everything on one scene against a converged reference."""
    scene = load_scene(path, args.size)
    halves = reference_halves(path.stem, scene, args.reference_seconds or 10 * args.seconds, args.threads)
    contestants = entries(path, scene, args)
    errors: dict[str, list[tuple[float, float, float]]] = {c.name: [] for c in contestants}

    def observe(contestant: Contestant, index: int) -> None:
        if index + 1 in CHECKPOINTS:
            picture = contestant.picture()
            error = metrics.rel_mse_corrected(picture, *halves), metrics.ssim_corrected(picture, *halves)
            errors[contestant.name].append((contestant.seconds, *error))
            print(f"{path.stem}: {contestant.name}, {contestant.seconds:.1f} s, relMSE {error[0]:.3g}", flush=True)

    race(contestants, args.seconds, ROUNDS, observe)
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


def mesh_variant(path: Path, levels: int) -> Path:
    """The Sierpinski scene with meshes for spheres, written by the script that lies beside it, once."""
    output = Path("out") / f"sierpinski_mesh_{levels}.blend"
    if not output.exists():
        output.parent.mkdir(exist_ok=True)
        script = path.with_suffix(".py")
        command = [sys.executable, str(script), "--mesh", str(output), "--levels", str(levels)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return output


def reference_halves(
    name: str, scene: Scene, seconds: float, threads: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Two independent REFERENCE pictures (h, w, 3), top row first, of `seconds` each; made once and kept."""
    key = fingerprint([native_file()], {"scene": scene_digest(scene), "seconds": seconds})

    def make(index: int) -> NDArray[np.float32]:
        print(f"{name}: reference, half {index + 1} of 2, {seconds:.0f} s, kept in {FOLDER}/", flush=True)
        settings = RenderSettings(
            mode=Mode.REFERENCE, samples=1 << 30, time_limit=seconds, seed=1001 + index, threads=threads
        )
        return np.ascontiguousarray(Renderer(scene, settings).render().pixels[::-1, :, :3])

    first, second = batches(f"{name}-reference", key, 2, make)
    return first.astype(np.float64), second.astype(np.float64)


def native_file() -> Path:
    """The native core's file: what a kept picture of ours depends on besides its scene and settings."""
    return Path(load_native()._module.__file__)


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
    widths = [max(len(line[i]) for line in [head, *lines]) for i in range(len(head))]
    rule = ["-" * width for width in widths]
    return "\n".join(
        "| " + " | ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)) + " |"
        for line in [head, rule, *lines]
    )

"""Error over time with Open Image Denoise, ours beside Cycles.

Each render starts anew and is denoised once at its end; seconds are of both, without reading and preparing the scene.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vlp_bpt import metrics
from vlp_bpt.render import Renderer
from vlp_bpt.scene import Scene
from vlp_bpt.settings import MODE_PRESETS, Mode, RenderSettings

from . import cycles
from .references import our_halves
from .scenes import find_scene, load_scene

Halves = tuple[NDArray[np.float64], NDArray[np.float64]]
Render = Callable[[int], tuple[float, NDArray[np.float32]]]  # samples -> seconds, (h, w, 3 or more) top row first


@dataclass(frozen=True)
class Point:
    """One render; error is less the reference's noise."""

    name: str
    samples: int
    seconds: float
    rel_mse: float
    ssim: float


def contestants(path: Path, scene: Scene, threads: int) -> dict[str, Render]:
    """With their guides denoised first, and without."""
    scatterings = MODE_PRESETS[Mode.BALANCED].eye_path_length

    def ours(samples: int, prefilter: bool) -> tuple[float, NDArray[np.float32]]:
        settings = RenderSettings(samples=samples, threads=threads, denoise=True, denoise_prefilter=prefilter)
        renderer = Renderer(scene, settings)
        pixels = renderer.render().pixels
        return renderer.statistics.seconds + renderer.statistics.denoise_seconds, pixels[::-1]

    def theirs(samples: int, prefilter: bool) -> tuple[float, NDArray[np.float32]]:
        opened = cycles.open_scene(path)
        cycles.set_size(opened, scene.film.width, scene.film.height)
        denoise_by_cycles(opened.cycles, prefilter)
        image = cycles.render(opened, samples=samples, scatterings=scatterings, threads=threads)
        return image.seconds, image.pixels

    return {
        "BALANCED": lambda samples: ours(samples, False),
        "BALANCED, prefilter": lambda samples: ours(samples, True),
        "Cycles": lambda samples: theirs(samples, False),
        "Cycles, prefilter": lambda samples: theirs(samples, True),
    }


def denoise_by_cycles(settings: Any, prefilter: bool) -> None:
    """On the processor, with albedo and normal, in its best quality: what this renderer does."""
    settings.use_denoising, settings.denoiser, settings.denoising_use_gpu = True, "OPENIMAGEDENOISE", False
    settings.denoising_input_passes = "RGB_ALBEDO_NORMAL"
    settings.denoising_prefilter = "ACCURATE" if prefilter else "NONE"
    settings.denoising_quality = "HIGH"


def measure(renders: dict[str, Render], halves: Halves, most_samples: int, ssim: float) -> list[Point]:
    """1, 2, 4 ... samples by turns, each contestant until it has that SSIM."""
    points: list[Point] = []
    racing, samples = list(renders), 1
    while racing and samples <= most_samples:
        for name in list(racing):
            seconds, pixels = renders[name](samples)
            picture = pixels[..., :3].astype(np.float64)
            errors = metrics.rel_mse_corrected(picture, *halves), metrics.ssim_corrected(picture, *halves)
            points.append(Point(name, samples, seconds, *errors))
            print(f"{name}, {samples}: {seconds:.2f} s, relMSE {errors[0]:.2e}, SSIM {errors[1]:.5f}", flush=True)
            if errors[1] >= ssim:
                racing.remove(name)
        samples *= 2
    return points


def seconds_to(points: list[Point], ssim: float) -> float | None:
    """Between the last render below that SSIM and the first above, straight over log(1 - SSIM); None where none is."""
    below = None
    for point in points:
        if point.ssim >= ssim:
            if below is None:
                return point.seconds
            gap = [np.log(max(1 - p, 1e-6)) for p in (below.ssim, ssim, point.ssim)]
            return float(below.seconds + (point.seconds - below.seconds) * (gap[1] - gap[0]) / (gap[2] - gap[0]))
        below = point
    return None


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of this benchmark."""
    parser.add_argument("scene", nargs="?", default="cornell_box", help="a file, or the name of one in scenes/")
    parser.add_argument("--size", type=int, default=512, help="width in pixels (default: 512)")
    parser.add_argument("--ssim", type=float, default=0.998, help="to be reached (default: 0.998)")
    parser.add_argument("--samples", type=int, default=256, help="most to try (default: 256)")
    parser.add_argument("--reference-seconds", type=float, default=300.0, help="of each half (default: 300)")
    parser.add_argument("--threads", type=int, default=0, help="0 for all (default)")


def run(options: argparse.Namespace) -> None:
    """Prints each render and, per contestant, the seconds to an SSIM."""
    path = find_scene(options.scene)
    scene = load_scene(path, options.size)
    halves = our_halves(
        path.stem, scene, {"mode": Mode.REFERENCE, "threads": options.threads}, options.reference_seconds
    )
    renders = contestants(path, scene, options.threads)
    points = measure(renders, halves, options.samples, options.ssim)
    for name in renders:
        seconds = seconds_to([point for point in points if point.name == name], options.ssim)
        print(f"{name}: SSIM {options.ssim:g} " + ("not reached" if seconds is None else f"after {seconds:.1f} s"))

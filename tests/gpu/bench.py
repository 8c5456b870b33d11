"""bench.py OUT: what the device makes in a second and how soon pictures are good, as OUT/gpu.json and a table.

Iterations a second of each scene and mode at 512 x 512, on a GPU with either form of the eye pass and with the one that
is found to be faster; in PAPER mode also the seconds to the SSIM that the paper gives (Celestino et al. 2014, 5.1),
against a long render of the same window: SSIM of sRGB-encoded, clipped pictures. And how long it takes from another
camera to the first picture of it, as while someone looks around.
"""

from __future__ import annotations

import json
import os
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from on_device import DEVICE, FORM, SCENES, load

from vlp_bpt import Renderer, RenderSettings, devices, metrics
from vlp_bpt.scene import Film

SECONDS = 1.5
RUNS = ((DEVICE, "paths"), (DEVICE, "wavefront"), (DEVICE, ""), ("HYBRID", ""), ("CPU", ""))
if DEVICE == "CPU":
    RUNS = RUNS[-1:]
MARKS = {"cornell_box": (0.90, 0.97, 0.998), "sierpinski": (0.93, 0.97, 0.998)}


def timed(
    name: str, mode: str, device: str = DEVICE, seconds: float = SECONDS, seed: int = 0, form: str = ""
) -> tuple[Renderer, dict[str, float]]:
    """Rendered for `seconds`, after some iterations that choose the form of the eye pass and warm up; and its rates."""
    os.environ[FORM] = form
    settings = {"samples": 1 << 30, "time_limit": seconds, "device": device, "mode": mode, "seed": seed}
    renderer = Renderer(load(name, Film(512, 512)), RenderSettings.from_dict(settings))
    renderer.iterate(6)
    before = renderer.statistics
    renderer.render()  # in one go: `iterate` throws away what a second device has begun
    after = renderer.statistics
    rates = {
        f"{what}_per_second": (getattr(after, what) - getattr(before, what)) / (after.seconds - before.seconds)
        for what in ("iterations", "eye_samples")
    }
    return renderer, rates


def seconds_to_ssim(name: str, marks: tuple[float, ...]) -> dict[str, float | None]:
    """By renders of 1, 2, 4, ... iterations, between which the logarithms are interpolated; None where not reached."""
    reference = timed(name, "PAPER", seconds=6 * SECONDS, seed=1)[0].read()[..., :3]
    found: list[tuple[float, float]] = []
    if DEVICE != "CPU":  # short renders have no time to choose
        os.environ[FORM] = timed(name, "PAPER", seconds=0.1)[0].statistics.eye_form
    for count in (2**i for i in range(20)):
        renderer = Renderer(
            load(name, Film(512, 512)), RenderSettings.from_dict({"samples": count, "device": DEVICE, "mode": "PAPER"})
        )
        started = time.perf_counter()
        renderer.iterate(count)
        seconds = time.perf_counter() - started
        found.append((metrics.ssim(renderer.read()[..., :3], reference), seconds))
        if found[-1][0] > marks[-1] or seconds > 2 * SECONDS:
            break
    ssims, times = np.array(found).T
    return {
        str(mark): float(np.exp(np.interp(mark, ssims, np.log(times)))) if ssims.max() >= mark else None
        for mark in marks
    }


def first_picture(name: str) -> dict[str, float]:
    """Seconds from an update with another camera to the picture of one iteration, in BALANCED mode: median and most."""
    renderer, _ = timed(name, "BALANCED", seconds=0.1)
    taken = []
    for i in range(20):
        scene = load(name, Film(512, 512))
        assert scene.camera is not None
        scene.camera.half_width *= 1 - 0.01 * i
        started = time.perf_counter()
        renderer.update(replace(renderer._known, camera=scene.camera))
        renderer.iterate(1)
        renderer.read()
        taken.append(time.perf_counter() - started)
    return {"median": float(np.median(taken)), "most": max(taken)}


def main(out: str) -> None:
    modes = ("PAPER", "BALANCED", "REFERENCE")
    rows: list[dict[str, Any]] = []
    ssim: dict[str, dict[str, float | None]] = {}
    first: dict[str, dict[str, float]] = {}

    def save() -> None:  # what there is, should the time be up
        report = {"devices": devices(), "rates": rows, "seconds_to_ssim": ssim, "seconds_to_first_picture": first}
        (Path(out) / "gpu.json").write_text(json.dumps(report, indent=1))

    print("| scene | mode | device | eye pass | iterations/s | M eye samples/s |\n|---|---|---|---|---|---|")
    for name in SCENES:
        for mode in modes:
            for device, form in RUNS:
                renderer, rates = timed(name, mode, device, form=form)
                taken = renderer.statistics
                row = {"scene": name, "mode": mode, "device": device, "eye_form": taken.eye_form, "chosen": not form}
                rows.append({**row, **rates, "memory": taken.memory, "warnings": renderer.warnings})
                save()
                eye_pass = taken.eye_form + (", chosen" if not form and device != "CPU" else "")
                told = f"{rates['iterations_per_second']:.1f} | {rates['eye_samples_per_second'] / 1e6:.2f}"
                print(f"| {name} | {mode} | {device} | {eye_pass} | {told} |", flush=True)
    print("\n| scene | ms from another camera to its first picture: median, most |\n|---|---|")
    for name in SCENES:
        seconds = first[name] = first_picture(name)
        save()
        print(f"| {name} | {1e3 * seconds['median']:.1f}, {1e3 * seconds['most']:.1f} |", flush=True)
    print("\n| scene | seconds to SSIM |\n|---|---|")
    for name, marks in MARKS.items():
        found = ssim[name] = seconds_to_ssim(name, marks)
        save()
        print(f"| {name} | {', '.join(f'{mark}: {seconds}' for mark, seconds in found.items())} |", flush=True)


if __name__ == "__main__":
    main(sys.argv[1])

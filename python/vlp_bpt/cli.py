"""The command line: `vlp-bpt render | export | info | compare | merge | denoise | bench`."""

from __future__ import annotations

import argparse
import importlib
import json
import os
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from . import __version__, metrics
from ._options import (
    USAGE,
    UsageError,
    iterations,
    make_parser,
    resolution,
    scene_kind,
    setting_values,
    with_mode_first,
)
from ._progress import ProgressDisplay, lost_light_text, summary_text
from .denoise import denoise
from .errors import Cancelled, DeviceError, Error, SceneError
from .images import ALBEDO, NOISY, NORMAL, check_output, read_image, write_image
from .memory import memory_lines, total_text
from .merge import merge_images
from .render import Progress, Renderer, devices, load_native, native_errors
from .scene import Film, Mesh, Scene
from .settings import RenderSettings
from .snapshot import SUFFIX, Snapshot, load_snapshot, save_snapshot, scene_digest
from .strategies import SHEET, make_folder, render_strategies, write_strategies
from .upload import upload

FAILED, INTERRUPTED = 1, 130  # exit codes, besides USAGE


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command and returns its exit code: 0, 1 (it failed), 2 (it was asked wrongly), 130 (interrupted)."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    if arguments[:1] == ["bench"]:
        return _bench(arguments[1:])
    options = make_parser(_COMMANDS).parse_args(arguments)
    try:
        return int(options.run(options))
    except (SceneError, DeviceError) as error:
        return _fail(error, FAILED)
    except (KeyboardInterrupt, Cancelled):  # with no iteration complete there is no picture
        print("vlp-bpt: interrupted", file=sys.stderr)
        return INTERRUPTED
    except Error as error:
        return _fail(error, USAGE)
    except BrokenPipeError:  # standard output was closed, as by `| head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return FAILED


def _fail(error: Error, code: int) -> int:
    print(f"vlp-bpt: {error}", file=sys.stderr)
    return code


# Commands


def _render(options: argparse.Namespace) -> int:
    kind = scene_kind(options.file)
    if options.debug_strategies is not None:
        return _render_strategies(options, kind)
    if options.output is None:
        raise UsageError("the following arguments are required: -o/--output")
    check_output(options.output, options.depth)
    values = setting_values(options)
    range_ = iterations(options)
    if range_ is not None:
        if values.get("noise_threshold"):
            raise UsageError("--iterations says how many iterations to render: leave the noise threshold out")
        if values.get("adaptive"):
            raise UsageError("--iterations needs the same samples wherever they are made: leave adaptive out")
        values |= {"samples": range_[1] - range_[0], "noise_threshold": 0.0, "adaptive": False}
    if kind == "blend" and range_ is None:
        return _render_blend(options, values)
    snapshot, warnings, settings = _scene_to_render(options, kind, values)
    first = range_[0] if range_ is not None else 0
    renderer = Renderer(snapshot.scene, settings, first_iteration=first)
    warnings += renderer.warnings
    _warn(warnings)
    with ProgressDisplay(quiet=options.quiet) as display:
        _tell_memory(options, renderer)
        image = renderer.render(lambda progress: display.show(renderer, progress))
    _warn([warning for warning in renderer.warnings if warning not in warnings])  # of a device that has failed
    image.metadata["source"] = snapshot.metadata | {"file": options.file.name}
    if range_ is not None:
        image.metadata["scene"] = scene_digest(snapshot.scene)
        image.film_state = renderer.film_state()
    write_image(options.output, image, options.depth)
    return _finish(options.output, renderer)


def _scene_to_render(
    options: argparse.Namespace, kind: str, values: dict[str, Any]
) -> tuple[Snapshot, list[str], RenderSettings]:
    """The scene of the file, warnings about it, and its settings with `values` over them."""
    if kind == "blend":
        snapshot, warnings = _capture(options.file, options.frame, values)
    else:
        if options.frame is not None:
            raise UsageError("--frame is for .blend files: a snapshot holds one frame")
        snapshot, warnings = load_snapshot(options.file), []
    settings = (snapshot.settings or RenderSettings()).to_dict()
    return snapshot, warnings, RenderSettings.from_dict(with_mode_first(settings, values))


def _render_strategies(options: argparse.Namespace, kind: str) -> int:
    for name in ("output", "iterations", "time", "noise"):
        if getattr(options, name) is not None:
            raise UsageError(f"--debug-strategies writes pictures of its own: leave --{name} out")
    make_folder(options.debug_strategies)
    snapshot, warnings, settings = _scene_to_render(options, kind, setting_values(options))
    _warn(warnings + snapshot.scene.validate())

    def report(done: int) -> None:
        if not options.quiet and sys.stderr.isatty():
            print(f"\r{done} of {settings.samples} samples", end="", file=sys.stderr, flush=True)

    pictures = render_strategies(snapshot.scene, settings, report)
    written = write_strategies(options.debug_strategies, pictures)
    print(f"{options.debug_strategies}: {len(written) - 1} pictures and {SHEET}, {pictures.iterations} samples")
    return 0


def _render_blend(options: argparse.Namespace, values: dict[str, Any]) -> int:
    from ._blender import render_blend

    told: list[Renderer] = []

    with ProgressDisplay(quiet=options.quiet) as display:

        def show(renderer: Renderer, progress: Progress) -> None:
            if renderer not in told:
                told.append(renderer)
                _tell_memory(options, renderer)
            display.show(renderer, progress)

        result = render_blend(options.file, options.output, options.depth, options.frame, values, show)
    _warn(result.warnings)
    if not result.renderers:
        raise SceneError(f"'{options.file}': Blender did not render it with VLP-BPT")
    for renderer in result.renderers:
        code = _finish(options.output, renderer)
    return code


def _export(options: argparse.Namespace) -> int:
    if scene_kind(options.file) != "blend":
        raise UsageError(f"'{options.file}': only a .blend can be exported")
    if not options.output.name.endswith(SUFFIX):
        raise UsageError(f"'{options.output}': a snapshot's name ends in {SUFFIX}")
    if not options.output.parent.is_dir():
        raise UsageError(f"'{options.output}': there is no folder '{options.output.parent}'")
    snapshot, warnings = _capture(options.file, options.frame, {})
    _warn(warnings)
    save_snapshot(options.output, snapshot)
    size = options.output.stat().st_size / 2**20
    print(f"{options.output}: {_scene_text(snapshot.scene)}, {size:.1f} MiB")
    return 0


def _info(options: argparse.Namespace) -> int:
    if options.file is None:
        print(f"VLP-BPT {__version__}")
        for device in devices():
            memory = f", {device['memory'] / 2**30:.1f} GiB" if device["memory"] else ""
            print(f"{device['kind']}: {device['name']} ({device['isa']}{memory})")
        return 0
    if options.file.suffix.lower() in (".blend", ".npz"):
        return _info_scene(options)
    if options.resolution or options.set:
        raise UsageError(f"'{options.file}': --resolution and --set are for scenes")
    image = read_image(options.file)
    height, width, _ = image.pixels.shape
    mean = ", ".join(f"{x:.5g}" for x in image.pixels[..., :3].mean(axis=(0, 1), dtype=float))
    print(f"{options.file}: {width} x {height} pixels, mean ({mean})")
    for name, value in image.metadata.items():
        print(f"  {name}: {json.dumps(value)}")
    if image.layers:
        print(f"  layers: {', '.join(image.layers)}")
    if image.film_state is not None:
        print("  holds exact sums: can be merged")
    return 0


def _info_scene(options: argparse.Namespace) -> int:
    path, values = options.file, setting_values(options)
    if scene_kind(path) == "blend":
        snapshot, warnings = _capture(path, None, values)
    else:
        snapshot, warnings = load_snapshot(path), []
    scene = snapshot.scene
    if options.resolution:
        scene.film = Film(*resolution(options.resolution), transparent=scene.film.transparent)
    warnings += [warning for warning in scene.validate() if warning not in warnings]
    x, y, width, height = scene.film.render_window
    print(f"{path}: {_scene_text(scene)}")
    print(f"  picture: {scene.film.width} x {scene.film.height} pixels, window {width} x {height} at ({x}, {y})")
    if snapshot.settings is not None:
        print(f"  settings: {json.dumps(snapshot.settings.to_dict())}")
    for name, value in snapshot.metadata.items():
        print(f"  {name}: {json.dumps(value)}")
    native_scene = load_native().Scene()
    with native_errors():
        upload(scene, native_scene)
        native_scene.build(0)
    info = native_scene.info()
    print(f"  glowing triangles and spheres: {info['emitters']}; built in {info['build_seconds']:.3f} s")
    settings = RenderSettings.from_dict(with_mode_first((snapshot.settings or RenderSettings()).to_dict(), values))
    for line in memory_lines(scene, native_scene, settings):
        print(f"  {line}")
    _warn(warnings)
    return 0


def _compare(options: argparse.Namespace) -> int:
    test, reference = read_image(options.a), read_image(options.b)
    result = metrics.compare(test.pixels, reference.pixels)
    if options.json:
        print(json.dumps(asdict(result)))
        return 0
    print(f"SSIM    {result.ssim:.6f}     1 when equal; sRGB-encoded, Gaussian window of sigma 1.5")
    print(f"FLIP    {result.flip:.6f}     0 when equal; LDR-FLIP at {metrics.PIXELS_PER_DEGREE:.0f} pixels per degree")
    print(f"relMSE  {result.rel_mse:.6g}     mean of (A - B)^2 / (B^2 + {metrics.REL_MSE_EPSILON:g})")
    means = [", ".join(f"{x:.6g}" for x in mean) for mean in (result.mean_test, result.mean_reference)]
    print(f"mean    {result.mean_difference:+.4%}     A ({means[0]}), B ({means[1]})")
    return 0


def _merge(options: argparse.Namespace) -> int:
    check_output(options.output, options.depth)
    image = merge_images(options.parts)
    if options.output.suffix.lower() != ".exr":
        image.film_state = None
    write_image(options.output, image, options.depth)
    ranges = ", ".join(f"{begin}:{end}" for begin, end in image.metadata["ranges"])
    print(f"{options.output}: {image.metadata['iterations']} iterations ({ranges})")
    return 0


def _denoise(options: argparse.Namespace) -> int:
    check_output(options.output, options.depth)
    image = read_image(options.file)
    if options.threads < 0:
        raise UsageError(f"--threads {options.threads}: must be 0, for all, or more")
    noisy = image.layers.setdefault(NOISY, image.pixels)
    guides = image.layers.get(ALBEDO), image.layers.get(NORMAL) if ALBEDO in image.layers else None
    image.pixels = denoise(noisy, *guides, prefilter=not options.no_prefilter, threads=options.threads)
    image.film_state = None  # of the noisy picture: it would go on as such in a merge
    write_image(options.output, image, options.depth)
    print(f"{options.output}: denoised with {'guides' if guides[0] is not None else 'no guides'}")
    return 0


def _bench(arguments: list[str]) -> int:
    try:
        run = importlib.import_module("vlp_bpt.bench").main
    except (ImportError, AttributeError) as error:
        return _fail(Error(f"bench: cannot be loaded ({error})"), FAILED)
    return int(run(arguments) or 0)


def _capture(path: Path, frame: int | None, values: dict[str, Any]) -> tuple[Snapshot, list[str]]:
    from ._blender import capture_blend

    return capture_blend(path, frame, values)


_COMMANDS = {
    "render": _render,
    "export": _export,
    "info": _info,
    "compare": _compare,
    "merge": _merge,
    "denoise": _denoise,
}

# Text


def _warn(warnings: list[str]) -> None:
    for warning in dict.fromkeys(warnings):
        print(f"vlp-bpt: warning: {warning}", file=sys.stderr)


def _tell_memory(options: argparse.Namespace, renderer: Renderer) -> None:
    if not options.quiet:
        print(f"{options.file}: takes {total_text(renderer.memory)}", file=sys.stderr, flush=True)


def _finish(output: Path, renderer: Renderer) -> int:
    summary = summary_text(renderer.statistics)
    if renderer.interrupted:
        print(f"{output}: {summary} (interrupted)")
        return INTERRUPTED
    print(f"{output}: {summary}{lost_light_text(*renderer.lost_light())}")
    return 0


def _scene_text(scene: Scene) -> str:
    triangles = sum(len(g.triangles) for g in scene.geometries if isinstance(g, Mesh))
    spheres = sum(len(g.centers) for g in scene.geometries if not isinstance(g, Mesh))
    counts = [
        (triangles, "triangles"),
        (spheres, "spheres"),
        (len(scene.instances), "instances"),
        (len(scene.materials), "materials"),
        (len(scene.lights), "lights"),
    ]
    return ", ".join(f"{count} {name}" for count, name in counts)

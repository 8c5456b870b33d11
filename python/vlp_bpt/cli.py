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
from typing import Any, NoReturn

from . import __version__, metrics
from ._progress import ProgressDisplay, lost_light_text, summary_text
from .denoise import denoise
from .errors import Cancelled, DeviceError, Error, SceneError
from .images import ALBEDO, NOISY, NORMAL, Depth, check_output, read_image, write_image
from .memory import memory_lines, total_text
from .merge import merge_images
from .render import Progress, Renderer, devices, load_native, native_errors
from .scene import Film, Mesh, Scene
from .settings import FROM_MODE, Device, RenderSettings
from .snapshot import SUFFIX, Snapshot, load_snapshot, save_snapshot, scene_digest
from .strategies import SHEET, make_folder, render_strategies, write_strategies
from .upload import upload

FAILED, USAGE, INTERRUPTED = 1, 2, 130


class UsageError(Error):
    """A command line that asks for what cannot be: names the argument."""


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        """One line on standard error, exit code 2."""
        self.exit(USAGE, f"{self.prog}: {message} (try {self.prog} --help)\n")


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command and returns its exit code: 0, 1 (it failed), 2 (it was asked wrongly), 130 (interrupted)."""
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    if arguments[:1] == ["bench"]:
        return _bench(arguments[1:])
    options = _parser().parse_args(arguments)
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


def _parser() -> _Parser:
    parser = _Parser(
        prog="vlp-bpt",
        description="Renders scenes by bidirectional path tracing with virtual light points.",
        epilog="vlp-bpt COMMAND --help explains a command, with examples.",
    )
    parser.add_argument("--version", action="version", version=f"VLP-BPT {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def command(name: str, run: Any, text: str, examples: str) -> argparse.ArgumentParser:
        added = commands.add_parser(
            name,
            help=text,
            description=text[0].upper() + text[1:] + ".",
            epilog="examples:\n" + "\n".join(f"  {line}" for line in examples.strip().splitlines()),
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        added.set_defaults(run=run)
        return added

    _add_render(command("render", _render, "render a .blend or a snapshot to a picture", _RENDER_EXAMPLES))

    export = command(
        "export",
        _export,
        f"save the scene of a .blend as a snapshot ({SUFFIX}), which renders without Blender",
        "vlp-bpt export room.blend -o room.vlp.npz\nvlp-bpt render room.vlp.npz -o room.exr",
    )
    export.add_argument("file", type=Path, metavar="FILE.blend")
    export.add_argument(
        "-o", "--output", type=Path, required=True, metavar=f"FILE{SUFFIX}", help="the snapshot to write"
    )
    export.add_argument("--frame", type=int, help="frame to export (default: the file's current one)")

    info = command(
        "info",
        _info,
        "tell what a scene or a picture holds, or, without a file, what this machine renders on",
        "vlp-bpt info\nvlp-bpt info room.exr\nvlp-bpt info room.vlp.npz --resolution 1920x1080 --set mode=REFERENCE",
    )
    info.add_argument("file", type=Path, nargs="?", metavar="FILE")
    info.add_argument("--resolution", metavar="WxH", help="of a scene: what a render of so many pixels takes")
    _add_settings(info)

    compare = command(
        "compare",
        _compare,
        "tell how far picture A is from reference B: SSIM, FLIP, relMSE, mean",
        "vlp-bpt compare noisy.exr reference.exr\nvlp-bpt compare a.png b.png --json",
    )
    compare.add_argument("a", type=Path, metavar="A", help="picture to judge")
    compare.add_argument("b", type=Path, metavar="B", help="reference, of the same size")
    compare.add_argument("--json", action="store_true", help="print the figures as JSON")

    merge = command(
        "merge",
        _merge,
        "merge .exr files of different iterations of one render, exactly as if it had been rendered in one go",
        "vlp-bpt render room.vlp.npz -o a.exr --iterations 0:500\n"
        "vlp-bpt render room.vlp.npz -o b.exr --iterations 500:1000      (on another machine)\n"
        "vlp-bpt merge a.exr b.exr -o room.exr",
    )
    merge.add_argument("parts", type=Path, nargs="+", metavar="PART.exr")
    _add_output(merge)

    denoising = command(
        "denoise",
        _denoise,
        "denoise a picture, guided by the layers Denoising Albedo and Denoising Normal where it has them",
        "vlp-bpt denoise noisy.exr -o clean.png\nvlp-bpt denoise cycles.exr -o clean.exr --no-prefilter",
    )
    denoising.add_argument("file", type=Path, metavar="IN", help="its layer Noisy Image is taken where it has one")
    _add_output(denoising)
    denoising.add_argument(
        "--no-prefilter", action="store_true", help="take the guides as they are: faster, more error"
    )
    denoising.add_argument("--threads", type=int, default=0, help="0 for all (default)")

    commands.add_parser("bench", help="measure speed and error over time (vlp-bpt bench --help)", add_help=False)
    return parser


_RENDER_EXAMPLES = """
vlp-bpt render room.blend -o room.png
vlp-bpt render room.blend -o room.exr --samples 500 --frame 12
vlp-bpt render room.vlp.npz -o room.exr --time 60
vlp-bpt render room.vlp.npz -o room.exr --samples 100000 --noise 0.01
vlp-bpt render room.vlp.npz -o paper.exr --set mode=PAPER --set eye_path_length=5
vlp-bpt render room.vlp.npz -o part.exr --iterations 500:1000   (then: vlp-bpt merge)
vlp-bpt render room.vlp.npz --debug-strategies room --samples 64 --set light_path_length=2

--debug-strategies keeps apart what each way of making a path finds. (s, t): s vertices were made from the light, t from
the camera; s0 ran into a light, s1 sampled one, t1 splat on the film, the others joined a virtual light point. Raw
pictures of the same n = s + t vertices show the same light, so they must agree in brightness, and show which way is
noisy where; dark ones cannot make these paths (mirrors, point lights). Weighted ones are the shares that add up to the
picture: noise that is left in one of them is noise of the picture, and light in two of them at full strength is a bug.
"""


def _add_render(render: argparse.ArgumentParser) -> None:
    render.add_argument("file", type=Path, metavar=f"FILE.blend|FILE{SUFFIX}")
    _add_output(render, required=False)
    render.add_argument("--frame", type=int, help="frame of a .blend (default: its current one)")
    render.add_argument("--samples", metavar="N", help="iterations to render")
    render.add_argument("--time", metavar="SECONDS", help="stop after this long, samples or not")
    render.add_argument("--noise", metavar="X", help="stop once the noise is as low as X, such as 0.01, samples or not")
    render.add_argument("--device", metavar="NAME", help=f"one of {', '.join(Device)}")
    render.add_argument("--seed", metavar="N", help="another seed, other noise")
    render.add_argument(
        "--iterations",
        metavar="A:B",
        help="render iterations A to B-1 and keep exact sums in the .exr for vlp-bpt merge",
    )
    _add_settings(render)
    render.add_argument(
        "--debug-strategies",
        type=Path,
        metavar="DIR",
        help="instead of a picture, write what each strategy (s, t) finds into DIR: s2_t3_raw.exr, s2_t3_weighted.exr, "
        f"... and {SHEET}, which shows all of them, raw ones left, weighted ones right, with a row for each number of "
        "vertices from 2 on and a column for each s from 0 on",
    )
    render.add_argument("--quiet", action="store_true", help="no progress")


def _add_settings(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help=f"any setting: {', '.join(RenderSettings().to_dict())}",
    )


def _add_output(command: argparse.ArgumentParser, *, required: bool = True) -> None:
    command.add_argument(
        "-o", "--output", type=Path, required=required, metavar="OUT.exr|png", help="the picture to write"
    )
    command.add_argument(
        "--depth",
        type=Depth,
        choices=list(Depth),
        metavar="DEPTH",
        help="float or half for .exr, 8 or 16 bits for .png",
    )


# Commands


def _render(options: argparse.Namespace) -> int:
    kind = _scene_kind(options.file)
    if options.debug_strategies is not None:
        return _render_strategies(options, kind)
    if options.output is None:
        raise UsageError("the following arguments are required: -o/--output")
    check_output(options.output, options.depth)
    values = _setting_values(options)
    iterations = _iterations(options)
    if iterations is not None:
        if values.get("noise_threshold"):
            raise UsageError("--iterations says how many iterations to render: leave the noise threshold out")
        values |= {"samples": iterations[1] - iterations[0], "noise_threshold": 0.0}
    if kind == "blend" and iterations is None:
        return _render_blend(options, values)
    snapshot, warnings, settings = _scene_to_render(options, kind, values)
    first = iterations[0] if iterations is not None else 0
    renderer = Renderer(snapshot.scene, settings, first_iteration=first)
    warnings += renderer.warnings
    _warn(warnings)
    with ProgressDisplay(quiet=options.quiet) as display:
        _tell_memory(options, renderer)
        image = renderer.render(lambda progress: display.show(renderer, progress))
    _warn([warning for warning in renderer.warnings if warning not in warnings])  # of a device that has failed
    image.metadata["source"] = snapshot.metadata | {"file": options.file.name}
    if iterations is not None:
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
    return snapshot, warnings, RenderSettings.from_dict(_with_mode_first(settings, values))


def _render_strategies(options: argparse.Namespace, kind: str) -> int:
    for name in ("output", "iterations", "time", "noise"):
        if getattr(options, name) is not None:
            raise UsageError(f"--debug-strategies writes pictures of its own: leave --{name} out")
    make_folder(options.debug_strategies)
    snapshot, warnings, settings = _scene_to_render(options, kind, _setting_values(options))
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
    if _scene_kind(options.file) != "blend":
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
    path, values = options.file, _setting_values(options)
    if _scene_kind(path) == "blend":
        snapshot, warnings = _capture(path, None, values)
    else:
        snapshot, warnings = load_snapshot(path), []
    scene = snapshot.scene
    if options.resolution:
        scene.film = Film(*_resolution(options.resolution), transparent=scene.film.transparent)
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
    settings = RenderSettings.from_dict(_with_mode_first((snapshot.settings or RenderSettings()).to_dict(), values))
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
    noisy = image.layers.setdefault(NOISY, image.pixels)
    guides = image.layers.get(ALBEDO), image.layers.get(NORMAL) if ALBEDO in image.layers else None
    image.pixels = denoise(noisy, *guides, prefilter=not options.no_prefilter, threads=max(options.threads, 0))
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


# Arguments


def _scene_kind(path: Path) -> str:
    kind = "blend" if path.suffix.lower() == ".blend" else "snapshot" if path.name.lower().endswith(SUFFIX) else None
    if kind is None:
        raise UsageError(f"'{path}': scenes are .blend or {SUFFIX} files")
    if not path.is_file():
        raise UsageError(f"'{path}': there is no such file")
    return kind


def _setting_values(options: argparse.Namespace) -> dict[str, Any]:
    """The settings that the command line names, checked, of all of which the last counts."""
    texts: dict[str, str] = {}
    for text in options.set:
        name, equals, value = text.partition("=")
        if not equals:
            raise UsageError(f"--set {text}: must be NAME=VALUE")
        texts[name.strip()] = value
    named = {"samples": "samples", "time_limit": "time", "noise_threshold": "noise", "device": "device", "seed": "seed"}
    for name, option in named.items():
        value = getattr(options, option, None)
        if value is not None:
            texts[name] = value
    settings = RenderSettings.from_strings(texts).to_dict()
    return {name: settings[name] for name in texts}


def _with_mode_first(settings: dict[str, Any], values: dict[str, Any]) -> dict[str, Any]:
    """`values` over `settings`, in which a new mode takes the place of all that the old one gave."""
    if values.get("mode", settings["mode"]) != settings["mode"]:
        settings = {name: None if name in FROM_MODE else value for name, value in settings.items()}
    return settings | values


def _iterations(options: argparse.Namespace) -> tuple[int, int] | None:
    if options.iterations is None:
        return None
    try:
        begin, end = (int(part) for part in options.iterations.split(":"))
    except ValueError:
        raise UsageError(f"--iterations {options.iterations}: must be A:B, two whole numbers") from None
    if not 0 <= begin < end:
        raise UsageError(f"--iterations {options.iterations}: A must be below B and not negative")
    if options.samples is not None:
        raise UsageError("--iterations says how many samples to render: leave --samples out")
    if options.output.suffix.lower() != ".exr":
        raise UsageError(f"'{options.output}': --iterations needs an .exr file, which can hold exact sums")
    return begin, end


def _resolution(text: str) -> tuple[int, int]:
    try:
        width, height = (int(part) for part in text.lower().split("x"))
    except ValueError:
        raise UsageError(f"--resolution {text}: must be WxH, two whole numbers") from None
    return width, height


def _capture(path: Path, frame: int | None, values: dict[str, Any]) -> tuple[Snapshot, list[str]]:
    from ._blender import capture_blend

    return capture_blend(path, frame, values)


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

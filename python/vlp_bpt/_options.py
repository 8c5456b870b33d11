"""The command line's commands and options, and what the words of a command line mean."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NoReturn

from . import __version__
from .errors import Error
from .images import Depth
from .settings import FROM_MODE, Device, RenderSettings
from .snapshot import SUFFIX
from .strategies import SHEET

USAGE = 2  # the exit code

Command = Callable[[argparse.Namespace], int]


class UsageError(Error):
    """A command line that asks for what cannot be: names the argument."""


class Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        """One line on standard error, exit code 2."""
        self.exit(USAGE, f"{self.prog}: {message} (try {self.prog} --help)\n")


def make_parser(commands: Mapping[str, Command]) -> Parser:
    """`commands` do what their names say; each becomes `run` of what the parser gives."""
    parser = Parser(
        prog="vlp-bpt",
        description="Renders scenes by bidirectional path tracing with virtual light points.",
        epilog="vlp-bpt COMMAND --help explains a command, with examples.",
    )
    parser.add_argument("--version", action="version", version=f"VLP-BPT {__version__}")
    added_to = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def command(name: str, text: str, examples: str) -> argparse.ArgumentParser:
        added = added_to.add_parser(
            name,
            help=text,
            description=text[0].upper() + text[1:] + ".",
            epilog="examples:\n" + "\n".join(f"  {line}" for line in examples.strip().splitlines()),
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        added.set_defaults(run=commands[name])
        return added

    _add_render(command("render", "render a .blend or a snapshot to a picture", _RENDER_EXAMPLES))

    export = command(
        "export",
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
        "tell what a scene or a picture holds, or, without a file, what this machine renders on",
        "vlp-bpt info\nvlp-bpt info room.exr\nvlp-bpt info room.vlp.npz --resolution 1920x1080 --set mode=REFERENCE",
    )
    info.add_argument("file", type=Path, nargs="?", metavar="FILE")
    info.add_argument("--resolution", metavar="WxH", help="of a scene: what a render of so many pixels takes")
    _add_settings(info)

    compare = command(
        "compare",
        "tell how far picture A is from reference B: SSIM, FLIP, relMSE, mean",
        "vlp-bpt compare noisy.exr reference.exr\nvlp-bpt compare a.png b.png --json",
    )
    compare.add_argument("a", type=Path, metavar="A", help="picture to judge")
    compare.add_argument("b", type=Path, metavar="B", help="reference, of the same size")
    compare.add_argument("--json", action="store_true", help="print the figures as JSON")

    merge = command(
        "merge",
        "merge .exr files of different iterations of one render, exactly as if it had been rendered in one go",
        "vlp-bpt render room.vlp.npz -o a.exr --iterations 0:500\n"
        "vlp-bpt render room.vlp.npz -o b.exr --iterations 500:1000      (on another machine)\n"
        "vlp-bpt merge a.exr b.exr -o room.exr",
    )
    merge.add_argument("parts", type=Path, nargs="+", metavar="PART.exr")
    _add_output(merge)

    denoising = command(
        "denoise",
        "denoise a picture, guided by the layers Denoising Albedo and Denoising Normal where it has them",
        "vlp-bpt denoise noisy.exr -o clean.png\nvlp-bpt denoise cycles.exr -o clean.exr --no-prefilter",
    )
    denoising.add_argument("file", type=Path, metavar="IN", help="its layer Noisy Image is taken where it has one")
    _add_output(denoising)
    denoising.add_argument(
        "--no-prefilter", action="store_true", help="take the guides as they are: faster, more error"
    )
    denoising.add_argument("--threads", type=int, default=0, help="0 for all (default)")

    added_to.add_parser("bench", help="measure speed and error over time (vlp-bpt bench --help)", add_help=False)
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


def scene_kind(path: Path) -> str:
    """ "blend" or "snapshot", of a file that is there."""
    kind = "blend" if path.suffix.lower() == ".blend" else "snapshot" if path.name.lower().endswith(SUFFIX) else None
    if kind is None:
        raise UsageError(f"'{path}': scenes are .blend or {SUFFIX} files")
    if not path.is_file():
        raise UsageError(f"'{path}': there is no such file")
    return kind


def setting_values(options: argparse.Namespace) -> dict[str, Any]:
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


def with_mode_first(settings: dict[str, Any], values: dict[str, Any]) -> dict[str, Any]:
    """`values` over `settings`, in which a new mode takes the place of all that the old one gave."""
    if values.get("mode", settings["mode"]) != settings["mode"]:
        settings = {name: None if name in FROM_MODE else value for name, value in settings.items()}
    return settings | values


def iterations(options: argparse.Namespace) -> tuple[int, int] | None:
    """The range that --iterations names, its end not in it; None without."""
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


def resolution(text: str) -> tuple[int, int]:
    """Width and height in pixels."""
    try:
        width, height = (int(part) for part in text.lower().split("x"))
    except ValueError:
        raise UsageError(f"--resolution {text}: must be WxH, two whole numbers") from None
    return width, height

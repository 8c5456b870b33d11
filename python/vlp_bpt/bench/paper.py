"""`vlp-bpt bench paper`: the experiment of Celestino et al. 2014 in PAPER mode.

Iterations over time of each device (its Figure 3), SSIM over time, and path lengths at equal time, beside the figures
that its text gives; CSV files, plots and a page, report.md.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

from vlp_bpt.errors import Error
from vlp_bpt.render import devices
from vlp_bpt.scene import Scene
from vlp_bpt.settings import MODE_PRESETS, Device, Mode, RenderSettings, Weighting

from . import plots, sweep
from .claims import Claim, claims
from .contestants import Contestant, Ours, race
from .measure import Halves, Point, add_point, columns, judge, ladder, ssim_at
from .references import our_halves
from .report import machine, markdown_table, number, write_csv
from .scenes import find_scene, load_scene

SAME_MEAN = {"weighting": Weighting.BALANCE}  # of the same paths, with less noise: what a reference is made with


@dataclass(frozen=True)
class Quoted:
    """What the paper's text says of a scene: SSIM on its PC3 after so many seconds; iterations of PC2 and PC3."""

    ssim: dict[float, float]
    iterations: dict[str, tuple[float, int]]  # device: after so many seconds, so many iterations


QUOTED = {
    "cornell_box": Quoted(
        {1: 0.90, 5: 0.97, 60: 0.998},
        {"PC2, GeForce 560 Ti": (180, 5700), "PC3, GeForce GTX 780": (180, 24400)},
    ),
    "sierpinski": Quoted({1: 0.93, 5: 0.97, 120: 0.998}, {}),
}


@dataclass
class Curve:
    """A scene on a device: a point at each instant; samples are iterations."""

    scene: str
    device: str
    points: list[Point]

    @property
    def iterations_per_second(self) -> float:
        return self.points[-1].samples / self.points[-1].seconds


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `vlp-bpt bench paper`."""
    parser.add_argument("--scenes", nargs="+", default=list(QUOTED), metavar="SCENE", help="default: the paper's two")
    parser.add_argument("--size", type=int, default=512, help="width in pixels (default: 512)")
    parser.add_argument("--seconds", type=float, default=180.0, help="render time of each device (default: 180)")
    parser.add_argument(
        "--reference-seconds",
        type=float,
        default=0.0,
        help="render time of each half of a reference, kept in out/references (default: 2.5 times --seconds)",
    )
    parser.add_argument("--device", nargs="+", default=[], metavar="NAME", help="default: every device that is here")
    parser.add_argument("--eye-path-length", type=int, help="K (default: PAPER mode's, 5)")
    sweep.add_arguments(parser)
    parser.add_argument("--threads", type=int, default=0, help="0 for all (default)")
    parser.add_argument("--output", type=Path, default=Path("out/bench-paper"), help="default: out/bench-paper")
    parser.add_argument("--no-plots", action="store_true", help="needs no matplotlib")


def run(args: argparse.Namespace) -> None:
    """Measures everything and writes it to the folder `output`."""
    if not args.no_plots:
        plots.require()
    names = [device_name(name) for name in args.device] or list(dict.fromkeys(str(d["kind"]) for d in devices()))
    reference_seconds = args.reference_seconds or 2.5 * args.seconds
    args.output.mkdir(parents=True, exist_ok=True)
    curves: list[Curve] = []
    sweeps: dict[str, list[sweep.Cell]] = {}
    for scene_name in args.scenes:
        path = find_scene(scene_name)
        scene = load_scene(path, args.size)
        settings = {"mode": Mode.PAPER, "eye_path_length": args.eye_path_length, "threads": args.threads}
        halves = our_halves(path.stem, scene, settings | SAME_MEAN, reference_seconds)
        curves += measure_devices(path.stem, scene, settings, names, halves, args.seconds)
        if args.sweep_seconds > 0:
            truth = our_halves(path.stem, scene, {"mode": Mode.REFERENCE, "threads": args.threads}, reference_seconds)
            sweeps[path.stem] = sweep.measure(path.stem, scene, truth, args)
    write(args, curves, sweeps, reference_seconds)


def device_name(name: str) -> str:
    """A device's name in capitals; raises Error for one that there is not."""
    if name.upper() not in list(Device):
        raise Error(f"--device {name}: must be one of {', '.join(Device)}")
    return name.upper()


def measure_devices(
    name: str, scene: Scene, settings: dict[str, object], names: list[str], halves: Halves, seconds: float
) -> list[Curve]:
    """One scene on each device, by turns."""
    runners = [
        Ours(device, scene, RenderSettings.from_dict(settings | {"samples": 1 << 30, "device": device}))
        for device in names
    ]
    for runner in runners:
        if runner.renderer.warnings:
            raise Error(f"{runner.name}: {runner.renderer.warnings[0]}")
    curves = {runner.name: Curve(name, runner.name, []) for runner in runners}

    def observe(runner: Contestant, _: int) -> None:
        point = judge(runner.picture(), halves, runner.seconds, runner.iterations or 0)
        add_point(curves[runner.name].points, point)
        print(f"{name}: {runner.name}, {point.seconds:.1f} s, {point.samples} iterations, SSIM {point.ssim_c:.4f}")

    race(runners, ladder(seconds), observe)
    return list(curves.values())


# What is written


def write(
    args: argparse.Namespace, curves: list[Curve], sweeps: dict[str, list[sweep.Cell]], reference_seconds: float
) -> None:
    """iterations.csv, sweep.csv, plots and report.md; the page is printed too."""
    folder: Path = args.output
    rows = [{"scene": c.scene, "device": c.device, **columns(p, "iterations")} for c in curves for p in c.points]
    write_csv(folder / "iterations.csv", rows)
    if sweeps:
        write_csv(folder / "sweep.csv", sweep.rows(sweeps))
    pictures = [] if args.no_plots else draw(folder, curves, sweeps)
    verdicts = claims(curves, sweeps, QUOTED, args.sweep_seconds)
    page = report(args, curves, sweeps, verdicts, pictures, reference_seconds)
    (folder / "report.md").write_text(page)
    print(
        f"\n{page}\n{folder}/: report.md, " + ", ".join(sorted(p.name for p in folder.iterdir() if p.suffix != ".md"))
    )


def report(
    args: argparse.Namespace,
    curves: list[Curve],
    sweeps: dict[str, list[sweep.Cell]],
    verdicts: list[Claim],
    pictures: list[str],
    reference_seconds: float,
) -> str:
    """The page, in Markdown."""
    k = args.eye_path_length or MODE_PRESETS[Mode.PAPER].eye_path_length
    parts = [
        "# The paper's experiment",
        f"{machine()}\n\nPAPER mode: L = 1, K = {k}, {args.size} pixels wide, {args.seconds:g} s a device; the SSIM is "
        f"against two halves of {reference_seconds:g} s each of the same lengths, weighted by the balance heuristic, "
        "which changes the noise and not the mean. SSIM: sRGB-encoded, clipped, Gaussian window of sigma 1.5; SSIM_c "
        "is less the reference's noise. The paper does not give the size of its pictures nor its scene files, so its "
        "seconds and iterations are of like work, not of the same.",
        "## SSIM after the paper's times\n\n" + ssim_table(curves),
        "## Iterations\n\n" + iteration_table(curves),
        *([f"## Path lengths at equal time\n\n{sweep.page(sweeps, args.sweep_seconds)}"] if sweeps else []),
        "## What the paper says, and what was found\n\n"
        + markdown_table(["claim", "here", "verdict"], [[c.text, c.found, c.verdict] for c in verdicts]),
        "\n\n".join(f"![{name}]({name})" for name in pictures),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def ssim_table(curves: list[Curve]) -> str:
    """SSIM over time, and what the paper gives for its times."""
    lines = []
    for curve in curves:
        quoted = QUOTED[curve.scene].ssim if curve.scene in QUOTED else {}
        for seconds in sorted({*quoted, *(round(point.seconds, 2) for point in curve.points)}):
            here = ssim_at(curve.points, seconds)
            paper = number(quoted.get(seconds))
            lines.append([curve.scene, curve.device, f"{seconds:g}", "-" if here is None else f"{here:.4f}", paper])
    return markdown_table(["scene", "device", "seconds", "SSIM_c", "paper, GTX 780"], lines)


def iteration_table(curves: list[Curve]) -> str:
    """Iterations a second here and in the paper's text."""
    lines = [
        [c.scene, c.device, f"{c.points[-1].samples} in {c.points[-1].seconds:.1f} s", f"{c.iterations_per_second:.2f}"]
        for c in curves
    ]
    for scene in dict.fromkeys(c.scene for c in curves):
        for device, (seconds, count) in (QUOTED[scene].iterations if scene in QUOTED else {}).items():
            lines.append([scene, f"paper: {device}", f"{count} in {seconds:g} s", f"{count / seconds:.1f}"])
    return markdown_table(["scene", "device", "iterations", "a second"], lines)


def draw(folder: Path, curves: list[Curve], sweeps: dict[str, list[sweep.Cell]]) -> list[str]:
    """The plots; their names."""
    scenes = list(dict.fromkeys(c.scene for c in curves))
    counts, quality = [], []
    for scene in scenes:
        quoted = QUOTED.get(scene, Quoted({}, {}))
        mine = [c for c in curves if c.scene == scene]
        lines = [plots.Series(c.device, [p.seconds for p in c.points], [p.samples for p in c.points]) for c in mine]
        lines += [  # straight through the one point that the text gives
            plots.Series(f"paper: {device}", [1, seconds], [count / seconds, count], "--")
            for device, (seconds, count) in quoted.iterations.items()
        ]
        note = "PC1: no figure in the paper's text" if quoted.iterations else "no figures in the paper's text"
        counts.append((plots.Axes(scene, "seconds", "iterations", log_x=True, log_y=True, note=note), lines))
        lines = [plots.Series(c.device, [p.seconds for p in c.points], [p.ssim_c for p in c.points]) for c in mine]
        if quoted.ssim:
            lines.append(plots.Series("paper: GTX 780", list(quoted.ssim), list(quoted.ssim.values()), "s--", "gray"))
        quality.append((plots.Axes(scene, "seconds", "SSIM_c", log_x=True, loss=True), lines))
    plots.plots(folder / "figure3.png", counts)
    plots.plots(folder / "ssim.png", quality)
    if sweeps:
        plots.plots(folder / "sweep.png", [sweep.panel(name, cells) for name, cells in sweeps.items()])
    return ["figure3.png", "ssim.png"] + (["sweep.png"] if sweeps else [])

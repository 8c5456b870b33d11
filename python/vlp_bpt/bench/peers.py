"""`vlp-bpt bench peers`: this renderer, Cycles, Mitsuba and LuxCore at equal time, each in a process of its own.

First it is told whether each makes the same picture as we do; then how far each is from it over time. CSV files, plots
and a page, report.md.
"""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from dataclasses import dataclass, field
from importlib import util
from pathlib import Path

import numpy as np

from vlp_bpt.errors import Error
from vlp_bpt.scene import Scene
from vlp_bpt.settings import Mode, RenderSettings

from . import plots
from .agreement import Agreement, compare, increments
from .contestants import Contestant, Cycles, LuxCore, Mitsuba, Ours, race
from .measure import Halves, Pixels, Point, add_point, judge, ladder
from .peers_report import write
from .references import our_halves
from .remote import Remote, State
from .scenes import find_scene, load_scene, mesh_variant

SCENES = ["cornell_box", "sierpinski", "caustics", "indirect_room", "million"]
LONGEST = 64  # surface hits of a path, where roulette ends it
MESH_LEVELS = 5  # of the meshes that stand for spheres in Cycles
FEWEST = 4  # eye samples a pixel, without which a picture is not compared
BATCHES = 8  # of each renderer's time, for its noise
BOX = {"filter": "BOX", "filter_width": 1.0}  # the one filter that all have
ENGINES = {  # by which a peer is named on the command line: its module, and how it is installed
    "vlp-bpt": ("vlp_bpt", ""),
    "cycles": ("bpy", "pip install bpy"),
    "mitsuba": ("mitsuba", "pip install mitsuba, or make bench-peers"),
    "luxcore": ("pyluxcore", "pip install pyluxcore, or make bench-peers"),
}


@dataclass
class Outcome:
    """What one renderer did with one scene. own: its error is against a long render of its own, as it differs."""

    scene: str
    name: str
    pictures: list[tuple[Pixels, float]] = field(default_factory=list)  # running mean, eye samples
    seconds: list[float] = field(default_factory=list)
    state: State = field(default_factory=State)
    agreement: Agreement | None = None
    own: bool = False
    points: list[Point] = field(default_factory=list)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `vlp-bpt bench peers`."""
    parser.add_argument("--scenes", nargs="+", default=SCENES, metavar="SCENE", help=f"default: {' '.join(SCENES)}")
    parser.add_argument("--peers", nargs="+", default=list(ENGINES), choices=list(ENGINES), help="default: all")
    parser.add_argument("--size", type=int, default=512, help="width in pixels (default: 512)")
    parser.add_argument("--seconds", type=float, default=30.0, help="render time of each renderer (default: 30)")
    parser.add_argument(
        "--reference-seconds",
        type=float,
        default=0.0,
        help="render time of each half of a reference, kept in out/references (default: 5 times --seconds)",
    )
    parser.add_argument("--threads", type=int, default=0, help="0 for all (default); Mitsuba always takes all")
    parser.add_argument("--output", type=Path, default=Path("out/bench-peers"), help="default: out/bench-peers")
    parser.add_argument("--no-plots", action="store_true", help="needs no matplotlib")


def run(args: argparse.Namespace) -> None:
    """Measures everything and writes it to the folder `output`."""
    if not args.no_plots:
        plots.require()
    left_out = missing(args.peers)
    for line in left_out:
        print(line, flush=True)
    args.output.mkdir(parents=True, exist_ok=True)
    outcomes: list[Outcome] = []
    for name in args.scenes:
        path = find_scene(name)
        scene = load_scene(path, args.size)
        seconds = args.reference_seconds or 5 * args.seconds
        halves = our_halves(path.stem, scene, {"mode": Mode.REFERENCE, "threads": args.threads} | BOX, seconds)
        outcomes += bench_scene(path, scene, halves, args, left_out)
        write(args.output, conditions(args), outcomes, left_out, not args.no_plots)  # kept if the next scene fails
    print(f"\n{(args.output / 'report.md').read_text()}")


def conditions(args: argparse.Namespace) -> str:
    """What was measured and how."""
    seconds = args.reference_seconds or 5 * args.seconds
    return (
        f"{args.size} pixels wide, {args.seconds:g} s of rendering each, by turns. Against two halves of {seconds:g} s "
        "of our REFERENCE mode, with which each is compared first. All have a box filter of one pixel, no clamps, no "
        f"denoiser and paths of up to {LONGEST} hits, save where said."
    )


def missing(peers: list[str]) -> list[str]:
    """A line for each peer that is not installed: its name, and how it is installed."""
    lines = []
    for peer in peers:
        module, how = ENGINES[peer]
        if util.find_spec(module) is None:
            lines.append(f"{peer} is missing and takes no part: {how}")
    return lines


def contestants(path: Path, scene: Scene, args: argparse.Namespace, seed: int = 0) -> list[Contestant]:
    """Those that are asked for and installed, set to the same picture: box filter, no clamps, long paths."""
    peers = [peer for peer in args.peers if util.find_spec(ENGINES[peer][0]) is not None]
    size = (scene.film.width, scene.film.height)
    common = {"mode": Mode.BALANCED, "samples": 1 << 30, "threads": args.threads, "seed": seed}
    result: list[Contestant] = []
    if "vlp-bpt" in peers:
        result.append(Ours("VLP-BPT", scene, RenderSettings.from_dict(common | BOX)))
    if "cycles" in peers and path.suffix == ".blend":
        balls = path.stem == "sierpinski"
        blend = mesh_variant(path, MESH_LEVELS) if balls else path
        result.append(Cycles("Cycles", blend, size, LONGEST, args.threads, seed, box=True))
    if "mitsuba" in peers:
        result.append(Mitsuba("Mitsuba", scene, LONGEST, seed))
    if "luxcore" in peers:
        engines = ("PATHCPU", "BIDIRCPU")
        result += [LuxCore(f"LuxCore {engine}", scene, engine, LONGEST, args.threads, seed) for engine in engines]
    return result


def bench_scene(
    path: Path, scene: Scene, halves: Halves, args: argparse.Namespace, left_out: list[str]
) -> list[Outcome]:
    """Race all on one scene, then judge their pictures. Who cannot render it gets a line in `left_out`."""
    name = path.stem
    if "cycles" in args.peers and path.suffix != ".blend":
        left_out.append(f"{name}: Cycles: renders .blend files alone")
    with ExitStack() as stack:
        ready: list[Remote] = []
        for contestant in contestants(path, scene, args):
            remote = stack.enter_context(Remote(contestant))
            try:
                remote.prepare()
                ready.append(remote)
            except Error as error:
                left_out.append(f"{name}: {error}")
                print(left_out[-1], flush=True)
        outcomes = {remote.name: Outcome(name, remote.name) for remote in ready}

        def observe(remote: Contestant, _: int) -> None:
            assert isinstance(remote, Remote)
            outcome = outcomes[remote.name]
            if remote.seconds > (outcome.seconds[-1] if outcome.seconds else 0.0):
                outcome.pictures.append((remote.picture(), float(remote.eye_samples)))
                outcome.seconds.append(remote.seconds)
            outcome.state = remote.state

        race(ready, instants(args.seconds), observe)
    for contestant in contestants(path, scene, args, seed=1):
        if contestant.name in outcomes:
            conclude(outcomes[contestant.name], contestant, halves, args)
    return list(outcomes.values())


def instants(seconds: float) -> list[float]:
    """Where the pictures are judged, and eighths of the time, of which batches are made."""
    return sorted({*ladder(seconds), *(seconds * (i + 1) / BATCHES for i in range(BATCHES))})


def conclude(outcome: Outcome, again: Contestant, halves: Halves, args: argparse.Namespace) -> None:
    """Agreement and errors. A renderer that makes another picture is held against itself: two long renders, `again`
    and one with the next seed."""
    batches = increments(outcome.pictures)
    height, width, _ = halves[0].shape
    if len(batches) > 1 and outcome.pictures[-1][1] >= FEWEST * height * width:
        outcome.agreement = compare(batches, halves)
    print(f"{outcome.scene}: {outcome.name}: {outcome.agreement or 'too few samples to compare'}", flush=True)
    if outcome.agreement is not None and not outcome.agreement.agrees:
        halves = own_halves(again, args.reference_seconds or 5 * args.seconds)
        outcome.own = True
    wanted = ladder(args.seconds)
    for (picture, samples), seconds in zip(outcome.pictures, outcome.seconds, strict=True):
        if samples < height * width:
            continue  # parts of the picture are still black
        # the first one at or after each step of the ladder, and the last, which may lie a little before its end
        if seconds >= wanted[0] or seconds == outcome.seconds[-1]:
            add_point(outcome.points, judge(picture, halves, seconds, int(samples)))
            wanted = [step for step in wanted if step > seconds] or [float("inf")]
    outcome.pictures.clear()


def own_halves(contestant: Contestant, seconds: float) -> Halves:
    """Two independent pictures of a renderer: its own slices, of which every other one counts for each."""
    print(f"{contestant.name}: a reference of its own, {2 * seconds:.0f} s", flush=True)
    pictures = []
    with Remote(contestant) as remote:
        remote.prepare()
        for _ in range(BATCHES):
            remote.run(2 * seconds / BATCHES)
            pictures.append((remote.picture(), float(remote.eye_samples)))
    batches = increments(pictures)
    return joined(batches[0::2]), joined(batches[1::2])


def joined(batches: list[tuple[Pixels, float]]) -> Pixels:
    """The mean of batches, each with its weight."""
    weights = np.array([weight for _, weight in batches])
    return np.asarray(np.tensordot(weights / weights.sum(), np.stack([pixels for pixels, _ in batches]), 1))

"""What `vlp-bpt bench peers` writes: results.csv, curves.csv, plots, and report.md with each renderer's settings."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Protocol

from vlp_bpt.settings import MODE_PRESETS, Mode

from . import mitsuba, plots
from .agreement import Agreement
from .contestants import LUXCORE_DEPTH
from .measure import Point, columns, seconds_to
from .remote import State
from .report import Cell, machine, markdown_table, number, write_csv

LEVELS = (0.9, 0.93, 0.97, 0.998)


class Outcome(Protocol):
    """See peers.Outcome."""

    scene: str
    name: str
    state: State
    agreement: Agreement | None
    own: bool
    points: list[Point]


def write(
    folder: Path, conditions: str, outcomes: Sequence[Outcome], left_out: Sequence[str], with_plots: bool
) -> None:
    """Every file, into `folder`."""
    write_csv(folder / "results.csv", [_row(o) for o in outcomes if o.points])
    curves = [{"scene": o.scene, "renderer": o.name, **columns(p, "eye_samples")} for o in outcomes for p in o.points]
    write_csv(folder / "curves.csv", curves)
    pictures = _draw(folder, outcomes) if with_plots else []
    (folder / "report.md").write_text(_page(conditions, outcomes, left_out, pictures))


def _row(outcome: Outcome) -> dict[str, Cell]:
    last, state = outcome.points[-1], outcome.state
    agreement = outcome.agreement
    row: dict[str, Cell] = {
        "scene": outcome.scene,
        "renderer": outcome.name,
        "agrees": None if agreement is None else agreement.agrees,
        "mean_difference": None if agreement is None else agreement.difference,
        "own_reference": outcome.own,
        "eye_samples_per_second": last.samples / last.seconds,
        "processors": _processors(state),
        "memory_bytes": state.memory,
        **columns(last, "eye_samples"),
    }
    for level in LEVELS:
        crossing = seconds_to(outcome.points, level)
        row[f"seconds_to_{level:g}"] = None if crossing is None else str(crossing)
    return row


def _processors(state: State) -> float:
    return state.processor / state.wall if state.wall > 0 else 0.0


def _page(conditions: str, outcomes: Sequence[Outcome], left_out: Sequence[str], pictures: Sequence[str]) -> str:
    parts = ["# Beside its peers", f"{machine()}\n\n{conditions}"]
    if left_out:
        parts.append("Left out:\n\n" + "\n".join(f"- {line}" for line in left_out))
    scenes = dict.fromkeys(o.scene for o in outcomes)
    parts += [f"## {scene}\n\n{_table([o for o in outcomes if o.scene == scene])}" for scene in scenes]
    parts.append(
        "relMSE and SSIM_c are less the reference's noise. Seconds to an SSIM_c: ~ extrapolated, < before the first "
        "picture, - not to be told. Processors: the process's processor time over wall time while its slices ran, "
        "preparation of the scene included where a renderer repeats it. * another picture than ours: held against a "
        "long render of its own."
    )
    parts.append("## Settings\n\n" + "\n".join(f"- **{name}**: {text}" for name, text in settings().items()))
    parts.append("\n\n".join(f"![{name}]({name})" for name in pictures))
    return "\n\n".join(part for part in parts if part) + "\n"


def _table(outcomes: Sequence[Outcome]) -> str:
    head = ["", "same picture", "M samples/s", "processors", "MiB", "s", "relMSE", "FLIP", "SSIM", "SSIM_c"]
    head += [f"s to {level:g}" for level in LEVELS]
    lines = []
    for outcome in outcomes:
        agreement = "too few samples to tell" if outcome.agreement is None else str(outcome.agreement)
        notes = "".join(f"; {note}" for note in outcome.state.notes)
        line = [outcome.name + ("*" if outcome.own else ""), agreement + notes]
        if outcome.points:
            last = outcome.points[-1]
            line += [f"{last.samples / last.seconds / 1e6:.2f}", f"{_processors(outcome.state):.2f}"]
            line += [f"{outcome.state.memory / 2**20:.0f}", f"{last.seconds:.1f}", number(last.rel_mse)]
            line += [f"{last.flip:.3f}", f"{last.ssim:.4f}", f"{last.ssim_c:.4f}"]
            line += [str(seconds_to(outcome.points, level) or "-") for level in LEVELS]
        lines.append(line + ["-"] * (len(head) - len(line)))
    return markdown_table(head, lines)


def settings() -> dict[str, str]:
    """What each renderer was told, in a sentence."""
    balanced = MODE_PRESETS[Mode.BALANCED]
    return {
        "VLP-BPT": f"BALANCED: L = {balanced.light_path_length}, K = {balanced.eye_path_length}, roulette, splats, "
        f"adaptive sampling, one VLP of {balanced.vlp_candidates} a hit, a light path for "
        f"{balanced.pixels_per_light_path} pixels; where a trial of the scene finds that it pays, up to eight "
        "times as many for caustics, up to eight VLPs where the camera looks, or none, or no light paths; where a "
        "pilot finds that it pays, light paths go through windows and begin at the lights that the picture shows; "
        "Sobol sequences.",
        f"Cycles{_version('bpy')}": "path tracing on the CPU, multiple importance sampling; light tree, adaptive "
        "sampling, path guiding, clamps and denoiser off; its Sobol sequences. Spheres are smooth meshes, as its point "
        "clouds are wrong inside glass.",
        f"Mitsuba{_version('mitsuba')}": f"{mitsuba.variant()}, `path`, or `volpath` where lamps have to let light "
        "through; independent sampler, launches of up to 67 M samples, of which the first alone pays for what a launch "
        "costs without samples.",
        f"LuxCore PATHCPU{_version('pyluxcore')}": "Sobol sampler, not adaptive; its own roulette.",
        "LuxCore BIDIRCPU": f"as PATHCPU; walks of up to {LUXCORE_DEPTH} hits from either side without roulette, "
        "as with it the picture is too bright.",
    }


def _version(package: str) -> str:
    try:
        return f" {metadata.version(package)}"
    except metadata.PackageNotFoundError:
        return ""


def _draw(folder: Path, outcomes: Sequence[Outcome]) -> list[str]:
    """For each scene, error and SSIM over time side by side; the names of the files."""
    names = []
    for scene in dict.fromkeys(o.scene for o in outcomes):
        drawn = [o for o in outcomes if o.scene == scene and o.points]
        times = {o.name: [p.seconds for p in o.points] for o in drawn}
        error = [
            plots.Series(o.name + "*" * o.own, times[o.name], [max(p.rel_mse, 1e-7) for p in o.points]) for o in drawn
        ]
        quality = [plots.Series(o.name + "*" * o.own, times[o.name], [p.ssim_c for p in o.points]) for o in drawn]
        names.append(f"{scene}.png")
        plots.plots(
            folder / names[-1],
            [
                (plots.Axes(scene, "seconds", "relMSE", log_x=True, log_y=True), error),
                (plots.Axes(scene, "seconds", "SSIM_c", log_x=True, loss=True), quality),
            ],
        )
    return names

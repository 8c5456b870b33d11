"""Merging ranges of iterations rendered apart: exact sums add up to the picture of one render, bit for bit."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .errors import ImageError
from .images import Image, read_image
from .render import Renderer
from .scene import Film, Scene
from .settings import Mode, RenderSettings

# What may differ between the parts of one render: how much and where they computed.
_FREE_SETTINGS = ("samples", "time_limit", "noise_threshold", "device", "threads", "denoise_prefilter")
_OF_DENOISING = ("denoised", "denoise_seconds")
_OF_PARTS = (*_OF_DENOISING, "noise")  # metadata of each picture by itself


def merge_images(paths: Sequence[str | Path]) -> Image:
    """The picture of all the iterations in the files, with its film state, so that it can be merged again.

    Raises ImageError naming the file that holds no exact sums, belongs to another scene, film or settings, or repeats
    iterations of another.
    """
    if not paths:
        raise ImageError("merge: no files to merge")
    parts = [(Path(path), read_image(path)) for path in paths]
    for path, image in parts:
        if (
            image.film_state is None
            or not {"ranges", "settings", "film", "scene", "iterations"} <= image.metadata.keys()
        ):
            raise ImageError(f"'{path}': holds no exact sums: render its part with --iterations A:B to an .exr file")
    first_path, first = parts[0]
    for path, image in parts[1:]:
        _check_same_render(path, image.metadata, first_path, first.metadata)
    ranges = _joined([(path, image.metadata["ranges"]) for path, image in parts])
    film = Film(
        first.metadata["film"]["width"], first.metadata["film"]["height"], tuple(first.metadata["film"]["window"])
    )
    denoising = {name: first.metadata["settings"].get(name, False) for name in ("denoise", "denoise_prefilter")}
    summing = Renderer(  # for its film alone
        Scene(film=film), RenderSettings(mode=Mode.PAPER, light_paths=1, **denoising)
    )
    shape = summing.film_state().shape
    for path, image in parts:
        if image.film_state is None or image.film_state.shape != shape:
            raise ImageError(f"'{path}': its exact sums have another size than its film")
        summing.add_film_state(image.film_state, image.metadata["iterations"])
    metadata = {name: value for name, value in first.metadata.items() if name not in _OF_PARTS} | {
        "settings": first.metadata["settings"] | {"samples": summing.iterations},
        "iterations": summing.iterations,
        "ranges": ranges,
        "seconds": round(sum(image.metadata.get("seconds", 0.0) for _, image in parts), 3),
        "statistics": _summed([image.metadata.get("statistics", {}) for _, image in parts]),
    }
    merged = summing.picture()
    merged.metadata = metadata | {name: merged.metadata[name] for name in _OF_DENOISING if name in merged.metadata}
    merged.film_state = summing.film_state()
    return merged


def _check_same_render(path: Path, metadata: dict[str, Any], other_path: Path, other: dict[str, Any]) -> None:
    for what in ("scene", "film"):
        if metadata[what] != other[what]:
            raise ImageError(f"'{path}': was rendered from another {what} than '{other_path}'")
    mine, theirs = metadata["settings"], other["settings"]
    for name in sorted(mine.keys() | theirs.keys()):
        if name not in _FREE_SETTINGS and mine.get(name) != theirs.get(name):
            values = f"{name} = {mine.get(name)} but '{other_path}' has {theirs.get(name)}"
            raise ImageError(f"'{path}': was rendered with {values}")


def _joined(parts: list[tuple[Path, list[list[int]]]]) -> list[list[int]]:
    """The ranges of all parts in order, neighbours joined; raises ImageError where two overlap."""
    joined: list[list[int]] = []
    owner: Path | None = None
    for begin, end, path in sorted((begin, end, path) for path, ranges in parts for begin, end in ranges):
        if joined and begin < joined[-1][1]:
            raise ImageError(f"'{path}': has iterations {begin}:{end}, some of which are in '{owner}' too")
        if joined and begin == joined[-1][1]:
            joined[-1][1] = end
        else:
            joined.append([begin, end])
        owner = path
    return joined


def _summed(statistics: list[dict[str, int]]) -> dict[str, int]:
    names = {name for part in statistics for name in part}
    return {name: sum(part.get(name, 0) for part in statistics) for name in sorted(names)}

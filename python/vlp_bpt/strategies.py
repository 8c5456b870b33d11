"""The debug render: what every strategy (s, t) finds, alone and with its weight, as pictures and on one sheet."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .errors import ImageError, SettingsError
from .images import Image, write_image
from .render import load_native, native_errors
from .scene import Scene
from .settings import RenderSettings, ResolvedSettings
from .upload import upload

Float32 = NDArray[np.float32]
Strategy = tuple[int, int]  # s light vertices and t eye vertices

MOST_BYTES = 4 << 30  # that the pictures of all strategies may take
_TILE = 128  # most pixels that one side of a picture has on the sheet
_GAP = 2  # pixels between pictures on the sheet
SHEET = "strategies.png"


@dataclass(frozen=True)
class StrategyPictures:
    """What each strategy found, by (s, t): (height, width, 3) float32, linear Rec. 709, row 0 at the bottom.

    raw: its own estimate of all light that it can find, weight 1. weighted: its share of the picture; the weighted ones
    add up to the picture that `Renderer` makes of the same iterations.
    """

    raw: dict[Strategy, Float32]
    weighted: dict[Strategy, Float32]
    iterations: int


def strategies_of(settings: ResolvedSettings) -> Iterator[Strategy]:
    """The strategies that are switched on and lie within the path lengths L and K. Light samples leave no direct light
    to splats, (2, 1)."""
    least_splat = 3 if settings.light_samples > 0 else 2
    for s in range(settings.light_path_length + 2):
        for t in range(1, settings.eye_path_length + 2):
            on = {0: settings.hits, 1: settings.light_samples > 0}.get(s, settings.vlp_connections > 0)
            if (settings.splats and s >= least_splat) if t == 1 else on:
                yield s, t


def render_strategies(
    scene: Scene, settings: RenderSettings | None = None, report: Callable[[int], None] | None = None
) -> StrategyPictures:
    """Renders `settings.samples` iterations on the processor and keeps the strategies apart.

    `report` is called with the number of complete iterations. Raises SettingsError where the pictures would take more
    than MOST_BYTES, and SceneError, SettingsError or DeviceError as `Renderer` does.
    """
    scene.validate()
    resolved = (settings or RenderSettings()).resolved(scene.film.width, scene.film.height)
    _, _, width, height = scene.film.render_window
    size = 24 * width * height * (resolved.light_path_length + 2) * (resolved.eye_path_length + 2)
    if size > MOST_BYTES:
        raise SettingsError(
            f"the pictures of all strategies would take {size / 2**30:.1f} GiB: choose a smaller picture, or shorter "
            f"paths than light_path_length = {resolved.light_path_length}, eye_path_length = {resolved.eye_path_length}"
        )
    native = load_native()
    with native_errors():
        uploaded = native.Scene()
        upload(scene, uploaded)
        uploaded.build(resolved.threads)
        renderer = native.StrategyRenderer(uploaded, resolved.to_dict())
        for iteration in range(resolved.samples):
            renderer.iterate(iteration)
            if report is not None:
                report(iteration + 1)

    def pictures(weighted: bool) -> dict[Strategy, Float32]:
        found = {}
        for s, t in strategies_of(resolved):
            found[s, t] = np.empty((height, width, 3), np.float32)
            renderer.read(s, t, weighted, found[s, t])
        return found

    return StrategyPictures(pictures(False), pictures(True), resolved.samples)


def contact_sheet(pictures: StrategyPictures) -> Float32:
    """All pictures small, raw ones left and weighted ones right: (height, width, 4), linear, row 0 at the bottom.

    From the top down, rows are path lengths n = s + t = 2, 3, ...; columns are s = 0, 1, .... Each row is brightened so
    that the light of its length, all weighted pictures together, is white at its brightest hundredth.
    """
    columns = max(s for s, _ in pictures.raw) + 1
    lengths = range(2, max(s + t for s, t in pictures.raw) + 1)
    height, width, _ = next(iter(pictures.raw.values())).shape
    step = max(1, -(-max(height, width) // _TILE))
    tile_height, tile_width = -(-height // step), -(-width // step)
    pitch_y, pitch_x = tile_height + _GAP, tile_width + _GAP
    half = columns * pitch_x + 4 * _GAP
    sheet = np.ones((len(lengths) * pitch_y + _GAP, 2 * half, 4), np.float32)
    sheet[..., :3] = 0.02
    for row, n in enumerate(lengths):
        of_length = [(s, n - s) for s in range(columns) if (s, n - s) in pictures.raw]
        total = np.sum([pictures.weighted[strategy] for strategy in of_length], axis=0)
        white = float(np.quantile(total, 0.99)) or float(total.max()) or 1.0
        bottom = (len(lengths) - 1 - row) * pitch_y + _GAP
        for side, kind in enumerate((pictures.raw, pictures.weighted)):
            for s, t in of_length:
                left = side * half + s * pitch_x + _GAP
                tile = sheet[bottom : bottom + tile_height, left : left + tile_width, :3]
                tile[:] = _shrunk(kind[s, t], step) / white
    return sheet


def _shrunk(picture: Float32, step: int) -> NDArray[np.floating]:
    """Means over blocks of `step` pixels a side, cut off at the upper and right edges."""
    rows, columns = (np.arange(0, size, step) for size in picture.shape[:2])
    sums = np.add.reduceat(np.add.reduceat(picture, rows, axis=0), columns, axis=1)
    counts = np.outer(np.diff(np.append(rows, picture.shape[0])), np.diff(np.append(columns, picture.shape[1])))
    return np.asarray(sums / counts[..., None])


def make_folder(folder: Path) -> None:
    """Makes the folder where it is missing; raises ImageError naming it where it cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ImageError(f"'{folder}': {error.strerror}") from error


def write_strategies(folder: Path, pictures: StrategyPictures) -> list[Path]:
    """Writes s2_t3_raw.exr, s2_t3_weighted.exr and so on and the contact sheet into `folder`, which it makes.

    Returns what it wrote. Raises ImageError naming the folder or file that cannot be written.
    """
    make_folder(folder)
    written = []
    for kind, found in (("raw", pictures.raw), ("weighted", pictures.weighted)):
        for (s, t), pixels in found.items():
            written.append(folder / f"s{s}_t{t}_{kind}.exr")
            write_image(written[-1], Image(pixels, {"strategy": [s, t, kind], "iterations": pictures.iterations}))
    written.append(folder / SHEET)
    write_image(written[-1], Image(contact_sheet(pictures)))
    return written

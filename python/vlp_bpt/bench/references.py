"""Converged pictures as independent batches, kept on disk: a file for each, so that making them can be interrupted."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vlp_bpt.render import Renderer, load_native
from vlp_bpt.scene import Scene
from vlp_bpt.settings import RenderSettings
from vlp_bpt.snapshot import scene_digest

FOLDER = Path("out/references")


def fingerprint(files: list[Path], settings: dict[str, Any]) -> str:
    """A short hash of the contents of files and of settings (JSON values)."""
    digest = hashlib.sha256(json.dumps(settings, sort_keys=True).encode())
    for file in files:
        digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


def batches(
    name: str, key: str, count: int, make: Callable[[int], NDArray[np.float32]], folder: Path = FOLDER
) -> NDArray[np.float32]:
    """(count, h, w, c): for each index, `make(index)` or what an earlier call with the same name and key stored."""
    folder.mkdir(parents=True, exist_ok=True)
    result = []
    for index in range(count):
        path = folder / f"{name}-{key}-{index}.npy"
        if not path.exists():
            partial = path.with_suffix(".partial.npy")
            np.save(partial, make(index))
            partial.replace(path)
        result.append(np.load(path, allow_pickle=False))
    return np.stack(result)


def native_file() -> Path:
    """The native core's file: what a kept picture of ours depends on besides its scene and settings."""
    return Path(load_native()._module.__file__)


def our_halves(
    name: str, scene: Scene, settings: dict[str, Any], seconds: float, folder: Path = FOLDER
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Two independent pictures of ours (h, w, 3), top row first, of `seconds` each; made once and kept."""
    window = RenderSettings(**settings, samples=1 << 30, time_limit=seconds)
    kept = {key: value for key, value in window.to_dict().items() if key not in ("threads", "seed")}
    film = scene.film.width, scene.film.height, scene.film.window  # the digest leaves it out
    key = fingerprint([native_file()], {"scene": scene_digest(scene), "film": film, **kept})

    def make(index: int) -> NDArray[np.float32]:
        print(f"{name}: {window.mode} reference, half {index + 1} of 2, {seconds:.0f} s, kept in {folder}/", flush=True)
        image = Renderer(scene, replace(window, seed=1001 + index)).render()
        return np.ascontiguousarray(image.pixels[::-1, :, :3])

    first, second = batches(f"{name}-{window.mode.lower()}", key, 2, make, folder)
    return first.astype(np.float64), second.astype(np.float64)


def cycles_batches(
    blend: Path, *, size: tuple[int, int], count: int, samples: int, scatterings: int, folder: Path = FOLDER
) -> NDArray[np.float32]:
    """(count, h, w, 3) linear RGB of Cycles under a box filter of one pixel, `samples` a pixel each; top row first.

    The batches are parts of one sequence: a short one has an error of its own (64 samples, whatever their seed, leave
    0.3 % along the edge of a lamp). They average out a little better than independent ones, so a test that takes them
    for such is on the safe side.
    """
    import bpy

    from . import cycles

    settings = {"cycles": bpy.app.version_string, "size": size, "samples": (count, samples), "scatterings": scatterings}
    opened: list[Any] = []

    def make(index: int) -> NDArray[np.float32]:
        if not opened:
            opened.append(cycles.open_scene(blend))
            cycles.set_size(opened[0], *size)
            opened[0].cycles.pixel_filter_type = "BOX"
        image = cycles.render(
            opened[0], samples=samples, scatterings=scatterings, first=index * samples, total=count * samples
        )
        return np.ascontiguousarray(image.pixels[..., :3])

    key = fingerprint([Path(blend), Path(cycles.__file__)], settings)
    return batches(f"{Path(blend).stem}-cycles", key, count, make, folder)


def mitsuba_batches(
    name: str, scene: Scene, *, count: int, samples: int, scatterings: int, folder: Path = FOLDER
) -> NDArray[np.float32]:
    """(count, h, w, 3) of Mitsuba, as `cycles_batches`; raises NotConvertible for a scene that it cannot render."""
    from . import mitsuba

    settings = {"scene": scene_digest(scene), "samples": samples, "scatterings": scatterings}
    key = fingerprint([Path(mitsuba.__file__)], settings | {"mitsuba": mitsuba.module().__version__})

    def make(index: int) -> NDArray[np.float32]:
        return mitsuba.render(scene, samples=samples, scatterings=scatterings, seed=index + 1)

    return batches(f"{name}-mitsuba", key, count, make, folder)

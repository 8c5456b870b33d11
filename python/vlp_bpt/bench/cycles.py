"""Cycles on the CPU as an unbiased renderer to compare with: everything off that trades truth for speed.

The path-length window. `scatterings` is the largest number of surface hits between the lens and the light, both ends
left out. Cycles' `max_bounces` = B evaluates direct light at B + 1 hits and the emission that one ray beyond them
finds, so B = scatterings - 1. Here an eye path of at most K hits with light samples alone (C = 0) has
scatterings = K; joined to light paths of at most L hits, K + L.
"""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vlp_bpt._blender import _console as quiet
from vlp_bpt.errors import Error


@dataclass(frozen=True)
class CyclesImage:
    """pixels (h, w, 4) float32, linear premultiplied RGBA, top row first; seconds of rendering alone, as Cycles stamps
    them (without reading the file, exporting the scene and building its BVH); samples per pixel."""

    pixels: NDArray[np.float32]
    seconds: float
    samples: int


def open_scene(blend: Path) -> Any:
    """Open a .blend and return its scene with Cycles chosen and set up without bias."""
    import bpy

    if not hasattr(bpy.types.Scene, "cycles"):
        import addon_utils

        addon_utils.enable("cycles")
    with quiet():
        bpy.ops.wm.open_mainfile(filepath=str(Path(blend).resolve()))
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.use_persistent_data = False
    scene.render.use_simplify = False
    scene.render.use_compositing = scene.render.use_sequencer = False
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = cycles.use_guiding = cycles.use_fast_gi = False
    cycles.time_limit = cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.light_sampling_threshold = 0.0  # it is roulette, not bias, but adds noise where light is dim
    cycles.transparent_max_bounces = 1024
    cycles.direct_light_sampling_type = "MULTIPLE_IMPORTANCE_SAMPLING"
    cycles.use_animated_seed = False
    cycles.pixel_filter_type, cycles.filter_width = "BLACKMAN_HARRIS", 1.5
    cycles.film_exposure = 1.0
    for shown in bpy.data.objects:  # no grazing light is left out on smooth surfaces
        shown.shadow_terminator_geometry_offset = shown.shadow_terminator_shading_offset = 0.0
    return scene


def set_size(scene: Any, width: int, height: int) -> None:
    """Render at another size, the whole frame."""
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = width, height, 100
    scene.render.use_border = False


def render(
    scene: Any,
    *,
    samples: int,
    scatterings: int,
    first: int = 0,
    total: int = 0,
    seed: int = 0,
    light_tree: bool = False,
    threads: int = 0,
) -> CyclesImage:
    """Render the samples `first` to `first + samples` of the `total` (0: just these) that one sequence has.

    Parts of one sequence average to the picture that it gives in one piece, so a render can be timed in slices without
    losing what Cycles gains by stratification.
    """
    import bpy

    cycles = scene.cycles
    total = total or first + samples
    cycles.samples, cycles.seed = total, seed
    cycles.use_sample_subset = (first, samples) != (0, total)
    cycles.sample_offset, cycles.sample_subset_length = first, samples
    cycles.use_light_tree = light_tree
    bounces = scatterings - 1
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = bounces
    scene.render.threads_mode = "FIXED" if threads else "AUTO"
    if threads:
        scene.render.threads = threads
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGBA", "32"
    settings.exr_codec = "NONE"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cycles.exr"
        scene.render.filepath = str(path)
        scene.render.use_file_extension = False
        with quiet():
            bpy.ops.render.render(write_still=True, scene=scene.name)
        return CyclesImage(*_read(path), samples)


def _read(path: Path) -> tuple[NDArray[np.float32], float]:
    """Pixels and the render time that the engine stamped into an EXR file."""
    import OpenImageIO

    image = OpenImageIO.ImageInput.open(str(path))
    if image is None:
        raise Error(f"Cycles wrote no image to '{path}'")
    spec = image.spec()
    pixels = np.ascontiguousarray(image.read_image(0, 0, 0, 4, OpenImageIO.FLOAT), np.float32)
    times = [
        str(a.value) for a in spec.extra_attribs if a.name.startswith("cycles.") and a.name.endswith(".render_time")
    ]
    image.close()
    if not times:
        raise Error(f"Cycles stamped no render time into '{path}'")
    return pixels, sum(map(parse_time, times))


def parse_time(text: str) -> float:
    """Seconds of H:M:S.f, M:S.f or S.f."""
    seconds = 0.0
    for part in text.split(":"):
        seconds = 60 * seconds + float(part)
    return seconds

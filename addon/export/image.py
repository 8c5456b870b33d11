"""Blender's images to arrays of linear radiance."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from vlp_bpt.scene import Float32

from .notes import Notes

MISSING = (1.0, 0.0, 1.0)  # Blender's sign for an image that cannot be read
LINEAR = ("Linear Rec.709", "Linear", "Non-Color", "Raw", "scene_linear")


def export_image(image: Any, owner: str, notes: Notes) -> Float32 | None:
    """(H, W, 3) linear colours, row 0 at the bottom; None, with a warning, where its file is absent or damaged.

    Blender gives the pixels of float images as linear values of its working space, those of others as they are encoded.
    Colours are multiplied by an alpha that is kept apart from them as Cycles does it: in bytes as encoded, and in float
    images only where they were made in Blender (before 5.0, not even there); float files come multiplied.
    """
    width, height = image.size  # reads the file
    if width == 0 or height == 0:
        notes.warn(f"{owner}: image '{image.name}' cannot be read from '{image.filepath}'")
        return None
    channels = image.channels
    pixels = np.empty(width * height * channels, np.float32)
    image.pixels.foreach_get(pixels)
    shaped = pixels.reshape(height, width, channels)
    colors = np.repeat(shaped[..., :1], 3, axis=2) if channels < 3 else np.ascontiguousarray(shaped[..., :3])
    apart = image.source == "GENERATED" and bpy.app.version >= (5, 0, 0) if image.is_float else True
    if channels == 4 and image.alpha_mode == "STRAIGHT" and apart:
        colors = colors * shaped[..., 3:]
    space = image.colorspace_settings.name
    if not image.is_float and space not in LINEAR:
        if space != "sRGB":
            notes.warn(f"{owner}: image '{image.name}' is read as sRGB, colour space {space} is not there yet")
        colors = np.where(colors <= 0.04045, colors / 12.92, ((colors + 0.055) / 1.055) ** 2.4).astype(np.float32)
    return colors

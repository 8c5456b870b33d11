"""Blender's own panels that VLP-BPT takes over: those of every engine, and a few of EEVEE's that mean the same here."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

ENGINE_ID = "VLP_BPT"

# Panels for every engine that say nothing here: previews, and what our own panels show.
LEFT_OUT = {
    "DATA_PT_falloff_curve",
    "DATA_PT_light",
    "DATA_PT_preview",
    "DATA_PT_spot",
    "MATERIAL_PT_preview",
    "NODE_DATA_PT_light",
    "NODE_DATA_PT_spot",
    "RENDER_PT_color_management_working_space",
    "RENDER_PT_simplify",
    "RENDER_PT_simplify_render",
    "RENDER_PT_simplify_viewport",
    "TEXTURE_PT_preview",
    "VIEWLAYER_PT_filter",
    "VIEWLAYER_PT_layer_passes",
    "WORLD_PT_preview",
}

# Panels of EEVEE alone that edit what VLP-BPT reads. Names that a version does not have are skipped.
TAKEN = {
    "DATA_PT_camera_dof",
    "DATA_PT_camera_dof_aperture",
    "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_surface",
    "EEVEE_WORLD_PT_surface",
}


def panels() -> Iterator[Any]:
    """Every panel class that VLP-BPT shares with other engines."""
    for panel in _subclasses(bpy.types.Panel):
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if engines is None or panel.__module__.startswith(__package__ or ""):
            continue
        name = panel.__name__
        if name in TAKEN or ("BLENDER_RENDER" in engines and name not in LEFT_OUT):
            yield panel


def _subclasses(cls: Any) -> Iterator[Any]:
    for subclass in cls.__subclasses__():
        yield subclass
        yield from _subclasses(subclass)


def register() -> None:
    for panel in panels():
        panel.COMPAT_ENGINES.add(ENGINE_ID)


def unregister() -> None:
    for panel in panels():
        panel.COMPAT_ENGINES.discard(ENGINE_ID)

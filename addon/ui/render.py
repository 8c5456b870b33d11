"""Render properties: sampling, light paths, film, performance, and what the last render took."""

from __future__ import annotations

from typing import Any

import bpy

from .. import figures
from .reuse import ENGINE_ID


class _RenderPanel:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = {ENGINE_ID}

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.engine in cls.COMPAT_ENGINES

    def column(self, context: Any) -> tuple[Any, Any]:
        """A column of properties, and the settings."""
        layout = self.layout  # type: ignore[attr-defined]
        layout.use_property_split = True
        layout.use_property_decorate = False
        return layout.column(), context.scene.vlp_bpt


class VLP_BPT_PT_sampling(_RenderPanel, bpy.types.Panel):
    bl_label = "Sampling"

    def draw(self, context: Any) -> None:
        column, settings = self.column(context)
        column.prop(settings, "mode")
        column.separator()
        column.prop(settings, "samples")
        column.prop(settings, "time_limit")
        column.prop(settings, "noise_threshold")
        column.prop(settings, "adaptive")
        column.prop(settings, "seed")
        column.separator()
        column.prop(settings, "denoise")
        prefilter = column.column()
        prefilter.active = settings.denoise
        prefilter.prop(settings, "denoise_prefilter")


class VLP_BPT_PT_light_paths(_RenderPanel, bpy.types.Panel):
    bl_label = "Light Paths"

    def draw(self, context: Any) -> None:
        column, settings = self.column(context)
        bounces = column.column(align=True)
        bounces.prop(settings, "light_path_length")
        bounces.prop(settings, "eye_path_length")
        column.separator()
        column.prop(settings, "light_paths")
        hits = column.column(align=True)
        hits.prop(settings, "vlp_connections")
        hits.prop(settings, "vlp_candidates")
        hits.prop(settings, "light_samples")
        column.separator()
        column.prop(settings, "splats")
        column.prop(settings, "roulette")
        clamps = column.column(align=True)
        clamps.prop(settings, "clamp_direct")
        clamps.prop(settings, "clamp_indirect")


class VLP_BPT_PT_strategies(_RenderPanel, bpy.types.Panel):
    bl_label = "Strategies"
    bl_parent_id = "VLP_BPT_PT_light_paths"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        column, settings = self.column(context)
        column.prop(settings, "weighting")
        column.prop(settings, "hits")


class VLP_BPT_PT_film(_RenderPanel, bpy.types.Panel):
    bl_label = "Film"

    def draw(self, context: Any) -> None:
        column, settings = self.column(context)
        column.prop(settings, "filter")
        column.prop(settings, "filter_width")
        column.prop(context.scene.render, "film_transparent", text="Transparent")


class VLP_BPT_PT_performance(_RenderPanel, bpy.types.Panel):
    bl_label = "Performance"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        column, settings = self.column(context)
        column.prop(settings, "device")
        column.prop(settings, "threads")
        column.prop(context.scene.render, "use_persistent_data", text="Keep Data")


class VLP_BPT_PT_simplify(_RenderPanel, bpy.types.Panel):
    """In place of Blender's own, which would come first."""

    bl_label = "Simplify"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context: Any) -> None:
        self.layout.prop(context.scene.render, "use_simplify", text="")

    def draw(self, context: Any) -> None:
        column, _ = self.column(context)
        render = context.scene.render
        column.active = render.use_simplify
        for use, subdivision, particles in (
            ("Viewport", "simplify_subdivision", "simplify_child_particles"),
            ("Render", "simplify_subdivision_render", "simplify_child_particles_render"),
        ):
            values = column.column(align=True)
            values.prop(render, subdivision, text=f"Max Subdivision {use}")
            values.prop(render, particles, text="Max Child Particles")


class VLP_BPT_PT_statistics(_RenderPanel, bpy.types.Panel):
    bl_label = "Statistics"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Any) -> None:
        layout = self.layout
        shown = {layer: rows for (scene, layer), rows in figures.last.items() if scene == context.scene.name}
        if not shown:
            layout.label(text="Nothing was rendered yet")
        for layer, rows in shown.items():
            column = layout.column(align=True)
            if len(shown) > 1:
                column.label(text=layer, icon="RENDERLAYERS")
            for label, value in rows:
                if label == "Warning":
                    column.label(text=value, icon="ERROR")
                    continue
                split = column.split(factor=0.4)
                name = split.row()
                name.alignment = "RIGHT"
                name.label(text=label)
                split.label(text=value)


CLASSES = (
    VLP_BPT_PT_sampling,
    VLP_BPT_PT_light_paths,
    VLP_BPT_PT_strategies,
    VLP_BPT_PT_film,
    VLP_BPT_PT_performance,
    VLP_BPT_PT_simplify,
    VLP_BPT_PT_statistics,
)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
    figures.last.clear()

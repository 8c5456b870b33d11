"""Panels of lights and objects whose Blender counterparts belong to Cycles or EEVEE."""

from __future__ import annotations

from typing import Any

import bpy

from .reuse import ENGINE_ID

# Objects that the camera can be kept from seeing.
VISIBLE_TYPES = {"MESH", "CURVE", "SURFACE", "META", "FONT", "POINTCLOUD", "LIGHT"}


class VLP_BPT_PT_light(bpy.types.Panel):
    bl_label = "Light"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"
    COMPAT_ENGINES = {ENGINE_ID}

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.light is not None and context.engine in cls.COMPAT_ENGINES

    def draw(self, context: Any) -> None:
        light, layout = context.light, self.layout
        layout.row().prop(light, "type", expand=True)
        layout.use_property_split = True
        column = layout.column()
        column.prop(light, "color", text="Tint" if light.use_temperature else "Color")
        column.prop(light, "use_temperature", text="By Temperature")
        if light.use_temperature:
            column.prop(light, "temperature")
        column.separator()
        column.prop(light, "energy", text="Strength" if light.type == "SUN" else "Power")
        column.prop(light, "exposure")
        column.prop(light, "normalize")
        column.separator()
        self._shape(light, layout.column())

    def _shape(self, light: Any, column: Any) -> None:
        if light.type == "SUN":
            column.prop(light, "angle")
        elif light.type == "AREA":
            column.prop(light, "shape")
            two = light.shape in {"RECTANGLE", "ELLIPSE"}
            sizes = column.column(align=True)
            sizes.prop(light, "size", text="Size X" if two else "Size")
            if two:
                sizes.prop(light, "size_y", text="Y")
            column.prop(light, "spread")
        else:
            column.prop(light, "shadow_soft_size", text="Radius")
            if light.type == "SPOT":
                column.prop(light, "spot_size", text="Cone")
                column.prop(light, "spot_blend", text="Blend", slider=True)


class VLP_BPT_PT_ray_visibility(bpy.types.Panel):
    bl_label = "Ray Visibility"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "object"
    bl_parent_id = "OBJECT_PT_visibility"
    COMPAT_ENGINES = {ENGINE_ID}

    @classmethod
    def poll(cls, context: Any) -> bool:
        shown = context.object is not None and context.object.type in VISIBLE_TYPES
        return shown and context.engine in cls.COMPAT_ENGINES

    def draw(self, context: Any) -> None:
        self.layout.use_property_split = True
        self.layout.prop(context.object, "visible_camera", text="Camera")


CLASSES = (VLP_BPT_PT_light, VLP_BPT_PT_ray_visibility)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)

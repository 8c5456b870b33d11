"""The render engine that Blender sees; what it does is in `final`."""

from __future__ import annotations

from typing import Any

import bpy

from . import final

ENGINE_ID = "VLP_BPT"


class VLP_BPT_RenderEngine(bpy.types.RenderEngine):
    bl_idname = ENGINE_ID
    bl_label = "VLP-BPT"
    bl_use_preview = False
    bl_use_eevee_viewport = True  # Material Preview in the viewport is EEVEE's
    bl_use_shading_nodes_custom = False  # Blender's own shader nodes

    # Blender makes the object twice, with its own arguments, and drops it on another thread: nothing is kept here.
    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)

    def update_render_passes(self, scene: Any = None, renderlayer: Any = None) -> None:
        self.register_pass(scene, renderlayer, "Combined", 4, "RGBA", "COLOR")
        if scene.vlp_bpt.denoise:  # under Cycles' names
            self.register_pass(scene, renderlayer, "Noisy Image", 4, "RGBA", "COLOR")
            self.register_pass(scene, renderlayer, "Denoising Albedo", 3, "RGB", "COLOR")
            self.register_pass(scene, renderlayer, "Denoising Normal", 3, "XYZ", "VECTOR")

    def render(self, depsgraph: Any) -> None:
        final.render(self, depsgraph)


def register() -> None:
    bpy.utils.register_class(VLP_BPT_RenderEngine)


def unregister() -> None:
    final.stop_all()
    bpy.utils.unregister_class(VLP_BPT_RenderEngine)

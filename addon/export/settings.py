"""The settings at `scene.vlp_bpt` to `vlp_bpt.RenderSettings`."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from vlp_bpt.settings import RenderSettings


def export_settings(scene: Any) -> RenderSettings:
    """Every setting by its own name, the same on both sides. Raises `vlp_bpt.SettingsError` for a wrong value.

    Without a number of threads of its own, the render takes the one of Blender's (`blender -t`).
    """
    values = {field.name: _typed(getattr(scene.vlp_bpt, field.name)) for field in fields(RenderSettings)}
    if values["threads"] == 0 and scene.render.threads_mode == "FIXED":
        values["threads"] = scene.render.threads
    return RenderSettings.from_dict(values)


def _typed(value: Any) -> Any:
    """A setting as it was typed: Blender keeps numbers in single precision, where 0.01 is a little less than that."""
    return float(str(np.float32(value))) if isinstance(value, float) else value

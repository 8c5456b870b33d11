"""The settings at `scene.vlp_bpt` to `vlp_bpt.RenderSettings`."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

from vlp_bpt.settings import RenderSettings


def export_settings(properties: Any) -> RenderSettings:
    """Every setting by its own name, which is the same on both sides. Raises `vlp_bpt.SettingsError` as a check."""
    return RenderSettings.from_dict({field.name: getattr(properties, field.name) for field in fields(RenderSettings)})

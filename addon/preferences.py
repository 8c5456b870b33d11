"""The add-on's preferences: which devices there are to render with."""

from __future__ import annotations

from typing import Any

import bpy

from . import core


def device_lines() -> list[tuple[str, str]]:
    """(icon, text) for each device of this machine, or for what keeps them from being found."""
    try:
        devices = core.load().devices()
    except Exception as error:  # the preferences stay usable whatever the core says
        return [("ERROR", str(error))]
    return [("CHECKMARK", describe(device)) for device in devices]


def describe(device: dict[str, Any]) -> str:
    """A device in a line: kind, name, instruction set and memory as far as they are known."""
    parts = [f"{device['kind']}: {device['name']}"]
    if device.get("isa"):
        parts.append(str(device["isa"]))
    if device.get("memory"):
        parts.append(f"{device['memory'] / 2**30:.1f} GB")
    return ", ".join(parts)


class VLP_BPT_Preferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    def draw(self, context: Any) -> None:
        column = self.layout.column()
        column.label(text="Devices that VLP-BPT can render with:")
        for icon, text in _devices():
            column.label(text=text, icon=icon)
        column.label(text="Each scene chooses among them in its render properties, under Performance.")


_found: list[tuple[str, str]] = []


def _devices() -> list[tuple[str, str]]:
    """Asked for once: drawing happens many times a second."""
    if not _found:
        _found.extend(device_lines())
    return _found


def register() -> None:
    bpy.utils.register_class(VLP_BPT_Preferences)


def unregister() -> None:
    bpy.utils.unregister_class(VLP_BPT_Preferences)
    _found.clear()

"""VLP-BPT for Blender: bidirectional path tracing with virtual light points, as a render engine."""

from __future__ import annotations

from . import engine, preferences, properties, ui

MODULES = (properties, preferences, engine, ui)


def register() -> None:
    for module in MODULES:
        module.register()


def unregister() -> None:
    for module in reversed(MODULES):
        module.unregister()

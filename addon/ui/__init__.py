"""Panels: our own, and Blender's that fit."""

from __future__ import annotations

from . import datablocks, render, reuse

MODULES = (render, datablocks, reuse)


def register() -> None:
    for module in MODULES:
        module.register()


def unregister() -> None:
    for module in reversed(MODULES):
        module.unregister()

"""The scene's world to `vlp_bpt.World`: a constant radiance from every direction."""

from __future__ import annotations

from typing import Any

import bpy

from vlp_bpt.scene import World

from .nodes import Graph, label
from .notes import Notes


def export_world(world: Any, notes: Notes) -> World:
    """The world's Background, colour times strength; black without a world or without a surface."""
    if world is None:
        return World()
    if world.node_tree is None or (bpy.app.version < (5, 0, 0) and not world.use_nodes):
        return World(world.name, tuple(world.color))
    graph = Graph(world, "World", notes)
    if graph.output("Volume") is not None:
        notes.warn(f"{graph.owner}: volumes are not there yet")
    place = graph.output("Surface")
    if place is None:
        return World(world.name)
    if place.socket.type != "SHADER":
        color, strength = graph.color(place), 1.0
    elif place.node.bl_idname in ("ShaderNodeBackground", "ShaderNodeEmission"):
        color, strength = graph.color(place.input("Color")), graph.number(place.input("Strength"))
    else:
        notes.warn(f"{graph.owner}: {label(place.node)} is not there yet, the world stays black")
        return World(world.name)
    return World(world.name, tuple(max(channel * strength, 0.0) for channel in color))  # type: ignore[arg-type]

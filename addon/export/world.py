"""The scene's world to `vlp_bpt.World`: a constant radiance from every direction."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from vlp_bpt.scene import World

from .nodes import Graph, Place, label
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
    radiance = _radiance(graph, graph.output("Surface"))
    if (radiance < 0).any():
        notes.warn(f"{graph.owner}: negative light is not there yet, taken as zero")
    red, green, blue = (float(channel) for channel in np.maximum(radiance, 0.0))
    return World(world.name, (red, green, blue))


def _radiance(graph: Graph, place: Place | None) -> NDArray[np.float64]:
    """(3,) what the shader at an output sends from every direction; black where there is none."""
    if place is None:
        return np.zeros(3)
    if place.socket.type != "SHADER":
        return np.array(graph.color(place))
    kind = place.node.bl_idname
    if kind in ("ShaderNodeBackground", "ShaderNodeEmission"):
        return np.array(graph.color(place.input("Color"))) * graph.number(place.input("Strength"))
    if kind in ("ShaderNodeAddShader", "ShaderNodeMixShader"):
        first, second = (_radiance(graph, graph.input_source(place, name)) for name in ("Shader", "Shader_001"))
        factor = min(max(graph.number(place.input("Fac")), 0.0), 1.0)
        return first + second if kind == "ShaderNodeAddShader" else (1.0 - factor) * first + factor * second
    graph.notes.warn(f"{graph.owner}: {label(place.node)} is not there yet, black stands in for it")
    return np.zeros(3)

"""The scene's world to `vlp_bpt.World`: radiance from every direction, constant or an equirectangular picture."""

from __future__ import annotations

from typing import Any

import bpy
import mathutils
import numpy as np

from vlp_bpt.scene import Float32, World

from .image import export_image
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
    place = graph.output("Surface")
    if place is None:
        return World(world.name)
    if place.socket.type != "SHADER":
        return _world(graph, world.name, place, 1.0)
    if place.node.bl_idname in ("ShaderNodeBackground", "ShaderNodeEmission"):
        return _world(graph, world.name, place.input("Color"), graph.number(place.input("Strength")))
    notes.warn(f"{graph.owner}: {label(place.node)} is not there yet, the world stays black")
    return World(world.name)


def _world(graph: Graph, name: str, color: Place | None, strength: float) -> World:
    """The world that shines with what feeds `color`, times `strength`."""
    source = None if color is None else graph.source(color)
    if source is not None and source.node.bl_idname == "ShaderNodeTexEnvironment":
        picture = _picture(graph, source)
        factor = max(strength, 0.0)
        if picture is not None:
            image, rotation = picture
            return World(name, (factor, factor, factor), image, rotation)
    red, green, blue = (max(channel * strength, 0.0) for channel in graph.color(color))
    return World(name, (red, green, blue))


def _picture(graph: Graph, place: Place) -> tuple[Float32, Float32] | None:
    """An Environment Texture's pixels and the rotation to it, or None where it can only be replaced by a constant."""
    node = place.node
    if node.projection != "EQUIRECTANGULAR":
        graph.notes.warn(f"{graph.owner}: {label(node)} with projection {node.projection} is not there yet")
        return None
    if node.interpolation not in ("Linear", "Cubic", "Smart"):
        graph.notes.warn(f"{graph.owner}: {label(node)} is interpolated linearly, not as {node.interpolation}")
    rotation = _rotation(graph, place.input("Vector"))
    if node.image is None:
        return np.array([[(1.0, 0.0, 1.0)]], np.float32), rotation  # as Blender shows an image that is absent
    return np.maximum(export_image(node.image, graph.owner, graph.notes), 0.0), rotation


def _rotation(graph: Graph, vector: Place | None) -> Float32:
    """(3, 3) from directions of the world to what a Mapping node makes of them."""
    identity = np.eye(3, dtype=np.float32)
    source = None if vector is None else graph.source(vector)
    if source is None or (source.node.bl_idname == "ShaderNodeTexCoord" and source.socket.identifier == "Generated"):
        return identity
    if source.node.bl_idname != "ShaderNodeMapping":
        graph.notes.warn(f"{graph.owner}: {label(source.node)} does not move the picture yet")
        return identity
    node = source.node
    angles, scale = graph.color(source.input("Rotation")), graph.color(source.input("Scale"), (1.0, 1.0, 1.0))
    moves = node.vector_type in ("POINT", "TEXTURE") and any(graph.color(source.input("Location")))
    if moves or len(set(scale)) > 1 or scale[0] <= 0:
        graph.notes.warn(f"{graph.owner}: {label(node)} rotates the picture, it does not move or scale it yet")
    turned = np.array(mathutils.Euler(angles).to_matrix(), dtype=np.float32)
    inner = _rotation(graph, source.input("Vector"))
    return (turned.T if node.vector_type == "TEXTURE" else turned) @ inner

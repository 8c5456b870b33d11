"""The scene's world to `vlp_bpt.World`: radiance from every direction, constant or an equirectangular picture."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import bpy
import mathutils
import numpy as np
from numpy.typing import NDArray

from vlp_bpt.scene import Float32, World

from .image import MISSING, export_image
from .nodes import Graph, Place, label
from .notes import Notes


@dataclass(frozen=True)
class Shine:
    """What a shader sends from every direction: `constant` (3,), and `strength` times a picture where it has one.

    image: (H, W, 3), rotation: (3, 3), as in `vlp_bpt.World`.
    """

    constant: NDArray[np.float64]
    strength: float = 0.0
    image: Float32 | None = None
    rotation: Float32 = field(default_factory=lambda: np.eye(3, dtype=np.float32))

    def __mul__(self, factor: float) -> Shine:
        return Shine(self.constant * factor, self.strength * factor, self.image, self.rotation)


BLACK = Shine(np.zeros(3))


def export_world(world: Any, notes: Notes) -> World:
    """The world's Background, colour times strength; black without a world or without a surface."""
    if world is None:
        return World()
    if world.node_tree is None or (bpy.app.version < (5, 0, 0) and not world.use_nodes):
        return World(world.name, tuple(world.color))
    graph = Graph(world, "World", notes)
    if graph.output("Volume") is not None:
        notes.warn(f"{graph.owner}: volumes are not there yet")
    shine = _shader(graph, graph.output("Surface"))
    radiance = shine.constant
    picture = None
    if shine.image is not None:
        picture = shine.image * np.float32(shine.strength) + radiance.astype(np.float32)
    if ((radiance if picture is None else picture) < 0).any():
        notes.warn(f"{graph.owner}: negative light is not there yet, taken as zero")
    if picture is not None:
        return World(world.name, (1.0, 1.0, 1.0), np.maximum(picture, 0.0), shine.rotation)
    red, green, blue = (float(channel) for channel in np.maximum(radiance, 0.0))
    return World(world.name, (red, green, blue))


def _shader(graph: Graph, place: Place | None) -> Shine:
    """What the shader at an output sends; black where there is none."""
    if place is None:
        return BLACK
    if place.socket.type != "SHADER":
        return _color(graph, place)
    kind = place.node.bl_idname
    if kind in ("ShaderNodeBackground", "ShaderNodeEmission"):
        return _color(graph, place.input("Color")) * graph.number(place.input("Strength"))
    if kind in ("ShaderNodeAddShader", "ShaderNodeMixShader"):
        first, second = (_shader(graph, graph.input_source(place, name)) for name in ("Shader", "Shader_001"))
        factor = min(max(graph.number(place.input("Fac")), 0.0), 1.0)
        both = (first, second) if kind == "ShaderNodeAddShader" else (first * (1.0 - factor), second * factor)
        return _add(graph, *both)
    graph.notes.warn(f"{graph.owner}: {label(place.node)} is not there yet, black stands in for it")
    return BLACK


def _add(graph: Graph, first: Shine, second: Shine) -> Shine:
    """The sum of two; of two pictures, both must be turned alike and of one size."""
    constant = first.constant + second.constant
    if second.image is None:
        return Shine(constant, first.strength, first.image, first.rotation)
    if first.image is None:
        return Shine(constant, second.strength, second.image, second.rotation)
    if first.image.shape == second.image.shape and np.array_equal(first.rotation, second.rotation):
        image = first.image * np.float32(first.strength) + second.image * np.float32(second.strength)
        return Shine(constant, 1.0, image, first.rotation)
    graph.notes.warn(f"{graph.owner}: a second image of another size or rotation is its mean colour")
    return Shine(constant + second.strength * _mean(second.image), first.strength, first.image, first.rotation)


def _mean(image: Float32) -> NDArray[np.float64]:
    """(3,) the mean over directions: rows are smaller towards the poles."""
    weights = np.sin((np.arange(len(image)) + 0.5) * np.pi / len(image))
    return np.average(image.mean(axis=1, dtype=np.float64), axis=0, weights=weights)


def _color(graph: Graph, color: Place | None) -> Shine:
    """What feeds a colour input."""
    source = None if color is None else color if color.socket.is_output else graph.source(color)
    if source is None or source.node.bl_idname != "ShaderNodeTexEnvironment":
        return Shine(np.array(graph.color(color)))
    node = source.node
    if node.image is None:
        graph.notes.warn(f"{graph.owner}: {label(node)} has no image")
        return Shine(np.array(MISSING))
    image = export_image(node.image, graph.owner, graph.notes)
    if image is None:
        return Shine(np.array(MISSING))
    if node.projection != "EQUIRECTANGULAR":
        graph.notes.warn(f"{graph.owner}: {label(node)}: a mirror ball is not there yet, its mean stands in")
        return Shine(image.mean(axis=(0, 1), dtype=np.float64))
    if node.interpolation == "Closest":
        graph.notes.warn(f"{graph.owner}: {label(node)} is interpolated linearly, Closest is not there yet")
    return Shine(np.zeros(3), 1.0, image, _rotation(graph, source.input("Vector")))


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
        graph.notes.warn(f"{graph.owner}: {label(node)} turns the picture, it does not move or scale it yet")
    turned = np.array(mathutils.Euler(angles).to_matrix(), dtype=np.float32)
    inner = _rotation(graph, source.input("Vector"))
    return (turned.T if node.vector_type == "TEXTURE" else turned) @ inner

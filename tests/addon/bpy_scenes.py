"""Small scenes for the tests, made through bpy."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from addon.export.notes import Notes
from addon.export.scene import export_scene

TRIANGLE = ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])


def link(name: str, data: Any) -> Any:
    """A new object with this data in the scene's own collection."""
    shown = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(shown)
    return shown


def mesh(name: str = "Triangle", source: tuple[Any, Any, Any] = TRIANGLE) -> Any:
    data = bpy.data.meshes.new(name)
    data.from_pydata(*source)
    return data


def camera(**settings: Any) -> Any:
    """The scene's camera, 5 m above the origin and looking down."""
    shown = link("Camera", bpy.data.cameras.new("Camera"))
    shown.location = (0, 0, 5)
    for name, value in settings.items():
        setattr(shown.data, name, value)
    bpy.context.scene.camera = shown
    return shown


def light(kind: str, **settings: Any) -> Any:
    """A lamp 2 m above the origin."""
    shown = link(kind.title(), bpy.data.lights.new(kind.title(), kind))
    shown.location = (0, 0, 2)
    for name, value in settings.items():
        setattr(shown.data, name, value)
    return shown


def material(name: str, *nodes: str) -> tuple[Any, list[Any]]:
    """A material with an output and these nodes, the first of them linked to its surface."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    added = [tree.nodes.new(node) for node in nodes]
    if added and added[0].outputs:  # a group has none before its tree is set
        tree.links.new(added[0].outputs[0], output.inputs["Surface"])
    return made, added


def plane(made: Any = None, size: float = 4.0) -> Any:
    """A square in the xy plane with a material."""
    half = size / 2
    corners = [(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)]
    shown = link("Plane", mesh("Plane", (corners, [], [(0, 1, 2, 3)])))
    if made is not None:
        shown.data.materials.append(made)
    return shown


def export(notes: Notes | None = None, **options: Any) -> Any:
    """The evaluated scene as the add-on exports it, with a camera where it has none."""
    if bpy.context.scene.camera is None:
        camera()
    return export_scene(bpy.context.evaluated_depsgraph_get(), notes=notes, **options)


def socket(node: Any, identifier: str) -> Any:
    """A node's input by its identifier: names change between versions."""
    return next(item for item in node.inputs if item.identifier == identifier)


def triangle_points(geometry: Any) -> Any:
    """(T, 3, 3) corner positions of an exported mesh."""
    return np.asarray(geometry.positions)[geometry.triangles]

"""Follows links through a shader tree: reroutes, groups and muted nodes, on every Blender version.

Blender 5.0 and later inline groups, repeat zones and closures themselves (`InlineShaderNodes`); 4.5 leaves it to us.
Sockets are addressed by identifier: their names change between versions.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import bpy

from .constants import FOLDABLE, Color, Value, as_color, as_number
from .notes import Notes

# Nodes that a link passes straight through are followed at most this often: a tree that loops ends.
MAX_STEPS = 1000


@dataclass(frozen=True)
class Place:
    """A socket, and the group nodes (outermost first) that it lies in."""

    socket: Any
    groups: tuple[Any, ...] = ()

    @property
    def node(self) -> Any:
        return self.socket.node

    def input(self, identifier: str) -> Place | None:
        """The input socket of this socket's node, or None where this version's node has none of that name."""
        for socket in self.socket.node.inputs:
            if socket.identifier == identifier:
                return Place(socket, self.groups)
        return None


class Graph:
    """The shader tree of a material, world or light: what is linked where, and the constants that come out."""

    def __init__(self, datablock: Any, kind: str, notes: Notes) -> None:
        self.owner = f"{kind} '{datablock.name}'"
        self.notes = notes
        self.tree, self._inline = _inlined(datablock, kind)
        self._links: dict[int, dict[int, Any]] = {}

    def output(self, identifier: str) -> Place | None:
        """What is linked to an input of the tree's active output node, or None."""
        node = self.tree.get_output_node("CYCLES")
        for socket in node.inputs if node else ():
            if socket.identifier == identifier:
                return self.source(Place(socket))
        return None

    def source(self, place: Place) -> Place | None:
        """The output socket that feeds an input, or None where it stands on its own value."""
        found = self._follow(place)
        return found if found.socket.is_output else None

    def input_source(self, place: Place, identifier: str) -> Place | None:
        """The output socket that feeds an input of this socket's node, or None."""
        socket = place.input(identifier)
        return None if socket is None else self.source(socket)

    def number(self, place: Place | None, default: float = 0.0) -> float:
        """The constant at an input as a number; `default` where the node has no such input."""
        return default if place is None else as_number(self._value(place))

    def color(self, place: Place | None, default: Color = (0.0, 0.0, 0.0)) -> Color:
        """The constant at an input as a colour; `default` where the node has no such input."""
        return default if place is None else as_color(self._value(place))

    def _value(self, place: Place) -> Value:
        """The constant at a socket: its own, or folded where the nodes before it are constant.

        What is not constant is replaced by its nearest constant, the socket's own, and reported once.
        """
        found = self._follow(place)
        if not found.socket.is_output:
            return own_value(found.socket)
        fold = FOLDABLE.get(found.node.bl_idname)
        value = fold(self, found) if fold else None
        if value is None:
            self.notes.warn(f"{self.owner}: {label(found.node)} is not there yet, a constant stands in for it")
            return own_value(place.socket)
        return value

    def _follow(self, place: Place) -> Place:
        """From an input to what feeds it: an output of a node that does something, or an input with its own value."""
        for _ in range(MAX_STEPS):
            if place.socket.is_output:
                step = self._through(place)
                if step is None:
                    return place
            else:
                step = self._linked(place)
                if step is None:
                    return place
            place = step
        self.notes.warn(f"{self.owner}: the node tree links back to itself")
        return place

    def _linked(self, place: Place) -> Place | None:
        """The output that is linked to an input, if any."""
        tree = place.socket.id_data
        key = tree.as_pointer()
        if key not in self._links:
            live = (link for link in tree.links if not link.is_muted and link.is_valid)
            self._links[key] = {link.to_socket.as_pointer(): link.from_socket for link in live}
        source = self._links[key].get(place.socket.as_pointer())
        return None if source is None else Place(source, place.groups)

    def _through(self, place: Place) -> Place | None:
        """The input that an output hands on unchanged, or None where its node does something."""
        node, identifier = place.node, place.socket.identifier
        if node.mute:
            for link in node.internal_links:
                if link.to_socket == place.socket:
                    return Place(link.from_socket, place.groups)
            return None
        if node.bl_idname == "NodeReroute":
            return Place(node.inputs[0], place.groups)
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
            outputs = [inner for inner in node.node_tree.nodes if inner.bl_idname == "NodeGroupOutput"]
            for inner in sorted(outputs, key=lambda inner: not inner.is_active_output):
                for socket in inner.inputs:
                    if socket.identifier == identifier:
                        return Place(socket, (*place.groups, node))
            return None
        if node.bl_idname == "NodeGroupInput" and place.groups:
            for socket in place.groups[-1].inputs:
                if socket.identifier == identifier:
                    return Place(socket, place.groups[:-1])
        return None


def _inlined(datablock: Any, kind: str) -> tuple[Any, Any]:
    """The datablock's tree without groups where Blender can do that; the second value keeps the first alive."""
    inline = getattr(bpy.types, "InlineShaderNodes", None)
    if inline is None:
        return datablock.node_tree, None
    flat = getattr(inline, f"from_{kind.lower()}")(datablock)
    return flat.node_tree, flat


def own_value(socket: Any) -> Value:
    """An unlinked socket's value; black where it has none (a shader, or a normal that means the surface's own)."""
    value = getattr(socket, "default_value", None)
    if value is None or isinstance(value, str):
        return 0.0
    return (value[0], value[1], value[2]) if hasattr(value, "__len__") else float(value)


def label(node: Any) -> str:
    """A node as the artist sees it: its type, and its name where that says more.

    Blender puts a number before the names of nodes in an inlined tree.
    """
    kind, name = node.bl_label or node.bl_idname, re.sub(r"^\d+_", "", node.name)
    return f"node {kind}" if name.split(".")[0] == kind else f"node {kind} ('{name}')"

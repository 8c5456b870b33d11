"""Blender's lamps to `vlp_bpt` lights: watts and metres with Cycles' conventions."""

from __future__ import annotations

import math
from typing import Any

import bpy
import numpy as np

from vlp_bpt.scene import AreaLight, Float32, Light, PointLight, Rgb, SpotLight, SunLight, Visibility

from .camera import rigid
from .nodes import Graph, label
from .notes import Notes

LEAST_SPREAD = math.radians(0.1)  # of an area light: what stands for zero, as good as parallel


def export_light(lamp: bpy.types.Object, matrix: Float32, visibility: Visibility, notes: Notes) -> Light | None:
    """The lamp placed by `matrix` (3, 4), or None where it gives no light."""
    data, name = lamp.data, lamp.name
    owner = f"Light '{name}'"
    if data.type == "AREA" and getattr(getattr(data, "cycles", None), "is_portal", False):
        return None
    strength = _strength(data, notes)
    if min(strength) < 0:
        notes.warn(f"{owner}: negative power is not there yet, taken as zero")
    strength = tuple(max(channel, 0.0) for channel in strength)  # type: ignore[assignment]
    if not np.isfinite(strength).all():
        notes.warn(f"{owner}: its power {strength} is not a number, the light is left out")
        return None
    if max(strength) == 0:
        return None
    if not data.use_shadow:
        notes.warn(f"{owner}: shadows cannot be turned off yet")
    if data.type == "AREA":
        return _area(name, data, matrix, strength, visibility, notes)
    transform = rigid(matrix)
    if data.type != "POINT" and not transform[:, 2].any():
        notes.warn(f"{owner}: scaled to nothing it has no direction, the light is left out")
        return None
    if data.type == "SUN":
        return SunLight(name, transform, _sun_irradiance(data, strength), data.angle, visibility)
    radius = float(data.shadow_soft_size)
    # Without normalization the strength is pi times the radiance of the sphere; Cycles has a point stand for 1/pi m².
    area = 4.0 * math.pi * radius * radius if radius > 0 else 4.0
    power = strength if data.normalize else _scaled(strength, area)
    if data.type == "SPOT":
        return SpotLight(name, transform, power, _cone(name, data, matrix, notes), data.spot_blend, radius, visibility)
    position = (float(matrix[0, 3]), float(matrix[1, 3]), float(matrix[2, 3]))
    return PointLight(name, position, power, radius, visibility)


def _sun_irradiance(data: Any, strength: Rgb) -> Rgb:
    """Without normalization the strength is the radiance of the sun's disc, which covers pi sin² of half its angle."""
    if data.normalize or data.angle == 0:
        return strength
    return _scaled(strength, math.pi * math.sin(min(data.angle, math.pi) / 2.0) ** 2)


def _cone(name: str, data: Any, matrix: Float32, notes: Notes) -> float:
    """A spot's full angle: scaling it along its axis or across it makes the cone narrower or wider."""
    x, y, z = np.linalg.norm(np.asarray(matrix, np.float64)[:, :3], axis=0)
    if abs(x - y) > 1e-3 * x:
        notes.warn(f"Light '{name}': a spot scaled to an ellipse is not there yet, its cone stays round")
    if z <= 0 or math.isclose(math.sqrt(x * y), z, rel_tol=1e-5):
        return float(data.spot_size)
    return 2.0 * math.atan(math.tan(min(data.spot_size, math.pi) / 2.0) * math.sqrt(x * y) / z)


def _area(
    name: str, data: Any, matrix: Float32, strength: Rgb, visibility: Visibility, notes: Notes
) -> AreaLight | None:
    size = (data.size, data.size_y if data.shape in ("RECTANGLE", "ELLIPSE") else data.size)
    ellipse = data.shape in ("DISK", "ELLIPSE")
    edges = np.asarray(matrix, np.float64)[:, :2] * size
    area = float(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]))) * (math.pi / 4.0 if ellipse else 1.0)
    if not area > 0:
        notes.warn(f"Light '{name}': its area is zero ({size[0]:g} x {size[1]:g} m, scaled), the light is left out")
        return None
    power = strength if data.normalize else _scaled(strength, area)
    return AreaLight(name, matrix, power, size, ellipse, max(data.spread, LEAST_SPREAD), visibility)


def _strength(data: Any, notes: Notes) -> Rgb:
    """Colour, temperature, exposure and energy, times the constant that the lamp's own nodes emit."""
    scale = data.energy * 2.0**data.exposure
    color = np.array(data.color[:]) * scale
    if data.use_temperature:
        color *= data.temperature_color[:]
    return tuple(float(channel) for channel in color * _emitted(data, notes))  # type: ignore[return-value]


def _emitted(data: Any, notes: Notes) -> Any:
    """What the lamp's node tree multiplies its light with: 1 without nodes."""
    if data.node_tree is None or (bpy.app.version < (5, 2, 0) and not data.use_nodes):
        return np.ones(3)
    graph = Graph(data, "Light", notes)
    place = graph.output("Surface")
    if place is None:
        return np.zeros(3)
    if place.socket.type != "SHADER":
        return np.array(graph.color(place))
    if place.node.bl_idname != "ShaderNodeEmission":
        notes.warn(f"{graph.owner}: {label(place.node)} is not there yet, its nodes are ignored")
        return np.ones(3)
    return np.array(graph.color(place.input("Color"))) * graph.number(place.input("Strength"))


def _scaled(color: Rgb, factor: float) -> Rgb:
    return (color[0] * factor, color[1] * factor, color[2] * factor)

"""Nodes that come out as a constant when their inputs are: the small part of shading that needs no renderer."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from .image import MISSING, export_image

if TYPE_CHECKING:
    from .nodes import Graph, Place

Color = tuple[float, float, float]
Value = float | Color

LUMINANCE = (0.2126, 0.7152, 0.0722)  # of linear Rec. 709


def as_number(value: Value) -> float:
    """A value as a number: a colour by its luminance."""
    return sum(a * b for a, b in zip(value, LUMINANCE, strict=True)) if isinstance(value, tuple) else value


def as_color(value: Value) -> Color:
    """A value as a colour or vector."""
    return value if isinstance(value, tuple) else (value, value, value)


def _number(graph: Graph, place: Place, identifier: str) -> float:
    return graph.number(place.input(identifier))


def _color(graph: Graph, place: Place, identifier: str) -> Color:
    return graph.color(place.input(identifier))


def _triple(values: Iterable[float]) -> Color:
    red, green, blue = values
    return red, green, blue


def _own(graph: Graph, place: Place) -> Value:
    from .nodes import own_value

    return own_value(place.socket)


_MATH: dict[str, Callable[[float, float, float], float]] = {
    "ADD": lambda a, b, c: a + b,
    "SUBTRACT": lambda a, b, c: a - b,
    "MULTIPLY": lambda a, b, c: a * b,
    "DIVIDE": lambda a, b, c: a / b if b else 0.0,
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b, c: math.pow(a, b) if a > 0 or (b == int(b) and (a or b >= 0)) else 0.0,
    "SQRT": lambda a, b, c: math.sqrt(a) if a > 0 else 0.0,
    "ABSOLUTE": lambda a, b, c: abs(a),
    "MINIMUM": lambda a, b, c: min(a, b),
    "MAXIMUM": lambda a, b, c: max(a, b),
    "LESS_THAN": lambda a, b, c: float(a < b),
    "GREATER_THAN": lambda a, b, c: float(a > b),
}


def _math(graph: Graph, place: Place) -> Value | None:
    operation = _MATH.get(place.node.operation)
    if operation is None:
        return None
    inputs = [graph.number(place.input(name)) for name in ("Value", "Value_001", "Value_002")]
    result = operation(*inputs)
    return min(max(result, 0.0), 1.0) if place.node.use_clamp else result


_BLEND: dict[str, Callable[[float, float], float]] = {
    "MIX": lambda a, b: b,
    "ADD": lambda a, b: a + b,
    "SUBTRACT": lambda a, b: a - b,
    "MULTIPLY": lambda a, b: a * b,
    "DARKEN": min,
    "LIGHTEN": max,
}


def _blend(kind: str, factor: float, a: Color, b: Color, clamp: bool) -> Color | None:
    blend = _BLEND.get(kind)
    if blend is None:
        return None
    mixed = (x + factor * (blend(x, y) - x) for x, y in zip(a, b, strict=True))
    return _triple(min(max(x, 0.0), 1.0) if clamp else x for x in mixed)


def _mix(graph: Graph, place: Place) -> Value | None:
    node = place.node
    if node.factor_mode != "UNIFORM" and node.data_type == "VECTOR":
        return None
    factor = _number(graph, place, "Factor_Float")
    if node.clamp_factor:
        factor = min(max(factor, 0.0), 1.0)
    if node.data_type == "FLOAT":
        start, end = (_number(graph, place, name) for name in ("A_Float", "B_Float"))
        return start + factor * (end - start)
    suffix = {"RGBA": "Color", "VECTOR": "Vector"}.get(node.data_type)
    if suffix is None:
        return None
    a, b = (_color(graph, place, f"{name}_{suffix}") for name in ("A", "B"))
    if suffix == "Vector":
        return _blend("MIX", factor, a, b, clamp=False)
    return _blend(node.blend_type, factor, a, b, clamp=node.clamp_result)


def _mix_rgb(graph: Graph, place: Place) -> Value | None:
    node = place.node
    factor = min(max(_number(graph, place, "Fac"), 0.0), 1.0)
    a, b = (_color(graph, place, name) for name in ("Color1", "Color2"))
    return _blend(node.blend_type, factor, a, b, clamp=node.use_clamp)


def _gamma(graph: Graph, place: Place) -> Value:
    gamma = _number(graph, place, "Gamma")
    return _triple(x**gamma if x > 0 else x for x in _color(graph, place, "Color"))


def _invert(graph: Graph, place: Place) -> Value:
    factor = _number(graph, place, "Fac")
    return _triple(x + factor * (1.0 - 2.0 * x) for x in _color(graph, place, "Color"))


def _ramp(graph: Graph, place: Place) -> Value:
    color = place.node.color_ramp.evaluate(_number(graph, place, "Fac"))
    return color[3] if place.socket.identifier == "Alpha" else _triple(color[:3])


def _combine(graph: Graph, place: Place) -> Value | None:
    if getattr(place.node, "mode", "RGB") != "RGB":
        return None
    names = ("X", "Y", "Z") if place.node.bl_idname == "ShaderNodeCombineXYZ" else ("Red", "Green", "Blue")
    return _triple(_number(graph, place, name) for name in names)


def _image(graph: Graph, place: Place) -> Value | None:
    """The mean of an image: what stands in for a texture that is not looked up."""
    image = place.node.image
    if image is None:
        graph.notes.warn(f"{graph.owner}: {place.node.bl_label} '{place.node.name}' has no image")
        return (0.0, 0.0, 0.0)
    colors = export_image(image, graph.owner, graph.notes)
    if colors is None:
        return MISSING
    graph.notes.warn(f"{graph.owner}: image '{image.name}' is not there yet, its mean colour stands in for it")
    if place.socket.identifier == "Alpha":
        return _mean_alpha(image)
    return _triple(float(mean) for mean in colors.mean(axis=(0, 1), dtype=np.float64))


def _mean_alpha(image: Any) -> float:
    if image.channels < 4:
        return 1.0
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    return float(pixels[3::4].mean(dtype=np.float64))


FOLDABLE: dict[str, Callable[[Graph, Place], Value | None]] = {
    "ShaderNodeRGB": _own,
    "ShaderNodeValue": _own,
    "ShaderNodeMath": _math,
    "ShaderNodeMix": _mix,
    "ShaderNodeMixRGB": _mix_rgb,
    "ShaderNodeGamma": _gamma,
    "ShaderNodeInvert": _invert,
    "ShaderNodeValToRGB": _ramp,
    "ShaderNodeCombineColor": _combine,
    "ShaderNodeCombineXYZ": _combine,
    "ShaderNodeRGBToBW": lambda graph, place: as_number(_color(graph, place, "Color")),
    "ShaderNodeTexImage": _image,
}

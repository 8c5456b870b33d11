"""Node materials to `vlp_bpt.Material`: one function for each shader node, constants at their inputs.

What a node computes is in `vlp_bpt.materials`; here its sockets are read. A shader node that is not there yet becomes
a diffuse surface of its own colour, and is reported once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import bpy

from vlp_bpt import materials
from vlp_bpt.scene import Material

from .nodes import Graph, Place, label
from .notes import Notes

DEFAULT_GREY = (0.8, 0.8, 0.8)
MAX_DEPTH = 64  # shader nodes below one another


def default_material() -> Material:
    """What a surface without a material has: Blender's grey."""
    return materials.diffuse(DEFAULT_GREY, name="default")


def export_material(material: Any, notes: Notes) -> Material:
    """The surface of an evaluated material; black where nothing is linked to its output."""
    if material.node_tree is None or (bpy.app.version < (5, 0, 0) and not material.use_nodes):
        return materials.diffuse(tuple(material.diffuse_color[:3]), name=material.name)
    graph = Graph(material, "Material", notes)
    for identifier, kind in (("Volume", "volumes are"), ("Displacement", "displacement is")):
        if graph.output(identifier) is not None:
            notes.warn(f"{graph.owner}: {kind} not there yet, left out")
    surface = _shader(graph, graph.output("Surface"), 0)
    if min(surface.emission) < 0:
        notes.warn(f"{graph.owner}: negative emission is not there yet, taken as zero")
    red, green, blue = (max(channel, 0.0) for channel in surface.emission)
    return replace(surface, name=material.name, emission=(red, green, blue))


def _shader(graph: Graph, place: Place | None, depth: int) -> Material:
    """What the shader at an output scatters and emits; nothing where there is no shader."""
    if place is None:
        return Material()
    if place.socket.type != "SHADER":  # a colour plugged into a surface glows, as in Cycles
        return materials.emission(graph.color(place), 1.0)
    if depth >= MAX_DEPTH:
        graph.notes.warn(f"{graph.owner}: more than {MAX_DEPTH} shader nodes below one another, the rest is left out")
        return Material()
    if graph.input_source(place, "Normal") is not None:
        graph.notes.warn(f"{graph.owner}: bump and normal maps are not there yet")
    read = _SHADERS.get(place.node.bl_idname)
    if read is None:
        return _stand_in(graph, place)
    return read(graph, place, depth)


def _stand_in(graph: Graph, place: Place) -> Material:
    graph.notes.warn(f"{graph.owner}: {label(place.node)} is not there yet, a diffuse surface stands in for it")
    color = place.input("Base Color") or place.input("Color")
    return materials.diffuse(graph.color(color, DEFAULT_GREY))


def _diffuse(graph: Graph, place: Place, depth: int) -> Material:
    _report_nonzero(graph, place, {"Roughness": "roughness"})
    return materials.diffuse(_color(graph, place, "Color"))


def _glossy(graph: Graph, place: Place, depth: int) -> Material:
    _report_nonzero(graph, place, {"Anisotropy": "anisotropy"})
    return materials.glossy(
        _color(graph, place, "Color"), _number(graph, place, "Roughness"), _distribution(graph, place)
    )


def _metallic(graph: Graph, place: Place, depth: int) -> Material:
    _report_nonzero(graph, place, {"Anisotropy": "anisotropy", "Thin Film Thickness": "thin film"})
    roughness, distribution = _number(graph, place, "Roughness"), _distribution(graph, place)
    if place.node.fresnel_type == "PHYSICAL_CONDUCTOR":
        eta, k = _color(graph, place, "IOR"), _color(graph, place, "Extinction")
        return materials.conductor(eta, k, roughness, distribution)
    base, edge = _color(graph, place, "Base Color"), _color(graph, place, "Edge Tint")
    return materials.metallic(base, edge, roughness, distribution)


def _glass(graph: Graph, place: Place, depth: int) -> Material:
    _report_nonzero(graph, place, {"Thin Film Thickness": "thin film"})
    color, roughness = _color(graph, place, "Color"), _number(graph, place, "Roughness")
    return materials.glass(color, roughness, _number(graph, place, "IOR"), _distribution(graph, place))


def _refraction(graph: Graph, place: Place, depth: int) -> Material:
    _distribution(graph, place)
    color, roughness = _color(graph, place, "Color"), _number(graph, place, "Roughness")
    return materials.refraction(color, roughness, _number(graph, place, "IOR"))


def _transparent(graph: Graph, place: Place, depth: int) -> Material:
    return materials.transparent(_color(graph, place, "Color"))


def _translucent(graph: Graph, place: Place, depth: int) -> Material:
    return materials.translucent(_color(graph, place, "Color"))


def _emission(graph: Graph, place: Place, depth: int) -> Material:
    return materials.emission(_color(graph, place, "Color"), _number(graph, place, "Strength"))


def _mix(graph: Graph, place: Place, depth: int) -> Material:
    factor = min(max(_number(graph, place, "Fac"), 0.0), 1.0)
    # A side that the factor turns off is not read: nothing in it needs reporting.
    first = _input_shader(graph, place, "Shader", depth) if factor < 1 else Material()
    second = _input_shader(graph, place, "Shader_001", depth) if factor > 0 else Material()
    return materials.mix(first, second, factor)


def _add(graph: Graph, place: Place, depth: int) -> Material:
    return materials.add(_input_shader(graph, place, "Shader", depth), _input_shader(graph, place, "Shader_001", depth))


# Principled inputs that change the picture when they are not zero.
_PRINCIPLED_MISSING = {
    "Subsurface Weight": "subsurface scattering",
    "Sheen Weight": "sheen",
    "Coat Weight": "coat",
    "Anisotropic": "anisotropy",
    "Diffuse Roughness": "diffuse roughness",
    "Thin Film Thickness": "thin film",
    "Thin Wall": "thin walls",
}


def _principled(graph: Graph, place: Place, depth: int) -> Material:
    _report_nonzero(graph, place, _PRINCIPLED_MISSING)
    return materials.principled(
        base_color=_color(graph, place, "Base Color"),
        metallic=_number(graph, place, "Metallic"),
        roughness=_number(graph, place, "Roughness"),
        ior=_number(graph, place, "IOR"),
        transmission=_number(graph, place, "Transmission Weight"),
        emission_color=_color(graph, place, "Emission Color"),
        emission_strength=_number(graph, place, "Emission Strength"),
        alpha=_number(graph, place, "Alpha"),
        specular_ior_level=_number(graph, place, "Specular IOR Level"),
        specular_tint=_color(graph, place, "Specular Tint"),
        distribution=_distribution(graph, place),
    )


def _input_shader(graph: Graph, place: Place, identifier: str, depth: int) -> Material:
    return _shader(graph, graph.input_source(place, identifier), depth + 1)


def _color(graph: Graph, place: Place, identifier: str) -> Any:
    return graph.color(place.input(identifier))


def _number(graph: Graph, place: Place, identifier: str) -> float:
    return graph.number(place.input(identifier))


def _distribution(graph: Graph, place: Place) -> materials.Distribution:
    """GGX with or without its lost energy; GGX too where the node asks for a distribution that is not there yet.

    A smooth surface has none: what it asks for, such as the Beckmann of a new Refraction node, makes no difference.
    """
    chosen = place.node.distribution
    if chosen not in ("GGX", "MULTI_GGX") and _number(graph, place, "Roughness") > 0:
        graph.notes.warn(f"{graph.owner}: {label(place.node)}: {chosen.title()} is not there yet, GGX stands in for it")
    return "MULTI_GGX" if chosen == "MULTI_GGX" else "GGX"


def _report_nonzero(graph: Graph, place: Place, missing: dict[str, str]) -> None:
    """Reports the features, named by their sockets, that a node uses and that are not there yet."""
    for identifier, words in missing.items():
        if _number(graph, place, identifier) != 0:
            graph.notes.warn(f"{graph.owner}: {label(place.node)}: {words} not there yet")


_SHADERS: dict[str, Callable[[Graph, Place, int], Material]] = {
    "ShaderNodeBsdfPrincipled": _principled,
    "ShaderNodeBsdfDiffuse": _diffuse,
    "ShaderNodeBsdfAnisotropic": _glossy,
    "ShaderNodeBsdfMetallic": _metallic,
    "ShaderNodeBsdfGlass": _glass,
    "ShaderNodeBsdfRefraction": _refraction,
    "ShaderNodeBsdfTransparent": _transparent,
    "ShaderNodeBsdfTranslucent": _translucent,
    "ShaderNodeEmission": _emission,
    "ShaderNodeMixShader": _mix,
    "ShaderNodeAddShader": _add,
}

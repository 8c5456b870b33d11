"""Measures in Cycles what surfaces reflect and transmit, for bsdf_cycles_test.cpp to compare with.

    PYTHONPATH=python python tests/native/measure_cycles_albedos.py tests/native/bsdf_cycles_albedos.h

needs bpy. Each case is a plane in an environment of radiance 1 above it, then below it, seen by an orthographic camera:
the picture's mean is the directional albedo. The header holds the lobes that `vlp_bpt.materials` makes of the same
parameters, so that the whole way from a node's inputs to the BSDF is compared.
"""

from __future__ import annotations

import itertools
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from math import acos, cos, pi, sin
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from vlp_bpt import materials
from vlp_bpt.scene import Lobe, LobeKind, Material

FRONT = (0.95, 0.6, 0.25)
BOTH = (0.9, 0.4, -0.4, -0.9)
PIXELS, SAMPLES = 16, 1024


@dataclass
class Case:
    """A Blender shader node with its inputs, the material that ought to be the same, and the cosines of the views."""

    name: str
    node: str
    inputs: dict[str, Any]
    material: Material
    cosines: tuple[float, ...] = FRONT
    distribution: str | None = None

    @property
    def transmits(self) -> bool:
        """Whether light reaches the eye from the far side."""
        opaque = (LobeKind.DIFFUSE, LobeKind.REFLECTION)
        return any(lobe.kind not in opaque for lobe in self.material.lobes)


def cases() -> Iterator[Case]:
    """Every node kind, over its parameters."""
    red, grey = (0.9, 0.4, 0.1), (0.8, 0.8, 0.8)
    yield Case("diffuse", "ShaderNodeBsdfDiffuse", {"Color": red, "Roughness": 0.0}, materials.diffuse(red))
    yield Case(
        "translucent", "ShaderNodeBsdfTranslucent", {"Color": red}, materials.translucent(red), cosines=(0.9, -0.4)
    )
    for distribution, roughness in itertools.product(("GGX", "MULTI_GGX"), (0.0, 0.2, 0.5, 0.8, 1.0)):
        yield Case(
            f"glossy {distribution} {roughness}",
            "ShaderNodeBsdfAnisotropic",
            {"Color": red, "Roughness": roughness},
            materials.glossy(red, roughness, distribution),  # type: ignore[arg-type]
            distribution=distribution,
        )
    for distribution, roughness, ior in itertools.product(("GGX", "MULTI_GGX"), (0.0, 0.3, 0.7, 1.0), (1.2, 1.5, 2.4)):
        yield Case(
            f"glass {distribution} {roughness} {ior}",
            "ShaderNodeBsdfGlass",
            {"Color": grey, "Roughness": roughness, "IOR": ior},
            materials.glass(grey, roughness, ior, distribution),  # type: ignore[arg-type]
            BOTH,
            distribution,
        )
    for roughness, ior in ((0.0, 1.45), (0.3, 1.45), (0.8, 1.45), (0.5, 1.1)):
        yield Case(
            f"refraction {roughness} {ior}",
            "ShaderNodeBsdfRefraction",
            {"Color": grey, "Roughness": roughness, "IOR": ior},
            materials.refraction(grey, roughness, ior),
            BOTH,
            "GGX",
        )
    eta, k = (0.271, 0.676, 1.316), (3.609, 2.624, 2.292)
    for roughness in (0.1, 0.6):
        yield Case(
            f"conductor {roughness}",
            "ShaderNodeBsdfMetallic",
            {"fresnel_type": "PHYSICAL_CONDUCTOR", "IOR": eta, "Extinction": k, "Roughness": roughness},
            materials.conductor(eta, k, roughness),
            distribution="MULTI_GGX",
        )
        yield Case(
            f"metallic F82 {roughness}",
            "ShaderNodeBsdfMetallic",
            {"fresnel_type": "F82", "Base Color": red, "Edge Tint": grey, "Roughness": roughness},
            materials.metallic(red, grey, roughness),
            distribution="MULTI_GGX",
        )
    sweeps: list[dict[str, Any]] = [{"roughness": r} for r in (0.0, 0.1, 0.3, 0.6, 1.0)]
    sweeps += [{"ior": i, "roughness": r} for i in (1.05, 1.33, 2.0, 0.8) for r in (0.1, 0.5)]
    sweeps += [{"metallic": m, "roughness": r} for m in (0.5, 1.0) for r in (0.1, 0.5, 0.9)]
    sweeps += [{"transmission": t, "roughness": r} for t in (0.5, 1.0) for r in (0.0, 0.3, 0.8)]
    sweeps += [{"specular_ior_level": level} for level in (0.0, 0.2, 1.0)]
    tint = (1.0, 0.5, 0.2)
    sweeps += [{"specular_tint": tint, **other} for other in ({}, {"metallic": 1.0}, {"transmission": 1.0})]
    sweeps += [{"metallic": 0.3, "transmission": 0.4, "roughness": 0.4, "specular_tint": tint, "alpha": 0.7}]
    sweeps += [
        {"roughness": 0.4, "distribution": "GGX"},
        {"roughness": 0.9, "transmission": 1.0, "distribution": "GGX"},
    ]
    for sweep in sweeps:
        parameters = {"base_color": red, **sweep}
        sockets = {
            "base_color": "Base Color",
            "ior": "IOR",
            "transmission": "Transmission Weight",
            "specular_ior_level": "Specular IOR Level",
            "specular_tint": "Specular Tint",
        }
        yield Case(
            "principled " + " ".join(f"{key} {value}" for key, value in sweep.items()),
            "ShaderNodeBsdfPrincipled",
            {sockets.get(key, key.title()): v for key, v in parameters.items() if key != "distribution"},
            materials.principled(**parameters),
            BOTH if "transmission" in sweep else FRONT,
            sweep.get("distribution", "MULTI_GGX"),
        )


def prepare() -> None:
    """An empty scene with a plane, a camera and an environment, rendered by Cycles without any of its shortcuts."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = SAMPLES
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.cycles.blur_glossy = 0.0
    scene.cycles.max_bounces = 4
    scene.render.resolution_x = scene.render.resolution_y = PIXELS
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    # Off the middle: rays that cross the diagonal, where the plane's two triangles meet, hit the other one again.
    bpy.ops.mesh.primitive_plane_add(size=1000.0, location=(300.0, -100.0, 0.0))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 0.01
    scene.collection.objects.link(camera)
    scene.camera = camera
    world = bpy.data.worlds.new("World")
    scene.world = world
    if hasattr(world, "use_nodes") and not world.use_nodes:
        world.use_nodes = True
    world.cycles.sampling_method = "NONE"
    nodes, links = world.node_tree.nodes, world.node_tree.links
    background = next(node for node in nodes if node.type == "BACKGROUND")
    coordinates = nodes.new("ShaderNodeTexCoord")
    split = nodes.new("ShaderNodeSeparateXYZ")
    side = nodes.new("ShaderNodeMath")
    side.name, side.operation = "Side", "GREATER_THAN"
    scale = nodes.new("ShaderNodeMath")
    scale.name, scale.operation = "Scale", "MULTIPLY"
    side.inputs[1].default_value = 0.0
    links.new(coordinates.outputs["Generated"], split.inputs[0])
    links.new(split.outputs["Z"], scale.inputs[0])
    links.new(scale.outputs[0], side.inputs[0])
    background.inputs["Color"].default_value = (1, 1, 1, 1)
    links.new(side.outputs[0], background.inputs["Strength"])


def assign(case: Case) -> None:
    """Gives the plane the case's node."""
    material = bpy.data.materials.new(case.name)
    if not material.use_nodes:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output, node = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new(case.node)
    if case.distribution is not None:
        node.distribution = case.distribution
    for name, value in case.inputs.items():
        if name == "fresnel_type":
            node.fresnel_type = value
        else:
            socket = node.inputs[name]
            socket.default_value = (*value, 1.0) if socket.type == "RGBA" else value
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    plane = bpy.data.objects["Plane"]
    plane.data.materials.clear()
    plane.data.materials.append(material)


def measure(cosine: float, above: bool) -> np.ndarray:
    """The mean (RGB) of the plane seen at `cosine` with its normal, lit from one side."""
    scene = bpy.context.scene
    scene.world.node_tree.nodes["Scale"].inputs[1].default_value = 1.0 if above else -1.0
    angle = acos(cosine)
    scene.camera.location = (5 * sin(angle) * cos(0.4), 5 * sin(angle) * sin(0.4), 5 * cos(angle))
    scene.camera.rotation_euler = (angle, 0.0, 0.4 + pi / 2)
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "x.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        pixels = np.array(image.pixels[:]).reshape(-1, image.channels)[:, :3]
        bpy.data.images.remove(image)
    return pixels.mean(axis=0)


def number(value: float) -> str:
    text = f"{value:.7g}"
    return text + ("f" if "." in text or "e" in text else ".0f")


def color(values: Any) -> str:
    return "{" + ", ".join(number(float(value)) for value in values) + "}"


def initialiser(lobe: Lobe) -> str:
    """A lobe as `LobeInput`."""
    return (
        f"{{LobeKind({lobe.kind.value}), Fresnel({lobe.fresnel.value}), {color(lobe.weight)}, "
        f"{number(lobe.roughness)}, {number(lobe.ior)}, {color(lobe.f0)}, {color(lobe.f82)}, {lobe.layered_under}, "
        f"{'true' if lobe.compensate else 'false'}}}"
    )


def rows(case: Case) -> Iterator[str]:
    """The case as an initialiser of `CyclesCase`."""
    yield f'    {{"{case.name}",\n     {{'
    for lobe in case.material.lobes:
        yield f"         {initialiser(lobe)},"
    yield "     },\n     {"
    for cosine in case.cosines:
        near = measure(cosine, cosine > 0)
        far = measure(cosine, cosine < 0) if case.transmits else np.zeros(3)
        yield f"         {{{number(cosine)}, {color(near)}, {color(far)}}},"
    yield "     }},"


def main(path: Path) -> None:
    prepare()
    lines = [
        "// What Cycles reflects and transmits, measured by measure_cycles_albedos.py. Generated: do not edit.",
        "#pragma once",
        "",
        '#include "bsdf_cycles_case.h"',
        "",
        "namespace vlp::test {",
        "",
        f'inline constexpr const char* k_measured_with = "Blender {bpy.app.version_string}";',
        "",
        "// clang-format off",
        "inline const std::vector<CyclesCase> k_cycles_cases = {",
    ]
    for case in cases():
        assign(case)
        lines += rows(case)
    lines += ["};", "// clang-format on", "", "}  // namespace vlp::test", ""]
    path.write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[-1]))

"""Shader nodes: each kind with its sockets, and what lies between a shader and its output."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import bpy
import bpy_scenes as scenes
import numpy as np
import pytest

from addon.export.notes import Notes
from vlp_bpt import materials
from vlp_bpt.scene import Material


def exported(made: Any, notes: Notes | None = None) -> Material:
    """A material as it comes out of the whole export."""
    scenes.plane(made)
    (found,) = scenes.export(Notes() if notes is None else notes).materials
    return found


def check(made: Any, wanted: Material) -> None:
    notes = Notes()
    assert_same(exported(made, notes), replace(wanted, name=made.name))
    assert notes.warnings == []


def assert_same(found: Material, wanted: Material) -> None:
    """Equal but for the rounding of Blender's single precision."""
    assert found.name == wanted.name
    assert found.emission == pytest.approx(wanted.emission, rel=1e-5)
    assert len(found.lobes) == len(wanted.lobes)
    for one, other in zip(found.lobes, wanted.lobes, strict=True):
        assert (one.kind, one.fresnel, one.layered_under, one.compensate) == (
            other.kind,
            other.fresnel,
            other.layered_under,
            other.compensate,
        )
        for name in ("weight", "roughness", "ior", "f0", "f82"):
            assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-5), name


def put(node: Any, **values: Any) -> None:
    """Sets inputs by identifier, with underscores for spaces."""
    for name, value in values.items():
        item = scenes.socket(node, name.replace("_", " "))
        item.default_value = (*value, 1.0) if item.type == "RGBA" else value


RED = (0.7, 0.2, 0.1)


def test_diffuse() -> None:
    made, (node,) = scenes.material("m", "ShaderNodeBsdfDiffuse")
    put(node, Color=RED)
    check(made, materials.diffuse(RED))


@pytest.mark.parametrize("distribution", ["GGX", "MULTI_GGX"])
def test_glossy(distribution: Any) -> None:
    made, (node,) = scenes.material("m", "ShaderNodeBsdfAnisotropic")
    node.distribution = distribution
    put(node, Color=RED, Roughness=0.3)
    check(made, materials.glossy(RED, 0.3, distribution))


def test_glass() -> None:
    made, (node,) = scenes.material("m", "ShaderNodeBsdfGlass")
    node.distribution = "GGX"
    put(node, Color=RED, Roughness=0.1, IOR=1.33)
    check(made, materials.glass(RED, 0.1, 1.33, "GGX"))


def test_refraction() -> None:
    made, (node,) = scenes.material("m", "ShaderNodeBsdfRefraction")
    node.distribution = "GGX"
    put(node, Color=RED, Roughness=0.1, IOR=1.33)
    check(made, materials.refraction(RED, 0.1, 1.33))


@pytest.mark.parametrize("roughness", [0.0, 0.3])
def test_the_distribution_of_a_new_refraction_node_matters_only_when_it_is_rough(roughness: float) -> None:
    made, (node,) = scenes.material("m", "ShaderNodeBsdfRefraction")
    node.distribution = "BECKMANN"
    put(node, Roughness=roughness)
    notes = Notes()
    exported(made, notes)
    assert [warning for warning in notes.warnings if "Beckmann" in warning] == notes.warnings
    assert len(notes.warnings) == (1 if roughness else 0)


def test_transparent_and_translucent() -> None:
    for kind, make in (("Transparent", materials.transparent), ("Translucent", materials.translucent)):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        made, (node,) = scenes.material("m", f"ShaderNodeBsdf{kind}")
        put(node, Color=RED)
        check(made, make(RED))


def test_emission() -> None:
    made, (node,) = scenes.material("m", "ShaderNodeEmission")
    put(node, Color=RED, Strength=5)
    check(made, materials.emission(RED, 5))


def test_negative_emission_is_named() -> None:
    made, (node,) = scenes.material("m", "ShaderNodeEmission")
    put(node, Color=RED, Strength=-5)
    notes = Notes()
    assert exported(made, notes).emission == (0, 0, 0)
    assert len(notes.warnings) == 1


@pytest.mark.parametrize("fresnel", ["F82", "PHYSICAL_CONDUCTOR"])
def test_metallic(fresnel: str) -> None:
    made, (node,) = scenes.material("m", "ShaderNodeBsdfMetallic")
    node.fresnel_type, node.distribution = fresnel, "MULTI_GGX"
    put(node, Roughness=0.25, Base_Color=RED, Edge_Tint=(0.9, 0.8, 0.7), IOR=(0.2, 0.9, 1.1), Extinction=(4, 3, 2))
    if fresnel == "F82":
        check(made, materials.metallic(RED, (0.9, 0.8, 0.7), 0.25))
    else:
        check(made, materials.conductor((0.2, 0.9, 1.1), (4, 3, 2), 0.25))


def test_principled_with_every_input() -> None:
    made, (node,) = scenes.material("m", "ShaderNodeBsdfPrincipled")
    node.distribution = "GGX"
    put(
        node,
        Base_Color=RED,
        Metallic=0.25,
        Roughness=0.4,
        IOR=1.6,
        Alpha=0.75,
        Specular_IOR_Level=0.6,
        Specular_Tint=(0.9, 0.8, 0.7),
        Transmission_Weight=0.5,
        Emission_Color=(0.1, 0.2, 0.3),
        Emission_Strength=2.0,
    )
    check(
        made,
        materials.principled(
            RED,
            metallic=0.25,
            roughness=0.4,
            ior=1.6,
            transmission=0.5,
            emission_color=(0.1, 0.2, 0.3),
            emission_strength=2.0,
            alpha=0.75,
            specular_ior_level=0.6,
            specular_tint=(0.9, 0.8, 0.7),
            distribution="GGX",
        ),
    )


def test_a_new_material_is_blenders_default() -> None:
    made = bpy.data.materials.new("new")
    if made.node_tree is None:  # before Blender 5.0
        check(made, materials.diffuse((0.8, 0.8, 0.8)))
    else:
        check(made, materials.principled((0.8, 0.8, 0.8), distribution="MULTI_GGX"))


@pytest.mark.parametrize("factor", [0.0, 0.3, 1.0])
def test_mix_and_add(factor: float) -> None:
    made, (mix, add, red, glow, glass) = scenes.material(
        "m",
        "ShaderNodeMixShader",
        "ShaderNodeAddShader",
        "ShaderNodeBsdfDiffuse",
        "ShaderNodeEmission",
        "ShaderNodeBsdfTransparent",
    )
    link = made.node_tree.links.new
    put(mix, Fac=factor)
    put(red, Color=RED)
    link(add.outputs[0], scenes.socket(mix, "Shader"))
    link(glass.outputs[0], scenes.socket(mix, "Shader_001"))
    link(red.outputs[0], scenes.socket(add, "Shader"))
    link(glow.outputs[0], scenes.socket(add, "Shader_001"))
    both = materials.add(materials.diffuse(RED), materials.emission())
    found = exported(made)
    wanted = materials.mix(both, materials.transparent(), factor)
    assert found.emission == pytest.approx(wanted.emission)
    weights = {(lobe.kind, tuple(np.round(lobe.weight, 5))) for lobe in found.lobes if max(lobe.weight) > 0}
    assert weights == {(lobe.kind, tuple(np.round(lobe.weight, 5))) for lobe in wanted.lobes if max(lobe.weight) > 0}


def test_a_mix_of_one_shader_fades_to_black() -> None:
    made, (mix, red) = scenes.material("m", "ShaderNodeMixShader", "ShaderNodeBsdfDiffuse")
    made.node_tree.links.new(red.outputs[0], scenes.socket(mix, "Shader_001"))
    put(red, Color=RED)
    put(mix, Fac=0.5)
    (lobe,) = exported(made).lobes
    assert lobe.weight == pytest.approx(tuple(0.5 * value for value in RED))


def test_no_surface_is_black() -> None:
    made, _ = scenes.material("m")
    assert exported(made) == Material("m")


def test_a_colour_as_surface_glows() -> None:
    made, (rgb,) = scenes.material("m", "ShaderNodeRGB")
    rgb.outputs[0].default_value = (*RED, 1)
    check(made, materials.emission(RED))


def group(name: str, *sockets: tuple[str, str, str]) -> Any:
    made = bpy.data.node_groups.new(name, "ShaderNodeTree")
    for label, direction, kind in sockets:
        made.interface.new_socket(label, in_out=direction, socket_type=kind)
    return made


@pytest.mark.parametrize("linked", [False, True])
def test_groups_reroutes_and_muted_nodes(linked: bool) -> None:
    """A colour through a group's input, a muted node and reroutes inside two nested groups."""
    inner = group("inner", ("Tint", "INPUT", "NodeSocketColor"), ("Shader", "OUTPUT", "NodeSocketShader"))
    nodes, links = inner.nodes, inner.links
    entry, leave = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    diffuse, reroute, gamma = (nodes.new(kind) for kind in ("ShaderNodeBsdfDiffuse", "NodeReroute", "ShaderNodeGamma"))
    put(gamma, Gamma=5.0)
    gamma.mute = True
    links.new(entry.outputs[0], reroute.inputs[0])
    links.new(reroute.outputs[0], scenes.socket(gamma, "Color"))
    links.new(gamma.outputs[0], scenes.socket(diffuse, "Color"))
    links.new(diffuse.outputs[0], leave.inputs[0])

    outer = group("outer", ("Tint", "INPUT", "NodeSocketColor"), ("Shader", "OUTPUT", "NodeSocketShader"))
    entry, leave, nested = (outer.nodes.new(kind) for kind in ("NodeGroupInput", "NodeGroupOutput", "ShaderNodeGroup"))
    nested.node_tree = inner
    outer.links.new(entry.outputs[0], nested.inputs[0])
    outer.links.new(nested.outputs[0], leave.inputs[0])

    made, (user, rgb) = scenes.material("m", "ShaderNodeGroup", "ShaderNodeRGB")
    user.node_tree = outer
    output = next(node for node in made.node_tree.nodes if node.bl_idname == "ShaderNodeOutputMaterial")
    made.node_tree.links.new(user.outputs[0], output.inputs["Surface"])
    user.inputs[0].default_value = (*RED, 1)
    if linked:
        rgb.outputs[0].default_value = (0.1, 0.9, 0.3, 1)
        made.node_tree.links.new(rgb.outputs[0], user.inputs[0])
    check(made, materials.diffuse((0.1, 0.9, 0.3) if linked else RED))


def test_a_muted_shader_passes_its_first_shader_on() -> None:
    made, (mix, red) = scenes.material("m", "ShaderNodeMixShader", "ShaderNodeBsdfDiffuse")
    made.node_tree.links.new(red.outputs[0], scenes.socket(mix, "Shader"))
    put(red, Color=RED)
    put(mix, Fac=1.0)
    mix.mute = True
    check(made, materials.diffuse(RED))


def test_muted_links_do_not_count() -> None:
    made, (diffuse, rgb) = scenes.material("m", "ShaderNodeBsdfDiffuse", "ShaderNodeRGB")
    put(diffuse, Color=RED)
    made.node_tree.links.new(rgb.outputs[0], scenes.socket(diffuse, "Color")).is_muted = True
    check(made, materials.diffuse(RED))


def test_constants_are_folded() -> None:
    made, (diffuse, mix, ramp, math, value) = scenes.material(
        "m", "ShaderNodeBsdfDiffuse", "ShaderNodeMix", "ShaderNodeValToRGB", "ShaderNodeMath", "ShaderNodeValue"
    )
    link = made.node_tree.links.new
    value.outputs[0].default_value = 0.25
    math.operation = "MULTIPLY"
    scenes.socket(math, "Value_001").default_value = 2.0
    mix.data_type, mix.blend_type = "RGBA", "MULTIPLY"
    scenes.socket(mix, "Factor_Float").default_value = 1.0
    scenes.socket(mix, "B_Color").default_value = (1.0, 0.5, 0.0, 1.0)
    link(value.outputs[0], scenes.socket(math, "Value"))
    link(math.outputs[0], scenes.socket(ramp, "Fac"))
    link(ramp.outputs["Color"], scenes.socket(mix, "A_Color"))
    result = next(item for item in mix.outputs if item.identifier == "Result_Color")
    link(result, scenes.socket(diffuse, "Color"))
    check(made, materials.diffuse((0.5, 0.25, 0.0)))  # a black to white ramp at 0.5


@pytest.mark.parametrize("is_float", [False, True])
def test_an_image_is_its_mean_colour_and_is_reported(is_float: bool) -> None:
    image = bpy.data.images.new("checks", 2, 1, float_buffer=is_float)
    image.pixels = [1.0, 0.5, 0.5, 1.0, 0.0, 0.5, 0.5, 1.0]
    made, (diffuse, texture) = scenes.material("m", "ShaderNodeBsdfDiffuse", "ShaderNodeTexImage")
    texture.image = image
    made.node_tree.links.new(texture.outputs["Color"], scenes.socket(diffuse, "Color"))
    notes = Notes()
    (lobe,) = exported(made, notes).lobes
    middle = 0.5 if is_float else ((128 / 255 + 0.055) / 1.055) ** 2.4
    assert lobe.weight == pytest.approx((0.5, middle, middle), rel=0.01)
    assert len(notes.warnings) == 1 and "'checks'" in notes.warnings[0]


def test_a_missing_image_is_named_with_its_file() -> None:
    made, (diffuse, texture) = scenes.material("m", "ShaderNodeBsdfDiffuse", "ShaderNodeTexImage")
    texture.image = bpy.data.images.new("lost", 1, 1)
    texture.image.source, texture.image.filepath = "FILE", "/nowhere/lost.png"
    made.node_tree.links.new(texture.outputs["Color"], scenes.socket(diffuse, "Color"))
    notes = Notes()
    assert exported(made, notes).lobes[0].weight == (1, 0, 1)
    assert notes.warnings == ["Material 'm': image 'lost' cannot be read from '/nowhere/lost.png'"]


def test_what_is_not_there_yet_stands_in_and_is_reported_once() -> None:
    """A texture used twice, a shader and features: one line each, however many objects use the material."""
    made, (add, principled, toon, noise) = scenes.material(
        "m", "ShaderNodeAddShader", "ShaderNodeBsdfPrincipled", "ShaderNodeBsdfToon", "ShaderNodeTexNoise"
    )
    link = made.node_tree.links.new
    link(principled.outputs[0], scenes.socket(add, "Shader"))
    link(toon.outputs[0], scenes.socket(add, "Shader_001"))
    link(noise.outputs[0], scenes.socket(principled, "Roughness"))
    link(noise.outputs[0], scenes.socket(principled, "Base Color"))
    put(principled, Coat_Weight=1.0, Roughness=0.3, Base_Color=RED)
    put(toon, Color=RED)
    scenes.plane(made)
    scenes.plane(made)
    notes = Notes()
    (found,) = scenes.export(notes).materials
    wanted = materials.add(materials.principled(RED, roughness=0.3), materials.diffuse(RED))
    assert_same(found, replace(wanted, name="m"))
    for words in ("node Noise Texture is", "node Toon BSDF is", "node Principled BSDF: coat"):
        assert sum(words in text for text in notes.warnings) == 1, notes.warnings
    assert len(notes.warnings) == 3


def test_displacement_volume_and_normal_maps_are_reported() -> None:
    made, (diffuse, displace, scatter, bump) = scenes.material(
        "m", "ShaderNodeBsdfDiffuse", "ShaderNodeDisplacement", "ShaderNodeVolumeScatter", "ShaderNodeBump"
    )
    output = next(node for node in made.node_tree.nodes if node.bl_idname == "ShaderNodeOutputMaterial")
    link = made.node_tree.links.new
    link(displace.outputs[0], output.inputs["Displacement"])
    link(scatter.outputs[0], output.inputs["Volume"])
    link(bump.outputs[0], scenes.socket(diffuse, "Normal"))
    notes = Notes()
    assert len(exported(made, notes).lobes) == 1
    assert len(notes.warnings) == 3


def test_a_tree_that_links_to_itself_ends() -> None:
    made, (mix, red) = scenes.material("m", "ShaderNodeMixShader", "ShaderNodeBsdfDiffuse")
    link = made.node_tree.links.new
    link(red.outputs[0], scenes.socket(mix, "Shader"))
    link(mix.outputs[0], scenes.socket(mix, "Shader_001"))
    exported(made)


def test_the_output_for_every_engine_and_for_cycles() -> None:
    made, (red, green) = scenes.material("m", "ShaderNodeBsdfDiffuse", "ShaderNodeBsdfDiffuse")
    put(red, Color=RED)
    put(green, Color=(0, 1, 0))
    other = made.node_tree.nodes.new("ShaderNodeOutputMaterial")
    other.target = "EEVEE"
    other.is_active_output = True
    made.node_tree.links.new(green.outputs[0], other.inputs["Surface"])
    check(made, materials.diffuse(RED))

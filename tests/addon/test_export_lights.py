"""Lamps in Blender's units, as `tests/addon/test_render.py` finds them against Cycles."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import bpy
import bpy_scenes as scenes
import numpy as np
import OpenImageIO
import pytest

from addon.export.notes import Notes
from vlp_bpt.scene import AreaLight, PointLight, SpotLight, SunLight


def only(kind: str, notes: Notes | None = None, **settings: Any) -> Any:
    scenes.light(kind, **settings)
    (light,) = scenes.export(notes).lights
    return light


def test_point() -> None:
    light = only("POINT", energy=30, color=(1, 0.5, 0), shadow_soft_size=0.2)
    assert isinstance(light, PointLight)
    assert light.power == pytest.approx((30, 15, 0))
    assert light.position == (0, 0, 2)
    assert light.radius == pytest.approx(0.2)


def test_spot() -> None:
    light = only("SPOT", energy=30, spot_size=1.0, spot_blend=0.4, shadow_soft_size=0.0)
    assert isinstance(light, SpotLight)
    assert (light.spot_size, light.blend, light.radius) == pytest.approx((1.0, 0.4, 0.0))
    assert light.power == (30, 30, 30)


def test_a_spot_stretched_along_its_axis_is_narrower() -> None:
    scenes.light("SPOT", spot_size=1.0).scale = (1, 1, 2)
    (light,) = scenes.export().lights
    assert math.tan(light.spot_size / 2) == pytest.approx(math.tan(0.5) / 2, rel=1e-5)
    assert np.allclose(np.linalg.norm(light.transform[:, :3], axis=0), 1)


def test_sun() -> None:
    light = only("SUN", energy=3, angle=0.1)
    assert isinstance(light, SunLight)
    assert light.irradiance == (3, 3, 3)
    assert light.angle == pytest.approx(0.1)


@pytest.mark.parametrize(
    "shape, size, ellipse",
    [("SQUARE", (2, 2), False), ("RECTANGLE", (2, 3), False), ("DISK", (2, 2), True), ("ELLIPSE", (2, 3), True)],
)
def test_area(shape: str, size: tuple[float, float], ellipse: bool) -> None:
    light = only("AREA", energy=30, shape=shape, size=2, size_y=3, spread=1.0)
    assert isinstance(light, AreaLight)
    assert (light.size, light.ellipse, light.power) == (size, ellipse, (30, 30, 30))
    assert light.spread == pytest.approx(1.0)


def test_scale_makes_an_area_larger_at_the_same_power() -> None:
    scenes.light("AREA", energy=30, size=2).scale = (3, 4, 5)
    (light,) = scenes.export().lights
    assert light.power == (30, 30, 30)
    assert np.allclose(np.linalg.norm(light.transform[:, :2], axis=0) * light.size, (6, 8))


@pytest.mark.parametrize(
    "kind, settings, factor",
    [
        ("POINT", {"shadow_soft_size": 0.3}, 4 * math.pi * 0.09),
        ("SPOT", {"shadow_soft_size": 0.0}, 4),
        ("SUN", {"angle": 0.3}, math.pi * math.sin(0.15) ** 2),
        ("SUN", {"angle": 0.0}, 1),
        ("AREA", {"shape": "RECTANGLE", "size": 2, "size_y": 3}, 6),
        ("AREA", {"shape": "DISK", "size": 2}, math.pi),
    ],
)
def test_without_normalization(kind: str, settings: dict[str, Any], factor: float) -> None:
    light = only(kind, energy=10, normalize=False, **settings)
    power = light.irradiance if isinstance(light, SunLight) else light.power
    assert power == pytest.approx((10 * factor,) * 3, rel=1e-6)


def test_exposure_and_temperature() -> None:
    light = only("POINT", energy=10, exposure=1, use_temperature=True, temperature=3000, color=(1, 0.5, 1))
    tint = bpy.data.lights["Point"].temperature_color
    assert light.power == pytest.approx((20 * tint[0], 10 * tint[1], 20 * tint[2]), rel=1e-5)
    assert tint[0] > tint[2]


def emission(lamp: Any) -> Any:
    lamp.data.use_nodes = True
    return next(node for node in lamp.data.node_tree.nodes if node.bl_idname == "ShaderNodeEmission")


def test_the_constants_of_a_lamps_own_nodes() -> None:
    node = emission(scenes.light("POINT", energy=10))
    scenes.socket(node, "Color").default_value = (1, 0.5, 0.25, 1)
    scenes.socket(node, "Strength").default_value = 3
    (light,) = scenes.export().lights
    assert light.power == pytest.approx((30, 15, 7.5))


def test_unlinked_lamp_nodes_give_no_light() -> None:
    lamp = scenes.light("POINT", energy=10)
    emission(lamp)
    lamp.data.node_tree.links.clear()
    assert scenes.export().lights == []


@pytest.mark.parametrize(
    "settings, words", [({"size": 0.0}, "area is zero"), ({"shape": "RECTANGLE", "size_y": 0.0}, "area is zero")]
)
def test_areas_of_zero_are_left_out_and_named(settings: dict[str, Any], words: str) -> None:
    scenes.light("AREA", **settings).name = "Flat"
    notes = Notes()
    assert scenes.export(notes).lights == []
    assert len(notes.warnings) == 1
    assert words in notes.warnings[0] and "'Flat'" in notes.warnings[0]


def test_a_lamp_scaled_to_nothing_is_left_out() -> None:
    scenes.light("AREA").scale = (0, 1, 1)
    notes = Notes()
    assert scenes.export(notes).lights == []
    assert len(notes.warnings) == 1


@pytest.mark.parametrize("kind", ["SPOT", "SUN"])
def test_a_lamp_without_direction_is_left_out_and_named(kind: str) -> None:
    scenes.light(kind).scale = (0, 0, 0)
    notes = Notes()
    assert scenes.export(notes).lights == []
    (warning,) = notes.warnings
    assert f"'{kind.title()}'" in warning


def test_a_spread_of_zero_is_next_to_parallel() -> None:
    scenes.light("AREA", energy=1, spread=0)
    exported = scenes.export()
    exported.validate()
    (light,) = exported.lights
    assert 0 < light.spread < 0.01


def test_lamps_without_power_are_left_out() -> None:
    scenes.light("POINT", energy=0)
    notes = Notes()
    assert scenes.export(notes).lights == []
    assert notes.warnings == []


def test_negative_power_is_named() -> None:
    notes = Notes()
    scenes.light("POINT", energy=-5)
    assert scenes.export(notes).lights == []
    assert "negative" in notes.warnings[0]


def test_lamps_in_collection_instances() -> None:
    inner = bpy.data.collections.new("inner")
    inner.objects.link(bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "POINT")))
    for index in range(3):
        empty = scenes.link(f"empty{index}", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", inner
        empty.location.x = index
    assert sorted(light.position[0] for light in scenes.export().lights) == [0, 1, 2]


def world(**values: Any) -> Any:
    made = bpy.data.worlds.new("World")
    made.use_nodes = True
    bpy.context.scene.world = made
    for name, value in values.items():
        scenes.socket(background(made), name).default_value = value
    return made


def background(made: Any) -> Any:
    return next(node for node in made.node_tree.nodes if node.bl_idname == "ShaderNodeBackground")


def test_world_colour_and_strength() -> None:
    world(Color=(0.1, 0.2, 0.3, 1), Strength=2)
    assert scenes.export().world.radiance == pytest.approx((0.2, 0.4, 0.6))


def test_no_world_is_black() -> None:
    bpy.context.scene.world = None
    assert scenes.export().world.radiance == (0, 0, 0)


def test_a_world_without_surface_is_black() -> None:
    world().node_tree.links.clear()
    assert scenes.export().world.radiance == (0, 0, 0)


@pytest.mark.parametrize("factor", [None, 0.25])
def test_worlds_are_added_and_mixed(factor: float | None) -> None:
    made = world(Color=(0.4, 0.2, 0.0, 1), Strength=2)
    tree = made.node_tree
    other = tree.nodes.new("ShaderNodeBackground")
    scenes.socket(other, "Color").default_value = (0, 0, 1, 1)
    both = tree.nodes.new("ShaderNodeAddShader" if factor is None else "ShaderNodeMixShader")
    if factor is not None:
        scenes.socket(both, "Fac").default_value = factor
    tree.links.new(background(made).outputs[0], scenes.socket(both, "Shader"))
    tree.links.new(other.outputs[0], scenes.socket(both, "Shader_001"))
    tree.links.new(both.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    notes = Notes()
    wanted = (0.8, 0.4, 1.0) if factor is None else (0.6, 0.3, 0.25)
    assert scenes.export(notes).world.radiance == pytest.approx(wanted)
    assert notes.warnings == []


def test_negative_light_of_the_world_is_named() -> None:
    world(Color=(1, 1, 1, 1), Strength=-1)
    notes = Notes()
    assert scenes.export(notes).world.radiance == (0, 0, 0)
    assert "World 'World'" in notes.warnings[0] and "negative" in notes.warnings[0]


def environment(made: Any) -> Any:
    """An Environment Texture that feeds the world's Background, and the (4, 8, 3) colours of its image.

    Its alpha is kept apart from the colours, which Cycles multiplies by it from 5.0 on.
    """
    tree = made.node_tree
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    background = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBackground")
    tree.links.new(node.outputs[0], scenes.socket(background, "Color"))
    node.image = bpy.data.images.new("sky", 8, 4, float_buffer=True)
    pixels = np.random.default_rng(1).random((4, 8, 4)).astype(np.float32)
    node.image.pixels.foreach_set(pixels.ravel())
    return node, pixels[..., :3] * (pixels[..., 3:] if bpy.app.version >= (5, 0, 0) else 1.0)


def test_a_world_image() -> None:
    _, colors = environment(world(Strength=2))
    notes = Notes()
    found = scenes.export(notes).world
    assert notes.warnings == []
    assert found.radiance == (1, 1, 1)
    assert found.image == pytest.approx(2 * colors)
    assert (found.rotation == np.eye(3)).all()


@pytest.mark.parametrize("kind", ["POINT", "TEXTURE", "VECTOR", "NORMAL"])
def test_a_mapping_turns_the_world_image(kind: str) -> None:
    made = world()
    node, _ = environment(made)
    mapping = made.node_tree.nodes.new("ShaderNodeMapping")
    mapping.vector_type = kind
    scenes.socket(mapping, "Rotation").default_value = (0, 0, math.pi / 2)
    coordinates = made.node_tree.nodes.new("ShaderNodeTexCoord")
    generated = next(socket for socket in coordinates.outputs if socket.identifier == "Generated")
    made.node_tree.links.new(generated, scenes.socket(mapping, "Vector"))
    made.node_tree.links.new(mapping.outputs[0], scenes.socket(node, "Vector"))
    notes = Notes()
    turned = scenes.export(notes).world.rotation @ (1, 0, 0)
    assert notes.warnings == []
    assert turned == pytest.approx((0, -1, 0) if kind == "TEXTURE" else (0, 1, 0), abs=1e-6)


def test_a_world_image_in_bytes_is_made_linear() -> None:
    node, _ = environment(world())
    node.image = bpy.data.images.new("bytes", 2, 1)
    node.image.pixels.foreach_set(np.array([0, 0.5, 1, 1, 0.02, 0.2, 0.8, 1], np.float32))
    found = scenes.export().world.image
    assert found[0, 0] == pytest.approx((0, 0.2140, 1), abs=2e-3)
    assert found[0, 1] == pytest.approx((0.0016, 0.0331, 0.6038), abs=2e-3)


def test_bytes_are_multiplied_by_alpha_as_encoded() -> None:
    node, _ = environment(world())
    node.image = bpy.data.images.new("bytes", 1, 1, alpha=True)
    node.image.pixels.foreach_set(np.array([1, 0.5, 0, 0.5], np.float32))
    middle, dark = (((x + 0.055) / 1.055) ** 2.4 for x in (0.5, 0.25))
    assert scenes.export().world.image[0, 0] == pytest.approx((middle, dark, 0), rel=0.02)


def test_float_files_are_multiplied_by_alpha_once(tmp_path: Path) -> None:
    pixels = np.array([[[0.8, 0.4, 0.2, 0.5]]], np.float32)
    OpenImageIO.ImageBuf(pixels).write(str(tmp_path / "apart.exr"))
    node, _ = environment(world())
    node.image = bpy.data.images.load(str(tmp_path / "apart.exr"))
    node.image.alpha_mode = "STRAIGHT"
    assert scenes.export().world.image[0, 0] == pytest.approx((0.4, 0.2, 0.1), rel=1e-3)


def test_a_missing_world_image_is_named_with_its_file() -> None:
    node, _ = environment(world(Strength=2))
    node.image = bpy.data.images.new("gone.hdr", 8, 4)
    node.image.source, node.image.filepath = "FILE", "/nowhere/gone.hdr"
    notes = Notes()
    assert scenes.export(notes).world.radiance == (2, 0, 2)  # magenta, as in Blender
    assert "World 'World'" in notes.warnings[0] and "/nowhere/gone.hdr" in notes.warnings[0]


def test_a_world_without_its_image_is_magenta() -> None:
    node, _ = environment(world())
    node.image = None
    notes = Notes()
    assert scenes.export(notes).world.radiance == (1, 0, 1)
    assert "no image" in notes.warnings[0]


@pytest.mark.parametrize("alike", [True, False])
def test_world_images_are_added(alike: bool) -> None:
    """Of one size and rotation texel by texel; else the second counts as its mean over directions."""
    made = world(Strength=2)
    _, colors = environment(made)
    tree = made.node_tree
    other, second = tree.nodes.new("ShaderNodeTexEnvironment"), tree.nodes.new("ShaderNodeBackground")
    other.image = bpy.data.images.new("other", 8, 4 if alike else 90, float_buffer=True)
    white = np.zeros((other.image.size[1], 8, 4), np.float32)
    white[2 * len(white) // 3 :] = 1  # above a height of 30 degrees
    other.image.pixels.foreach_set(white.ravel())
    both = tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(other.outputs[0], scenes.socket(second, "Color"))
    tree.links.new(background(made).outputs[0], scenes.socket(both, "Shader"))
    tree.links.new(second.outputs[0], scenes.socket(both, "Shader_001"))
    tree.links.new(both.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    notes = Notes()
    found = scenes.export(notes).world
    assert found.image == pytest.approx(2 * colors + (white[..., :3] if alike else 0.25), rel=1e-3)
    assert len(notes.warnings) == (0 if alike else 1)


def test_a_textured_world_is_reported_once() -> None:
    made = world(Color=(0.5, 0.5, 0.5, 1))
    sky = made.node_tree.nodes.new("ShaderNodeTexSky")
    made.node_tree.links.new(sky.outputs[0], scenes.socket(background(made), "Color"))
    notes = Notes()
    assert scenes.export(notes).world.radiance == pytest.approx((0.5, 0.5, 0.5))
    assert len(notes.warnings) == 1
    assert notes.warnings[0].startswith("World 'World': node Sky Texture is not there yet")

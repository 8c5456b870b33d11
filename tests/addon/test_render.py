"""Real renders through the add-on, beside Cycles on the same scene.

Each quarter of the picture has Cycles' mean within 1 %, with 4 standard errors of the difference beside it, which may
themselves be no more than 1 %. Noise alone passes 4 standard errors in one of 16,000 comparisons; there are about 200,
and the 1 % comes on top. The seeds are fixed, so that a test passes or fails for good.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import bpy
import bpy_scenes as scenes
import numpy as np
import OpenImageIO
import pytest

from vlp_bpt.render import load_native

SIZE = 24


@pytest.fixture(scope="module", autouse=True)
def native() -> None:
    """The compiled core: without it these tests fail, they are not left out."""
    load_native()


def rendered(engine: str, folder: Path) -> Any:
    """(height, width, 4) linear pixels, row 0 at the bottom."""
    scene = bpy.context.scene
    scene.render.engine = engine
    path = folder / f"{engine}.exr"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    image = OpenImageIO.ImageInput.open(str(path))
    pixels = image.read_image("float")
    image.close()
    return np.asarray(pixels, np.float64)[::-1]


@pytest.fixture
def compare(tmp_path: Path) -> Any:
    """Renders with both engines and compares quarters of the picture."""
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    settings, cycles = scene.vlp_bpt, scene.cycles
    settings.samples, settings.filter, settings.filter_width = 256, "BOX", 1.0
    cycles.samples, cycles.pixel_filter_type = 1024, "BOX"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_indirect = 0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 12

    def check() -> None:
        wanted, found = rendered("CYCLES", tmp_path), rendered("VLP_BPT", tmp_path)
        half = SIZE // 2
        for rows in (slice(0, half), slice(half, SIZE)):
            for columns in (slice(0, half), slice(half, SIZE)):
                difference = (found - wanted)[rows, columns].reshape(-1, 4)
                mean = wanted[rows, columns].reshape(-1, 4).mean(axis=0)
                noise = difference.std(axis=0, ddof=1) / math.sqrt(len(difference))
                bound = 0.01 * mean + 4 * noise + 1e-6
                assert (np.abs(difference.mean(axis=0)) <= bound).all(), (difference.mean(axis=0) / mean, noise / mean)
                assert (4 * noise <= 0.01 * mean + 1e-6).all(), "too few samples to tell"

    return check


def floor() -> None:
    """A diffuse floor under an orthographic camera that looks straight down."""
    made, (node,) = scenes.material("floor", "ShaderNodeBsdfDiffuse")
    scenes.socket(node, "Color").default_value = (0.8, 0.5, 0.2, 1)
    scenes.plane(made, 20)
    camera = scenes.camera(type="ORTHO", ortho_scale=3)
    camera.location = (0, 0, 8)


LAMPS: dict[str, tuple[str, dict[str, Any]]] = {
    "point": ("POINT", {"energy": 100, "shadow_soft_size": 0}),
    "sphere": ("POINT", {"energy": 100, "shadow_soft_size": 0.3, "use_soft_falloff": False}),
    "sphere without normalization": (
        "POINT",
        {"energy": 100, "shadow_soft_size": 0.3, "normalize": False, "use_soft_falloff": False},
    ),
    "spot": ("SPOT", {"energy": 100, "shadow_soft_size": 0, "spot_size": 1.0, "spot_blend": 0.5}),
    "soft spot": (
        "SPOT",
        {"energy": 100, "shadow_soft_size": 0.2, "spot_size": 1.0, "spot_blend": 0.5, "use_soft_falloff": False},
    ),
    "sun": ("SUN", {"energy": 3, "angle": 0}),
    "wide sun without normalization": ("SUN", {"energy": 3, "angle": 0.3, "normalize": False}),
    "square": ("AREA", {"energy": 50, "size": 1}),
    "rectangle": ("AREA", {"energy": 50, "shape": "RECTANGLE", "size": 1, "size_y": 0.5}),
    "disk": ("AREA", {"energy": 50, "shape": "DISK", "size": 1}),
    "ellipse without normalization": (
        "AREA",
        {"energy": 50, "shape": "ELLIPSE", "size": 1, "size_y": 0.5, "normalize": False},
    ),
    "narrow area": ("AREA", {"energy": 50, "size": 0.7, "spread": 1.5}),
    "coloured": (
        "AREA",
        {"energy": 50, "color": (0.5, 1, 0.3), "use_temperature": True, "temperature": 3000, "exposure": 1},
    ),
}


@pytest.mark.parametrize("name", LAMPS)
def test_lamps_are_as_bright_as_in_cycles(name: str, compare: Any) -> None:
    floor()
    kind, settings = LAMPS[name]
    shown = scenes.light(kind, **settings)
    shown.rotation_euler = (0.2, 0.1, 0)
    shown.scale = (1.5, 1.5, 1.5)
    compare()


@pytest.mark.parametrize("kind", ["POINT", "AREA"])
def test_lamps_are_seen_by_the_camera_when_they_may_be(kind: str, compare: Any) -> None:
    floor()
    shown = scenes.light(kind, energy=20)
    if kind == "AREA":
        shown.rotation_euler.x = math.pi  # shines at the camera
        shown.data.size = 2
    else:
        shown.data.shadow_soft_size, shown.data.use_soft_falloff = 0.8, False
    shown.visible_camera = True
    compare()


def test_a_glowing_mesh(compare: Any) -> None:
    floor()
    made, (node,) = scenes.material("glow", "ShaderNodeEmission")
    scenes.socket(node, "Strength").default_value = 10
    shown = scenes.plane(made, 1)
    shown.location = (0.3, 0, 1.5)
    shown.rotation_euler = (0.4, 0, 0)
    compare()


@pytest.mark.parametrize("turn", [0.0, 1.0])
def test_a_world_image(compare: Any, turn: float) -> None:
    """Seen directly and by its light on a floor: a picture of noise with a bright spot, turned about two axes."""
    floor()
    camera = bpy.context.scene.camera
    camera.data.type, camera.data.angle = "PERSP", 1.4
    camera.location, camera.rotation_euler = (0, -3, 2), (1.35, 0, 0.3)
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    bpy.context.scene.world = world
    tree = world.node_tree
    picture = tree.nodes.new("ShaderNodeTexEnvironment")
    mapping, coordinates = tree.nodes.new("ShaderNodeMapping"), tree.nodes.new("ShaderNodeTexCoord")
    scenes.socket(mapping, "Rotation").default_value = (0.4 * turn, 0, turn)
    generated = next(socket for socket in coordinates.outputs if socket.identifier == "Generated")
    tree.links.new(generated, scenes.socket(mapping, "Vector"))
    tree.links.new(mapping.outputs[0], scenes.socket(picture, "Vector"))
    background = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBackground")
    tree.links.new(picture.outputs[0], scenes.socket(background, "Color"))
    pixels = np.random.default_rng(2).random((8, 16, 4)).astype(np.float32)
    pixels[5, 4, :3] = 8
    picture.image = bpy.data.images.new("sky", 16, 8, float_buffer=True)
    picture.image.pixels.foreach_set(pixels.ravel())
    compare()


def test_the_world(compare: Any) -> None:
    floor()
    block, _ = scenes.material("block", "ShaderNodeBsdfDiffuse")
    shown = scenes.plane(block, 1)
    shown.rotation_euler.x = 1.2
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.bl_idname == "ShaderNodeBackground")
    scenes.socket(background, "Color").default_value = (0.2, 0.5, 1.0, 1)
    scenes.socket(background, "Strength").default_value = 1.5
    bpy.context.scene.world = world
    bpy.context.scene.vlp_bpt.mode = "REFERENCE"
    compare()


@pytest.mark.parametrize("mode", ["BALANCED", "REFERENCE"])
def test_indirect_light_in_a_corner(mode: str, compare: Any) -> None:
    """A floor lit by a wall: the modes' own path lengths reach what matters here."""
    floor()
    made, (node,) = scenes.material("wall", "ShaderNodeBsdfPrincipled")
    scenes.socket(node, "Base Color").default_value = (0.9, 0.3, 0.3, 1)
    wall = scenes.plane(made, 6)
    wall.location.x, wall.rotation_euler.y = -1.5, math.pi / 2
    lamp = scenes.light("AREA", energy=60, size=0.5)
    lamp.location, lamp.rotation_euler.y = (1.5, 0, 1.0), math.pi / 2  # shines at the wall alone
    settings = bpy.context.scene.vlp_bpt
    settings.mode, settings.samples = mode, 1024
    assert settings.splats
    compare()


def test_film_transparent_leaves_holes(compare: Any) -> None:
    made, _ = scenes.material("square", "ShaderNodeBsdfDiffuse")
    scenes.plane(made, 2)
    scenes.camera(type="ORTHO", ortho_scale=3)
    scenes.light("POINT", energy=100, shadow_soft_size=0)
    bpy.context.scene.render.film_transparent = True
    compare()


def test_the_same_seed_is_the_same_picture(tmp_path: Path) -> None:
    floor()
    scenes.light("AREA")
    scene = bpy.context.scene
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    pictures = []
    for threads, seed in ((1, 0), (2, 0), (2, 1)):
        scene.vlp_bpt.threads, scene.vlp_bpt.seed = threads, seed
        pictures.append(rendered("VLP_BPT", tmp_path))
    assert np.array_equal(pictures[0], pictures[1])
    assert not np.array_equal(pictures[0], pictures[2])


def test_a_border_is_a_part_of_the_whole(tmp_path: Path) -> None:
    """With a box filter of one pixel each pixel is on its own: the border's mean agrees with the whole picture's."""
    floor()
    scenes.light("POINT", energy=100, shadow_soft_size=0).location.x = 0.7
    scene = bpy.context.scene
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.vlp_bpt.filter, scene.vlp_bpt.filter_width, scene.vlp_bpt.samples = "BOX", 1.0, 64
    whole = rendered("VLP_BPT", tmp_path)
    settings = scene.render
    settings.use_border = settings.use_crop_to_border = True
    settings.border_min_x, settings.border_max_x, settings.border_min_y, settings.border_max_y = 0.25, 0.75, 0.5, 1.0
    part = rendered("VLP_BPT", tmp_path)
    height, width = whole.shape[:2]
    assert part.shape[:2] == (height // 2, width // 2)
    same = whole[height // 2 :, width // 4 : width // 4 * 3]
    difference = (part - same)[..., :3].reshape(-1, 3)
    noise = difference.std(axis=0) / math.sqrt(len(difference))
    assert (np.abs(difference.mean(axis=0)) <= 4 * noise + 1e-6).all()
    assert (noise < 0.01 * same[..., :3].mean()).all()


def test_a_noise_threshold(tmp_path: Path) -> None:
    from addon import figures

    floor()
    scenes.light("POINT")
    scene = bpy.context.scene
    scene.vlp_bpt.samples, scene.vlp_bpt.noise_threshold = 10**6, 0.02
    scene.view_layers.new("second")
    scene.render.engine = "VLP_BPT"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.filepath = str(tmp_path / "x.exr")
    bpy.ops.render.render(write_still=True)
    image = OpenImageIO.ImageInput.open(str(tmp_path / "x.exr"))
    stamps = {attribute.name: attribute.value for attribute in image.spec().extra_attribs}
    image.close()
    for layer in ("ViewLayer", "second"):
        shown = dict(figures.last[("Scene", layer)])
        assert 32 <= int(shown["Iterations"].replace(",", "")) < 10**5
        assert 0 < float(shown["Noise"]) <= 0.02
        assert float(stamps[f"VLP_BPT.{layer}.noise"]) == pytest.approx(float(shown["Noise"]), rel=0.06)


def test_a_time_limit(tmp_path: Path) -> None:
    from addon import figures

    floor()
    scenes.light("POINT")
    scene = bpy.context.scene
    scene.vlp_bpt.samples, scene.vlp_bpt.time_limit = 10**6, 1.0
    scene.render.filepath = str(tmp_path / "x.png")
    bpy.ops.render.render(write_still=True)
    hours, minutes, seconds = dict(figures.last[("Scene", "ViewLayer")])["Render Time"].split(":")
    assert 0.5 < int(hours) * 3600 + int(minutes) * 60 + float(seconds) < 2.0

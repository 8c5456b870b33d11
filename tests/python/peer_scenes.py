"""Small scenes that other renderers must render alike, made through bpy: each function fills an empty file."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

SCENES = Path(__file__).resolve().parents[2] / "scenes"
FOLDER = Path("out/peer_scenes")


def blend(name: str) -> Path:
    """The .blend of one of `MAKERS`, written once for each state of the scripts that it is made by."""
    if str(SCENES) not in sys.path:
        sys.path.insert(0, str(SCENES))
    import builder

    digest = hashlib.sha256(Path(__file__).read_bytes() + (SCENES / "builder.py").read_bytes()).hexdigest()[:12]
    path = FOLDER / f"{name}-{digest}.blend"
    if not path.exists():
        FOLDER.mkdir(parents=True, exist_ok=True)
        scene = builder.new_file(name, 64, 64)
        MAKERS[name](builder, scene)
        builder.save(scene, name, path)
    return path


def bumpy_furnace(builder: Any, scene: Any) -> None:
    """A shining grey room around a ball and over a floor whose normals wave by 17 degrees, as a bump map's would.

    A black sheet lies under the floor: Cycles' light samples pass through a surface whose normals lean over them.
    """
    walls = builder.diffuse("walls", (0.5, 0.5, 0.5))
    _glow(walls, (0.4, 0.5, 0.6))
    builder.block("room", (-2, -2, -1), (2, 2, 2), walls)
    grey = builder.diffuse("grey", (0.7, 0.6, 0.5))
    ball = builder.applied(builder.mesh_sphere("ball", (0, 0, 0), 1.0, 4, grey))
    shown = builder.link(ball, "ball")
    shown.location = (0.2, 0.3, 0.1)
    shown.scale = (0.8, 0.8, 0.8)
    _wave(ball, 8.0)
    n = 16
    points = [(3.0 * (i / n - 0.5), 3.0 * (j / n - 0.5), 0.0) for j in range(n + 1) for i in range(n + 1)]
    corners = [j * (n + 1) + i for j in range(n) for i in range(n)]
    faces = [(k, k + 1, k + n + 2, k + n + 1) for k in corners]
    floor = builder.mesh("floor", points, faces, grey)
    floor.location = (0, 0, -0.9)
    black = builder.diffuse("black", (0, 0, 0))
    builder.mesh(
        "sheet", [(-1.5, -1.5, -0.92), (1.5, -1.5, -0.92), (1.5, 1.5, -0.92), (-1.5, 1.5, -0.92)], [(0, 1, 2, 3)], black
    )
    _wave(floor.data, 5.0)
    builder.camera(scene, (-0.9, -1.8, 1.0), (0.1, 0.2, -0.1), 24.0, 32.0, clip_start=0.05)


def mis_plates(builder: Any, scene: Any) -> None:
    """Veach's plates: four roughnesses from narrow to wide, four spheres of light from small to large."""
    builder.mesh(
        "floor",
        [(-6, -4, -0.4), (6, -4, -0.4), (6, 5, -0.4), (-6, 5, -0.4), (6, 5, 6), (-6, 5, 6)],
        [(0, 1, 2, 3), (3, 2, 4, 5)],
        builder.diffuse("floor", (0.4, 0.4, 0.4)),
    )
    eye, lamps = np.array([0, -5.5, 3.6]), np.array([0, 3.4, 3.4])
    for i, roughness in enumerate([0.2, 0.3, 0.38, 0.46]):
        center = np.array([0, 2.2 - 1.2 * i, 0.9 - 0.3 * i])
        normal = sum((p - center) / np.linalg.norm(p - center) for p in (eye, lamps))  # mirrors the lamps' middle
        up = 0.5 * np.array([0, normal[2], -normal[1]]) / np.linalg.norm(normal)
        side = np.array([2.2, 0, 0])
        corners = [center - side - up, center + side - up, center + side + up, center - side + up]
        builder.mesh(f"plate {i}", corners, [(0, 1, 2, 3)], builder.glossy(f"plate {i}", (0.7, 0.7, 0.7), roughness))
    for i, radius in enumerate([0.08, 0.15, 0.3, 0.6]):
        color = [(1.0, 0.6, 0.4), (0.5, 1.0, 0.5), (0.5, 0.7, 1.0), (1.0, 1.0, 0.7)][i]
        lamp = _lamp(builder, f"lamp {i}", "POINT", (-2.1 + 1.4 * i, 3.4, 3.4), energy=150, color=color)
        lamp.data.shadow_soft_size = radius
        lamp.data.use_soft_falloff = False
        lamp.visible_camera = True
    builder.camera(scene, eye, (0, 1.0, 1.0), 38.0, 32.0, clip_start=0.05)


def thousand_lights(builder: Any, scene: Any) -> None:
    """900 points and 100 small squares of light, all of one power and different colours, over blocks."""
    builder.mesh(
        "floor", [(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0)], [(0, 1, 2, 3)], builder.diffuse("f", (0.6, 0.6, 0.6))
    )
    rng = np.random.default_rng(1)
    red = builder.diffuse("red", (0.7, 0.3, 0.2))
    for i in range(12):
        x, y, h = 3.6 * rng.random() - 1.8, 3.6 * rng.random() - 1.8, 0.2 + 0.5 * rng.random()
        builder.block(f"block {i}", (x - 0.2, y - 0.2, 0), (x + 0.2, y + 0.2, h), red)
    for i in range(1000):
        position = (6 * rng.random() - 3, 6 * rng.random() - 3, 1.2 + rng.random())
        kind = "AREA" if i % 10 == 0 else "POINT"
        lamp = _lamp(builder, f"lamp {i}", kind, position, energy=0.3, color=tuple(0.3 + 0.7 * rng.random(3)))
        if kind == "AREA":
            lamp.data.size = 0.05
        else:
            lamp.data.shadow_soft_size = 0.0
    builder.camera(scene, (-2.5, -4.0, 3.2), (0, 0, 0.2), 35.0, 32.0, clip_start=0.05)


def sun_and_glass(builder: Any, scene: Any) -> None:
    """A low sun of 30 degrees through a glass ball and a rough glass block onto a floor and a wall."""
    white = builder.diffuse("white", (0.7, 0.7, 0.7))
    points = [(-2, -2, 0), (2, -2, 0), (2, 1.2, 0), (-2, 1.2, 0), (2, 1.2, 2), (-2, 1.2, 2)]
    builder.mesh("floor", points, [(0, 1, 2, 3), (3, 2, 4, 5)], white)
    builder.mesh_sphere("ball", (-0.6, 0, 0.6), 0.5, 5, builder.glass("glass", (0.95, 1.0, 0.95), 1.5))
    rough = builder.glass("rough", (1.0, 0.9, 0.8), 1.4)
    rough.node_tree.nodes["Glass BSDF"].inputs["Roughness"].default_value = 0.3
    builder.block("block", (0.4, -0.3, 0.05), (1.0, 0.3, 0.9), rough)
    sun = _lamp(builder, "sun", "SUN", (0, 0, 3), energy=4.0, color=(1.0, 0.9, 0.7))
    sun.data.angle = 0.52
    sun.matrix_world = builder.look_at((-2.0, -2.2, 2.6), (0, 0, 0))
    builder.camera(scene, (0.4, -3.4, 1.6), (0.1, 0.2, 0.5), 32.0, 32.0, clip_start=0.05)


def sky(builder: Any, scene: Any) -> None:
    """Nothing but a blue environment around a box, a mirror ball and a metal ball."""
    builder.set_world(scene, (0.5, 0.7, 1.0))
    white = builder.diffuse("white", (0.7, 0.7, 0.7))
    builder.mesh("floor", [(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], [(0, 1, 2, 3)], white)
    builder.block("box", (-1.0, -0.2, 0), (-0.4, 0.6, 0.9), builder.diffuse("red", (0.7, 0.2, 0.1)))
    builder.mesh_sphere("mirror", (0.2, 0.5, 0.45), 0.45, 5, builder.glossy("mirror", (0.9, 0.9, 0.9), 0.0))
    builder.mesh_sphere("metal", (0.75, -0.35, 0.35), 0.35, 5, builder.glossy("metal", (0.9, 0.7, 0.4), 0.35))
    builder.camera(scene, (0.5, -3.4, 1.7), (0, 0, 0.4), 36.0, 32.0, clip_start=0.05)


def depth_of_field(builder: Any, scene: Any) -> None:
    """A wide lens that focuses on a block before a small bright ball, which lights floor and wall out of focus."""
    grey = builder.diffuse("grey", (0.5, 0.5, 0.5))
    points = [(-3, -3, 0), (3, -3, 0), (3, 3, 0), (-3, 3, 0), (3, 3, 3), (-3, 3, 3)]
    builder.mesh("floor", points, [(0, 1, 2, 3), (3, 2, 4, 5)], grey)
    builder.block("block", (-0.8, -0.5, 0), (-0.2, 0.1, 0.6), builder.diffuse("green", (0.2, 0.6, 0.3)))
    ball = builder.mesh_sphere("ball", (0.6, 1.6, 1.6), 0.15, 3, builder.diffuse("glow", (0, 0, 0)))
    _emission(ball.data.materials[0], (60.0, 50.0, 40.0))
    camera = builder.camera(scene, (0, -3.2, 1.1), (0, 0, 0.7), 35.0, 32.0, clip_start=0.05)
    camera.data.dof.use_dof = True
    camera.data.dof.focus_distance = 3.0
    camera.data.dof.aperture_fstop = 0.06


def scaled_emitters(builder: Any, scene: Any) -> None:
    """Shining meshes with vertex normals, mirrored and stretched by their objects; a smooth surface mirrored too."""
    grey = builder.diffuse("grey", (0.6, 0.6, 0.6))
    points = [(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0), (2, 2, 2), (-2, 2, 2)]
    builder.mesh("floor", points, [(0, 1, 2, 3), (3, 2, 4, 5)], grey)
    for name, color, position, scale in (
        ("mirrored", (4.0, 2.0, 1.0), (-0.7, 0.6, 1.0), (-0.3, 0.5, 0.2)),
        ("turned inside out", (1.0, 2.0, 4.0), (0.8, 0.3, 0.9), (-0.2, -0.4, -0.3)),
    ):
        ball = builder.mesh_sphere(name, position, 1.0, 2, builder.diffuse(name, (0, 0, 0)))
        ball.scale = scale
        _emission(ball.data.materials[0], color)
    bowl = builder.mesh(
        "bowl",
        [(-1, -1, 0.3), (1, -1, 0), (1, 1, 0.3), (-1, 1, 0)],
        [(0, 1, 2), (0, 2, 3)],
        builder.diffuse("b", (0, 0, 0)),
    )
    bowl.data.polygons.foreach_set("use_smooth", [True] * 2)
    bowl.location, bowl.scale = (0.0, -0.6, 1.3), (0.3, -0.2, 0.5)
    _emission(bowl.data.materials[0], (3.0, 3.0, 3.0))
    ball = builder.mesh_sphere("ball", (0.1, 0.2, 0.3), 1.0, 4, builder.diffuse("red", (0.7, 0.3, 0.3)))
    ball.scale = (0.5, -0.3, 0.3)
    builder.camera(scene, (0.3, -3.4, 1.9), (0, 0.2, 0.6), 34.0, 32.0, clip_start=0.05)


def glass_window(builder: Any, scene: Any) -> None:
    """Inside a room whose one window is closed by a glass pane; all light comes through it from a panel outside."""
    white = builder.diffuse("white", (0.75, 0.75, 0.7))
    builder.block("floor", (-2, -2, -0.1), (2, 2, 0), builder.diffuse("floor", (0.5, 0.4, 0.3)))
    builder.block("ceiling", (-2, -2, 2.4), (2, 2, 2.5), white)
    for name, low, high in (
        ("right", (2, -2, 0), (2.1, 2, 2.4)),
        ("front", (-2, -2.1, 0), (2, -2, 2.4)),
        ("back", (-2, 2, 0), (2, 2.1, 2.4)),
        ("left below", (-2.1, -2, 0), (-2, 2, 0.8)),
        ("left above", (-2.1, -2, 2.0), (-2, 2, 2.4)),
        ("left before", (-2.1, -2, 0.8), (-2, -0.6, 2.0)),
        ("left behind", (-2.1, 1.2, 0.8), (-2, 2, 2.0)),
    ):
        builder.block(name, low, high, white)
    builder.block("pane", (-2.06, -0.62, 0.78), (-2.04, 1.22, 2.02), builder.glass("glass", (1.0, 1.0, 1.0), 1.5))
    builder.block("table", (-0.9, -0.2, 0), (0.1, 0.8, 0.7), builder.diffuse("red", (0.6, 0.2, 0.15)))
    builder.area_lamp("panel", (4.0, 4.5, 5.0), (4.0, 3.0), (-2.4, 0.3, 1.4), (0, 0.3, 1.4))
    builder.camera(scene, (1.7, -1.7, 1.6), (-1.0, 0.6, 0.9), 20.0, 32.0, clip_start=0.05)


MAKERS: dict[str, Callable[[Any, Any], None]] = {
    maker.__name__: maker
    for maker in (
        bumpy_furnace,
        mis_plates,
        thousand_lights,
        sun_and_glass,
        sky,
        depth_of_field,
        scaled_emitters,
        glass_window,
    )
}


def _lamp(builder: Any, name: str, kind: str, position: Any, energy: float, color: Any) -> Any:
    """A lamp that the camera does not see."""
    import bpy

    data = bpy.data.lights.new(name, kind)
    data.energy, data.color = energy, color
    shown = builder.link(data, name)
    shown.location = position
    shown.visible_camera = False
    return shown


def _glow(material: Any, color: Any) -> None:
    """Adds emission to what a material scatters."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    output = next(node for node in nodes if node.bl_idname == "ShaderNodeOutputMaterial")
    scatter = output.inputs["Surface"].links[0].from_socket
    emission, both = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeAddShader")
    emission.inputs["Color"].default_value = (*color, 1.0)
    links.new(scatter, both.inputs[0])
    links.new(emission.outputs[0], both.inputs[1])
    links.new(both.outputs[0], output.inputs["Surface"])


def _emission(material: Any, color: Any) -> None:
    """Emission of this radiance in place of what a material scatters."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    output = next(node for node in nodes if node.bl_idname == "ShaderNodeOutputMaterial")
    emission = nodes.new("ShaderNodeEmission")
    strength = max(color)
    emission.inputs["Color"].default_value = (*(c / strength for c in color), 1.0)
    emission.inputs["Strength"].default_value = strength
    links.new(emission.outputs[0], output.inputs["Surface"])


def _wave(mesh: Any, frequency: float) -> None:
    """Vertex normals that wave around the mesh's own."""
    points = np.array([vertex.co[:] for vertex in mesh.vertices])
    normals = np.array([vertex.normal[:] for vertex in mesh.vertices])
    normals = normals + 0.3 * np.sin(frequency * points[:, [1, 2, 0]] + [0.0, 1.0, 2.0]) * np.sin(
        pi * points[:, [2, 0, 1]] + 1
    )
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    mesh.normals_split_custom_set_from_vertices((normals / np.linalg.norm(normals, axis=1, keepdims=True)).tolist())

"""Small helpers that the scene scripts share: an empty file, meshes, spheres, materials, lamps, cameras, saving.

Every scene script is run with the Python that has bpy 4.5, so that Blender 4.5 and later open the file:
    python scenes/cornell_box.py
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Vector

HERE = Path(__file__).resolve().parent
ENGINE = "VLP_BPT"
Rgb = tuple[float, float, float]
Point = Sequence[float]


def new_file(name: str, width: int, height: int) -> bpy.types.Scene:
    """Empty Blender and return its scene, set up for linear pixels shown as plain sRGB."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.name = name
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.render.filepath = f"//{name}_"
    scene.render.image_settings.file_format = "PNG"
    scene.view_settings.view_transform = "Standard"
    scene.view_settings.look = "None"
    scene.cycles.pixel_filter_type = "BLACKMAN_HARRIS"
    scene.cycles.filter_width = 1.5
    set_world(scene, (0.0, 0.0, 0.0))
    return scene


def set_world(scene: bpy.types.Scene, radiance: Rgb) -> None:
    """A world of constant radiance."""
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    world.color = radiance
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*radiance, 1.0)
    background.inputs["Strength"].default_value = 1.0
    scene.world = world


def _material(name: str, bsdf: str, color: Rgb, inputs: dict[str, float], distribution: str) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    material.diffuse_color = (*color, 1.0)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output, shader = nodes.new("ShaderNodeOutputMaterial"), nodes.new(bsdf)
    shader.location = (-220, 0)
    shader.inputs["Color"].default_value = (*color, 1.0)
    for key, value in inputs.items():
        shader.inputs[key].default_value = value
    if distribution:
        shader.distribution = distribution
    links.new(shader.outputs[0], output.inputs["Surface"])
    return material


def diffuse(name: str, color: Rgb) -> bpy.types.Material:
    """Lambertian reflection."""
    return _material(name, "ShaderNodeBsdfDiffuse", color, {"Roughness": 0.0}, "")


def glossy(name: str, color: Rgb, roughness: float) -> bpy.types.Material:
    """Single-scattering GGX reflection of constant colour; a mirror at roughness 0."""
    return _material(name, "ShaderNodeBsdfAnisotropic", color, {"Roughness": roughness}, "GGX")


def glass(name: str, color: Rgb, ior: float) -> bpy.types.Material:
    """Smooth dielectric."""
    return _material(name, "ShaderNodeBsdfGlass", color, {"Roughness": 0.0, "IOR": ior}, "GGX")


def link(data: bpy.types.ID | None, name: str) -> bpy.types.Object:
    """A new object in the scene's collection."""
    obj = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def mesh(
    name: str, points: Iterable[Point], faces: Iterable[Sequence[int]], material: bpy.types.Material
) -> bpy.types.Object:
    """A flat-shaded mesh object."""
    data = bpy.data.meshes.new(name)
    data.from_pydata([tuple(p) for p in points], [], [tuple(f) for f in faces])
    if data.validate():
        raise ValueError(f"mesh '{name}' is not valid")
    data.materials.append(material)
    return link(data, name)


def block(name: str, low: Point, high: Point, material: bpy.types.Material) -> bpy.types.Object:
    """An axis-aligned box with outward normals."""
    corners = [[(low, high)[i >> a & 1][a] for a in range(3)] for i in range(8)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return mesh(name, corners, faces, material)


def mesh_sphere(name: str, center: Point, radius: float, levels: int, material: bpy.types.Material) -> bpy.types.Object:
    """A smooth sphere by modifiers: a cube subdivided `levels` times (6 * 4**levels quads) and cast to a sphere."""
    obj = block(name, (-1, -1, -1), (1, 1, 1), material)
    obj.data.polygons.foreach_set("use_smooth", [True] * 6)
    subdivide = obj.modifiers.new("Subdivide", "SUBSURF")
    subdivide.levels = subdivide.render_levels = levels
    cast = obj.modifiers.new("Sphere", "CAST")
    cast.cast_type, cast.factor, cast.size, cast.use_radius_as_size = "SPHERE", 1.0, 1.0, False
    obj.location, obj.scale = center, (radius,) * 3
    return obj


def applied(obj: bpy.types.Object) -> bpy.types.Mesh:
    """The mesh that the object's modifiers make; the object itself is removed."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    data = bpy.data.meshes.new_from_object(obj.evaluated_get(depsgraph), depsgraph=depsgraph)
    source, data.name = obj.data, obj.name
    bpy.data.objects.remove(obj)
    bpy.data.meshes.remove(source)
    return data


def spheres(name: str, centers: np.ndarray, radii: np.ndarray, material: bpy.types.Material) -> bpy.types.Object:
    """A point cloud object, each point a sphere; centers (n, 3) and radii (n,).

    Blender 4.5 has no call that sets the number of points, but it converts a mesh of loose vertices.
    """
    data = bpy.data.meshes.new(name)
    data.from_pydata(np.asarray(centers).tolist(), [], [])
    obj = link(data, name)
    bpy.ops.object.select_all(action="DESELECT")
    obj.select_set(True)
    bpy.context.view_layer.objects.active = obj
    bpy.ops.object.convert(target="POINTCLOUD")
    bpy.data.meshes.remove(data)
    cloud = obj.data
    cloud.name = name
    for attribute in [a for a in cloud.attributes if a.name.startswith(".select")]:
        cloud.attributes.remove(attribute)
    radius = cloud.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.asarray(radii, np.float32))
    cloud.materials.append(material)
    return obj


def area_lamp(name: str, radiance: Rgb, size: tuple[float, float], position: Point, target: Point) -> bpy.types.Object:
    """A rectangular Lambertian lamp of the given radiance, seen by the camera, that shines from position to target.

    Blender's area lamps emit color * energy / (pi * area).
    """
    light = bpy.data.lights.new(name, "AREA")
    light.shape, light.size, light.size_y = "RECTANGLE", size[0], size[1]
    strength = max(radiance)
    light.color = tuple(c / strength for c in radiance)
    light.energy = strength * np.pi * size[0] * size[1]
    obj = link(light, name)
    obj.matrix_world = look_at(position, target)
    obj.visible_camera = True
    return obj


def look_at(position: Point, target: Point) -> Matrix:
    """The placement of a camera or lamp that looks along -z from position to target, with z of the world up."""
    direction = Vector(target) - Vector(position)
    return Matrix.Translation(Vector(position)) @ direction.to_track_quat("-Z", "Y").to_matrix().to_4x4()


def camera(
    scene: bpy.types.Scene, position: Point, target: Point, lens: float, sensor: float, clip_start: float
) -> bpy.types.Object:
    """A pinhole camera; lens and sensor width in millimetres."""
    data = bpy.data.cameras.new("Camera")
    data.lens, data.sensor_width, data.sensor_fit = lens, sensor, "HORIZONTAL"
    data.clip_start = clip_start
    obj = link(data, "Camera")
    obj.matrix_world = look_at(position, target)
    scene.camera = obj
    return obj


class _StandIn(bpy.types.RenderEngine):
    """Lets Blender accept the engine's name while the add-on is not installed."""

    bl_idname = ENGINE
    bl_label = "VLP-BPT"


def save(scene: bpy.types.Scene, name: str, path: Path | None = None) -> Path:
    """Choose the engine and write `path`, compressed; without a path, `scenes/NAME.blend`."""
    try:
        scene.render.engine = ENGINE
    except TypeError:
        bpy.utils.register_class(_StandIn)
        scene.render.engine = ENGINE
    for space in (s for screen in bpy.data.screens for area in screen.areas for s in area.spaces):
        if space.type == "FILE_BROWSER" and space.params:
            space.params.directory = b"//"  # not the home directory of whoever made the file
    path = path.resolve() if path else HERE / f"{name}.blend"
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
    print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")
    return path

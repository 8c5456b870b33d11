"""Hands a validated scene to the native core: the only place that knows the core's calls for geometry and lights."""

from __future__ import annotations

from typing import Any

import numpy as np

from .changes import Changes
from .errors import SceneError
from .scene import AreaLight, Camera, Film, Float32, Light, Material, Mesh, PointLight, Scene, Spheres, SpotLight, World


def upload(scene: Scene, native_scene: Any) -> None:
    """Fills an empty native scene; `scene` must have passed `validate`. Geometries without primitives are left out."""
    geometries = [_add_geometry(geometry, native_scene) for geometry in scene.geometries]
    for material in scene.materials:
        _add_material(material, native_scene)
    for instance in scene.instances:
        geometry = geometries[instance.geometry]
        if geometry is not None:
            materials = np.asarray(instance.materials, dtype=np.int32)
            native_scene.add_instance(geometry, instance.transform, materials, int(instance.visibility))
    for light in scene.lights:
        _add_light(light, native_scene)
    _set_world(scene.world, native_scene)
    _set_view(scene, native_scene)


def upload_changes(scene: Scene, changed: Changes, native_scene: Any) -> None:
    """Makes a built native scene hold `scene`, whose geometry is the same or moved; it must be built again."""
    native_scene.reopen(changed.materials, changed.lamps, changed.world)
    _move(scene, changed, native_scene)
    if changed.materials:
        for material in scene.materials:
            _add_material(material, native_scene)
    if changed.lamps:
        for light in scene.lights:
            _add_light(light, native_scene)
    if changed.world:
        _set_world(scene.world, native_scene)
    _set_view(scene, native_scene)


def _move(scene: Scene, changed: Changes, native_scene: Any) -> None:
    """Those without primitives were left out: the native scene counts without them."""
    if not (changed.moved_geometries or changed.moved_instances):
        return
    there = [_primitives(geometry) > 0 for geometry in scene.geometries]
    placed = [there[instance.geometry] for instance in scene.instances]
    index, place = np.cumsum(there) - 1, np.cumsum(placed) - 1
    for i in changed.moved_geometries:
        if there[i]:
            _move_geometry(scene.geometries[i], int(index[i]), native_scene)
    for i in changed.moved_instances:
        if placed[i]:
            native_scene.move_instance(int(place[i]), scene.instances[i].transform)


def _primitives(geometry: Mesh | Spheres) -> int:
    return len(geometry.centers if isinstance(geometry, Spheres) else geometry.triangles)


def _set_view(scene: Scene, native_scene: Any) -> None:
    if scene.camera is None:
        raise SceneError("scene: has no camera")
    _set_camera(scene.camera, native_scene)
    _set_film(scene.film, native_scene)


def _set_world(world: World, native_scene: Any) -> None:
    if world.image is None or max(world.radiance) == 0:
        native_scene.set_world(_rgb(world.radiance))
    else:
        texels = world.image * np.asarray(world.radiance, dtype=np.float32)
        native_scene.set_world_image(np.ascontiguousarray(texels), np.ascontiguousarray(world.rotation))


def _rgb(color: tuple[float, float, float]) -> tuple[float, float, float]:
    r, g, b = color
    return float(r), float(g), float(b)


def _add_geometry(geometry: Mesh | Spheres, native_scene: Any) -> int | None:
    if _primitives(geometry) == 0:
        return None
    if isinstance(geometry, Spheres):
        return int(native_scene.add_spheres(geometry.centers, geometry.radii, geometry.material_index))
    uvs = next(iter(geometry.uvs.values()), None)
    args = (geometry.positions, geometry.triangles, geometry.corner_normals, uvs, geometry.material_index)
    return int(native_scene.add_mesh(*args))


def _move_geometry(geometry: Mesh | Spheres, index: int, native_scene: Any) -> None:
    if isinstance(geometry, Spheres):
        native_scene.move_spheres(index, geometry.centers, geometry.radii, geometry.material_index)
    else:
        uvs = next(iter(geometry.uvs.values()), None)
        native_scene.move_mesh(index, geometry.positions, geometry.corner_normals, uvs, geometry.material_index)


def _add_material(material: Material, native_scene: Any) -> None:
    lobes = material.lobes

    def numbers(name: str) -> Float32:
        return np.array([getattr(lobe, name) for lobe in lobes], dtype=np.float32)

    def colors(name: str) -> Float32:
        return numbers(name).reshape(len(lobes), 3)

    def integers(name: str) -> Any:
        return np.array([int(getattr(lobe, name)) for lobe in lobes], dtype=np.int32)

    native_scene.add_material(
        integers("kind"),
        integers("fresnel"),
        colors("weight"),
        numbers("roughness"),
        numbers("ior"),
        colors("f0"),
        colors("f82"),
        integers("layered_under"),
        integers("compensate"),
        _rgb(material.emission),
    )


def _add_light(light: Light, native_scene: Any) -> None:
    visibility = int(light.visibility)
    if isinstance(light, PointLight):
        native_scene.add_point_light(_rgb(light.position), _rgb(light.power), float(light.radius), visibility)
    elif isinstance(light, SpotLight):
        cone = float(light.spot_size), float(light.blend)
        native_scene.add_spot_light(light.transform, _rgb(light.power), *cone, float(light.radius), visibility)
    elif isinstance(light, AreaLight):
        size = float(light.size[0]), float(light.size[1])
        shape = bool(light.ellipse), float(light.spread)
        native_scene.add_area_light(light.transform, _rgb(light.power), *size, *shape, visibility)
    else:
        native_scene.add_sun_light(light.transform, _rgb(light.irradiance), float(light.angle), visibility)


def _set_camera(camera: Camera, native_scene: Any) -> None:
    transform = camera.transform.astype(np.float64)
    transform[:, :3] /= np.linalg.norm(transform[:, :3], axis=0)  # Blender's cameras ignore scale
    native_scene.set_camera(
        transform.astype(np.float32),
        int(camera.projection),
        float(camera.half_width),
        float(camera.half_height),
        float(camera.shift[0]),
        float(camera.shift[1]),
        float(camera.clip_start),
        float(camera.clip_end),
        float(camera.aperture_radius),
        float(camera.focus_distance),
    )


def _set_film(film: Film, native_scene: Any) -> None:
    native_scene.set_film(film.width, film.height, *film.render_window, bool(film.transparent))
